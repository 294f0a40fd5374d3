//! A tube and ways in which it moves, for measuring: `cargo run --release --example move_tube -- FOLDER
//! [STITCHES [FRAMES [own]]]` writes `tube.smobj` (22,800 stitches, as many as a pullover has, unless given) and the
//! motions as `.npy`, 20 frames each unless given. Faces share their vertices; with `own` each has four of its own, as
//! the field's tools write them.
//!
//! - `still.npy`: nothing moves;
//! - `rigid.npy`: the whole turns and travels;
//! - `sleeve.npy`: the upper 40 % bend by a quarter turn, the rest stands;
//! - `stretch.npy`: everything grows longer, to 1.3, and narrower, to 0.9;
//! - `noise.npy`: every corner trembles on its own, up to 0.05 course spacings each way.
//!
//! Then for instance `knotmesh measure FOLDER/tube.smobj --frames FOLDER/sleeve.npy`.

mod tube;

use glam::DVec3;
use knotmesh::io::npy::header_bytes;
use std::io::{BufWriter, Write};
use std::path::Path;
use tube::Vertices;
use tube::moves::Motion;

fn main() -> std::io::Result<()> {
    let usage = || std::io::Error::other("usage: move_tube FOLDER [STITCHES [FRAMES [own]]]");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: usize| match arguments.get(i).map(|a| a.parse()) {
        None => Ok(default),
        Some(Ok(n)) if n > 0 => Ok(n),
        Some(_) => Err(usage()),
    };
    let folder = Path::new(arguments.first().ok_or_else(usage)?);
    let (stitches, frames) = (number(1, 22_800)?, number(2, 20)?);
    let vertices = match arguments.get(3).map(String::as_str) {
        None => Vertices::Shared,
        Some("own") => Vertices::Own,
        Some(_) => return Err(usage()),
    };
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("tube.smobj"), tube::smobj(stitches, vertices))?;

    let rest = tube::positions(stitches, vertices);
    let height = rest.iter().map(|p| p.z).fold(0.0, f64::max);
    for motion in Motion::ALL {
        let path = folder.join(motion.name()).with_extension("npy");
        write(&path, &rest, frames, |p, frame| motion.place(p, height, frame, frames))?;
    }
    Ok(())
}

/// Frames 0 to `frames` - 1.
fn write(
    path: &Path,
    rest: &[DVec3],
    frames: usize,
    place: impl Fn(DVec3, usize) -> DVec3,
) -> std::io::Result<()> {
    let mut out = BufWriter::new(std::fs::File::create(path)?);
    out.write_all(&header_bytes("<f8", &[frames as u64, rest.len() as u64, 3]))?;
    for frame in 0..frames {
        for p in rest {
            for x in place(*p, frame).to_array() {
                out.write_all(&x.to_le_bytes())?;
            }
        }
    }
    out.flush()
}
