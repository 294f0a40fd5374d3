//! A scene: mesh and library compiled once into flat arrays sorted by stitch type; never changed after.

mod chain;
mod material;
mod stencil;
mod terms;
mod visible;

pub use chain::{NO_SLOT as NO_SECOND_SLOT, StrandEnd, StrandPlace, Yarns};
pub use material::{laid_flat, natural_unit};
pub use stencil::{Role, Stencil, StencilPoint};
pub use terms::{NOT_OWN, OwnCosine, OwnLength, Term, Terms};
pub use visible::{Camera, visible_faces};

use crate::ids::{FaceId, TemplateId};
use crate::mesh::corners::CornerGroups;
use crate::mesh::{FaceEdge, StitchMesh, StitchType};
use crate::template::check::polygon_area;
use crate::template::{Coordinates, Place, Strand, Template, TemplateLibrary};
use crate::{Error, Result};
use glam::DVec3;
use std::collections::BTreeMap;

/// What is done with the templates' points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Knots are interpolated and their points solved for (Huang et al. 2025, section 3.2).
    #[default]
    Relax,
    /// Knots are interpolated and carry their points rigidly.
    Knots,
    /// Every point is interpolated.
    Embed,
}

impl Mode {
    /// The polylines that this mode takes of a template: `embed` the original ones, where there are any.
    pub fn strands(self, template: &Template) -> &[Strand] {
        template.polylines.as_ref().filter(|_| self == Mode::Embed).unwrap_or(&template.strands)
    }
}

/// How a scene is compiled.
#[derive(Clone, Debug, Default)]
pub struct SceneOptions {
    /// What is done with the templates' points.
    pub mode: Mode,
    /// Coordinates by which templates are mapped into faces.
    pub coordinates: Coordinates,
    /// Leave out faces whose stitch type the library lacks, instead of refusing the mesh.
    pub skip_unknown: bool,
    /// World units per template unit; without, those that the mesh was made to ([`StitchMesh::gauge`], unless there are other rest
    /// positions), else computed from the rest positions.
    pub gauge: Option<f64>,
    /// `[vertex]` rest positions, world units; the mesh's own where not given.
    pub rest: Option<Vec<DVec3>>,
}

/// The faces of one stitch type.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Index into [`Scene::stencils`].
    pub stencil: usize,
    /// `[i]` faces of the mesh, ascending.
    pub faces: Vec<FaceId>,
    /// `[i][corner]` vertices; corner 0 is the template's.
    pub corners: Vec<u32>,
    /// Slot of the first point of face 0 of the batch.
    pub first_slot: usize,
    /// First strand of face 0 of the batch.
    pub first_strand: usize,
    /// First knot of face 0 of the batch, in batch order.
    pub first_knot: usize,
    /// Number of faces in the batches before.
    pub first_face: usize,
}

/// Where a face's work is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FacePlace {
    /// Index into [`Scene::batches`], or `u32::MAX` for a face that is left out.
    pub batch: u32,
    /// Index within the batch.
    pub index: u32,
}

impl FacePlace {
    const SKIPPED: Self = Self { batch: u32::MAX, index: 0 };

    /// Whether the face is left out.
    pub fn skipped(self) -> bool {
        self.batch == u32::MAX
    }
}

/// Mesh and library, compiled.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The mode it was compiled for.
    pub mode: Mode,
    /// The coordinates it was compiled for.
    pub coordinates: Coordinates,
    /// World units per template unit.
    pub gauge: f64,
    /// Yarn radius, template units.
    pub yarn_radius: f64,
    /// Number of vertices that a frame must have.
    pub vertex_count: usize,
    /// One per stitch type in use.
    pub stencils: Vec<Stencil<f64>>,
    /// `[stencil]` the template it was compiled from.
    pub templates: Vec<Template>,
    /// One per stencil.
    pub batches: Vec<Batch>,
    /// `[face]`
    pub face_places: Vec<FacePlace>,
    /// `[stitch type of the mesh]` which corner of its faces is the template's corner 0.
    pub rotations: Vec<u32>,
    /// `[face + 1]` prefix sums of corner counts of all faces.
    pub face_offsets: Vec<u32>,
    /// Vertices of all faces.
    pub face_vertices: Vec<u32>,
    /// Corners joined into places of the fabric; none with Wachspress coordinates, where each face is
    /// on its own.
    pub corner_groups: Option<CornerGroups>,
    /// Total number of slots: points of all faces, a face's side by side.
    pub slot_count: usize,
    /// Total number of strands.
    pub strand_count: usize,
    /// Total number of knots.
    pub knot_count: usize,
    /// Number of faces that are not left out.
    pub face_count: usize,
    /// The chained yarns.
    pub yarns: Yarns,
    /// `[vertex]` rest positions, world units, if another mesh gave them.
    pub rest: Option<Vec<DVec3>>,
}

impl Scene {
    /// Compiles a mesh against a library.
    ///
    /// # Errors
    /// Stitch types that the library lacks, templates of different yarn radius, nothing left to do, rest
    /// positions of another count, a gauge that is not positive.
    pub fn compile(mesh: &StitchMesh, library: &TemplateLibrary, options: SceneOptions) -> Result<Self> {
        let found = find_templates(mesh, library);
        let known = |face: usize| found[mesh.face_types[face].index()];
        if !options.skip_unknown {
            refuse_unknown(mesh, library, |face| known(face).is_some())?;
        }

        // Batches in library order, so that they do not depend on the mesh's numbering of types.
        let mut by_template = BTreeMap::new();
        for face in 0..mesh.face_count() {
            if let Some((template, rotation)) = known(face) {
                by_template.entry(template).or_insert_with(Vec::new).push((FaceId::from(face), rotation));
            }
        }
        if by_template.is_empty() {
            return Err(Error::invalid(if mesh.face_count() == 0 {
                "the mesh has no faces: nothing to do"
            } else {
                "no face has a stitch type that the library knows: nothing to do"
            }));
        }

        let mut scene = Scene {
            mode: options.mode,
            coordinates: options.coordinates,
            gauge: 1.0,
            yarn_radius: 0.0,
            vertex_count: mesh.positions.len(),
            stencils: Vec::new(),
            templates: Vec::new(),
            batches: Vec::new(),
            face_places: vec![FacePlace::SKIPPED; mesh.face_count()],
            rotations: found.iter().map(|f| f.map_or(0, |(_, rotation)| rotation as u32)).collect(),
            face_offsets: mesh.face_offsets.clone(),
            face_vertices: mesh.face_vertices.iter().map(|v| v.0).collect(),
            corner_groups: (options.coordinates == Coordinates::MeanValue).then(|| CornerGroups::new(mesh)),
            slot_count: 0,
            strand_count: 0,
            knot_count: 0,
            face_count: 0,
            yarns: Yarns::default(),
            rest: options.rest,
        };
        for (id, faces) in by_template {
            scene.add_batch(mesh, library.get(id), faces)?;
        }
        scene.yarns = chain::chain(mesh, &scene);
        scene.set_gauge(mesh, options.gauge)?;
        Ok(scene)
    }

    fn add_batch(
        &mut self,
        mesh: &StitchMesh,
        template: &Template,
        faces: Vec<(FaceId, usize)>,
    ) -> Result<()> {
        if let Some(first) = self.templates.first().filter(|t| t.yarn_radius != template.yarn_radius) {
            return Err(Error::invalid(format_args!(
                "templates of different yarn radius: {} of '{}' and {} of '{}' (in course spacings); take the \
                 stitches of a mesh from one library",
                first.yarn_radius,
                first.key(),
                template.yarn_radius,
                template.key()
            )));
        }
        self.yarn_radius = template.yarn_radius;
        let stencil = Stencil::new(template, self.mode, self.coordinates);
        let n = stencil.corner_count;
        let mut corners = Vec::with_capacity(n * faces.len());
        for (i, (face, rotation)) in faces.iter().enumerate() {
            let vertices = mesh.face(*face);
            corners.extend((0..n).map(|c| vertices[(c + rotation) % n].0));
            self.face_places[face.index()] = FacePlace { batch: self.batches.len() as u32, index: i as u32 };
        }
        let batch = Batch {
            stencil: self.stencils.len(),
            faces: faces.into_iter().map(|(face, _)| face).collect(),
            corners,
            first_slot: self.slot_count,
            first_strand: self.strand_count,
            first_knot: self.knot_count,
            first_face: self.face_count,
        };
        let slots = self.slot_count + batch.faces.len() * stencil.points.len();
        if slots > (i32::MAX - 1) as usize {
            return Err(Error::invalid("more than 2,147,483,646 points: split the mesh"));
        }
        self.slot_count = slots;
        self.strand_count += batch.faces.len() * (stencil.strand_offsets.len() - 1);
        self.face_count += batch.faces.len();
        self.knot_count += batch.faces.len() * stencil.knot_count();
        self.batches.push(batch);
        self.stencils.push(stencil);
        self.templates.push(template.clone());
        Ok(())
    }

    /// g = sqrt(mean over the kept faces of |vector area at rest| / area of the template polygon).
    fn set_gauge(&mut self, mesh: &StitchMesh, given: Option<f64>) -> Result<()> {
        if let Some(rest) = self.rest.as_ref().filter(|r| r.len() != mesh.positions.len()) {
            return Err(Error::invalid(format_args!(
                "the rest mesh has {} vertices, expected {} as in the mesh",
                rest.len(),
                mesh.positions.len()
            )));
        }
        if let Some(gauge) = given {
            if !(1e-100..=1e100).contains(&gauge) {
                return Err(Error::invalid(format_args!("gauge {gauge:e}: expected a positive number")));
            }
            self.gauge = gauge;
            return Ok(());
        }
        if let (Some([width, _]), None) = (mesh.gauge, &self.rest) {
            self.gauge = width;
            return Ok(());
        }
        let rest = self.rest.as_deref().unwrap_or(&mesh.positions);
        // Measured against the mesh's extent first, so that no size of a mesh over- or underflows.
        let extent = rest.iter().map(|p| (*p - rest[0]).abs().max_element()).fold(0.0, f64::max);
        let (mut sum, mut count) = (0.0, 0usize);
        for batch in &self.batches {
            let area = polygon_area(&self.templates[batch.stencil].corners);
            for face in &batch.faces {
                let corners = mesh.face(*face);
                let scaled = |k: usize| (rest[corners[k].index()] - rest[corners[0].index()]) / extent;
                let vector_area: DVec3 =
                    (1..corners.len() - 1).map(|k| scaled(k).cross(scaled(k + 1)) * 0.5).sum();
                if vector_area.is_finite() {
                    sum += vector_area.length() / area;
                    count += 1;
                }
            }
        }
        let gauge = (sum / count.max(1) as f64).sqrt() * extent;
        if !(gauge > 0.0 && gauge.is_finite()) {
            return Err(Error::invalid(
                "the rest mesh's faces have no area, so its gauge is unknown: give one with --gauge",
            ));
        }
        self.gauge = gauge;
        Ok(())
    }

    /// The stencil of a kept face and the edge of its template that an edge of the face is.
    pub fn template_edge(&self, mesh: &StitchMesh, at: FaceEdge) -> Option<(usize, usize)> {
        let place = self.face_places[at.face.index()];
        if place.skipped() {
            return None;
        }
        let stencil = self.batches[place.batch as usize].stencil;
        let n = self.stencils[stencil].corner_count;
        let rotation = self.rotations[mesh.face_types[at.face.index()].index()] as usize;
        Some((stencil, (at.edge as usize + n - rotation) % n))
    }

    /// The slot of a face's crossing of the given rank on an edge: by fraction along it, then by z.
    pub fn crossing_slot(&self, mesh: &StitchMesh, at: FaceEdge, rank: u32) -> Option<u32> {
        let (_, first_slot) = self.face_stencil(at.face)?;
        let (stencil, edge) = self.template_edge(mesh, at)?;
        let template = &self.templates[stencil];
        let strands = self.mode.strands(template);
        let mut crossings: Vec<(f64, f64, usize)> = strands
            .iter()
            .flatten()
            .enumerate()
            .filter_map(|(i, p)| match p.place {
                Place::Boundary { edge: e, along } if e as usize == edge => Some((along, p.z, i)),
                _ => None,
            })
            .collect();
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        crossings.get(rank as usize).map(|(.., i)| (first_slot + i) as u32)
    }

    /// `[point]` the slots of control points: the owner's (of the face with the lower index) first, then
    /// [`NO_SECOND_SLOT`] or that of the other face. Made when first asked for.
    pub fn point_slots(&self) -> &[[u32; 2]] {
        self.yarns.slots.get_or_init(|| chain::point_slots(self))
    }

    /// Whether a face is left out for want of a template.
    pub fn skipped_faces(&self) -> usize {
        self.face_places.iter().filter(|p| p.skipped()).count()
    }

    /// The stencil of a face and its first slot, unless it is left out.
    pub fn face_stencil(&self, face: FaceId) -> Option<(&Stencil<f64>, usize)> {
        let place = self.face_places[face.index()];
        (!place.skipped()).then(|| {
            let batch = &self.batches[place.batch as usize];
            let stencil = &self.stencils[batch.stencil];
            (stencil, batch.first_slot + place.index as usize * stencil.points.len())
        })
    }

    /// The batch, index within it and point within the face of a slot.
    pub fn slot_place(&self, slot: u32) -> (&Batch, usize, usize) {
        let b = self.batches.partition_point(|b| b.first_slot <= slot as usize) - 1;
        // Batches of templates without points begin at the same slot as the next: the last one owns it.
        let batch = &self.batches[b];
        let points = self.stencils[batch.stencil].points.len();
        let local = slot as usize - batch.first_slot;
        (batch, local / points, local % points)
    }
}

/// `[stitch type]` of a mesh: its template and rotation. Where some are the given libraries' own, a stand-in with another
/// yarn radius does not count.
pub fn find_templates(mesh: &StitchMesh, library: &TemplateLibrary) -> Vec<Option<(TemplateId, usize)>> {
    let mut found: Vec<_> = mesh.types.iter().map(|t| library.find(t)).collect();
    let mut used = vec![false; found.len()];
    mesh.face_types.iter().for_each(|t| used[t.index()] = true);
    let own = found.iter().zip(&used).find_map(|(f, used)| {
        f.filter(|(id, _)| *used && !library.stands_in(*id)).map(|(id, _)| library.get(id).yarn_radius)
    });
    if let Some(radius) = own {
        for f in &mut found {
            *f = f.filter(|(id, _)| !library.stands_in(*id) || library.get(*id).yarn_radius == radius);
        }
    }
    found
}

/// An error that lists the stitch types without a template and how many faces use each.
fn refuse_unknown(mesh: &StitchMesh, library: &TemplateLibrary, known: impl Fn(usize) -> bool) -> Result<()> {
    let mut missing: BTreeMap<String, usize> = BTreeMap::new();
    let mut other_yarn = false;
    for face in (0..mesh.face_count()).filter(|f| !known(*f)) {
        other_yarn |= library.find(mesh.face_type(face.into())).is_some();
        *missing.entry(mesh.face_type(face.into()).key()).or_default() += 1;
    }
    if missing.is_empty() {
        return Ok(());
    }
    let list: Vec<String> = missing
        .iter()
        .map(|(key, faces)| format!("'{key}' ({faces} face{})", if *faces == 1 { "" } else { "s" }))
        .collect();
    Err(Error::invalid(format_args!(
        "the library lacks {} stitch type{}: {}; add them with --templates, rename them with --map, or leave \
         the faces out with --skip-unknown",
        list.len(),
        if list.len() == 1 { "" } else { "s" },
        list.join(", ") + if other_yarn { " (the built-in library's yarn is of another radius)" } else { "" }
    )))
}

/// Renames stitch types: `from` is a full key or a bare name, `to` likewise (a bare name keeps the labels).
///
/// # Errors
/// A full new key with another number of edges than the faces have; a rule that renames nothing.
pub fn rename_types(mesh: &mut StitchMesh, from: &str, to: &str) -> Result<()> {
    let from = from.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut words = to.split_whitespace().map(str::to_string);
    let name = words
        .next()
        .ok_or_else(|| Error::invalid(format_args!("--map '{from}=': expected a key after '='")))?;
    let labels: Vec<String> = words.collect();
    let mut hit = false;
    for stitch in &mut mesh.types {
        if stitch.key() != from && stitch.name != from {
            continue;
        }
        hit = true;
        if !labels.is_empty() && labels.len() != stitch.labels.len() {
            return Err(Error::invalid(format_args!(
                "--map '{}={to}': {} edges, expected {} as in the mesh",
                stitch.key(),
                labels.len(),
                stitch.labels.len()
            )));
        }
        let labels = if labels.is_empty() { stitch.labels.clone() } else { labels.clone() };
        *stitch = StitchType { name: name.clone(), labels };
    }
    if !hit {
        return Err(Error::invalid(format_args!(
            "--map '{from}={to}': the mesh has no stitch type '{from}'"
        )));
    }
    Ok(())
}
