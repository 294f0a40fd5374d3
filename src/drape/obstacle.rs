//! Colliders at work: nodes are pushed out to the collider's thickness and dragged along by Coulomb friction.
//!
//! Everything is done in the collider's own frame, where it does not move: a node's way in a substep is its way relative to the
//! collider. Normal correction and friction are those of Macklin et al. 2014, *Unified Particle Physics for Real-Time
//! Applications*, section 6.1: a tangential way up to mu_s times the normal correction is taken back, of a longer one mu_k times
//! the normal correction. For a node at rest the normal correction of a substep is g dt^2, so this is Coulomb's law exactly.
//!
//! Nothing tunnels: spheres and capsules are swept (a way longer than a quarter of the radius is cut where it enters), meshes are
//! if the way is longer than the thickness, a plane is a half-space. A mesh that deforms stops nodes only as fast as half its
//! own depth a substep.

use super::motion::{Motion, Pose, pose_of};
use super::scene::{Collider, Friction, Shape};
use super::solid::{SolidState, Touch};
use glam::DVec3;

/// Speed at which nodes that began a substep inside are let out, m/s. At once would be a shot.
pub const RECOVERY: f64 = 0.25;

/// A collider and where it is.
#[derive(Clone, Debug)]
pub struct Obstacle {
    body: Body,
    motions: Vec<Motion>,
    friction: Friction,
    thickness: f64,
    /// What motions turn about if they name no centre.
    center: DVec3,
    before: Pose,
    now: Pose,
    /// World extents of both poses, the thickness included; infinite for planes.
    extents: [DVec3; 2],
}

/// A shape, ready for distances.
#[derive(Clone, Debug)]
enum Body {
    Plane { point: DVec3, normal: DVec3 },
    Capsule { from: DVec3, to: DVec3, radius: f64 },
    Mesh(Box<SolidState>),
}

/// What is known of a node near a mesh: no contact until it has moved further than `slack`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Near {
    at: DVec3,
    slack: f64,
    travelled: f64,
    triangle: u32,
}

/// What became of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// Whether it was touched.
    pub touched: bool,
    /// How deep inside the thickness it is still, metres.
    pub deep: f64,
}

/// A collider near a node.
#[derive(Clone, Copy, Debug)]
pub struct Felt {
    /// How far it is from where the node may be, metres; negative inside.
    pub gap: f64,
    /// Away from it, of length 1.
    pub normal: DVec3,
    /// The node's way along it, metres.
    pub way: DVec3,
}

impl Obstacle {
    /// The collider at time 0; `thickness` is for those that name none.
    pub fn new(collider: &Collider, thickness: f64) -> Self {
        let (body, center) = match &collider.shape {
            Shape::Plane { point, normal } => {
                (Body::Plane { point: *point, normal: normal.normalize_or(DVec3::Y) }, *point)
            }
            Shape::Sphere { center, radius } => {
                (Body::Capsule { from: *center, to: *center, radius: *radius }, *center)
            }
            Shape::Capsule { from, to, radius } => {
                (Body::Capsule { from: *from, to: *to, radius: *radius }, (*from + *to) * 0.5)
            }
            Shape::Mesh(solid) => {
                let state = SolidState::new(solid.clone());
                let [low, high] = state.extents();
                (Body::Mesh(Box::new(state)), (low + high) * 0.5)
            }
        };
        let mut obstacle = Self {
            body,
            motions: collider.motions.clone(),
            friction: collider.friction,
            thickness: collider.thickness.unwrap_or(thickness),
            center,
            before: Pose::IDENTITY,
            now: Pose::IDENTITY,
            extents: [DVec3::NEG_INFINITY, DVec3::INFINITY],
        };
        obstacle.set_times(0.0, 0.0);
        obstacle
    }

    /// Moves it to where it is at two times, seconds: the start and the end of a substep.
    pub fn set_times(&mut self, before: f64, now: f64) {
        self.before = pose_of(&self.motions, before, self.center);
        self.now = pose_of(&self.motions, now, self.center);
        if let Body::Mesh(solid) = &mut self.body {
            solid.set_times(before, now);
        }
        self.extents = self.extents_of(&[self.before, self.now]);
    }

    fn extents_of(&self, poses: &[Pose]) -> [DVec3; 2] {
        let (low, high, more) = match &self.body {
            Body::Plane { .. } => return [DVec3::NEG_INFINITY, DVec3::INFINITY],
            Body::Capsule { from, to, radius } => (from.min(*to), from.max(*to), *radius),
            Body::Mesh(solid) => {
                let [low, high] = solid.extents();
                (low, high, 0.0)
            }
        };
        let mut extents = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for pose in poses {
            for corner in 0..8 {
                let pick = |k: usize| if corner >> k & 1 == 0 { low[k] } else { high[k] };
                let p = pose.apply(DVec3::new(pick(0), pick(1), pick(2)));
                extents = [extents[0].min(p), extents[1].max(p)];
            }
        }
        let more = DVec3::splat(more + self.thickness);
        [extents[0] - more, extents[1] + more]
    }

    /// World extents at a time, thickness included.
    pub fn extents_at(&self, time: f64) -> [DVec3; 2] {
        self.extents_of(&[pose_of(&self.motions, time, self.center)])
    }

    /// How near nodes come, metres.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Distance of a world point from its surface now, metres, negative inside.
    pub fn distance(&self, point: DVec3) -> f64 {
        let q = self.now.undo_rigid(point);
        self.body.touch(q, f64::INFINITY, u32::MAX).map_or(f64::INFINITY, |t| t.distance)
    }

    /// Friction on it.
    pub fn friction(&self) -> &Friction {
        &self.friction
    }

    /// What a node that goes from `previous` to `position` (world) feels of it, if it is within `reach` of where it may be.
    pub fn feel(
        &self,
        (previous, position): (DVec3, DVec3),
        dt: f64,
        reach: f64,
        near: &mut Near,
    ) -> Option<Felt> {
        let more = DVec3::splat(reach);
        if !((position - more).cmple(self.extents[1]).all() && (position + more).cmpge(self.extents[0]).all())
        {
            return None;
        }
        let (start, q) = (self.before.undo_rigid(previous), self.now.undo_rigid(position));
        if let Body::Mesh(solid) = &self.body {
            let travelled = solid.travelled() - near.travelled;
            if near.slack > reach + q.distance(near.at) + start.distance(near.at) + travelled {
                return None;
            }
        }
        let touch = self.body.touch(q, self.thickness + reach, near.triangle)?;
        let mut least = self.thickness;
        if touch.distance < self.thickness - 1e-12 {
            let first = self.body.touch(start + touch.slide, f64::INFINITY, touch.triangle);
            let began = first.map_or(self.thickness, |t| t.distance);
            least = least.min(began + RECOVERY * dt);
        }
        let way = q - start - touch.slide;
        Some(Felt {
            gap: touch.distance - least,
            normal: self.now.linear * touch.normal,
            way: self.now.linear * (way - touch.normal * way.dot(touch.normal)),
        })
    }

    /// Pushes a node out that went from `previous` to `position` (world) in a substep of `dt` seconds.
    pub fn push(&self, previous: DVec3, position: &mut DVec3, dt: f64, near: &mut Near) -> Contact {
        let (low, high) = (previous.min(*position), previous.max(*position));
        // Written so that positions that are not finite are left alone.
        if !(low.cmple(self.extents[1]).all() && high.cmpge(self.extents[0]).all()) {
            return Contact::default();
        }
        let start = self.before.undo_rigid(previous);
        let free = self.now.undo_rigid(*position);
        let travelled = match &self.body {
            Body::Mesh(solid) => solid.travelled(),
            _ => 0.0,
        };
        if near.slack > free.distance(near.at) + start.distance(near.at) + (travelled - near.travelled) {
            return Contact::default();
        }
        let mut q = free;
        let mut normal = DVec3::ZERO;
        let mut depth = 0.0;
        if let Some((point, n)) = self.body.sweep(start, free, self.thickness) {
            let below = (point - q).dot(n);
            if below > 0.0 {
                q += n * below;
                depth = below;
                normal = n;
            }
        }
        let reach = match &self.body {
            // How far nodes around are from contact is worth knowing.
            Body::Mesh(_) => f64::INFINITY,
            _ => self.thickness,
        };
        let mut contact = Contact::default();
        let mut slide = DVec3::ZERO;
        if let Some(touch) = self.body.touch(q, reach, near.triangle) {
            *near =
                Near { at: q, slack: touch.distance - self.thickness, travelled, triangle: touch.triangle };
            // A node that was put on the surface lies on it but for rounding.
            if touch.distance < self.thickness - 1e-12 {
                let first = self.body.touch(start + touch.slide, f64::INFINITY, touch.triangle);
                let began = first.map_or(self.thickness, |t| t.distance).min(self.thickness);
                // One that began outside ends outside.
                let target = if began >= self.thickness {
                    self.thickness
                } else {
                    self.thickness.min(began + RECOVERY * dt)
                };
                let out = f64::max(target - touch.distance, 0.0);
                contact = Contact { touched: true, deep: self.thickness - touch.distance - out };
                q += touch.normal * out;
                depth += out;
                normal = touch.normal;
                slide = touch.slide;
                near.slack = 0.0;
            }
        }
        if depth <= 0.0 {
            return contact;
        }
        contact.touched = true;
        let way = free - start - slide;
        let tangential = way - normal * way.dot(normal);
        q -= tangential * self.friction.taken_back(tangential.length(), depth);
        *position = self.now.apply(q);
        contact
    }
}

impl Friction {
    /// The force of a collider on a node on which `force` acts; a displacement into it meets `stiffness`, one along it
    /// `inertia`, N/m.
    pub fn answer(&self, force: DVec3, felt: &Felt, (stiffness, inertia): (f64, f64)) -> DVec3 {
        let into = -force.dot(felt.normal);
        let normal = into - stiffness * felt.gap.max(0.0);
        // What is no number is left alone.
        if normal.is_nan() || normal <= 0.0 {
            return DVec3::ZERO;
        }
        let along = force + felt.normal * into + felt.way * inertia;
        let drive = along.length();
        let held = if drive <= self.fixed * normal { 1.0 } else { self.sliding * normal / drive };
        felt.normal * normal - along * held
    }

    /// The share of a tangential way that friction takes back under a normal correction, both in metres.
    pub fn taken_back(&self, way: f64, depth: f64) -> f64 {
        if way <= self.fixed * depth { 1.0 } else { (self.sliding * depth / way).min(1.0) }
    }
}

impl Body {
    fn touch(&self, q: DVec3, within: f64, first: u32) -> Option<Touch> {
        let touch = |distance, normal| Touch { distance, normal, slide: DVec3::ZERO, triangle: u32::MAX };
        let touch = match self {
            Body::Plane { point, normal } => touch((q - *point).dot(*normal), *normal),
            Body::Capsule { from, to, radius } => {
                let away = q - nearest_on(*from, *to, q);
                let length = away.length();
                let aside = || (*to - *from).any_orthogonal_vector().normalize_or(DVec3::Y);
                touch(length - radius, if length > 1e-12 { away / length } else { aside() })
            }
            Body::Mesh(solid) => return solid.touch(q, within, first),
        };
        (touch.distance <= within).then_some(touch)
    }

    /// Where a long way first meets the thickened surface: a point of the tangent plane, and its normal.
    fn sweep(&self, from: DVec3, to: DVec3, thickness: f64) -> Option<(DVec3, DVec3)> {
        let way = to - from;
        match self {
            Body::Plane { .. } => None,
            Body::Capsule { from: a, to: b, radius } => {
                let radius = radius + thickness;
                if way.length_squared() < radius * radius / 16.0 {
                    return None;
                }
                let s = enters_capsule(from, way, *a, *b, radius)?;
                let point = from + way * s;
                let normal = (point - nearest_on(*a, *b, point)).normalize_or_zero();
                (normal != DVec3::ZERO).then_some((point, normal))
            }
            Body::Mesh(solid) => {
                if way.length_squared() <= thickness * thickness {
                    return None;
                }
                let (point, normal) = solid.enters(from, to)?;
                Some((point + normal * thickness, normal))
            }
        }
    }
}

/// The point of a segment that is nearest to p.
fn nearest_on(a: DVec3, b: DVec3, p: DVec3) -> DVec3 {
    let along = b - a;
    let squared = along.length_squared();
    if squared > 0.0 { a + along * ((p - a).dot(along) / squared).clamp(0.0, 1.0) } else { a }
}

/// How far along a way, 0 to 1, a point enters a capsule (a sphere if both ends are one) from outside.
fn enters_capsule(from: DVec3, way: DVec3, a: DVec3, b: DVec3, radius: f64) -> Option<f64> {
    let sphere = |center: DVec3| {
        let away = from - center;
        let (half, rest) = (away.dot(way), away.length_squared() - radius * radius);
        let squared = way.length_squared();
        let root = half * half - squared * rest;
        (rest > 0.0 && half < 0.0 && root >= 0.0).then(|| (-half - root.sqrt()) / squared)
    };
    if nearest_on(a, b, from).distance_squared(from) <= radius * radius {
        return None;
    }
    let mut best = [sphere(a), sphere(b)].into_iter().flatten().fold(f64::INFINITY, f64::min);
    let axis = b - a;
    let length = axis.length();
    if length > 0.0 {
        let axis = axis / length;
        let away = from - a;
        let (flat_way, flat_away) = (way - axis * way.dot(axis), away - axis * away.dot(axis));
        let squared = flat_way.length_squared();
        let (half, rest) = (flat_away.dot(flat_way), flat_away.length_squared() - radius * radius);
        let root = half * half - squared * rest;
        if squared > 0.0 && rest > 0.0 && half < 0.0 && root >= 0.0 {
            let s = (-half - root.sqrt()) / squared;
            let height = (away + way * s).dot(axis);
            if (0.0..=length).contains(&height) {
                best = best.min(s);
            }
        }
    }
    (best <= 1.0).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn obstacle(shape: Shape) -> Obstacle {
        let friction = Friction { fixed: 0.0, sliding: 0.0 };
        let collider =
            Collider { shape, motions: Vec::new(), friction, thickness: Some(0.01), name: String::new() };
        Obstacle::new(&collider, 0.0)
    }

    #[test]
    fn fast_nodes_do_not_pass_thin_things() {
        // Seen red without the sweep: the node ends on the far side.
        let (a, b) = (DVec3::new(-1.0, 0.0, 0.0), DVec3::new(1.0, 0.0, 0.0));
        for shape in [
            Shape::Sphere { center: DVec3::ZERO, radius: 0.05 },
            Shape::Capsule { from: a, to: b, radius: 0.05 },
        ] {
            let obstacle = obstacle(shape);
            let (previous, mut position) = (DVec3::new(1e-3, 1.0, 1e-3), DVec3::new(1e-3, -1.0, 1e-3));
            let contact = obstacle.push(previous, &mut position, 1e-3, &mut Near::default());
            assert!(contact.touched && position.y > 0.0, "{position}");
            assert!(obstacle.distance(position) >= 0.01 - 1e-12);
        }
    }

    #[test]
    fn what_begins_inside_is_let_out_slowly() {
        let obstacle = obstacle(Shape::Sphere { center: DVec3::ZERO, radius: 1.0 });
        let previous = DVec3::X * 0.9;
        let mut position = previous;
        let contact = obstacle.push(previous, &mut position, 1e-2, &mut Near::default());
        assert!((position.x - 0.9 - RECOVERY * 1e-2).abs() < 1e-12, "{position}");
        assert!((contact.deep - (0.11 - RECOVERY * 1e-2)).abs() < 1e-12);
    }

    #[test]
    fn entries_into_capsules() {
        let (a, b) = (DVec3::ZERO, DVec3::X * 2.0);
        for (from, way, expected) in [
            (DVec3::new(1.0, 3.0, 0.0), DVec3::Y * -4.0, Some(0.5)),
            (DVec3::new(-3.0, 0.0, 0.0), DVec3::X * 4.0, Some(0.5)),
            (DVec3::new(5.0, 0.0, 0.0), DVec3::X * -8.0, Some(0.25)),
            (DVec3::new(1.0, 3.0, 0.0), DVec3::Y * -1.0, None),
            (DVec3::new(1.0, 3.0, 0.0), DVec3::Y * 4.0, None),
            (DVec3::new(1.0, 0.5, 0.0), DVec3::Y * 4.0, None),
            (DVec3::new(1.0, 3.0, 1.5), DVec3::Y * -4.0, None),
        ] {
            let s = enters_capsule(from, way, a, b, 1.0);
            assert_eq!(s.is_some(), expected.is_some(), "{from} {way}");
            assert!(s.zip(expected).is_none_or(|(a, b)| (a - b).abs() < 1e-12), "{s:?}");
        }
    }
}
