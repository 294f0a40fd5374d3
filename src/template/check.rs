//! What a template must satisfy before anything is computed with it.

use super::{Place, Template};

/// Says what is wrong with a template, if anything: `(found, expected)`.
pub fn check(template: &Template) -> Result<(), (String, String)> {
    let fail = |found: String, expected: &str| Err((found, expected.to_string()));
    let n = template.corners.len();
    if n < 3 || template.labels.len() != n {
        return fail(
            format!("{} edges and {n} corners", template.labels.len()),
            "as many edges as corners, at least 3",
        );
    }
    if !template.corners.iter().all(|c| c.is_finite() && c.abs().max_element() < 1e6) {
        return fail("a corner out of range".into(), "finite corners in template units");
    }
    if polygon_area(&template.corners) <= 0.0 {
        return fail("corners in clockwise order or in a line".into(), "corners counter-clockwise");
    }
    let r = template.yarn_radius;
    if !(r > 0.0 && r < 1e3) {
        return fail(format!("yarn radius {r}"), "a positive number, in template units");
    }
    for (k, knot) in template.knots.iter().enumerate() {
        let near = knot.center.is_finite() && knot.center.abs().max_element() < 1e6;
        let turn = knot.direction.length() - 1.0;
        if !near || !(-1e-9..1e-9).contains(&turn) {
            return fail(format!("a centre or tilt of knot {k} out of range"), "finite numbers");
        }
        if !(knot.half_length >= 0.5 * r && knot.half_length < 1e3) {
            return fail(
                format!("half-length {} of knot {k}", knot.half_length),
                "at least half the yarn radius",
            );
        }
    }
    for (s, strand) in template.strands.iter().enumerate() {
        if strand.len() < 2 {
            return fail(format!("yarn {s} with fewer than 2 points"), "2 points or more");
        }
        for (i, point) in strand.iter().enumerate() {
            let place = format!("point {i} of yarn {s}");
            if !(-1e3..1e3).contains(&point.z) {
                return fail(format!("z {} at {place}", point.z), "a finite number");
            }
            match point.place {
                Place::Boundary { edge, along } => {
                    if edge as usize >= n || !(along > 0.0 && along < 1.0) {
                        return fail(
                            format!("edge {edge}, fraction {along} at {place}"),
                            "an edge counted from 0 and a fraction from 0 to 1",
                        );
                    }
                    if i != 0 && i + 1 != strand.len() {
                        return fail(format!("a boundary point inside, {place}"), "boundary points at ends");
                    }
                }
                Place::Contact { knot, .. } | Place::Control { knot, .. } => {
                    if knot as usize >= template.knots.len() {
                        return fail(format!("knot {knot} at {place}"), "a knot counted from 0");
                    }
                }
                Place::Free { at } => {
                    if !(at.is_finite() && at.abs().max_element() < 1e6) {
                        return fail(format!("a coordinate out of range at {place}"), "finite numbers");
                    }
                }
            }
        }
    }
    Ok(())
}

/// Signed area of a polygon, positive when counter-clockwise.
pub fn polygon_area(corners: &[glam::DVec2]) -> f64 {
    0.5 * corners.iter().zip(corners.iter().cycle().skip(1)).map(|(a, b)| a.perp_dot(*b)).sum::<f64>()
}
