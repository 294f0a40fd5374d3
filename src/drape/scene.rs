//! What a scene says, as plain data: what is held and moved, what is in the way, what blows. Units are metres,
//! seconds, kilograms and radians. Read from files by `io::scene_json`, or put together in code.

use super::motion::{Motion, Pose};
use glam::DVec3;

/// Everything about a cloth's surroundings and the frames that are wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct DrapeScene {
    /// Metres per unit of the mesh. Frames are in the mesh's units again.
    pub unit: f64,
    /// Number of frames; frame k is at time k / fps, and frame 0 is the start.
    pub frames: usize,
    /// Frames a second.
    pub fps: f64,
    /// Substeps a frame; none: what the stepper takes by itself.
    pub substeps: Option<u32>,
    /// m/s^2.
    pub gravity: DVec3,
    /// Where the mesh is put before anything else, applied to its positions in metres.
    pub place: Pose,
    /// Relax the cloth to its natural sizes before the first frame.
    pub relax: bool,
    /// Areal density of the cloth, kg/m^2; none: the cloth's own.
    pub density: Option<f64>,
    /// Rate at which velocities fade, 1/s; none: what the stepper takes by itself.
    pub damping: Option<f64>,
    /// Groups that are held. Where groups share a node, the last one has it.
    pub held: Vec<Held>,
    /// What cloth does not pass through.
    pub colliders: Vec<Collider>,
    /// How cloth keeps from passing through itself; none: it does not.
    pub self_collision: Option<SelfCollision>,
    /// Wind; none: the air is not felt.
    pub wind: Option<Wind>,
}

impl Default for DrapeScene {
    fn default() -> Self {
        Self {
            unit: 1.0,
            frames: 1,
            fps: 30.0,
            substeps: None,
            gravity: DVec3::new(0.0, -9.81, 0.0),
            place: Pose::IDENTITY,
            relax: false,
            density: None,
            damping: None,
            held: Vec::new(),
            colliders: Vec::new(),
            self_collision: None,
            wind: None,
        }
    }
}

impl DrapeScene {
    /// Seconds between frames.
    pub fn frame_time(&self) -> f64 {
        1.0 / self.fps
    }
}

/// A group of vertices that the scene holds, still or in motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Held {
    /// Which vertices.
    pub select: Selection,
    /// How they move, one motion after the other; empty: not at all.
    pub motions: Vec<Motion>,
    /// Where its entry stands in the file, for messages: `pins[2]`.
    pub name: String,
}

/// Which vertices of a mesh; one has to meet every condition that is given. None given: no vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Numbers of vertices, counted from 0.
    pub vertices: Option<Vec<u32>>,
    /// Edges as face and edge within it, counted from 0: both their ends.
    pub edges: Option<Vec<[u32; 2]>>,
    /// Corners of a box in which they lie at the start, metres (after placing, before relaxing).
    pub bounds: Option<[DVec3; 2]>,
    /// The extreme along an axis of the mesh's own positions.
    pub border: Option<Border>,
    /// Vertices of faces whose pattern line (`N`) is one of first to last.
    pub rows: Option<[u32; 2]>,
}

/// Vertices near an extreme of the mesh's own positions, before it is placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Border {
    /// Which extreme.
    pub side: Side,
    /// How far from it, metres; none: half the mean length of edges.
    pub depth: Option<f64>,
}

/// An extreme of positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Least x.
    Left,
    /// Greatest x.
    Right,
    /// Least y.
    Bottom,
    /// Greatest y.
    Top,
    /// Least z.
    Back,
    /// Greatest z.
    Front,
}

impl Side {
    /// How far along the side's direction a point lies: greatest at the border.
    pub fn reach(self, p: DVec3) -> f64 {
        match self {
            Side::Left => -p.x,
            Side::Right => p.x,
            Side::Bottom => -p.y,
            Side::Top => p.y,
            Side::Back => -p.z,
            Side::Front => p.z,
        }
    }
}

/// Coulomb friction: sticks up to `fixed` times the normal force, slides under `sliding` times it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Coefficient of static friction.
    pub fixed: f64,
    /// Coefficient of kinetic friction, not above the static one.
    pub sliding: f64,
}

impl Default for Friction {
    /// Wool on skin or cotton: about 0.3 to 0.5.
    fn default() -> Self {
        Self { fixed: 0.4, sliding: 0.3 }
    }
}

/// Something that cloth does not enter.
#[derive(Clone, Debug, PartialEq)]
pub struct Collider {
    /// Its shape at rest.
    pub shape: Shape,
    /// How it moves: rigidly (no key scales), one motion after the other.
    pub motions: Vec<Motion>,
    /// Of cloth on it.
    pub friction: Friction,
    /// How near nodes of the cloth come, metres; none: a fifth of a stitch's diagonal.
    pub thickness: Option<f64>,
    /// Where its entry stands in the file, for messages: `colliders[2]`.
    pub name: String,
}

/// The shape of a collider, metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// The half-space behind a plane.
    Plane {
        /// A point of it.
        point: DVec3,
        /// Out of it; any length but zero.
        normal: DVec3,
    },
    /// A ball.
    Sphere {
        /// Its middle.
        center: DVec3,
        /// Metres, above 0.
        radius: f64,
    },
    /// All that is within a distance of a segment.
    Capsule {
        /// One end of the segment.
        from: DVec3,
        /// The other end.
        to: DVec3,
        /// Metres, above 0.
        radius: f64,
    },
    /// The inside of a closed triangle mesh.
    Mesh(Solid),
}

/// A closed triangle mesh, at rest or given for every frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solid {
    /// `[frame][vertex]` positions, metres, at least one frame; between frames vertices go straight, after the last they stay.
    pub frames: Vec<Vec<DVec3>>,
    /// Frames a second, if there are several.
    pub fps: f64,
    /// Corners, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// How nodes keep their distance from nodes that are no neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SelfCollision {
    /// Least distance between nodes, metres; none: five eighths of a stitch's diagonal.
    pub thickness: Option<f64>,
    /// Of cloth on itself.
    pub friction: Friction,
}

/// Wind: a force `drag * area * |u_n| u_n n` on every triangle, u_n the speed of the air past it along its normal n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wind {
    /// Where it blows to; any length but zero.
    pub direction: DVec3,
    /// m/s.
    pub speed: f64,
    /// kg/m^3: half the density of air times a drag coefficient.
    pub drag: f64,
    /// Changes of the speed.
    pub gust: Option<Gust>,
}

/// Random changes of the wind's speed, the same for the same seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gust {
    /// Greatest change, relative to the speed.
    pub strength: f64,
    /// Seconds from one random value to the next.
    pub period: f64,
    /// Names the sequence.
    pub seed: u64,
}

impl Wind {
    /// Drag that is used where none is given: half of 1.2 kg/m^3 times the coefficient of a flat plate, about 1.2.
    pub const DRAG: f64 = 0.72;
}
