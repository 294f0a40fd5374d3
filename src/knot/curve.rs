//! Centripetal Catmull-Rom curves through control points (model section 7); each yarn is sampled segment by segment.

use crate::Result;
use crate::math::{Scalar, V3};

/// Points of a curve of `n` control points with `subdivide` extra ones a segment.
pub fn sampled_len(n: usize, closed: bool, subdivide: usize) -> usize {
    match (n, closed) {
        (0, _) => 0,
        (_, true) => n * (subdivide + 1),
        (_, false) => (n - 1) * (subdivide + 1) + 1,
    }
}

/// Point `i` of a run of `n` (`i` may be one before or after): closed runs wrap, open ends mirror their
/// neighbour.
pub fn neighbour<T: Scalar>(i: isize, n: usize, closed: bool, point: impl Fn(usize) -> V3<T>) -> V3<T> {
    let last = n as isize - 1;
    let mirrored = |end: isize, other: isize| {
        let end = point(end as usize);
        end + end - point(other as usize)
    };
    if closed {
        point(i.rem_euclid(n as isize) as usize)
    } else if i < 0 {
        mirrored(0, last.min(1))
    } else if i > last {
        mirrored(last, (last - 1).max(0))
    } else {
        point(i as usize)
    }
}

/// Calls `sink` with each sample of a run of points: the points, and `subdivide` more a segment.
///
/// # Errors
/// The first of `sink`.
pub fn sample<T: Scalar>(
    points: &[V3<T>],
    closed: bool,
    subdivide: usize,
    sink: &mut dyn FnMut(V3<T>) -> Result<()>,
) -> Result<()> {
    let n = points.len();
    if subdivide == 0 {
        return points.iter().try_for_each(|p| sink(*p));
    }
    let segments = if closed { n } else { n.saturating_sub(1) };
    let step = T::of(1.0 / (subdivide + 1) as f64);
    for i in 0..segments {
        let p = [-1, 0, 1, 2].map(|k| neighbour(i as isize + k, n, closed, |i| points[i]));
        let segment = Segment::centripetal(p);
        sink(p[1])?;
        for k in 1..=subdivide {
            sink(segment.at(T::of(k as f64) * step))?;
        }
    }
    if !closed && n > 0 { sink(points[n - 1]) } else { Ok(()) }
}

/// A segment of a curve: its ends, and the tangents there.
#[derive(Clone, Copy, Debug)]
pub struct Segment<T> {
    ends: [V3<T>; 2],
    tangents: [V3<T>; 2],
}

impl<T: Scalar> Segment<T> {
    /// The middle one of four consecutive points, for a parameter from 0 to 1: centripetal parametrisation (knots
    /// spaced by the square root of the distance).
    pub fn centripetal(p: [V3<T>; 4]) -> Self {
        let spacing = |a: V3<T>, b: V3<T>| (b - a).length().sqrt();
        let (d0, d1, d2) = (spacing(p[0], p[1]), spacing(p[1], p[2]), spacing(p[2], p[3]));
        let usable = |a: T, b: T| T::zero() < a && T::zero() < b && (a + b).finite();
        let chord = p[2] - p[1];
        // Where two points coincide there is no spacing to divide by: the chord stands in.
        let (mut start, mut end) = (chord, chord);
        if usable(d0, d1) {
            let across = (p[2] - p[0]) * (T::one() / (d0 + d1));
            start = chord + ((p[1] - p[0]) * (T::one() / d0) - across) * d1;
        }
        if usable(d1, d2) {
            let across = (p[3] - p[1]) * (T::one() / (d1 + d2));
            end = chord + ((p[3] - p[2]) * (T::one() / d2) - across) * d1;
        }
        Self { ends: [p[1], p[2]], tangents: [start, end] }
    }

    /// The middle one of four consecutive points of a uniform Catmull-Rom curve.
    pub fn uniform(p: [V3<T>; 4]) -> Self {
        let half = T::of(0.5);
        Self { ends: [p[1], p[2]], tangents: [(p[2] - p[0]) * half, (p[3] - p[1]) * half] }
    }

    /// The point at parameter `t` in 0..1.
    pub fn at(&self, t: T) -> V3<T> {
        let (two, three) = (T::of(2.0), T::of(3.0));
        let t2 = t * t;
        let t3 = t2 * t;
        let begin = two * t3 - three * t2 + T::one();
        let leave = t3 - two * t2 + t;
        let arrive = t3 - t2;
        let finish = three * t2 - two * t3;
        self.ends[0] * begin + self.tangents[0] * leave + self.ends[1] * finish + self.tangents[1] * arrive
    }
}
