//! Tubes, whose material coordinates jump at a seam.

use crate::common::fabric;
use crate::mends::on_lines;
use crate::{Laid, laid};
use glam::{DVec2, DVec3};
use knotmesh::database::{Compat, Settings};
use knotmesh::mesh::MaterialMesh;

/// A tube of so many metres around: material coordinates of a sheet, the last column of vertices at the first.
fn tube(around: f64) -> MaterialMesh {
    let (columns, rows) = (32usize, 10);
    let mut mesh = fabric::sheet([columns, rows], DVec2::new(around, 0.08));
    let radius = around / std::f64::consts::TAU;
    mesh.positions = (0..=rows)
        .flat_map(|j| (0..columns).map(move |i| (i, j)))
        .map(|(i, j)| {
            let angle = i as f64 / columns as f64 * std::f64::consts::TAU;
            DVec3::new(radius * angle.sin(), 0.008 * j as f64, radius * (1.0 - angle.cos()))
        })
        .collect();
    for face in &mut mesh.faces {
        *face = face.map(|v| {
            let (i, j) = (v as usize % (columns + 1), v as usize / (columns + 1));
            (j * columns + i % columns) as u32
        });
    }
    mesh
}

fn tubed(periods: f64, compat: Compat) -> (Laid<f64>, MaterialMesh) {
    let mesh = tube(periods * fabric::model(20, 5).pattern.size.x);
    let settings = Settings { compat, ..Settings::default() };
    (laid(&mesh, fabric::model(20, 5), settings, &mesh.positions), mesh)
}

/// Where the pattern goes on across the seam, so does the yarn: rows are closed, and kept. Seen red with seams taken for
/// borders.
#[test]
fn yarn_is_joined_where_phases_match() {
    let (whole, _) = tubed(6.0, Compat::None);
    // All rows but those that the upper and lower border cut through.
    let closed = whole.fabric.yarn_closed.iter().filter(|c| **c).count();
    assert!(closed >= 18, "{closed}");
    let long = |yarn: usize| whole.fabric.yarn(yarn).len() == 6 * 20;
    for yarn in (0..whole.fabric.yarn_count()).filter(|y| whole.fabric.yarn_closed[*y]) {
        assert!(long(yarn));
        // No gap anywhere: edges are as long as elsewhere.
        let points: Vec<DVec3> = whole.fabric.yarn(yarn).map(|p| whole.frame.world(p)).collect();
        for (i, p) in points.iter().enumerate() {
            let edge = (points[(i + 1) % points.len()] - *p).length();
            assert!(edge < 0.004, "{edge}");
        }
    }
    // Half a period off, yarn ends at the seam.
    let (half, _) = tubed(6.5, Compat::None);
    assert!(half.fabric.yarn_closed.iter().all(|c| !c));
    // The fault: all yarn is cut, and no yarn is closed.
    let (faulty, _) = tubed(6.0, Compat::Madypg);
    assert!(faulty.fabric.yarn_closed.iter().all(|c| !c));
    assert!(faulty.fabric.yarn_count() >= 18);
}

/// Points on the seam are there once, or rows would not close; some of them lie at vertices of the mesh, all of them where
/// triangles are as high as rows. Seen red with claims of border points not compared, and with ways that go back and forth
/// between two faces at a vertex.
#[test]
fn points_on_the_seam_are_there_once() {
    let mut mesh = tube(6.0 / 64.0);
    for high in [0.08, 10.0 / 128.0] {
        let last = mesh.uvs.last().unwrap().y;
        mesh.uvs.iter_mut().for_each(|uv| uv.y *= high / last);
        let laid: Laid<f64> = laid(&mesh, on_lines(), Settings::default(), &mesh.positions);
        // Rows every 1/128 m from the lower border on.
        assert_eq!(laid.fabric.yarn_count(), 11);
        for yarn in 0..11 {
            assert!(laid.fabric.yarn_closed[yarn], "{high} {yarn}");
            assert_eq!(laid.fabric.yarn(yarn).len(), 6 * 8);
        }
    }
}

/// Normals and bending at the seam are those of the rest of the tube. Seen red with nodes numbered by material vertex.
#[test]
fn seams_do_not_show() {
    for (periods, compat) in [(6.0, Compat::None), (6.5, Compat::None), (6.0, Compat::Madypg)] {
        let (laid, mesh) = tubed(periods, compat);
        let around = periods * fabric::PERIOD.as_vec2().as_dvec2().x;
        let curvature = std::f64::consts::TAU / around;
        let (mut off_normal, mut off_bending) = (0f64, 0f64);
        for (face, nodes) in laid.fabric.face_nodes().iter().enumerate() {
            for (k, node) in nodes.iter().enumerate() {
                let uv = mesh.uvs[mesh.face_uvs[face][k] as usize];
                // Borders above and below have one side only.
                if uv.y < 0.015 || uv.y > 0.065 || (uv.x > 0.01 && uv.x < around - 0.01) {
                    continue;
                }
                let form = laid.cpu.node_forms()[*node as usize];
                let angle = uv.x * curvature;
                let normal = DVec3::new(-angle.sin(), 0.0, angle.cos());
                off_normal = off_normal.max((form.normal.to_f64() - normal).length());
                off_bending = off_bending.max((form.second[0] / curvature - 1.0).abs());
            }
        }
        if compat == Compat::None {
            assert!(off_normal < 0.01 && off_bending < 0.02, "{periods}: {off_normal} {off_bending}");
        } else {
            assert!(off_normal > 0.03 && off_bending > 0.2, "the fault is there: {off_normal} {off_bending}");
        }
    }
}
