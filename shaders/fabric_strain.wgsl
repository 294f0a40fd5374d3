// From a strain to a place in the table. Twin of src/database/strain.rs.

// The axes' nodes, each with one over the width of the interval that begins there; then the pattern's rows (vertex, height,
// twist); then displacements along u, v and height and twist, `[vertex][sy][sa][sx]`.
@group(0) @binding(1) var<storage, read> pattern: array<vec4<u32>>;

// Where a strain lies in the table.
struct Cell {
    node: u32,
    fraction: vec3<f32>,
    outside: bool,
}

fn within(x: f32) -> f32 {
    return larger(smaller(x, MOST), -MOST);
}

// Keeps the eigenvalues of C (uu, uv, vv) from falling below their bound: both are mean and deviation, and the clamped ones
// share their eigenvectors. What is no number is rest.
fn clamped(c: vec3<f32>) -> vec3<f32> {
    let known = select(vec3<f32>(1.0, 0.0, 1.0), c, finite3(c));
    let uu = within(known.x);
    let uv = within(known.y);
    let vv = within(known.z);
    let mean = (uu + vv) * 0.5;
    let lean = (uu - vv) * 0.5;
    let deviation = sqrt(lean * lean + uv * uv);
    let high = larger(mean + deviation, settings.least);
    let low = larger(mean - deviation, settings.least);
    let middle = (high + low) * 0.5;
    let spread = (high - low) * 0.5;
    // Where the deviation is nothing, so are the components that it scales.
    let scale = spread / larger(deviation, 1e-30);
    return vec3<f32>(middle + lean * scale, uv * scale, middle - lean * scale);
}

// sx, sa, sy of a clamped strain.
fn strains(c: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(sqrt(c.x) - 1.0, c.y / sqrt(c.x * c.z), sqrt(c.z) - 1.0);
}

struct Along {
    node: u32,
    fraction: f32,
    outside: bool,
}

fn axis_node(at: u32) -> vec2<f32> {
    return bitcast<vec2<f32>>(pattern[at].xy);
}

// Along the axis whose nodes begin at `begin`.
fn find_along(begin: u32, count: u32, s: f32) -> Along {
    let first = axis_node(begin);
    let last = axis_node(begin + count - 1u).x;
    var node = 0u;
    var at = first;
    for (var j = 1u; j + 1u < count; j++) {
        let next = axis_node(begin + j);
        let beyond = next.x <= s;
        node = select(node, j, beyond);
        at = select(at, next, beyond);
    }
    let fraction = smaller(larger((s - at.x) * at.y, 0.0), 1.0);
    return Along(node, select(0.0, fraction, count > 1u), s < first.x || last < s);
}

// The cell that strains fall into, the nearest one outside the table, and whether they are outside.
fn find(s: vec3<f32>) -> Cell {
    let x = find_along(0u, settings.axis_sx, s.x);
    let a = find_along(settings.axis_sx, settings.axis_sa, s.y);
    let y = find_along(settings.axis_sx + settings.axis_sa, settings.axis_sy, s.z);
    // A stride of 0 is that of an axis of one node, whose only one is node 0.
    return Cell(
        x.node + a.node * settings.table_sa + y.node * settings.table_sy,
        vec3<f32>(x.fraction, a.fraction, y.fraction),
        x.outside || a.outside || y.outside,
    );
}
