//! The other kernels of a frame: areas and normals of the surface, seams, faces chosen one by one, curves.

use super::{CROSS3, Costs, DOT3, IN_PLANE, Kind, LENGTH3, PLACE, Stage, WORD, frame, load};
use crate::backend::gpu::layout::COUNTS;

/// Bytes that a thread of stitches reads to learn which face is its own, where faces were chosen: how many there are, and
/// the entry, once for the face and once for whether it is hidden.
pub const ENTRY: u64 = 3 * WORD as u64;

/// The area of a face with so many corners, three at least.
pub fn areas(corners: usize) -> Costs {
    let mut costs = Costs::default();
    let triangles = corners - 2;
    // Where it begins and ends, the first corner; each corner for whether it moved; two corners of each triangle.
    costs.put(Stage::Areas, Kind::Topology, WORD * (3 + corners + 2 * triangles));
    costs.put(Stage::Areas, Kind::Surface, PLACE + WORD * corners + 2 * PLACE * triangles);
    costs.put(Stage::Areas, Kind::SurfaceWritten, WORD + PLACE);
    // Two edges, their product added, their size added.
    costs.work(Stage::Areas, (3 + 3 + CROSS3 + 3 + 2 * DOT3 + 2) * triangles);
    // Half of it; is it wide.
    costs.work(Stage::Areas, 3 + 1 + LENGTH3);
    costs
}

/// The normal of a corner group with so many faces around it.
pub fn corner_normals(faces: usize) -> Costs {
    let mut costs = Costs::default();
    // Where it begins and ends; each face for whether its area changed, and for the area.
    costs.put(Stage::CornerNormals, Kind::Topology, WORD * (2 + 2 * faces));
    costs.put(Stage::CornerNormals, Kind::Surface, (WORD + PLACE) * faces);
    costs.put(Stage::CornerNormals, Kind::SurfaceWritten, WORD + PLACE);
    costs.work(Stage::CornerNormals, 3 * faces);
    costs
}

/// A seam: the mean of its two sides.
pub fn join() -> Costs {
    let mut costs = Costs::default();
    costs.put(Stage::Join, Kind::Topology, WORD);
    costs.put(Stage::Join, Kind::PointsRead, 2 * PLACE);
    costs.put(Stage::Join, Kind::Points, PLACE);
    costs.work(Stage::Join, 2 * 3);
    costs
}

/// A point, or a side of a seam, turned along.
pub fn carry() -> Costs {
    let mut costs = Costs::default();
    costs.put(Stage::Carry, Kind::PointsRead, PLACE);
    costs.put(Stage::Carry, Kind::Points, PLACE);
    // Three columns scaled, and four of them added.
    costs.work(Stage::Carry, 3 * 3 + 3 * 3);
    costs
}

/// What is decided about a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Choice {
    /// Nobody sees it.
    Hidden {
        /// Whether it has no points yet, and is interpolated once.
        first: bool,
    },
    /// Nothing moved: not worked on.
    Unmoved,
    /// There is nothing to solve.
    WithoutKnots,
    /// It has no frame.
    Unusable,
    /// The shape is remembered.
    Rigid,
    /// The template's own shape.
    Rest,
    /// The first face's shape.
    Shared,
    /// It is to be solved.
    Solved,
}

/// How faces are chosen.
#[derive(Clone, Copy, Debug)]
pub struct Choosing {
    /// Whether some are hidden.
    pub sight: bool,
    /// Whether shapes are remembered.
    pub rigid: bool,
    /// Whether a frame before tells what is remembered.
    pub near: bool,
}

/// What comparisons came to that the choice alone does not tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Looks {
    /// Corners looked at for whether they or their normals moved.
    pub changed: usize,
    /// Corners whose places are finite.
    pub finite: usize,
    /// Whether what is remembered of the face was asked for.
    pub remembered: bool,
    /// `[remembered, rest, shared]` corners compared along the course, and of those along the wale too.
    pub compared: [[usize; 2]; 3],
    /// Whether there was a rest shape, and a first face's, to compare with; `None` where it was not asked.
    pub known: [Option<bool>; 2],
}

impl Looks {
    /// A face of so many corners in motion, looked at as briefly as can be for what was decided, where all may be skipped.
    pub fn least(choice: Choice, choosing: &Choosing, corners: usize) -> Self {
        let all = [corners - 1; 2];
        let near = choosing.near;
        let mut looks =
            Self { changed: usize::from(near), finite: corners, remembered: near, ..Self::default() };
        // The first corner compared is off along the course.
        let off = [1, 0];
        let remembered = if near { off } else { [0; 2] };
        (looks.compared, looks.known) = match choice {
            Choice::Unmoved => {
                looks.changed = corners;
                ([[0; 2]; 3], [None; 2])
            }
            Choice::Hidden { .. } | Choice::WithoutKnots | Choice::Unusable => ([[0; 2]; 3], [None; 2]),
            Choice::Rigid => ([all, [0; 2], [0; 2]], [None; 2]),
            Choice::Rest => ([remembered, all, [0; 2]], [Some(true), None]),
            Choice::Shared => ([remembered, off, all], [Some(true); 2]),
            Choice::Solved => ([remembered, off, off], [Some(true); 2]),
        };
        looks
    }
}

/// A face with so many corners and knots, chosen or not.
pub fn choose(corners: usize, knots: usize, choosing: &Choosing, choice: Choice, looks: &Looks) -> Costs {
    let mut costs = Costs::default();
    let n = corners;
    let mut put = |kind, words: usize| costs.put(Stage::Choose, kind, WORD * words);
    // Counts of the stitch type, the face in the mesh, how it ended last.
    put(Kind::Stencil, COUNTS.len());
    put(Kind::Topology, 1);
    put(Kind::ResultsRead, 1);
    if choosing.sight {
        put(Kind::Surface, 1);
    }
    // A normal's place, and whether it changed.
    let hidden = matches!(choice, Choice::Hidden { .. });
    if !hidden {
        put(Kind::Topology, looks.changed);
        put(Kind::Surface, looks.changed);
    }
    // What was skipped is counted, and an entry put on a list: a count, and a word.
    let is_counted = !matches!(choice, Choice::Unusable | Choice::Solved);
    let is_listed = !matches!(choice, Choice::Unmoved | Choice::Hidden { first: false });
    let adds = usize::from(is_counted) + usize::from(is_listed);
    put(Kind::Lists, adds);
    put(Kind::ListsWritten, adds + usize::from(is_listed));
    if choice == (Choice::Hidden { first: false }) {
        put(Kind::Results, 1);
    }
    if hidden || matches!(choice, Choice::Unmoved | Choice::WithoutKnots) {
        return costs;
    }
    // A shape: whether there is one, two numbers for all corners but the first.
    let shape = 1 + 2 * (n - 1);
    if choice == Choice::Unusable {
        put(Kind::Shapes, usize::from(choosing.rigid));
    } else {
        let [remembered, rest, shared] = looks.compared;
        put(Kind::ShapesRead, usize::from(looks.remembered) + 2 * remembered[0]);
        let asked = looks.known.iter().flatten().count();
        put(Kind::Known, asked + 2 * (rest[0] + shared[0]));
        match choice {
            Choice::Rest | Choice::Shared => {
                put(Kind::Known, shape - 1 + 3 * knots + 3);
                put(Kind::Shapes, shape);
                put(Kind::Knots, 3 * knots);
                put(Kind::Results, 3);
            }
            Choice::Solved if choosing.rigid => put(Kind::Shapes, shape),
            _ => {}
        }
        // All corners but the first in the plane; a difference for each number compared.
        let compared: usize = looks.compared.iter().flatten().sum();
        costs.work(Stage::Choose, IN_PLANE * (n - 1) + compared);
    }
    load(&mut costs, n, looks.finite);
    frame(&mut costs, n);
    costs
}

/// Where a control point lies in its yarn, as far as it changes what its segment costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Steps by which its yarn is found, see [`steps`].
    pub steps: usize,
    /// How many of the points around it are mirrored: 0 inside a yarn; none where it is the last and has no segment.
    pub mirrored: Option<usize>,
    /// For each end: whether the two spacings around it are above zero, and whether they are finite too.
    pub sound: [[bool; 2]; 2],
}

impl Segment {
    /// One inside a yarn, its points apart.
    pub fn inside(steps: usize) -> Self {
        Self { steps, mirrored: Some(0), sound: [[true; 2]; 2] }
    }
}

/// Steps of the bisection that finds a yarn among so many.
pub fn steps(yarn: usize, yarns: usize) -> usize {
    let (mut all, mut count) = (0..yarns, 0);
    while all.len() > 1 {
        let middle = all.start + all.len() / 2;
        all = if middle <= yarn { middle..all.end } else { all.start..middle };
        count += 1;
    }
    count
}

/// A control point and the segment after it, with so many samples more.
pub fn curve(segment: &Segment, extra: usize) -> Costs {
    let mut costs = Costs::default();
    let mut put = |kind, bytes: usize| costs.put(Stage::Curve, kind, bytes);
    // Where the yarn begins and ends, and how many of those before have ends, it and the next.
    put(Kind::Yarns, WORD * (segment.steps + 4));
    put(Kind::PointsRead, PLACE);
    put(Kind::Curves, PLACE);
    let Some(mirrored) = segment.mirrored else { return costs };
    // Three points more, each mirrored one from two.
    put(Kind::PointsRead, PLACE * (3 + mirrored));
    put(Kind::Curves, PLACE * extra);
    // Three spacings, the root of a length each; the chord.
    let mut work = 6 * mirrored + 3 * (3 + LENGTH3 + 1) + 3;
    for [positive, finite] in segment.sound {
        // Both added; then the way across by their inverse, and the tangent.
        work += usize::from(positive)
            + if positive && finite { (3 + 1 + 1 + 3) + (3 + 1 + 3 + 3 + 3 + 3) } else { 0 };
    }
    // t and its powers (3), the four weights (4, 3, 1, 3), four vectors scaled and added.
    work += (3 + 11 + 4 * 3 + 3 * 3) * extra;
    costs.work(Stage::Curve, work);
    costs
}
