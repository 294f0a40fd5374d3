//! Whole frames: places, normals, control points, both sides of seams, knots, energies, statuses.
//!
//! Bits agree in all of it, the signs of zeros too, on Mesa's lavapipe. There, as the driver sees fit, 99.7 % of the faces
//! were within 1e-4 r: faces' areas (`surface.wgsl`) differ first, then the normal equations (`sums.wgsl`); frames, starts
//! and energies at the start agree even so.
//!
//! Seeded faults, each seen red: t1 longer by 1 % (not seen by `embedded`, which needs no frame, and rightly so), points
//! of `embedded` higher by 1 %. `faults` has more.

use crate::case::{Case, Frame, JOINT, agree, agreement, compiled, told};
use crate::common::Random;
use crate::common::faces::{faces, motion};
use crate::common::gpu::adapter;
use crate::common::grid::{Wrap, grid, placed, tube_place};
use glam::DVec3;
use knotmesh::backend::gpu::{Adapter, GpuOptions};
use knotmesh::knot::{Settings, Solver, Start, Status};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::Mode;
use knotmesh::template::{Coordinates, Template, TemplateLibrary};

/// Faces of each template; workgroups full and partial.
const FACES: [usize; 2] = [37, 33];
/// Where shaders do not run as they are written: this share of the faces ...
const MOST: f64 = 0.99;
/// ... is within this, yarn radii ...
const NEAR: f64 = 1e-4;
/// ... and none is further off than so many draws of the input's last bits move the twin.
const DRAWS: u64 = 8;

/// All templates, some of the first ones in more than one workgroup.
pub fn everything() -> StitchMesh {
    faces(TemplateLibrary::embedded().templates(), |t| if t == 0 { 256 + 33 } else { FACES[t % 2] })
}

/// Four templates: one, two and three knots, and edges of their own.
pub fn chosen() -> Vec<Template> {
    let library = TemplateLibrary::embedded();
    let names = ["knit+ -lX +yX +lX -yX", "knittuck", "decrease", "slip"];
    let of_name = |name| library.templates().iter().find(|t: &&Template| t.name.starts_with(name));
    names.map(|name| library.by_key(name).or_else(|| of_name(name)).expect("a template").clone()).into()
}

/// A tube whose faces share points and normals, stretched, with one corner that is not finite.
pub fn tube() -> (StitchMesh, Vec<Vec<DVec3>>) {
    let (columns, rows) = (19, 31);
    let key = |row: usize, column: usize| {
        if (row + column).is_multiple_of(3) { "purl+ -lX +yX +lX -yX" } else { "knit+ -lX +yX +lX -yX" }
    };
    let mesh = grid(columns, rows, Wrap::Helix, false, |r, c| key(r, c).to_string());
    let mesh = placed(mesh, columns, tube_place(columns, true));
    let mut random = Random::new(5);
    let mut stretched = || -> Vec<DVec3> {
        let [x, y, z] = [(); 3].map(|()| random.between(0.7, 1.3));
        mesh.positions.iter().map(|p| *p * DVec3::new(x, y, z)).collect()
    };
    let mut frames = vec![mesh.positions.clone(), stretched(), stretched()];
    frames[2][7] = DVec3::NAN;
    (mesh, frames)
}

/// Solves in all combinations of solver, start and spacing.
fn solves(starts: &[Start]) -> Vec<Settings> {
    let mut all = Vec::new();
    for solver in [Solver::Safeguarded, Solver::GaussNewton] {
        for start in starts {
            for beta in [1.0, 0.3] {
                // As many steps as differ in what they run into: none, one, a few, up to the end.
                let iterations = [3, 1, 10, 0, 3, 3, 2, 3][all.len() % 8];
                all.push(Settings { solver, start: *start, iterations, beta, ..Settings::default() });
            }
        }
    }
    all
}

/// Compares a case, as close as the device allows; gives the twin's frames.
fn compare(case: &Case, adapter: &Adapter, options: &GpuOptions, what: &str) -> Vec<Frame> {
    let twin = case.by_twin();
    let (device, exact) = case.by_device(adapter, options);
    let counts = agreement(&twin, &device);
    let Settings { solver, start, iterations, beta, .. } = case.settings;
    let told = told(&counts);
    println!("{what}, {solver:?} {start:?} {iterations} steps, beta {beta}: {told}");
    if exact {
        assert!(agree(&counts), "{what}, {:?}: {told}", case.settings);
    } else {
        within_bound(case, &twin, &device, what);
    }
    twin
}

/// The bound where shaders run as a driver sees fit.
fn within_bound(case: &Case, twin: &[Frame], device: &[Frame], what: &str) {
    let nudged: Vec<_> = (0..DRAWS).map(|seed| case.by_twin_nudged(seed + 1)).collect();
    let (mut all, mut near) = (0, 0);
    let (mut worst, mut beyond) = (0.0f64, 0.0f64);
    for (i, (a, b)) in twin.iter().zip(device).enumerate() {
        let apart = case.apart(a, b);
        let moved: Vec<_> = nudged.iter().map(|n| case.apart(a, &n[i])).collect();
        for batch in &case.scene.batches {
            // What the input's last bits do is known from few draws: the batch's faces speak for one another.
            let range = batch.first_face..batch.first_face + batch.faces.len();
            let bound = moved.iter().flat_map(|m| &m[range.clone()]).fold(NEAR, |m, x| m.max(*x));
            for x in &apart[range] {
                all += 1;
                near += usize::from(*x <= NEAR);
                worst = worst.max(*x);
                beyond = beyond.max(if *x <= bound { 0.0 } else { x / bound });
            }
        }
    }
    println!(
        "{what}: {near} of {all} faces within {NEAR} r, the worst {worst:.1e} r, {beyond:.1e} of its bound"
    );
    assert!(near as f64 >= MOST * all as f64, "{what}: {near} of {all} faces within {NEAR} r");
    assert!(beyond == 0.0, "{what}: {beyond} times what the input's last bits do");
}

/// Every template, in a mode and by solves; the statuses found.
fn every_template(mode: Mode, coordinates: Coordinates, solves: &[Settings]) -> Option<[usize; 8]> {
    let adapter = adapter()?;
    let mesh = everything();
    let scene = compiled(&mesh, mode, coordinates);
    let motion = motion(&mesh, 3);
    let mut found = [0; 8];
    for settings in solves {
        let case = Case::new(&scene, &motion, *settings);
        let twin = compare(&case, &adapter, &JOINT, &format!("{mode:?} {coordinates:?}"));
        for frame in twin {
            frame[5].iter().for_each(|status| found[*status as usize] += 1);
        }
    }
    println!("{} templates, {} faces, statuses {found:?}", scene.stencils.len(), scene.face_count);
    assert_eq!(scene.stencils.len(), TemplateLibrary::embedded().templates().len());
    Some(found)
}

#[test]
fn relaxed() {
    let solves = solves(&[Start::Affine, Start::Previous]);
    let Some(found) = every_template(Mode::Relax, Coordinates::MeanValue, &solves) else { return };
    for status in &Status::ALL[..6] {
        assert!(found[*status as usize] > 100, "{status:?}: {found:?}");
    }
}

/// As many steps as a driver allows that ends loops; beyond that it must say so. Seen red with 64 steps allowed.
#[test]
fn long_solves() {
    let long = [(Solver::Safeguarded, 60), (Solver::GaussNewton, 20)].map(|(solver, iterations)| Settings {
        solver,
        start: Start::Affine,
        iterations,
        ..Settings::default()
    });
    if every_template(Mode::Relax, Coordinates::MeanValue, &long).is_none() {
        return;
    }
    let adapter = adapter().expect("it was there");
    let mesh = everything();
    let scene = compiled(&mesh, Mode::Relax, Coordinates::MeanValue);
    let case = Case::new(&scene, &[], Settings { iterations: 21, ..long[1] });
    match case.try_device(&adapter, &JOINT) {
        Ok(_) => assert!(!adapter.report().name.contains("llvmpipe"), "it ends loops"),
        Err(e) => assert!(e.to_string().contains("--iterations 21: expected 20 at most"), "{e}"),
    }
}

#[test]
fn relaxed_in_wachspress_coordinates() {
    every_template(Mode::Relax, Coordinates::Wachspress, &solves(&[Start::Affine, Start::Previous]));
}

#[test]
fn knots_carried() {
    let spaced = [1.0, 0.3].map(|beta| Settings { beta, ..Settings::default() });
    for coordinates in [Coordinates::MeanValue, Coordinates::Wachspress] {
        every_template(Mode::Knots, coordinates, &spaced);
    }
}

#[test]
fn embedded() {
    for coordinates in [Coordinates::MeanValue, Coordinates::Wachspress] {
        every_template(Mode::Embed, coordinates, &[Settings::default()]);
    }
}

#[test]
fn from_tables() {
    let Some(adapter) = adapter() else { return };
    let mesh = faces(&chosen(), |t| FACES[t % 2]);
    let motion = motion(&mesh, 4);
    for coordinates in [Coordinates::MeanValue, Coordinates::Wachspress] {
        let scene = compiled(&mesh, Mode::Relax, coordinates);
        for settings in solves(&[Start::Table]) {
            let case = Case::new(&scene, &motion, settings);
            compare(&case, &adapter, &JOINT, &format!("table {coordinates:?}"));
        }
    }
}

#[test]
fn joined_faces() {
    let Some(adapter) = adapter() else { return };
    let (mesh, motion) = tube();
    for coordinates in [Coordinates::MeanValue, Coordinates::Wachspress] {
        let scene = compiled(&mesh, Mode::Relax, coordinates);
        assert!(scene.yarns.seams.len() > 500, "faces share points");
        for settings in solves(&[Start::Previous, Start::Affine]) {
            compare(
                &Case::new(&scene, &motion, settings),
                &adapter,
                &JOINT,
                &format!("tube {coordinates:?}"),
            );
        }
    }
}

#[test]
fn without_energies() {
    let Some(adapter) = adapter() else { return };
    let mesh = faces(&chosen(), |t| FACES[t % 2]);
    let motion = motion(&mesh, 6);
    let scene = compiled(&mesh, Mode::Relax, Coordinates::MeanValue);
    for settings in solves(&[Start::Affine]) {
        let case = Case { energies: false, ..Case::new(&scene, &motion, settings) };
        compare(&case, &adapter, &JOINT, "without energies");
    }
}

/// Shaders of their own: every count is known to the compiler.
#[test]
fn own_shaders() {
    let Some(adapter) = adapter() else { return };
    let (chosen, modes) = own(&adapter);
    let mesh = faces(&chosen, |t| FACES[t % 2]);
    let motion = motion(&mesh, 7);
    let settings = Settings { start: Start::Table, ..Settings::default() };
    let options = GpuOptions { own_shaders: true, ..JOINT };
    for mode in modes {
        let scene = compiled(&mesh, *mode, Coordinates::MeanValue);
        compare(&Case::new(&scene, &motion, settings), &adapter, &options, "own shaders");
    }
}

/// What shaders of their own are compared on. Software unrolls all their loops: half a minute for a knit's, and minutes for
/// one with a table; nobody is given them there unless asked.
pub fn own(adapter: &Adapter) -> (Vec<Template>, &'static [Mode]) {
    if adapter.report().is_software() {
        println!("software: own shaders of one stitch type only, from no table");
        (chosen()[..1].to_vec(), &[Mode::Knots, Mode::Embed])
    } else {
        (chosen(), &[Mode::Knots, Mode::Embed, Mode::Relax])
    }
}

/// As the driver sees fit.
#[test]
fn not_as_written() {
    let Some(adapter) = adapter() else { return };
    let mesh = everything();
    let scene = compiled(&mesh, Mode::Relax, Coordinates::MeanValue);
    let motion = motion(&mesh, 3);
    let options = GpuOptions { exact: false, ..JOINT };
    compare(&Case::new(&scene, &motion, Settings::default()), &adapter, &options, "not as written");
}
