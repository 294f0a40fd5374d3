//! The operations by which one knot-form template derives from another.

use super::derive::{
    Operation, mirror_x_corner, mirror_x_edge, mirror_x_labels, mirror_x_run, reverse_yarn_labels,
};
use super::{Place, Strand, Template};
use glam::DVec2;

/// Applies one operation. `None` where all edges are of one kind and a mirror has no first run to keep.
pub fn apply(template: &Template, operation: Operation) -> Option<Template> {
    let mut new = template.clone();
    match operation {
        Operation::MirrorX => {
            let n = template.labels.len();
            let run = mirror_x_run(&template.labels)?;
            new.labels = mirror_x_labels(&template.labels, run);
            new.corners = (0..n).map(|i| flip(template.corners[mirror_x_corner(i, run, n)])).collect();
            for knot in &mut new.knots {
                knot.center = flip(knot.center);
                // tilt -> pi - tilt: contacts keep their signs, controls change sides.
                knot.direction = flip(knot.direction);
            }
            each_point(&mut new, |place| match place {
                Place::Boundary { edge, along } => {
                    Place::Boundary { edge: mirror_x_edge(edge as usize, run, n) as u32, along: 1.0 - along }
                }
                Place::Contact { .. } => place,
                Place::Control { knot, sign } => Place::Control { knot, sign: -sign },
                Place::Free { at } => Place::Free { at: flip(at) },
            });
        }
        Operation::MirrorZ => {
            for strand in all_strands(&mut new) {
                for point in strand {
                    point.z = -point.z;
                }
            }
        }
        Operation::ReverseYarn => new.labels = reverse_yarn_labels(&template.labels),
    }
    Some(new)
}

fn flip(p: DVec2) -> DVec2 {
    DVec2::new(-p.x, p.y)
}

fn all_strands(template: &mut Template) -> impl Iterator<Item = &mut Strand> {
    template.strands.iter_mut().chain(template.polylines.iter_mut().flatten())
}

fn each_point(template: &mut Template, map: impl Fn(Place) -> Place) {
    for strand in all_strands(template) {
        for point in strand {
            point.place = map(point.place);
        }
    }
}
