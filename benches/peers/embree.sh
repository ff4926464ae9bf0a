#!/bin/sh
# Embree 4 and sampler-lab in turn on the same triangles and rays; see README.md in this folder.
# usage: embree.sh [WORK_FOLDER [--scene 200k|3200k] [--rounds N] [--threads N,N]]
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=${1:-"$here/../../target/peers"}
[ $# -gt 0 ] && shift
mkdir -p "$work/embree"
work=$(cd "$work" && pwd)
# The library is all that is wanted of the wheel.
library() { find "$work/embree/wheel" -name 'libembree4*.so*' 2>/dev/null | head -n 1; }
if [ -z "$(library)" ]; then
    python3 -m pip download --quiet --no-deps --only-binary :all: --dest "$work/embree" 'embreex==4.4.*'
    python3 -m zipfile -e "$work"/embree/embreex-*.whl "$work/embree/wheel"
fi
EMBREE_LIBRARY=$(library)
export EMBREE_LIBRARY
# The packages of the main program, in the same versions.
cp "$here/../../Cargo.lock" "$here/embree/Cargo.lock"
cargo build --release --quiet --manifest-path "$here/embree/Cargo.toml" --target-dir "$work/embree/target"
exec "$work/embree/target/release/embree-peer" "$@"
