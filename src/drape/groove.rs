//! Nodes between several colliders, where pushes in turns end in sight of the way out but not out.

use super::obstacle::{Near, Obstacle};
use glam::DVec3;

/// Newton's steps.
const STEPS: usize = 12;
/// Turns over the colliders in one.
const TURNS: usize = 200;
/// Colliders that a node may be between.
const MOST: usize = 8;

/// Moves a node that goes from `previous` to `position` the least way by which it leaves all colliders, each taken as the plane
/// that it has before it; how deep it still is, which is more than rounding only where colliders leave no room.
pub fn leave(
    obstacles: &[Obstacle],
    (previous, position): (DVec3, &mut DVec3),
    dt: f64,
    near: &mut [Near],
) -> f64 {
    let start = *position;
    let mut best = (f64::INFINITY, start);
    let mut reach = 1e-6;
    for _ in 0..STEPS {
        let mut planes = [(DVec3::ZERO, 0.0, 0.0); MOST];
        let (mut count, mut deep) = (0, 0.0);
        for (obstacle, near) in obstacles.iter().zip(near.iter_mut()) {
            if let Some(felt) = obstacle.feel((previous, *position), dt, reach, near) {
                deep = f64::max(deep, -felt.gap);
                if count < MOST {
                    planes[count] = (felt.normal, felt.gap, 0.0);
                    count += 1;
                }
            }
        }
        if deep < best.0 {
            best = (deep, *position);
        }
        if deep <= 1e-13 {
            break;
        }
        // The least way that leaves all planes, by its dual (Hildreth 1957).
        let planes = &mut planes[..count];
        let mut way = DVec3::ZERO;
        for _ in 0..TURNS {
            let mut most = 0.0;
            for (normal, gap, push) in planes.iter_mut() {
                let change = f64::max(-(*gap + way.dot(*normal)), -*push);
                *push += change;
                way += *normal * change;
                most = f64::max(most, change.abs());
            }
            if most <= 1e-14 {
                break;
            }
        }
        // On curved ones, others may come near.
        reach = f64::max(reach, 2.0 * way.length());
        *position += way;
    }
    *position = best.1;
    best.0
}
