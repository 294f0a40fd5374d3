#!/usr/bin/env bash
# Draws the pictures of docs/gallery.md and the README from the sample patterns: docs/gallery.sh [PROGRAM]
# PROGRAM is a built knotmesh; without one, it is built. Any Vulkan driver will do, a software one too.
set -euo pipefail
cd "$(dirname "$0")/.."
knotmesh=${1:-}
if [ -z "$knotmesh" ]; then
    cargo build --release --quiet
    knotmesh=target/release/knotmesh
fi
out=docs/gallery
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"

draw() { # NAME INPUT OPTIONS...
    local name=$1
    shift
    "$knotmesh" render "$@" --width 720 --height 540 --samples 8 -o "$out/$name.png"
    # One frame of several has its number in its name.
    for numbered in "$out/$name".*.png; do
        [ ! -e "$numbered" ] || mv "$numbered" "$out/$name.png"
    done
    echo "$out/$name.png"
}

# A swatch stretched and sheared as in figures 9 and 18 of Huang et al. 2025: every point interpolated, and relaxed.
for motion in stretch shear; do
    "$knotmesh" drape stitches/swatch.smobj --scene stitches/scenes/patch-$motion.json -o "$work/$motion.npy"
    for mode in embed relax; do
        draw $motion-$mode stitches/swatch.smobj --frames "$work/$motion.npy" --frame-range -1: --mode $mode \
            --camera front --zoom 2.5 --colour '#4a7aa6'
    done
    draw $motion-tension stitches/swatch.smobj --frames "$work/$motion.npy" --frame-range -1: --style tension \
        --camera front --zoom 1.2
done

# Swatches. Stockinette shows V's on the front, garter ridges on both sides.
draw stockinette stitches/stockinette.knit --camera front --zoom 2.2
draw stockinette-back stitches/stockinette.knit --camera back --zoom 2.2
draw garter stitches/garter.knit --camera front --zoom 2 --colour '#dea84a'
draw rib stitches/rib-2x2.knit --camera 15,10 --zoom 2 --colour '#6a9860'
draw lace stitches/openwork-lace.knit --camera front --colour '#e2d6c4' --background '#5c6672,#3a4048'
draw flame stitches/flame-chevron.knit --camera front --colour '#92689e'
draw fair-isle stitches/fair-isle.png --camera front --zoom 1.5
draw decreases stitches/lace.smobj --camera 12,12 --zoom 4.5 --colour '#ce828a'
draw types stitches/lace.smobj --style type

# Garments.
draw hat stitches/hat.knit --colour '#486898'
# The sock is pulled over a foot, where its heel is one.
"$knotmesh" knit stitches/sock.knit -o "$work/sock.smobj"
"$knotmesh" drape "$work/sock.smobj" --scene stitches/scenes/sock.json --frame-range 0:21 -o "$work/sock.npy"
draw sock "$work/sock.smobj" --frames "$work/sock.npy" --frame-range -1: --fold-ribs --camera 70,10 --colour '#6a9860'
draw mitten stitches/mitten.knit --colour '#c4544c'
# The sweater is worn: its scene's body, a second after it was put on.
"$knotmesh" knit stitches/raglan-sweater.knit --relax -o "$work/sweater.smobj"
"$knotmesh" drape "$work/sweater.smobj" --scene stitches/scenes/sweater.json --frame-range 0:31 -o "$work/sweater.npy"
draw sweater "$work/sweater.smobj" --frames "$work/sweater.npy" --frame-range -1: --fold-ribs --colour '#dea84a'
