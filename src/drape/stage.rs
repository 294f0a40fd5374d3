//! A scene at work on the nodes of a cloth: holds, moves, blows and pushes, substep by substep.

use super::check::selections;
use super::layers::{LayerContacts, Layers};
use super::motion::{Motion, pose_of};
use super::obstacle::{Near, Obstacle};
use super::scene::{DrapeScene, SelfCollision};
use super::wind::Air;
use crate::Result;
use crate::cloth::Support;
use crate::mesh::StitchMesh;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// Nodes a task.
const CHUNK: usize = 1024;
/// How often a node is pushed out of colliders that take turns.
const PASSES: usize = 4;
/// How often pairs of nodes and colliders take turns in a substep.
const ROUNDS: usize = 6;

/// Thickness of colliders that name none, in diagonals of a stitch: half of what a knitted fabric is thick.
pub const COLLIDER_THICKNESS: f64 = 0.2;
/// Thickness of self-collision that names none, in diagonals of a stitch. No node passes through the middle of an undeformed
/// stitch of another layer above 0.5.
pub const SELF_THICKNESS: f64 = 0.625;

/// Nodes that move together.
#[derive(Clone, Debug)]
struct Group {
    motions: Vec<Motion>,
    /// What motions turn about if they name no centre: the mean of the nodes at the start.
    center: DVec3,
    nodes: Vec<u32>,
    /// Where the nodes are before any motion.
    places: Vec<DVec3>,
}

/// What happened in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ContactReport {
    /// Nodes that touched a collider in the frame's last substep.
    pub contacts: usize,
    /// Pairs of nodes that were pushed apart in the last substep, at its first turn.
    pub self_contacts: usize,
    /// How deep inside a collider's thickness a node was left after any substep, metres.
    pub deepest_penetration: f64,
    /// How much nearer than the thickness of self-collision a pair was found at the last turn of a substep, metres.
    pub deepest_self_penetration: f64,
}

/// A scene at work. It implements the cloth's `Surroundings`.
#[derive(Clone, Debug)]
pub struct Stage {
    gravity: DVec3,
    groups: Vec<Group>,
    /// Held nodes, rising.
    held: Vec<u32>,
    /// `[node]` 1 / kg; 0 for held nodes.
    inverse_mass: Vec<f64>,
    obstacles: Vec<Obstacle>,
    /// `[node, obstacle]`
    near: Vec<Near>,
    layers: Option<Layers>,
    air: Option<Air>,
    /// Nodes that colliders bore when they were last asked for forces.
    borne: usize,
    report: ContactReport,
}

/// The nodes of a cloth, as a scene needs them.
#[derive(Clone, Copy, Debug)]
pub struct Nodes<'a> {
    /// `[node]` metres, at time 0.
    pub start: &'a [DVec3],
    /// `[node]` kg.
    pub masses: &'a [f64],
    /// Over nodes: what wind blows on, and what says which nodes are neighbours.
    pub triangles: &'a [[u32; 3]],
    /// `[vertex]` its node.
    pub of_vertex: &'a [u32],
}

impl Stage {
    /// Sets a scene up for a mesh whose nodes are given.
    ///
    /// # Errors
    /// Selections that name what is not there, and what [`DrapeScene::check`] refuses.
    pub fn new(scene: &DrapeScene, mesh: &StitchMesh, nodes: Nodes) -> Result<Self> {
        scene.check()?;
        let count = nodes.start.len();
        let mut owner = vec![usize::MAX; count];
        for (number, vertices) in selections(mesh, scene)?.iter().enumerate() {
            vertices.iter().for_each(|v| owner[nodes.of_vertex[v.index()] as usize] = number);
        }
        let mut groups = Vec::new();
        for (number, entry) in scene.held.iter().enumerate() {
            let own: Vec<u32> = (0..count as u32).filter(|n| owner[*n as usize] == number).collect();
            let places: Vec<DVec3> = own.iter().map(|n| nodes.start[*n as usize]).collect();
            let center = places.iter().sum::<DVec3>() / (own.len().max(1) as f64);
            groups.push(Group { motions: entry.motions.clone(), center, nodes: own, places });
        }
        let is_held = |n: usize| owner[n] != usize::MAX;
        let inverse_mass: Vec<f64> = (0..count)
            .map(|n| if is_held(n) || nodes.masses[n] <= 0.0 { 0.0 } else { 1.0 / nodes.masses[n] })
            .collect();
        let diagonal = diagonal(mesh, nodes);
        let obstacles: Vec<Obstacle> =
            scene.colliders.iter().map(|c| Obstacle::new(c, COLLIDER_THICKNESS * diagonal)).collect();
        let layers = scene.self_collision.map(|SelfCollision { thickness, friction }| {
            let thickness = thickness.unwrap_or(SELF_THICKNESS * diagonal);
            Layers::new(thickness, friction, inverse_mass.clone(), nodes.triangles)
        });
        Ok(Self {
            gravity: scene.gravity,
            groups,
            held: (0..count as u32).filter(|n| is_held(*n as usize)).collect(),
            inverse_mass,
            near: vec![Near::default(); count * obstacles.len()],
            obstacles,
            layers,
            air: scene.wind.map(|wind| Air::new(wind, nodes.triangles, count)),
            borne: 0,
            report: ContactReport::default(),
        })
    }

    /// Adds gravity and wind over `dt` seconds.
    pub fn accelerate(&mut self, time: f64, dt: f64, positions: &[DVec3], velocities: &mut [DVec3]) {
        let change = self.gravity * dt;
        for (velocity, inverse_mass) in velocities.iter_mut().zip(&self.inverse_mass) {
            if *inverse_mass > 0.0 {
                *velocity += change;
            }
        }
        if let Some(air) = &mut self.air {
            air.blow(time, dt, positions, &self.inverse_mass, velocities);
        }
    }

    /// Puts held nodes where they are at a time, seconds.
    pub fn place(&self, time: f64, positions: &mut [DVec3]) {
        for group in &self.groups {
            let pose = pose_of(&group.motions, time, group.center);
            let still = group.motions.is_empty();
            for (node, place) in group.nodes.iter().zip(&group.places) {
                positions[*node as usize] = if still { *place } else { pose.apply(*place) };
            }
        }
    }

    /// Puts held nodes where they are at time 0.
    pub fn place_at_start(&self, positions: &mut [DVec3]) {
        self.place(0.0, positions);
    }

    /// Pushes nodes apart and out of colliders, in turns: colliders have the last word.
    pub fn collide(&mut self, time: f64, dt: f64, previous: &[DVec3], positions: &mut [DVec3]) {
        self.obstacles.iter_mut().for_each(|o| o.set_times(time - dt, time));
        for round in 0..ROUNDS {
            let mut apart = LayerContacts::default();
            if let Some(layers) = &mut self.layers {
                apart = layers.push(dt, previous, positions);
            }
            if round == 0 {
                self.report.self_contacts = apart.contacts;
            }
            // What no pair has moved since is out of colliders.
            if round > 0 && apart.contacts == 0 {
                break;
            }
            if round + 1 == ROUNDS {
                self.report.deepest_self_penetration = self.report.deepest_self_penetration.max(apart.deep);
            }
            let contacts = self.push_out(dt, previous, positions);
            if round == 0 {
                // Nodes that are borne need no push.
                self.report.contacts = contacts.max(std::mem::take(&mut self.borne));
            }
        }
    }

    /// Pushes nodes out of colliders, not apart; how many were touched.
    pub fn confine(&mut self, time: f64, dt: f64, previous: &[DVec3], positions: &mut [DVec3]) -> usize {
        self.obstacles.iter_mut().for_each(|o| o.set_times(time - dt, time));
        let deepest = self.report.deepest_penetration;
        let contacts = self.push_out(dt, previous, positions);
        // What is left now is not left at the end.
        self.report.deepest_penetration = deepest;
        contacts
    }

    /// Adds the forces by which colliders hold nodes that lie on them: what presses into one is taken away, and what drives
    /// along it, or the way along it that mass would go on, up to Coulomb's bound.
    pub fn support(&mut self, step: &Support, forces: &mut [DVec3]) -> usize {
        let Support { time, dt, previous, positions, stiffness } = *step;
        let count = self.obstacles.len();
        if count == 0 {
            return 0;
        }
        self.obstacles.iter_mut().for_each(|o| o.set_times(time - dt, time));
        let (obstacles, inverse_mass) = (&self.obstacles, &self.inverse_mass);
        self.borne = forces
            .par_iter_mut()
            .zip(self.near.par_chunks_mut(count))
            .enumerate()
            .with_min_len(CHUNK)
            .filter(|(n, _)| inverse_mass[*n] > 0.0)
            .map(|(n, (force, near))| {
                let mut borne = false;
                let inertia = 1.0 / (inverse_mass[n] * dt * dt);
                for (obstacle, near) in obstacles.iter().zip(near) {
                    // As far as the force would take it.
                    let reach = force.length() / stiffness[n];
                    let ways = (previous[n], positions[n]);
                    if let Some(felt) = obstacle.feel(ways, dt, reach, near) {
                        let answer = obstacle.friction().answer(*force, &felt, (stiffness[n], inertia));
                        borne |= answer != DVec3::ZERO;
                        *force += answer;
                    }
                }
                usize::from(borne)
            })
            .sum();
        self.borne
    }

    /// Pushes nodes out of colliders; how many were touched.
    fn push_out(&mut self, dt: f64, previous: &[DVec3], positions: &mut [DVec3]) -> usize {
        if self.obstacles.is_empty() {
            return 0;
        }
        let (obstacles, inverse_mass) = (&self.obstacles, &self.inverse_mass);
        let count = obstacles.len();
        let settle = |(((p, q), near), inverse_mass): (((&mut DVec3, &DVec3), &mut [Near]), &f64)| {
            let mut all = (0, 0.0);
            if *inverse_mass == 0.0 {
                return all;
            }
            for pass in 0..PASSES {
                let (mut touched, mut deep) = (0, 0.0);
                for (obstacle, near) in obstacles.iter().zip(near.iter_mut()) {
                    let contact = obstacle.push(*q, p, dt, near);
                    touched += usize::from(contact.touched);
                    deep = f64::max(deep, contact.deep);
                }
                if pass == 0 {
                    all.0 = usize::from(touched > 0);
                }
                all.1 = deep;
                // One collider alone has been settled at once.
                if touched == 0 || count == 1 {
                    return all;
                }
            }
            // Turns may end in sight of the way out, each collider having had its own.
            all.1 = f64::max(all.1, super::groove::leave(obstacles, (*q, p), dt, near));
            all
        };
        let (contacts, deep) = positions
            .par_iter_mut()
            .zip(previous)
            .zip(self.near.par_chunks_mut(count))
            .zip(inverse_mass)
            .with_min_len(CHUNK)
            .map(settle)
            .reduce(|| (0, 0.0), |a, b| (a.0 + b.0, f64::max(a.1, b.1)));
        self.report.deepest_penetration = self.report.deepest_penetration.max(deep);
        contacts
    }

    /// Nodes that the scene holds, rising.
    pub fn held(&self) -> &[u32] {
        &self.held
    }

    /// The colliders, where they were last.
    pub fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
    }

    /// Least distance of nodes that are no neighbours, metres, if they keep one.
    pub fn self_thickness(&self) -> Option<f64> {
        self.layers.as_ref().map(Layers::thickness)
    }

    /// What happened since the last time this was asked.
    pub fn take_report(&mut self) -> ContactReport {
        std::mem::take(&mut self.report)
    }
}

/// The mean diagonal of a stitch at the start, metres: of quads, else of whatever faces there are.
fn diagonal(mesh: &StitchMesh, nodes: Nodes) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for quads in [true, false] {
        for face in 0..mesh.face_count() {
            let corners = mesh.face(face.into());
            if (corners.len() == 4) != quads {
                continue;
            }
            let at = |k: usize| nodes.start[nodes.of_vertex[corners[k].index()] as usize];
            let half = corners.len() / 2;
            for k in 0..half {
                sum += at(k).distance(at(k + half));
                count += 1;
            }
        }
        if count > 0 {
            break;
        }
    }
    sum / f64::max(f64::from(count), 1.0)
}
