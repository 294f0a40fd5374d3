//! A fabric, what becomes of its mesh, and what both backends make of it.

use crate::common::fabric::{model, sheet};
use glam::{DVec2, DVec3};
use knotmesh::backend::gpu::Adapter;
use knotmesh::database::gpu::{Gpu, GpuYarn};
use knotmesh::database::{Cpu, Fabric, RunningYarn, Settings, SkipYarn, SkippedYarn, YarnFrame};
use knotmesh::mesh::MaterialMesh;
use knotmesh::pattern::{StrainTable, YarnModel};
use std::f64::consts::TAU;
use std::sync::Arc;

/// A frame of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    pub positions: Vec<DVec3>,
    /// Which faces are seen from here on; `None` leaves that as it was.
    pub visible: Option<Option<Vec<bool>>>,
    /// Whether the output is a new one.
    pub anew: bool,
}

impl From<Vec<DVec3>> for Motion {
    fn from(positions: Vec<DVec3>) -> Self {
        Self { positions, ..Self::default() }
    }
}

/// What came of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    pub points: Vec<[f32; 3]>,
    pub twists: Vec<f32>,
    pub outside: usize,
    pub skipped: SkippedYarn,
    pub origin: DVec3,
}

impl Found {
    fn new(frame: &YarnFrame<f32>) -> Self {
        Self {
            points: frame.points.iter().map(|p| [p.x, p.y, p.z]).collect(),
            twists: frame.twists.clone(),
            outside: frame.outside,
            skipped: frame.skipped,
            origin: frame.origin,
        }
    }

    pub fn finite(&self) -> bool {
        self.points.iter().flatten().chain(&self.twists).all(|x| x.is_finite())
    }

    /// Floats whose bits differ.
    pub fn differing(&self, other: &Self) -> usize {
        let all = |found: &Self| -> Vec<u32> {
            found.points.iter().flatten().chain(&found.twists).map(|x| x.to_bits()).collect()
        };
        let (mine, theirs) = (all(self), all(other));
        assert_eq!(mine.len(), theirs.len());
        mine.iter().zip(&theirs).filter(|(a, b)| a != b).count()
    }
}

pub struct Case {
    pub fabric: Arc<Fabric>,
    pub skip: SkipYarn,
    pub motions: Vec<Motion>,
}

impl Case {
    pub fn new<M: Into<Motion>>(
        mesh: &MaterialMesh,
        model: YarnModel,
        settings: Settings,
        motions: impl IntoIterator<Item = M>,
    ) -> Self {
        Self {
            fabric: Arc::new(Fabric::new(mesh, model, settings).expect("a fabric")),
            skip: SkipYarn::NOTHING,
            motions: motions.into_iter().map(Into::into).collect(),
        }
    }

    pub fn by_cpu(&self) -> Vec<Found> {
        let running = RunningYarn { threads: 2, skip: self.skip, ..RunningYarn::default() };
        let mut cpu = Cpu::<f32>::new(self.fabric.clone(), running).expect("threads");
        let mut output = YarnFrame::default();
        let frame = |motion: &Motion| {
            if let Some(visible) = &motion.visible {
                cpu.set_visible(visible.as_deref()).expect("as many as faces");
            }
            if motion.anew {
                output = YarnFrame::default();
            }
            cpu.frame(&motion.positions, &mut output).expect("as many as vertices");
            Found::new(&output)
        };
        self.motions.iter().map(frame).collect()
    }

    pub fn by_gpu(&self, adapter: &Adapter, options: GpuYarn) -> Vec<Found> {
        let options = GpuYarn { skip: self.skip, ..options };
        let mut gpu = Gpu::new(self.fabric.clone(), &options, adapter).expect("a device");
        let mut output = YarnFrame::default();
        let frame = |motion: &Motion| {
            if let Some(visible) = &motion.visible {
                gpu.set_visible(visible.as_deref()).expect("as many as faces");
            }
            if motion.anew {
                output = YarnFrame::default();
            }
            gpu.frame(&motion.positions, &mut output).expect("as many as vertices");
            Found::new(&output)
        };
        self.motions.iter().map(frame).collect()
    }

    /// Holds both against each other.
    pub fn agrees(&self, adapter: &Adapter, what: &str) {
        self.agrees_with(adapter, GpuYarn::default(), what);
    }

    pub fn agrees_with(&self, adapter: &Adapter, options: GpuYarn, what: &str) {
        let (twin, device) = (self.by_cpu(), self.by_gpu(adapter, options));
        let report = adapter.report();
        let exact = report.exact && report.is_software() && options.device.exact;
        for (i, (a, b)) in twin.iter().zip(&device).enumerate() {
            let differing = a.differing(b);
            if exact {
                assert_eq!(differing, 0, "{what}, frame {i}: of {} points", a.points.len());
                assert_eq!(a, b, "{what}, frame {i}");
            } else if differing > 0 {
                self.bounded(a, b, &format!("{what}, frame {i}"));
            }
        }
    }

    fn bounded(&self, twin: &Found, device: &Found, what: &str) {
        let radius = self.fabric.model.pattern.radius;
        let far = |(a, b): (&[f32; 3], &[f32; 3])| {
            (0..3).map(|i| (f64::from(a[i]) - f64::from(b[i])).powi(2)).sum::<f64>().sqrt() / radius
        };
        let far: Vec<f64> = twin.points.iter().zip(&device.points).map(far).collect();
        let beyond = far.iter().filter(|x| x.is_nan() || **x > 1e-4).count();
        let worst = far.iter().copied().fold(0.0, f64::max);
        println!("{what}: {beyond} of {} points further than 1e-4 r, up to {worst:.1e} r", far.len());
        assert!(1000 * beyond <= far.len() && worst < 1e-2, "{what}: {beyond} points, up to {worst} r");
    }
}

/// A sheet that meets itself along u, a whole number of periods around: one seam that only shifts material coordinates.
pub fn tube(squares: [usize; 2], size: DVec2) -> MaterialMesh {
    let mut mesh = sheet(squares, size);
    for corner in mesh.faces.iter_mut().flatten() {
        let (column, row) = (*corner as usize % (squares[0] + 1), *corner as usize / (squares[0] + 1));
        *corner = (row * (squares[0] + 1) + column % squares[0]) as u32;
    }
    mesh.positions = rolled(&mesh, size, 0.0);
    mesh
}

/// Positions of a tube at a time.
pub fn rolled(mesh: &MaterialMesh, size: DVec2, time: f64) -> Vec<DVec3> {
    let place = |uv: &DVec2| {
        let (angle, radius) = (TAU * uv.x / size.x, size.x / TAU * (1.1 + 0.2 * (30.0 * uv.y + time).sin()));
        DVec3::new(radius * angle.cos(), 1.1 * uv.y + 0.02 * time * angle.sin(), radius * angle.sin())
    };
    mesh.uvs.iter().map(place).collect()
}

/// The made-up model with another table: so many nodes along sx, sa and sy, displacements up to so many metres.
pub fn uneven(points: usize, nodes: [usize; 3], most: f64) -> YarnModel {
    let mut model = model(points, 1);
    let axis = |n: usize, low: f64, high: f64| -> Vec<f32> {
        (0..n).map(|i| (low + (high - low) * (i as f64 / n as f64).powf(1.3)) as f32).collect()
    };
    let axes = [axis(nodes[0], -0.2, 0.8), axis(nodes[1], -0.5, 0.6), axis(nodes[2], -0.15, 0.9)];
    let mut random = crate::common::Random::new(7);
    let mut next = || (most * random.between(-1.0, 1.0)) as f32;
    let count = model.pattern.vertex_count() * nodes.iter().product::<usize>();
    let values = (0..count).map(|_| [next(), next(), next(), next()]).collect();
    model.table = StrainTable::new(axes, values).expect("axes rise");
    YarnModel::new(model.pattern, model.table).expect("they fit")
}
