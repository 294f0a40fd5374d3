//! Face-local polylines chained across faces into yarns (model section 7).

use super::{Mode, Scene};
use crate::ids::FaceId;
use crate::mesh::{Join, StitchMesh};
use crate::template::{Place, Template};
use std::sync::OnceLock;

/// No second slot: the point belongs to one face only.
pub const NO_SLOT: u32 = u32::MAX;

/// The yarns of a scene, and where the strands of faces lie in them.
#[derive(Clone, Debug, Default)]
pub struct Yarns {
    /// `[yarn + 1]` yarn i is the control points `offsets[i] .. offsets[i + 1]`.
    pub offsets: Vec<u32>,
    /// `[yarn]` closed yarns do not repeat their first point.
    pub closed: Vec<bool>,
    /// `[yarn + 1]` how many of the yarns before have ends (and points).
    pub with_ends: Vec<u32>,
    /// Strands of all faces in batch order.
    pub strands: Vec<StrandPlace>,
    /// `[seam]` control points that two faces share: each is the mean of what they say.
    pub seams: Vec<u32>,
    /// See [`Scene::point_slots`].
    pub(super) slots: OnceLock<Vec<[u32; 2]>>,
}

/// Where a strand lies in its yarn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StrandPlace {
    /// Control point of the strand's point 0, were the yarn unrolled; the top bit is set where the yarn runs against
    /// the strand.
    start: u32,
    /// Where its first and its last point go: a control point, or with the top bit set 2 x seam + side.
    ends: [u32; 2],
}

const TOP: u32 = 1 << 31;

/// Where the end of a strand goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrandEnd {
    /// A control point of its own.
    Point(u32),
    /// 2 x seam + side; side 0 is that of the owner, the face with the lower index.
    Seam(u32),
}

impl StrandPlace {
    /// As words: `[start, end of the first point, of the last]`; in the first the top bit says that the yarn runs against
    /// the strand, in the others that it is 2 x seam + side, not a control point.
    pub fn words(self) -> [u32; 3] {
        [self.start, self.ends[0], self.ends[1]]
    }

    /// The control point of the strand's point `i`, not one at its ends.
    #[inline(always)]
    pub fn inner(self, i: u32) -> u32 {
        let start = self.start & !TOP;
        if self.start & TOP == 0 { start.wrapping_add(i) } else { start.wrapping_sub(i) }
    }

    /// The lowest control point of the strand's points but its ends, `count` of them, and whether the yarn runs with
    /// the strand.
    #[inline(always)]
    pub fn inside(self, count: u32) -> (u32, bool) {
        let start = self.start & !TOP;
        let with = self.start & TOP == 0;
        (if with { start.wrapping_add(1) } else { start.wrapping_sub(count) }, with)
    }

    /// Where the first (0) or the last (1) point goes.
    #[inline(always)]
    pub fn end(self, end: usize) -> StrandEnd {
        let place = self.ends[end];
        if place & TOP == 0 { StrandEnd::Point(place) } else { StrandEnd::Seam(place & !TOP) }
    }
}

impl Yarns {
    /// Number of control points.
    pub fn point_count(&self) -> usize {
        self.offsets.last().map_or(0, |n| *n as usize)
    }

    /// Number of yarns.
    pub fn len(&self) -> usize {
        self.closed.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.closed.is_empty()
    }

    /// Where a yarn's samples begin among those of all yarns, with `subdivide` extra ones a segment. Of yarn
    /// [`Yarns::len`], how many there are.
    pub fn first_sample(&self, yarn: usize, subdivide: usize) -> usize {
        // Each yarn with ends has a segment less than points.
        self.offsets[yarn] as usize * (subdivide + 1) - self.with_ends[yarn] as usize * subdivide
    }

    /// Which sample a control point is, as [`Yarns::first_sample`] counts them. Of point [`Yarns::point_count`], how many
    /// there are.
    pub fn sample_of(&self, point: u32, subdivide: usize) -> usize {
        let yarn = self.offsets.partition_point(|o| *o <= point) - 1;
        let first = self.first_sample(yarn, subdivide);
        // Zero beyond the last yarn.
        first + (point - self.offsets[yarn]) as usize * (subdivide + 1)
    }

    /// The points of a yarn.
    pub fn range(&self, yarn: usize) -> std::ops::Range<usize> {
        self.offsets[yarn] as usize..self.offsets[yarn + 1] as usize
    }
}

/// An end of a strand on an edge of its template.
#[derive(Clone, Copy)]
struct Crossing {
    strand: u32,
    /// 0: the strand's first point, 1: its last.
    end: u32,
    along: i64,
    z: i64,
}

/// Crossings agree when they are equal after rounding to a thousandth.
const QUANTA: f64 = 1000.0;
const UNLINKED: u32 = u32::MAX;

/// `[edge]` crossings of a template.
fn crossings(template: &Template, mode: Mode) -> Vec<Vec<Crossing>> {
    let mut edges = vec![Vec::new(); template.corners.len()];
    for (s, strand) in mode.strands(template).iter().enumerate() {
        for (end, point) in [(0, strand.first()), (1, strand.last())] {
            let Some(point) = point else { continue };
            if let Place::Boundary { edge, along } = point.place {
                edges[edge as usize].push(Crossing {
                    strand: s as u32,
                    end,
                    along: (along * QUANTA).round() as i64,
                    z: (point.z * QUANTA).round() as i64,
                });
            }
        }
    }
    edges
}

/// Strands numbered through: strand s of face f is `first_strand[f] + s`; end e of strand i is `2 i + e`.
struct Strands<'a> {
    scene: &'a Scene,
    first: Vec<u32>,
}

impl Strands<'_> {
    fn face(&self, strand: u32) -> usize {
        // Faces without strands share their first strand with the next: the last one owns it.
        self.first.partition_point(|f| *f <= strand) - 1
    }

    /// Place of a strand in batch order, and its number of points.
    fn place(&self, strand: u32, face: usize) -> (usize, u32) {
        let at = self.scene.face_places[face];
        let batch = &self.scene.batches[at.batch as usize];
        let offsets = &self.scene.stencils[batch.stencil].strand_offsets;
        let s = (strand - self.first[face]) as usize;
        let place = batch.first_strand + at.index as usize * (offsets.len() - 1) + s;
        (place, (offsets[s + 1] - offsets[s]) as u32)
    }
}

/// Chains the strands of all kept faces.
pub(super) fn chain(mesh: &StitchMesh, scene: &Scene) -> Yarns {
    let edge_crossings: Vec<_> = scene.templates.iter().map(|t| crossings(t, scene.mode)).collect();
    let mut first = Vec::with_capacity(mesh.face_count() + 1);
    let mut count = 0u32;
    for face in 0..mesh.face_count() {
        first.push(count);
        count += scene.face_stencil(face.into()).map_or(0, |(s, _)| s.strand_offsets.len() as u32 - 1);
    }
    first.push(count);
    let strands = Strands { scene, first };

    let mut links = vec![UNLINKED; 2 * count as usize];
    for join in &mesh.joins {
        link(mesh, scene, &edge_crossings, &strands, join, &mut links);
    }
    walk(&strands, &links, count)
}

/// Links the strand ends that meet at a joined edge.
fn link(
    mesh: &StitchMesh,
    scene: &Scene,
    edge_crossings: &[Vec<Vec<Crossing>>],
    strands: &Strands,
    join: &Join,
    links: &mut [u32],
) {
    // The crossings of the face's edge, with template edges counted from the template's corner 0.
    let side = |e: crate::mesh::FaceEdge| {
        let (stencil, edge) = scene.template_edge(mesh, e)?;
        Some(&edge_crossings[stencil][edge])
    };
    let (Some(a), Some(b)) = (side(join.a), side(join.b)) else { return };
    let end = |face: FaceId, c: &Crossing| (2 * (strands.first[face.index()] + c.strand) + c.end) as usize;
    for x in a {
        let along = if join.flipped { QUANTA as i64 - x.along } else { x.along };
        let i = end(join.a.face, x);
        // Several crossings of one place pair up in order.
        let partner = b
            .iter()
            .map(|y| (y, end(join.b.face, y)))
            .find(|(y, j)| y.along == along && y.z == x.z && links[*j] == UNLINKED && *j != i);
        if let Some((_, j)) = partner.filter(|_| links[i] == UNLINKED) {
            links[i] = j as u32;
            links[j] = i as u32;
        }
    }
}

fn walk(strands: &Strands, links: &[u32], count: u32) -> Yarns {
    let mut yarns = Yarns {
        offsets: vec![0],
        with_ends: vec![0],
        strands: vec![StrandPlace::default(); count as usize],
        ..Yarns::default()
    };
    let mut seen = vec![false; count as usize];
    let mut path: Vec<u32> = Vec::new();
    for lowest in 0..count {
        if seen[lowest as usize] {
            continue;
        }
        // Back to the yarn's beginning, or round to the lowest strand again. An entry is 2 strand + the end
        // by which the strand is left.
        let mut begin = 2 * lowest;
        let closed = loop {
            let back = links[begin as usize];
            if back == UNLINKED {
                break false;
            }
            begin = back ^ 1;
            if begin == 2 * lowest {
                break true;
            }
        };
        path.clear();
        let mut enter = begin;
        loop {
            path.push(enter);
            seen[enter as usize / 2] = true;
            let next = links[(enter ^ 1) as usize];
            if next == UNLINKED || next == begin {
                break;
            }
            enter = next;
        }
        if votes(strands, &path) < 0 {
            path.reverse();
            path.iter_mut().for_each(|e| *e ^= 1);
            if closed {
                // Still starts at the lowest strand.
                let at = path.iter().position(|e| e / 2 == lowest).expect("the path has it");
                path.rotate_left(at);
            }
        }
        emit(strands, &path, closed, &mut yarns);
    }
    yarns.offsets.shrink_to_fit();
    yarns.seams.shrink_to_fit();
    yarns
}

/// +1 where all yarn edge labels on the way agree with the direction of the path, -1 where all disagree, else 0.
fn votes(strands: &Strands, path: &[u32]) -> i32 {
    let (mut with, mut against) = (false, false);
    for enter in path {
        let strand = enter / 2;
        let face = strands.face(strand);
        let place = strands.scene.face_places[face];
        let stencil = strands.scene.batches[place.batch as usize].stencil;
        let template = &strands.scene.templates[stencil];
        let points = &strands.scene.mode.strands(template)[(strand - strands.first[face]) as usize];
        for (end, point) in [(0, points.first()), (1, points.last())] {
            let Some(Place::Boundary { edge, .. }) = point.map(|p| p.place) else { continue };
            let label = &template.labels[edge as usize];
            let sign = match label.as_bytes() {
                [b'+', b'y', ..] => 1,
                [b'-', b'y', ..] => -1,
                _ => continue,
            };
            let leaving = end != enter % 2;
            if (sign > 0) == leaving { with = true } else { against = true }
        }
    }
    i32::from(with && !against) - i32::from(against && !with)
}

/// Appends a yarn: at each link the two boundary points become one.
fn emit(strands: &Strands, path: &[u32], closed: bool, yarns: &mut Yarns) {
    let first = yarns.point_count() as u32;
    let mut next = first;
    // The strand left last, by which end, and its face.
    let mut last: Option<(usize, usize, usize)> = None;
    for (i, enter) in path.iter().enumerate() {
        let (strand, end) = (enter / 2, (enter % 2) as usize);
        let face = strands.face(strand);
        let (place, n) = strands.place(strand, face);
        let begin = match last {
            Some(before) => {
                next -= 1;
                yarns.join(next, before, (place, end, face));
                next
            }
            None => {
                yarns.strands[place].ends[end] = next;
                next
            }
        };
        yarns.strands[place].start = if end == 0 { begin } else { (begin + n - 1) | TOP };
        yarns.strands[place].ends[1 - end] = begin + n - 1;
        next = begin + n;
        last = Some((place, 1 - end, face));
        if closed && i + 1 == path.len() {
            // Round to the yarn's first point.
            next -= 1;
            let begun = (strands.place(path[0] / 2, strands.face(path[0] / 2)).0, (path[0] % 2) as usize);
            yarns.join(first, (place, 1 - end, face), (begun.0, begun.1, strands.face(path[0] / 2)));
        }
    }
    yarns.offsets.push(next);
    yarns.closed.push(closed);
    let before = yarns.with_ends[yarns.closed.len() - 1];
    yarns.with_ends.push(before + u32::from(!closed && yarns.offsets[yarns.closed.len() - 1] < next));
}

impl Yarns {
    /// Makes a control point the seam of two strands' ends, each given as (strand, end, face).
    fn join(&mut self, point: u32, a: (usize, usize, usize), b: (usize, usize, usize)) {
        let seam = self.seams.len() as u32;
        self.seams.push(point);
        let (owner, other) = if a.2 <= b.2 { (a, b) } else { (b, a) };
        for (side, (strand, end, _)) in [(0, owner), (1, other)] {
            self.strands[strand].ends[end] = TOP | (2 * seam + side);
        }
    }
}

/// `[point]` the slots of control points: the owner's first, then that of the other face or [`NO_SLOT`].
pub(super) fn point_slots(scene: &Scene) -> Vec<[u32; 2]> {
    let yarns = &scene.yarns;
    let mut slots = vec![[NO_SLOT; 2]; yarns.point_count()];
    for batch in &scene.batches {
        let stencil = &scene.stencils[batch.stencil];
        let count = stencil.strand_offsets.len() - 1;
        for (i, place) in yarns.strands[batch.first_strand..][..batch.faces.len() * count].iter().enumerate()
        {
            let (face, s) = (i / count, i % count);
            let [begin, end] = [0, 1].map(|k| stencil.strand_offsets[s + k]);
            let first = batch.first_slot + face * stencil.points.len() + begin;
            for k in 0..end - begin {
                let slot = (first + k) as u32;
                let at_end = [0, end - begin - 1].iter().position(|e| *e == k).map(|e| place.end(e));
                match at_end {
                    None => slots[place.inner(k as u32) as usize][0] = slot,
                    Some(StrandEnd::Point(point)) => slots[point as usize][0] = slot,
                    Some(StrandEnd::Seam(side)) => {
                        slots[yarns.seams[side as usize / 2] as usize][side as usize % 2] = slot;
                    }
                }
            }
        }
    }
    slots
}
