"""Draws result files (.npz) as shaded yarn, side by side: python3 docs/picture.py OUT.png A.npz [B.npz ...] [+ NEXT_ROW.npz ...]

A plain orthographic picture from the front (z towards the viewer): every curve is stamped as small lit spheres
into a depth buffer, with the stripes of a plied yarn. Needs numpy and Pillow. Curves should be dense
(`--subdivide 12`). The README's picture is made by docs/picture.sh.
"""

import sys

import numpy as np
from PIL import Image

COLORS = [(0.80, 0.33, 0.30), (0.28, 0.48, 0.66), (0.87, 0.66, 0.29), (0.42, 0.60, 0.38)]
PAPER = (0.96, 0.955, 0.94)
WIDTH = 1400
LIGHT = np.array([-0.45, 0.55, 0.70]) / np.linalg.norm([-0.45, 0.55, 0.70])


def paper(height, width):
    return np.ones((height, width, 3)) * np.array(PAPER)


def draw(path, color, scale):
    data = np.load(path)
    points = data["points"][-1].astype(float) + data.get("origin", np.zeros(3))
    radius = float(data["radius"])
    low, high = points.min(axis=0) - 2 * radius, points.max(axis=0) + 2 * radius
    px = scale / float(data["gauge"])
    width, height = (np.ceil((high - low)[:2] * px)).astype(int)
    image = paper(height, width)
    depth = np.full((height, width), -np.inf)
    size = radius * px
    half = int(np.ceil(size))
    for begin, end, closed in zip(data["yarn_offsets"], data["yarn_offsets"][1:], data["yarn_closed"]):
        curve = points[begin:end]
        if closed:
            curve = np.vstack([curve, curve[:1]])
        lengths = np.linalg.norm(np.diff(curve, axis=0), axis=1)
        arc = np.concatenate([[0], np.cumsum(lengths)])
        places = np.arange(0, arc[-1], radius / 6)
        stamps = np.stack([np.interp(places, arc, curve[:, k]) for k in range(3)], axis=1)
        ahead = np.stack([np.interp(places + radius / 6, arc, curve[:, k]) for k in range(3)], axis=1)
        for s, p, q in zip(places, stamps, ahead):
            x, y = (p[0] - low[0]) * px, (high[1] - p[1]) * px
            x0, y0 = max(int(x) - half, 0), max(int(y) - half, 0)
            x1, y1 = min(int(x) + half + 2, width), min(int(y) + half + 2, height)
            u = (np.arange(x0, x1) - x) / size
            v = -(np.arange(y0, y1)[:, None] - y) / size
            inside = 1 - u**2 - v**2
            w = np.sqrt(np.maximum(inside, 0))
            z = p[2] * px + w * size
            hit = (inside > 0) & (z > depth[y0:y1, x0:x1])
            if not hit.any():
                continue
            along = (q - p)[:2]
            along = along / (np.linalg.norm(along) + 1e-9)
            across = u * -along[1] + v * along[0]
            # Plies: slanted stripes over the arc length and the yarn's width.
            ply = 0.82 + 0.18 * np.cos(2 * np.pi * (s / radius * 0.55 + across * 0.9 + 0 * v))
            lit = np.maximum(u * LIGHT[0] + v * LIGHT[1] + w * LIGHT[2], 0)
            # Deep places get less of the sky.
            sky = 0.62 + 0.38 * np.clip((z / px - low[2]) / (high[2] - low[2]), 0, 1)
            shade = (0.30 + 0.75 * lit) * ply * sky
            block = image[y0:y1, x0:x1]
            block[hit] = (np.array(color) * shade[..., None])[hit]
            depth[y0:y1, x0:x1][hit] = z[hit]
    return image


def row(paths, first):
    panels = [draw(p, COLORS[(first + i) % len(COLORS)], 60.0) for i, p in enumerate(paths)]
    height = max(p.shape[0] for p in panels)
    parts = [paper(height, 24)]
    for panel in panels:
        above = (height - panel.shape[0]) // 2
        full = paper(height, panel.shape[1])
        full[above : above + panel.shape[0]] = panel
        parts += [full, paper(height, 24)]
    pixels = (np.clip(np.hstack(parts), 0, 1) * 255).astype(np.uint8)
    image = Image.fromarray(pixels)
    return image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.LANCZOS)


def main():
    out, *paths = sys.argv[1:]
    rows, first = [], 0
    while paths:
        here = paths[: paths.index("+")] if "+" in paths else paths
        rows.append(row(here, first))
        first += len(here)
        paths = paths[len(here) + 1 :]
    picture = Image.new("RGB", (WIDTH, sum(r.height + 16 for r in rows)), tuple(int(255 * c) for c in PAPER))
    top = 8
    for image in rows:
        picture.paste(image, (0, top))
        top += image.height + 16
    picture.quantize(96, dither=Image.Dither.NONE).save(out, optimize=True)


main()
