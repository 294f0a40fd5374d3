//! Scenes that nobody means: a result or an error of one line, and never a panic.

use crate::common::Random;
use crate::parse::{ALL, parse};
use glam::DVec3;
use knotmesh::drape::scene::DrapeScene;

const POISON: [&str; 20] = [
    "0",
    "-1",
    "1e308",
    "-1e-320",
    "1e999",
    "NaN",
    "null",
    "true",
    "{}",
    "[]",
    "[[]]",
    "\"\"",
    "\"walk\"",
    "4294967296",
    "18446744073709551616",
    "[1,2,3]",
    "{\"keys\": []}",
    "\\u0000",
    "\"\\ud800\"",
    "é",
];

#[test]
fn mutated_scenes_never_panic() {
    let mut dice = Random::new(11);
    let (mut fine, mut refused) = (0, 0);
    for _ in 0..20_000 {
        let mut bytes = ALL.as_bytes().to_vec();
        for _ in 0..1 + dice.below(3) {
            let at = dice.below(bytes.len());
            match dice.below(5) {
                0 => bytes[at] = dice.bits() as u8,
                1 => drop(bytes.drain(at..(at + 1 + dice.below(8)).min(bytes.len()))),
                2 => {
                    let end = (at + dice.below(12)).min(bytes.len());
                    bytes.splice(at..end, POISON[dice.below(POISON.len())].bytes());
                }
                3 => {
                    // A number for another.
                    if let Some(digit) = bytes[at..].iter().position(u8::is_ascii_digit) {
                        let poison = POISON[dice.below(POISON.len())];
                        bytes.splice(at + digit..at + digit + 1, poison.bytes());
                    }
                }
                _ => bytes.truncate(at.max(1)),
            }
        }
        let result = knotmesh::io::scene_json::read(std::path::Path::new("s.json"), &bytes);
        match result {
            Ok(scene) => {
                scene.check().expect("what is read is fine");
                fine += 1;
            }
            Err(error) => {
                let message = error.to_string();
                assert!(!message.contains('\n') && message.len() < 1000, "{message}");
                refused += 1;
            }
        }
    }
    assert!(fine > 200 && refused > 10_000, "{fine} {refused}");
}

#[test]
fn poison_in_scenes_of_code_is_refused() {
    // Each field in turn; seen red with the gust's period unchecked.
    let poison = [f64::NAN, f64::INFINITY, -f64::INFINITY, -1e300];
    type Set = fn(&mut DrapeScene, f64);
    let fields: [Set; 25] = [
        |s, x| s.unit = x,
        |s, x| s.fps = x,
        |s, x| s.gravity.y = x,
        |s, x| s.place.offset.x = x,
        |s, x| s.place.linear.x_axis.y = x,
        |s, x| s.density = Some(x),
        |s, x| s.damping = Some(x),
        |s, x| s.held[1].select.bounds.as_mut().unwrap()[0].z = x,
        |s, x| s.held[2].select.border.as_mut().unwrap().depth = Some(x),
        |s, x| s.held[2].motions[0].axis = DVec3::splat(x),
        |s, x| s.held[2].motions[0].keys[1].translate.z = x,
        |s, x| s.held[2].motions[0].keys[1].time = x,
        |s, x| s.held[2].motions[0].keys[1].turn = x,
        |s, x| s.held[2].motions[0].keys[1].scale.y = x,
        |s, x| s.held[2].motions[1].center = Some(DVec3::splat(x)),
        |s, x| s.colliders[1].thickness = Some(x),
        |s, x| s.colliders[0].friction.fixed = x,
        |s, x| s.colliders[0].friction.sliding = x,
        |s, x| s.self_collision.as_mut().unwrap().thickness = Some(x),
        |s, x| s.self_collision.as_mut().unwrap().friction.fixed = x,
        |s, x| s.wind.as_mut().unwrap().direction = DVec3::splat(x),
        |s, x| s.wind.as_mut().unwrap().speed = x,
        |s, x| s.wind.as_mut().unwrap().drag = x,
        |s, x| s.wind.as_mut().unwrap().gust.as_mut().unwrap().strength = x,
        |s, x| s.wind.as_mut().unwrap().gust.as_mut().unwrap().period = x,
    ];
    let scene = parse(ALL).unwrap();
    scene.check().unwrap();
    for (number, set) in fields.iter().enumerate() {
        for x in poison {
            let mut scene = scene.clone();
            set(&mut scene, x);
            let message = scene.check().expect_err(&format!("field {number}, {x}")).to_string();
            assert!(!message.contains('\n'), "{message}");
        }
    }
}
