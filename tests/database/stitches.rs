//! Stitch meshes laid flat.

use crate::common::fabric;
use crate::common::grid::{HEIGHT, WIDTH, Wrap, grid, placed, tube_place};
use crate::laid;
use glam::{DVec2, DVec3, UVec2};
use knotmesh::database::Settings;
use knotmesh::io::smobj;
use knotmesh::mesh::{MaterialMesh, StitchMesh};
use knotmesh::pattern::Pattern;
use knotmesh::scene::{laid_flat, natural_unit};
use knotmesh::template::TemplateLibrary;
use std::path::Path;

const KNIT: &str = "knit+ -lX +yX +lX -yX";

fn stitch() -> DVec2 {
    fabric::model(20, 5).pattern.size / 2.0
}

fn flat(mesh: &StitchMesh) -> MaterialMesh {
    let flat = laid_flat(mesh, &TemplateLibrary::embedded(), stitch());
    flat.check().unwrap();
    for uvs in &flat.face_uvs {
        let [a, b, c] = uvs.map(|uv| flat.uvs[uv as usize]);
        assert!((b - a).perp_dot(c - a) > 0.0, "counter-clockwise, of some area");
    }
    flat
}

/// In metres.
fn scaled(mut flat: MaterialMesh) -> MaterialMesh {
    let unit = natural_unit(&flat).unwrap();
    flat.positions.iter_mut().for_each(|p| *p *= unit);
    flat
}

#[test]
fn a_swatch_is_a_grid() {
    for welded in [false, true] {
        let mesh = grid(7, 5, Wrap::Flat, welded, |_, _| KNIT.into());
        let flat = flat(&mesh);
        assert_eq!((flat.faces.len(), flat.uvs.len()), (2 * 35, 8 * 6));
        for (face, uvs) in flat.face_uvs.iter().enumerate() {
            let source = flat.source(face) as usize;
            let cell = DVec2::new((source % 7) as f64, (source / 7) as f64);
            for (uv, vertex) in uvs.iter().zip(flat.faces[face]) {
                // Relative to the first face, whose cell is centred.
                let at = flat.uvs[*uv as usize] / stitch() + 0.5;
                assert!((at - cell).min_element() > -1e-9 && (at - cell).max_element() < 1.0 + 1e-9);
                let place = flat.positions[vertex as usize].truncate() / DVec2::new(WIDTH, HEIGHT);
                assert!((place - at).abs().max_element() < 1e-9, "{place} {at}");
            }
        }
    }
}

/// A tube whose stitches are a multiple of the pattern's columns has closed rows, another one none. Seen red with corners
/// that are joined left apart.
#[test]
fn tubes_close_where_the_pattern_does() {
    for (columns, closes) in [(12, true), (13, false)] {
        let mesh = grid(columns, 8, Wrap::Tube, false, |_, _| KNIT.into());
        let mesh = placed(mesh, columns, tube_place(columns, false));
        let flat = scaled(flat(&mesh));
        let laid = laid::<f64>(&flat, fabric::model(20, 5), Settings::default(), &flat.positions);
        let closed = laid.fabric.yarn_closed.iter().filter(|c| **c).count();
        assert_eq!(closed > 4, closes, "{columns}: {closed} of {}", laid.fabric.yarn_count());
    }
}

/// Courses run along u, wales along v, and the unit is such that nothing is strained overall.
#[test]
fn courses_run_along_u() {
    let mesh = grid(9, 9, Wrap::Flat, false, |_, _| KNIT.into());
    let flat = scaled(flat(&mesh));
    let laid = laid::<f64>(&flat, fabric::model(20, 5), Settings::default(), &flat.positions);
    for form in laid.cpu.face_forms() {
        let [u, v] = form.gradient.map(|g| g.to_f64());
        assert!(u.y.abs() < 1e-9 && v.x.abs() < 1e-9 && u.x > 0.5 && v.y > 0.5, "{u} {v}");
        assert!((u.x * v.y - 1.0).abs() < 1e-9, "area is kept");
        assert!((form.normal.to_f64() - DVec3::Z).length() < 1e-9);
    }
}

/// Every sample: yarn on all of them, all of it finite (`laid` looks).
#[test]
fn samples() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches");
    let mut seen = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "smobj") {
            let flat = scaled(flat(&smobj::read_file(&path).unwrap()));
            let laid = laid::<f32>(&flat, fabric::model(20, 5), Settings::default(), &flat.positions);
            assert!(laid.fabric.point_count() > 100, "{}", path.display());
            seen += 1;
        }
    }
    assert!(seen > 5);
}

/// Rows and loops of patterns; wovens have none.
#[test]
fn stitches_of_a_pattern() {
    let pattern = fabric::model(20, 2).pattern;
    assert_eq!(pattern.stitches(), Some(UVec2::new(2, 2)));
    let mut flat = pattern.clone();
    flat.places.iter_mut().for_each(|p| p.y *= 0.05);
    assert_eq!(flat.stitches(), None);
    let mut woven = pattern;
    woven.edges[19].tile.y = 1;
    assert_eq!(woven.stitches(), None);
    assert_eq!(Pattern::default().stitches(), None);
}

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn stitches_of_the_published_patterns() {
    let Some(data) = crate::common::data() else { return };
    let of = |name: &str| {
        let path = data.join(format!("madypg/models/model_{name}/pyp"));
        knotmesh::io::pyp::read_file(&path).unwrap().stitches().map(|s| (s.x, s.y))
    };
    assert_eq!(["stock_9", "rib_9", "stocktiniest_9"].map(of), [Some((2, 2)), Some((4, 4)), Some((1, 1))]);
    assert_eq!(["honey_9", "satin_9", "basket_9"].map(of), [None; 3]);
}
