//! A tube and ways in which it moves, for measuring: `cargo run --release --example move_tube -- FOLDER
//! [STITCHES [FRAMES]]` writes `tube.smobj` (22,800 stitches, as many as a pullover has, unless given) and the
//! motions as `.npy`, 20 frames each unless given:
//!
//! - `still.npy`: nothing moves;
//! - `rigid.npy`: the whole turns and travels;
//! - `sleeve.npy`: the upper 40 % bend by a quarter turn, the rest stands;
//! - `stretch.npy`: everything grows longer, to 1.3, and narrower, to 0.9;
//! - `noise.npy`: every corner trembles on its own, up to 0.05 course spacings each way.
//!
//! Then for instance `knotmesh measure FOLDER/tube.smobj --frames FOLDER/sleeve.npy`.

mod tube;

use glam::{DMat3, DVec3};
use knotmesh::io::npy::header_bytes;
use std::io::{BufWriter, Write};
use std::path::Path;

fn main() -> std::io::Result<()> {
    let usage = || std::io::Error::other("usage: move_tube FOLDER [STITCHES [FRAMES]]");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: usize| match arguments.get(i).map(|a| a.parse()) {
        None => Ok(default),
        Some(Ok(n)) if n > 0 => Ok(n),
        Some(_) => Err(usage()),
    };
    let folder = Path::new(arguments.first().ok_or_else(usage)?);
    let (stitches, frames) = (number(1, 22_800)?, number(2, 20)?);
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("tube.smobj"), tube::smobj(stitches))?;

    let rest = tube::positions(stitches);
    let height = rest.iter().map(|p| p.z).fold(0.0, f64::max);
    let stretch = |p: DVec3, t: f64| p * DVec3::new(1.0 - 0.1 * t, 1.0 - 0.1 * t, 1.0 + 0.3 * t);
    let path = |name: &str| folder.join(name).with_extension("npy");
    write(&path("still"), &rest, frames, |p, _, _| p)?;
    write(&path("rigid"), &rest, frames, |p, t, _| {
        DMat3::from_rotation_y(1.5 * t) * DMat3::from_rotation_z(2.0 * t) * p
            + DVec3::new(40.0, 5.0, 10.0) * t
    })?;
    write(&path("sleeve"), &rest, frames, |p, t, _| bent(p, t, height))?;
    write(&path("stretch"), &rest, frames, |p, t, _| stretch(p, t))?;
    write(&path("noise"), &rest, frames, |p, _, frame| p + tremble(p, frame))
}

/// Frames 0 to `frames` - 1 at times 0 to 1.
fn write(
    path: &Path,
    rest: &[DVec3],
    frames: usize,
    place: impl Fn(DVec3, f64, usize) -> DVec3,
) -> std::io::Result<()> {
    let mut out = BufWriter::new(std::fs::File::create(path)?);
    out.write_all(&header_bytes("<f8", &[frames as u64, rest.len() as u64, 3]))?;
    for frame in 0..frames {
        let t = frame as f64 / (frames - 1).max(1) as f64;
        for p in rest {
            for x in place(*p, t, frame).to_array() {
                out.write_all(&x.to_le_bytes())?;
            }
        }
    }
    out.flush()
}

/// The upper 40 % of the tube bent towards x: an arc over half of that, straight beyond.
fn bent(p: DVec3, t: f64, height: f64) -> DVec3 {
    let (begin, arc) = (0.6 * height, 0.2 * height);
    let whole = t * std::f64::consts::FRAC_PI_2;
    let up = p.z - begin;
    if up <= 0.0 || whole == 0.0 {
        return p;
    }
    let radius = arc / whole;
    let (sin, cos) = (whole * (up / arc).min(1.0)).sin_cos();
    let beyond = (up - arc).max(0.0);
    // Around the centre of the arc, at x = radius.
    let arm = radius - p.x;
    DVec3::new(radius - arm * cos + beyond * sin, p.y, begin + arm * sin + beyond * cos)
}

/// A random offset, the same for corners at the same place.
fn tremble(p: DVec3, frame: usize) -> DVec3 {
    let cell = (p * 1e4).round();
    let mut bits = 0x9e37_79b9_7f4a_7c15u64.wrapping_mul(frame as u64 + 1);
    for x in cell.to_array() {
        bits = (bits ^ (x as i64 as u64)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        bits ^= bits >> 32;
    }
    let mut next = || {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (bits >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    DVec3::new(next(), next(), next()) * 0.05
}
