//! `--compat madypg` against what the authors' program computed on its own data, stage by stage. Needs `KNOTMESH_DATA`;
//! `tests/database.rs` covers the method without.

mod common;

use common::data;
use glam::DVec3;
use knotmesh::database::{
    Bending, Compat, Cpu, Fabric, FaceWeights, RunningYarn, Settings, Trace, YarnFrame,
};
use knotmesh::io::{obj_mesh, sequence::Sequence, yarn_model};
use knotmesh::mesh::MaterialMesh;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Arrays of a reference file, as f64.
struct Reference(HashMap<String, Vec<f64>>);

impl Reference {
    fn open(path: &Path) -> Self {
        let mut npz = npyz::npz::NpzArchive::open(path).unwrap();
        let names: Vec<String> = npz.array_names().map(str::to_string).collect();
        let mut arrays = HashMap::new();
        for name in names {
            macro_rules! read {
                ($t:ty) => {
                    npz.by_name(&name).unwrap().unwrap().into_vec::<$t>().ok()
                };
            }
            let floats = read!(f32).map(|v| v.into_iter().map(f64::from).collect());
            let signed = || read!(i32).map(|v| v.into_iter().map(f64::from).collect());
            let values: Vec<f64> = floats.or_else(signed).unwrap_or_else(|| match read!(u32) {
                Some(v) => v.into_iter().map(f64::from).collect(),
                None => read!(i64).unwrap().into_iter().map(|x| x as f64).collect(),
            });
            arrays.insert(name, values);
        }
        Self(arrays)
    }

    fn rows<const N: usize>(&self, name: &str) -> Vec<[f64; N]> {
        self.0[name].chunks_exact(N).map(|r| r.try_into().unwrap()).collect()
    }

    fn number(&self, name: &str) -> f64 {
        self.0[name][0]
    }
}

/// The mesh of a case and the positions of its frame.
fn source(data: &Path, name: &str, frame: usize) -> (MaterialMesh, Vec<DVec3>) {
    let path = data.join("madypg").join(name);
    if name.ends_with(".obj") {
        let mesh = obj_mesh::read_file(&path).unwrap().into_material_mesh().unwrap();
        let positions = mesh.positions.clone();
        return (mesh, positions);
    }
    let mut sequence = Sequence::open(&path).unwrap();
    let mut positions = Vec::new();
    sequence.read(frame, &mut positions).unwrap();
    (sequence.mesh().clone(), positions)
}

/// Reference, model, mesh, frame, what is switched off.
type Case = (&'static str, &'static str, &'static str, usize, fn(&mut Settings));

const CASES: [Case; 9] = [
    ("sxsyconst_stock-040", "stock", "sequences/sxsy_const.bin", 40, |_| ()),
    ("stock_stretchX-059", "stock", "sequences/stock_stretchX.bin", 59, |_| ()),
    ("rib_stretchX-030", "rib", "sequences/rib_stretchX.bin", 30, |_| ()),
    ("sock_rib-000", "rib", "objstatic/sock/cloth.obj", 0, |_| ()),
    ("twist_stock-040", "stock", "sequences/synth_twist.bin", 40, |_| ()),
    ("twist_phong0-040", "stock", "sequences/synth_twist.bin", 40, |s| s.phong = 0.0),
    ("twist_linbend0-040", "stock", "sequences/synth_twist.bin", 40, |s| s.bending = Bending::None),
    ("twist_deform0-040", "stock", "sequences/synth_twist.bin", 40, |s| s.displacement = 0.0),
    ("twist_shepard0-040", "stock", "sequences/synth_twist.bin", 40, |s| s.weights = FaceWeights::Equal),
];

fn compare(data: &Path, case: &Case) {
    let (name, model, mesh, frame, switch) = case;
    let reference = Reference::open(&data.join(format!("madypg/reference/{name}.npz")));
    let model = yarn_model::read(&data.join(format!("madypg/models/model_{model}_9"))).unwrap();
    let (mesh, positions) = source(data, mesh, *frame);
    let mut settings = Settings { compat: Compat::Madypg, ..Settings::default() };
    switch(&mut settings);
    let fabric = Arc::new(Fabric::new(&mesh, model, settings).unwrap());
    assert_eq!(fabric.point_count(), reference.number("used_count") as usize, "{name}: used vertices");
    assert_eq!(fabric.yarn_count(), reference.number("yarn_count") as usize, "{name}: yarns");
    let mut cpu = Cpu::<f64>::new(fabric.clone(), RunningYarn::default()).unwrap();
    let mut output = YarnFrame::default();
    cpu.frame(&positions, &mut output).unwrap();
    let traces: HashMap<u32, Trace<f64>> = cpu.trace().into_iter().collect();
    let vertices = fabric.point_vertices();
    let points: HashMap<(i32, i32, u32), u32> = (0..fabric.point_count())
        .map(|p| {
            let tile = fabric.tiles[fabric.point_tiles[p] as usize];
            ((tile.y, tile.x, vertices[p]), p as u32)
        })
        .collect();
    let samples: Vec<u32> = reference
        .rows::<2>("tile")
        .iter()
        .zip(&reference.0["pattern_vertex"])
        .map(|(tile, vertex)| points[&(tile[0] as i32, tile[1] as i32, *vertex as u32)])
        .collect();
    let trace = |f: &dyn Fn(&Trace<f64>) -> Vec<f64>| -> Vec<Vec<f64>> {
        samples.iter().map(|p| f(&traces[p])).collect()
    };
    let check = |stage: &str, found: Vec<Vec<f64>>, bound: f64| {
        let expected = &reference.0[stage];
        let n = expected.len() / found.len();
        let mut worst = (0.0, 0);
        for (row, (found, expected)) in found.iter().zip(expected.chunks(n)).enumerate() {
            assert_eq!(found.len(), n);
            for (a, b) in found.iter().zip(expected) {
                let off = (a - b).abs() / (1.0 + b.abs());
                if off > worst.0 || off.is_nan() {
                    worst = (off, row);
                }
            }
        }
        println!("{name} {stage}: {:.2e} at {} (bound {bound:.0e})", worst.0, worst.1);
    };
    check("triangle", trace(&|t| vec![t.face.into()]), 0.0);
    check(
        "barycentric",
        trace(&|t| {
            let [b, c] = t.home.0.map(f64::from);
            vec![1.0 - b - c, b, c]
        }),
        1e-6,
    );
    check(
        "barycentric",
        trace(&|t| {
            let [b, c] = t.place.barycentric;
            vec![1.0 - b - c, b, c]
        }),
        1e-6,
    );
    check("strain_raw", trace(&|t| t.strain.to_vec()), 1e-5);
    check("strain_clamped", trace(&|t| t.clamped.to_vec()), 1e-5);
    check("sx_sa_sy", trace(&|t| t.strains.to_vec()), 1e-5);
    check("displacement", trace(&|t| t.displacement.to_vec()), 1e-7);
    check("position", samples.iter().map(|p| output.world(*p as usize).to_array().to_vec()).collect(), 2e-7);
    check("twist", samples.iter().map(|p| vec![output.twists[*p as usize]]).collect(), 5e-6);
}

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn every_reference() {
    let Some(data) = data() else { return };
    for case in &CASES {
        compare(&data, case);
    }
}
