// Vectors, as in src/math/vector.rs: sums written out, for the built-in functions leave their order open.

fn dot2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.x + a.y * b.y;
}

fn turned(a: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(-a.y, a.x);
}

fn dot3(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn cross3(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

fn length3(a: vec3<f32>) -> f32 {
    return sqrt(dot3(a, a));
}

// By the bits: compilers may take it for granted that numbers are finite.
fn finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn finite3(a: vec3<f32>) -> bool {
    return finite(a.x) && finite(a.y) && finite(a.z);
}

fn smaller(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

fn larger(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

// The direction; zero where the vector is zero or not finite.
fn normalized_or_zero(a: vec3<f32>) -> vec3<f32> {
    let length = length3(a);
    let usable = 0.0 < length && finite(length);
    let scale = 1.0 / select(1.0, length, usable);
    return select(vec3<f32>(0.0), a * scale, usable);
}
