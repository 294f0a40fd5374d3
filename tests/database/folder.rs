//! A folder with a model and a cloth, and what comes of running `knotmesh` there.

use crate::common::{fabric, npy::npy};
use assert_cmd::Command;
use glam::{DVec2, DVec3};
use knotmesh::database::{Cpu, Fabric, RunningYarn, Settings, YarnFrame};
use knotmesh::io::{obj_mesh, sequence, yarn_model};
use knotmesh::math::V3;
use knotmesh::mesh::MaterialMesh;
use std::path::PathBuf;
use std::sync::Arc;

/// A folder with a model (`model`, `model.npz`), a cloth (`cloth.obj`, `cloth.bin`) and its frames (`frames.npy`).
pub struct Folder {
    pub folder: tempfile::TempDir,
    pub mesh: MaterialMesh,
    pub frames: Vec<Vec<DVec3>>,
}

pub fn single(p: DVec3) -> DVec3 {
    p.as_vec3().as_dvec3()
}

impl Folder {
    pub fn new() -> Self {
        let mut mesh = fabric::sheet([12, 10], DVec2::new(0.11, 0.09));
        mesh.uvs.iter_mut().for_each(|uv| *uv = uv.as_vec2().as_dvec2());
        let still = fabric::waved(&mesh, 0.4);
        // Once nothing moves, and once so little that a strain is taken for known.
        let mut frames = vec![still.clone(), still.clone(), still.iter().map(|p| *p * 1.000_01).collect()];
        frames.extend([1.0, 1.6].map(|time| fabric::waved(&mesh, time)));
        frames.iter_mut().flatten().for_each(|p| *p = single(*p));
        mesh.positions.clone_from(&frames[0]);
        let made = Self { folder: tempfile::tempdir().unwrap(), mesh, frames };
        yarn_model::write_dir(&made.at("model"), &fabric::model(20, 4)).unwrap();
        yarn_model::write_npz(&made.at("model.npz"), &fabric::model(20, 4)).unwrap();
        obj_mesh::write(&made.at("cloth.obj"), &made.mesh).unwrap();
        sequence::write(&made.at("cloth.bin"), &made.mesh, made.frames[1..].iter()).unwrap();
        made.write_frames("frames.npy", &made.frames);
        made
    }

    pub fn write_frames(&self, name: &str, frames: &[Vec<DVec3>]) {
        let bytes: Vec<u8> =
            frames.iter().flatten().flat_map(|p| p.to_array()).flat_map(f64::to_le_bytes).collect();
        let bytes = npy("<f8", false, &[frames.len(), frames[0].len(), 3], &bytes);
        std::fs::write(self.at(name), bytes).unwrap();
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.at(name)).unwrap_or_else(|e| panic!("{name}: {e}; {:?}", self.names()))
    }

    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Exit code and messages of a run in the folder; arguments stand in one line.
    pub fn knotmesh(&self, line: &str) -> (i32, String) {
        let output = Command::cargo_bin("knotmesh")
            .unwrap()
            .current_dir(self.folder.path())
            .args(line.split_whitespace())
            .output()
            .unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code().expect("not killed by a signal"), message)
    }

    /// A run that goes well and has nothing to say.
    pub fn relax(&self, line: &str) {
        let (code, message) = self.knotmesh(&format!("relax --backend database -q {line}"));
        assert_eq!((code, message.as_str()), (0, ""), "{line}");
    }

    /// What the library makes of the frames.
    pub fn expected(&self, settings: Settings, frames: &[Vec<DVec3>]) -> Expected {
        let fabric = Arc::new(Fabric::new(&self.mesh, fabric::model(20, 4), settings).unwrap());
        let mut cpu = Cpu::<f64>::new(fabric.clone(), RunningYarn::default()).unwrap();
        let mut expected = Expected { fabric, frames: Vec::new() };
        let mut frame = YarnFrame::default();
        for positions in frames {
            cpu.frame(positions, &mut frame).unwrap();
            let directors = cpu.directors(&frame).into_iter().map(V3::to_f64).collect();
            expected.frames.push((frame.clone(), directors));
        }
        expected
    }

    pub fn result(&self, name: &str) -> ResultFile {
        ResultFile(npyz::npz::NpzArchive::open(self.at(name)).unwrap())
    }
}

pub struct Expected {
    pub fabric: Arc<Fabric>,
    pub frames: Vec<(YarnFrame<f64>, Vec<DVec3>)>,
}

/// A result file as another reader sees it.
pub struct ResultFile(npyz::npz::NpzArchive<std::io::BufReader<std::fs::File>>);

impl ResultFile {
    pub fn array<T: npyz::Deserialize>(&mut self, name: &str) -> Vec<T> {
        self.0.by_name(name).unwrap().expect(name).into_vec().unwrap()
    }

    /// Floats, of either precision.
    pub fn floats(&mut self, name: &str) -> Vec<f64> {
        match self.0.by_name(name).unwrap().expect(name).into_vec::<f64>() {
            Ok(values) => values,
            Err(_) => self.array::<f32>(name).into_iter().map(f64::from).collect(),
        }
    }

    pub fn vectors(&mut self, name: &str) -> Vec<DVec3> {
        self.floats(name).chunks_exact(3).map(DVec3::from_slice).collect()
    }

    /// Name, shape and type of each array.
    pub fn shapes(&mut self) -> Vec<String> {
        let mut names: Vec<String> = self.0.array_names().map(str::to_string).collect();
        names.sort();
        let shape = |name: &String| {
            let array = self.0.by_name(name).unwrap().unwrap();
            format!("{name} {:?} {}", array.shape(), array.dtype().descr())
        };
        names.iter().map(shape).collect()
    }
}
