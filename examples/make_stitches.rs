//! Makes the sample meshes in `stitches/`: `cargo run --example make_stitches [FOLDER]`.

use glam::{DVec2, DVec3};
use knotmesh::ids::VertexId;
use knotmesh::io::smobj;
use knotmesh::mesh::{FaceEdge, Join, StitchMesh, StitchType};
use knotmesh::template::TemplateLibrary;
use std::collections::HashMap;
use std::path::Path;

const HEIGHT: f64 = 0.61;

/// A welded mesh under construction; edges of faces that share both vertices are joined, unless labelled `x`.
#[derive(Default)]
struct Builder {
    mesh: StitchMesh,
    vertices: HashMap<[i64; 3], VertexId>,
}

impl Builder {
    fn new() -> Self {
        Self { mesh: StitchMesh { face_offsets: vec![0], ..StitchMesh::default() }, ..Self::default() }
    }

    /// Adds a face; corners within 1e-6 of each other are one vertex. `source` is the pattern row.
    fn face(&mut self, key: &str, source: usize, corners: &[DVec3]) {
        let mut words = key.split(' ').map(str::to_string);
        let stitch = StitchType { name: words.next().expect("a name"), labels: words.collect() };
        assert_eq!(stitch.labels.len(), corners.len(), "{key}");
        let mesh = &mut self.mesh;
        let known = mesh.types.iter().position(|t| *t == stitch);
        mesh.face_types.push(known.unwrap_or(mesh.types.len()).into());
        if known.is_none() {
            mesh.types.push(stitch);
        }
        for corner in corners {
            let cell = (*corner * 1e6).round().to_array().map(|x| x as i64);
            let vertex = *self.vertices.entry(cell).or_insert_with(|| {
                mesh.positions.push(*corner);
                (mesh.positions.len() - 1).into()
            });
            mesh.face_vertices.push(vertex);
        }
        mesh.face_offsets.push(mesh.face_vertices.len() as u32);
        mesh.face_source.push(source as u32);
    }

    fn finish(mut self) -> StitchMesh {
        let mut open: HashMap<[VertexId; 2], FaceEdge> = HashMap::new();
        for face in 0..self.mesh.face_count() {
            let corners = self.mesh.face(face.into()).to_vec();
            for (edge, label) in self.mesh.face_type(face.into()).labels.clone().iter().enumerate() {
                let ends = [corners[edge], corners[(edge + 1) % corners.len()]];
                if label == "x" || ends[0] == ends[1] {
                    continue;
                }
                let here = FaceEdge { face: face.into(), edge: edge as u32 };
                match open.remove(&[ends[1], ends[0]]) {
                    Some(a) => self.mesh.joins.push(Join { a, b: here, flipped: true }),
                    None => {
                        open.insert(ends, here);
                    }
                }
            }
        }
        // Six digits, as files of this kind have.
        for p in &mut self.mesh.positions {
            *p = (*p * 1e6).round() / 1e6;
        }
        self.mesh
    }
}

/// Lets a flat mesh find a shape whose faces are like their templates': each face in turn offers its corners
/// the best-placed copy of its template (shape matching), and corners take the mean.
fn settle(mesh: &mut StitchMesh) {
    let library = TemplateLibrary::embedded();
    let shapes: Vec<Vec<DVec2>> = mesh
        .types
        .iter()
        .map(|t| library.get(library.find(t).expect("an embedded stitch").0).corners.clone())
        .collect();
    for _ in 0..3000 {
        let mut sums = vec![(DVec2::ZERO, 0.0); mesh.positions.len()];
        for face in 0..mesh.face_count() {
            let shape = &shapes[mesh.face_types[face].index()];
            let corners = mesh.face(face.into());
            let n = corners.len() as f64;
            let here: Vec<DVec2> = corners.iter().map(|v| mesh.positions[v.index()].truncate()).collect();
            let (middle, shape_middle) = (here.iter().sum::<DVec2>() / n, shape.iter().sum::<DVec2>() / n);
            // The turn that lays the template on the face best.
            let (mut cos, mut sin) = (0.0, 0.0);
            for (p, q) in here.iter().zip(shape) {
                cos += (*q - shape_middle).dot(*p - middle);
                sin += (*q - shape_middle).perp_dot(*p - middle);
            }
            let turn = DVec2::new(cos, sin).normalize_or(DVec2::X);
            for (v, q) in corners.iter().zip(shape) {
                let sum = &mut sums[v.index()];
                sum.0 += middle + turn.rotate(*q - shape_middle);
                sum.1 += 1.0;
            }
        }
        for (p, (sum, count)) in mesh.positions.iter_mut().zip(sums) {
            *p = (sum / count).extend(0.0);
        }
    }
    for p in &mut mesh.positions {
        *p = (*p * 1e6).round() / 1e6;
    }
}

fn at(u: usize, k: usize) -> DVec3 {
    DVec3::new(u as f64, k as f64 * HEIGHT, 0.0)
}

/// A quad of row `k` between columns `u` and `u + 1`.
fn quad(u: usize, k: usize) -> [DVec3; 4] {
    [at(u, k), at(u + 1, k), at(u + 1, k + 1), at(u, k + 1)]
}

const CAST_ON: [&str; 2] = ["tuck-twist+ -lX +yX +lX -yX", "tuck-twist- -lX -yX +lX +yX"];
const KNIT: [&str; 2] = ["knit+ -lX +yX +lX -yX", "knit- -lX -yX +lX +yX"];
const PURL: [&str; 2] = ["purl+ -lX +yX +lX -yX", "purl- -lX -yX +lX +yX"];
const DROP: &str = "drop+ -l1 +y0 +l0 -y0";

/// The borders of flat knitting of `rows` rows (row 0 to the right): turns at the sides, yarn in and out.
fn borders(b: &mut Builder, columns: usize, rows: usize) {
    for k in 0..rows - 1 {
        let (y, w) = (k, 0.5);
        if k % 2 == 0 {
            let x = columns;
            let out = |k: usize| at(x, k) + DVec3::X * w;
            // From the mirrored template: corner 0 lower left, then right side, then the left side downwards.
            b.face("edge) x x x +y1 -y1", k, &[at(x, y), out(y), out(y + 2), at(x, y + 2), at(x, y + 1)]);
        } else {
            let out = |k: usize| at(0, k) - DVec3::X * w;
            b.face("edge( x -y1 +y1 x x", k, &[out(y), at(0, y), at(0, y + 1), at(0, y + 2), out(y + 2)]);
        }
    }
    b.face("in+ x +yX x", 0, &[(at(0, 0) + at(0, 1)) / 2.0 - DVec3::X * 0.5, at(0, 0), at(0, 1)]);
    let last = rows - 1;
    let tip = |x: usize| (at(x, last) + at(x, last + 1)) / 2.0;
    if last.is_multiple_of(2) {
        b.face(
            "out+ x x -yX",
            last,
            &[at(columns, last), tip(columns) + DVec3::X * 0.5, at(columns, last + 1)],
        );
    } else {
        b.face("out- x -yX x", last, &[tip(0) - DVec3::X * 0.5, at(0, last), at(0, last + 1)]);
    }
}

/// Closes flat knitting: the last row's loops stay open on top, the borders turn.
fn finish_flat(mut b: Builder, columns: usize, rows: usize) -> StitchMesh {
    for u in 0..columns {
        b.face(DROP, rows, &quad(u, rows));
    }
    borders(&mut b, columns, rows);
    let mut mesh = b.finish();
    settle(&mut mesh);
    mesh
}

/// Flat knitting: a cast-on row, rows of the stitches that `front` gives as seen from the front (true: knit),
/// loops left open on top.
fn flat(columns: usize, rows: usize, front: impl Fn(usize, usize) -> bool) -> StitchMesh {
    let mut b = Builder::new();
    for k in 0..rows {
        for u in 0..columns {
            let keys = if k == 0 {
                CAST_ON
            } else if front(u, k) {
                KNIT
            } else {
                PURL
            };
            b.face(keys[k % 2], k, &quad(u, k));
        }
    }
    finish_flat(b, columns, rows)
}

/// Eyelet lace: every fourth row, a yarn-over and a decrease in each repeat of six.
fn lace(repeats: usize, rows: usize) -> StitchMesh {
    let columns = 6 * repeats + 1;
    let mut b = Builder::new();
    for k in 0..rows {
        let eyelets = k > 0 && k % 4 == 2;
        let shift = if k % 8 == 2 { 1 } else { 3 };
        let mut u = 0;
        while u < columns {
            if eyelets && u % 6 == shift && u + 3 <= columns {
                let make = [at(u, k), at(u + 1, k), at(u + 2, k + 1), at(u + 1, k + 1), at(u, k + 1)];
                b.face("make-left-tuck+ -lX +yX +lX +lX -yX", k, &make);
                let decrease = [at(u + 1, k), at(u + 2, k), at(u + 3, k), at(u + 3, k + 1), at(u + 2, k + 1)];
                b.face("decrease-right+ -lX -lX +yX +lX -yX", k, &decrease);
                u += 3;
            } else {
                b.face(if k == 0 { CAST_ON } else { KNIT }[k % 2], k, &quad(u, k));
                u += 1;
            }
        }
    }
    finish_flat(b, columns, rows)
}

/// A tube of stockinette in one helical yarn.
fn tube(columns: usize, rounds: usize) -> StitchMesh {
    let radius = columns as f64 / std::f64::consts::TAU;
    let place = |u: usize, k: usize| {
        let angle = std::f64::consts::TAU * u as f64 / columns as f64;
        // The next round begins one row up.
        let height = k as f64 + u as f64 / columns as f64;
        DVec3::new(radius * angle.cos(), radius * angle.sin(), height * HEIGHT)
    };
    let mut b = Builder::new();
    for k in 0..rounds {
        for u in 0..columns {
            let key = if k == 0 { CAST_ON[0] } else { KNIT[0] };
            b.face(key, k, &[place(u, k), place(u + 1, k), place(u + 1, k + 1), place(u, k + 1)]);
        }
    }
    b.finish()
}

/// Plain weave.
fn weave(columns: usize, rows: usize) -> StitchMesh {
    let mut b = Builder::new();
    for k in 0..rows {
        for u in 0..columns {
            let name = if (u + k) % 2 == 0 { "over" } else { "under" };
            let p = |i: usize, j: usize| DVec3::new(i as f64, j as f64, 0.0);
            let corners = [p(u, k), p(u + 1, k), p(u + 1, k + 1), p(u, k + 1)];
            b.face(&format!("{name} -a1 +e1 +a1 -e1"), k, &corners);
        }
    }
    b.finish()
}

/// A swatch with a face squeezed to a point, one to a line, a folded one and one far out of plane.
fn degenerate() -> StitchMesh {
    let mut mesh = StitchMesh { face_offsets: vec![0], ..StitchMesh::default() };
    let sound = flat(6, 6, |_, _| true);
    // Unwelded, so that only the chosen faces are spoilt.
    for face in 0..sound.face_count() {
        for v in sound.face(face.into()) {
            mesh.face_vertices.push(mesh.positions.len().into());
            mesh.positions.push(sound.positions[v.index()]);
        }
        mesh.face_offsets.push(mesh.face_vertices.len() as u32);
    }
    (mesh.face_types, mesh.types, mesh.joins) = (sound.face_types, sound.types, sound.joins);
    mesh.face_source = sound.face_source;
    let spoil = |mesh: &mut StitchMesh, face: usize, change: &dyn Fn([DVec3; 4]) -> [DVec3; 4]| {
        let first = mesh.face_offsets[face] as usize;
        let corners = [0, 1, 2, 3].map(|c| mesh.positions[first + c]);
        mesh.positions[first..first + 4].copy_from_slice(&change(corners));
    };
    spoil(&mut mesh, 7, &|c| [c[0]; 4]);
    spoil(&mut mesh, 10, &|c| [c[0], c[1], c[1], c[0]]);
    spoil(&mut mesh, 20, &|c| [c[0], c[1], c[3], c[2]]);
    spoil(&mut mesh, 27, &|c| [c[0], c[1], c[2] + DVec3::Z * 3.0, c[3]]);
    mesh
}

/// The swatch as an OBJ file whose materials name the stitches, and whose corners begin anywhere: texture
/// coordinates say which way is up.
fn as_obj(mesh: &StitchMesh) -> String {
    let mut text = String::from("# A swatch for modelling tools: the material of a face is its stitch.\n");
    for p in &mesh.positions {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for p in &mesh.positions {
        text += &format!("vt {} {}\n", p.x / 16.0 + 0.25, p.y / 16.0 + 0.25);
    }
    let mut last = String::new();
    for face in 0..mesh.face_count() {
        let name = &mesh.face_type(face.into()).name;
        if *name != last {
            text += &format!("usemtl {name}\n");
            last.clone_from(name);
        }
        let corners = mesh.face(face.into());
        text += "f";
        for c in 0..corners.len() {
            let v = corners[(c + face) % corners.len()].index() + 1;
            text += &format!(" {v}/{v}");
        }
        text += "\n";
    }
    text
}

/// The samples by file name.
pub fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let swatch = flat(12, 14, |_, _| true);
    let bytes = |mesh: &StitchMesh| {
        let mut bytes = Vec::new();
        smobj::write(mesh, &mut bytes).expect("memory");
        bytes
    };
    vec![
        ("swatch.smobj", bytes(&swatch)),
        ("swatch.obj", as_obj(&flat(8, 8, |_, _| true)).into_bytes()),
        ("rib.smobj", bytes(&flat(12, 14, |u, _| u % 4 < 2))),
        ("garter.smobj", bytes(&flat(10, 12, |_, k| k % 2 == 0))),
        ("lace.smobj", bytes(&lace(3, 16))),
        ("tube.smobj", bytes(&tube(24, 12))),
        ("weave.smobj", bytes(&weave(8, 8))),
        ("degenerate.smobj", bytes(&degenerate())),
    ]
}

#[allow(dead_code)]
fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "stitches".into());
    std::fs::create_dir_all(&folder)?;
    for (name, bytes) in samples() {
        std::fs::write(Path::new(&folder).join(name), bytes)?;
    }
    Ok(())
}
