#!/bin/sh
# What does a scene pay for the features that it lacks? The renderer is built with all of them, and once without each (the loop
# of src/render/lanes.rs, `--cfg without="lens"` and so on); scenes without the feature are rendered by both, in turn, in one thread.
# Prints a table: the median over rounds of the ratio of seconds, its middle half, and whether the images have the same bits.
# usage: features.sh [WORK_FOLDER [ROUNDS]]
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
work=${1:-"$root/target/features"}
rounds=${2:-15}
mkdir -p "$work/crate/src"

# A crate of the modules that render: it builds in a fraction of the time of the whole.
for part in accel error.rs film film.rs mutants.rs render sampling scene; do ln -sfn "$root/src/$part" "$work/crate/src/$part"; done
cp "$root/benches/features/render.rs" "$work/crate/src/main.rs"
cp "$root/Cargo.lock" "$work/crate/Cargo.lock"
{
    printf '[package]\nname = "features"\nversion = "0.0.0"\nedition = "2024"\n[features]\nmutants = []\n[workspace]\n[dependencies]\n'
    grep -E '^(exr|glam|image|libm|miniz_oxide|obvhs|rayon|serde|serde_json|sha2|tobj) = ' "$root/Cargo.toml"
    printf '[lints.rust]\nunused = "allow"\n'
    grep '^unexpected_cfgs' "$root/Cargo.toml"
    printf '[profile.release]\nlto = "thin"\ncodegen-units = 4\n'
} >"$work/crate/Cargo.toml"

# build NAME [FLAGS]: a wrapper of the compiler hands the flags to this crate alone, so that its dependencies are built once.
build() {
    name=$1
    shift
    printf '#!/bin/sh\nexec "$@" %s\n' "$*" >"$work/$name.sh"
    chmod +x "$work/$name.sh"
    RUSTC_WORKSPACE_WRAPPER="$work/$name.sh" CARGO_TARGET_DIR="$work/target" \
        cargo build --release --quiet --manifest-path "$work/crate/Cargo.toml"
    cp "$work/target/release/features" "$work/$name"
}
build all
for feature in pixel lens lights textures; do build "$feature" "--cfg 'without=\"$feature\"'"; done

echo "| scene without | built without it | seconds | seconds of the build that has it | ratio (middle half) | bits |"
echo "|---|---|---|---|---|---|"
row() { # FEATURE STAGE WHAT
    for _ in $(seq "$rounds"); do
        printf '%s %s\n' "$("$work/all" "$root/configs/cornell.json" "$root/data" 16 "$2")" \
            "$("$work/$1" "$root/configs/cornell.json" "$root/data" 16 "$2")"
    done | awk '{ print $1 / $3, $1, $3, $2 == $4 }' | sort -n | awk -v what="$3" -v feature="$1" '
        { ratio[NR] = $1; all[NR] = $2; without[NR] = $3; same += $4 }
        function at(part) { return ratio[1 + int(part * (NR - 1) + 0.5)] }
        function least(of,  i, m) { m = of[1]; for (i in of) if (of[i] < m) m = of[i]; return m }
        END {
            printf "| %s | %s | %.3f | %.3f | %.3f (%.3f to %.3f) | %s |\n", what, feature, least(without), least(all), at(0.5), at(0.25),
                at(0.75), same == NR ? "the same" : "DIFFERENT"
        }'
}
row lens final "a lens: Cornell box, pinhole"
row lights final "lights other than one parallelogram: the same"
row textures final "textures: the same"
row pixel start "a sampled place in the pixel: the same, stage start"
