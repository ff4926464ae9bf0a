#!/bin/sh
# Mitsuba 3 and sampler-lab in turn on the same scenes; see README.md in this folder.
# usage: run.sh [WORK_FOLDER [options of mitsuba_peer.py]]
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
work=${1:-"$root/target/peers"}
[ $# -gt 0 ] && shift
mkdir -p "$work"
binary=${SAMPLER_LAB:-"$root/target/release/sampler-lab"}
[ -n "${SAMPLER_LAB:-}" ] || cargo build --release --quiet --manifest-path "$root/Cargo.toml"
[ -x "$work/venv/bin/python" ] || python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet mitsuba numpy
"$binary" bench --write-scenes "$work/scenes" --quiet

# The variant llvm_ad_rgb compiles with the system's LLVM, which has to be new enough (15 is too old for Mitsuba 3.9). Where there
# is none: `apt-get download libllvm19`, unpack it with `dpkg -x` and name the library in DRJIT_LIBLLVM_PATH.
variant=llvm_ad_rgb
if ! (cd "$here" && "$work/venv/bin/python" -B probe.py) >"$work/probe.log" 2>&1; then
    echo "Mitsuba's llvm_ad_rgb does not work here ($work/probe.log): scalar_rgb, which is many times slower" >&2
    variant=scalar_rgb
fi
cd "$here" && exec "$work/venv/bin/python" -B mitsuba_peer.py --binary "$binary" --scenes "$work/scenes" --work "$work/mitsuba" \
    --variant "$variant" --points "$work/points.json" "$@"
