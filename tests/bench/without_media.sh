#!/bin/sh
# What the code for media costs a scene that has none: instructions per ray of bench/surface_only by this build and by one that leaves that
# code out (`--cfg resolvent_surfaces_only`, see `WITH_MEDIA` in core/api/src/vertex.rs), counted by valgrind, which no other load on the
# machine disturbs. Both must render the same picture. Start-up cancels: it is the difference of two runs that counts.
# Needs valgrind. Ends with an error if the cost is above 2 %.
set -eu
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cargo build --release -q
RUSTFLAGS="--cfg resolvent_surfaces_only" cargo build --release -q --target-dir target/without-media \
    -p resolvent-cli --no-default-features -p resolvent-integrator-pt -p resolvent-bsdf-diffuse

# instructions BINARY SPP: prints the count, leaves picture and stats in $work
instructions() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$1" render scenes/bench/surface_only.json --resolution 40x40 \
        --spp "$2" --threads 1 --quiet -o "$work/picture-$3.exr" --stats "$work/stats.json" 2>&1 |
        sed -n 's/.*Collected : \([0-9]*\).*/\1/p'
}
rays() {
    python3 -c "import json; c = json.load(open('$work/stats.json'))['counts']; print(c['rays'] + c['shadow_rays'])"
}
per_ray() {
    a=$(instructions "$1" 16 "$2"); r=$(rays)
    b=$(instructions "$1" 48 "$2"); s=$(rays)
    python3 -c "print(($b - $a) / ($s - $r))"
}
with=$(per_ray target/release/resolvent with)
without=$(per_ray target/without-media/release/resolvent without)
cmp "$work/picture-with.exr" "$work/picture-without.exr" 2>/dev/null ||
    target/release/resolvent compare "$work/picture-with.exr" "$work/picture-without.exr" | grep -q '^MSE  *0\.0*e0$'
python3 - "$with" "$without" <<'END'
import sys
a, b = map(float, sys.argv[1:])
print(f"instructions per ray: {a:.1f} with the code for media, {b:.1f} without: {100 * (a / b - 1):+.2f} %")
sys.exit(a / b > 1.02)
END
