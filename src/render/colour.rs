//! Colours: of yarns, of stitch types, of numbers.

/// Colours for yarns, dyed wool: one after the other.
pub const YARNS: [[u8; 3]; 8] = [
    [196, 84, 76],
    [72, 122, 168],
    [222, 168, 74],
    [106, 152, 96],
    [146, 104, 158],
    [226, 214, 196],
    [86, 90, 100],
    [206, 130, 138],
];

/// Colours for kinds of things, well apart from each other: after Okabe and Ito, made for colour-blind eyes too, then lighter and
/// darker ones.
pub const KINDS: [[u8; 3]; 14] = [
    [0, 114, 178],
    [230, 159, 0],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [213, 94, 0],
    [240, 228, 66],
    [110, 110, 110],
    [140, 190, 220],
    [250, 205, 130],
    [130, 205, 180],
    [120, 60, 100],
    [20, 60, 110],
    [140, 70, 20],
];

/// Places between which a map of numbers to colours goes in straight lines.
type Stops = &'static [[u8; 3]];

/// From low to high: dark blue over green to yellow, after viridis; even steps look even, in grey too.
pub const SEQUENTIAL: Stops = &[
    [68, 1, 84],
    [72, 36, 117],
    [65, 68, 135],
    [53, 95, 141],
    [42, 120, 142],
    [33, 145, 140],
    [34, 168, 132],
    [68, 191, 112],
    [122, 209, 81],
    [189, 223, 38],
    [253, 231, 37],
];

/// From less over just right (the middle) to more: blue, off-white, red.
pub const DIVERGING: Stops = &[
    [33, 72, 150],
    [68, 117, 188],
    [123, 166, 212],
    [182, 207, 230],
    [238, 236, 232],
    [246, 200, 172],
    [232, 142, 112],
    [206, 82, 70],
    [150, 26, 44],
];

/// A map's colour at `t` from 0 to 1; what lies beyond takes the ends', what is not a number a grey.
pub fn ramp(stops: &[[u8; 3]], t: f64) -> [u8; 3] {
    if t.is_nan() {
        return [128; 3];
    }
    let at = t.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let i = (at as usize).min(stops.len() - 2);
    let f = at - i as f64;
    std::array::from_fn(|c| {
        (f64::from(stops[i][c]) * (1.0 - f) + f64::from(stops[i + 1][c]) * f).round() as u8
    })
}

/// An sRGB channel as light, 0 to 1.
pub fn linear(channel: u8) -> f32 {
    let c = f32::from(channel) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}
