// Places and normals in the words of the surface, which each shader binds for itself.

fn at_surface(i: u32) -> vec3<f32> {
    return vec3<f32>(
        bitcast<f32>(surface[3u * i]),
        bitcast<f32>(surface[3u * i + 1u]),
        bitcast<f32>(surface[3u * i + 2u]),
    );
}
