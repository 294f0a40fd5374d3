//! What a frame does to the mesh: normals, deformation gradients and fundamental forms of faces, averaged at nodes, and
//! put together face by face for the yarn (sections 4.1 and 4.5).

use super::curvature::Fits;
use super::nodes::{Nodes, Shares};
use super::surface::{NONE, Surface};
use super::{Bending, Compat, Settings};
use crate::math::{Scalar, V3};
use glam::DVec3;
use rayon::prelude::*;

/// Places beyond this are held back: their squares must be numbers still. Metres.
const FARTHEST: f64 = 1e12;
const CHUNK: usize = 1024;

/// A face or a node in space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Form<T> {
    /// Unit normal; zero where there is none.
    pub normal: V3<T>,
    /// Columns of the deformation gradient: what becomes of u and of v.
    pub gradient: [V3<T>; 2],
    /// First fundamental form: uu, uv, vv.
    pub first: [T; 3],
    /// Second fundamental form, positive where the surface curls toward its normal.
    pub second: [T; 3],
}

/// What yarn needs to know of a face, in fours. Of the corners 0, 1 and 2 stand the value of the first and the differences of
/// the others from it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct FaceFrame<T> {
    /// Places.
    pub place: [[T; 4]; 3],
    /// What Phong deformation adds for each pair of corners (0-1, 1-2, 2-0), times both their coordinates.
    pub phong: [[T; 4]; 3],
    /// Normals.
    pub normal: [[T; 4]; 3],
    /// First fundamental forms.
    pub first: [[T; 4]; 3],
    /// Twice the second.
    pub second: [[T; 4]; 3],
}

impl<T: Scalar> Default for FaceFrame<T> {
    fn default() -> Self {
        let zero = [[T::zero(); 4]; 3];
        Self { place: zero, phong: zero, normal: zero, first: zero, second: zero }
    }
}

/// The parts of a mesh that its frames need, and the last frame.
pub struct Forms<T> {
    settings: Settings,
    pub faces: Vec<[u32; 3]>,
    /// `[face]` rows of the inverse of the material edges.
    pub inverses: Vec<[T; 4]>,
    /// `[face]` material edges 0-1, 1-2 and 2-0.
    pub edges: Vec<[[T; 2]; 3]>,
    /// `[face][edge]` the face beyond it and its far corner, where bending is read off edges.
    beyond: Vec<[(u32, u8); 3]>,
    pub nodes: Nodes,
    pub strain: Vec<T>,
    pub normal: Vec<T>,
    pub fits: Fits,
    pub fit_weights: Vec<[T; 3]>,
    /// `[vertex]` places relative to the origin.
    pub places: Vec<V3<T>>,
    /// `[face]`
    pub face_forms: Vec<Form<T>>,
    /// `[node]`
    pub node_forms: Vec<Form<T>>,
}

impl<T: Scalar> Forms<T> {
    pub fn new(surface: &Surface, nodes: Nodes, vertex_count: usize, settings: &Settings) -> Self {
        let rounded = |shares: &Shares| shares.weights.iter().map(|w| T::of(*w)).collect();
        let edge = |corners: &[glam::DVec2; 3]| {
            [0, 1, 2].map(|k| (corners[(k + 1) % 3] - corners[k]).to_array().map(T::of))
        };
        let beyond = match settings.compat {
            Compat::Madypg => material_neighbours(surface),
            Compat::None => Vec::new(),
        };
        let fits = match settings.compat {
            Compat::Madypg => Fits::default(),
            Compat::None => Fits::new(surface, &nodes),
        };
        Self {
            settings: *settings,
            fit_weights: fits.weights.iter().map(|w| w.map(T::of)).collect(),
            fits,
            faces: surface.faces.clone(),
            inverses: surface
                .inverses
                .iter()
                .map(|[a, b]| [T::of(a.x), T::of(a.y), T::of(b.x), T::of(b.y)])
                .collect(),
            edges: surface.corners.iter().map(edge).collect(),
            beyond,
            strain: rounded(&nodes.strain),
            normal: rounded(&nodes.normal),
            places: vec![V3::zero(); vertex_count],
            face_forms: vec![Form::default(); surface.face_count()],
            node_forms: vec![Form::default(); nodes.count()],
            nodes,
        }
    }

    /// Works a frame out; `positions` `[vertex]` in the world.
    pub fn update(&mut self, positions: &[DVec3], origin: DVec3) {
        let Self {
            settings, faces, inverses, beyond, nodes, strain, normal, fits, fit_weights, places, ..
        } = self;
        let (face_forms, node_forms) = (&mut self.face_forms, &mut self.node_forms);
        // Single precision is all that MADYPG reads.
        let rounded = settings.compat == Compat::Madypg;
        places.par_iter_mut().zip(positions).with_min_len(CHUNK).for_each(|(place, p)| {
            let p = if rounded { p.as_vec3().as_dvec3() } else { *p };
            *place = near(p, origin);
        });
        let places = &*places;
        face_forms.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(face, form)| {
            let [a, b, c] = faces[face].map(|v| places[v as usize]);
            *form = stretched(b - a, c - a, &inverses[face]);
        });
        let hinges = settings.compat == Compat::Madypg;
        let bends = settings.bending == Bending::Linearized;
        if hinges && bends {
            let normals: Vec<V3<T>> = face_forms.iter().map(|f| f.normal).collect();
            face_forms.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(face, form)| {
                form.second = by_hinges(face, form, &normals, faces, beyond, places);
            });
        }
        let all = &*face_forms;
        node_forms.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(node, form)| {
            form.normal = average_normal(all, &nodes.normal, normal, node);
        });
        let all = &*face_forms;
        node_forms.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(node, form)| {
            average(form, all, &nodes.strain, strain, node);
            if !hinges && bends {
                form.second = fitted(form.normal, node, nodes.vertices[node], fits, fit_weights, places);
            }
        });
    }

    /// What yarn needs to know of a face.
    pub fn face_frame(&self, face: usize) -> FaceFrame<T> {
        let places = self.faces[face].map(|v| self.places[v as usize]);
        let forms = self.nodes.of_faces[face].map(|n| self.node_forms[n as usize]);
        let phong = T::of(self.settings.phong);
        // Sum over corners of b_k F_k (p - u_k): with p = sum b_j u_j only pairs of corners are left.
        let pair = |j: usize, k: usize| {
            let [u, v] = self.edges[face][j];
            let [a, b] = [0, 1].map(|i| forms[j].gradient[i] - forms[k].gradient[i]);
            four((a * u + b * v) * phong)
        };
        let corner = |value: [[T; 4]; 3]| {
            let [a, b, c] = value;
            [a, difference(b, a), difference(c, a)]
        };
        let two = T::of(2.0);
        let form = |v: [T; 3]| [v[0], v[1], v[2], T::zero()];
        FaceFrame {
            place: corner(places.map(four)),
            phong: [pair(0, 1), pair(1, 2), pair(2, 0)],
            normal: corner(forms.map(|f| four(f.normal))),
            first: corner(forms.map(|f| form(f.first))),
            second: corner(forms.map(|f| form(f.second.map(|x| x * two)))),
        }
    }
}

/// A position relative to the origin; one that is no number stands for the origin.
pub fn near<T: Scalar>(position: DVec3, origin: DVec3) -> V3<T> {
    let near = (position - origin).clamp(DVec3::splat(-FARTHEST), DVec3::splat(FARTHEST));
    V3::of(if near.is_nan() { DVec3::ZERO } else { near })
}

fn four<T: Scalar>(v: V3<T>) -> [T; 4] {
    [v.x, v.y, v.z, T::zero()]
}

fn difference<T: Scalar>(a: [T; 4], b: [T; 4]) -> [T; 4] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]]
}

/// Normal, gradient and first fundamental form of a face with world edges 0-1 and 0-2.
fn stretched<T: Scalar>(a: V3<T>, b: V3<T>, inverse: &[T; 4]) -> Form<T> {
    let u = a * inverse[0] + b * inverse[2];
    let v = a * inverse[1] + b * inverse[3];
    Form {
        normal: a.cross(b).normalized_or_zero(),
        gradient: [u, v],
        first: [u.dot(u), u.dot(v), v.dot(v)],
        second: [T::zero(); 3],
    }
}

/// Second derivatives of the surface along its normal.
fn fitted<T: Scalar>(
    normal: V3<T>,
    node: usize,
    vertex: u32,
    fits: &Fits,
    weights: &[[T; 3]],
    places: &[V3<T>],
) -> [T; 3] {
    let mut second = [T::zero(); 3];
    for i in fits.offsets[node] as usize..fits.offsets[node + 1] as usize {
        let off = normal.dot(places[fits.vertices[i] as usize] - places[vertex as usize]);
        for (second, weight) in second.iter_mut().zip(weights[i]) {
            *second += off * weight;
        }
    }
    second
}

/// Faces across edges of the same material vertices, and which of their corners lies beyond.
fn material_neighbours(surface: &Surface) -> Vec<[(u32, u8); 3]> {
    let mut all = vec![[(NONE, 0); 3]; surface.face_count()];
    let mut sides: Vec<[u32; 4]> = Vec::with_capacity(3 * surface.face_count());
    for (face, uvs) in surface.face_uvs.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (uvs[k], uvs[(k + 1) % 3]);
            sides.push([a.min(b), a.max(b), face as u32, k as u32]);
        }
    }
    sides.sort_unstable();
    for pair in sides.windows(2) {
        let [one, other] = [pair[0], pair[1]];
        if one[..2] == other[..2] {
            for (here, there) in [(one, other), (other, one)] {
                all[here[2] as usize][here[3] as usize] = (there[2], ((there[3] + 2) % 3) as u8);
            }
        }
    }
    all
}

/// The shape operator from the angles across edges (Grinspun et al. 2006):
/// `II = sum of angle / (2 area length) (F^T t) (F^T t)^T`, t across the edge. In f64 always: angles are no stage that
/// kernels have.
fn by_hinges<T: Scalar>(
    face: usize,
    form: &Form<T>,
    normals: &[V3<T>],
    faces: &[[u32; 3]],
    beyond: &[[(u32, u8); 3]],
    places: &[V3<T>],
) -> [T; 3] {
    let corners = faces[face].map(|v| places[v as usize].to_f64());
    let twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    let normal = normals[face].to_f64();
    let gradient = form.gradient.map(|g| g.to_f64());
    let mut second = [0.0; 3];
    for (k, (other, corner)) in beyond[face].iter().enumerate() {
        if *other == NONE {
            continue;
        }
        let edge = corners[(k + 1) % 3] - corners[k];
        let far = places[faces[*other as usize][*corner as usize] as usize].to_f64() - corners[k];
        let theirs = far.cross(edge);
        let length = edge.length();
        let angle = -(edge / length).dot(normal.cross(theirs)).atan2(normal.dot(theirs));
        let across = edge.cross(normal);
        let [s, t] = gradient.map(|g| g.dot(across));
        let share = angle / (twice_area * length);
        if share.is_finite() {
            second[0] += share * s * s;
            second[1] += share * s * t;
            second[2] += share * t * t;
        }
    }
    second.map(T::of)
}

fn average_normal<T: Scalar>(faces: &[Form<T>], shares: &Shares, weights: &[T], node: usize) -> V3<T> {
    let mut sum = V3::zero();
    for i in shares.offsets[node] as usize..shares.offsets[node + 1] as usize {
        sum = sum + faces[shares.faces[i] as usize].normal * weights[i];
    }
    sum.normalized_or_zero()
}

fn average<T: Scalar>(form: &mut Form<T>, faces: &[Form<T>], shares: &Shares, weights: &[T], node: usize) {
    let mut gradient = [V3::zero(); 2];
    let (mut first, mut second) = ([T::zero(); 3], [T::zero(); 3]);
    for i in shares.offsets[node] as usize..shares.offsets[node + 1] as usize {
        let (face, weight) = (&faces[shares.faces[i] as usize], weights[i]);
        for (sum, column) in gradient.iter_mut().zip(face.gradient) {
            *sum = *sum + column * weight;
        }
        for k in 0..3 {
            first[k] += face.first[k] * weight;
            second[k] += face.second[k] * weight;
        }
    }
    form.gradient = gradient;
    form.first = first;
    form.second = second;
}
