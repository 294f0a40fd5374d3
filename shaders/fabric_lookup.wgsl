// Displacements between the nodes of the table. Twin of src/database/lookup.rs.

fn value(at: u32) -> vec4<f32> {
    return bitcast<vec4<f32>>(pattern[settings.first_value + at]);
}

fn between(a: vec4<f32>, b: vec4<f32>, t: f32) -> vec4<f32> {
    return a + (b - a) * t;
}

// The displacement of a pattern's vertex in a cell: along sy first, then sa, then sx.
fn displacement(vertex: u32, cell: Cell) -> vec4<f32> {
    let sa = settings.table_sa;
    let sy = settings.table_sy;
    let at = vertex * settings.table_nodes + cell.node;
    let t = cell.fraction;
    let near_left = between(value(at), value(at + sy), t.z);
    let near_right = between(value(at + 1u), value(at + sy + 1u), t.z);
    let far_left = between(value(at + sa), value(at + sa + sy), t.z);
    let far_right = between(value(at + sa + 1u), value(at + sa + sy + 1u), t.z);
    let left = between(near_left, far_left, t.y);
    let right = between(near_right, far_right, t.y);
    return between(left, right, t.x);
}
