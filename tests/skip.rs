//! What a frame leaves undone: that nothing else comes out, that it is what can be left undone, and faces that nobody
//! sees. Bounds stand at the tests.
//!
//! Seeded faults, each seen red here: shapes compared with the frame before instead of the one last solved, a face that is
//! shown anew taken for known, no ring of faces around the visible ones, hidden faces taken for settled, turned normals
//! not noticed; a mesh that moves as one: both sides of seams not turned along, turned along without end. Knots shared between knits and purls stay green: they mirror each other and are equal.

mod common;

use common::Random;
use common::grid::{Wrap, grid};
use glam::{DMat3, DVec3};
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Precision, Running, Skip, Skipped};
use knotmesh::io::smobj;
use knotmesh::knot::{Settings, Start, Status};
use knotmesh::math::{Scalar, Width};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::Path;
use std::sync::Arc;

const KNIT: &str = "knit+ -lX +yX +lX -yX";
const FRAMES: usize = 8;
const STARTS: [Start; 3] = [Start::Affine, Start::Previous, Start::Table];
const MOTIONS: [&str; 5] = ["still", "rigid", "bend", "stretch", "noise"];
/// Motions of about a third of the default tolerance a frame.
const SLOW: [&str; 2] = ["jiggle", "drift"];

fn swatch() -> StitchMesh {
    grid(14, 10, Wrap::Flat, true, |_, _| KNIT.into())
}

fn lace() -> StitchMesh {
    smobj::read_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("stitches/lace.smobj")).expect("it reads")
}

fn compiled(mesh: &StitchMesh) -> Arc<Scene> {
    Arc::new(Scene::compile(mesh, &TemplateLibrary::embedded(), SceneOptions::default()).expect("compiles"))
}

fn settings(start: Start) -> Settings {
    Settings { start, iterations: if start == Start::Table { 1 } else { 3 }, ..Settings::default() }
}

fn backend<T: Precision>(scene: &Arc<Scene>, settings: &Settings, running: &Running) -> CpuBackend<T> {
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("skip-tables");
    CpuBackend::with_cache(scene.clone(), settings, running, Some(&cache)).expect("settings are in range")
}

fn running(skip: Skip) -> Running {
    Running { threads: 1, skip, ..Running::default() }
}

/// Frame 0 is the mesh as it stands.
fn moved(mesh: &StitchMesh, motion: &str, frame: usize) -> Vec<DVec3> {
    let t = frame as f64 / (FRAMES - 1) as f64;
    let right = mesh.positions.iter().map(|p| p.x).fold(f64::MIN, f64::max);
    let left = mesh.positions.iter().map(|p| p.x).fold(f64::MAX, f64::min);
    let place = |(i, p): (usize, &DVec3)| match motion {
        "still" => *p,
        "rigid" => {
            DMat3::from_rotation_x(1.1 * t) * DMat3::from_rotation_z(2.0 * t) * *p
                + DVec3::new(3.0, -2.0, 1.0) * t
        }
        "bend" => {
            // The right third rolls up.
            let begin = left + (right - left) * 2.0 / 3.0;
            let (past, turn) = ((p.x - begin).max(0.0), 0.2 * t);
            if past == 0.0 || turn == 0.0 {
                return *p;
            }
            let (sin, cos) = (turn * past).sin_cos();
            DVec3::new(begin + (sin - p.z * sin * turn) / turn, p.y, (1.0 - cos) / turn + p.z * cos)
        }
        "stretch" => *p * DVec3::new(1.0 - 0.1 * t, 1.0 + 0.3 * t, 1.0),
        // Strains grow on and on.
        "drift" => {
            *p * DVec3::new(1.0 + 3e-5 * frame as f64, 1.0 - 5e-5 * frame as f64, 1.0)
                + DVec3::X * (3e-5 * frame as f64 * p.y)
        }
        // Each corner trembles about a place of its own.
        "jiggle" => {
            let mut random = Random::new(i as u64);
            let mut place = || random.between(-0.08, 0.08);
            let strained = *p + DVec3::new(place(), place(), place());
            let mut random = Random::new((frame * 100_003 + i) as u64);
            let mut next = || random.between(-3e-5, 3e-5);
            strained + DVec3::new(next(), next(), next())
        }
        _ => {
            let mut random = Random::new((frame * 100_003 + i) as u64);
            let mut next = || random.between(-0.05, 0.05) * f64::from(frame > 0);
            *p + DVec3::new(next(), next(), next())
        }
    };
    mesh.positions.iter().enumerate().map(place).collect()
}

fn bits<T: Scalar>(output: &FrameOutput<T>) -> Vec<u64> {
    let points = output.points.iter().flat_map(|p| [p.x, p.y, p.z]);
    let knots = output.knots.iter().flat_map(|k| [k.direction.u, k.direction.v, k.half_length]);
    let energies = output.faces.iter().flat_map(|f| [f.energy_start, f.energy]);
    let numbers = points.chain(knots).chain(energies).map(|x| x.to_f64().to_bits());
    numbers.chain(output.faces.iter().map(|f| f.status as u64)).collect()
}

/// Distances of control points, in yarn radii.
fn apart<T: Scalar>(scene: &Scene, a: &FrameOutput<T>, b: &FrameOutput<T>) -> Vec<f64> {
    let pairs = a.points.iter().zip(&b.points);
    pairs.map(|(a, b)| (a.to_f64() - b.to_f64()).length() / scene.yarn_radius).collect()
}

fn unmoved() -> Skip {
    Skip { unmoved: true, ..Skip::NOTHING }
}

/// Faces around which nothing moved come out as they would, to the bit; with the start at the previous frame's
/// result the others would go on a little.
fn check_unmoved<T: Precision>() {
    for mesh in [swatch(), lace()] {
        let scene = compiled(&mesh);
        for start in [Start::Affine, Start::Table] {
            for motion in MOTIONS {
                let mut plain = backend::<T>(&scene, &settings(start), &running(Skip::NOTHING));
                let mut other = backend::<T>(&scene, &settings(start), &running(unmoved()));
                let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
                for frame in 0..FRAMES {
                    let positions = moved(&mesh, motion, frame);
                    plain.frame(&positions, &mut a).unwrap();
                    other.frame(&positions, &mut b).unwrap();
                    assert!(bits(&a) == bits(&b), "{start:?} {motion} frame {frame}");
                    assert_eq!(a.skipped.unmoved, 0);
                    let stands = b.skipped.unmoved as f64 / scene.face_count as f64;
                    let expected = match motion {
                        _ if frame == 0 => 0.0..=0.0,
                        "still" => 1.0..=1.0,
                        "bend" => 0.5..=0.7,
                        _ => 0.0..=0.0,
                    };
                    assert!(expected.contains(&stands), "{motion} frame {frame}: {stands} stand");
                }
            }
        }
    }
}

#[test]
fn faces_that_stand_still_keep_their_bits_f32() {
    check_unmoved::<f32>();
}

#[test]
fn faces_that_stand_still_keep_their_bits_f64() {
    check_unmoved::<f64>();
}

/// With the default tolerance of 1e-3 r, control points are within 2e-3 r of what they would be. Measured, in f32 and
/// f64: at most 0.67e-3 r with the affine start, 0.66e-3 r with the previous frame's and 1.05e-3 r with the table's, where
/// 4 of 8.7 million points are off by more than 1e-3 r.
fn check_bounds<T: Precision>() {
    let one = |f: fn(&mut Skip)| {
        let mut skip = Skip { tolerance: 1e-3, ..Skip::NOTHING };
        f(&mut skip);
        skip
    };
    let skips = [
        ("rigid", one(|s| s.rigid = true)),
        ("rest", one(|s| s.rest = true)),
        ("shared", one(|s| s.shared = true)),
        ("all", Skip::default()),
    ];
    let (mut most, mut beyond, mut count) = ([0.0f64; 3], 0, 0);
    for mesh in [swatch(), lace()] {
        let scene = compiled(&mesh);
        for start in STARTS {
            for motion in MOTIONS.into_iter().chain(SLOW) {
                let mut plain = backend::<T>(&scene, &settings(start), &running(Skip::NOTHING));
                let mut others = skips.map(|(_, s)| backend::<T>(&scene, &settings(start), &running(s)));
                let mut a = FrameOutput::default();
                let mut outputs = skips.map(|_| FrameOutput::default());
                let frames = if motion == "drift" { 60 } else { FRAMES };
                for frame in 0..frames {
                    let positions = moved(&mesh, motion, frame);
                    plain.frame(&positions, &mut a).unwrap();
                    for ((other, output), (name, skip)) in others.iter_mut().zip(&mut outputs).zip(skips) {
                        other.frame(&positions, output).unwrap();
                        check_counts(&scene, output.skipped, name, skip, start, motion, frame);
                        for d in apart(&scene, &a, output) {
                            most[start as usize] = most[start as usize].max(d);
                            assert!(d < 0.1, "{start:?} {motion} {name} frame {frame}: {d:.1e} r");
                            beyond += usize::from(d > 1e-3);
                            count += 1;
                        }
                    }
                }
            }
        }
    }
    println!("most {most:?}, {beyond} of {count} beyond");
    let worst = most.iter().copied().fold(0.0, f64::max);
    assert!(worst < 2e-3, "{most:?} r");
    assert!(beyond * 100_000 < count, "{beyond} of {count} beyond 1e-3 r");
}

/// How many are left out is known for some cases.
fn check_counts(scene: &Scene, s: Skipped, name: &str, skip: Skip, start: Start, motion: &str, frame: usize) {
    let what = format!("{name} {start:?} {motion} frame {frame}: {s:?} of {}", scene.face_count);
    let plain = scene.batches.len() == 1;
    let knotted: usize = scene
        .batches
        .iter()
        .filter(|b| scene.stencils[b.stencil].knot_count() > 0)
        .map(|b| b.faces.len())
        .sum();
    assert!(skip.unmoved || s.unmoved == 0, "{what}");
    assert!(skip.rigid || s.rigid == 0, "{what}");
    assert!(skip.rest || s.rest == 0, "{what}");
    assert!((skip.shared && start != Start::Previous) || s.shared == 0, "{what}");
    assert_eq!(s.hidden, 0, "{what}");
    let lifted = s.rigid + s.rest + s.shared;
    match (name, motion) {
        ("all", "still") if frame > 0 && start != Start::Previous => {
            assert_eq!(s.unmoved, scene.face_count, "{what}");
        }
        ("all", "rigid") if frame > 0 && start != Start::Previous => assert_eq!(lifted, knotted, "{what}"),
        ("rest", "rigid") if plain => assert_eq!(lifted, knotted, "{what}"),
        // One solve, and no face's own.
        ("all" | "shared", "stretch" | "drift") if plain && start != Start::Previous => {
            assert_eq!(lifted, knotted, "{what}");
        }
        ("all", "noise") if frame > 0 => assert!(lifted < knotted / 10, "{what}"),
        ("rigid", "jiggle") if frame > 0 && start != Start::Previous => {
            assert!(lifted > knotted * 9 / 10, "{what}");
        }
        // A face is solved anew every few frames.
        ("rigid", "drift") if plain && start != Start::Previous => {
            assert!(frame == 0 || lifted == 0 || lifted == knotted, "{what}");
        }
        _ => {}
    }
}

#[test]
fn skipping_stays_within_its_bound_f32() {
    check_bounds::<f32>();
}

#[test]
fn skipping_stays_within_its_bound_f64() {
    check_bounds::<f64>();
}

/// Errors do not add up over a drift that stays below the tolerance each frame, whatever the tolerance: fast enough that
/// faces are looked at one by one, or so slow that the whole mesh passes for rigid.
#[test]
fn a_drift_is_followed() {
    let mesh = swatch();
    let scene = compiled(&mesh);
    for (tolerance, speed) in [(1e-4, 0.03), (1e-3, 0.03), (1e-2, 0.03), (1e-3, 5e-4)] {
        let skip = Skip { tolerance, ..Skip::default() };
        let run = |skip| {
            let mut backend = backend::<f64>(&scene, &settings(Start::Affine), &running(skip));
            let mut output = FrameOutput::default();
            let mut solved = 0;
            for frame in 0..400 {
                let strain = speed * tolerance * scene.yarn_radius * frame as f64;
                // No two faces alike, so that none is shared.
                let place = |p: &DVec3| *p + DVec3::new(p.x * p.y, p.y * p.y, 0.0) * strain;
                let positions: Vec<DVec3> = mesh.positions.iter().map(place).collect();
                backend.frame(&positions, &mut output).unwrap();
                let s = output.skipped;
                solved += scene.face_count - s.rigid - s.rest - s.shared - s.unmoved;
            }
            (output, solved)
        };
        let ((all, every), (some, few)) = (run(Skip::NOTHING), run(skip));
        let most = apart(&scene, &all, &some).into_iter().fold(0.0, f64::max);
        println!("{tolerance:.0e}, {speed:.0e}: {:.2} of it; {few} of {every} solved", most / tolerance);
        let bound = if speed < 1e-3 { 2.0 } else { 1.0 };
        assert!(most < bound * tolerance, "{most:.1e} r at a tolerance of {tolerance:.0e}");
        let least = if speed < 1e-3 { 50 } else { 141 };
        assert!(few >= least && few < every / 2, "{few} of {every} solved");
    }
}

/// A mesh that turns as one keeps its yarn frame after frame, and a part that then moves meets the rest where it is.
#[test]
fn a_long_turn_does_not_drift() {
    let mesh = lace();
    let scene = compiled(&mesh);
    let pose = moved(&mesh, "noise", 1);
    let mut plain = backend::<f32>(&scene, &settings(Start::Table), &running(Skip::NOTHING));
    let mut other = backend::<f32>(&scene, &settings(Start::Table), &running(Skip::default()));
    let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
    let (mut most, mut first_lifted) = (0.0f64, None);
    for frame in 0..70 {
        // Every tenth frame, a tenth of the vertices moves on its own while the rest stands, and then back.
        let alone = frame % 10 == 9;
        let t = f64::from(frame - i32::from(alone)) * 0.09;
        let turn = DMat3::from_rotation_y(t) * DMat3::from_rotation_z(1.7 * t);
        let mut positions: Vec<DVec3> =
            pose.iter().map(|p| turn * *p + DVec3::new(4.0, 1.0, -2.0) * t).collect();
        if alone {
            for p in positions.iter_mut().take(pose.len() / 10) {
                p.z += 0.05;
            }
        }
        plain.frame(&positions, &mut a).unwrap();
        other.frame(&positions, &mut b).unwrap();
        most = apart(&scene, &a, &b).into_iter().fold(most, f64::max);
        let s = b.skipped;
        if frame % 10 != 9 && frame % 10 != 0 {
            assert_eq!(s.rigid + s.without_knots, scene.face_count, "frame {frame}");
            first_lifted.get_or_insert(frame);
        }
    }
    println!("{most:.1e} r at most");
    assert_eq!(first_lifted, Some(1));
    assert!(most < 2e-3, "{most:.1e} r");
}

/// The same bits for any number of threads and lanes, with everything skipped that can be.
#[test]
fn skipping_does_not_depend_on_threads_or_lanes() {
    let mesh = lace();
    let scene = compiled(&mesh);
    for motion in MOTIONS.into_iter().chain(SLOW) {
        let variants = [(1, Width::One), (2, Width::Eight), (3, Width::Sixteen), (2, Width::One)];
        let mut backends = variants.map(|(threads, width)| {
            let running = Running { threads, width, ..Running::default() };
            backend::<f32>(&scene, &settings(Start::Table), &running)
        });
        let mut outputs = variants.map(|_| FrameOutput::default());
        for frame in 0..FRAMES {
            for (backend, output) in backends.iter_mut().zip(&mut outputs) {
                backend.frame(&moved(&mesh, motion, frame), output).unwrap();
            }
            for other in &outputs[1..] {
                assert!(bits(other) == bits(&outputs[0]), "{motion} frame {frame}");
                assert_eq!(other.skipped, outputs[0].skipped);
            }
        }
    }
}

/// The control points that belong to faces, by whether they are named.
fn points_of(scene: &Scene, named: &[bool]) -> Vec<bool> {
    let of = |slot: u32| {
        let (batch, index, _) = scene.slot_place(slot);
        named[batch.faces[index].index()]
    };
    let slots = scene.point_slots().iter();
    slots.map(|s| s.iter().any(|s| *s != knotmesh::scene::NO_SECOND_SLOT && of(*s))).collect()
}

/// Whatever was hidden before, all points of visible faces are those of a backend that sees everything: in the frame
/// in which a face is shown, next to hidden ones, and where nothing moves meanwhile.
#[test]
fn visible_faces_are_right_at_once() {
    for (start, motion) in [Start::Affine, Start::Table].into_iter().flat_map(|s| MOTIONS.map(|m| (s, m))) {
        let mesh = lace();
        let scene = compiled(&mesh);
        let mut whole = backend::<f32>(&scene, &settings(start), &running(Skip::NOTHING));
        let mut part = backend::<f32>(&scene, &settings(start), &running(unmoved()));
        let [mut a, mut b] = [FrameOutput::default(), FrameOutput::default()];
        let mut random = Random::new(5);
        for frame in 0..12 {
            // Every other frame stands still, and the last shows everything again.
            let positions = moved(&mesh, motion, frame / 2);
            let share = random.unit();
            let visible: Vec<bool> =
                (0..mesh.face_count()).map(|_| frame == 11 || random.unit() < share).collect();
            part.set_visible((frame != 10).then_some(&visible)).unwrap();
            whole.frame(&positions, &mut a).unwrap();
            part.frame(&positions, &mut b).unwrap();
            let visible = if frame == 10 { vec![true; visible.len()] } else { visible };
            for (i, own) in points_of(&scene, &visible).into_iter().enumerate() {
                assert!(!own || a.points[i] == b.points[i], "{start:?} {motion} frame {frame}: point {i}");
                assert!(b.points[i].finite());
            }
            for (face, visible) in visible.iter().enumerate() {
                let status = b.face(&scene, face.into()).status;
                assert!(!visible || status == a.face(&scene, face.into()).status);
            }
            let hidden = b.faces.iter().filter(|f| f.status == Status::Hidden).count();
            assert_eq!(b.skipped.hidden, hidden, "frame {frame}");
        }
    }
}

/// Hidden faces keep their points; in an output that is new they are interpolated, not left at zero or as they were in it.
#[test]
fn hidden_faces_stay_where_they_were() {
    let mesh = swatch();
    let scene = compiled(&mesh);
    for start in STARTS {
        let mut backend = backend::<f64>(&scene, &settings(start), &Running::default());
        let mut output = FrameOutput::default();
        backend.set_visible(Some(&vec![false; mesh.face_count()])).unwrap();
        let rest = moved(&mesh, "stretch", 7);
        backend.frame(&rest, &mut output).unwrap();
        assert_eq!(output.skipped.hidden, scene.face_count);
        let mut whole = FrameOutput::default();
        let mut seen = self::backend::<f64>(&scene, &settings(start), &running(Skip::NOTHING));
        seen.frame(&rest, &mut whole).unwrap();
        let near = apart(&scene, &output, &whole).into_iter().fold(0.0, f64::max);
        assert!(near > 0.01 && near < 3.0, "{near} r");
        let before = output.clone();
        backend.frame(&moved(&mesh, "noise", 3), &mut output).unwrap();
        assert!(before.points == output.points);
        // Shown, it is as in a first frame.
        backend.set_visible(None).unwrap();
        backend.frame(&rest, &mut output).unwrap();
        let most = apart(&scene, &output, &whole).into_iter().fold(0.0, f64::max);
        assert!(most < 1e-3, "{start:?}: {most:.1e} r");
        assert!(backend.set_visible(Some(&[true])).is_err());
    }
}

/// Outputs may be swapped, and may come from another backend; faces that fall back recover.
#[test]
fn foreign_outputs_and_bad_faces() {
    let (mesh, other) = (lace(), swatch());
    let scene = compiled(&mesh);
    for start in [Start::Affine, Start::Table] {
        let mut plain = backend::<f64>(&scene, &settings(start), &running(Skip::NOTHING));
        let mut skipping = backend::<f64>(&scene, &settings(start), &running(Skip::default()));
        let mut foreign = FrameOutput::default();
        let mut stranger = backend::<f64>(&compiled(&other), &settings(start), &running(Skip::default()));
        stranger.frame(&other.positions, &mut foreign).unwrap();
        let mut outputs = [foreign, FrameOutput::default()];
        for frame in 0..9 {
            let mut positions = moved(&mesh, "bend", frame / 3);
            if frame % 3 == 1 {
                positions[40] = DVec3::NAN;
                positions[80] = positions[81];
            }
            let mut whole = FrameOutput::default();
            plain.frame(&positions, &mut whole).unwrap();
            let output = &mut outputs[frame / 2 % 2];
            skipping.frame(&positions, output).unwrap();
            let most = apart(&scene, &whole, output).into_iter().fold(0.0, f64::max);
            assert!(most < 1e-3, "frame {frame}: {most:.1e} r");
            let fallen = |o: &FrameOutput<f64>| -> Vec<bool> {
                o.faces.iter().map(|f| f.status == Status::FellBack).collect()
            };
            assert_eq!(fallen(&whole), fallen(output), "frame {frame}");
        }
    }
}

/// Energies that nobody asked for change nothing else.
#[test]
fn energies_are_optional() {
    use knotmesh::knot::Solver;
    use knotmesh::scene::Mode;
    let mesh = lace();
    for (mode, solver) in [
        (Mode::Relax, Solver::GaussNewton),
        (Mode::Relax, Solver::Safeguarded),
        (Mode::Knots, Solver::Safeguarded),
        (Mode::Embed, Solver::Safeguarded),
    ] {
        let options = SceneOptions { mode, ..SceneOptions::default() };
        let scene = Arc::new(Scene::compile(&mesh, &TemplateLibrary::embedded(), options).unwrap());
        let settings = Settings { solver, ..Settings::default() };
        let outputs = [true, false].map(|energies| {
            let running = Running { energies, ..running(Skip::NOTHING) };
            let mut output = FrameOutput::default();
            let mut backend = backend::<f32>(&scene, &settings, &running);
            backend.frame(&moved(&mesh, "stretch", 5), &mut output).unwrap();
            output
        });
        let [with, without] = outputs;
        assert!(with.points == without.points && with.knots == without.knots);
        assert!(with.faces.iter().all(|f| f.energy.is_finite()));
        let spared = solver == Solver::GaussNewton || mode != Mode::Relax;
        for (a, b) in with.faces.iter().zip(&without.faces) {
            assert!(a.status == b.status && (b.energy.is_nan() || !spared));
        }
    }
}
