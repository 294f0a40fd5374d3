//! What each curve writer takes for seven million points: `cargo bench --bench curve_writers`.

use glam::DVec3;
use knotmesh::io::curves::{WriteOptions, write_curves};
use knotmesh::measure::machine::heading;
use knotmesh::yarn::CurveSource;

/// Points that exist only while they are visited.
struct Endless(usize);

impl CurveSource for Endless {
    fn yarn_count(&self) -> usize {
        1
    }
    fn yarn_closed(&self, _: usize) -> bool {
        false
    }
    fn yarn_len(&self, _: usize) -> usize {
        self.0
    }
    fn yarn_radius(&self, _: usize) -> Option<f64> {
        Some(0.1)
    }
    fn visit(
        &self,
        _: usize,
        sink: &mut dyn FnMut(&[DVec3]) -> knotmesh::Result<()>,
    ) -> knotmesh::Result<()> {
        // The same points over and over, so that only the writers take time.
        let chunk: [DVec3; 4096] =
            std::array::from_fn(|i| DVec3::new((i % 7) as f64 / 3.0, (i % 13) as f64 / 7.0, 1e-4 * i as f64));
        let mut left = self.0;
        while left > 0 {
            let n = left.min(chunk.len());
            sink(&chunk[..n])?;
            left -= n;
        }
        Ok(())
    }
}

fn main() {
    println!("{}", heading("curve_writers"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    for extension in ["yarns", "bcc", "obj", "npz", "usda", "txt", "pbrt"] {
        let path = folder.path().join(format!("a.{extension}"));
        let start = std::time::Instant::now();
        write_curves(&path, &Endless(7_000_000), &WriteOptions::default()).expect("written");
        let seconds = start.elapsed().as_secs_f64();
        let bytes = std::fs::metadata(&path).expect("is there").len();
        println!("{extension:6} {seconds:6.2} s {:8.1} MB", bytes as f64 / 1e6);
        std::fs::remove_file(&path).expect("removable");
    }
}
