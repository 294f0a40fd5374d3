//! Checks of pictures hold for the shaders as they are, and are seen to fail for what they are here to find.

use super::gpu::adapter;
use super::{geometry, levels, look};
use knotmesh::render::Painter;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A text in the shaders, and what stands for it.
type Fault = [&'static str; 2];

fn prove(check: fn(&Painter), faults: &[Fault]) {
    let Some(adapter) = adapter() else { return };
    check(&Painter::open(&adapter).unwrap());
    let mut passed = Vec::new();
    for fault in faults {
        let painter = Painter::with_fault(&adapter, *fault).unwrap_or_else(|e| panic!("{fault:?}: {e}"));
        match catch_unwind(AssertUnwindSafe(|| check(&painter))) {
            Ok(()) => passed.push(fault),
            Err(what) => {
                // A check that fails says so in words of its own; what else ends it is no proof.
                let text = what.downcast_ref::<String>().map_or("", String::as_str);
                assert!(!text.contains("Err(") && !text.contains("called `"), "{fault:?}: {text}");
            }
        }
    }
    assert!(passed.is_empty(), "not seen: {passed:#?}");
}

macro_rules! checks {
    ($($module:ident::$check:ident: $faults:expr;)*) => {$(
        #[test]
        fn $check() {
            prove($module::$check, &$faults);
        }
    )*};
}

checks! {
    geometry::a_cylinder_covers_what_it_should: [
        // Without ends; with ends as long as the yarn is thick; half tubes that look away; rings inside the circle.
        ["out.radius = here.w * cos(inwards);", "out.radius = 0.0;"],
        ["(outwards * here.w * sin(angle))", "(outwards * 2.0 * here.w * sin(angle))"],
        ["let facing = look - out.tangent * dot(look, out.tangent);", "let facing = out.tangent * dot(look, out.tangent) - look;"],
        ["var wide = 0.5 * TAU / (sides_of_ring * sin(0.5 * TAU / sides_of_ring));", "var wide = cos(0.5 * TAU / sides_of_ring);"],
        // A chord's end short of where it should be.
        ["let next = links[i + count - 1u].y;", "let next = links[i].y;"],
    ];
    geometry::a_ring_covers_what_it_should: [
        // The last segment left out, at all levels.
        ["link.y != NONE", "(link.y != NONE && link.y > i)"],
    ];
    geometry::volume_is_kept: [
        ["inverseSqrt(max(around, 1e-6))", "1.0 / max(around, 1e-6)"],
        ["preparing.keep_volume != 0u", "preparing.keep_volume != 7u"],
        ["preparing.keep_volume != 0u", "preparing.keep_volume != 1u"],
    ];
    geometry::a_picture_does_not_depend_on_axes: [
        // A sky over the world instead of over the picture; a light that stands in it.
        ["dot(on.normal, light.sky.xyz)", "on.normal.y"],
        ["dot(on.normal, light.key.xyz)", "dot(on.normal, normalize(vec3<f32>(-0.55, 0.68, 0.62)))"],
    ];
    levels::levels_follow_the_distance_and_nothing_out_of_view_is_drawn: [
        ["eye.scale.x / mix(1.0, max(distance, 1e-12), eye.place.w)", "eye.scale.x * max(distance, 1e-12) * 1e-6"],
        ["dot(plane.xyz, middle) + plane.w < -reach", "reach < 0.0"],
        ["i + count <= begin + RUN && straight(i, count)", "false"],
    ];
    levels::a_finer_level_changes_little: [
        // Half tubes turned inside out; chords that leave the curve by pixels; gaps after them; levels left out.
        ["angle = 0.5 * TAU * (f32(spoke)", "angle = -0.5 * TAU * (f32(spoke)"],
        ["eye.scale.w * min(1.0, 0.5 / size)", "8.0 * eye.scale.w"],
        ["let next = links[i + count - 1u].y;", "let next = links[i].y;"],
        ["if size > 1.2 || bow > 0.3 {", "if false {"],
    ];
    look::shadows_fall_away_from_the_light: [
        ["vec2<f32>(at.x, -at.y) * 0.5 + 0.5", "vec2<f32>(-at.x, at.y) * 0.5 + 0.5"],
        ["if d > at.z {", "if d < at.z {"],
        ["mix(0.12, 1.0, through)", "1.0"],
    ];
    look::valleys_are_darker: [
        // The same everywhere; horizons below instead of above; half the sky.
        ["vec4<f32>(clamp(open / f32(DIRECTIONS), 0.0, 1.0))", "vec4<f32>(0.6)"],
        ["highest = max(highest,", "highest = min(highest,"],
        ["open += l * arc;", "open += 0.5 * l * arc;"],
    ];
    look::tension_has_the_colours_of_its_range: [
        ["(in.stretch - light.shading.y) / (light.shading.z - light.shading.y)", "(light.shading.z - in.stretch) / (light.shading.z - light.shading.y)"],
        ["stretch = chord_length / rest;", "stretch = 1.0;"],
    ];
    look::the_background_is_what_was_asked_for: [
        ["mix(light.top, light.bottom, t)", "mix(light.bottom, light.top, t)"],
        ["let opacity = over.w + under.w * (1.0 - over.w);", "let opacity = 1.0;"],
        ["select(1.055 * pow(c, vec3<f32>(1.0 / 2.4)) - 0.055, c * 12.92,", "select(c, c * 12.92,"],
    ];
    look::pictures_repeat: [
        // What is added up begins with what was there; more samples that add nothing.
        ["if developing.pass_number > 0u {", "if true {"],
        ["let over = sum / f32(developing.passes);", "let over = sum;"],
    ];
    look::thin_yarn_does_not_flicker: [
        // The last pass alone.
        ["let over = sum / f32(developing.passes);", "let over = textureLoad(shaded, vec2<i32>(id.xy), 0);"],
    ];
}
