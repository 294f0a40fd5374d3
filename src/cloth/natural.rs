//! Natural sizes: how wide and how high each face wants to be.
//!
//! A template says how a stitch type differs from a plain knit; [`Sizes`] says how large that is; [`Factors`] say how fronts
//! (knit) and backs (purl) of loops side by side draw each other in, which is what makes ribs narrow and garter short.

use crate::mesh::StitchMesh;
use crate::template::check::polygon_area;
use crate::template::{Template, TemplateLibrary};
use crate::{Error, Result};
use glam::{DVec2, DVec3};

/// Natural size of a plain knit face, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Its width: the spacing of wales.
    pub course: f64,
    /// Its height: the spacing of courses.
    pub wale: f64,
}

impl Sizes {
    /// The size at a gauge of so many stitches and rows per 10 cm.
    pub fn of_gauge(stitches: f64, rows: f64) -> Self {
        Self { course: 0.1 / stitches, wale: 0.1 / rows }
    }
}

/// How the neighbours of a stitch change its natural size: `[h][v]`, where h of its two neighbours along the course and v of its
/// two along the wale show the other side of a loop (a knit beside or above a purl).
///
/// Defaults, relaxed, against stockinette of the same yarn and needles; a measured gauge overrides them (`--sizes`). No table of
/// measurements is public that covers them:
///
/// | fabric | h | v | width | height | from |
/// |---|---|---|---|---|---|
/// | stockinette | 0 | 0 | 1 | 1 | by definition |
/// | 1x1 rib | 2 | 0 | 0.70 | 1 | can be stretched to 1.96 times its width, a 2x2 rib to 2.23 times (swatches of several yarns): if to 1.4 times that of stockinette, 0.71 and 0.63; rows stay |
/// | 2x2 rib | 1 | 0 | 0.62 | 1 | the same; of 40 stitches each, swatches get narrower from 1x1 to 4x4 |
/// | garter | 0 | 2 | 1.05 | 0.70 | two rows are as high as a stitch is wide (1 : 2); stockinette is 5 : 7, so 5 / 7 |
/// | seed (moss) | 2 | 2 | 0.95 | 0.80 | between rib and garter |
///
/// The others lie between their neighbours in the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    /// Of the width.
    pub width: [[f64; 3]; 3],
    /// Of the height.
    pub height: [[f64; 3]; 3],
}

/// Width of a stitch in 1x1 rib.
const RIB_1X1: f64 = 0.70;
/// Width of a stitch in 2x2 rib.
const RIB_2X2: f64 = 0.62;
/// Width of a stitch in garter.
const GARTER_WIDTH: f64 = 1.05;
/// Height of a row of garter.
const GARTER_HEIGHT: f64 = 0.70;
/// Width of a stitch in seed stitch.
const SEED_WIDTH: f64 = 0.95;
/// Height of a row of seed stitch.
const SEED_HEIGHT: f64 = 0.80;

impl Default for Factors {
    fn default() -> Self {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        Self {
            width: [
                [1.0, mean(1.0, GARTER_WIDTH), GARTER_WIDTH],
                [RIB_2X2, mean(RIB_2X2, SEED_WIDTH), SEED_WIDTH],
                [RIB_1X1, mean(RIB_1X1, SEED_WIDTH), SEED_WIDTH],
            ],
            height: [
                [1.0, mean(1.0, GARTER_HEIGHT), GARTER_HEIGHT],
                [1.0, mean(1.0, mean(GARTER_HEIGHT, SEED_HEIGHT)), mean(GARTER_HEIGHT, SEED_HEIGHT)],
                [1.0, mean(1.0, SEED_HEIGHT), SEED_HEIGHT],
            ],
        }
    }
}

/// Which side of its loop a stitch shows on the front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Front {
    /// The front: knits, and decreases, increases and the like made with knits.
    Knit,
    /// The back.
    Purl,
    /// Neither: borders, cast-on, slipped and tucked stitches, weaves. They follow their neighbours.
    Neutral,
}

impl Front {
    /// What a stitch of that name shows.
    pub fn of_name(name: &str) -> Self {
        if name.starts_with("purl") {
            Self::Purl
        } else if ["knit", "decrease", "make-", "bind-off"].iter().any(|start| name.starts_with(start)) {
            Self::Knit
        } else {
            Self::Neutral
        }
    }

    /// Whether two stitches side by side draw each other in.
    pub fn differs(self, other: Self) -> bool {
        matches!((self, other), (Self::Knit, Self::Purl) | (Self::Purl, Self::Knit))
    }
}

/// The direction of an edge in the fabric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Along {
    Course,
    Wale,
    /// A border that runs askew: it follows both.
    Askew,
}

/// A stitch type's shape at the natural size of plain fabric.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    /// Corners in the order of the mesh's faces, m.
    pub corners: Vec<DVec2>,
    /// `[edge]`
    pub along: Vec<Along>,
    /// `[edge]` length, m.
    pub lengths: Vec<f64>,
    /// m2
    pub area: f64,
    pub front: Front,
}

/// Corners of a template, the first that of the mesh's faces, and edge directions; template units.
struct Outline {
    corners: Vec<DVec2>,
    along: Vec<Along>,
}

/// The shapes of a mesh's stitch types, and the size of a plain face: as given, or as measured on the mesh.
pub(crate) fn shapes(
    mesh: &StitchMesh,
    library: &TemplateLibrary,
    sizes: Option<Sizes>,
) -> Result<(Vec<Shape>, Sizes)> {
    let found: Vec<Option<(&Template, usize)>> =
        mesh.types.iter().map(|t| library.find(t).map(|(id, k)| (library.get(id), k))).collect();
    let cell = found.iter().flatten().find_map(|(t, _)| rectangle(&t.corners)).unwrap_or(PLAIN);
    let outlines: Vec<Outline> =
        mesh.types.iter().zip(&found).map(|(stitch, found)| outline(&stitch.labels, *found, cell)).collect();
    let made_to = mesh.gauge.map(|[course, wale]| Sizes { course, wale });
    let sizes = match sizes.or(made_to) {
        Some(sizes) => sizes,
        None => {
            let unit = measured_unit(mesh, &outlines)?;
            Sizes { course: unit * cell.x, wale: unit * cell.y }
        }
    };
    let scale = DVec2::new(sizes.course, sizes.wale) / cell;
    let shapes = mesh.types.iter().zip(outlines).map(|(stitch, outline)| {
        let n = outline.corners.len();
        let lengths = (0..n).map(|k| {
            let edge = outline.corners[(k + 1) % n] - outline.corners[k];
            match outline.along[k] {
                // A slanting edge of a decrease is as long as a stitch is wide, however high stitches are.
                Along::Course => edge.length() * scale.x,
                Along::Wale => edge.length() * scale.y,
                Along::Askew => (edge * scale).length(),
            }
        });
        let lengths = lengths.collect();
        let corners: Vec<DVec2> = outline.corners.iter().map(|c| *c * scale).collect();
        Shape {
            area: polygon_area(&corners).abs(),
            corners,
            along: outline.along,
            lengths,
            front: Front::of_name(&stitch.name),
        }
    });
    Ok((shapes.collect(), sizes))
}

/// A plain face of the embedded library, template units.
const PLAIN: DVec2 = DVec2::new(1.0, 0.61);

/// The size of a template that is an upright rectangle.
fn rectangle(corners: &[DVec2]) -> Option<DVec2> {
    let [a, b, c, d] = corners else { return None };
    let size = *c - *a;
    let near = |p: DVec2, q: DVec2| p.distance(q) < 1e-6 * size.length();
    let upright = near(*b, DVec2::new(c.x, a.y)) && near(*d, DVec2::new(a.x, c.y));
    (upright && size.min_element() > 0.0).then_some(size)
}

fn outline(labels: &[String], found: Option<(&Template, usize)>, cell: DVec2) -> Outline {
    let n = labels.len();
    let corners: Vec<DVec2> = match found {
        Some((template, rotation)) => (0..n).map(|k| template.corners[(k + n - rotation) % n]).collect(),
        None => {
            // A plain face, or a polygon whose edges are as long as plain ones are on average.
            let radius = 0.25 * (cell.x + cell.y) / (std::f64::consts::PI / n as f64).sin();
            let corner = |k: usize| {
                let turn = (k as f64 - 0.5 * (n as f64 - 1.0)) * std::f64::consts::TAU / n as f64;
                radius * DVec2::new(turn.sin(), -turn.cos())
            };
            let plain = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|p| DVec2::from(p) * cell);
            if n == 4 { plain.to_vec() } else { (0..n).map(corner).collect() }
        }
    };
    let along = (0..n).map(|k| {
        let label = labels[k].trim_start_matches(['+', '-']);
        let edge = (corners[(k + 1) % n] - corners[k]).abs();
        match label.chars().next() {
            Some('l') => Along::Course,
            Some('y' | 'c') => Along::Wale,
            // What has no direction of its own has that of its template.
            _ if edge.y < 0.2 * edge.x => Along::Course,
            _ if edge.x < 0.2 * edge.y => Along::Wale,
            _ => Along::Askew,
        }
    });
    Outline { along: along.collect(), corners }
}

/// Metres per template unit: the root of the mesh's area over that of its templates.
fn measured_unit(mesh: &StitchMesh, outlines: &[Outline]) -> Result<f64> {
    let (mut space, mut plane) = (0.0, 0.0);
    for face in 0..mesh.face_count() {
        let corners = mesh.face(face.into());
        let first = mesh.positions[corners[0].index()];
        let at = |k: usize| mesh.positions[corners[k].index()] - first;
        space += (2..corners.len()).map(|k| at(k - 1).cross(at(k))).sum::<DVec3>().length() / 2.0;
        plane += polygon_area(&outlines[mesh.face_types[face].index()].corners).abs();
    }
    let unit = f64::sqrt(space / plane);
    if unit.is_finite() && unit > 0.0 {
        Ok(unit)
    } else {
        Err(Error::invalid(
            "the mesh's faces have no area, so the size of a stitch is unknown: expected a gauge, stitches and rows per 10 cm",
        ))
    }
}

/// What lies beyond the edges of faces.
pub(crate) struct Neighbours {
    /// `[face + 1]` edges of face f are `offsets[f] ..`
    pub offsets: Vec<u32>,
    /// `[edge of a face]` the face beyond, or `u32::MAX`.
    pub beyond: Vec<u32>,
}

/// `[face]` factors of width and height.
///
/// Of faces that show neither side, the mean of their neighbours', spread from face to face.
pub(crate) fn face_factors(
    mesh: &StitchMesh,
    shapes: &[Shape],
    neighbours: &Neighbours,
    factors: &Factors,
    own: &[DVec2],
) -> Vec<DVec2> {
    let faces = mesh.face_count();
    let shape = |face: usize| &shapes[mesh.face_types[face].index()];
    let beyond = |face: usize| {
        let edges = neighbours.offsets[face] as usize..neighbours.offsets[face + 1] as usize;
        neighbours.beyond[edges]
            .iter()
            .enumerate()
            .filter(|(_, f)| **f != u32::MAX)
            .map(|(k, f)| (k, *f as usize))
    };
    let mut known: Vec<Option<DVec2>> = (0..faces)
        .map(|face| {
            let here = shape(face);
            if here.front == Front::Neutral {
                return None;
            }
            let (mut h, mut v) = (0, 0);
            for (edge, other) in beyond(face) {
                if here.front.differs(shape(other).front) {
                    match here.along[edge] {
                        Along::Wale => h += 1,
                        _ => v += 1,
                    }
                }
            }
            let (h, v) = (h.min(2), v.min(2));
            Some(DVec2::new(factors.width[h][v], factors.height[h][v]))
        })
        .collect();
    let mut open: Vec<usize> = (0..faces).filter(|f| known[*f].is_none()).collect();
    let mut news = Vec::new();
    while !open.is_empty() {
        news.clear();
        for face in &open {
            let around: Vec<DVec2> = beyond(*face).filter_map(|(_, other)| known[other]).collect();
            if !around.is_empty() {
                news.push((*face, around.iter().sum::<DVec2>() / around.len() as f64));
            }
        }
        if news.is_empty() {
            break;
        }
        for (face, mean) in &news {
            known[*face] = Some(*mean);
        }
        open.retain(|f| known[*f].is_none());
    }
    let of_type = |face: usize| own[mesh.face_types[face].index()];
    known.iter().enumerate().map(|(face, k)| k.unwrap_or(DVec2::ONE) * of_type(face)).collect()
}
