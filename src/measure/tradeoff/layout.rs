//! Which face a control point belongs to. The only place of these measures that knows how yarns name the
//! slots that their points come from.

use crate::math::V3;
use crate::scene::{NO_SECOND_SLOT, Scene};

/// Where a control point comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Owner {
    /// The owning face, in batch order.
    pub face: u32,
    /// Whether a second face puts it too: a point where the yarn goes from face to face.
    pub shared: bool,
}

/// `[point]` the owners.
pub(super) fn owners(scene: &Scene) -> Vec<Owner> {
    let owner = |slots: &[u32; 2]| {
        let (batch, index, _) = scene.slot_place(slots[0]);
        Owner { face: (batch.first_face + index) as u32, shared: slots[1] != NO_SECOND_SLOT }
    };
    scene.point_slots().iter().map(owner).collect()
}

/// Control points from the points that faces put in their slots: shared ones are the mean.
pub(super) fn gather(scene: &Scene, slots: &[V3<f64>], points: &mut Vec<V3<f64>>) {
    points.clear();
    points.extend(scene.point_slots().iter().map(|[a, b]| match *b {
        NO_SECOND_SLOT => slots[*a as usize],
        b => (slots[*a as usize] + slots[b as usize]) * 0.5,
    }));
}
