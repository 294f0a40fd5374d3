//! Frame after frame: skips, lanes and threads.

use crate::common::fabric;
use glam::{DQuat, DVec2, DVec3};
use knotmesh::database::{Cpu, Fabric, RunningYarn, Settings, SkipYarn, YarnFrame};
use knotmesh::math::Width;
use std::sync::Arc;

fn made() -> (Arc<Fabric>, Vec<Vec<DVec3>>) {
    let mesh = fabric::sheet([24, 20], DVec2::new(0.2, 0.17));
    let made = Arc::new(Fabric::new(&mesh, fabric::model(40, 5), Settings::default()).unwrap());
    let start = fabric::waved(&mesh, 0.0);
    let mut frames = vec![start.clone(), start.clone()];
    // A corner moves.
    let mut some = start.clone();
    some.iter_mut().filter(|p| p.x < 0.05 && p.y < 0.05).for_each(|p| p.z += 0.002 * (p.x * 50.0).cos());
    frames.push(some.clone());
    // All turn, and back.
    let turn = DQuat::from_rotation_y(0.3);
    frames.push(some.iter().map(|p| turn * *p + DVec3::new(0.1, 0.0, 0.2)).collect());
    frames.push(some);
    // All is stretched.
    frames.push(fabric::waved(&mesh, 0.7));
    (made, frames)
}

fn run(fabric: &Arc<Fabric>, frames: &[Vec<DVec3>], running: RunningYarn) -> Vec<YarnFrame<f32>> {
    let mut cpu = Cpu::<f32>::new(fabric.clone(), running).unwrap();
    let mut frame = YarnFrame::default();
    frames
        .iter()
        .map(|positions| {
            cpu.frame(positions, &mut frame).unwrap();
            frame.clone()
        })
        .collect()
}

/// The same bits in any lanes and threads. Seen red with a lane's height taken from its neighbour.
#[test]
fn lanes_and_threads_do_not_matter() {
    let (fabric, frames) = made();
    let with = |threads, width| {
        let running = RunningYarn { threads, width, skip: SkipYarn::default() };
        run(&fabric, &frames, running)
    };
    let expected = with(1, Width::One);
    for (threads, width) in [(1, Width::Eight), (1, Width::Sixteen), (2, Width::Auto), (3, Width::One)] {
        for (a, b) in with(threads, width).iter().zip(&expected) {
            let bits = |f: &YarnFrame<f32>| -> Vec<u32> {
                let points = f.points.iter().flat_map(|p| [p.x, p.y, p.z]);
                points.chain(f.twists.iter().copied()).map(f32::to_bits).collect()
            };
            assert!(bits(a) == bits(b), "{threads} {width:?}");
            assert_eq!((a.outside, a.skipped), (b.outside, b.skipped));
        }
    }
}

/// Skips leave out what they should, and change the result by no more than their bound. Seen red with neither places nor
/// normals compared (unmoved), and with strains not compared (rigid).
#[test]
fn skips() {
    let (fabric, frames) = made();
    let running = |skip| RunningYarn { skip, ..RunningYarn::default() };
    let all = run(&fabric, &frames, running(SkipYarn::NOTHING));
    let unmoved = run(&fabric, &frames, running(SkipYarn { rigid: false, ..SkipYarn::default() }));
    let skipped = run(&fabric, &frames, running(SkipYarn::default()));
    let count = fabric.point_count();
    for (i, ((all, unmoved), skipped)) in all.iter().zip(&unmoved).zip(&skipped).enumerate() {
        assert_eq!(all.skipped.unmoved + all.skipped.rigid, 0);
        let same = all.points.iter().zip(&unmoved.points).all(|(a, b)| a == b);
        assert!(same && all.twists == unmoved.twists && all.outside == unmoved.outside, "{i}");
        let off = (0..count).map(|p| (all.world(p) - skipped.world(p)).length()).fold(0.0, f64::max);
        assert!(off < 2e-3 * fabric.model.pattern.radius, "{i}: {off}");
    }
    let of = |i: usize| (skipped[i].skipped.unmoved, skipped[i].skipped.rigid);
    assert_eq!((of(0), of(1)), ((0, 0), (count, 0)));
    assert!(of(2).0 > count * 3 / 4 && of(2).0 < count);
    assert!(of(3).1 == count, "{:?} of {count}", of(3));
    assert!(of(4).1 == count, "{:?} of {count}", of(4));
    assert!(of(5).0 + of(5).1 < count / 4);
}

/// A drift that each frame takes for nothing is seen when it has added up. Seen red with places not compared (taken for
/// unmoved), and with the bound a hundred times as large.
#[test]
fn slow_drift_is_seen() {
    let mesh = fabric::sheet([12, 10], DVec2::new(0.1, 0.085));
    let fabric = Arc::new(Fabric::new(&mesh, fabric::model(40, 5), Settings::default()).unwrap());
    let frames: Vec<Vec<DVec3>> = (0..400)
        .map(|i| {
            mesh.positions.iter().map(|p| DVec3::new(p.x * (1.0 + 5e-5 * f64::from(i)), p.y, p.z)).collect()
        })
        .collect();
    let skip = SkipYarn { tolerance: 1e-2, ..SkipYarn::default() };
    let skipped = run(&fabric, &frames, RunningYarn { skip, ..RunningYarn::default() });
    let all = run(&fabric, &frames, RunningYarn { skip: SkipYarn::NOTHING, ..RunningYarn::default() });
    assert!(skipped.iter().filter(|f| f.skipped.rigid == fabric.point_count()).count() > 20);
    for (a, b) in all.iter().zip(&skipped) {
        let off = (0..fabric.point_count()).map(|p| (a.world(p) - b.world(p)).length()).fold(0.0, f64::max);
        assert!(off < 1.1e-2 * fabric.model.pattern.radius, "{off}");
    }
}

/// Hidden faces keep their yarn where it was; shown again it is right in that frame. Seen red with
/// faces compared with what they were while hidden.
#[test]
fn hidden_faces() {
    let (fabric, frames) = made();
    let visible: Vec<bool> = (0..fabric.face_count()).map(|f| f % 3 != 0).collect();
    let expected = run(&fabric, &frames, RunningYarn { skip: SkipYarn::NOTHING, ..RunningYarn::default() });
    let mut cpu = Cpu::<f32>::new(fabric.clone(), RunningYarn::default()).unwrap();
    let mut frame = YarnFrame::default();
    let faces = fabric.point_faces();
    let mut before = Vec::new();
    for (i, positions) in frames.iter().enumerate() {
        let hides = i == 2 || i == 3;
        cpu.set_visible(hides.then_some(&visible[..])).unwrap();
        cpu.frame(positions, &mut frame).unwrap();
        let bound = 2e-3 * fabric.model.pattern.radius;
        for point in 0..fabric.point_count() {
            if hides && !visible[faces[point] as usize] {
                assert_eq!(frame.points[point], before[point], "{i}");
            } else {
                let off = (frame.world(point) - expected[i].world(point)).length();
                assert!(off < bound, "{i}: {off}");
            }
        }
        let hidden = faces.iter().filter(|f| hides && !visible[**f as usize]).count();
        assert_eq!(frame.skipped.hidden, hidden);
        before.clone_from(&frame.points);
    }
    assert!(cpu.set_visible(Some(&visible[1..])).is_err());
}

/// Another number of positions is an error, and an output of another backend is filled anew. Seen red with outputs taken for
/// their own by their length.
#[test]
fn outputs_of_others() {
    let (fabric, frames) = made();
    let mut cpu = Cpu::<f32>::new(fabric.clone(), RunningYarn::default()).unwrap();
    let mut frame = YarnFrame::default();
    cpu.frame(&frames[0], &mut frame).unwrap();
    assert!(cpu.frame(&frames[0][1..], &mut frame).is_err());
    let expected = frame.points.clone();
    let mut other = YarnFrame::default();
    Cpu::new(fabric, RunningYarn::default()).unwrap().frame(&frames[5], &mut other).unwrap();
    cpu.frame(&frames[0], &mut other).unwrap();
    assert!(other.points == expected && other.skipped.unmoved == 0);
}
