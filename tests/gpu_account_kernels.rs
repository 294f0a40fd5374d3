//! The account of the kernels around stitches against what their threads count, thread by thread: areas, normals, seams,
//! points turned along, faces chosen, curves; and what a stitch reads to learn its face where faces were chosen.
//!
//! What only the data decides is taken from the counters where faces are chosen: how many corners were looked at, and
//! compared. What was decided is not: exactly one choice must cost what was counted, and their numbers must be those that
//! the backend reports.
//!
//! Seeded faults on paper, each seen red: in `areas` an operation less a triangle; in `corner_normals` flags not read; in
//! `join` only one side read; in `carry` the shift not added; in `choose` atomics that only write; in `curve` mirrored points
//! taken from one point.
#![cfg(feature = "gpu")]

mod common;
#[path = "../examples/tube/mod.rs"]
#[allow(dead_code)]
mod tube;

use common::faces::{faces, motion};
use common::gpu::adapter;
use glam::{DQuat, DVec3};
use knotmesh::backend::gpu::account::Costs;
use knotmesh::backend::gpu::account::kernels::{
    Choice, Choosing, ENTRY, Looks, Segment, areas, carry, choose, corner_normals, curve, join, steps,
};
use knotmesh::backend::gpu::account::{Kind, STAGES};
use knotmesh::backend::gpu::counters::{self, Counted, KERNEL_COUNTERS};
use knotmesh::backend::gpu::{Counting, GpuBackend, GpuOptions, shader};
use knotmesh::backend::{Backend, FrameOutput, Running, Skip, Skipped, Wanted};
use knotmesh::io::smobj;
use knotmesh::knot::{Settings, Solver};
use knotmesh::math::{V3, Width};
use knotmesh::mesh::StitchMesh;
use knotmesh::scene::{Batch, Mode, Scene, SceneOptions};
use knotmesh::template::{Coordinates, TemplateLibrary};
use std::sync::Arc;

/// Faces of each template.
const FACES: usize = 5;
/// Extra samples a segment.
const EXTRA: usize = 3;

/// A backend that counts; `None` where it cannot.
fn counting(mesh: &StitchMesh, coordinates: Coordinates, skip: Skip) -> Option<(Arc<Scene>, GpuBackend)> {
    let adapter = adapter()?;
    let options =
        SceneOptions { mode: Mode::Relax, coordinates, gauge: Some(1.0), ..SceneOptions::default() };
    let scene = Scene::compile(mesh, &TemplateLibrary::embedded(), options).expect("compiles");
    let scene = Arc::new(scene);
    let running = Running { threads: 1, width: Width::One, skip, energies: false };
    let options = GpuOptions { count: true, ..GpuOptions::PLAIN };
    let settings = Settings { solver: Solver::GaussNewton, iterations: 1, ..Settings::default() };
    let backend =
        GpuBackend::new(scene.clone(), &settings, &running, &options, &adapter, None).expect("taken");
    if !backend.is_exact() {
        println!("skipped: shaders are not taken as they are written");
        return None;
    }
    Some((scene, backend))
}

fn everything() -> StitchMesh {
    faces(TemplateLibrary::embedded().templates(), |_| FACES)
}

fn plain_tube(stitches: usize) -> StitchMesh {
    let text = tube::smobj(stitches, tube::Vertices::Shared);
    smobj::read("tube.smobj".as_ref(), text.as_bytes()).expect("a mesh")
}

/// Where paper and counters differ, if they do.
fn difference(paper: &Costs, counted: &Costs) -> Option<String> {
    let of_stage = |s: usize| {
        let differs = move |kind: &Kind| paper.0[s][*kind as usize] != counted.0[s][*kind as usize];
        let told = move |kind: Kind| {
            let [paper, counted] = [paper, counted].map(|c| c.0[s][kind as usize]);
            format!("{} {kind:?}: {paper} on paper, {counted} counted", STAGES[s])
        };
        Kind::ALL.into_iter().filter(differs).map(told)
    };
    let all: Vec<String> = (0..STAGES.len()).flat_map(of_stage).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

fn same(name: &str, thread: usize, paper: &Costs, counted: &Counted) {
    if let Some(difference) = difference(paper, &counted.costs) {
        panic!("{name} {thread}: {difference}");
    }
}

/// Shaders with counters are valid; no device is needed.
#[test]
fn counters_fit() {
    let texts = [shader::counted(shader::surface(64), 5), shader::counted(shader::curve(64), 4)];
    for text in texts {
        let segments = counters::segments(&text).unwrap_or_else(|fault| panic!("{}", fault.0));
        assert!(segments.len() <= KERNEL_COUNTERS && segments.len() > 3);
        assert!(text.contains(&format!("COUNTERS: u32 = {KERNEL_COUNTERS}u;")));
    }
}

#[test]
fn surfaces_and_seams() {
    let meshes = [
        (everything(), Coordinates::MeanValue),
        (plain_tube(300), Coordinates::MeanValue),
        (plain_tube(300), Coordinates::Wachspress),
    ];
    for (mesh, coordinates) in meshes {
        let Some((scene, mut backend)) = counting(&mesh, coordinates, Skip::default()) else { return };
        let mut output = FrameOutput::default();
        let groups = scene.corner_groups.as_ref().map_or(&[][..], |g| &g.offsets);
        let seams = scene.yarns.seams.len();
        let points = scene.yarns.point_count() + 2 * seams;
        println!(
            "{} vertices, {} faces, {} groups, {seams} seams, {points} points and sides",
            scene.vertex_count,
            scene.face_places.len(),
            groups.len().saturating_sub(1)
        );
        backend.frame(&mesh.positions, &mut output).expect("as many as vertices");
        let told = backend.counted_since(Counting::Surface).expect("read");
        assert!(told.len() >= points.max(scene.face_places.len()));
        for (i, counted) in told.iter().enumerate() {
            let mut paper = Costs::default();
            if let Some([begin, end]) = scene.face_offsets.get(i..i + 2) {
                paper.add(&areas((end - begin) as usize), 1);
            }
            if let Some([begin, end]) = groups.get(i..i + 2) {
                paper.add(&corner_normals((end - begin) as usize), 1);
            }
            paper.add(&join(), u64::from(i < seams));
            same("surface", i, &paper, counted);
        }
        // All turned as one.
        let turn = DQuat::from_rotation_y(0.3);
        let turned: Vec<DVec3> = mesh.positions.iter().map(|p| turn * *p + DVec3::X).collect();
        backend.frame(&turned, &mut output).expect("as many as vertices");
        let told = backend.counted_since(Counting::Surface).expect("read");
        for (i, counted) in told.iter().enumerate() {
            let mut paper = Costs::default();
            paper.add(&carry(), u64::from(i < points));
            same("carry", i, &paper, counted);
        }
    }
}

/// A length's root, as `spacing` in `shaders/curve.wgsl`.
fn spacing(a: V3<f32>, b: V3<f32>) -> f32 {
    let [x, y, z] = [b.x - a.x, b.y - a.y, b.z - a.z];
    (x * x + y * y + z * z).sqrt().sqrt()
}

/// A control point's segment, worked out from the frame's points.
fn segment(scene: &Scene, yarn: usize, i: usize, points: &[V3<f32>]) -> Segment {
    let yarns = &scene.yarns;
    let own = &points[yarns.range(yarn)];
    let (n, closed) = (own.len(), yarns.closed[yarn]);
    let steps = steps(yarn, yarns.len());
    if !closed && i == n - 1 {
        return Segment { steps, mirrored: None, sound: [[false; 2]; 2] };
    }
    let mirror = |p: V3<f32>, q: V3<f32>| V3::new(p.x + p.x - q.x, p.y + p.y - q.y, p.z + p.z - q.z);
    let (before, after) = if closed {
        (own[(i + n - 1) % n], own[(i + 2) % n])
    } else {
        let before = if i == 0 { mirror(own[0], own[1]) } else { own[i - 1] };
        (before, if i + 2 >= n { mirror(own[n - 1], own[n - 2]) } else { own[i + 2] })
    };
    let four = [before, own[i], own[(i + 1) % n], after];
    let d: Vec<f32> = four.windows(2).map(|p| spacing(p[0], p[1])).collect();
    let sound = [0, 1].map(|k| [0.0 < d[k] && 0.0 < d[k + 1], (d[k] + d[k + 1]).is_finite()]);
    let mirrored = if closed { 0 } else { usize::from(i == 0) + usize::from(i + 2 >= n) };
    Segment { steps, mirrored: Some(mirrored), sound }
}

#[test]
fn curves() {
    let (mut seen, mut unsound, mut ends) = ([0; 2], 0, 0);
    let all = everything();
    let frames = motion(&all, 8);
    for (mesh, positions) in [(&plain_tube(300), None), (&all, Some(&frames[1]))] {
        let Some((scene, mut backend)) = counting(mesh, Coordinates::MeanValue, Skip::NOTHING) else {
            return;
        };
        let mut output = FrameOutput::default();
        for extra in [EXTRA, 1] {
            backend.set_wanted(Wanted { points: true, knots: false, curves: extra }).expect("room");
            backend.frame(positions.unwrap_or(&mesh.positions), &mut output).expect("as many as vertices");
            let told = backend.counted_since(Counting::Curve).expect("read");
            assert_eq!(told.len(), scene.yarns.point_count());
            for yarn in 0..scene.yarns.len() {
                for (i, point) in scene.yarns.range(yarn).enumerate() {
                    let segment = segment(&scene, yarn, i, &output.points);
                    same("curve", point, &curve(&segment, extra), &told[point]);
                    seen[usize::from(scene.yarns.closed[yarn])] += 1;
                    unsound += usize::from(segment.sound.iter().any(|s| *s != [true; 2]));
                    ends += usize::from(segment.mirrored.is_none());
                }
            }
        }
    }
    println!("{seen:?} of open and closed yarns, {ends} ends, {unsound} with a spacing that is of no use");
    assert!(seen[0] > 1000 && unsound > ends + 20 && ends > 100);
}

fn finite_corners(batch: &Batch, n: usize, index: usize, surface: &[V3<f32>]) -> usize {
    let corners = &batch.corners[index * n..(index + 1) * n];
    let finite = |v: &&u32| {
        let p = surface[**v as usize];
        p.x.is_finite() && p.y.is_finite() && p.z.is_finite()
    };
    corners.iter().filter(finite).count()
}

/// The choice that costs what was counted, the only one that does.
fn decided(
    (n, knots): (usize, usize),
    choosing: &Choosing,
    (finite, hidden): (usize, bool),
    counted: &Counted,
) -> Result<Choice, String> {
    let runs = |function: &str, i: usize| counted.runs.get(function).map_or(0, |runs| runs[i] as usize);
    let [asked, others] = [0, 1].map(|i| runs("same_as_known", i));
    let [compared, both] = [0, 1].map(|i| runs("apart", i));
    let remembered = compared - others;
    let looks = Looks {
        changed: runs("changed", 0),
        finite,
        remembered: choosing.rigid && choosing.near,
        // Which shape they were compared with does not change what it costs.
        compared: [[remembered, both], [others, 0], [0, 0]],
        known: [(asked > 0).then_some(true), (asked > 1).then_some(true)],
    };
    let last = n - 1;
    let may = |choice: &Choice| match choice {
        Choice::Hidden { first } => hidden && *first != choosing.near,
        _ if hidden => false,
        Choice::Unmoved => choosing.near && looks.changed == n,
        Choice::WithoutKnots => knots == 0,
        Choice::Unusable => knots > 0 && compared == 0,
        Choice::Rigid => looks.remembered && [remembered, both] == [last; 2],
        Choice::Rest => asked == 1 && others == last && both >= last,
        Choice::Shared => asked == 2 && others >= last && both >= last,
        Choice::Solved => knots > 0 && asked == 2 && (others < 2 * last || both < compared),
    };
    let all = [
        Choice::Hidden { first: false },
        Choice::Hidden { first: true },
        Choice::Unmoved,
        Choice::WithoutKnots,
        Choice::Unusable,
        Choice::Rigid,
        Choice::Rest,
        Choice::Shared,
        Choice::Solved,
    ];
    let candidates: Vec<Choice> = all.into_iter().filter(may).collect();
    let told = |choice: &Choice| difference(&choose(n, knots, choosing, *choice, &looks), &counted.costs);
    let equal: Vec<Choice> = candidates.iter().copied().filter(|choice| told(choice).is_none()).collect();
    match equal[..] {
        [choice] => Ok(choice),
        _ => Err(format!(
            "{equal:?} of {candidates:?} {looks:?} {choosing:?}: {:?}",
            candidates.iter().map(told).collect::<Vec<_>>()
        )),
    }
}

#[test]
fn choosing() {
    let mesh = everything();
    let mut positions = motion(&mesh, 9);
    // At rest once more, for what is hidden then.
    positions.push(mesh.positions.clone());
    let (mut all, mut first) = (Skipped::default(), 0);
    for late in [false, true] {
        let Some((scene, mut backend)) = counting(&mesh, Coordinates::MeanValue, Skip::default()) else {
            return;
        };
        let mut output = FrameOutput::default();
        for (f, frame) in positions.iter().enumerate() {
            // Some are hidden from the first frame on, or from the third.
            let sight = f >= if late { 2 } else { 0 };
            let visible: Vec<bool> = (0..mesh.face_count()).map(|i| !sight || (i + f) % 3 != 0).collect();
            if sight {
                backend.set_visible(Some(&visible)).expect("as many as faces");
            }
            backend.frame(frame, &mut output).expect("as many as vertices");
            let surface = backend.surface().expect("read");
            let choosing = Choosing { sight, rigid: true, near: f > 0 };
            let mut tally = Skipped::default();
            for (b, batch) in scene.batches.iter().enumerate() {
                let stencil = &scene.stencils[batch.stencil];
                let (n, knots) = (stencil.corner_count, stencil.knot_count());
                let told = backend.counted_since(Counting::Choose(b)).expect("read");
                let key = scene.templates[batch.stencil].key();
                if told.is_empty() {
                    tally.without_knots += batch.faces.len();
                    continue;
                }
                assert_eq!(told.len(), batch.faces.len());
                for (i, counted) in told.iter().enumerate() {
                    let finite = finite_corners(batch, n, i, &surface);
                    let choice =
                        decided((n, knots), &choosing, (finite, !visible[batch.faces[i].index()]), counted)
                            .unwrap_or_else(|e| panic!("frame {f} {key} face {i}: {e}"));
                    match choice {
                        Choice::Hidden { first: new } => {
                            tally.hidden += 1;
                            first += usize::from(new);
                        }
                        Choice::Unmoved => tally.unmoved += 1,
                        Choice::WithoutKnots => tally.without_knots += 1,
                        Choice::Rigid => tally.rigid += 1,
                        Choice::Rest => tally.rest += 1,
                        Choice::Shared => tally.shared += 1,
                        Choice::Unusable | Choice::Solved => {}
                    }
                }
                // All of the first frame are on a list; later some keep what they counted then.
                let of_stitches = if f == 0 { backend.counted(b).expect("read") } else { Vec::new() };
                let stage = STAGES.iter().position(|s| *s == "stitch").expect("a stage");
                let entry = |c: &Counted| c.costs.0[stage][Kind::Lists as usize];
                assert!(of_stitches.iter().all(|c| entry(c) == ENTRY), "{key}: entries of lists");
            }
            println!("frame {f}: {tally:?}");
            assert_eq!(tally, output.skipped, "frame {f}");
            all = all + tally;
        }
    }
    let Skipped { hidden, unmoved, without_knots, rigid, rest, shared } = all;
    assert!([hidden, unmoved, without_knots, rigid, rest, shared, first].iter().all(|n| *n > 0), "{all:?}");
}
