//! Control points that stay on the device.

use super::gpu::adapter;
use super::scenes::sample;
use knotmesh::backend::gpu::{GpuBackend, GpuOptions};
use knotmesh::backend::{Backend, FrameOutput, Running, Wanted};
use knotmesh::knot::Settings;
use knotmesh::render::camera::Axes;
use knotmesh::render::{Camera, Look, Painter, Strands, View, Yarn};

/// Solved and drawn on one device without coming back: the same picture, to the byte, as of points that came back.
///
/// Seen red with the first frame's points, and with places in another unit.
#[test]
fn points_need_not_come_back() {
    let Some(adapter) = adapter() else { return };
    let (mesh, scene) = sample("rib.smobj");
    let (settings, running, options) = (Settings::default(), Running::default(), GpuOptions::default());
    let make = || GpuBackend::new(scene.clone(), &settings, &running, &options, &adapter, None).unwrap();
    let (mut stays, mut comes) = (make(), make());
    stays.set_wanted(Wanted { points: false, knots: false, curves: 0 }).unwrap();
    let (mut kept, mut back) = (FrameOutput::default(), FrameOutput::default());
    let mut positions = mesh.positions.clone();
    let mut painted: Option<(Painter, [Yarn; 2])> = None;
    for frame in 0..4 {
        match frame {
            0 => {}
            // Stretched, then turned and moved as a whole, then left alone.
            1 => positions.iter_mut().for_each(|p| p.x *= 1.2),
            2 => positions
                .iter_mut()
                .for_each(|p| *p = glam::DQuat::from_rotation_y(0.3) * *p + 3.0 * glam::DVec3::X),
            _ => {}
        }
        stays.frame(&positions, &mut kept).unwrap();
        comes.frame(&positions, &mut back).unwrap();
        assert!(kept.points.is_empty() && !back.points.is_empty());
        let strands = Strands::of_frame(&mesh, &scene, &back);
        let bounds = strands.bounds().unwrap();
        let camera = Camera::framing(bounds, &Axes::Y_UP, View::FRONT, 4.0 / 3.0, 1.0);
        let points = stays.device_points().unwrap();
        let (painter, yarns) = painted.get_or_insert_with(|| {
            let painter = Painter::beside(&points).unwrap();
            let yarns = [(); 2].map(|()| painter.yarn(&strands).unwrap());
            (painter, yarns)
        });
        let [direct, through] = yarns;
        painter.take(direct, &points, bounds).unwrap();
        painter.update(through, &strands).unwrap();
        let canvas = painter.canvas(320, 240).unwrap();
        let [direct, expected] = [direct, through].map(|yarn| {
            painter.paint(&canvas, yarn, &camera, &Look::default()).unwrap();
            painter.picture(&canvas).unwrap()
        });
        assert!(direct == expected, "frame {frame}: {}", super::scenes::apart(&direct, &expected));
    }
    // Asked for after all, they come, though nothing is solved again.
    stays.set_wanted(Wanted { points: true, knots: false, curves: 0 }).unwrap();
    stays.frame(&positions, &mut kept).unwrap();
    assert!(kept.points == back.points);
}

/// Seen red without the check of devices.
#[test]
fn points_of_another_device_are_refused() {
    let Some(adapter) = adapter() else { return };
    let (mesh, scene) = sample("rib.smobj");
    let (settings, running, options) = (Settings::default(), Running::default(), GpuOptions::default());
    let mut backend = GpuBackend::new(scene.clone(), &settings, &running, &options, &adapter, None).unwrap();
    assert!(backend.device_points().is_none(), "there was no frame yet");
    let mut output = FrameOutput::default();
    backend.frame(&mesh.positions, &mut output).unwrap();
    let strands = Strands::of_frame(&mesh, &scene, &output);
    let painter = Painter::open(&adapter).unwrap();
    let mut yarn = painter.yarn(&strands).unwrap();
    let bounds = yarn.bounds();
    let error = painter.take(&mut yarn, &backend.device_points().unwrap(), bounds).unwrap_err();
    assert!(error.to_string().contains("another device"), "{error}");
}
