// The tabulated start. Twin of src/knot/table.rs.

// [node][group][value, half slopes][unknown of a group], then [node] whether the cell above is whole.
@group(0) @binding(7) var<storage, read> table: array<f32>;

const GROUP: u32 = 4u;

fn flag(a: bool, b: bool) -> f32 {
    return select(0.0, 1.0, a && b);
}

fn reach(flags: vec3<f32>, strides: vec3<f32>) -> f32 {
    return flags.x * strides.x + flags.y * strides.y + flags.z * strides.z;
}

// Turns `state`, the affine start, into the tabulated one.
fn correct_start(frame: Frame) {
    let groups = (UNKNOWNS + GROUP - 1u) / GROUP;
    let h = sqrt(frame.f12 * frame.f12 + frame.f22 * frame.f22);
    var strains = vec3<f32>(
        2.0 * (frame.f11 - 1.0) / (frame.f11 + 1.0),
        frame.f12 / h,
        2.0 * (h - 1.0) / (h + 1.0),
    );
    var strides = GRID_STRIDES;
    // Faces sheared the other way see the grid mirrored.
    let mirrored = strains.y < 0.0;
    let side = select(1.0, -1.0, mirrored);
    strains.y = abs(strains.y);
    strides.y = strides.y * side;
    var base = 0.0;
    var f: array<f32, 3>;
    var steps: array<f32, 3>;
    for (var i = 0u; i < 3u; i++) {
        let rest = GRID_BELOW[i];
        let begin = select(rest, 0.0, i == 1u);
        let x = strains[i] * GRID_DENSITY + begin;
        let last = GRID_ABOVE[i] + begin;
        let inside = smaller(larger(x, 0.0), last);
        let cell = smaller(floor(inside), last - 1.0);
        f[i] = inside - cell;
        steps[i] = x - cell;
        base += select(cell, rest * side + cell, i == 1u) * strides[i];
    }
    let lowest = base - select(0.0, GRID_STRIDES.y, mirrored);
    // The greatest fraction steps first; equal ones in the order of the axes.
    let xy = f[1] <= f[0];
    let xz = f[2] <= f[0];
    let yz = f[2] <= f[1];
    let first = vec3<f32>(flag(xy, xz), flag(!xy, yz), flag(!xz, !yz));
    let last = vec3<f32>(flag(!xy, !xz), flag(xy, !yz), flag(xz, yz));
    let high = larger(larger(f[0], f[1]), f[2]);
    let low = smaller(smaller(f[0], f[1]), f[2]);
    let middle = larger(smaller(f[0], f[1]), smaller(larger(f[0], f[1]), f[2]));
    let diagonal = base + strides.x + strides.y + strides.z;
    let weights = vec4<f32>(1.0 - high, high - middle, middle - low, low);
    let but_last = vec3<f32>(1.0 - last.x, 1.0 - last.y, 1.0 - last.z);
    var ahead = array<vec3<f32>, 4>(vec3<f32>(0.0), first, but_last, vec3<f32>(1.0));
    var shares: array<vec4<f32>, 4>;
    for (var m = 0u; m < 4u; m++) {
        let w = weights[m];
        let a = ahead[m];
        shares[m] = vec4<f32>(w, w * (steps[0] - a.x), w * (steps[1] - a.y) * side, w * (steps[2] - a.z));
    }
    var nodes = vec4<f32>(base, base + reach(first, strides), diagonal - reach(last, strides), diagonal);
    let whole = table[GRID_NODES * groups * 16u + min(u32(lowest), GRID_NODES - 1u)];
    if whole < 0.5 {
        // The branch of optima breaks here: one node counts alone.
        let most = larger(larger(larger(weights.x, weights.y), weights.z), weights.w);
        var found = false;
        for (var m = 0u; m < 4u; m++) {
            let nearest = most <= weights[m] && !found;
            found = found || nearest;
            let twice = 2.0 / select(1.0, weights[m], nearest);
            let only = vec4<f32>(1.0, shares[m].y * twice, shares[m].z * twice, shares[m].w * twice);
            shares[m] = select(vec4<f32>(0.0), only, nearest);
        }
    }
    let shortest = stencil.yarn_radius * 0.5;
    for (var group = 0u; group < groups; group++) {
        var sums = array<f32, 4>(0.0, 0.0, 0.0, 0.0);
        for (var m = 0u; m < 4u; m++) {
            let block = (min(u32(nodes[m]), GRID_NODES - 1u) * groups + group) * 16u;
            for (var j = 0u; j < 4u; j++) {
                let share = shares[m][j];
                for (var u = 0u; u < 4u; u++) {
                    sums[u] += share * table[block + 4u * j + u];
                }
            }
        }
        for (var i = 0u; i < 2u; i++) {
            let k = 2u * group + i;
            if k < KNOTS {
                state[k] = stepped(state[k], sums[2u * i], sums[2u * i + 1u]);
                state[k].half_length = larger(state[k].half_length, shortest);
            }
        }
    }
}
