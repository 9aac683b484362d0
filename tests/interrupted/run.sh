#!/bin/bash
# Renders that are killed (SIGKILL) at random moments and gone on with: the picture must be the one of a render that was
# left alone, bit for bit. Also: a full disk and a folder that cannot be written to. By hand:
#   bash tests/interrupted/run.sh [KILLS]
set -u
cd "$(dirname "$0")/../.." || exit 1
cargo build --release --quiet || exit 1
luxel=$PWD/target/release/luxel
kills=${1:-50}
folder=$(mktemp -d)
trap 'rm -rf "$folder"; mountpoint -q "$folder.full" && umount "$folder.full"; rmdir "$folder.full" 2>/dev/null' EXIT
cd "$folder" || exit 1
faults=0
fault() { echo "FAULT: $*"; faults=$((faults + 1)); }

# Seconds of sleep from 0.05 to $1.
moment() { awk -v r="$RANDOM" -v most="$1" 'BEGIN { print 0.05 + r / 32768 * (most - 0.05) }'; }

for way in "path --spp 400" "vcm --spp 60" "sppm --spp 60" "combined --spp 60" "path --target-error 12%"; do
    # shellcheck disable=SC2086
    set -- --resolution 120x90 --integrator $way --progress never
    begin=$(date +%s.%N)
    "$luxel" render "$@" -o whole.pfm 2>whole.log || fault "$way: $(cat whole.log)"
    took=$(echo "$(date +%s.%N) $begin" | awk '{ print $1 - $2 }')
    killed=0
    resumed=0
    rm -f part.*
    while [ "$killed" -lt $((kills / 5)) ]; do
        "$luxel" render "$@" -o part.pfm --resume --checkpoint 50ms 2>part.log &
        render=$!
        sleep "$(moment "$took")"
        if kill -KILL "$render" 2>/dev/null; then
            killed=$((killed + 1))
        fi
        wait "$render" 2>/dev/null && rm -f part.*
        [ -e part.checkpoint.exr ] && resumed=$((resumed + 1))
    done
    "$luxel" render "$@" -o part.pfm --resume --checkpoint 50ms 2>part.log || fault "$way: $(cat part.log)"
    cmp -s whole.pfm part.pfm || fault "$way: the picture differs after $killed kills"
    [ -e part.checkpoint.exr ] && fault "$way: the checkpoint is left"
    compgen -G '.luxel-*.tmp' && fault "$way: what was half written is left"
    echo "$way: killed $killed times, a checkpoint was there $resumed times"
done

# A folder that takes nothing, and one that is full: where the system lets us make them.
set -- --resolution 120x90 --spp 40 --progress never
if "$luxel" render "$@" -o /proc/picture.exr 2>log; then
    fault "wrote to /proc"
fi
cat log
mkdir "$folder.full"
if mount -t tmpfs -o size=64k tmpfs "$folder.full" 2>/dev/null; then
    "$luxel" render "$@" -o "$folder.full/a.exr" --checkpoint 1ms 2>log
    code=$?
    [ "$code" = 3 ] || fault "a full disk: exit code $code"
    grep -q "the disk is full" log || fault "a full disk is not told"
    cat log
    umount "$folder.full"
else
    echo "no tmpfs can be mounted here: the full disk is left out"
fi
[ "$faults" = 0 ] && echo "all is well"
exit "$faults"
