#!/bin/sh
# Makes the README's picture (needs python3 with numpy and Pillow): sh docs/picture.sh [OUT.png]
# Above: stitches/lace.smobj and stitches/rib.smobj. Below: stitches/swatch.obj stretched to 1.6 of its
# width, every point interpolated (embed, left) and relaxed (right).
set -eu
out=${1:-docs/picture.png}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
run="cargo run --release --quiet -- relax --quiet --subdivide 12"
$run stitches/lace.smobj -o "$folder/lace.npz"
$run stitches/rib.smobj -o "$folder/rib.npz"
python3 - "$folder/stretch.npy" <<'PYTHON'
import sys
import numpy as np
lines = (line.split() for line in open("stitches/swatch.obj"))
p = np.array([[float(x) for x in w[1:4]] for w in lines if w and w[0] == "v"])
np.save(sys.argv[1], p * [1.6, 0.85, 1.0])
PYTHON
for mode in embed relax; do
    $run stitches/swatch.obj --mode $mode --iterations 10 --frames "$folder/stretch.npy" -o "$folder/$mode.npz"
done
python3 docs/picture.py "$out" "$folder/lace.npz" "$folder/rib.npz" + "$folder/embed.npz" "$folder/relax.npz"
