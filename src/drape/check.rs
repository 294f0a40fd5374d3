//! What a scene selects in a mesh, and what of it can have no effect, said before anything is stepped.

use super::motion::{Motion, pose_of};
use super::obstacle::Obstacle;
use super::scene::{Collider, DrapeScene, Shape};
use super::select::mean_edge;
use crate::Result;
use crate::ids::VertexId;
use crate::mesh::StitchMesh;
use glam::DVec3;

/// What a scene means for a mesh, in words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneCheck {
    /// What is selected, one line each.
    pub selects: Vec<String>,
    /// What has no effect, one line each.
    pub ignored: Vec<String>,
}

/// Positions of a mesh in metres: its own, and where the scene puts them.
pub(super) fn positions(mesh: &StitchMesh, scene: &DrapeScene) -> [Vec<DVec3>; 2] {
    let own: Vec<DVec3> = mesh.positions.iter().map(|p| *p * scene.unit).collect();
    let placed = own.iter().map(|p| scene.place.apply(*p)).collect();
    [own, placed]
}

/// The vertices of every held group.
///
/// # Errors
/// Selections that name what is not there.
pub(super) fn selections(mesh: &StitchMesh, scene: &DrapeScene) -> Result<Vec<Vec<VertexId>>> {
    let [own, placed] = positions(mesh, scene);
    scene.held.iter().map(|h| h.select.vertices(mesh, &own, &placed, &h.name)).collect()
}

/// Says what a scene selects and what of it can have no effect.
///
/// # Errors
/// Selections that name what is not there, and what [`DrapeScene::check`] refuses.
pub fn check(mesh: &StitchMesh, scene: &DrapeScene) -> Result<SceneCheck> {
    scene.check()?;
    let mut said = SceneCheck::default();
    let [_, placed] = positions(mesh, scene);
    let last = (scene.frames - 1) as f64 * scene.frame_time();
    let edge = mean_edge(mesh, &placed);
    let doubt = if edge > 0.1 { " (\"unit\" says how many metres a unit of the mesh is)" } else { "" };
    said.selects.push(format!(
        "{} frames, {last:.3} s; {} vertices, {} stitches; an edge of a stitch is {:.2} mm on average{doubt}",
        scene.frames,
        mesh.positions.len(),
        mesh.face_count(),
        edge * 1e3
    ));
    if scene.frames == 1 {
        said.ignored.push("everything that moves: there is one frame, the start".into());
    }
    held(mesh, scene, last, &mut said)?;
    let reach = reachable(scene, &placed, &selections(mesh, scene)?, last);
    for collider in &scene.colliders {
        let Collider { name, shape, motions, .. } = collider;
        said.selects.push(format!("{name}: {}", describe(shape)));
        still(name, motions, last, &mut said.ignored);
        if !meets(collider, reach, scene) {
            said.ignored.push(format!("{name}: the cloth does not get there"));
        }
    }
    if let Some(wind) = &scene.wind {
        if wind.speed == 0.0 || wind.drag == 0.0 {
            let which = if wind.speed == 0.0 { "speed" } else { "drag" };
            said.ignored.push(format!("wind: its {which} is 0"));
        } else if wind.gust.is_some_and(|g| g.strength == 0.0) {
            said.ignored.push("wind: the strength of its gust is 0".into());
        }
    }
    Ok(said)
}

fn held(mesh: &StitchMesh, scene: &DrapeScene, last: f64, said: &mut SceneCheck) -> Result<()> {
    let groups = selections(mesh, scene)?;
    let mut owner = vec![usize::MAX; mesh.positions.len()];
    for (number, group) in groups.iter().enumerate() {
        group.iter().for_each(|v| owner[v.index()] = number);
    }
    for (number, (entry, group)) in scene.held.iter().zip(&groups).enumerate() {
        let name = &entry.name;
        if group.is_empty() {
            said.ignored.push(format!("{name}: it selects no vertex"));
            continue;
        }
        said.selects.push(format!("{name}: {} vertices", group.len()));
        let lost = group.iter().filter(|v| owner[v.index()] != number).count();
        if lost > 0 {
            said.ignored.push(format!("{name}: {lost} of its vertices, which a later group holds"));
        }
        still(name, &entry.motions, last, &mut said.ignored);
    }
    if owner.iter().all(|o| *o != usize::MAX) && !owner.is_empty() {
        said.ignored.push("gravity, wind, colliders: every vertex is held".into());
    }
    Ok(())
}

fn still(name: &str, motions: &[Motion], last: f64, ignored: &mut Vec<String>) {
    for (number, motion) in motions.iter().enumerate() {
        if motion.is_still() {
            ignored.push(format!("{name}: motion {number}, whose keys change nothing"));
        } else if !motion.repeat && motion.keys.len() > 1 && motion.keys[1..].iter().any(|k| k.time > last) {
            let late = motion.keys.iter().filter(|k| k.time > last).count();
            ignored.push(format!(
                "{name}: {late} keys of motion {number} lie after the last frame, in part at least"
            ));
        }
    }
}

fn describe(shape: &Shape) -> String {
    match shape {
        Shape::Plane { .. } => "a plane".into(),
        Shape::Sphere { radius, .. } => format!("a sphere of radius {radius} m"),
        Shape::Capsule { from, to, radius } => {
            format!("a capsule {:.3} m long between its ends, of radius {radius} m", from.distance(*to))
        }
        Shape::Mesh(solid) => {
            let frames = match solid.frames.len() {
                1 => String::new(),
                n => format!(", {n} frames"),
            };
            format!("a closed mesh of {} triangles{frames}", solid.triangles.len())
        }
    }
}

/// A box that the cloth will hardly leave: where it starts and falls to, and where it is taken, its own size around.
fn reachable(scene: &DrapeScene, placed: &[DVec3], groups: &[Vec<VertexId>], last: f64) -> [DVec3; 2] {
    let around = |all: &mut dyn Iterator<Item = DVec3>| {
        all.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(p), h.max(p)])
    };
    let start = around(&mut placed.iter().copied());
    let size = DVec3::splat((start[1] - start[0]).length());
    let wind = scene.wind.as_ref().map_or(DVec3::ZERO, |w| w.direction.normalize_or_zero() * w.speed * last);
    let fall = scene.gravity * (0.5 * last * last) + wind;
    let mut reach = [start[0].min(start[0] + fall), start[1].max(start[1] + fall)];
    for (entry, group) in scene.held.iter().zip(groups) {
        if group.is_empty() || entry.motions.is_empty() {
            continue;
        }
        let own = around(&mut group.iter().map(|v| placed[v.index()]));
        for frame in sampled(scene.frames) {
            let pose = pose_of(&entry.motions, frame as f64 * scene.frame_time(), (own[0] + own[1]) * 0.5);
            for corner in 0..8 {
                let pick = |k: usize| own[corner >> k & 1][k];
                let p = pose.apply(DVec3::new(pick(0), pick(1), pick(2)));
                reach = [reach[0].min(p), reach[1].max(p)];
            }
        }
    }
    [reach[0] - size, reach[1] + size]
}

/// At most a few hundred frames of all.
fn sampled(frames: usize) -> impl Iterator<Item = usize> {
    (0..frames).step_by((frames / 300).max(1)).chain([frames - 1])
}

fn meets(collider: &Collider, [low, high]: [DVec3; 2], scene: &DrapeScene) -> bool {
    let mut obstacle = Obstacle::new(collider, 0.0);
    sampled(scene.frames).any(|frame| {
        let time = frame as f64 * scene.frame_time();
        if let Shape::Plane { .. } = collider.shape {
            obstacle.set_times(time, time);
            return (0..8).any(|corner| {
                let pick = |k: usize| [low, high][corner >> k & 1][k];
                obstacle.distance(DVec3::new(pick(0), pick(1), pick(2))) <= obstacle.thickness()
            });
        }
        let [from, to] = obstacle.extents_at(time);
        from.cmple(high).all() && to.cmpge(low).all()
    })
}
