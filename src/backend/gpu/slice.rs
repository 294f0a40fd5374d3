//! The faces that a part of the device's buffers holds, and all that they need, numbered anew.

use crate::scene::{Scene, StrandEnd};
use std::borrow::Cow;
use std::ops::Range;

const TOP: u32 = 1 << 31;
const NONE: u32 = u32::MAX;

/// Which things of a scene there are in a part, ascending.
#[derive(Debug)]
pub(super) enum Ids {
    /// All of so many.
    All(usize),
    /// These.
    Some(Vec<u32>),
}

impl Ids {
    pub fn len(&self) -> usize {
        match self {
            Self::All(count) => *count,
            Self::Some(ids) => ids.len(),
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = u32> {
        (0..self.len()).map(|i| match self {
            Self::All(_) => i as u32,
            Self::Some(ids) => ids[i],
        })
    }

    /// Those of the values that the part has.
    pub fn gather<'a, T: Copy>(&self, values: &'a [T]) -> Cow<'a, [T]> {
        match self {
            Self::All(_) => Cow::Borrowed(values),
            Self::Some(ids) => ids.iter().map(|i| values[*i as usize]).collect(),
        }
    }

    /// Puts the part's values back among all.
    pub fn scatter<T: Copy>(&self, values: impl Iterator<Item = T>, all: &mut [T]) {
        for (i, value) in self.iter().zip(values) {
            all[i as usize] = value;
        }
    }
}

/// Numbers in a part by numbers in the scene.
struct Numbers(Option<Vec<u32>>);

impl Numbers {
    fn new(ids: &Ids, count: usize) -> Self {
        let Ids::Some(ids) = ids else { return Self(None) };
        let mut numbers = vec![NONE; count];
        for (i, id) in ids.iter().enumerate() {
            numbers[*id as usize] = i as u32;
        }
        Self(Some(numbers))
    }

    /// The number in the part, for one that it has.
    fn of(&self, id: u32) -> u32 {
        self.0.as_ref().map_or(id, |numbers| numbers[id as usize])
    }
}

/// Marks, and what is marked.
struct Marks(Vec<bool>);

impl Marks {
    fn ids(&self) -> Ids {
        Ids::Some((0..self.0.len() as u32).filter(|i| self.0[*i as usize]).collect())
    }
}

/// A part of a scene.
#[derive(Debug)]
pub(super) struct Slice {
    pub vertices: Ids,
    /// Faces of the mesh whose areas the part's corners need.
    pub faces: Ids,
    pub groups: Ids,
    /// Control points on strands of the part's own faces.
    pub points: Ids,
    /// Seams with both sides in the part.
    pub seams: Ids,
    /// Sides of seams (2 x seam + side) whose other side is in another part.
    pub open: Vec<u32>,
    /// `[batch]` the part's own faces among the batch's.
    pub batches: Vec<Range<usize>>,
}

impl Slice {
    /// All of a scene.
    pub fn whole(scene: &Scene) -> Self {
        Self {
            vertices: Ids::All(scene.vertex_count),
            faces: Ids::All(scene.face_places.len()),
            groups: Ids::All(scene.corner_groups.as_ref().map_or(0, |g| g.len())),
            points: Ids::All(scene.yarns.point_count()),
            seams: Ids::All(scene.yarns.seams.len()),
            open: Vec::new(),
            batches: scene.batches.iter().map(|b| 0..b.faces.len()).collect(),
        }
    }

    /// The part of a scene whose own faces are these of the mesh.
    pub fn of_faces(scene: &Scene, own: Range<u32>) -> Self {
        let range = |batch: &crate::scene::Batch| {
            let at = |face: u32| batch.faces.partition_point(|f| f.0 < face);
            at(own.start)..at(own.end)
        };
        let batches: Vec<_> = scene.batches.iter().map(range).collect();
        let mut vertices = Marks(vec![false; scene.vertex_count]);
        let mut faces = Marks(vec![false; scene.face_places.len()]);
        let mut points = Marks(vec![false; scene.yarns.point_count()]);
        let mut sides = vec![false; 2 * scene.yarns.seams.len()];
        let mut groups = Marks(vec![false; scene.corner_groups.as_ref().map_or(0, |g| g.len())]);
        for (batch, range) in scene.batches.iter().zip(&batches) {
            let stencil = &scene.stencils[batch.stencil];
            let (corners, strands) = (stencil.corner_count, stencil.strand_offsets.len() - 1);
            for i in range.clone() {
                faces.0[batch.faces[i].index()] = true;
                for vertex in &batch.corners[i * corners..][..corners] {
                    vertices.0[*vertex as usize] = true;
                    if let Some(all) = &scene.corner_groups {
                        groups.0[all.of_vertex[*vertex as usize] as usize] = true;
                    }
                }
                let places = &scene.yarns.strands[batch.first_strand + i * strands..][..strands];
                for (place, ends) in places.iter().zip(stencil.strand_offsets.windows(2)) {
                    let count = ends[1] - ends[0];
                    if count < 2 {
                        continue;
                    }
                    for end in [0, 1] {
                        let point = match place.end(end) {
                            StrandEnd::Point(point) => point,
                            StrandEnd::Seam(side) => {
                                sides[side as usize] = true;
                                scene.yarns.seams[side as usize / 2]
                            }
                        };
                        points.0[point as usize] = true;
                    }
                    for i in 1..count - 1 {
                        points.0[place.inner(i as u32) as usize] = true;
                    }
                }
            }
        }
        // Normals are sums over all faces around a corner, whoever's they are.
        if let (Some(all), Ids::Some(groups)) = (&scene.corner_groups, groups.ids()) {
            for group in groups {
                let ends = [group, group + 1].map(|g| all.offsets[g as usize] as usize);
                for face in &all.faces[ends[0]..ends[1]] {
                    faces.0[*face as usize] = true;
                }
            }
        }
        let faces = faces.ids();
        for face in faces.iter() {
            let ends = [face, face + 1].map(|f| scene.face_offsets[f as usize] as usize);
            for vertex in &scene.face_vertices[ends[0]..ends[1]] {
                vertices.0[*vertex as usize] = true;
            }
        }
        let both = |seam: &u32| sides[2 * *seam as usize] && sides[2 * *seam as usize + 1];
        let open = |side: &u32| sides[*side as usize] && !sides[(*side ^ 1) as usize];
        Self {
            vertices: vertices.ids(),
            faces,
            groups: groups.ids(),
            points: points.ids(),
            seams: Ids::Some((0..scene.yarns.seams.len() as u32).filter(both).collect()),
            open: (0..sides.len() as u32).filter(open).collect(),
            batches,
        }
    }

    /// Sides of seams that the part has.
    pub fn side_count(&self) -> usize {
        2 * self.seams.len() + self.open.len()
    }

    /// How the part numbers what it has.
    pub fn numbering<'a>(&'a self, scene: &'a Scene) -> Numbering<'a> {
        let whole = matches!(self.seams, Ids::All(_));
        let mut sides = Vec::new();
        if !whole {
            sides = vec![NONE; 2 * scene.yarns.seams.len()];
            for (i, seam) in self.seams.iter().enumerate() {
                for side in 0..2 {
                    sides[2 * seam as usize + side] = (2 * i + side) as u32;
                }
            }
            for (i, side) in self.open.iter().enumerate() {
                sides[*side as usize] = (2 * self.seams.len() + i) as u32;
            }
        }
        Numbering {
            scene,
            slice: self,
            vertices: Numbers::new(&self.vertices, scene.vertex_count),
            faces: Numbers::new(&self.faces, scene.face_places.len()),
            groups: Numbers::new(&self.groups, scene.corner_groups.as_ref().map_or(0, |g| g.len())),
            points: Numbers::new(&self.points, scene.yarns.point_count()),
            sides: Numbers((!whole).then_some(sides)),
        }
    }
}

/// The words of a part's topology.
pub(super) struct Numbering<'a> {
    scene: &'a Scene,
    slice: &'a Slice,
    vertices: Numbers,
    faces: Numbers,
    groups: Numbers,
    points: Numbers,
    sides: Numbers,
}

impl Numbering<'_> {
    /// Offsets of the faces' vertices, and the vertices.
    pub fn face_vertices(&self) -> [Vec<u32>; 2] {
        let scene = self.scene;
        lists(&self.slice.faces, &scene.face_offsets, &scene.face_vertices, &self.vertices)
    }

    /// Offsets of the faces around corner groups, and the faces.
    pub fn group_faces(&self) -> [Vec<u32>; 2] {
        match &self.scene.corner_groups {
            Some(groups) => lists(&self.slice.groups, &groups.offsets, &groups.faces, &self.faces),
            None => [vec![0], Vec::new()],
        }
    }

    /// `[seam]` control points.
    pub fn seam_points(&self) -> Vec<u32> {
        self.slice.seams.iter().map(|s| self.points.of(self.scene.yarns.seams[s as usize])).collect()
    }

    /// `[face][corner]` of a batch: vertex, and index of the normal in the surface's buffer.
    pub fn corners(&self, b: usize) -> Vec<u32> {
        let batch = &self.scene.batches[b];
        let n = self.scene.stencils[batch.stencil].corner_count;
        let (vertices, faces) = (self.slice.vertices.len() as u32, self.slice.faces.len() as u32);
        let own = &self.slice.batches[b];
        let mut words = Vec::with_capacity(2 * n * own.len());
        for (i, vertex) in batch.corners[own.start * n..own.end * n].iter().enumerate() {
            let normal = match &self.scene.corner_groups {
                Some(groups) => vertices + faces + self.groups.of(groups.of_vertex[*vertex as usize]),
                None => vertices + self.faces.of(batch.faces[own.start + i / n].0),
            };
            words.extend([self.vertices.of(*vertex), normal]);
        }
        words
    }

    /// `[face][strand]` of a batch, as [`crate::scene::StrandPlace::words`] has it.
    pub fn strands(&self, b: usize) -> Vec<u32> {
        let batch = &self.scene.batches[b];
        let offsets = &self.scene.stencils[batch.stencil].strand_offsets;
        let count = offsets.len() - 1;
        let own = &self.slice.batches[b];
        let places = &self.scene.yarns.strands[batch.first_strand..][own.start * count..own.end * count];
        let mut words = Vec::with_capacity(3 * places.len());
        for (i, place) in places.iter().enumerate() {
            let [start, ends @ ..] = place.words();
            let ends = ends.map(|end| match end & TOP {
                0 => self.points.of(end),
                _ => TOP | self.sides.of(end & !TOP),
            });
            let inner = offsets[i % count + 1] - offsets[i % count] > 2;
            words.push(if inner { self.start(*place, start) } else { start });
            words.extend(ends);
        }
        words
    }

    /// Points inside a strand lie side by side in the part as in the scene.
    fn start(&self, place: crate::scene::StrandPlace, start: u32) -> u32 {
        let first = self.points.of(place.inner(1));
        let with_yarn = start & TOP == 0;
        // The strand's own end lies before.
        debug_assert!(!with_yarn || first > 0);
        if with_yarn { first.wrapping_sub(1) & !TOP } else { (first + 1) | TOP }
    }

    /// `[face]` of a batch, number of the mesh's face.
    pub fn mesh_faces(&self, b: usize) -> Vec<u32> {
        let batch = &self.scene.batches[b];
        batch.faces[self.slice.batches[b].clone()].iter().map(|f| self.faces.of(f.0)).collect()
    }
}

/// Lists of some things, numbered anew: offsets, and what is on them.
fn lists(ids: &Ids, offsets: &[u32], all: &[u32], numbers: &Numbers) -> [Vec<u32>; 2] {
    let mut begins = vec![0];
    let mut entries = Vec::new();
    for id in ids.iter() {
        let ends = [id, id + 1].map(|i| offsets[i as usize] as usize);
        entries.extend(all[ends[0]..ends[1]].iter().map(|e| numbers.of(*e)));
        begins.push(entries.len() as u32);
    }
    [begins, entries]
}
