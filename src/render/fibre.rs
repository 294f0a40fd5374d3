//! The look of plied yarn, once around and once along a turn of the twist: a periodic map of normals, cavities and fibres.
//!
//! What it holds is what Huang et al. 2025 (section 4.1) keep of a yarn's fibres in textures along the arc length; here it is made by
//! rule: plies as twisted cylinders, fibres as ridges along them.

/// Texels along a turn of the twist, and around.
pub const SIZE: [u32; 2] = [1024, 512];
/// Plies of a yarn.
pub const PLIES: f32 = 3.0;
/// Length of a turn of the twist, in yarn radii: the plies lie at 28 degrees.
pub const TURN: f32 = 12.0;

/// A texel: slopes along and around (as parts of a unit normal, -1 to 1), how open the place is and how light the fibre, 0 to 1.
type Texel = [f32; 4];

/// `[level][row * width + column]` the map and its halvings down to a texel, as RGBA bytes; columns run along, rows around.
pub fn levels() -> Vec<Vec<[u8; 4]>> {
    let mut level = whole();
    let (mut width, mut height) = (SIZE[0] as usize, SIZE[1] as usize);
    let mut levels = Vec::new();
    loop {
        levels.push(level.iter().map(|t| bytes(*t)).collect());
        if width == 1 && height == 1 {
            return levels;
        }
        let (w, h) = ((width / 2).max(1), (height / 2).max(1));
        let texel = |x: usize, y: usize| level[y.min(height - 1) * width + x.min(width - 1)];
        let halved = |i: usize| {
            let (x, y) = (2 * (i % w), 2 * (i / w));
            let four = [texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1)];
            std::array::from_fn(|c| four.iter().map(|t| t[c]).sum::<f32>() / 4.0)
        };
        level = (0..w * h).map(halved).collect();
        (width, height) = (w, h);
    }
}

fn bytes(texel: Texel) -> [u8; 4] {
    let byte = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
    [byte(texel[0] * 0.5 + 0.5), byte(texel[1] * 0.5 + 0.5), byte(texel[2]), byte(texel[3])]
}

/// The map at full size.
fn whole() -> Vec<Texel> {
    let [width, height] = SIZE.map(|n| n as usize);
    let heights: Vec<[f32; 2]> = (0..width * height)
        .map(|i| surface((i % width) as f32 / width as f32, (i / width) as f32 / height as f32))
        .collect();
    let at = |x: usize, y: usize| heights[y % height * width + x % width][0];
    // Texel sizes in yarn radii.
    let along = TURN / width as f32;
    let around = std::f32::consts::TAU / height as f32;
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let du = (at(x + 1, y) - at(x + width - 1, y)) / (2.0 * along);
        let dv = (at(x, y + 1) - at(x, y + height - 1)) / (2.0 * around);
        let length = (1.0 + du * du + dv * dv).sqrt();
        let open = ((at(x, y) - 0.64) / 0.3).clamp(0.0, 1.0);
        [-du / length, -dv / length, 0.35 + 0.65 * open, heights[i][1]]
    };
    (0..width * height).map(texel).collect()
}

/// Distance from the axis in yarn radii, and how light the fibre is, at a place along and around, both 0 to 1.
fn surface(u: f32, v: f32) -> [f32; 2] {
    use std::f32::consts::{PI, TAU};
    // Plies are cylinders that touch each other and the yarn's outside.
    let ply = (PI / PLIES).sin() / (1.0 + (PI / PLIES).sin());
    let centre = 1.0 - ply;
    let turned = (v - u).rem_euclid(1.0) * PLIES;
    let angle = (turned - turned.floor() - 0.5) * TAU / PLIES;
    let root = (ply * ply - (centre * angle.sin()).powi(2)).max(0.0).sqrt();
    let outside = centre * angle.cos() + root;
    // Fibres fill the grooves between them.
    let filled = smooth_max(outside, 0.64, 0.12);
    // Fibres of a balanced yarn run along it; ridges of three widths, each a noise that is long along and narrow around.
    let ridges = 0.5 * noise(u, v, 5, 72, 1)
        + 0.3 * noise(u, v, 9, 150, 2)
        + 0.2 * noise(u, (v + u).fract(), 7, 110, 3);
    [filled + 0.035 * (ridges - 0.5), 0.55 + 0.9 * (ridges - 0.5)]
}

fn smooth_max(a: f32, b: f32, width: f32) -> f32 {
    let h = ((a - b) / width).clamp(-1.0, 1.0);
    if h.abs() < 1.0 { (a + b) / 2.0 + width * (h * h + 1.0) / 4.0 } else { a.max(b) }
}

/// Smooth noise from 0 to 1 that repeats after 1 both ways, with so many cells along and around.
fn noise(u: f32, v: f32, along: u32, around: u32, seed: u32) -> f32 {
    let (x, y) = (u * along as f32, v * around as f32);
    let (i, j) = (x.floor(), y.floor());
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (s, t) = (ease(x - i), ease(y - j));
    let corner = |di: u32, dj: u32| hash((i as u32 + di) % along, (j as u32 + dj) % around, seed);
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    mix(mix(corner(0, 0), corner(1, 0), s), mix(corner(0, 1), corner(1, 1), s), t)
}

/// A number from 0 to 1 for a cell, the same everywhere.
fn hash(i: u32, j: u32, seed: u32) -> f32 {
    let mut h = i.wrapping_mul(0x9e37_79b1) ^ j.wrapping_mul(0x85eb_ca77) ^ seed.wrapping_mul(0xc2b2_ae3d);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    ((h ^ (h >> 15)) >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seen red with another number of turns (`v - 1.5 * u`).
    #[test]
    fn the_map_repeats() {
        for i in 0..64 {
            let t = i as f32 / 64.0;
            let near = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3;
            assert!(near(surface(0.0, t), surface(1.0 - 1e-6, t)), "along, at {t}");
            assert!(near(surface(t, 0.0), surface(t, 1.0 - 1e-6)), "around, at {t}");
        }
    }

    #[test]
    fn levels_halve_down_to_one() {
        let levels = levels();
        assert_eq!(levels.len(), 11);
        assert_eq!(levels[0].len(), (SIZE[0] * SIZE[1]) as usize);
        // The mean normal is straight up: slopes of a periodic map cancel. Seen red with one-sided differences of |slope|.
        let last = levels[10][0];
        assert!((126..=129).contains(&last[0]) && (126..=129).contains(&last[1]), "{last:?}");
    }
}
