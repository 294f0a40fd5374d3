//! SCENE.json: what is read, and where errors point.

use glam::DVec3;
use knotmesh::drape::motion::Interpolation;
use knotmesh::drape::scene::{DrapeScene, Friction, Shape, Side};
use knotmesh::io::scene_json::read;
use std::path::Path;

pub fn parse(text: &str) -> Result<DrapeScene, String> {
    read(Path::new("s.json"), text.as_bytes()).map_err(|e| e.to_string())
}

/// One of everything that needs no other file.
pub const ALL: &str = r#"{
  "format": "knotmesh-scene", "version": 1,
  "unit": 0.0045, "frames": 60, "fps": 24, "substeps": 12,
  "gravity": [0, -9.81, 0],
  "place": {"center": [0, 0, 0], "axis": [1, 0, 0], "turn": 90, "translate": [0, 0.2, 0], "scale": 1.5},
  "relax": true, "density": 0.3, "damping": 0.5,
  "motions": {
    "walk": {"axis": [0, 0, 2], "interpolation": "linear", "repeat": true,
             "keys": [{"time": 0}, {"time": 1, "turn": 180}, {"time": 2, "translate": [1, 0, 0]}]}
  },
  "pins": [{"select": {"vertices": [0, 3]}},
           {"select": {"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "rows": [1, 4]}}],
  "moves": [{"select": {"border": "left", "depth": 0.01}, "motion": ["walk",
             {"center": [1, 2, 3], "keys": [{"time": 0, "scale": [1, 2, 1]}]}]},
            {"select": {"edges": [[0, 1]]}, "motion": ["walk"]}],
  "colliders": [
    {"plane": {"point": [0, 0, 0], "normal": [0, 2, 0]}, "friction": {"static": 0.9, "kinetic": 0.8}},
    {"sphere": {"center": [0, 0, 0], "radius": 0.1}, "thickness": 0.002, "motion": ["walk"]},
    {"capsule": {"from": [0, 0, 0], "to": [0, 1, 0], "radius": 0.1}}
  ],
  "self_collision": {"thickness": 0.003},
  "friction": {"kinetic": 0.2},
  "wind": {"direction": [0, 0, 2], "speed": 3, "gust": {"strength": 0.4, "period": 1.5, "seed": 7}}
}"#;

#[test]
fn a_scene_says_what_it_says() {
    let scene = parse(ALL).unwrap();
    assert_eq!((scene.unit, scene.frames, scene.fps, scene.substeps), (0.0045, 60, 24.0, Some(12)));
    assert!(scene.relax && scene.density == Some(0.3));
    assert!(scene.place.apply(DVec3::Y).abs_diff_eq(DVec3::new(0.0, 0.2, 1.5), 1e-12));
    assert_eq!(
        scene.held.iter().map(|h| h.name.as_str()).collect::<Vec<_>>(),
        ["pins[0]", "pins[1]", "moves[0]", "moves[1]"]
    );
    assert_eq!(scene.held[1].select.rows, Some([1, 4]));
    let border = scene.held[2].select.border.unwrap();
    assert_eq!((border.side, border.depth), (Side::Left, Some(0.01)));
    let motions = &scene.held[2].motions;
    assert_eq!(motions[0].interpolation, Interpolation::Linear);
    // A key keeps what it does not say.
    assert!((motions[0].keys[2].turn - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!((motions[1].center, motions[1].keys[0].scale.y), (Some(DVec3::new(1.0, 2.0, 3.0)), 2.0));
    assert!(matches!(scene.colliders[0].shape, Shape::Plane { normal: DVec3::Y, .. }));
    assert_eq!(scene.colliders[0].friction, Friction { fixed: 0.9, sliding: 0.8 });
    assert_eq!(scene.colliders[1].friction, Friction { fixed: 0.4, sliding: 0.2 });
    assert_eq!((scene.colliders[1].thickness, scene.colliders[2].thickness), (Some(0.002), None));
    assert_eq!(scene.self_collision.unwrap().friction.sliding, 0.2);
    let wind = scene.wind.unwrap();
    assert_eq!((wind.direction, wind.speed, wind.gust.unwrap().seed), (DVec3::Z, 3.0, 7));
    scene.check().unwrap();
    let least = parse(r#"{"frames": 1}"#).unwrap();
    assert_eq!(least, DrapeScene::default());
}

#[test]
fn errors_say_where_and_what() {
    // Seen red with columns counted from the entry's start.
    let mut faults = Vec::new();
    for (text, expected) in [
        ("", "s.json:1:1: found the end of the file, expected the rest of a value"),
        ("{}", "s.json:1:2: found missing field `frames`, expected a scene as JSON"),
        ("{\"frames\": 0}", "s.json:1:13: found integer `0`, expected a whole number from 1 to 1000000"),
        ("{\"frames\": -3}", "s.json:1:13: found integer `-3`, expected u64"),
        (
            "{\"frames\": 1,\n \"fps\": 0}",
            "s.json:2:10: found floating point `0.0`, expected a number above 0, at least 1e-9 and at most 1e9",
        ),
        ("{\"frames\": 1,\n \"colour\": 0}", "s.json:2:9: found unknown field `colour`"),
        (
            "{\"frames\": 1, \"gravity\": [0, 1e300, 0]}",
            "s.json:1:36: found floating point `1e+300`, expected a number from -1e9 to 1e9",
        ),
        ("{\"frames\": 1, \"gravity\": [0, 1e999, 0]}", "s.json:1:34: found number out of range"),
        ("{\"frames\": 1, \"gravity\": [0, NaN, 0]}", "s.json:1:30: found 'N', expected value"),
        (
            "{\"frames\": 1, \"gravity\": [0, 0]}",
            "s.json:1:31: found invalid length 2, expected an array of length 3",
        ),
        ("{\"frames\": 1, \"format\": \"x\"}", "s.json:1:1: found format 'x', expected 'knotmesh-scene'"),
        ("{\"frames\": 1, \"version\": 2}", "s.json:1:1: found version 2, expected version 1"),
        (
            "{\"frames\": 1,\n \"pins\": [\n  {\"select\": {}}]}",
            "s.json:3:3: found a selection without a condition, expected one or more of",
        ),
        (
            "{\"frames\": 1,\n \"pins\": [\n  {\"select\": {\"vertices\": [-1]}}]}",
            "s.json:3:29: found integer `-1`, expected u32",
        ),
        (
            "{\"frames\": 1, \"pins\": [{\"select\": {\"border\": \"north\"}}]}",
            "s.json:1:52: found unknown variant `north`, expected one of `left`",
        ),
        (
            "{\"frames\": 1, \"pins\": [{\"select\": {\"vertices\": [1], \"depth\": 1}}]}",
            "s.json:1:24: found \"depth\" without \"border\", expected both",
        ),
        (
            "{\"frames\": 1, \"pins\": [{\"select\": {\"rows\": [3, 1]}}]}",
            "s.json:1:24: found rows 3 to 1, expected the lower row first",
        ),
        (
            "{\"frames\": 1, \"pins\": [{\"select\": {\"box\": {\"min\": [1,0,0], \"max\": [0,0,0]}}}]}",
            "s.json:1:24: found a box whose min lies beyond its max",
        ),
        (
            "{\"frames\": 1, \"moves\": [{\"select\": {\"rows\": [1, 1]}}]}",
            "s.json:1:25: found an entry without \"motion\", expected one",
        ),
        (
            "{\"frames\": 1, \"pins\": [{\"select\": {\"rows\": [1, 1]},\n \"motion\": [\"walk\"]}]}",
            "s.json:1:24: found motion 'walk', expected a name of one under \"motions\"",
        ),
        (
            "{\"frames\": 1, \"motions\": {\"a\": {\"keys\": []}}}",
            "s.json:1:42: found no keys, expected at least one",
        ),
        (
            "{\"frames\": 1, \"motions\": {\"a\": {\"keys\": [{\"time\": 1},\n{\"time\": 1}]}}}",
            "s.json:2:12: found time 1 after time 1, expected a later one",
        ),
        (
            "{\"frames\": 1, \"motions\": {\"a\": {\"axis\": [0,0,0], \"keys\": [{\"time\": 0}]}}}",
            "found a vector without a direction, expected one longer than 1e-9",
        ),
        (
            "{\"frames\": 1, \"motions\": {\"a\": {\"keys\": [{\"time\": 0, \"scale\": [1, 0, 1]}]}}}",
            "found floating point `0.0`, expected a factor from 1e-6 to 1e6",
        ),
        (
            "{\"frames\": 1, \"motions\": {\"a\": {\"keys\": [{\"time\": 0, \"scale\": [1, 1]}]}}}",
            "found invalid length 2, expected three factors",
        ),
        (
            "{\"frames\": 1, \"colliders\": [{}]}",
            "s.json:1:29: found a collider of no shape, or of several, expected exactly one of",
        ),
        (
            "{\"frames\": 1, \"colliders\": [\n  {\"sphere\": {\"center\": [0,0,0], \"radius\": -1}}]}",
            "s.json:2:46: found floating point `-1.0`, expected a number above 0",
        ),
        (
            "{\"frames\": 1, \"colliders\": [{\"sphere\": {\"center\": [0,0,0], \"radius\": 1}, \"motion\": [{\"keys\": [{\"time\": 0, \"scale\": 2}]}]}]}",
            "s.json:1:29: found a motion that scales a collider",
        ),
        ("{\"frames\": 1, \"colliders\": [{\"mesh\": {\"file\": \"no.obj\"}}]}", "no.obj: No such file"),
        (
            "{\"frames\": 1, \"colliders\": [{\"mesh\": {\"file\": \"no.stl\"}}]}",
            "no.stl: found a collider of kind '.stl', expected .obj",
        ),
        (
            "{\"frames\": 1, \"friction\": {\"static\": 0.1, \"kinetic\": 0.2}}",
            "found kinetic friction 0.2 above the static one, 0.1, expected at most the static one",
        ),
        (
            "{\"frames\": 1, \"wind\": {\"direction\": [0,0,1]}}",
            "found missing field `speed`, expected a scene as JSON",
        ),
        ("{\"frames\": 1} x", "s.json:1:15: found trailing characters"),
    ] {
        let message = parse(text).expect_err(text);
        if !message.contains(expected) {
            faults.push(format!("{text}\n  {message}\n  {expected}"));
        }
        assert!(!message.contains('\n'), "{message}");
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
