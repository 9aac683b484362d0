#!/bin/sh
# Opens a report of `luxel study` in a real Chromium without a window, and checks that it works: no errors, marks for
# all settings, the divider and the plots by keyboard, nothing asked of the network. Not a part of `cargo test`.
#
#   sh tests/report_in_browser.sh [REPORT.html] [FOLDER FOR SCREENSHOTS]
#
# Without a report it makes one of scenes/studies/samplers.xml by the program that cargo built. On Debian, as root, it
# installs Chromium; elsewhere, without it, it says that it skips and ends well.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
if ! command -v chromedriver >/dev/null || ! command -v chromium >/dev/null; then
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        apt-get install -y --no-install-recommends chromium chromium-driver >/dev/null || true
    fi
fi
for program in chromium chromedriver python3; do
    if ! command -v "$program" >/dev/null; then
        echo "skipped: there is no $program here (Debian: chromium, chromium-driver, python3)"
        exit 0
    fi
done
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
report=${1:-}
if [ -z "$report" ]; then
    "$here/../target/release/luxel" study "$here/../scenes/studies/samplers.xml" -o "$scratch/study" \
        --vary sampler=independent,sobol --spp 1..16 --runs 4 --reference-time 5s
    report=$scratch/study/report.html
fi
python3 "$here/browser/report.py" "$report" "${2:-$scratch}"
