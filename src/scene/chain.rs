//! Face-local polylines chained across faces into yarns (model section 7).

use super::{Mode, Scene};
use crate::ids::FaceId;
use crate::mesh::{Join, StitchMesh};
use crate::template::{Place, Template};

/// No second slot: the point belongs to one face only.
pub const NO_SLOT: u32 = u32::MAX;

/// The yarns of a scene: for each control point, the slot or two where faces put it.
#[derive(Clone, Debug, Default)]
pub struct Yarns {
    /// `[yarn + 1]` yarn i is `slots[offsets[i] .. offsets[i + 1]]`.
    pub offsets: Vec<u32>,
    /// `[yarn]` closed yarns do not repeat their first point.
    pub closed: Vec<bool>,
    /// `[point]` slots: the owner's (of the face with the lower index) first, then `NO_SLOT` or that of
    /// the other face; the point is the mean of both.
    pub slots: Vec<[u32; 2]>,
}

impl Yarns {
    /// Number of yarns.
    pub fn len(&self) -> usize {
        self.closed.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.closed.is_empty()
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

    /// First slot and number of points of a strand.
    fn slots(&self, strand: u32, face: usize) -> (u32, u32) {
        let (stencil, first_slot) =
            self.scene.face_stencil(FaceId::from(face)).expect("faces with strands are kept");
        let s = (strand - self.first[face]) as usize;
        let [begin, end] = [0, 1].map(|k| stencil.strand_offsets[s + k]);
        ((first_slot + begin) as u32, (end - begin) as u32)
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
    let mut yarns = Yarns { offsets: vec![0], closed: Vec::new(), slots: Vec::new() };
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
    yarns.slots.shrink_to_fit();
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
    let first = yarns.slots.len();
    let mut last: Option<(u32, usize)> = None;
    let merge = |a: (u32, usize), b: (u32, usize)| if a.1 <= b.1 { [a.0, b.0] } else { [b.0, a.0] };
    for enter in path {
        let strand = enter / 2;
        let face = strands.face(strand);
        let (slot, n) = strands.slots(strand, face);
        for i in 0..n {
            let local = if enter % 2 == 0 { i } else { n - 1 - i };
            let here = (slot + local, face);
            match last.take().filter(|_| i == 0) {
                Some(before) => *yarns.slots.last_mut().expect("a strand came before") = merge(before, here),
                None => yarns.slots.push([here.0, NO_SLOT]),
            }
            if i + 1 == n {
                last = Some(here);
            }
        }
    }
    if closed && let Some(end) = last {
        yarns.slots.pop();
        let begin = yarns.slots[first];
        // A closed yarn's first point is unmerged so far: its owner is the first strand's face.
        let face = strands.face(path[0] / 2);
        yarns.slots[first] = merge(end, (begin[0], face));
    }
    yarns.offsets.push(yarns.slots.len() as u32);
    yarns.closed.push(closed);
}
