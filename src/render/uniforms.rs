//! What shaders are told of a picture; layouts as in `shaders/yarn_eye.wgsl` and `shaders/yarn_shade.wgsl`.

use super::camera::Camera;
use super::colour::linear;
use super::look::{Background, Look, Shading};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4, Vec3, Vec4};

/// Something that yarn is seen from: the camera, or the light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Eye {
    /// To clip space, depth 1 near and 0 far.
    clip: [[f32; 4]; 4],
    /// Planes of what is seen, normals inwards, in the strands' own axes.
    planes: [[f32; 4]; 6],
    /// Place of the camera and 1, or the direction to the light and 0.
    place: [f32; 4],
    /// Pixels per unit at distance 1 (camera) or anywhere (light); detail; smallest radius in pixels; how many pixels a chord may be off.
    scale: [f32; 4],
}

/// How light falls, and what colours mean.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Light {
    /// To the light's clip space.
    clip: [[f32; 4]; 4],
    /// To the camera's axes, and depth to distance: `near`, focal length in pixels, half width, half height.
    view: [[f32; 4]; 4],
    lens: [f32; 4],
    /// To the key light; tangent of half its angle.
    key: [f32; 4],
    /// To the middle of the sky; yarn radius that scales shadows and occlusion.
    sky: [f32; 4],
    /// Texel of the shadow map in units, its texels a side, range of its depth in units, whether there is one.
    shadow: [f32; 4],
    /// Radius of occlusion in units, whether there is any, a turn of its directions, its strength.
    occlusion: [f32; 4],
    /// 0 yarn, 1 numbers, 2 tension; low and high of it; whether there are plies.
    shading: [f32; 4],
    /// Background at the top and at the bottom as light; opacity in the last.
    top: [f32; 4],
    bottom: [f32; 4],
}

/// A picture's geometry: everything in the strands' units.
pub struct Geometry {
    pub eye: Eye,
    pub from_light: Eye,
    pub light: Light,
}

/// What a picture is made of.
pub struct Setting<'a> {
    pub camera: &'a Camera,
    pub look: &'a Look,
    /// Pixels.
    pub size: [u32; 2],
    /// Of the strands: origin, unit.
    pub origin: DVec3,
    pub unit: f64,
    /// Box around them, in units, and a typical radius.
    pub bounds: [DVec3; 2],
    pub radius: f64,
    /// Texels of the shadow map a side.
    pub shadow_size: u32,
    /// Which of the look's samples this is, and of how many.
    pub pass: [u32; 2],
}

impl Geometry {
    pub fn new(setting: &Setting) -> Self {
        let Setting { camera, look, size, bounds, radius, .. } = *setting;
        let camera = Camera {
            eye: (camera.eye - setting.origin) / setting.unit,
            target: (camera.target - setting.origin) / setting.unit,
            ..*camera
        };
        let view = camera.to_view();
        let corners = corners(bounds);
        let depths = corners.map(|p| -view.transform_point3(p).z);
        let far = depths.iter().copied().fold(1e-6, f64::max) * 1.01 + radius;
        let near = (depths.iter().copied().fold(f64::INFINITY, f64::min) * 0.99 - radius)
            .clamp(far * 1e-4, far * 0.99);
        let [width, height] = size.map(f64::from);
        let tangent = (camera.field / 2.0).tan();
        let (focal, aspect) = (height / 2.0 / tangent, width / height);
        let [jitter, soft] = offsets(setting.pass);
        let mut projection = perspective(tangent, aspect, near);
        // A part of a pixel aside.
        projection.z_axis.x += jitter.0 * 2.0 / width;
        projection.z_axis.y += jitter.1 * 2.0 / height;
        let clip = projection * view;
        let axes = view.inverse();
        let own = |x: f64, y: f64, z: f64| axes.transform_vector3(DVec3::new(x, y, z)).normalize();
        // From the left above, in front; the sky from above.
        let size_of_key = 0.045;
        let key = own(-0.55 + soft.0 * size_of_key, 0.68 + soft.1 * size_of_key, 0.62);
        let sky = own(0.0, 0.85, 0.5);
        let seen = frustum(&axes, tangent, aspect, near, far);
        let (light_clip, texel, depth) = light_clip(key, &corners, &seen, radius, setting.shadow_size);
        let eye = |clip: DMat4, place: DVec4, pixels: f64, least: f32, off: f32| Eye {
            clip: columns(clip),
            planes: planes(clip),
            place: place.as_vec4().to_array(),
            scale: [pixels as f32, look.detail, least, off],
        };
        let (shading, low, high) = match look.shading {
            Shading::Yarn => (0.0, 0.0, 1.0),
            Shading::Numbers => (1.0, 0.0, 1.0),
            Shading::Tension([low, high]) => (2.0, low, high),
        };
        let (top, bottom) = match look.background {
            Background::Transparent => (Vec4::ZERO, Vec4::ZERO),
            Background::Gradient(top, bottom) => (opaque(top), opaque(bottom)),
        };
        let flag = |on: bool| f32::from(u8::from(on));
        Self {
            eye: eye(clip, camera.eye.extend(1.0), focal, 0.3, 0.5),
            // Shadows need no fine silhouettes.
            from_light: eye(light_clip, key.extend(0.0), 0.12 / texel, 0.5, 0.15),
            light: Light {
                clip: columns(light_clip),
                view: columns(view),
                lens: [near as f32, focal as f32, (width / 2.0) as f32, (height / 2.0) as f32],
                key: key.as_vec3().extend(0.06).to_array(),
                sky: sky.as_vec3().extend(radius as f32).to_array(),
                shadow: [texel as f32, setting.shadow_size as f32, depth as f32, flag(look.shadows)],
                occlusion: [
                    6.0 * radius as f32,
                    flag(look.occlusion),
                    setting.pass[0] as f32 / setting.pass[1] as f32,
                    1.0,
                ],
                shading: [shading, low, high, flag(look.plies)],
                top: top.to_array(),
                bottom: bottom.to_array(),
            },
        }
    }
}

fn opaque(colour: [u8; 3]) -> Vec4 {
    Vec3::from(colour.map(linear)).extend(1.0)
}

fn columns(matrix: DMat4) -> [[f32; 4]; 4] {
    matrix.as_mat4().to_cols_array_2d()
}

fn corners(bounds: [DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let pick = |axis: usize| bounds[i >> axis & 1][axis];
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

/// Where in a pixel, and where on the light, a pass takes its samples: (-0.5 to 0.5, -1 to 1). The first of one is the middle.
fn offsets([pass, passes]: [u32; 2]) -> [(f64, f64); 2] {
    if passes <= 1 {
        return [(0.0, 0.0), (0.0, 0.0)];
    }
    // The additive recurrence of Roberts' R2 sequence: even however many are taken.
    let at = |k: f64, i: u32| (0.5 + k * f64::from(i + 1)).fract();
    let (a, b) = (0.754_877_666_246_692_7, 0.569_840_290_998_053_2);
    let pixel = (at(a, pass) - 0.5, at(b, pass) - 0.5);
    let turn = at(0.618_033_988_749_894_9, pass) * std::f64::consts::TAU;
    let reach = ((f64::from(pass) + 0.5) / f64::from(passes)).sqrt();
    [pixel, (turn.cos() * reach, turn.sin() * reach)]
}

/// A projection with depth 1 at `near`, falling to 0 far away; x and y from -1 to 1.
fn perspective(tangent: f64, aspect: f64, near: f64) -> DMat4 {
    DMat4::from_cols(
        DVec4::new(1.0 / (tangent * aspect), 0.0, 0.0, 0.0),
        DVec4::new(0.0, 1.0 / tangent, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 0.0, -1.0),
        DVec4::new(0.0, 0.0, near, 0.0),
    )
}

/// Corners of what a camera sees.
fn frustum(axes: &DMat4, tangent: f64, aspect: f64, near: f64, far: f64) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let depth = if i & 4 == 0 { near } else { far };
        axes.transform_point3(DVec3::new(
            sign(0) * aspect * tangent * depth,
            sign(1) * tangent * depth,
            -depth,
        ))
    })
}

/// Planes of a clip space, normals inwards, of length 1.
fn planes(clip: DMat4) -> [[f32; 4]; 6] {
    let row = |i: usize| DVec4::new(clip.x_axis[i], clip.y_axis[i], clip.z_axis[i], clip.w_axis[i]);
    let (x, y, z, w) = (row(0), row(1), row(2), row(3));
    [w + x, w - x, w + y, w - y, w - z, z].map(|p| {
        // A plane at infinity keeps everything.
        let length = p.truncate().length();
        if length > 1e-12 { (p / length).as_vec4().to_array() } else { [0.0, 0.0, 0.0, 1.0] }
    })
}

/// What the light sees: all that may throw shadows on what is in the picture. With it a texel's size, and the range of depths.
fn light_clip(
    key: DVec3,
    corners: &[DVec3; 8],
    seen: &[DVec3; 8],
    radius: f64,
    texels: u32,
) -> (DMat4, f64, f64) {
    let right = key.any_orthonormal_vector();
    let up = key.cross(right);
    let turn = glam::DMat3::from_cols(right, up, key).transpose();
    let around = |points: &[DVec3; 8]| {
        points.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| {
            let p = turn * *p;
            [low.min(p), high.max(p)]
        })
    };
    let (all, view) = (around(corners), around(seen));
    let margin = 4.0 * radius;
    let low = all[0].max(view[0]) - margin;
    let high = all[1].min(view[1]) + margin;
    // As many texels a unit both ways; where nothing is seen, any will do.
    let side = (high - low).truncate().max_element().max(margin);
    let middle = (low + high) / 2.0;
    let (near, far) = (all[1].z + margin, all[0].z - margin);
    let depth = near - far;
    let clip = DMat4::from_cols(
        DVec4::new(2.0 / side, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 2.0 / side, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 1.0 / depth, 0.0),
        DVec4::new(-2.0 * middle.x / side, -2.0 * middle.y / side, -far / depth, 1.0),
    ) * DMat4::from_mat3(turn);
    (clip, side / f64::from(texels), depth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::camera::{Axes, View};

    fn setting<'a>(camera: &'a Camera, look: &'a Look) -> Setting<'a> {
        Setting {
            camera,
            look,
            size: [400, 300],
            origin: DVec3::new(5.0, 0.0, 0.0),
            unit: 0.5,
            bounds: [DVec3::splat(-1.0), DVec3::ONE],
            radius: 0.1,
            shadow_size: 512,
            pass: [0, 1],
        }
    }

    /// Seen red with depths of the wrong sign, and with the zoom the other way round.
    #[test]
    fn a_framed_box_is_in_the_picture_and_nearly_fills_it() {
        let bounds = [DVec3::new(4.5, -0.5, -0.5), DVec3::new(5.5, 0.5, 0.5)];
        let look = Look::default();
        for (name, view) in View::NAMES {
            let camera = Camera::framing(bounds, &Axes::Y_UP, view, 400.0 / 300.0, 1.0);
            let g = Geometry::new(&setting(&camera, &look));
            let clip = glam::Mat4::from_cols_array_2d(&g.eye.clip);
            let mut most = 0.0f32;
            for p in super::corners([DVec3::splat(-1.0), DVec3::ONE]) {
                let q = clip * p.as_vec3().extend(1.0);
                let q = q / q.w;
                assert!(q.x.abs() <= 1.0 && q.y.abs() <= 1.0 && (0.0..=1.0).contains(&q.z), "{name}: {q}");
                most = most.max(q.x.abs()).max(q.y.abs());
                let inside =
                    g.eye.planes.iter().all(|n| Vec4::from(*n).dot(p.as_vec3().extend(1.0)) >= -1e-4);
                assert!(inside, "{name}: {p} is outside a plane");
                let lit = glam::Mat4::from_cols_array_2d(&g.light.clip) * p.as_vec3().extend(1.0);
                assert!(
                    lit.x.abs() <= 1.0 && lit.y.abs() <= 1.0 && (0.0..=1.0).contains(&lit.z),
                    "{name}: {lit}"
                );
            }
            assert!(most > 0.9, "{name}: {most}");
        }
    }

    /// Seen red with depths of the wrong sign.
    #[test]
    fn a_point_nearer_has_the_greater_depth() {
        let bounds = [DVec3::new(4.5, -0.5, -0.5), DVec3::new(5.5, 0.5, 0.5)];
        let camera = Camera::framing(bounds, &Axes::Y_UP, View::FRONT, 4.0 / 3.0, 1.0);
        let look = Look::default();
        let clip = glam::Mat4::from_cols_array_2d(&Geometry::new(&setting(&camera, &look)).eye.clip);
        let depth = |z: f32| {
            let q = clip * Vec4::new(0.0, 0.0, z, 1.0);
            q.z / q.w
        };
        assert!(depth(1.0) > depth(0.0) && depth(0.0) > depth(-1.0) && depth(-1.0) > 0.0);
    }
}
