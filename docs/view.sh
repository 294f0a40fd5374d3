#!/usr/bin/env bash
# docs/view.png: a rib with a corner pulled, as `knotmesh view` shows it. Needs a display, or Xvfb.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release --quiet --features view
script=$(mktemp)
trap 'rm -f "$script"' EXIT
cat >"$script" <<'STEPS'
settle
set beta 0.8
pull 0 -0.012 -0.012 0.02 0.05
view 18 12
settle
screenshot docs/view.png
STEPS
run=(target/release/knotmesh view stitches/rib-2x2.knit --window 1280x800 --script "$script")
if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then "${run[@]}"; else
    xvfb-run --auto-servernum --server-args '-screen 0 1400x1000x24' "${run[@]}"
fi
