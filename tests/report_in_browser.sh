#!/bin/sh
# Opens a report of `luxel study` in a real Chromium and a real Firefox without windows, light and dark, and checks that
# it works: no errors, marks for all settings, the divider and the plots by keyboard, nothing asked of the network. Not a
# part of `cargo test`.
#
#   sh tests/report_in_browser.sh [REPORT.html] [FOLDER FOR SCREENSHOTS]
#
# Without a report it makes one of scenes/studies/samplers.xml by the program that cargo built. On Debian, as root, it
# installs the browsers; elsewhere it takes those that are there, and without any it says that it skips and ends well.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
has() { command -v "$1" >/dev/null; }
if has apt-get && [ "$(id -u)" = 0 ]; then
    has chromium && has chromedriver || apt-get install -y --no-install-recommends chromium chromium-driver >/dev/null || true
    has firefox-esr || apt-get install -y --no-install-recommends firefox-esr >/dev/null || true
fi
if ! has python3 || ! { has chromium && has chromedriver || has firefox-esr; }; then
    echo "skipped: there is no python3, or neither chromium with chromedriver nor firefox-esr (names of Debian)"
    exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
report=${1:-}
if [ -z "$report" ]; then
    "$here/../target/release/luxel" study "$here/../scenes/studies/samplers.xml" -o "$scratch/study" \
        --vary sampler=independent,sobol --spp 1..16 --runs 4 --reference-time 5s
    report=$scratch/study/report.html
fi
PYTHONDONTWRITEBYTECODE=1 python3 "$here/browser/report.py" "$report" "${2:-$scratch}"
