//! Whole frames in lanes against the scalar f32, bit for bit: points, knots, energies, statuses, what was skipped.
//!
//! Seeded faults, each seen red: a scalar product of lanes with a fused multiply-add, or summed from its last term; the
//! last lane's corners not loaded; the points of a strand stored backwards; quotients by the reciprocal; `any` blind to
//! the last lane. Lanes left over at a group's end may hold anything, and may be solved or not: no lane looks at
//! another, and the tests were seen green with both.

use super::{bits, widths};
use crate::common::Random;
use crate::common::faces::{faces, motion};
use crate::common::grid::{Wrap, grid, placed, tube_place};
use glam::DVec3;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running, Skip, Skipped};
use knotmesh::knot::{Settings, Solver, Start, Status};
use knotmesh::math::Width;
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Mode, Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::sync::{Arc, LazyLock};
use tempfile::TempDir;

/// Faces of each template: groups of 8 and 16 full and partial, and a single one.
const FACES: [usize; 2] = [37, 33];

/// Everything that frames gave.
#[derive(PartialEq)]
struct Frames {
    /// Bits of points, knots and energies, then statuses, frame after frame.
    values: Vec<u32>,
    skipped: Vec<Skipped>,
}

struct Case {
    settings: Settings,
    threads: usize,
    skip: Skip,
}

/// Where tables are kept, so that each is made once.
static TABLES: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a folder"));

impl Case {
    fn frames(&self, scene: &Arc<Scene>, frames: &[Vec<DVec3>], width: Width) -> Frames {
        let running = Running { threads: self.threads, width, skip: self.skip, ..Running::default() };
        let mut backend =
            CpuBackend::<f32>::with_cache(scene.clone(), &self.settings, &running, Some(TABLES.path()))
                .expect("in range");
        let mut output = FrameOutput::default();
        let mut all = Frames { values: Vec::new(), skipped: Vec::new() };
        for positions in frames {
            backend.frame(positions, &mut output).expect("as many as vertices");
            for p in &output.points {
                all.values.extend([p.x, p.y, p.z].map(bits));
            }
            for k in &output.knots {
                all.values.extend([k.direction.u, k.direction.v, k.half_length].map(bits));
            }
            for f in &output.faces {
                all.values.extend([bits(f.energy_start), bits(f.energy), f.status as u32]);
            }
            all.skipped.push(output.skipped);
        }
        all
    }

    /// Compares widths; gives how many values agreed for each, and the scalar's.
    fn compare(
        &self,
        scene: &Arc<Scene>,
        frames: &[Vec<DVec3>],
        widths: &[Width],
        what: &str,
    ) -> (usize, Frames) {
        let scalar = self.frames(scene, frames, Width::One);
        for width in widths {
            let lanes = self.frames(scene, frames, *width);
            assert_eq!(scalar.skipped, lanes.skipped, "{what}: {width:?}");
            let differ = scalar.values.iter().zip(&lanes.values).filter(|(a, b)| a != b).count();
            let first = scalar.values.iter().zip(&lanes.values).position(|(a, b)| a != b);
            let show = |f: &Frames| first.map(|i| f32::from_bits(f.values[i]));
            assert!(
                first.is_none() && scalar.values.len() == lanes.values.len(),
                "{what}: {width:?}, {:?}, {} threads, {:?}: {differ} of {} differ, first {first:?}: {:?} {:?}",
                self.settings,
                self.threads,
                self.skip,
                scalar.values.len(),
                show(&scalar),
                show(&lanes)
            );
        }
        (scalar.values.len(), scalar)
    }
}

fn compiled(mesh: &StitchMesh, library: &TemplateLibrary, mode: Mode) -> Arc<Scene> {
    // As if nothing were deformed, so that a face at rest is one.
    let options = SceneOptions { mode, gauge: Some(1.0), ..SceneOptions::default() };
    Arc::new(Scene::compile(mesh, library, options).expect("compiles"))
}

/// All combinations of what a solve can be asked for.
fn cases(starts: &[Start], iterations: &[u32]) -> Vec<Case> {
    let mut cases = Vec::new();
    for solver in [Solver::Safeguarded, Solver::GaussNewton] {
        for start in starts {
            for iterations in iterations {
                for beta in [1.0, 0.3] {
                    for skip in [Skip::NOTHING, Skip::default()] {
                        let (start, iterations) = (*start, *iterations);
                        let settings = Settings { solver, start, iterations, beta, ..Settings::default() };
                        let threads = if cases.len() % 2 == 0 { 1 } else { 3 };
                        cases.push(Case { settings, threads, skip });
                        cases.push(Case { settings, threads: 4 - threads, skip });
                    }
                }
            }
        }
    }
    cases
}

#[test]
fn frames_of_every_template_are_the_scalars_to_the_bit() {
    let widths = widths();
    let library = TemplateLibrary::embedded();
    // Of the first one several chunks.
    let mesh = faces(library.templates(), |t| if t == 0 { 256 + 33 } else { FACES[t % 2] });
    let (mut count, mut found) = (0, [0usize; Status::ALL.len()]);
    for mode in [Mode::Relax, Mode::Knots, Mode::Embed] {
        let scene = compiled(&mesh, &library, mode);
        let frames = motion(&mesh, 3);
        let solves = mode == Mode::Relax;
        let starts: &[_] = if solves { &[Start::Affine, Start::Previous] } else { &[Start::Affine] };
        let iterations: &[_] = if solves { &[0, 1, 3, 10] } else { &[3] };
        for case in cases(starts, iterations) {
            let (values, scalar) = case.compare(&scene, &frames, &widths, &format!("{mode:?}"));
            count += values;
            let faces = 3 * scene.face_count;
            let each = scalar.values.chunks_exact(values / frames.len());
            for frame in each {
                frame[frame.len() - faces..].chunks_exact(3).for_each(|f| found[f[2] as usize] += 1);
            }
        }
    }
    println!(
        "{} templates, {} faces: {count} values agree for each of {widths:?}; statuses {found:?}",
        library.templates().len(),
        mesh.face_count()
    );
    // No faces are left out or hidden here; everything else must have been compared.
    for status in &Status::ALL[..6] {
        assert!(found[*status as usize] > 100, "{status:?}: {found:?}");
    }
}

#[test]
fn tabulated_starts_are_the_scalars_to_the_bit() {
    let widths = widths();
    let library = TemplateLibrary::embedded();
    let names = ["knit+ -lX +yX +lX -yX", "knittuck", "decrease", "slip"];
    let chosen = names.map(|name| {
        let of_name = || library.templates().iter().find(|t| t.name.starts_with(name));
        library.by_key(name).or_else(of_name).expect("a template").clone()
    });
    let mesh = faces(&chosen, |t| FACES[t % 2]);
    let scene = compiled(&mesh, &library, Mode::Relax);
    let frames = motion(&mesh, 4);
    let mut count = 0;
    for case in cases(&[Start::Table], &[0, 1, 3, 10]) {
        count += case.compare(&scene, &frames, &widths, "table").0;
    }
    println!("{count} values agree for each of {widths:?}");
}

/// A tube, whose faces share points and normals.
#[test]
fn joined_faces_are_the_scalars_to_the_bit() {
    let widths = widths();
    let library = TemplateLibrary::embedded();
    let (columns, rows) = (19, 31);
    let key = |row: usize, column: usize| {
        if (row + column).is_multiple_of(3) { "purl+ -lX +yX +lX -yX" } else { "knit+ -lX +yX +lX -yX" }
    };
    let mesh = placed(
        grid(columns, rows, Wrap::Helix, false, |r, c| key(r, c).to_string()),
        columns,
        tube_place(columns, true),
    );
    let scene = compiled(&mesh, &library, Mode::Relax);
    let mut random = Random::new(5);
    let stretched = |random: &mut Random| -> Vec<DVec3> {
        let scale = DVec3::new(random.between(0.7, 1.3), random.between(0.7, 1.3), random.between(0.7, 1.3));
        mesh.positions.iter().map(|p| *p * scale).collect()
    };
    let mut frames = vec![mesh.positions.clone(), stretched(&mut random), stretched(&mut random)];
    frames[2][7] = DVec3::NAN;
    let mut count = 0;
    for case in cases(&[Start::Affine, Start::Previous], &[1, 3]) {
        count += case.compare(&scene, &frames, &widths, "tube").0;
    }
    println!("{count} values agree for each of {widths:?}");
}
