// Curves through control points, sampled: a segment a thread. Twin of src/knot/curve.rs.

struct CurveSizes {
    yarns: u32,
    // The control points of this dispatch.
    begin: u32,
    end: u32,
    // Extra points a segment, and what they lie apart.
    subdivide: u32,
    step: f32,
    // The sample that the buffer begins with.
    first_sample: u32,
}

@group(0) @binding(0) var<uniform> sizes: CurveSizes;
// [yarn + 1] first control point, and how many of the yarns before have ends.
@group(0) @binding(1) var<storage, read> yarns: array<u32>;
@group(0) @binding(2) var<storage, read> points: array<f32>;
@group(0) @binding(3) var<storage, read_write> curves: array<f32>;

fn point_at(i: u32) -> vec3<f32> {
    return vec3<f32>(points[3u * i], points[3u * i + 1u], points[3u * i + 2u]);
}

fn put_sample(i: u32, p: vec3<f32>) {
    curves[3u * i] = p.x;
    curves[3u * i + 1u] = p.y;
    curves[3u * i + 2u] = p.z;
}

// The yarn of a control point: the last that does not begin after it.
fn yarn_of(point: u32) -> u32 {
    var low = 0u;
    var high = sizes.yarns;
    while low + 1u < high {
        let middle = (low + high) / 2u;
        if yarns[middle] <= point {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

fn spacing(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return sqrt(length3(b - a));
}

fn usable(a: f32, b: f32) -> bool {
    return 0.0 < a && 0.0 < b && finite(a + b);
}

// A point before the first or after the last mirrors its neighbour.
fn mirrored(end: u32, other: u32) -> vec3<f32> {
    let p = point_at(end);
    return p + p - point_at(other);
}

@compute @workgroup_size(WORKGROUP)
fn curve(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let point = sizes.begin + thread_of(id, groups);
    if point >= sizes.end {
        return;
    }
    let yarn = yarn_of(point);
    let begin = yarns[yarn];
    let n = yarns[yarn + 1u] - begin;
    let before = yarns[sizes.yarns + 1u + yarn];
    let closed = yarns[sizes.yarns + 2u + yarn] == before;
    let i = point - begin;
    let each = sizes.subdivide + 1u;
    // Each yarn with ends has a segment less than points.
    let to = point * each - before * sizes.subdivide - sizes.first_sample;
    let p1 = point_at(point);
    put_sample(to, p1);
    let last = n - 1u;
    if !closed && i == last {
        return;
    }
    var p0: vec3<f32>;
    var p2: vec3<f32>;
    var p3: vec3<f32>;
    if closed {
        p0 = point_at(begin + (i + last) % n);
        p2 = point_at(begin + (i + 1u) % n);
        p3 = point_at(begin + (i + 2u) % n);
    } else {
        p2 = point_at(point + 1u);
        if i == 0u {
            p0 = mirrored(begin, begin + min(last, 1u));
        } else {
            p0 = point_at(point - 1u);
        }
        if i + 2u > last {
            p3 = mirrored(begin + last, begin + last - 1u);
        } else {
            p3 = point_at(point + 2u);
        }
    }
    let d0 = spacing(p0, p1);
    let d1 = spacing(p1, p2);
    let d2 = spacing(p2, p3);
    let chord = p2 - p1;
    var leave = chord;
    var arrive = chord;
    if usable(d0, d1) {
        let across = (p2 - p0) * (1.0 / (d0 + d1));
        leave = chord + ((p1 - p0) * (1.0 / d0) - across) * d1;
    }
    if usable(d1, d2) {
        let across = (p3 - p1) * (1.0 / (d1 + d2));
        arrive = chord + ((p3 - p2) * (1.0 / d2) - across) * d1;
    }
    for (var k = 1u; k < each; k++) {
        let t = f32(k) * sizes.step;
        let t2 = t * t;
        let t3 = t2 * t;
        let a = 2.0 * t3 - 3.0 * t2 + 1.0;
        let b = t3 - 2.0 * t2 + t;
        let c = t3 - t2;
        let d = 3.0 * t2 - 2.0 * t3;
        put_sample(to + k, p1 * a + leave * b + p2 * d + arrive * c);
    }
}
