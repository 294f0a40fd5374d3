//! Every stage on its own, by name, against the CPU's function for it.
//!
//! Seeded fault, seen red: the frame's shear told 1 % larger.

use crate::case::{Case, JOINT, compiled, tables};
use crate::common::faces::{faces, motion};
use crate::common::gpu::adapter;
use crate::frames::{chosen, everything, own};
use crate::record::{Row, Rows, record};
use crate::twin::{Face, Stages, stages};
use knotmesh::backend::gpu::{GpuOptions, trace};
use knotmesh::backend::{Backend, FrameOutput, Tables};
use knotmesh::knot::{Kernel, KnotState, Settings, Solver, Start};
use knotmesh::math::V3;
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Batch, Mode, Scene};
use knotmesh::template::Coordinates;
use std::collections::BTreeMap;
use std::sync::Arc;

fn kernels(scene: &Scene, settings: &Settings) -> Vec<Kernel<f32>> {
    let tables = Tables::new(scene, settings, Some(&tables())).tables;
    let kernel = |(stencil, table): (_, Option<_>)| {
        Kernel::new(stencil, scene.mode, settings).with_table(table.map(Arc::new))
    };
    scene.stencils.iter().zip(tables).map(kernel).collect()
}

/// `[batch][face]` all stages of a frame on the CPU.
fn by_twin(
    scene: &Scene,
    kernels: &[Kernel<f32>],
    surface: &[V3<f32>],
    earlier: Option<&[KnotState<f32>]>,
) -> Vec<Vec<Stages>> {
    let of_batch = |(batch, kernel): (&Batch, &Kernel<f32>)| {
        let k = kernel.stencil.knot_count();
        let of_face = |i: usize| {
            let earlier = earlier.map(|all| (&all[batch.first_knot + i * k..][..k], true));
            stages(kernel, &Face::load(scene, batch, i, surface), earlier)
        };
        (0..batch.faces.len()).map(of_face).collect()
    };
    scene.batches.iter().zip(kernels).map(of_batch).collect()
}

fn up(p: &V3<f32>) -> V3<f32> {
    V3 { x: p.x.next_up(), y: p.y.next_up(), z: p.z.next_up() }
}

/// Compares the stages of all frames of a motion; gives how often each was seen.
fn compare(
    mesh: &StitchMesh,
    (mode, coordinates): (Mode, Coordinates),
    settings: Settings,
    options: &GpuOptions,
    seed: u64,
) -> BTreeMap<&'static str, usize> {
    let Some(adapter) = adapter() else { return BTreeMap::new() };
    let scene = compiled(mesh, mode, coordinates);
    let motion = motion(mesh, seed);
    let case = Case::new(&scene, &motion, settings);
    let kernels = kernels(&scene, &settings);
    let mut twin = case.twin();
    let mut device = case.device(&adapter, &GpuOptions { trace: true, ..*options });
    let [mut twin_output, mut output] = [(); 2].map(|()| FrameOutput::default());
    let Settings { solver, start, iterations, beta, .. } = settings;
    let how = match options.free {
        Some(function) => format!("{function} as the driver sees fit"),
        None if device.is_exact() => "as written".into(),
        None => "as the driver sees fit".into(),
    };
    let name = format!("{mode:?} {coordinates:?} {solver:?} {start:?} {iterations} {beta} {seed} {how}");
    let (mut rows, mut seen) = (Rows::new(), BTreeMap::new());
    for (frame, positions) in motion.iter().enumerate() {
        let earlier = (start == Start::Previous && frame > 0).then(|| twin_output.knots.clone());
        twin.frame(positions, &mut twin_output).expect("as many as vertices");
        device.frame(positions, &mut output).expect("as many as vertices");
        let surface = twin.surface();
        let right = by_twin(&scene, &kernels, &surface, earlier.as_deref());
        // Where a unit in the last place leads: all places a little up.
        let nudged: Vec<_> = surface.iter().map(up).collect();
        let nudged = by_twin(&scene, &kernels, &nudged, earlier.as_deref());
        for (b, (batch, kernel)) in scene.batches.iter().zip(&kernels).enumerate() {
            if kernel.stencil.points.is_empty() {
                continue;
            }
            let places = trace::stages(&kernel.stencil);
            let words = trace::words(&kernel.stencil);
            let told = device.trace(b).expect("read");
            assert!(told.len() >= words * batch.faces.len(), "all faces are told");
            let key = scene.templates[batch.stencil].key();
            for (i, told) in told.chunks_exact(words).take(batch.faces.len()).enumerate() {
                let other: BTreeMap<_, _> = nudged[b][i].iter().map(|(n, v)| (*n, v)).collect();
                for (stage, values) in &right[b][i] {
                    let at = places.iter().position(|(n, _)| n == stage).expect("a stage");
                    let row: &mut Row = rows.entry((name.clone(), key.clone(), at, *stage)).or_default();
                    row.compare(values, &told[places[at].1.clone()]);
                    if let Some(nudged) = other.get(stage) {
                        row.nudge(values, nudged);
                    }
                    *seen.entry(*stage).or_default() += 1;
                }
            }
        }
    }
    if options.free.is_some() {
        let mut shares = BTreeMap::<_, [usize; 2]>::new();
        for ((_, _, at, stage), row) in &rows {
            let share = shares.entry((at, stage)).or_default();
            share[0] += row.identical;
            share[1] += row.floats;
        }
        let shares = shares.iter().filter(|(_, [same, all])| same < all);
        let told: Vec<_> = shares
            .map(|((_, stage), [same, all])| format!("{stage} {:.4}", *same as f64 / *all as f64))
            .collect();
        println!("{how}: {}", if told.is_empty() { "all identical".into() } else { told.join(", ") });
    }
    let mut faults = Vec::new();
    for ((_, template, _, stage), row) in &rows {
        if row.identical < row.floats {
            faults.push(format!("{template}, {stage}: {row:?}"));
        }
    }
    println!("{name}: {} faces, faces by stage {seen:?}", scene.face_count);
    record(rows);
    if device.is_exact() {
        assert!(
            faults.is_empty(),
            "{name}: {} differ, such as {:#?}",
            faults.len(),
            &faults[..faults.len().min(9)]
        );
    } else {
        println!("{name}: {} stages of templates differ", faults.len());
    }
    seen
}

const RELAXED: (Mode, Coordinates) = (Mode::Relax, Coordinates::MeanValue);

fn all_seen(seen: &BTreeMap<&'static str, usize>, count: usize) {
    assert!(seen.is_empty() || seen.len() == count, "{seen:?}");
    assert!(seen.values().all(|n| *n > 100), "{seen:?}");
}

#[test]
fn of_every_template() {
    let mesh = everything();
    for solver in [Solver::Safeguarded, Solver::GaussNewton] {
        for start in [Start::Affine, Start::Previous] {
            let settings = Settings { solver, start, ..Settings::default() };
            all_seen(&compare(&mesh, RELAXED, settings, &JOINT, 11), 9);
        }
    }
}

#[test]
fn of_every_template_in_other_modes() {
    let mesh = everything();
    let settings = Settings { beta: 0.3, ..Settings::default() };
    all_seen(&compare(&mesh, RELAXED, settings, &JOINT, 12), 9);
    all_seen(&compare(&mesh, (Mode::Knots, Coordinates::MeanValue), settings, &JOINT, 12), 5);
    let settings = Settings::default();
    all_seen(&compare(&mesh, (Mode::Embed, Coordinates::MeanValue), settings, &JOINT, 12), 5);
}

#[test]
fn from_tables() {
    let mesh = faces(&chosen(), |t| 33 + t);
    for beta in [1.0, 0.3] {
        let settings = Settings { start: Start::Table, beta, ..Settings::default() };
        all_seen(&compare(&mesh, RELAXED, settings, &JOINT, 13), 9);
    }
}

#[test]
fn of_own_shaders() {
    let Some(adapter) = adapter() else { return };
    let mesh = faces(&own(&adapter).0, |t| 133 + t);
    let options = GpuOptions { own_shaders: true, ..JOINT };
    let way = (Mode::Relax, Coordinates::Wachspress);
    all_seen(&compare(&mesh, way, Settings::default(), &options, 14), 9);
}

/// As the driver sees fit: how far each stage is off, and what the input's last bits do to it, is only recorded; what
/// comes of it all is bounded in `frames`.
#[test]
fn not_as_written() {
    let options = GpuOptions { exact: false, ..JOINT };
    all_seen(&compare(&everything(), RELAXED, Settings::default(), &options, 11), 9);
}

/// Which expressions a driver rewrites, where it may: each function is left to it alone, then all but it. Takes a quarter of
/// an hour, for each shader is another: `cargo test --test gpu left_to_the_driver -- --ignored --nocapture`.
#[test]
#[ignore = "takes a quarter of an hour; tells which expressions a driver rewrites"]
fn functions_left_to_the_driver() {
    const FILES: [&str; 10] =
        ["vector", "frame", "start", "lift", "energy", "sums", "factor", "solve", "stitch", "surface"];
    let mesh = everything();
    let left = |free: String| {
        let options = GpuOptions { free: Some(free.leak()), ..JOINT };
        compare(&mesh, RELAXED, Settings::default(), &options, 11);
    };
    left("-".into());
    for file in FILES {
        let text = std::fs::read_to_string(format!("shaders/{file}.wgsl")).expect("it is there");
        let names = text.lines().filter_map(|line| line.strip_prefix("fn ")?.split('(').next());
        for name in names {
            left(name.into());
            left(format!("-{name}"));
        }
    }
}
