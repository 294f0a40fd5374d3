#!/usr/bin/env python3
"""Optima of the stitch energy, found by SciPy from the same start as ours.

An implementation of the model of its own: it shares no code with the program, only the templates, which it
takes from `knotmesh templates --json`. Needs numpy and scipy (made with 2.4 and 1.17). After a change of
templates/ run, from the repository's root:

    cargo build --release && python3 tests/data/optima.py all

    optima.py affine          writes tests/data/optima.json: every template with knots under random affine
                              deformations, principal stretches log-uniform in 0.7..1.5
    optima.py tube            writes tests/data/tube.smobj, a strongly deformed tube with knit, purl and
                              decreases, tube-rest.smobj, the same at rest, and tube.json, the optimum of
                              each face of the first
    optima.py all             both
    optima.py garment MESH    runs `knotmesh relax` on a mesh and counts the faces that end above SciPy's
                              optimum; `--deform` bends, stretches and shakes the mesh first, `--every N`
                              takes each N-th face, `--iterations N`
"""
import argparse
import json
import multiprocessing
import os
import subprocess
import tempfile

import numpy as np
import scipy
from scipy.optimize import least_squares

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
KNOTMESH = os.environ.get("KNOTMESH", os.path.join(ROOT, "target", "release", "knotmesh"))
W_ANGLE, W_LENGTH = 1.0, 100.0


def mean_value(corners, q):
    """Floater's weights at q; also for complex q (complex steps give gradients)."""
    s = corners - q
    r = np.sqrt(s[:, 0] ** 2 + s[:, 1] ** 2)
    t, rt = np.roll(s, -1, axis=0), np.roll(r, -1)
    cross = s[:, 0] * t[:, 1] - s[:, 1] * t[:, 0]
    half = cross / (r * rt + s[:, 0] * t[:, 0] + s[:, 1] * t[:, 1])
    w = (np.roll(half, 1) + half) / r
    return w / w.sum()


def weights(corners, q):
    """Weights at q, linear on edges."""
    n = len(corners)
    for e in range(n):
        a, b = corners[e], corners[(e + 1) % n]
        t = np.clip((q - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        if np.linalg.norm(q - a - t * (b - a)) < 1e-9:
            w = np.zeros(n)
            w[e], w[(e + 1) % n] = 1 - t, t
            return w
    return mean_value(corners, q)


def mean_gradients(corners):
    """Gradients of the weights at the mean of the corners, by complex steps."""
    q, h = corners.mean(axis=0), 1e-30
    steps = [q + np.array([1j * h, 0]), q + np.array([0, 1j * h])]
    return np.stack([mean_value(corners, s).imag / h for s in steps], axis=1)


class Template:
    """A template with its rest values."""

    def __init__(self, t):
        self.key = " ".join([t["name"]] + t["edges"])
        self.corners = np.array(t["corners"])
        self.r = t["yarn_radius"]
        self.centers = np.array([k["center"] for k in t["knots"]]).reshape(-1, 2)
        tilt = np.array([k["tilt"] for k in t["knots"]])
        self.d0 = np.stack([np.cos(tilt), np.sin(tilt)], axis=1).reshape(-1, 2)
        self.l0 = np.array([k["half_length"] for k in t["knots"]])
        plane, z, contacts, controls, segments, pairs, self.shape = [], [], [], [], [], [], []
        for yarn in t["yarns"]:
            first = len(z)
            for p in yarn:
                i = len(z)
                if "edge" in p:
                    a, b = self.corners[p["edge"]], self.corners[(p["edge"] + 1) % len(self.corners)]
                    at = a + p["along"] * (b - a)
                    self.shape += [0, p["edge"], p["along"], p["z"]]
                elif "contact" in p:
                    k, at = p["knot"], self.centers[p["knot"]]
                    contacts.append((i, k, p["contact"]))
                    self.shape += [1, k, p["contact"], p["z"]]
                elif "control" in p:
                    k, at = p["knot"], self.centers[p["knot"]]
                    controls.append((i, k, p["control"]))
                    self.shape += [2, k, p["control"], p["z"]]
                else:
                    at = np.array(p["at"])
                    self.shape += [3, at[0], at[1], p["z"]]
                plane.append(at)
                z.append(p["z"])
            s = len(segments)
            segments += range(first, len(z) - 1)
            pairs += range(s, len(segments) - 1)
        self.plane, self.z = np.array(plane).reshape(-1, 2), np.array(z)
        table = lambda rows: np.array(rows, dtype=int).reshape(-1, 3).T
        self.contacts, self.controls = table(contacts), table(controls)
        self.segments, self.pairs = np.array(segments, dtype=int), np.array(pairs, dtype=int)
        self.weights = np.array([weights(self.corners, q) for q in self.plane])
        self.center_weights = np.array([weights(self.corners, q) for q in self.centers])
        self.gradients = mean_gradients(self.corners)
        rest = np.stack([np.arctan2(self.d0[:, 1], self.d0[:, 0]), self.l0], axis=1).ravel()
        self.len0, self.cos0 = self.values(rest, self.plane, self.centers)[:2]

    def numbers(self):
        """What the template consists of, to recognise it by."""
        knots = np.concatenate([self.centers, self.d0, self.l0[:, None]], axis=1)
        flat = [*self.corners.ravel(), self.r, *knots.ravel(), *self.shape]
        return [float(f"{x:.12g}") for x in flat]

    def values(self, x, plane, centers):
        """Lengths and cosines of the points, and their derivatives by x = (theta, l) for each knot."""
        theta, l = x[0::2], x[1::2]
        d = np.stack([np.cos(theta), np.sin(theta)], axis=1)
        t = np.stack([-d[:, 1], d[:, 0]], axis=1)
        p = np.concatenate([plane, self.z[:, None]], axis=1)
        dp = np.zeros((len(x), len(p), 3))
        i, k, s = self.contacts
        p[i, :2] = centers[k] + (s * l[k])[:, None] * d[k]
        dp[2 * k, i, :2] = (s * l[k])[:, None] * t[k]
        dp[2 * k + 1, i, :2] = s[:, None] * d[k]
        i, k, s = self.controls
        p[i, :2] = centers[k] - (s * self.r)[:, None] * t[k]
        dp[2 * k, i, :2] = (s * self.r)[:, None] * d[k]
        e = p[self.segments + 1] - p[self.segments]
        de = dp[:, self.segments + 1] - dp[:, self.segments]
        length = np.sqrt((e * e).sum(axis=1))
        inverse = np.where(length > 0, 1 / np.where(length > 0, length, 1), 0)
        dlength = (de * e).sum(axis=2) * inverse
        unit = e * inverse[:, None]
        dunit = (de - dlength[:, :, None] * unit) * inverse[:, None]
        a, b = unit[self.pairs], unit[self.pairs + 1]
        dcos = (dunit[:, self.pairs] * b + a * dunit[:, self.pairs + 1]).sum(axis=2)
        return length, (a * b).sum(axis=1), dlength, dcos

    def solve(self, plane, centers, f):
        """E at the affine start, E and x where SciPy ends from there."""
        v = self.l0[:, None] * (self.d0 @ f.T)
        shortest = self.r / 2
        start = np.stack(
            [np.arctan2(v[:, 1], v[:, 0]), np.maximum(np.linalg.norm(v, axis=1), shortest)], axis=1
        ).ravel()
        wa, wl = np.sqrt(W_ANGLE), np.sqrt(W_LENGTH)

        def residuals(x):
            length, cos = self.values(x, plane, centers)[:2]
            return np.concatenate([wl * (length - self.len0), wa * (cos - self.cos0)])

        def jacobian(x):
            dlength, dcos = self.values(x, plane, centers)[2:]
            return np.concatenate([wl * dlength, wa * dcos], axis=1).T

        low = np.tile([-np.inf, shortest], len(self.l0))
        r0 = residuals(start)
        found = least_squares(
            residuals, start, jacobian, (low, np.inf), ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=3000
        )
        return r0 @ r0, 2 * found.cost, found.x


def library():
    text = subprocess.run([KNOTMESH, "templates", "--json"], check=True, capture_output=True, text=True)
    return {t.key: t for t in map(Template, json.loads(text.stdout))}


def upper(f):
    """F in the face frame: course along t1."""
    t1 = f[:, 0] / np.linalg.norm(f[:, 0])
    return np.array([t1, [-t1[1], t1[0]]]) @ f


def shortened(values, digits):
    return [float(f"{x:.{digits}g}") for x in values]


def dump(name, data):
    path = os.path.join(HERE, name)
    with open(path, "w") as file:
        # One template or face a line.
        lines = [f'"{k}": {json.dumps(v)}' for k, v in data.items() if k != "list"]
        rows = ",\n".join(json.dumps(x, separators=(",", ":")) for x in data["list"])
        file.write("{" + ",\n".join(lines) + ',\n"list": [\n' + rows + "\n]}\n")
    print(f"wrote {path}: {os.path.getsize(path)} bytes")


def affine_job(job):
    t, cases = job
    rows = []
    for sym in cases:
        f = upper(np.array([[sym[0], sym[1]], [sym[1], sym[2]]]))
        q = t.corners[0]
        e0, e, x = t.solve((t.plane - q) @ f.T, (t.centers - q) @ f.T, f)
        rows.append([*sym, *shortened([e0, e], 13), *shortened(x, 9)])
    return {"key": t.key, "template": t.numbers(), "cases": rows}


def random_symmetric(random, low, high):
    a, b = np.exp(random.uniform(np.log(low), np.log(high), 2))
    c, s = np.cos(turn := random.uniform(0, np.pi)), np.sin(turn)
    return [round(x, 6) for x in (a * c * c + b * s * s, (a - b) * c * s, a * s * s + b * c * c)]


def affine(arguments):
    random = np.random.default_rng(1)
    jobs = [
        (t, [random_symmetric(random, 0.7, 1.5) for _ in range(arguments.cases)])
        for t in library().values()
        if len(t.l0)
    ]
    with multiprocessing.Pool() as pool:
        rows = pool.map(affine_job, jobs, chunksize=1)
    note = "by tests/data/optima.py; a case: F_uu, F_uv, F_vv, E at the start, E, then theta, l of each knot"
    dump("optima.json", {"made": note, "scipy": scipy.__version__, "list": rows})


def tube():
    """Rounds of knit and purl in ribs, narrowed by decreases; positions before deformation."""
    random = np.random.default_rng(2)
    counts = [24, 24, 24, 20, 20, 20, 16, 16, 16, 16]
    rings, vertices, faces, types = [], [], [], []
    for k, count in enumerate(counts + counts[-1:]):
        # Ring k is below round k; a round with decreases has fewer faces than vertices below it.
        below = counts[k - 1] if k else count
        rings.append([len(vertices) + i for i in range(below)])
        for i in range(below):
            angle = 2 * np.pi * i / below
            vertices.append([below / (2 * np.pi) * np.cos(angle), below / (2 * np.pi) * np.sin(angle), 0.61 * k])
    for k, count in enumerate(counts):
        below, above = rings[k], rings[k + 1]
        i = 0
        for j in range(count):
            twice = len(below) - i > count - j and (j % (count // (len(below) - count)) == 1)
            step = 2 if twice else 1
            low = [below[(i + m) % len(below)] for m in range(step + 1)]
            faces.append(low + [above[(j + 1) % count], above[j]])
            if twice:
                name = "decrease-right+" if j % 2 else "decrease-left+"
                types.append(name + " -lX -lX +yX +lX -yX")
            else:
                types.append(("purl+" if j % 4 == 3 else "knit+") + " -lX +yX +lX -yX")
            i += step
        assert i == len(below), (k, i, len(below))
    return np.array(vertices), faces, types, random


def deformed(v, random, noise):
    """A bend, uneven stretches and noise; vertices at one place move alike."""
    low, high = v.min(axis=0), v.max(axis=0)
    size, long = (high - low).max(), int(np.argmax(high - low))
    s = (v - low) / size
    other = [(long + 1) % 3, (long + 2) % 3]
    h = s[:, long]
    out = s.copy()
    out[:, other[0]] *= 1 + 0.45 * np.sin(7 * h)
    out[:, other[1]] *= 1 - 0.3 * np.sin(7 * h + 1)
    out[:, long] = h + 0.06 * np.sin(11 * h + 3 * s[:, other[0]])
    bend = 1.3 * out[:, long]
    x = out[:, other[0]] + 0.6
    out[:, long], out[:, other[0]] = x * np.sin(bend), x * np.cos(bend)
    _, place = np.unique(np.round(s, 6), axis=0, return_inverse=True)
    place = place.ravel()
    return low + size * out + noise * random.uniform(-1, 1, (place.max() + 1, 3))[place]


def write_smobj(path, vertices, faces, types):
    keys = sorted(set(types))
    edges = {}
    with open(path, "w") as file:
        file.write("# by tests/data/optima.py\n")
        file.writelines(f"L {key}\n" for key in keys)
        file.writelines("v " + " ".join(f"{x:.6f}" for x in v) + "\n" for v in vertices)
        file.writelines("f " + " ".join(str(i + 1) for i in f) + "\n" for f in faces)
        file.writelines(f"T {keys.index(t) + 1}\n" for t in types)
        for f, face in enumerate(faces):
            for e in range(len(face)):
                a, b = face[e], face[(e + 1) % len(face)]
                if (b, a) in edges:
                    g, other = edges[b, a]
                    file.write(f"e {g}/{other} {f + 1}/-{e + 1}\n")
                edges[a, b] = (f + 1, e + 1)


def read_smobj(path):
    labels, vertices, faces, types = [], [], [], []
    for line in open(path):
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[0] == "L":
            labels.append(" ".join(words[1:]))
        elif words[0] == "v":
            vertices.append([float(x) for x in words[1:4]])
        elif words[0] == "f":
            faces.append([int(x) - 1 for x in words[1:]])
        elif words[0] == "T":
            types.append(labels[int(words[1]) - 1])
    return np.array(vertices), faces, types


def matched(templates, key):
    """The template of a key, and the rotation that leads to it."""
    name, *labels = key.split()
    for k in range(len(labels)):
        t = templates.get(" ".join([name] + labels[k:] + labels[:k]))
        if t:
            return t, k
    raise SystemExit(f"no template of '{key}'")


def vector_area(v):
    return sum(np.cross(v[i] - v[0], v[i + 1] - v[0]) for i in range(1, len(v) - 1)) / 2


def polygon_area(p):
    q = np.roll(p, -1, axis=0)
    return (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum() / 2


def face_job(job):
    """A face's E at the start, E where SciPy ends, x, and E of a given x."""
    t, corners, given = job
    gradient = corners.T @ t.gradients
    a, b = gradient[:, 0], gradient[:, 1]
    normal = np.cross(a, b)
    if np.linalg.norm(normal) <= 1e-6 * (gradient**2).sum():
        return None
    t1 = a / np.linalg.norm(a)
    t2 = np.cross(normal / np.linalg.norm(normal), t1)
    frame = np.stack([t1, t2], axis=1)
    f = np.stack([frame.T @ a, frame.T @ b], axis=1)
    plane, centers = t.weights @ corners @ frame, t.center_weights @ corners @ frame
    e0, e, x = t.solve(plane, centers, f)
    again = None
    if given is not None:
        length, cos = t.values(given, plane, centers)[:2]
        again = W_LENGTH * ((length - t.len0) ** 2).sum() + W_ANGLE * ((cos - t.cos0) ** 2).sum()
    return e0, e, x, again


def face_jobs(templates, vertices, rest, faces, types, given=None, every=1):
    found = [matched(templates, key) for key in types]
    areas = [np.linalg.norm(vector_area(rest[f])) / polygon_area(t.corners) for f, (t, _) in zip(faces, found)]
    gauge = np.sqrt(np.mean(areas))
    jobs, which = [], []
    for i, (face, (t, k)) in enumerate(zip(faces, found)):
        if len(t.l0) and i % every == 0:
            corners = vertices[np.roll(face, -k)]
            jobs.append((t, (corners - corners[0]) / gauge, None if given is None else given(i, len(t.l0))))
            which.append(i)
    return gauge, which, jobs


def tube_data(_):
    vertices, faces, types, random = tube()
    path = os.path.join(HERE, "tube.smobj")
    rest = vertices
    write_smobj(os.path.join(HERE, "tube-rest.smobj"), vertices, faces, types)
    write_smobj(path, deformed(vertices, random, 0.12), faces, types)
    # Numbers as the file has them. The gauge is that of the tube at rest: given to both sides.
    vertices = read_smobj(path)[0]
    templates = library()
    gauge, which, jobs = face_jobs(templates, vertices, rest, faces, types)
    with multiprocessing.Pool() as pool:
        results = pool.map(face_job, jobs, chunksize=4)
    used = {key: matched(templates, key)[0].numbers() for key in sorted(set(types))}
    rows = [[i, *shortened(r[:2], 13), *shortened(r[2], 9)] for i, r in zip(which, results) if r]
    note = "by tests/data/optima.py; a face: its number, E at the start, E, then theta, l of each knot"
    dump("tube.json", {"made": note, "gauge": gauge, "templates": used, "list": rows})


def garment(arguments):
    vertices, faces, types = read_smobj(arguments.mesh)
    with tempfile.TemporaryDirectory() as folder:
        npz, frames = os.path.join(folder, "x.npz"), os.path.join(folder, "frames.npy")
        command = [KNOTMESH, "relax", arguments.mesh, "-o", npz, "--precision", "f64", "--mode", "relax"]
        command += ["--iterations", str(arguments.iterations), "--subdivide", "0", "--allow-degenerate"]
        rest = vertices
        if arguments.deform:
            edge = np.median([np.linalg.norm(vertices[f[0]] - vertices[f[1]]) for f in faces])
            vertices = deformed(vertices, np.random.default_rng(3), 0.1 * edge)
            np.save(frames, vertices[None])
            command += ["--frames", frames]
        subprocess.run(command, check=True, capture_output=True)
        result = dict(np.load(npz))
    offsets = result["face_knot_offsets"]

    def given(face, knots):
        at = slice(offsets[face], offsets[face] + knots)
        d, l = result["knot_direction"].reshape(-1, 2)[at], result["knot_half_length"].ravel()[at]
        return np.stack([np.arctan2(d[:, 1], d[:, 0]), l], axis=1).ravel()

    gauge, which, jobs = face_jobs(library(), vertices, rest, faces, types, given, arguments.every)
    print(f"gauge {gauge:.9f}, the program's {result['gauge'].ravel()[0]:.9f}")
    with multiprocessing.Pool() as pool:
        results = pool.map(face_job, jobs, chunksize=16)
    kept = [(i, r) for i, r in zip(which, results) if r and result["face_status"].ravel()[i] != 5]
    e0, e, again = (np.array([r[k] for _, r in kept]) for k in (0, 1, 3))
    own0 = np.array([result["face_energy_start"].ravel()[i] for i, _ in kept])
    own = np.array([result["face_energy"].ravel()[i] for i, _ in kept])
    print(f"E at the start: greatest difference {np.max(np.abs(e0 - own0) / (1 + e0)):.1e} of 1 + E")
    print(f"E at the end, of the program's own state: {np.max(np.abs(again - own) / (1 + own)):.1e} of 1 + E")
    gap = (own - e) / (1 + e)
    print(f"{len(gap)} faces; E median {np.median(own):.3g}, SciPy {np.median(e):.3g}")
    for limit in (1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        print(f"  by {limit:.0e}: above {100 * np.mean(gap > limit):.2f} %, below {100 * np.mean(gap < -limit):.2f} %")
    np.savez(os.path.join(tempfile.gettempdir(), "optima-garment.npz"), face=[i for i, _ in kept], gap=gap, e=e, own=own)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    modes = parser.add_subparsers(required=True)
    for name, run in [("affine", affine), ("tube", tube_data), ("all", None)]:
        mode = modes.add_parser(name)
        mode.add_argument("--cases", type=int, default=12)
        mode.set_defaults(run=run or (lambda a: (affine(a), tube_data(a))))
    mode = modes.add_parser("garment")
    mode.add_argument("mesh")
    mode.add_argument("--deform", action="store_true")
    mode.add_argument("--every", type=int, default=1)
    mode.add_argument("--iterations", type=int, default=60)
    mode.set_defaults(run=garment)
    arguments = parser.parse_args()
    arguments.run(arguments)


if __name__ == "__main__":
    main()
