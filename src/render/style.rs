//! What colours of yarn say: numbers along it, or which stitch it belongs to.

use super::colour::{DIVERGING, KINDS, SEQUENTIAL, ramp};
use super::legend::{Legend, Scale};
use super::strands::Strands;
use crate::backend::FrameOutput;
use crate::math::Scalar;
use crate::measure::quantile;
use crate::mesh::StitchMesh;
use crate::scene::{NO_SECOND_SLOT, Scene};
use glam::{DVec3, Vec3};

/// What colours say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Style {
    /// The yarn's own colours.
    #[default]
    Yarn,
    /// Length of each segment over its length at rest.
    Tension,
    /// How far that is from 1.
    Error,
    /// What is left of each stitch's energy.
    Energy,
    /// Kinds of stitches.
    Type,
    /// How much of its face a stitch's yarn covers.
    Tightness,
}

/// Energies below this are shown as this.
pub const LEAST_ENERGY: f32 = 1e-9;
/// What is not a number is drawn in this colour.
const UNKNOWN: [u8; 3] = [128; 3];
/// Numbers beyond this share of them at either end take the ends' colours.
const TAIL: f64 = 0.05;

impl Style {
    /// Whether colours stand for numbers on a scale.
    pub fn is_number(self) -> bool {
        !matches!(self, Self::Yarn | Self::Type)
    }

    /// `[point]` its number: `Tension` and `Error` of any strands whose lengths at rest are known; NaN where there is none.
    pub fn of_strands(self, strands: &Strands) -> Vec<f32> {
        let tension = tension(strands);
        match self {
            Self::Tension => at_points(strands, &tension),
            Self::Error => {
                let errors: Vec<f32> = tension.iter().map(|t| (t - 1.0).abs()).collect();
                at_points(strands, &errors)
            }
            _ => vec![f32::NAN; strands.points.len()],
        }
    }

    /// `[point]` its number in a solved frame; `strands` are that frame's, `positions` those of the mesh's vertices (world units).
    pub fn of_frame<T: Scalar>(
        self,
        strands: &Strands,
        scene: &Scene,
        output: &FrameOutput<T>,
        positions: &[DVec3],
    ) -> Vec<f32> {
        match self {
            Self::Energy => {
                let energy = |face: usize| output.faces.get(face).map_or(f64::NAN, |f| f.energy.to_f64());
                by_face(scene, |face| (energy(face) as f32).clamp(LEAST_ENERGY, f32::MAX))
            }
            Self::Tightness => {
                let cover = cover(strands, scene, positions);
                by_face(scene, |face| cover[face])
            }
            _ => self.of_strands(strands),
        }
    }

    /// Between which numbers colours change, so that a few outliers do not decide: round numbers around all but 5 % of `numbers` at
    /// either end, for tension as far below 1 as above. `None` where there are no numbers.
    pub fn range(self, numbers: &[f32]) -> Option<[f64; 2]> {
        let mut finite: Vec<f64> = numbers.iter().copied().filter(|x| x.is_finite()).map(f64::from).collect();
        if finite.is_empty() {
            return None;
        }
        let low = quantile(&mut finite, TAIL);
        let high = quantile(&mut finite, 1.0 - TAIL);
        Some(match self {
            Self::Tension => {
                let spread = round_up((high - 1.0).abs().max((1.0 - low).abs()).max(0.005));
                [1.0 - spread, 1.0 + spread]
            }
            Self::Error => [0.0, round_up(high.max(0.001))],
            Self::Energy => {
                let least = f64::from(LEAST_ENERGY).log10().round();
                let high = high.log10().ceil().max(least + 1.0);
                [10f64.powf(low.log10().floor().clamp(least, high - 1.0)), 10f64.powf(high)]
            }
            _ => {
                let step = round_up((high - low).max(0.01 * high.abs()).max(1e-6) / 4.0);
                let low = (low / step).floor() * step;
                [low, ((high / step).ceil() * step).max(low + step)]
            }
        })
    }

    /// Where a number lies between the ends of a range, 0 to 1.
    fn part(self, [low, high]: [f64; 2], number: f64) -> f64 {
        if self == Self::Energy {
            (number / low).ln() / (high / low).ln()
        } else {
            (number - low) / (high - low)
        }
    }

    /// The colour of a number.
    pub fn colour(self, range: [f64; 2], number: f32) -> [u8; 3] {
        if number.is_nan() {
            return UNKNOWN;
        }
        ramp(self.stops(), self.part(range, f64::from(number)))
    }

    fn stops(self) -> &'static [[u8; 3]] {
        if self == Self::Tension { DIVERGING } else { SEQUENTIAL }
    }

    /// The legend of numbers between these; `over` says what lengths are compared with.
    pub fn legend(self, [low, high]: [f64; 2], over: &str) -> Legend {
        let (title, unit) = match self {
            Self::Tension => ("Tension", format!("length / {over}")),
            Self::Error => ("Length error", format!("|length / {over} - 1|")),
            Self::Energy => ("Energy left", "of each stitch, no unit".into()),
            Self::Tightness => ("Tightness", "yarn's length x width / face's area".into()),
            Self::Yarn | Self::Type => ("", String::new()),
        };
        let scale = Scale::Bar { stops: self.stops(), low, high, logarithmic: self == Self::Energy };
        Legend { title: title.into(), unit, scale }
    }
}

/// The smallest of 1, 1.5, 2, 3, 5 and 7 times a power of ten that is not below a positive number.
fn round_up(x: f64) -> f64 {
    let power = 10f64.powf(x.log10().floor());
    let steps = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0];
    power * steps.into_iter().find(|s| s * power >= x * (1.0 - 1e-9)).unwrap_or(10.0)
}

/// `[point]` length over length at rest of the segment that begins there; NaN where there is none or its rest is not known.
fn tension(strands: &Strands) -> Vec<f32> {
    let mut tension = vec![f32::NAN; strands.points.len()];
    for (yarn, ends) in strands.offsets.windows(2).enumerate() {
        let (begin, end) = (ends[0] as usize, ends[1] as usize);
        for (i, tension) in (begin..end).zip(&mut tension[begin..end]) {
            let next = if i + 1 < end { i + 1 } else { begin };
            let there = i + 1 < end || strands.closed[yarn] && end - begin > 2;
            if there && strands.rest[i] > 0.0 {
                let length = Vec3::from(strands.points[next]).distance(Vec3::from(strands.points[i]));
                *tension = length / strands.rest[i];
            }
        }
    }
    tension
}

/// `[point]` the mean of the segments on either side, or the one there is.
fn at_points(strands: &Strands, segments: &[f32]) -> Vec<f32> {
    let mut points = vec![f32::NAN; segments.len()];
    for (yarn, ends) in strands.offsets.windows(2).enumerate() {
        let (begin, end) = (ends[0] as usize, ends[1] as usize);
        for i in begin..end {
            let before = match i {
                i if i > begin => segments[i - 1],
                _ if strands.closed[yarn] => segments[end - 1],
                _ => f32::NAN,
            };
            points[i] = match (before.is_nan(), segments[i].is_nan()) {
                (true, _) => segments[i],
                (_, true) => before,
                _ => (before + segments[i]) / 2.0,
            };
        }
    }
    points
}

/// `[point]` something of the face that the point belongs to (the first of two), faces in batch order.
fn by_face(scene: &Scene, of: impl Fn(usize) -> f32) -> Vec<f32> {
    let face = |slots: &[u32; 2]| {
        let (batch, face, _) = scene.slot_place(slots[0]);
        of(batch.first_face + face)
    };
    scene.point_slots().iter().map(face).collect()
}

/// `[face, batch order]` length of its yarn (chords between control points) times the yarn's width, over the face's area.
fn cover(strands: &Strands, scene: &Scene, positions: &[DVec3]) -> Vec<f32> {
    let slots = scene.point_slots();
    let mut lengths = vec![0.0; scene.face_count];
    for (yarn, ends) in strands.offsets.windows(2).enumerate() {
        let (begin, end) = (ends[0] as usize, ends[1] as usize);
        for i in begin..end {
            let next = match i + 1 {
                next if next < end => next,
                _ if strands.closed[yarn] => begin,
                _ => continue,
            };
            if let Some(face) = face_of_segment(scene, slots[i], slots[next]) {
                let chord = Vec3::from(strands.points[next]) - Vec3::from(strands.points[i]);
                lengths[face] += f64::from(chord.length());
            }
        }
    }
    let width = 2.0 * scene.yarn_radius;
    let mut cover = vec![f32::NAN; scene.face_count];
    for batch in &scene.batches {
        let n = scene.stencils[batch.stencil].corner_count;
        for (face, corners) in batch.corners.chunks_exact(n).enumerate() {
            let places: Vec<DVec3> = corners.iter().map(|v| positions[*v as usize] / scene.gauge).collect();
            let covered = lengths[batch.first_face + face] * width / area(&places);
            cover[batch.first_face + face] = if covered.is_finite() { covered as f32 } else { f32::NAN };
        }
    }
    cover
}

/// The area of triangles from a polygon's middle to its edges.
fn area(corners: &[DVec3]) -> f64 {
    let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    edges.map(|(a, b)| (*a - middle).cross(*b - middle).length() / 2.0).sum()
}

/// The face (batch order) in which two points follow each other.
fn face_of_segment(scene: &Scene, a: [u32; 2], b: [u32; 2]) -> Option<usize> {
    let given = |s: &u32| *s != NO_SECOND_SLOT;
    a.into_iter().filter(given).find_map(|x| {
        b.into_iter().filter(given).filter(|y| y.abs_diff(x) == 1).find_map(|y| {
            let [p, q] = [x, y].map(|s| {
                let (batch, face, _) = scene.slot_place(s);
                batch.first_face + face
            });
            (p == q).then_some(p)
        })
    })
}

/// A kind of stitch in a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kind {
    /// The stitch's name.
    pub name: String,
    /// Its faces.
    pub count: usize,
    /// Its colour.
    pub colour: [u8; 3],
}

/// Kinds of stitches by name, the most frequent first; those that there is no colour for share a grey as the last, "others".
pub fn kinds(mesh: &StitchMesh, scene: &Scene) -> Vec<Kind> {
    let mut kinds: Vec<Kind> = Vec::new();
    for batch in &scene.batches {
        for face in &batch.faces {
            let name = &mesh.face_type(*face).name;
            match kinds.iter_mut().find(|k| k.name == *name) {
                Some(kind) => kind.count += 1,
                None => kinds.push(Kind { name: name.clone(), count: 1, colour: UNKNOWN }),
            }
        }
    }
    kinds.sort_by(|a, b| b.count.cmp(&a.count).then_with(|| a.name.cmp(&b.name)));
    if kinds.len() > KINDS.len() {
        let count = kinds.drain(KINDS.len() - 1..).map(|k| k.count).sum();
        kinds.push(Kind { name: "others".into(), count, colour: UNKNOWN });
    }
    for (kind, colour) in kinds.iter_mut().zip(KINDS).filter(|(k, _)| k.name != "others") {
        kind.colour = colour;
    }
    kinds
}

/// `[point]` the colour of its stitch's kind.
pub fn kind_colours(mesh: &StitchMesh, scene: &Scene, kinds: &[Kind]) -> Vec<[u8; 3]> {
    let colour = |name: &str| kinds.iter().find(|k| k.name == name).map_or(UNKNOWN, |k| k.colour);
    let types: Vec<[u8; 3]> = mesh.types.iter().map(|t| colour(&t.name)).collect();
    let of = |slots: &[u32; 2]| {
        let (batch, face, _) = scene.slot_place(slots[0]);
        types[mesh.face_types[batch.faces[face].index()].index()]
    };
    scene.point_slots().iter().map(of).collect()
}

/// The legend of kinds.
pub fn kinds_legend(kinds: &[Kind]) -> Legend {
    let row = |k: &Kind| (format!("{}  {}", k.name, k.count), k.colour);
    Legend {
        title: "Stitches".into(),
        unit: "and how many of them".into(),
        scale: Scale::Swatches(kinds.iter().map(row).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(lengths: &[f32], closed: bool) -> Strands {
        let mut x = 0.0;
        let mut points = vec![[0.0; 3]];
        points.extend(lengths.iter().map(|l| {
            x += l;
            [x, 0.0, 0.0]
        }));
        let n = points.len();
        Strands {
            unit: 1.0,
            offsets: vec![0, n as u32],
            closed: vec![closed],
            radius: vec![0.1],
            rest: vec![2.0; n],
            colours: vec![[0; 3]; n],
            points,
            ..Strands::default()
        }
    }

    /// Seen red with segments taken as points (no mean).
    #[test]
    fn tension_is_the_mean_of_both_sides() {
        let open = line(&[2.0, 4.0], false);
        assert_eq!(Style::Tension.of_strands(&open), [1.0, 1.5, 2.0]);
        assert_eq!(Style::Error.of_strands(&open), [0.0, 0.5, 1.0]);
        // Closed, the third segment is 6 long: 3 times its rest.
        let closed = line(&[2.0, 4.0], true);
        assert_eq!(Style::Tension.of_strands(&closed), [2.0, 1.5, 2.5]);
    }

    /// Seen red with the tails' share at 0.
    #[test]
    fn ranges_are_round_and_leave_outliers_out() {
        let mut numbers = vec![1.0; 1000];
        numbers.extend([1.04; 120]);
        numbers.extend([f32::NAN, 7.0, f32::INFINITY]);
        assert_eq!(Style::Tension.range(&numbers), Some([0.95, 1.05]));
        assert_eq!(Style::Error.range(&[0.011; 9]), Some([0.0, 0.015]));
        let [low, high] = Style::Energy.range(&[2e-4, 3e-2, 4e-3]).unwrap();
        assert!((low / 1e-4 - 1.0).abs() < 1e-9 && (high / 1e-1 - 1.0).abs() < 1e-9, "{low} {high}");
        assert_eq!(Style::Tightness.range(&[f32::NAN]), None);
        for style in [Style::Tension, Style::Error, Style::Energy, Style::Tightness] {
            let [low, high] = style.range(&[0.5; 4]).unwrap();
            assert!(low < high && low <= 0.5 && 0.5 <= high, "{style:?}: {low} {high}");
        }
    }

    /// Seen red with the logarithm left out.
    #[test]
    fn colours_run_from_end_to_end() {
        let ends = |style: Style, range: [f64; 2]| range.map(|x| style.colour(range, x as f32));
        assert_eq!(ends(Style::Tension, [0.9, 1.1]), [DIVERGING[0], DIVERGING[8]]);
        assert_eq!(Style::Tension.colour([0.5, 1.5], 1.0), DIVERGING[4]);
        assert_eq!(Style::Energy.colour([1e-6, 1e-2], 1e-4), SEQUENTIAL[5]);
        assert_eq!(Style::Energy.colour([1e-6, 1e-2], f32::NAN), UNKNOWN);
    }
}
