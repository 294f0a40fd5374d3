//! What the GPU leaves undone: the same as its f32 twin does, frame by frame, to the bit.
#![cfg(feature = "gpu")]

mod common;

use common::curves::samples;
use common::grid::{Wrap, grid};
use glam::{DMat3, DVec3};
use knotmesh::backend::gpu::{Adapter, GpuBackend, GpuOptions, OnCpu};
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running, Skip, Skipped, Wanted};
use knotmesh::io::smobj;
use knotmesh::knot::{Settings, Start};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::Path;
use std::sync::Arc;

const FRAMES: usize = 8;

fn swatch() -> StitchMesh {
    grid(14, 10, Wrap::Flat, true, |_, _| "knit+ -lX +yX +lX -yX".into())
}

fn lace() -> StitchMesh {
    smobj::read_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches/lace.smobj")).expect("it reads")
}

fn scene(mesh: &StitchMesh) -> Arc<Scene> {
    Arc::new(Scene::compile(mesh, &TemplateLibrary::embedded(), SceneOptions::default()).unwrap())
}

/// Frame 0 is the mesh as it stands.
fn moved(mesh: &StitchMesh, motion: &str, frame: usize) -> Vec<DVec3> {
    let t = frame as f64 / (FRAMES - 1) as f64;
    let middle = mesh.positions.iter().map(|p| p.x).sum::<f64>() / mesh.positions.len() as f64;
    let turn = DMat3::from_rotation_y(1.2 * t) * DMat3::from_rotation_z(t);
    let place = |(i, p): (usize, &DVec3)| match motion {
        "still" => *p,
        "rigid" => turn * *p + DVec3::new(3.0, 0.0, 1.0) * t,
        // The right half turns as a whole; what lies between is stretched.
        "part" if p.x > middle => DMat3::from_rotation_x(0.4 * t) * *p,
        "stretch" => *p * DVec3::new(1.0 + 0.2 * t, 1.0 - 0.1 * t, 1.0),
        "noise" => {
            let mut random = common::Random::new((frame * 100_000 + i) as u64);
            *p + DVec3::new(
                random.between(-0.05, 0.05),
                random.between(-0.05, 0.05),
                random.between(-0.05, 0.05),
            )
        }
        // Shapes change by some tolerances a frame.
        "creep" => *p + DVec3::new(p.x * p.y, p.y * p.y, 0.0) * 5e-4 * frame as f64,
        // One vertex is lost in the middle of it.
        "lost" if i == 30 && (3..5).contains(&frame) => DVec3::NAN,
        "lost" => *p * (1.0 + 0.01 * t),
        _ => *p,
    };
    mesh.positions.iter().enumerate().map(place).collect()
}

fn bits(output: &FrameOutput<f32>) -> Vec<u32> {
    // 0 and -0 are the same.
    let word = |x: f32| (x + 0.0).to_bits();
    let mut all: Vec<u32> = output.points.iter().flat_map(|p| [p.x, p.y, p.z]).map(word).collect();
    all.extend(output.knots.iter().flat_map(|k| [k.direction.u, k.direction.v, k.half_length]).map(word));
    all.extend(output.faces.iter().flat_map(|f| [word(f.energy_start), word(f.energy), f.status as u32]));
    all
}

/// Compares runs through motions. With `hide`, some faces are hidden; with `ahead`, frames are told ahead.
fn compare(mesh: &StitchMesh, start: Start, skip: Skip, motions: &[&str], ways: [bool; 2]) {
    let Some(adapter) = common::gpu::adapter() else { return };
    if let Err(words) = compared(&adapter, GpuOptions::default(), mesh, (start, skip), motions, ways) {
        panic!("{words}");
    }
}

/// What is different, if anything.
fn compared(
    adapter: &Adapter,
    options: GpuOptions,
    mesh: &StitchMesh,
    (start, skip): (Start, Skip),
    motions: &[&str],
    [hide, ahead]: [bool; 2],
) -> Result<(), String> {
    let scene = scene(mesh);
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("skip-tables");
    let settings = Settings { start, ..Settings::default() };
    let running = Running { threads: 1, skip, ..Running::default() };
    let mut cpu = CpuBackend::<f32>::with_cache(scene.clone(), &settings, &running, Some(&cache)).unwrap();
    let mut gpu =
        GpuBackend::new(scene.clone(), &settings, &running, &options, adapter, Some(&cache)).unwrap();
    assert_eq!(gpu.part_count() > 1, options.most_bytes.is_some(), "parts where they are asked for");
    let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
    let mut all = Skipped::default();
    // A window of faces that wanders.
    let show = |frame: usize, backend: &mut dyn Backend<f32>| {
        let seen: Vec<bool> =
            (0..mesh.face_count()).map(|f| (f + 17 * frame) % mesh.face_count() < 60).collect();
        backend.set_visible((hide && frame != 5).then_some(&seen[..])).unwrap();
    };
    for motion in motions {
        for frame in 0..FRAMES {
            show(frame, &mut cpu);
            if !(ahead && frame > 0) {
                show(frame, &mut gpu);
            }
            let positions = moved(mesh, motion, frame);
            cpu.frame(&positions, &mut a).unwrap();
            gpu.frame(&positions, &mut b).unwrap();
            let at = format!("{start:?} {motion} frame {frame}");
            if a.skipped != b.skipped {
                return Err(format!("{at}: {:?} instead of {:?}", b.skipped, a.skipped));
            }
            let off = bits(&a).iter().zip(&bits(&b)).filter(|(x, y)| x != y).count();
            if gpu.is_exact() && off > 0 {
                return Err(format!("{at}: {off} numbers differ"));
            }
            all = all + b.skipped;
            if ahead && frame + 1 < FRAMES {
                show(frame + 1, &mut gpu);
                gpu.ahead(&moved(mesh, motion, frame + 1)).unwrap();
            }
        }
    }
    println!("{start:?}: {all:?}");
    Ok(())
}

const MOTIONS: [&str; 7] = ["still", "rigid", "part", "stretch", "creep", "noise", "lost"];

#[test]
fn a_swatch_from_the_table() {
    compare(&swatch(), Start::Table, Skip::default(), &MOTIONS, [false; 2]);
}

#[test]
fn lace_from_the_affine_start() {
    compare(&lace(), Start::Affine, Skip::default(), &MOTIONS, [false; 2]);
}

#[test]
fn lace_from_the_frame_before() {
    compare(&lace(), Start::Previous, Skip::default(), &MOTIONS, [false; 2]);
}

#[test]
fn each_skip_alone() {
    let one =
        |i: usize| Skip { unmoved: i == 0, rigid: i == 1, rest: i == 2, shared: i == 3, ..Skip::default() };
    for i in 0..4 {
        compare(&swatch(), Start::Affine, one(i), &["part", "stretch"], [false; 2]);
    }
}

#[test]
fn hidden_faces() {
    for start in [Start::Table, Start::Previous] {
        compare(&lace(), start, Skip::default(), &["part", "noise"], [true, false]);
    }
    compare(&lace(), Start::Affine, Skip::NOTHING, &["noise"], [true, false]);
}

#[test]
fn frames_told_ahead() {
    for start in [Start::Table, Start::Previous] {
        compare(&lace(), start, Skip::default(), &MOTIONS, [false, true]);
        compare(&lace(), start, Skip::default(), &["part", "noise"], [true, true]);
    }
}

/// What is skipped does not depend on how many parts the scene is in.
#[test]
fn in_parts() {
    let Some(adapter) = common::gpu::adapter() else { return };
    let options = GpuOptions { most_bytes: Some(6_000), ..GpuOptions::default() };
    for (mesh, start, ways) in [
        (swatch(), Start::Table, [false, true]),
        (lace(), Start::Affine, [false, false]),
        (lace(), Start::Previous, [true, true]),
    ] {
        if let Err(words) = compared(&adapter, options, &mesh, (start, Skip::default()), &MOTIONS, ways) {
            panic!("{words}");
        }
    }
}

/// Samples of curves, frame by frame, where faces are skipped; knots stay on the device.
#[test]
fn what_is_wanted() {
    let Some(adapter) = common::gpu::adapter() else { return };
    let mesh = lace();
    let scene = scene(&mesh);
    let running = Running { threads: 1, ..Running::default() };
    for start in [Start::Affine, Start::Previous] {
        let settings = Settings { start, ..Settings::default() };
        let mut cpu = CpuBackend::<f32>::new(scene.clone(), &settings, &running).unwrap();
        let mut gpu =
            GpuBackend::new(scene.clone(), &settings, &running, &GpuOptions::default(), &adapter, None)
                .unwrap();
        let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
        for frame in 0..4 * FRAMES {
            let motion = ["part", "rigid", "noise", "still"][frame / FRAMES];
            let positions = moved(&mesh, motion, frame % FRAMES);
            // It is said anew now and then what is wanted.
            let wanted = Wanted { points: true, knots: frame % 5 == 3, curves: [3, 0, 2][frame / 6 % 3] };
            gpu.set_wanted(wanted).unwrap();
            cpu.frame(&positions, &mut a).unwrap();
            gpu.frame(&positions, &mut b).unwrap();
            let subdivide = wanted.curves;
            if b.skipped.unmoved < scene.face_count {
                assert_eq!(b.curves.subdivide, subdivide, "frame {frame}");
            }
            if !gpu.is_exact() {
                continue;
            }
            for subdivide in [0, subdivide] {
                let [x, y] = [&a, &b].map(|o| samples(&scene, o, subdivide));
                let off = x.iter().zip(&y).filter(|(p, q)| p != q).count();
                assert_eq!(
                    (x.len(), off),
                    (y.len(), 0),
                    "{start:?} {motion} frame {frame}: samples that differ"
                );
            }
            if wanted.knots {
                assert_eq!(a.knots.len(), b.knots.len(), "{motion} frame {frame}");
                let off = a.knots.iter().zip(&b.knots).filter(|(p, q)| p != q).count();
                assert_eq!(off, 0, "{motion} frame {frame}: knots that differ");
            }
        }
    }
}

/// A frame that was told wrong is solved all the same.
#[test]
fn frames_told_wrong() {
    let Some(adapter) = common::gpu::adapter() else { return };
    let mesh = lace();
    let scene = scene(&mesh);
    let settings = Settings::default();
    let running = Running { threads: 1, ..Running::default() };
    let mut cpu = CpuBackend::<f32>::new(scene.clone(), &settings, &running).unwrap();
    let mut gpu =
        GpuBackend::new(scene, &settings, &running, &GpuOptions::default(), &adapter, None).unwrap();
    let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
    for (frame, motion) in ["stretch", "noise", "still", "noise", "part"].iter().enumerate() {
        let positions = moved(&mesh, motion, frame);
        cpu.frame(&positions, &mut a).unwrap();
        gpu.frame(&positions, &mut b).unwrap();
        if gpu.is_exact() {
            let off = bits(&a).iter().zip(&bits(&b)).filter(|(x, y)| x != y).count();
            assert_eq!(off, 0, "frame {frame}: numbers that differ");
        }
        gpu.ahead(&moved(&mesh, "noise", 7 + frame)).unwrap();
    }
}

/// Stages left to the CPU change nothing.
#[test]
fn the_first_stages_on_the_cpu() {
    let Some(adapter) = common::gpu::adapter() else { return };
    let mesh = lace();
    let scene = scene(&mesh);
    let settings = Settings::default();
    let running = Running { threads: 1, skip: Skip::NOTHING, ..Running::default() };
    let mut cpu = CpuBackend::<f32>::new(scene.clone(), &settings, &running).unwrap();
    let mut a = FrameOutput::default();
    let positions = moved(&mesh, "noise", 1);
    cpu.frame(&positions, &mut a).unwrap();
    for number in 0..4 {
        let options = GpuOptions { on_cpu: OnCpu::stages(number).unwrap(), ..GpuOptions::default() };
        let mut gpu = GpuBackend::new(scene.clone(), &settings, &running, &options, &adapter, None).unwrap();
        let mut b = FrameOutput::default();
        gpu.frame(&positions, &mut b).unwrap();
        if gpu.is_exact() {
            let off = bits(&a).iter().zip(&bits(&b)).filter(|(x, y)| x != y).count();
            assert_eq!(off, 0, "stage {number}: numbers that differ");
        }
    }
}

/// Faults in the shader that chooses faces are found.
#[test]
fn faults_of_choosing_are_found() {
    let Some(adapter) = common::gpu::adapter() else { return };
    const FAULTS: [(&str, &str); 5] = [
        ("surface[settings.turned + normal - settings.group_normals] != 0u", "false"),
        ("shapes[own_shape + 1u + i] = bitcast<f32>(known[at + i]);", ""),
        ("add_to_list(select(0u, 1u, SOLVES), face | TOP);", ""),
        ("abs(a.x - b.x) <= settings.tolerance", "abs(a.x - b.x) <= 100.0 * settings.tolerance"),
        ("shapes[own_shape + 2u * i] = shape[i].y;", "shapes[own_shape + 2u * i] = shape[i].x;"),
    ];
    let text = std::fs::read_to_string("shaders/select.wgsl").unwrap();
    for fault in FAULTS {
        assert!(text.contains(fault.0), "{} is no part of the shader", fault.0);
        let options = GpuOptions { fault: Some(fault), ..GpuOptions::default() };
        let found = [(swatch(), false), (lace(), false), (lace(), true)].iter().any(|(mesh, hide)| {
            let skips = (Start::Affine, Skip::default());
            compared(&adapter, options, mesh, skips, &["part", "noise", "creep"], [*hide, false]).is_err()
        });
        assert!(found, "{} instead of {} is not found", fault.1, fault.0);
    }
}
