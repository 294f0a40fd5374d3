#!/usr/bin/env python3
"""Designs, checks and draws the stitch template library (the *.json beside this file).

    design.py check [MESH...]          validate every template, measure the tiled swatches (and .smobj files with this
                                       library, embedded without relaxation)
    design.py draw DIR [NAME [MESH...]]  render the swatches whose name holds NAME to PNG files in DIR, front and back
    design.py make                     find all numbers again from the seeds and write the *.json (some minutes)
    design.py make NAME...             only the stitches of these names; the others keep what is on disk
    design.py write                    write the files again: searched stitches as on disk, the others from their seeds

Needs numpy and scipy; pictures need Pillow.

A stitch begins as a seed (points and knots placed by hand, in the order and with the crossings of the real stitch).
Where SEARCH names it, its knots and free points are then moved in a swatch of its neighbours until a sum is least: a
penalty on centrelines nearer than 1.9 r (steep below 1.68 r), bending energy and yarn length. Stitches on disk were
found so, in several runs; a new run gives like numbers, not the same ones.

Lengths are in course spacings: the face of a plain knit is 1 wide and H high. Curves through the points are
centripetal Catmull-Rom, chained across faces (an open end mirrors its neighbour). Distances are those of
formats.md: samples every r/2 along the curve, pairs on one yarn closer than 1.2 pi r along it left out.
"""
import copy
import glob
import json
import math
import os
import sys

import numpy as np
from scipy.spatial import cKDTree

HERE = os.path.dirname(os.path.abspath(__file__))
R = 0.1           # yarn radius
H = 0.61          # height of a plain face
LO, HI = 0.275, 0.725   # where loops cross wale edges
YR, YL = 0.25, 0.75     # where yarns cross yarn edges (right, left)


# ---------------------------------------------------------------- templates

def key(t):
    return " ".join([t["name"]] + t["edges"])


def load_library(folder=HERE):
    """Every template of the folder's JSON files by key, derived ones expanded."""
    raw = {}
    for f in sorted(glob.glob(os.path.join(folder, "*.json"))):
        d = json.load(open(f))
        for t in d if isinstance(d, list) else [d]:
            assert t.get("format") == "knotmesh-template" and t.get("version") == 1, (f, t.get("name"))
            assert key(t) not in raw, "twice: " + key(t)
            raw[key(t)] = t
    done = {}

    def get(k):
        if k not in done:
            t = raw[k]
            if "derive" in t:
                src = get(t["derive"]["from"])
                out = derive(src, t["derive"]["by"])
                assert out["edges"] == t["edges"], (k, out["edges"])
                out["name"] = t["name"]
                done[k] = out
            else:
                done[k] = t
        return done[k]

    for k in raw:
        get(k)
    return done


def derive(t, by):
    t = copy.deepcopy(t)
    assert len(set(by)) == len(by)
    for op in by:
        if op == "mirror-z":
            for y in t["yarns"]:
                for p in y:
                    p["z"] = -p["z"]
            # front and back change places: nothing else moves
        elif op == "reverse-yarn":
            sw = {"+": "-", "-": "+"}
            t["edges"] = [sw[e[0]] + e[1:] if e[1:2] == "y" and e[0] in sw else e for e in t["edges"]]
        elif op == "mirror-x":
            n = len(t["edges"])
            kind = [e.rstrip("0123456789") for e in t["edges"]]
            r = next(i for i in range(n + 1) if i == n or kind[i] != kind[0])
            assert r < n
            t["edges"] = [t["edges"][(r - i - 1) % n] for i in range(n)]
            t["corners"] = [[-t["corners"][(r - i) % n][0], t["corners"][(r - i) % n][1]] for i in range(n)]
            for k in t.get("knots", []):
                k["center"][0] = -k["center"][0]
                k["tilt"] = math.pi - k["tilt"]
            for y in t["yarns"]:
                for p in y:
                    if "edge" in p:
                        p["edge"] = (r - p["edge"] - 1) % n
                        p["along"] = round(1 - p["along"], 9)
                    elif "control" in p:
                        p["control"] = -p["control"]
                    elif "at" in p:
                        p["at"][0] = -p["at"][0]
        else:
            raise ValueError(op)
    return t


def points2d(t):
    """Planar positions of all points of all yarns (list of arrays) and their z (list of arrays)."""
    c = np.asarray(t["corners"], float)
    n = len(c)
    xy, zz = [], []
    for y in t["yarns"]:
        a = []
        for p in y:
            if "edge" in p:
                e = p["edge"]
                a.append(c[e] + p["along"] * (c[(e + 1) % n] - c[e]))
            elif "at" in p:
                a.append(p["at"])
            else:
                k = t["knots"][p["knot"]]
                d = np.array([math.cos(k["tilt"]), math.sin(k["tilt"])])
                if "contact" in p:
                    a.append(np.asarray(k["center"]) + p["contact"] * k["half_length"] * d)
                else:
                    a.append(np.asarray(k["center"]) + p["control"] * t["yarn_radius"] * np.array([d[1], -d[0]]))
        xy.append(np.asarray(a, float).reshape(-1, 2))
        zz.append(np.array([p["z"] for p in y], float))
    return xy, zz


def validate(t):
    """What is wrong with a template, as a list of lines."""
    bad = []
    c = np.asarray(t["corners"], float)
    n = len(c)
    r = t["yarn_radius"]
    if n != len(t["edges"]) or n < 3:
        bad.append("corners and edges differ in number")
    area = 0.5 * sum(c[i][0] * c[(i + 1) % n][1] - c[i][1] * c[(i + 1) % n][0] for i in range(n))
    if area <= 0:
        bad.append("corners are not counter-clockwise")
    knots = t.get("knots", [])
    for i, k in enumerate(knots):
        if k["half_length"] < r / 2:
            bad.append(f"knot {i}: half-length below r/2")
    visits = {}
    for yi, y in enumerate(t["yarns"]):
        i = 0
        if len(y) < 2:
            bad.append(f"yarn {yi} is too short")
        while i < len(y):
            p = y[i]
            if "edge" in p:
                if i not in (0, len(y) - 1):
                    bad.append(f"yarn {yi}: boundary point inside")
                if not (0 <= p["edge"] < n and 0 < p["along"] < 1):
                    bad.append(f"yarn {yi}: bad boundary point")
            elif "knot" in p:
                k = p["knot"]
                q = y[i:i + 3]
                if len(q) < 3 or "contact" not in q[0] or "control" not in q[1] or "contact" not in q[2] \
                        or any(x.get("knot") != k for x in q) or q[0]["contact"] != -q[2]["contact"]:
                    bad.append(f"yarn {yi}: knot {k} is not contact, control, contact")
                    break
                visits.setdefault(k, []).append((yi, {q[0]["contact"]: q[0]["z"], q[2]["contact"]: q[2]["z"]},
                                                 q[1]["control"], q[1]["z"]))
                i += 2
            i += 1
    for k in range(len(knots)):
        v = visits.get(k, [])
        if len(v) == 1:
            bad += deeper(t, visits, k)
            continue
        if len(v) != 2:
            bad.append(f"knot {k}: {len(v)} strands")
            continue
        (_, za, ca, pa), (_, zb, cb, pb) = v
        if ca != -cb:
            bad.append(f"knot {k}: both strands take the same control")
        for s in (-1, 1):
            if (za[s] > 0) == (zb[s] > 0):
                bad.append(f"knot {k}: contact {s:+d} does not have one strand in front")
            if abs(za[s] - zb[s]) < 2 * r - 1e-6:
                bad.append(f"knot {k}: strands nearer than 2r at contact {s:+d}")
        if (za[1] > zb[1]) == (za[-1] > zb[-1]):
            bad.append(f"knot {k}: strands do not swap")
    return bad


def deeper(t, visits, k):
    """What is wrong with a knot that only the loop of a deeper layer passes: it must share its place (centres within 3r,
    directions within a right angle) with a full knot, round whose leg its loop wraps on the side of that knot's own loop."""
    r, knots = t["yarn_radius"], t["knots"]
    (_, z, c, zc), = visits[k]
    gap = lambda j: math.dist(knots[j]["center"], knots[k]["center"])
    full = [j for j, w in visits.items() if j < len(knots) and len(w) == 2 and gap(j) <= 3 * r
            and math.cos(knots[j]["tilt"] - knots[k]["tilt"]) > 0]
    if not full:
        return [f"knot {k}: 1 strand, and no full knot in its place"]
    j = min(full, key=gap)
    leg = [w for w in visits[j] if w[2] == -c]
    loop = [w for w in visits[j] if w[2] == c]
    if len(leg) != 1 or len(loop) != 1:
        return [f"knot {k}: takes another side than the loop of knot {j}"]
    bad = []
    leg, loop = leg[0][1], loop[0][1]
    for s in (-1, 1):
        if (z[s] > leg[s]) != (loop[s] > leg[s]):
            bad.append(f"knot {k}: contact {s:+d} is on another side of the leg than knot {j}'s loop")
        if abs(z[s] - leg[s]) < 2 * r - 1e-6:
            bad.append(f"knot {k}: nearer than 2r to the leg at contact {s:+d}")
    if abs(zc - (z[1] + z[-1]) / 2) > 2e-6:
        bad.append(f"knot {k}: the control is not halfway between its contacts")
    return bad


# ---------------------------------------------------------------- faces, meshes

def mean_value(poly, q):
    """Mean value coordinates of the points q (m x 2) in the polygon (n x 2): m x n."""
    n = len(poly)
    nx = np.arange(1, n + 1) % n
    s = poly[None] - q[:, None]
    d = np.hypot(s[..., 0], s[..., 1])
    sn, dn = s[:, nx], d[:, nx]
    cr = s[..., 0] * sn[..., 1] - s[..., 1] * sn[..., 0]
    dt = (s * sn).sum(2)
    den = d * dn + dt
    th = cr / np.where(np.abs(den) < 1e-12, 1e-12, den)      # tan(alpha/2)
    w = (th[:, np.arange(-1, n - 1)] + th) / np.maximum(d, 1e-12)
    w = w / w.sum(1, keepdims=True)
    on = (np.abs(cr) < 1e-12) & (dt < 0)
    for m, i in zip(*np.where(on)):                          # on an edge: linear
        w[m] = 0
        w[m, i] = dn[m, i] / (d[m, i] + dn[m, i])
        w[m, (i + 1) % n] = d[m, i] / (d[m, i] + dn[m, i])
    return w


class Swatch:
    """Faces with templates, joined along edges.

    faces: list of (key, corner indices); verts: n x 3; joins: ((f, e), (g, h)) pairs joined reversed
    (a's start meets b's end), or with a third item True if the starts coincide.
    """

    def __init__(self, verts, faces, joins, gauge=1.0, weld=None):
        self.v = np.asarray(verts, float)
        if self.v.shape[1] == 2:
            self.v = np.column_stack([self.v, np.zeros(len(self.v))])
        self.faces, self.joins, self.gauge = faces, joins, gauge
        self.unjoined = []
        self._normals()

    def _normals(self):
        parent = list(range(len(self.v)))

        def find(a):
            while parent[a] != a:
                a = parent[a]
            return a
        for j in self.joins:
            (f, e), (g, h) = j[0], j[1]
            a, b = self.faces[f][1], self.faces[g][1]
            a0, a1 = a[e], a[(e + 1) % len(a)]
            b0, b1 = b[h], b[(h + 1) % len(b)]
            if not (len(j) > 2 and j[2]):
                b0, b1 = b1, b0
            parent[find(a0)] = find(b0)
            parent[find(a1)] = find(b1)
        nn = np.zeros_like(self.v)
        for _, ix in self.faces:
            p = self.v[ix] - self.v[ix[0]]
            a = 0.5 * np.cross(p, np.roll(p, -1, 0)).sum(0)
            for i in ix:
                nn[find(i)] += a
        nn = np.array([nn[find(i)] for i in range(len(self.v))])
        ln = np.linalg.norm(nn, axis=1, keepdims=True)
        self.n = nn / np.where(ln > 0, ln, 1)

    def build(self, lib):
        """Chains the yarns. Afterwards place(lib) gives positions for other numbers of the same templates."""
        ends = {}
        self.cp = []          # (face, yarn, point) of each control point
        ids = {}
        strand = []           # per (face, yarn): list of cp ids
        self.unjoined = []
        for f, (k, ix) in enumerate(self.faces):
            for yi, y in enumerate(lib[k]["yarns"]):
                lst = []
                for pi, p in enumerate(y):
                    cid = len(self.cp)
                    self.cp.append([(f, yi, pi)])
                    lst.append(cid)
                    if "edge" in p:
                        ends[(f, p["edge"], round(p["along"], 3), round(p["z"], 3))] = (len(strand), 0 if pi == 0 else -1)
                strand.append(lst)
        link = {}
        seen = set()
        for j in self.joins:
            (f, e), (g, h) = j[0], j[1]
            same = len(j) > 2 and j[2]
            for (ff, ee, al, z), s in list(ends.items()):
                if (ff, ee) == (f, e):
                    o = (g, h, al if same else round(1 - al, 3), z)
                    if o in ends:
                        link[s] = ends[o]
                        link[ends[o]] = s
                        seen.add((ff, ee, al, z))
                        seen.add(o)
        joined = {(j[i][0], j[i][1]) for j in self.joins for i in (0, 1)}
        for q in ends:
            if q not in seen and (q[0], q[1]) in joined:
                self.unjoined.append(q)
        used = set()
        chains = []

        def walk(s, side):
            out = []
            while True:
                used.add(s)
                lst = strand[s] if side == 0 else strand[s][::-1]
                out.append((s, lst))
                nx = link.get((s, -1 if side == 0 else 0))
                if nx is None:
                    return out, False
                if nx[0] in used:
                    return out, True
                s, side = nx[0], nx[1]

        order = [s for s in range(len(strand))]
        for pas in (0, 1):
            for s in order:
                if s in used or not strand[s]:
                    continue
                if pas == 0:
                    side = 0 if (s, 0) not in link else (-1 if (s, -1) not in link else None)
                    if side is None:
                        continue
                else:
                    side = 0
                out, closed = walk(s, side)
                ch = []
                for i, (_, lst) in enumerate(out):
                    if i and self.cp[lst[0]] is not None:
                        a, b = ch[-1], lst[0]       # the shared boundary point: mean of both
                        self.cp[a] = self.cp[a] + self.cp[b]
                        lst = lst[1:]
                    ch += lst
                if closed:
                    self.cp[ch[0]] = self.cp[ch[0]] + self.cp[ch[-1]]
                    ch = ch[:-1]
                chains.append((ch, closed))
        self.chains = chains
        self.keys = [k for k, _ in self.faces]
        return self

    def place(self, lib, vary=None):
        """World positions of all control points. vary: the only keys whose numbers change between calls."""
        if vary is not None and not hasattr(self, "fixed"):
            self.fixed = self._place(lib, lambda k: k not in vary)
        pos = dict(self.fixed) if vary is not None else {}
        pos.update(self._place(lib, (lambda k: k in vary) if vary is not None else (lambda k: True)))
        if not hasattr(self, "flat"):
            self.flat = np.array([(i, f, y, p) for i, l in enumerate(self.cp) for f, y, p in l])
            off, n = {}, 0
            for f, (k, _) in enumerate(self.faces):
                for y, yarn in enumerate(lib[k]["yarns"]):
                    off[(f, y)] = n
                    n += len(yarn)
            self.src = np.array([off[(f, y)] + p for _, f, y, p in self.flat])
            self.cnt = np.bincount(self.flat[:, 0], minlength=len(self.cp))[:, None]
            self.order = list(off)
        allp = np.concatenate([pos[q] for q in self.order])[self.src]
        out = np.zeros((len(self.cp), 3))
        np.add.at(out, self.flat[:, 0], allp)
        return out / np.maximum(self.cnt, 1)

    def _place(self, lib, want):
        pos = {}
        cache = {}
        for f, (k, ix) in enumerate(self.faces):
            if not want(k):
                continue
            t = lib[k]
            if k not in cache:
                xy, zz = points2d(t)
                c = np.asarray(t["corners"], float)
                w = []
                for y, a in zip(t["yarns"], xy):
                    ww = mean_value(c, a)
                    for i, p in enumerate(y):
                        if "edge" in p:
                            ww[i] = 0
                            ww[i, p["edge"]] = 1 - p["along"]
                            ww[i, (p["edge"] + 1) % len(c)] = p["along"]
                    w.append(ww)
                cache[k] = (w, zz)
            w, zz = cache[k]
            V, N = self.v[ix], self.n[ix]
            for yi in range(len(w)):
                nn = w[yi] @ N
                nn /= np.maximum(np.linalg.norm(nn, axis=1, keepdims=True), 1e-12)
                pos[(f, yi)] = w[yi] @ V + self.gauge * zz[yi][:, None] * nn
        return pos


def catmull_rom(p, closed, per=None, step=None):
    """Samples of the centripetal curve. Returns points, and for each sample its segment."""
    p = np.asarray(p, float)
    if closed:
        q = np.vstack([p[-1], p, p[0], p[1]])
    else:
        q = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    d = np.sqrt(np.maximum(np.linalg.norm(np.diff(q, axis=0), axis=1), 1e-12))
    m = len(q) - 3
    if per is None:
        per = np.maximum(2, np.ceil(d[1:m + 1] ** 2 / step).astype(int))
    else:
        per = np.full(m, per)
    seg = np.repeat(np.arange(m), per)
    u = np.concatenate([np.arange(k) / k for k in per])
    if not closed:
        seg = np.append(seg, m - 1)
        u = np.append(u, 1.0)
    t0 = np.zeros(len(seg))
    t1 = d[seg]
    t2 = t1 + d[seg + 1]
    t3 = t2 + d[seg + 2]
    t = (t1 + u * (t2 - t1))[:, None]
    t0, t1, t2, t3 = (x[:, None] for x in (t0, t1, t2, t3))
    a, b, c, e = q[seg], q[seg + 1], q[seg + 2], q[seg + 3]
    A1 = (t1 - t) / (t1 - t0) * a + (t - t0) / (t1 - t0) * b
    A2 = (t2 - t) / (t2 - t1) * b + (t - t1) / (t2 - t1) * c
    A3 = (t3 - t) / (t3 - t2) * c + (t - t2) / (t3 - t2) * e
    B1 = (t2 - t) / (t2 - t0) * A1 + (t - t0) / (t2 - t0) * A2
    B2 = (t3 - t) / (t3 - t1) * A2 + (t - t1) / (t3 - t1) * A3
    return (t2 - t) / (t2 - t1) * B1 + (t - t1) / (t2 - t1) * B2, seg


def curves(sw, lib, per=None, step=None, vary=None):
    """Sampled curves of a swatch: list of (points, owner face per sample, closed)."""
    cp = sw.place(lib, vary)
    out = []
    for ch, closed in sw.chains:
        if len(ch) < 2:
            continue
        x, seg = catmull_rom(cp[ch], closed, per, step)
        own = np.array([sw.cp[i][-1][0] for i in ch])
        out.append((x, own[np.minimum(seg, len(ch) - 1)], closed))
    return out


def resample(x, closed, step):
    y = np.vstack([x, x[:1]]) if closed else x
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(y, axis=0), axis=1))])
    n = max(2, int(math.ceil(s[-1] / step)))
    at = np.arange(n) * s[-1] / n if closed else np.linspace(0, s[-1], n + 1)
    return np.column_stack([np.interp(at, s, y[:, i]) for i in range(3)]), at, s[-1]


def measure(sw, lib, r=None, only=None):
    """Smallest distance over 2r, shares of samples nearer than 1.5 r and 2 r to another centreline (or to the same
    yarn further than 1.2 pi r along it), and the worst place. only: a set of faces to count."""
    r = (r or R) * sw.gauge
    P, S, L, C, O = [], [], [], [], []
    for i, (x, own, closed) in enumerate(curves(sw, lib, step=r / 10)):
        y, at, total = resample(x, closed, r / 2)
        tr = cKDTree(x)
        O.append(own[tr.query(y)[1]])
        P.append(y)
        S.append(at)
        L.append(np.full(len(y), total if closed else np.inf))
        C.append(np.full(len(y), i))
    P, S, L, C, O = (np.concatenate(a) for a in (P, S, L, C, O))
    near = np.full(len(P), np.inf)
    mate = np.full(len(P), -1)
    pairs = cKDTree(P).query_pairs(2.5 * r, output_type="ndarray")
    if len(pairs):
        a, b = pairs.T
        ds = np.abs(S[a] - S[b])
        ds = np.minimum(ds, L[a] - ds)
        ok = (C[a] != C[b]) | (ds > 1.2 * math.pi * r)
        a, b = a[ok], b[ok]
        d = np.linalg.norm(P[a] - P[b], axis=1)
        for i, j in ((a, b), (b, a)):
            o = np.argsort(-d)
            upd = d[o] < near[i[o]]
            np.minimum.at(near, i, d)
        for i, j in ((a, b), (b, a)):
            hit = d <= near[i] + 1e-15
            mate[i[hit]] = j[hit]
    sel = np.ones(len(P), bool) if only is None else np.isin(O, list(only))
    near_s = near[sel]
    if not len(near_s):
        return dict(min=np.inf, s15=0, s2=0, where=None, n=0)
    w = np.where(sel)[0][near_s.argmin()]
    m = mate[w]
    where = None if m < 0 else (int(O[w]), int(O[m]), P[w].round(3).tolist(), P[m].round(3).tolist())
    return dict(min=near_s.min() / (2 * r), s15=(near_s < 1.5 * r).mean(), s2=(near_s < 2 * r).mean(), where=where,
                n=len(near_s))


# ---------------------------------------------------------------- swatches

def grid(rows, lib):
    """A rectangle of faces; rows from the bottom up, each a list of keys of four-sided plain faces."""
    nx, ny = len(rows[0]), len(rows)
    verts = [(i, j * H) for j in range(ny + 1) for i in range(nx + 1)]
    at = lambda i, j: j * (nx + 1) + i
    faces, joins = [], []
    for j in range(ny):
        for i in range(nx):
            faces.append((rows[j][i], [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]))
            f = len(faces) - 1
            if i:
                joins.append(((f - 1, 1), (f, 3)))
            if j:
                joins.append(((f - nx, 2), (f, 0)))
    return Swatch(verts, faces, joins)


def run_of(t, sign, letter):
    return [i for i, e in enumerate(t["edges"]) if e[0] == sign and e[1:2] == letter]


def sheet(rows, lib, iters=400):
    """Rows of faces of any shape, bottom up; each row's +l edges meet the -l edges of the row above in order, the right
    yarn edge of a face the left one of the next. The flat mesh is found by fitting each face to its template polygon."""
    faces, joins, start = [], [], []
    tops = None
    for row in rows:
        bots, tp, prev = [], [], None
        for k in row:
            t = lib[k]
            f = len(faces)
            c = np.asarray(t["corners"], float)
            faces.append((k, list(range(len(start), len(start) + len(c)))))
            start += [None] * len(c)
            bots += [(f, e) for e in run_of(t, "-", "l")]
            tp += [(f, e) for e in run_of(t, "+", "l")][::-1]
            ys = [i for i, e in enumerate(t["edges"]) if e[1:2] in ("y", "c")]
            mid = lambda e: (c[e] + c[(e + 1) % len(c)])[0] / 2
            left = [e for e in ys if mid(e) < 0]
            right = [e for e in ys if mid(e) > 0]
            if prev is not None and left:
                joins.append((prev, (f, left[0])))
            prev = (f, right[0]) if right else None
        if tops is not None:
            assert len(tops) == len(bots), (len(tops), len(bots), row)
            joins += list(zip(tops, bots))
        tops = tp
    # weld
    par = list(range(len(start)))

    def find(a):
        while par[a] != a:
            a = par[a]
        return a
    for (f, e), (g, h) in joins:
        a, b = faces[f][1], faces[g][1]
        par[find(a[e])] = find(b[(h + 1) % len(b)])
        par[find(a[(e + 1) % len(a)])] = find(b[h])
    roots = sorted({find(i) for i in range(len(start))})
    idx = {r: i for i, r in enumerate(roots)}
    faces = [(k, [idx[find(i)] for i in ix]) for k, ix in faces]
    v = np.zeros((len(roots), 2))
    n = np.zeros(len(roots))
    f = 0
    for j, row in enumerate(rows):
        for i, k in enumerate(row):
            c = np.asarray(lib[k]["corners"], float) + [(i + 0.5) * len(rows[0]) / len(row), j * H]
            for q, x in zip(faces[f][1], c):
                v[q] += x
                n[q] += 1
            f += 1
    v /= n[:, None]
    for _ in range(iters):
        acc = np.zeros_like(v)
        for k, ix in faces:
            c = np.asarray(lib[k]["corners"], float)
            c0, p0 = c.mean(0), v[ix].mean(0)
            a, b = c - c0, v[ix] - p0
            co, si = (a * b).sum(), (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
            m = math.hypot(co, si) or 1
            co, si = co / m, si / m
            acc[ix] += np.column_stack([co * a[:, 0] - si * a[:, 1], si * a[:, 0] + co * a[:, 1]]) + p0
        v = acc / n[:, None]
    return Swatch(v, faces, joins)


def from_smobj(path, lib, only_known=True):
    """A mesh file with this library; the gauge as in model.md."""
    L, V, Fc, T, E = [], [], [], [], []
    for line in open(path):
        w = line.split("#")[0].split()
        if not w:
            continue
        if w[0] == "L":
            L.append(" ".join(w[1:]))
        elif w[0] == "v":
            V.append([float(x) for x in w[1:4]])
        elif w[0] == "f":
            Fc.append([int(x.split("/")[0]) - 1 for x in w[1:]])
        elif w[0] == "T":
            T.append(int(w[1]) - 1)
        elif w[0] == "e":
            a, b = ([int(x) for x in q.split("/")] for q in w[1:3])
            E.append(((a[0] - 1, abs(a[1]) - 1), (b[0] - 1, abs(b[1]) - 1), not ((a[1] < 0) != (b[1] < 0))))
    V = np.array(V)
    faces = [(L[t], f) for t, f in zip(T, Fc)]
    ratio = []
    for k, f in faces:
        p = V[f] - V[f[0]]
        c = np.asarray(lib[k]["corners"], float)
        a = 0.5 * np.linalg.norm(np.cross(p, np.roll(p, -1, 0)).sum(0))
        b = 0.5 * (c[:, 0] * np.roll(c[:, 1], -1) - c[:, 1] * np.roll(c[:, 0], -1)).sum()
        ratio.append(a / b)
    return Swatch(V, faces, E, gauge=math.sqrt(np.mean(ratio)))



# ---------------------------------------------------------------- search

def get_params(t, spec):
    x = []
    for s in spec:
        if s[0] == "knot":
            k = t["knots"][s[1]]
            x.append({"u": k["center"][0], "v": k["center"][1], "tilt": k["tilt"], "l": k["half_length"]}[s[2]])
        else:
            p = t["yarns"][s[1]][s[2]]
            x.append({"u": lambda: p["at"][0], "v": lambda: p["at"][1], "z": lambda: p["z"]}[s[3]]())
    return np.array(x, float)


def set_params(t, spec, x):
    for s, a in zip(spec, x):
        a = float(a)
        if s[0] == "knot":
            k = t["knots"][s[1]]
            if s[2] == "u":
                k["center"][0] = a
            elif s[2] == "v":
                k["center"][1] = a
            elif s[2] == "tilt":
                k["tilt"] = a
            else:
                k["half_length"] = max(a, 0.5 * t["yarn_radius"])
        else:
            p = t["yarns"][s[1]][s[2]]
            if s[3] == "u":
                p["at"][0] = a
            elif s[3] == "v":
                p["at"][1] = a
            else:
                p["z"] = a
            if s[0] == "layer":          # a control halfway between its two contacts
                y = t["yarns"][s[1]]
                c = s[2] + 1 if y[s[2] + 1].get("knot") == p["knot"] else s[2] - 1
                y[c]["z"] = (y[c - 1]["z"] + y[c + 1]["z"]) / 2


def layer_knots(t):
    """Knots that only one strand passes: knot -> (yarn, place of its first contact)."""
    at = {}
    for yi, y in enumerate(t["yarns"]):
        for pi, p in enumerate(y):
            if "control" in p:
                at.setdefault(p["knot"], []).append((yi, pi - 1))
    return {k: v[0] for k, v in at.items() if len(v) == 1}


def all_params(t, fix_z=False):
    out = [("knot", i, c) for i in range(len(t.get("knots", []))) for c in ("u", "v", "tilt", "l")]
    for yi, y in enumerate(t["yarns"]):
        for pi, p in enumerate(y):
            if "at" in p:
                out += [("free", yi, pi, "u"), ("free", yi, pi, "v")]
                if not fix_z:
                    out.append(("free", yi, pi, "z"))
    if not fix_z:
        out += [("layer", yi, pi + d, "z") for yi, pi in layer_knots(t).values() for d in (0, 2)]
    return out


def spline(q, u):
    """Centripetal Catmull-Rom of many segments (n x 4 x 3) at the parameters u: n x len(u) x 3."""
    d = np.sqrt(np.maximum(np.linalg.norm(np.diff(q, axis=1), axis=2), 1e-9))
    t1 = d[:, 0, None]
    t2 = t1 + d[:, 1, None]
    t3 = t2 + d[:, 2, None]
    t = t1 + u[None] * (t2 - t1)
    t0, t, t1, t2, t3 = (x[..., None] for x in (np.zeros_like(t1), t, t1, t2, t3))
    a, b, c, e = (q[:, k, None, :] for k in range(4))
    A1 = (t1 - t) / (t1 - t0) * a + (t - t0) / (t1 - t0) * b
    A2 = (t2 - t) / (t2 - t1) * b + (t - t1) / (t2 - t1) * c
    A3 = (t3 - t) / (t3 - t2) * c + (t - t2) / (t3 - t2) * e
    B1 = (t2 - t) / (t2 - t0) * A1 + (t - t0) / (t2 - t0) * A2
    B2 = (t3 - t) / (t3 - t1) * A2 + (t - t1) / (t3 - t1) * A3
    return (t2 - t) / (t2 - t1) * B1 + (t - t1) / (t2 - t1) * B2


class Objective:
    """Contact penalty, bending energy and length of the yarn in the faces that use the keys vary."""

    def __init__(self, sws, lib, vary, per=8, target=1.9, w_bend=0.01, w_len=0.05, reach=0.5):
        self.per, self.target, self.wb, self.wl, self.vary = per, target, w_bend, w_len, set(vary)
        self.parts = []
        self.u = np.arange(per) / per
        for sw in sws:
            sw.build(lib)
            cp = sw.place(lib, self.vary)
            n = len(cp)
            moving = np.array([any(sw.faces[f][0] in self.vary for f, _, _ in l) for l in sw.cp] + [False] * (4 * len(sw.chains)))
            ph, segs, chain = [], [], []
            for ci, (ch, closed) in enumerate(sw.chains):
                if len(ch) < 2:
                    continue
                if closed:
                    q = [ch[-1]] + ch + ch[:2]
                else:
                    for a, b in ((ch[0], ch[1]), (ch[-1], ch[-2])):
                        moving[n + len(ph)] = moving[a] or moving[b]
                        ph.append((a, b))
                    q = [n + len(ph) - 2] + ch + [n + len(ph) - 1]
                for k in range(len(q) - 3):
                    segs.append(q[k:k + 4])
                    chain.append(ci)
            segs, chain, ph = np.array(segs), np.array(chain), np.array(ph).reshape(-1, 2)
            dyn = moving[segs].any(1)
            ext = np.vstack([cp, 2 * cp[ph[:, 0]] - cp[ph[:, 1]]])
            x = spline(ext[segs], self.u)
            foc = np.vstack([sw.v[ix] for k, ix in sw.faces if k in self.vary])
            lo, hi = foc.min(0) - reach, foc.max(0) + reach
            m = x.mean(1)
            near = ~dyn & ((m > lo) & (m < hi))[:, :2].all(1)
            ln = np.linalg.norm(np.diff(spline(ext[segs], np.linspace(0, 1, per + 1)), axis=1), axis=2).sum(1)
            self.parts.append(dict(sw=sw, segs=segs, chain=chain, ph=ph, dyn=dyn, near=near, xs=x[near].reshape(-1, 3), ln=ln))

    def part(self, p, lib):
        r = R * p["sw"].gauge
        cp = p["sw"].place(lib, self.vary)
        ext = np.vstack([cp, 2 * cp[p["ph"][:, 0]] - cp[p["ph"][:, 1]]])
        x = spline(ext[p["segs"][p["dyn"]]], np.append(self.u, 1.0))
        d = np.diff(x, axis=1)
        l = np.linalg.norm(d, axis=2)
        ln = p["ln"].copy()
        ln[p["dyn"]] = l.sum(1)
        cum = np.cumsum(ln) - ln
        sd = (cum[p["dyn"], None] + np.cumsum(l, 1) - l).ravel()
        ss = (cum[p["near"], None] + self.u[None] * ln[p["near"], None]).ravel()
        cd, cs = np.repeat(p["chain"][p["dyn"]], self.per), np.repeat(p["chain"][p["near"]], self.per)
        xd = x[:, :-1].reshape(-1, 3)
        X, S, C = np.vstack([xd, p["xs"]]), np.concatenate([sd, ss]), np.concatenate([cd, cs])
        n = len(xd)
        near = np.full(len(X), self.target)
        i, j = cKDTree(X).query_pairs(self.target * r, output_type="ndarray").T
        ok = ((i < n) | (j < n)) & ((C[i] != C[j]) | (np.abs(S[i] - S[j]) >= 1.2 * math.pi * r))
        i, j = i[ok], j[ok]
        d2 = np.linalg.norm(X[i] - X[j], axis=1) / r
        np.minimum.at(near, i, d2)
        np.minimum.at(near, j, d2)
        near = near[:n]
        h = np.maximum(0, self.target - near) ** 2 + 10 * np.maximum(0, 1.68 - near) ** 2
        w = l.ravel() / r
        t = d / np.maximum(l, 1e-9)[..., None]
        bend = ((np.diff(t, axis=1) ** 2).sum(2) / (0.5 * (l[:, 1:] + l[:, :-1]) + 1e-9)).sum() * r
        return (h * w).sum(), bend, w.sum()

    def __call__(self, lib):
        return sum(a + self.wb * b + self.wl * c for a, b, c in (self.part(p, lib) for p in self.parts))


def search(objective, lib, k, spec, mirror=None, w_keep=0.0, iters=60, verbose=True, span=0.12):
    """Moves the parameters spec of template k. mirror(t) is applied after setting (symmetry)."""
    from scipy.optimize import minimize
    t = lib[k]
    x0 = get_params(t, spec)

    def f(x):
        set_params(t, spec, x)
        if mirror:
            mirror(t)
        over = sum(max(0, 0.5 * t["yarn_radius"] - a) ** 2 for s, a in zip(spec, x) if s[0] == "knot" and s[2] == "l")
        return objective(lib) + w_keep * ((x - x0) ** 2).sum() + 1e4 * over

    f0 = f(x0)
    room = {"u": span, "v": span, "tilt": 4 * span, "z": span}
    deep = layer_knots(t)
    bounds = [(0.5 * R, 0.26 if c[1] in deep else 0.22) if c[-1] == "l" else (a - room[c[-1]], a + room[c[-1]]) for a, c in zip(x0, spec)]
    res = minimize(f, x0, method="L-BFGS-B", bounds=bounds, options=dict(maxiter=iters, maxfun=iters * (len(x0) + 1) * 2, eps=1e-5))
    x = res.x if res.fun <= f0 else x0
    f(x)
    if verbose:
        print(f"  {k}: {f0:.4f} -> {min(res.fun, f0):.4f} ({res.nfev} evaluations)", flush=True)
    return t


def mirror_knit(t, k=0):
    """Knot k + 1 is the mirror of knot k."""
    a, b = t["knots"][k], t["knots"][k + 1]
    b["center"] = [-a["center"][0], a["center"][1]]
    b["tilt"] = math.pi - a["tilt"]
    b["half_length"] = a["half_length"]


# ---------------------------------------------------------------- seeds

def B(e, along, z=0.0):
    return {"edge": e, "along": along, "z": z}


def K(k, first, control, z0, z1, zc=0.0):
    """Through knot k: contact `first` at z0, control, the other contact at z1."""
    return [{"knot": k, "contact": first, "z": z0}, {"knot": k, "control": control, "z": zc},
            {"knot": k, "contact": -first, "z": z1}]


def D(k, first, control, z0, z1):
    """Through the knot of a deeper layer: its control lies halfway between its contacts."""
    return K(k, first, control, z0, z1, (z0 + z1) / 2)


def F(u, v, z=0.0):
    return {"at": [u, v], "z": z}


def knot(u, v, tilt, l):
    return {"center": [u, v], "tilt": tilt, "half_length": l}


def template(name, edges, corners, knots, yarns):
    return {"format": "knotmesh-template", "version": 1, "name": name, "edges": edges.split(), "corners": [list(c) for c in corners],
            "yarn_radius": R, "knots": knots, "yarns": yarns}


QUAD = [(-0.5, -H / 2), (0.5, -H / 2), (0.5, H / 2), (-0.5, H / 2)]


def seed_knit():
    r = R
    return template("knit+", "-lX +yX +lX -yX", QUAD, [knot(-0.215, -0.0045, 1.0645, 0.1385), knot(0.215, -0.0045, math.pi - 1.0645, 0.1385)], [
        [B(3, YL)] + K(0, -1, 1, -r, r) + [B(2, HI)],
        [B(1, YR)] + K(1, -1, -1, -r, r) + [B(2, LO)],
        [B(0, LO)] + K(0, -1, -1, r, -r) + K(1, 1, 1, -r, r) + [B(0, HI)]])


KP, KM = "knit+ -lX +yX +lX -yX", "knit- -lX -yX +lX +yX"
PP, PM = "purl+ -lX +yX +lX -yX", "purl- -lX -yX +lX +yX"
E0 = 0.1 * R     # a stacked contact that is only just in front


def flip(y):
    """A yarn of the left half as its mirror image in the right half (plain faces, free points only)."""
    out = []
    for p in y:
        p = dict(p)
        if "edge" in p:
            p["edge"] = {0: 0, 1: 3, 2: 2, 3: 1}[p["edge"]]
            p["along"] = round(1 - p["along"], 6)
        elif "at" in p:
            p["at"] = [-p["at"][0], p["at"][1]]
        out.append(p)
    return out


def arch(z):
    """The head of a loop that no yarn passes."""
    return [B(0, LO, z), F(-0.27, -0.13, z), F(-0.2, 0.07, z), F(0, 0.15, z), F(0.2, 0.07, z), F(0.27, -0.13, z), B(0, HI, z)]


def stacked(name, edges, z1, z2):
    """A knit through two loops, one in front of the other; they cross the lower edge at z1 (behind) and z2 (in front).
    Each leg has a knot with either loop; the leg itself passes the one with the loop behind."""
    r = R
    n = [-2 * r + E0, 2 * r]
    u, v, tilt, l = (0.32, 0.1, 1.45, 0.19) if z1 == 0 else (0.31, 0.05, 1.6, 0.25)
    return template(name, edges, QUAD, [knot(-0.19, 0.0, 1.22, 0.17), knot(0.19, 0.0, math.pi - 1.22, 0.17),
                                        knot(-u, v, tilt, l), knot(u, v, math.pi - tilt, l)], [
        [B(3, YL)] + K(0, -1, 1, *n) + [B(2, HI)],
        [B(1, YR)] + K(1, -1, -1, *n) + [B(2, LO)],
        [B(0, LO, z1)] + K(0, -1, -1, E0, -2 * r) + K(1, 1, 1, -2 * r, E0) + [B(0, HI, z1)],
        [B(0, LO, z2)] + D(2, -1, -1, 2 * r, -1.5 * r) + D(3, 1, 1, -1.5 * r, 2 * r) + [B(0, HI, z2)]])


PENT = [(-0.85, 0), (0, -0.527), (0.85, 0), (0.5, 0.5), (-0.5, 0.5)]
PENT_UP = [(-0.5, -0.44), (0.5, -0.44), (0.92, 0), (0, 0.392), (-0.92, 0)]
TRI = [(-0.475, -0.305), (0.475, 0), (-0.475, 0.305)]
HEX = [(-0.5, -H / 2), (0, -H / 2), (0.5, -H / 2), (0.5, H / 2), (0, H / 2), (-0.5, H / 2)]
TURN = [(-0.4, -0.6), (0.4, 0), (-0.4, 0.6), (-0.4, 0)]


def seed_decrease():
    """The left loop in front. Each leg of the new loop has a knot with either loop; the leg itself passes the one with
    the loop behind, only the loop in front passes its own two."""
    r = R
    n = [-2 * r + E0, 2 * r]
    return template("decrease-right+", "-lX -lX +yX +lX -yX", PENT, [
        knot(-0.22, 0.01, 1.45, 0.17), knot(0.37, 0.06, 1.91, 0.18), knot(-0.39, 0.1, 1.22, 0.19), knot(0.33, 0.14, 2.17, 0.18)], [
        [B(4, YL)] + K(0, -1, 1, *n) + [B(3, HI)],
        [B(2, YR)] + K(1, -1, -1, *n) + [B(3, LO)],
        [B(0, LO), F(-0.5, -0.2, 0.11)] + D(2, -1, -1, 2 * r, -0.2 * r) + D(3, 1, 1, -0.2 * r, 2.6 * r)
        + [F(-0.02, -0.41, 0.28), B(0, HI)],
        [B(1, LO), F(-0.09, -0.17, 0.13)] + K(0, -1, -1, E0, -2 * r) + K(1, 1, 1, -2 * r, E0) + [F(0.4, -0.26, 0.04), B(1, HI)]])


def seed_make(kind):
    r = R
    kn = [knot(-0.06, -0.1, 1.1, 0.13), knot(0.34, -0.1, 1.9, 0.13)]
    old = [B(0, LO)] + K(0, -1, -1, r, -r) + K(1, 1, 1, -r, r) + [B(0, HI)]
    nr = [B(1, YR)] + K(1, -1, -1, -r, r) + [B(2, LO)]
    if kind == "tuck":
        link = [B(2, HI)] + K(0, 1, 1, r, -r) + [F(-0.34, -0.14, -0.06), F(-0.33, 0.12, 0), B(3, LO)]
        out = [B(3, HI), F(-0.62, -0.1, 0), B(4, YL)]
    else:
        s = 1 if kind == "twist+" else -1
        link = [B(2, HI)] + K(0, 1, 1, r, -r) + [F(-0.3, -0.15, -0.1), F(-0.47, 0.0, -0.1 * s), B(3, HI)]
        out = [B(3, LO), F(-0.38, 0.1, 0.08 * s), F(-0.55, -0.15, 0.05 * s), B(4, YL)]
    name = {"tuck": "make-left-tuck+", "twist+": "make-left-tuck-twist+", "twist-": "make-left-tuck-twist-"}[kind]
    edges = "-lX -yX +lX +lX +yX" if kind == "twist-" else "-lX +yX +lX +lX -yX"
    return template(name, edges, PENT_UP, kn, [nr, link, out, old])


def seed_split_increase():
    r = R
    return template("make-left-split+", "-lX +yX +lX +lX -yX", PENT_UP, [knot(-0.12, -0.12, 1.2, 0.13)], [
        [B(1, YR), F(0.36, -0.26, -0.1), F(0.2, -0.02, 0.0), F(0.0, 0.18, 0.13), B(3, LO)],
        [B(3, HI)] + K(0, 1, 1, r, -r) + [B(4, YL)],
        [B(0, LO)] + K(0, -1, -1, r, -r) + [F(0.08, 0.16, -0.1), B(2, HI)],
        [B(0, HI), F(0.38, -0.15, 0.1), B(2, LO)]])


def seed_start():
    """The face is too low at its tip for a second knot: there the strands pass by free points; the tail leaves backwards."""
    r = R
    return template("start>", "-lX +lX +yX", TRI, [knot(-0.27, 0.0, 1.1, 0.12)], [
        [B(2, YL)] + K(0, -1, 1, -r, r) + [B(1, HI)],
        [F(0.05, -0.15, -0.45), F(0.04, -0.1, -0.18), F(0.0, 0.03, 0.0), F(0.04, 0.13, 0.14), B(1, LO)],
        [B(0, LO)] + K(0, -1, -1, r, -r) + [F(0.0, 0.17, -0.13), F(0.17, 0.09, -0.12), F(0.2, 0.0, 0.0), F(0.12, -0.1, 0.12), B(0, HI)]])


def seed_twisted():
    t = seed_knit()
    r = R
    t["name"] = "knit-twisted+"
    for k, u in zip(t["knots"], (-1, 1)):
        k.update(center=[u * 0.2, 0.04], tilt=math.pi / 2 + u * 0.45, half_length=0.11)
    t["yarns"][2] = [B(0, LO), F(0, -0.2, r)] + K(1, -1, 1, r, -r) + K(0, 1, -1, -r, r) + [F(0, -0.2, -r), B(0, HI)]
    return t


def seed_tuck_twist():
    y = [B(3, YL), F(-0.16, -0.12, 0.08), F(0.14, 0.06, 0.08), B(2, LO)]
    z = [dict(p, z=-p["z"]) for p in flip(y)]
    return template("tuck-twist+", "-lX +yX +lX -yX", QUAD, [], [y, z])


def legs(z0=0.0, z1=0.0, mid=None):
    y = [B(0, LO, z0)] + ([] if mid is None else [F(*mid)]) + [B(2, HI, z1)]
    return [y, flip(y)]


def float_behind():
    return [B(3, YL), F(-0.24, -0.17, -0.16), F(0.24, -0.17, -0.16), B(1, YR)]


def half_loop(z=0.0):
    y = [B(3, YL), F(-0.29, -0.09, 0.6 * z), B(2, HI, z)]
    return [y, flip(y)]


def seed_slip():
    return template("slip+", "-lX +yX +lX -yX", QUAD, [], legs(mid=(-0.215, -0.02, 0.06)) + [float_behind()])


def seed_turn():
    return template("turn)((", "-lX +lX +yX -yX", TURN, [], [
        [B(0, LO), F(-0.05, -0.16, 0.06), F(-0.05, 0.14, 0.06), B(1, HI)], [B(0, HI), F(0.2, 0, 0), B(1, LO)],
        [B(3, YL), F(-0.32, -0.31, -0.07), F(-0.29, -0.14, -0.09), F(-0.32, 0.02, -0.07), B(2, YL)]])


def seed_turn_tuck():
    z = 2 * R
    return template("turn-tuck)((", "-lX +lX +yX -yX", TURN, [], [
        [B(0, LO), F(-0.11, -0.08, -0.08), B(1, HI)], [B(0, HI), F(0.2, 0, -0.03), B(1, LO)],
        [B(3, YL), F(-0.31, -0.25, 0.12), F(-0.29, 0.12, 0.22), B(1, HI, z)],
        [B(2, YL), F(-0.29, 0.1, 0.02), F(-0.1, 0.05, 0.16), F(0.12, 0.04, 0.21), B(1, LO, z)]])


def seed_spacer():
    """Eight wales pass straight up; a yarn from the other bed is tucked into the first, fourth, fifth and eighth of them
    (top edges 16, 13, 12, 9), in front of the held loops."""
    z = 2 * R
    corners = [(i - 4, -H / 2) for i in range(9)] + [(4 - i, H / 2) for i in range(9)]
    edges = " ".join(["-lX"] * 8 + ["+yX"] + ["+lX"] * 8 + ["-yX"])
    ys = []
    for i in range(8):
        ys += [[B(i, LO), B(16 - i, HI)], [B(i, HI), B(16 - i, LO)]]
    wale = {16: -3.5, 13: -0.5, 12: 0.5, 9: 3.5}
    sag = -0.12
    tuck = [[B(17, YL), F(-3.84, -0.1, 0.16), F(-3.76, 0.08, 0.21), B(16, HI, z)]]
    for a, b in ((16, 13), (13, 12), (12, 9)):
        ua, ub = wale[a] + 0.225, wale[b] - 0.225
        mid = [F(ua + 0.09, 0.03, z), F(ub - 0.09, 0.03, z)]
        if ub - ua > 1:
            mid = [F(ua + 0.06, 0.05, z), F(ua + 0.35, sag, z), F(ub - 0.35, sag, z), F(ub - 0.06, 0.05, z)]
        tuck.append([B(a, LO, z)] + mid + [B(b, HI, z)])
    tuck.append([B(9, LO, z), F(3.76, 0.08, 0.21), F(3.84, -0.1, 0.16), B(8, YR)])
    return template("spacer4+", edges, corners, [], tuck + ys)


def seed_split(label):
    """split-front-to-right: the left needle's loops go to the right top edge in front of the right needle's own; with
    yarn, a new loop at the left top edge is drawn through the left needle's loops."""
    r = R
    a, b, y = label
    ys = []
    stack = a and b
    za = {0: [], 1: [0.0], 2: [-r, r]}[a]
    zb = {0: [], 1: [0.0], 2: [-r, r]}[b]
    n = a + b
    knots = []
    for z in za:
        top = r if stack else z
        if y:
            knots.append(knot(-0.31, -0.05, 1.2, 0.09))
            ys.append([B(0, LO, z)] + K(0, -1, -1, r, -r) + [F(-0.02, 0.14, -r + 0.03 + 0.5 * top), B(3, HI, top)])
            ys.append([B(0, HI, z), F(0.08, -0.17, 0.12), F(0.28, 0.1, 0.1 + 0.3 * top), B(3, LO, top)])
        else:
            up = 0.12 if stack else z
            ys.append([B(0, LO, z), F(-0.14, 0.0, up - 0.04), B(3, HI, top)])
            ys.append([B(0, HI, z), F(0.14, 0.0, up + 0.04), B(3, LO, top)])
    for z in zb:
        top = -r if stack else z
        back = -0.14 if (y or stack) else 0.0
        ys.append([B(1, LO, z), F(0.13, 0.0, z + back), B(3, HI, top)])
        ys.append([B(1, HI, z), F(0.37, 0.0, z + back), B(3, LO, top)])
    if y:
        if a:
            ys.append([B(5, YL)] + K(0, -1, 1, -r, r) + [B(4, HI)])
            ys.append([B(2, YR), F(0.24, -0.1, -0.06), F(0.05, -0.03, 0.02), F(-0.1, 0.14, 0.12), B(4, LO)])
        else:
            ys.append([B(5, YL), F(-0.4, -0.1, 0), B(4, HI)])
            ys.append([B(2, YR), F(0.3, -0.05, 0.08), F(0.0, 0.06, 0.08), F(-0.12, 0.2, 0.03), B(4, LO)])
    edges = f"-l{a} -l{b} +y{y} +l{n} +l{y} -y{y}"
    if not n and not y:
        edges = "-l0 -l0 +y0 +l0 +l0 -y0"
    return template("split-front-to-right", edges, HEX, knots, ys)


# ---------------------------------------------------------------- files

def tidy(x):
    if isinstance(x, float):
        x = round(x, 6)
        return 0.0 if x == 0 else x
    if isinstance(x, dict):
        return {k: tidy(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [tidy(v) for v in x]
    return x


def dump(t):
    """One template as text: short lines, one yarn a line or a few."""
    j = lambda v: json.dumps(tidy(v))
    if "derive" in t:
        return "{ " + f'"format": "knotmesh-template", "version": 1, "name": {j(t["name"])}, "edges": {j(t["edges"])},\n' \
            + f'  "derive": {j(t["derive"])} ' + "}"
    knots = (",\n             ".join(j(k) for k in t["knots"]))
    yarns = []
    for y in t["yarns"]:
        rows, i = [], 0
        while i < len(y):
            m = 3 if "knot" in y[i] else 1
            rows.append(", ".join(j(p) for p in y[i:i + m]))
            i += m
        yarns.append("[" + (",\n              ".join(rows)) + "]")
    return ('{ "format": "knotmesh-template", "version": 1,\n'
            f'  "name": {j(t["name"])}, "edges": {j(t["edges"])},\n'
            f'  "corners": {j(t["corners"])},\n  "yarn_radius": {j(t["yarn_radius"])},\n'
            f'  "knots": [{knots}],\n'
            '  "yarns": [' + (",\n            ".join(yarns)) + "] }")


def write(name, items):
    """One file a stitch family."""
    text = ",\n\n".join(dump(t) for t in items)
    with open(os.path.join(HERE, name + ".json"), "w") as f:
        f.write(text + "\n" if len(items) == 1 else "[\n" + text + "\n]\n")


# ---------------------------------------------------------------- the library

def plain(name, edges, yarns):
    return template(name, edges, QUAD, [], yarns)


def seed_tuck():
    """The held loop goes up in front, the new yarn behind it; a knittuck above takes both."""
    y = [B(3, YL), F(-0.28, -0.1, -0.1), B(2, HI)]
    return plain("tuck+", "-lX +yX +lX -yX", legs(0, 2 * R, (-0.215, -0.03, 0.1)) + [y, flip(y)])


def seed_wrap(edges, corners, top):
    """Loops cast on by winding: each crosses itself, the strand towards the right edge in front. top: the upper edges
    from left to right."""
    n = len(edges.split())
    c = np.asarray(corners, float)
    at = lambda e, a: c[e] + a * (c[(e + 1) % n] - c[e])
    ys, start = [], [B(n - 1, YL)]
    for e in top:
        l, r = at(e, HI), at(e, LO)          # left and right leg
        m, d = (l + r) / 2, (r - l) / 2
        dn = np.array([d[1], -d[0]]) / np.hypot(*d)
        x = m + 0.24 * dn
        ys.append(start + [F(*(x - 0.35 * d + 0.04 * dn), 0.11), F(*(x + 0.4 * d - 0.06 * dn), 0.1), B(e, LO)])
        start = [B(e, HI), F(*(x - 0.4 * d - 0.06 * dn), -0.1), F(*(x + 0.35 * d + 0.04 * dn), -0.11)]
    ys.append(start + [B(0, YR)])
    return template("edge-stitch", edges, corners, [], ys)


def seed_edge_stitch(n):
    """The yarn weaves through the last loops: over each left leg, under each right one, below the head."""
    r = R
    if n == 1:
        c, e = [(-0.5, 0), (0.5, 0), (0, 1.2)], "-lX +yX -yX"
        return template("edge-stitch", e, c, [], [
            [B(2, YL), F(-0.2, 0.29, r), F(0.2, 0.29, -r), B(1, YR)],
            [B(0, LO), F(-0.2, 0.29, -r), F(-0.12, 0.46, 0), F(0, 0.51, 0), F(0.12, 0.46, 0), F(0.2, 0.29, r), B(0, HI)]])
    c, e = [(-0.9, 0), (0, -0.2), (0.9, 0), (0, 1.1)], "-lX -lX +yX -yX"
    loop = lambda k, m, t: [B(k, LO), F(m - 0.18, 0.17 + t, -r), F(m - 0.12, 0.36, 0), F(m, 0.42, 0), F(m + 0.12, 0.36, 0),
                            F(m + 0.18, 0.17 - t, r), B(k, HI)]
    return template("edge-stitch", e, c, [], [
        [B(3, YL), F(-0.58, 0.22, r), F(-0.23, 0.17, -r), F(0.23, 0.17, r), F(0.58, 0.22, -r), B(2, YR)],
        loop(0, -0.4, 0.04), loop(1, 0.4, -0.04)])


def seed_weave():
    c = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]
    return template("over", "-a1 +e1 +a1 -e1", c, [], [[B(0, 0.5), F(0, 0, R), B(2, 0.5)], [B(1, 0.5), F(0, 0, -R), B(3, 0.5)]])


def seed_up(kind):
    """A yarn that climbs: it comes in through the lower yarn edge and leaves through the upper one."""
    a, b = kind.split("-up-")
    w, lo, hi = 0.25, 0.15, 0.5
    left = (-lo if a == "right" else -hi, hi if b == "right" else lo)
    right = (-lo if a == "left" else -hi, hi if b == "left" else lo)
    c = [(-w, left[0]), (w, right[0]), (w, right[1]), (-w, left[1])]
    return template("yarn-" + kind, "-y1 x +y1 x", c, [], [[B(0, 0.25 if a == "left" else 0.75), B(2, 0.25 if b == "right" else 0.75)]])


def stack_tuck():
    """tuck-behind over one held loop: the held loop goes up in front, the new yarn behind."""
    r = R
    y = [B(3, YL), F(-0.28, -0.1, -0.13), B(2, HI, -r)]
    return plain("tuck-behind-to-left", "-l1 -y1 +l2 +y1", legs(0, r, (-0.215, -0.02, 0.08)) + [y, flip(y)])


def edge_loop():
    c = [(-0.25, -H), (0.25, -H), (0.25, 0), (0.25, H), (-0.25, H)]
    return template("edge(", "x -y1 +y1 x x", c, [], [[B(1, YR), F(0.0, -0.42, 0), F(-0.13, -0.15, 0), F(0.0, 0.12, 0), B(2, YR)]])


def yarn_end():
    return template("in+", "x +yX x", [(-0.25, 0), (0.25, -H / 2), (0.25, H / 2)], [], [
        [F(-0.12, 0.05, 0), F(0.06, -0.1, 0), B(1, YR)]])


TRI_UP = [(0, -0.6), (0.5, 0), (-0.5, 0)]


def seed_yarn_over():
    """Yarn laid over the needle between two stitches: an open loop."""
    y = [B(2, YL), F(-0.2, -0.2, 0), B(1, HI)]
    z = [B(1, LO), F(0.2, -0.2, 0), B(0, YR)]
    return template("yarn-over+", "+yX +lX -yX", TRI_UP, [], [y, z])


def seed_yarn_over_twist():
    return dict(seed_wrap("+yX +lX -yX", TRI_UP, [1]), name="yarn-over-twist+")


HEX_DOWN = [(-1.1, 0.1), (-0.5, -0.62), (0.5, -0.62), (1.1, 0.1), (0.5, 0.5), (-0.5, 0.5)]


def seed_decrease_double():
    """Three loops: the left one in front, then the right one, the middle one behind. The legs of the new loop have their
    knots with the one behind; each loop in front of it passes two of its own."""
    r = R
    n = [-2 * r + E0, 2.9 * r, 0.5 * r]
    return template("decrease-double-right+", "-lX -lX -lX +yX +lX -yX", HEX_DOWN, [
        knot(-0.22, 0.0, 1.45, 0.18), knot(0.25, 0.0, 1.69, 0.18), knot(-0.42, 0.08, 1.2, 0.2), knot(0.31, 0.14, 2.17, 0.18),
        knot(-0.31, 0.14, 1.0, 0.18), knot(0.42, 0.08, 1.94, 0.2)], [
        [B(5, YL)] + K(0, -1, 1, *n) + [B(4, HI)],
        [B(3, YR)] + K(1, -1, -1, *n) + [B(4, LO)],
        [B(0, LO), F(-0.62, -0.12, 0.25)] + D(2, -1, -1, 4.1 * r, 0.9 * r) + D(3, 1, 1, 0.9 * r, 4.1 * r)
        + [F(0.0, -0.3, 0.42), B(0, HI)],
        [B(1, LO), F(-0.24, -0.35, 0.03)] + D(0, -1, -1, E0, -3.1 * r) + D(1, 1, 1, -3.1 * r, E0) + [F(0.24, -0.35, 0.03), B(1, HI)],
        [B(2, LO), F(0.0, -0.36, 0.2)] + D(4, -1, -1, 2.1 * r, -1.1 * r) + D(5, 1, 1, -1.1 * r, 2.1 * r)
        + [F(0.62, -0.15, 0.13), B(2, HI)]])


HB = 0.95                 # height of a bind-off face: a knit and the chain above it
CY, CL = 0.17, 0.72       # where the working yarn and both legs of the chain loop cross chain edges, seen from below
CZ = 1.05 * R             # height of the legs: one in front of the other


def seed_bind_off(name, edges):
    """A knit whose new loop goes up through the chain loop that comes in at the left (both its legs between that loop's,
    which lie in front and behind), and lies over to the right: to the next stitch (c), up as a live loop (l), or it is
    closed by the yarn itself, which comes through it from behind."""
    r = R
    right, top, left = edges.split()[1:]
    low = -H / 2
    at = lambda h, f: low + f * h
    hr, hl = (HB if right[1] == "c" else 0.75), (HB if left[1] == "c" else 0.75)
    if top != "x":
        hr = 0.75
    corners = [(-0.5, low), (0.5, low), (0.5, low + hr), (-0.5, low + hl)]
    first = [B(3, 1 - CY) if left[1] == "c" else B(3, YL)] + K(0, -1, 1, -r, r)
    last = K(1, 1, -1, r, -r) + [B(1, CY if right[1] == "c" else YR)]
    old = [B(0, LO)] + K(0, -1, -1, r, -r) + K(1, 1, 1, -r, r) + [B(0, HI)]
    ys = [old]
    through = [F(-0.11, 0.3, 0.02)]
    back = [F(0.12, 0.3, 0.02)]
    if left[1] == "c":
        ys.append([B(3, 1 - CL, CZ), F(-0.27, 0.32, 0.16), F(0.0, 0.28, 0.21), F(0.23, 0.28, 0.16), F(0.33, 0.29, 0.0),
                   F(0.23, 0.3, -0.16), F(0.0, 0.3, -0.21), F(-0.27, 0.33, -0.16), B(3, 1 - CL, -CZ)])
    if right[1] == "c" and top == "x":
        ys.append(first + through + [F(-0.05, 0.5, 0.07), F(0.2, 0.53, 0.12), B(1, CL, CZ)])
        ys.append([B(1, CL, -CZ), F(0.24, 0.5, -0.12)] + back + last)
    elif top != "x":
        ys.append(first + through + [B(2, HI)])
        ys.append([B(2, LO)] + back + last)
    else:
        ys.append(first + through + [F(-0.13, 0.45, 0.0), F(-0.08, 0.6, 0.0), F(0.07, 0.62, 0.0), F(0.15, 0.47, 0.0)] + back
                  + K(1, 1, -1, r, -r) + [F(0.38, 0.05, -0.15), F(0.33, 0.35, -0.2), F(0.14, 0.48, -0.17), F(0.01, 0.46, 0.0),
                                          F(0.14, 0.43, 0.18), F(0.36, 0.2, 0.14), B(1, YR)])
    return template(name, edges, corners, [knot(-0.215, -0.0045, 1.0645, 0.1385), knot(0.215, -0.0045, math.pi - 1.0645, 0.1385)], ys)


BIND = {"bind-off-first": "-lX +cX x -yX", "bind-off": "-lX +cX x -cX", "bind-off-next": "-lX +yX +lX -cX",
        "bind-off-last": "-lX +yX x -cX", "bind-off-only": "-lX +yX x -yX"}


def seed_pick_up():
    """The turn of the yarn at the left side, drawn out as a loop."""
    c = [(-0.25, -H), (0.25, -H), (0.25, 0), (0.25, H), (-0.25, H)]
    return template("pick-up-edge(", "x -y1 +y1 x +lX", c, [], [
        [B(1, YR), F(0.0, -0.4, 0), B(4, HI)], [B(4, LO), F(0.0, 0.22, 0), B(2, YR)]])


def seed_seam():
    """Loops from below and from above, side by side; the yarn passes over the left leg and under the right leg of each."""
    r = R
    return plain("seam+", "-lX +yX -lX -yX", [
        [B(3, YL), F(-0.37, 0, r), F(-0.13, 0, -r), F(0.13, 0, r), F(0.37, 0, -r), B(1, YR)],
        [B(0, LO), F(-0.36, -0.06, -r), F(-0.34, 0.08, -0.05), F(-0.25, 0.14, 0), F(-0.16, 0.08, 0.05), F(-0.13, -0.06, r),
         F(0.1, -0.2, 0.05), B(0, HI)],
        [B(2, HI), F(-0.1, 0.2, -0.05), F(0.13, 0.06, -r), F(0.16, -0.08, -0.05), F(0.25, -0.14, 0), F(0.34, -0.08, 0.05),
         F(0.36, 0.06, r), B(2, LO)]])


def seed_hold():
    """A yarn through a live loop: over its left leg, under its right one."""
    r = R
    return plain("hold+", "-lX +yX x -yX", [
        [B(3, YL), F(-0.2, -0.08, r), F(0.2, -0.08, -r), B(1, YR)],
        [B(0, LO), F(-0.2, -0.08, -r), F(-0.13, 0.1, 0), F(0, 0.16, 0), F(0.13, 0.1, 0), F(0.2, -0.08, r), B(0, HI)]])


SPLITS = [(0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1), (0, 2, 0), (1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1), (2, 0, 0)]

# key of each template that is not derived: how its seed is made
SEEDS = {}
for _t in (seed_knit, seed_decrease, lambda: seed_make("tuck"), lambda: seed_make("twist+"), lambda: seed_make("twist-"),
           seed_split_increase, seed_start, seed_twisted, seed_tuck_twist, seed_slip, seed_tuck, seed_turn, seed_turn_tuck,
           lambda: stacked("knittuck+", "-lX +yX +lX -yX", 0, 2 * R), lambda: stacked("knit-to-left", "-l2 -y1 +l1 +y1", -R, R),
           lambda: plain("drop", "-l1 +y0 +l0 -y0", [arch(0)]), edge_loop, yarn_end, seed_spacer, seed_weave, stack_tuck,
           lambda: plain("xfer+1", "-lX x +lX x", legs()),
           lambda: plain("knit-to-left", "-l0 -y1 +l1 +y1", half_loop()),
           lambda: plain("knit-to-left", "-l2 -y0 +l0 +y0", [arch(R), arch(-R)]),
           lambda: plain("loop", "-l2 x +l2 x", legs(R, R) + legs(-R, -R)),
           lambda: seed_edge_stitch(1), lambda: seed_edge_stitch(2),
           lambda: seed_wrap("+yX +lX -yX", [(0, -1.2), (0.5, 0), (-0.5, 0)], [1]),
           lambda: seed_wrap("+yX +lX +lX -yX", [(0, -1.1), (0.88, 0), (0, 0.3), (-0.88, 0)], [2, 1]),
           lambda: template("yarn-to-left", "x -y1 x +y1", QUAD, [],
                            [[B(1, YR), B(3, YL)]]),
           seed_yarn_over, seed_yarn_over_twist, seed_decrease_double, seed_pick_up, seed_seam, seed_hold):
    SEEDS[key(_t())] = _t
for _n, _e in BIND.items():
    SEEDS[f"{_n}+ {_e}"] = lambda n=_n, e=_e: seed_bind_off(n + "+", e)
for _k in ("left-up-left", "left-up-right", "right-up-left", "right-up-right"):
    SEEDS[key(seed_up(_k))] = lambda k=_k: seed_up(k)
for _l in SPLITS:
    SEEDS[key(seed_split(_l))] = lambda l=_l: seed_split(l)


def relabel(k, *by):
    """The key that the operations give, for another name."""
    name, edges = k.split(" ")[0], k.split(" ")[1:]
    n = len(edges)
    t = dict(name=name, edges=edges, corners=[[0, 0]] * n, knots=[], yarns=[])
    return derive(t, by)["edges"]


def families():
    """File name -> its templates: keys of SEEDS or (name, source key, operations)."""
    f = {}
    e4 = " -lX +yX +lX -yX"
    dec = "decrease-right+ -lX -lX +yX +lX -yX"
    pair = lambda k, n: [k, (n, k, "mirror-x")]
    f["knit"] = pair(KP, "knit-")
    f["purl"] = [("purl+", KP, "mirror-z"), ("purl-", PP, "mirror-x")]
    f["drop"] = ["drop -l1 +y0 +l0 -y0", ("drop", "drop -l1 +y0 +l0 -y0", "mirror-x"), ("drop+", "drop -l1 +y0 +l0 -y0"), ("drop-", "drop -l1 +y0 +l0 -y0", "mirror-x")]
    f["decrease"] = [dec, ("decrease-right-", "decrease-left+ -lX -lX +yX +lX -yX", "mirror-x"),
                     ("decrease-left+", dec, "mirror-x", "reverse-yarn"), ("decrease-left-", dec, "mirror-x")]
    f["purl-decrease"] = [("purl-" + a, k, "mirror-z") for a, k in
                          [("decrease-right+", dec), ("decrease-right-", "decrease-right- -lX -lX -yX +lX +yX"),
                           ("decrease-left+", "decrease-left+ -lX -lX +yX +lX -yX"), ("decrease-left-", "decrease-left- -lX -lX -yX +lX +yX")]]
    up = " -lX +yX +lX +lX -yX"
    um = " -lX -yX +lX +lX +yX"
    for s in ("tuck", "split"):
        f["make-" + s] = [f"make-left-{s}+" + up, (f"make-left-{s}-", f"make-left-{s}+" + up, "reverse-yarn"),
                          (f"make-right-{s}+", f"make-left-{s}+" + up, "mirror-x", "reverse-yarn"),
                          (f"make-right-{s}-", f"make-right-{s}+" + up, "reverse-yarn")]
    f["make-tuck-twist"] = ["make-left-tuck-twist+" + up, "make-left-tuck-twist-" + um,
                            ("make-right-tuck-twist+", "make-left-tuck-twist-" + um, "mirror-x"),
                            ("make-right-tuck-twist-", "make-left-tuck-twist+" + up, "mirror-x")]
    f["knittuck"] = pair("knittuck+" + e4, "knittuck-")
    f["tuck"] = pair("tuck+" + e4, "tuck-")
    f["tuck-twist"] = pair("tuck-twist+" + e4, "tuck-twist-")
    f["knit-twisted"] = pair("knit-twisted+" + e4, "knit-twisted-")
    f["slip"] = pair("slip+" + e4, "slip-") + [("slip-front+", "slip+" + e4, "mirror-z"), ("slip-front-", "slip-front+" + e4, "mirror-x")]
    st = "start> -lX +lX +yX"
    f["start-end"] = [st, ("start<", st, "mirror-x"), ("end>", st, "reverse-yarn"), ("end<", "end> -lX +lX -yX", "mirror-x")]
    f["in-out"] = ["in+ x +yX x", ("in-", "in+ x +yX x", "mirror-x"), ("out-", "in+ x +yX x", "reverse-yarn"),
                   ("out+", "out- x -yX x", "mirror-x")]
    f["turn"] = pair("turn)(( -lX +lX +yX -yX", "turn))(") + pair("turn-tuck)(( -lX +lX +yX -yX", "turn-tuck))(")
    f["edge"] = pair("edge( x -y1 +y1 x x", "edge)")
    for n, e in [("yarn-over", " +yX +lX -yX"), ("yarn-over-twist", " +yX +lX -yX")]:
        f.setdefault("yarn-over", []).extend([n + "+" + e, (n + "-", n + "+" + e, "reverse-yarn")])
    hp, hm = " -lX -lX -lX +yX +lX -yX", " -lX -lX -lX -yX +lX +yX"
    dd = "decrease-double-"
    f["decrease-double"] = [dd + "right+" + hp, (dd + "right-", dd + "left+" + hp, "mirror-x"),
                            (dd + "left+", dd + "right+" + hp, "mirror-x", "reverse-yarn"), (dd + "left-", dd + "right+" + hp, "mirror-x")]
    f["purl-decrease-double"] = [("purl-" + dd + a, dd + a + e, "mirror-z")
                                 for a, e in (("right+", hp), ("right-", hm), ("left+", hp), ("left-", hm))]
    f["bind-off"] = [x for n, e in BIND.items() for x in pair(f"{n}+ {e}", n + "-")]
    f["purl-bind-off"] = [("purl-" + k.split(" ")[0], k, "mirror-z") for n, e in BIND.items()
                          for k in (f"{n}+ {e}", " ".join([n + "-"] + relabel(f"{n}+ {e}", "mirror-x")))]
    f["edge"] += pair("pick-up-edge( x -y1 +y1 x +lX", "pick-up-edge)")
    f["seam"] = pair("seam+ -lX +yX -lX -yX", "seam-")
    held = "edge-stitch -lX +yX -yX"
    f["draw"] = [("draw+", held), ("draw-", held, "mirror-x")] + pair("hold+ -lX +yX x -yX", "hold-")
    f["purl-twisted"] = [("purl-twisted" + s, f"knit-twisted{s}" + (e4 if s == "+" else " -lX -yX +lX +yX"), "mirror-z") for s in "+-"]
    f["purltuck"] = [(b + s, a + s + (e4 if s == "+" else " -lX -yX +lX +yX"), "mirror-z")
                     for a, b in (("knittuck", "purltuck"), ("tuck", "tuck-front")) for s in "+-"]
    f["purl-make"] = [(f"purl-make-{side}-{s}{d}", f"make-{side}-{s}{d}" + (up if d == "+" else um), "mirror-z")
                      for s in ("tuck", "tuck-twist", "split") for side in ("left", "right") for d in "+-"]
    f["spacer"] = [k for k in SEEDS if k.startswith("spacer4+")]
    f["xfer"] = ["xfer+1 -lX x +lX x"]
    f["edge-stitch"] = [k for k in SEEDS if k.startswith("edge-stitch ")]
    f["weave"] = ["over -a1 +e1 +a1 -e1", ("under", "over -a1 +e1 +a1 -e1", "mirror-z")]
    # machine knitting (knitout): to-left carries -y on the right edge, to-right is the same yarn the other way
    kl = lambda l: "knit-to-left " + l
    k = [kl("-l0 -y1 +l1 +y1"), ("knit-to-left", "drop -l1 +y0 +l0 -y0", "reverse-yarn"), ("knit-to-left=-l1 -y1 +l1 +y1", KP, "reverse-yarn"),
         kl("-l2 -y0 +l0 +y0"), kl("-l2 -y1 +l1 +y1")]
    left = ["-l0 -y1 +l1 +y1", "-l1 -y0 +l0 +y0", "-l1 -y1 +l1 +y1", "-l2 -y0 +l0 +y0", "-l2 -y1 +l1 +y1"]
    k += [("knit-to-right", kl(l), "reverse-yarn") for l in left]
    f["knitout-knit"] = k
    f["knitout-purl"] = [("purl-to-left", kl(l), "mirror-z") for l in left] + [("purl-to-right", "purl-to-left " + l, "reverse-yarn") for l in left]
    f["knitout-loop"] = [("loop=-l1 x +l1 x", "xfer+1 -lX x +lX x"), "loop -l2 x +l2 x"]
    tb = ["tuck-behind-to-left -l0 -y1 +l1 +y1", "tuck-behind-to-left -l1 -y1 +l2 +y1"]
    f["knitout-tuck"] = [("tuck-behind-to-left", kl("-l0 -y1 +l1 +y1")), tb[1]] + [("tuck-behind-to-right", q, "reverse-yarn") for q in tb] \
        + [("tuck-infront-to-left", q, "mirror-z") for q in tb] \
        + [("tuck-infront-to-right", q.replace("behind", "infront"), "reverse-yarn") for q in tb]
    f["knitout-split-front"] = [q for q in SEEDS if q.startswith("split-front")]
    f["knitout-split-front"] += [("split-front-to-left", q, "reverse-yarn") for q in f["knitout-split-front"]]
    fr = [q for q in SEEDS if q.startswith("split-front")]
    f["knitout-split-back"] = [("split-back-to-left", q, "mirror-x", "mirror-z") for q in fr]
    f["knitout-split-back"] += [("split-back-to-right", " ".join(["split-back-to-left"] + relabel(q, "mirror-x")), "reverse-yarn") for q in fr]
    f["knitout-yarn"] = ["yarn-to-left x -y1 x +y1", ("yarn-to-right", "yarn-to-left x -y1 x +y1", "reverse-yarn")] \
        + [q for q in SEEDS if "-up-" in q and not q.startswith("pick")]
    return f


def make(names=None, only_write=False):
    """Writes all files. Templates in names (None: all that have a search) are searched again from their seeds, the
    others keep their numbers on disk if there are any."""
    try:
        disk = load_library()
    except (AssertionError, KeyError, ValueError) as err:
        print("starting afresh:", err)
        disk = {}
    again = lambda k: not only_write and (names is None or k.split(" ")[0] in names)
    base = {k: (disk[k] if k in disk and k in SEARCH and not again(k) else f()) for k, f in SEEDS.items()}
    for k in (SEARCH if not only_write else {}):
        if names is None or k.split(" ")[0] in names:
            base[k] = tune(k, base)
    for name, items in families().items():
        out = []
        for it in items:
            if isinstance(it, str):
                out.append(base[it])
            else:
                n, src, by = it[0], it[1], list(it[2:])
                n, _, want = n.partition("=")
                edges = relabel(src, *by)
                if want and want.split() != edges:       # the same geometry under other labels: written out in full
                    full = derive(base[src], by)
                    full["name"], full["edges"] = n, want.split()
                    out.append(full)
                elif not by:
                    full = copy.deepcopy(base[src])
                    full["name"] = n
                    out.append(full)
                else:
                    out.append(dict(format="knotmesh-template", version=1, name=n, edges=edges, derive={"from": src, "by": by}))
        write(name, out)


# ---------------------------------------------------------------- contexts and the search of each stitch

def context(k, lib, around=None):
    """A swatch of knits with the template in the middle (rows bottom up)."""
    n, t = k.split(" ")[0], lib[k]
    a = around or (KM if n.endswith("-") or "-yX" in k.split(" ")[2] else KP)
    nl, nu = len(run_of(t, "-", "l")), len(run_of(t, "+", "l"))
    tw, tu = "tuck-twist+ -lX +yX +lX -yX", "tuck+ -lX +yX +lX -yX"
    if n[:5] in ("start", "end<", "end>"):
        a = KP if ("+yX" in k) else KM
        c = np.asarray(t["corners"])
        e = [i for i, x in enumerate(t["edges"]) if x[1] == "y"][0]
        side = [a, a, k] if (c[e] + c[(e + 1) % 3])[0] < 0 else [k, a, a]
        return [[a] * 3, [a] * 3, side, [a] * 3, [a] * 3]
    if n[:10] == "tuck-twist":
        return [[k] * 4, [KM if n[-1] == "+" else KP] * 4, [KP] * 4]
    if n[:4] == "drop":
        return [[KP] * 4, [KM] * 4, [k] * 4]
    if n[:-1] in ("tuck-front", "purltuck"):
        e = e_of(n[-1])
        a = around or (PP if n[-1] == "+" else PM)
        return [[a] * 3, [a, f"tuck-front{n[-1]} {e}", a], [a, f"purltuck{n[-1]} {e}", a], [a] * 3]
    if n[:4] in ("tuck", "knit") and ("tuck+" in n or "tuck-" in n):
        m = n[-1] == "-"
        a, up, tk = (KM, "knittuck- -lX -yX +lX +yX", "tuck- -lX -yX +lX +yX") if m else (KP, "knittuck+ -lX +yX +lX -yX", tu)
        return [[a] * 3, [a, tk, a], [a, up, a], [a] * 3]
    if "-l2 -y1 +l1" in k or "-l1 -y1 +l2" in k:
        return [[KP] * 3, [KP, "tuck-behind-to-left -l1 -y1 +l2 +y1", KP], [KP, "knit-to-left -l2 -y1 +l1 +y1", KP], [KP] * 3]
    if "twisted" in n:
        return [[a] * 4, [a] * 4, [a, k, k, a], [a] * 4, [a] * 4]
    if "bind-off" in n:
        return bind_off_rows(n, k.split(" ")[1:], a)
    if n[:4] == "hold":
        return [[a] * 4, [a] * 4, [k] * 4]
    if n[:4] == "draw":
        return [[a] * 3, [a] * 3, [k] * 3]
    if n == "edge-stitch":
        if nl == 0:
            one = "edge-stitch +yX +lX -yX"
            return [[k] * 3, [KP] * 3, [KP] * 3] if nu == 1 else [[one, k, one], [KP] * 4, [KP] * 4]
        return [[KP] * 3 * nl, [KP] * 3 * nl, [k] * 3] if nl == 1 else [[KP] * 4, [KP] * 4, ["edge-stitch -lX +yX -yX", k, "edge-stitch -lX +yX -yX"]]
    side = 2 if nl == 3 else 1      # a double decrease pulls at more of its row
    return [[a] * (2 * side + nl)] * 2 + [[a] * side + [k] + [a] * side] + [[a] * (2 * side + nu)] * 2


def bind_off_rows(n, edges, a):
    """Rows of a, the last one bound off, with the stitch n among it."""
    p = "purl-" if n.startswith("purl-") else ""
    s = n[-1]
    kind = n[len(p):-1]
    lab = lambda q: " ".join([p + q + s] + (BIND[q].split() if s == "+" else relabel(f"{q}+ {BIND[q]}", "mirror-x")))
    if kind == "bind-off-only":
        row, top = [a, a, lab(kind), a, a], None
    elif kind == "bind-off-next":
        row, top = [lab("bind-off-first"), lab("bind-off"), lab(kind), a, a], [a] * 3
    else:
        row, top = [lab("bind-off-first"), lab("bind-off"), lab("bind-off"), lab("bind-off"), lab("bind-off-last")], None
    if s == "-":
        row = row[::-1]
    return [[a] * 5] * 2 + [row] + ([top] * 2 if top else [])


def e_of(sign):
    """Labels of a plain face whose yarn goes to the right (+) or to the left (-)."""
    return "-lX +yX +lX -yX" if sign == "+" else "-lX -yX +lX +yX"


def alone(k, lib):
    n = len(lib[k]["corners"])
    return Swatch(lib[k]["corners"], [(k, list(range(n)))], [])


def low_head(t, top=0.4):
    """Keeps the head of the front loop in the face: the upper contacts of its knots (2 and 3) no higher than top."""
    for k in t["knots"][2:]:
        k["center"][1] = min(k["center"][1], top - k["half_length"] * math.sin(k["tilt"]))


def both_halves(t):
    """Symmetry of the stacked knit: knots 1 and 3 mirror 0 and 2, the front loop its own left half."""
    low_head(t, 0.34)
    mirror_knit(t)
    mirror_knit(t, 2)
    y = t["yarns"][3]
    n = len(y) - 1
    for i in range(1, (n + 1) // 2):
        y[n - i]["z"] = y[i]["z"]
        if "at" in y[i]:
            y[n - i]["at"] = [-y[i]["at"][0], y[i]["at"][1]]


def half_turn(t):
    """Symmetry of the twisted knit: the crossing below is its own image."""
    mirror_knit(t)
    y = t["yarns"][2]
    y[1]["at"][0] = 0.0
    y[-2]["at"], y[-2]["z"] = list(y[1]["at"]), -y[1]["z"]


# key: (symmetry, starts)
SEARCH = {
    KP: (mirror_knit, 1),
    "decrease-right+ -lX -lX +yX +lX -yX": (low_head, 3),
    "make-left-tuck+ -lX +yX +lX +lX -yX": (None, 1),
    "make-left-tuck-twist+ -lX +yX +lX +lX -yX": (None, 1),
    "make-left-tuck-twist- -lX -yX +lX +lX +yX": (None, 1),
    "make-left-split+ -lX +yX +lX +lX -yX": (None, 1),
    "start> -lX +lX +yX": (None, 5),
    "knit-twisted+ -lX +yX +lX -yX": (half_turn, 3),
    "knittuck+ -lX +yX +lX -yX": (both_halves, 4),
    "knit-to-left -l2 -y1 +l1 +y1": (both_halves, 4),
    "tuck-twist+ -lX +yX +lX -yX": (None, 1),
    "slip+ -lX +yX +lX -yX": (None, 1),
    "edge-stitch -lX -lX +yX -yX": (None, 2),
    "turn-tuck)(( -lX +lX +yX -yX": (None, 1),
    "yarn-over+ +yX +lX -yX": (None, 1),
    "yarn-over-twist+ +yX +lX -yX": (None, 2),
    "decrease-double-right+ -lX -lX -lX +yX +lX -yX": (None, 3),
    "bind-off+ -lX +cX x -cX": (None, 3),
    "bind-off-first+ -lX +cX x -yX": (None, 1),
    "bind-off-next+ -lX +yX +lX -cX": (None, 1),
    "bind-off-last+ -lX +yX x -cX": (None, 3),
    "bind-off-only+ -lX +yX x -yX": (None, 2),
    "seam+ -lX +yX -lX -yX": (None, 2),
    "hold+ -lX +yX x -yX": (None, 1),
    "split-front-to-right -l0 -l1 +y1 +l1 +l1 -y1": (None, 2),
    "split-front-to-right -l1 -l0 +y1 +l1 +l1 -y1": (None, 4),
    "split-front-to-right -l1 -l1 +y1 +l2 +l1 -y1": (None, 6),
}


def tune(k, base, starts=None, iters=60, span=0.2, noise=0.05, fix_z=False):
    """Searches template k from its seed and from disturbed copies of it; the best that keeps 1.53 r clear wins."""
    sym, n = SEARCH.get(k, (None, 1))
    rng = np.random.default_rng(0)
    best = None
    for i in range(starts or n):
        lib = expand(base)
        lib[k] = t = copy.deepcopy(base[k])
        spec = [("knot", 0, c) for c in ("u", "v", "tilt", "l")] if k == KP else all_params(t, fix_z)
        if i:
            x = get_params(t, spec)
            set_params(t, spec, x + rng.normal(0, noise, len(x)) * np.array([0.3 if c[-1] == "l" else 1 for c in spec]))
        if sym:
            sym(t)
        if k == KP:        # stockinette, rib and garter at once
            def with_purl(t):
                mirror_knit(t)
                lib[PP] = dict(derive(t, ["mirror-z"]), name="purl+")
            with_purl(t)
            sws = [grid([[KP] * 3] * 4, lib), grid([[KP, PP, PP, KP]] * 4, lib), grid([[KP] * 3, [PP] * 3, [PP] * 3, [KP] * 3], lib)]
            ob = Objective(sws, lib, {KP, PP}, w_bend=0.02, target=2.06)
            search(ob, lib, k, spec, with_purl, iters=iters, span=span)
            return lib[k]
        sw = alone(k, lib) if k.startswith(("split-", "turn-tuck", "seam")) else sheet(context(k, lib), lib)
        ob = Objective([sw], lib, {k})
        search(ob, lib, k, spec, sym, iters=iters, span=span)
        m = measure(sw, lib, only={f for f, (q, _) in enumerate(sw.faces) if q == k})
        score = ob(lib) + 200 * max(0, 0.765 - m["min"])
        if best is None or score < best[0]:
            best = (score, copy.deepcopy(lib[k]))
    return best[1]


def expand(base):
    """The library that families() makes of these templates."""
    lib = dict(base)
    todo = [it for items in families().values() for it in items if not isinstance(it, str)]
    while todo:
        rest = []
        for it in todo:
            n, src, by = it[0], it[1], list(it[2:])
            n, _, want = n.partition("=")
            if src not in lib:
                rest.append(it)
                continue
            t = derive(lib[src], by)
            t["name"] = n
            if want:
                t["edges"] = want.split()
            lib[key(t)] = t
        assert len(rest) < len(todo)
        todo = rest
    return lib


# ---------------------------------------------------------------- pictures

PALETTE = [(214, 96, 77), (67, 147, 195), (90, 174, 97), (231, 170, 50), (153, 112, 171), (110, 110, 110), (53, 151, 143),
           (191, 129, 45)]


def draw(sw, lib, path, back=False, px=110, window=None, colour="yarn", r=None, view=None):
    """Tubes as shaded spheres in a depth buffer."""
    from PIL import Image
    r = (r or R) * sw.gauge
    cs = curves(sw, lib, step=r / 5)
    pts = [x for x, _, _ in cs]
    rot = np.eye(3) if view is None else np.asarray(view)
    pts = [x @ rot.T for x in pts]
    V = sw.v @ rot.T
    if back:
        pts = [x * [-1, 1, -1] for x in pts]
        V = V * [-1, 1, -1]
    allp = np.vstack(pts)
    lo, hi = allp.min(0) - 2 * r, allp.max(0) + 2 * r
    if window:
        lo[:2], hi[:2] = window[0], window[1]
    sc = px / sw.gauge
    W, Hh = int((hi[0] - lo[0]) * sc) + 1, int((hi[1] - lo[1]) * sc) + 1
    img = np.full((Hh, W, 3), 250.0)
    zb = np.full((Hh, W), -1e9)
    rp = r * sc
    k = int(math.ceil(rp))
    gy, gx = np.mgrid[-k:k + 1, -k:k + 1]
    for ci, x in enumerate(pts):
        col = np.array(PALETTE[ci % len(PALETTE)], float)
        own = cs[ci][1]
        for j, q in enumerate(x):
            if colour == "face":
                col = np.array(PALETTE[own[j] % len(PALETTE)], float)
            cx, cy = (q[0] - lo[0]) * sc, (hi[1] - q[1]) * sc
            ix, iy = int(round(cx)), int(round(cy))
            if ix < -k or iy < -k or ix >= W + k or iy >= Hh + k:
                continue
            dx, dy = (gx + ix - cx) / rp, (gy + iy - cy) / rp
            rr = dx * dx + dy * dy
            m = rr < 1
            X, Y = gx[m] + ix, gy[m] + iy
            ins = (X >= 0) & (Y >= 0) & (X < W) & (Y < Hh)
            X, Y = X[ins], Y[ins]
            nz = np.sqrt(1 - rr[m][ins])
            z = q[2] + r * nz
            up = z > zb[Y, X]
            X, Y, nz, z = X[up], Y[up], nz[up], z[up]
            zb[Y, X] = z
            lit = 0.35 + 0.65 * np.clip(0.8 * nz - 0.35 * dx[m][ins][up] - 0.45 * dy[m][ins][up], 0, 1)
            img[Y, X] = col * lit[:, None]
    # face outlines
    for _, ix in sw.faces:
        q = V[ix]
        for a, b in zip(q, np.roll(q, -1, 0)):
            n = int(np.hypot(*(b - a)[:2]) * sc) + 2
            s = np.linspace(0, 1, n)[:, None]
            e = a + s * (b - a)
            X, Y = ((e[:, 0] - lo[0]) * sc).astype(int), ((hi[1] - e[:, 1]) * sc).astype(int)
            ok = (X >= 0) & (Y >= 0) & (X < W) & (Y < Hh)
            img[Y[ok], X[ok]] = img[Y[ok], X[ok]] * 0.6
    Image.fromarray(np.clip(img, 0, 255).astype(np.uint8)).save(path)


def main(argv):
    if argv[:1] == ["make"]:
        make(argv[1:] or None)
    elif argv[:1] == ["write"]:
        make(only_write=True)
    elif argv[:1] == ["check"]:
        return check(argv[1:])
    elif argv[:1] == ["draw"] and len(argv) > 1:
        lib = load_library()
        os.makedirs(argv[1], exist_ok=True)
        for name, sw in swatches(lib, argv[3:]):
            if len(argv) > 2 and argv[2] and argv[2] not in name:
                continue
            sw.build(lib)
            for back in (False, True):
                f = "".join(c if c.isalnum() or c in "-+" else {"<": "l", ">": "r", "(": "c", ")": "o"}.get(c, "_") for c in name)
                draw(sw, lib, os.path.join(argv[1], f + ("-back" if back else "") + ".png"), back=back, px=120)
    else:
        print(__doc__)
        return 2
    return 0


def swatches(lib, meshes=()):
    """(name, swatch) of every tiled swatch, then of the given mesh files."""
    yield "stockinette", grid([[KP] * 5, [KM] * 5] * 2 + [[KP] * 5], lib)
    yield "rib 1x1", grid([[KP, PP, KP, PP, KP], [KM, PM, KM, PM, KM]] * 2, lib)
    yield "garter", grid([[KP] * 5, [PM] * 5] * 2 + [[KP] * 5], lib)
    yield "seed stitch", grid([[KP, PP, KP, PP, KP], [PM, KM, PM, KM, PM]] * 2, lib)
    sq = [["over", "under"] * 2, ["under", "over"] * 2] * 2
    sq = [[x + " -a1 +e1 +a1 -e1" for x in row] for row in sq]
    w = grid(sq, lib)
    w.v[:, 0] *= 0.4
    w.v[:, 1] *= 0.4 / H
    yield "plain weave", w
    e4, m4 = " -lX +yX +lX -yX", " -lX -yX +lX +yX"
    yield "cast on, drop", sheet([["tuck-twist+" + e4] * 4, [KM] * 4, [KP] * 4, ["drop- -l1 -y0 +l0 +y0"] * 4], lib)
    for n in ("slip", "slip-front"):
        yield n + " column", grid([[KP] * 4, [KP, n + "+" + e4, KP, KP], [KM] * 4, [KP, KP, n + "+" + e4, KP], [KM] * 4], lib)
    placed = ("knit-twisted", "knittuck", "tuck+", "tuck-", "tuck-front", "make", "decrease", "purl-decrease", "start", "end", "edge-stitch",
              "yarn-over", "bind-off", "purl-bind-off", "hold", "draw", "purl-twisted", "purltuck", "purl-make")
    for k in lib:
        n = k.split(" ")[0]
        if n.startswith(placed) and not n.startswith(("tuck-twist", "tuck-behind", "tuck-infront")) or k == "knit-to-left -l2 -y1 +l1 +y1":
            yield k, sheet(context(k, lib, PP if n.startswith("purl") else None), lib)
    for k in lib:
        if k.startswith(("split-", "tuck-behind", "tuck-infront", "knit-to", "purl-to", "loop", "yarn-", "turn", "edge", "pick-up", "seam", "in", "out",
                         "spacer", "xfer")) and lib[k]["yarns"]:
            yield "alone: " + k, alone(k, lib)
    for m in meshes:
        yield os.path.basename(m), from_smobj(m, lib)


def check(meshes):
    """Validates everything, then measures. Mesh files given on the command line are measured too."""
    lib = load_library()
    bad = 0
    for k, t in lib.items():
        for line in validate(t):
            bad += 1
            print(f"{k}: {line}")
    print(f"{len(lib)} templates, {bad} faults")
    print(f"{'swatch':58} min/2r  <1.5r   <2r   (whole; then the faces of the stitch alone)")
    for name, sw in swatches(lib, meshes):
        sw.build(lib)
        if "alone" in name:
            m = measure(sw, lib)
            if m["min"] > 0.75:
                continue
        m = measure(sw, lib)
        foc = {f for f, (q, _) in enumerate(sw.faces) if q == name}
        extra = ""
        if foc:
            g = measure(sw, lib, only=foc)
            extra = f"   {g['min']:.3f} {100 * g['s15']:5.1f}% {100 * g['s2']:5.1f}%"
        low = "" if m["min"] >= 0.75 else f"   LOW between {sw.faces[m['where'][0]][0]} and {sw.faces[m['where'][1]][0]} at {m['where'][2]}"
        if sw.unjoined:
            low += f"   {len(sw.unjoined)} loose ends at joined edges"
        print(f"{name:58} {m['min']:.3f} {100 * m['s15']:6.2f}% {100 * m['s2']:5.1f}%{extra}{low}", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
