//! Just enough of `.sf` to run the search over real libraries: faces, edges and yarns, no derivations.

use glam::DVec2;
use knotmesh::template::{Place, Strand, TemplatePoint};

#[derive(Default)]
pub struct Face {
    pub name: String,
    pub labels: Vec<String>,
    pub corners: Vec<DVec2>,
    pub strands: Vec<Strand>,
}

/// Reads the faces of a library, in its own units (plain knits are 2 wide, r = 0.1).
pub fn faces(text: &str) -> Vec<Face> {
    let mut faces: Vec<Face> = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or("").trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match (word, faces.last_mut()) {
            ("face", _) => faces.push(Face { name: rest.trim().into(), ..Face::default() }),
            ("edge", Some(face)) => {
                let (at, label) = rest.split_once(')').expect("edge (x,y) LABEL");
                let at = numbers(at);
                face.corners.push(DVec2::new(at[0], at[1]));
                face.labels.push(label.trim().into());
            }
            ("yarn", Some(face)) => face.strands.push(
                rest.split_inclusive([']', ')'])
                    .filter(|p| p.contains([']', ')']))
                    .filter_map(point)
                    .collect(),
            ),
            _ => {}
        }
    }
    faces
}

fn point(text: &str) -> Option<TemplatePoint> {
    let n = numbers(text);
    let place = if text.contains(']') {
        Place::Boundary { edge: n[0] as u32, along: n[1] }
    } else {
        Place::Free { at: DVec2::new(n[0], n[1]) }
    };
    // A fraction of exactly 0 or 1 marks a yarn's end and is no point.
    let end = matches!(place, Place::Boundary { along, .. } if along == 0.0 || along == 1.0);
    (!end).then_some(TemplatePoint { place, z: n[2..].first().copied().unwrap_or(0.0) })
}

fn numbers(text: &str) -> Vec<f64> {
    text.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c))).filter_map(|n| n.parse().ok()).collect()
}
