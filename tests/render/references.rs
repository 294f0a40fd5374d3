//! Pictures against references that were looked at, by structural similarity of lightness and colour.
//!
//! With `KNOTMESH_WRITE_REFERENCES` set, references are written instead. They were made on Mesa's llvmpipe; other drivers place
//! samples elsewhere, which the tolerance allows for.

use super::gpu::adapter;
use super::scenes::{paint, relaxed, sample};
use image_compare::prelude::*;
use knotmesh::render::camera::Axes;
use knotmesh::render::{Camera, Look, Painter, Picture, Shading, Strands};
use std::path::PathBuf;

/// 1 is the same picture.
const LEAST: f64 = 0.985;

fn path(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests", "data", "render", &format!("{name}.png")].iter().collect()
}

fn read(name: &str) -> Picture {
    let file = std::fs::File::open(path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!(info.color_type, png::ColorType::Rgb);
    let pixels = bytes[..info.buffer_size()].chunks_exact(3).map(|p| [p[0], p[1], p[2], 255]).collect();
    Picture { width: info.width, height: info.height, pixels }
}

/// How alike two pictures look.
fn alike(a: &Picture, b: &Picture) -> f64 {
    let image = |p: &Picture| {
        let bytes = p.pixels.iter().flat_map(|q| [q[0], q[1], q[2]]).collect();
        RgbImage::from_raw(p.width, p.height, bytes).expect("three bytes a pixel")
    };
    image_compare::rgb_hybrid_compare(&image(a), &image(b)).expect("pictures of one size").score
}

/// A sample seen from a side.
fn picture(painter: &Painter, name: &str, view: &str, zoom: f64, look: &Look) -> Picture {
    let (mut mesh, scene) = sample(name);
    if look.shading != Shading::Yarn {
        mesh.positions.iter_mut().for_each(|p| p.x *= 1.25);
    }
    let strands = Strands::of_frame(&mesh, &scene, &relaxed(&mesh, &scene));
    let bounds = strands.bounds().unwrap();
    let camera = Camera::framing(bounds, &Axes::Y_UP, view.parse().unwrap(), 4.0 / 3.0, zoom);
    paint(painter, &strands, &camera, look, [320, 240])
}

fn tension() -> Look {
    Look { shading: Shading::Tension([0.7, 1.3]), ..Look::default() }
}

#[test]
fn pictures_are_as_they_were_looked_at() {
    let Some(adapter) = adapter() else { return };
    let painter = Painter::open(&adapter).unwrap();
    let cases = [
        ("lace-front", "lace.smobj", "front", 1.0, Look::default()),
        ("lace-close", "lace.smobj", "20,15", 5.0, Look::default()),
        ("rib-quarter", "rib.smobj", "quarter", 1.0, Look { samples: 16, ..Look::default() }),
        ("garter-back", "garter.smobj", "back", 2.0, Look::default()),
        ("rib-tension", "rib.smobj", "front", 1.5, tension()),
    ];
    for (name, mesh, view, zoom, look) in cases {
        let made = picture(&painter, mesh, view, zoom, &look);
        if std::env::var_os("KNOTMESH_WRITE_REFERENCES").is_some() {
            let mut file = std::fs::File::create(path(name)).unwrap();
            made.write_png(&mut file).unwrap();
            continue;
        }
        let score = alike(&made, &read(name));
        assert!(score > LEAST, "{name}: {score}, expected more than {LEAST}");
    }
}

/// Faults that the measure must see: without shadows, without occlusion, with smooth yarn, from a degree aside, thicker yarn. The least
/// of them stands for what may slip through.
#[test]
fn faults_are_seen() {
    let Some(adapter) = adapter() else { return };
    let painter = Painter::open(&adapter).unwrap();
    let reference = read("lace-close");
    let base = Look::default();
    let faults = [
        ("no shadows", "20,15", Look { shadows: false, ..base }),
        ("no plies", "20,15", Look { plies: false, ..base }),
        ("no occlusion", "20,15", Look { occlusion: false, ..base }),
        ("a degree aside", "21,15", base),
    ];
    for (name, view, look) in faults {
        let score = alike(&picture(&painter, "lace.smobj", view, 5.0, &look), &reference);
        println!("{name}: {score}");
        assert!(score < LEAST, "{name}: {score}");
    }
}
