//! What a scene put together in code may get wrong; files are refused by their reader before.

use super::motion::Motion;
use super::scene::{DrapeScene, Friction, Shape};
use crate::{Error, Result};
use glam::DVec3;

/// Greatest magnitude of any number.
const MOST: f64 = 1e9;

impl DrapeScene {
    /// Checks that numbers are finite and within their ranges, keys in order, colliders rigid and solids closed.
    ///
    /// # Errors
    /// The first that is not, by name.
    pub fn check(&self) -> Result<()> {
        above("unit", self.unit)?;
        above("fps", self.fps)?;
        if self.frames == 0 || self.substeps == Some(0) {
            return Err(wrong("frames, substeps", "none", "at least one"));
        }
        vector("gravity", self.gravity)?;
        let pose = self.place;
        let columns = pose.linear.to_cols_array();
        if !columns.iter().all(|x| x.abs() <= MOST) {
            return Err(wrong("place", "a pose beyond 1e9", "a finite one"));
        }
        vector("place", pose.offset)?;
        self.density.map_or(Ok(()), |d| above("density", d))?;
        from_zero("damping", self.damping.unwrap_or(0.0))?;
        for held in &self.held {
            motions(&held.name, &held.motions)?;
            if let Some([low, high]) = held.select.bounds {
                vector(&held.name, low)?;
                vector(&held.name, high)?;
            }
            let depth = held.select.border.and_then(|b| b.depth).unwrap_or(0.0);
            from_zero(&held.name, depth)?;
        }
        for collider in &self.colliders {
            let name = &collider.name;
            motions(name, &collider.motions)?;
            if !collider.motions.iter().all(Motion::is_rigid) {
                return Err(wrong(name, "a motion that scales a collider", "translations and turns"));
            }
            from_zero(name, collider.thickness.unwrap_or(0.0))?;
            friction(name, &collider.friction)?;
            match &collider.shape {
                Shape::Plane { point, normal } => {
                    vector(name, *point)?;
                    direction(name, *normal)?;
                }
                Shape::Sphere { center, radius } => {
                    vector(name, *center)?;
                    above(name, *radius)?;
                }
                Shape::Capsule { from, to, radius } => {
                    vector(name, *from)?;
                    vector(name, *to)?;
                    above(name, *radius)?;
                }
                Shape::Mesh(solid) => {
                    solid.check().map_err(|(found, expected)| wrong(name, found, expected))?;
                }
            }
        }
        if let Some(own) = &self.self_collision {
            own.thickness.map_or(Ok(()), |t| above("self_collision", t))?;
            friction("self_collision", &own.friction)?;
        }
        if let Some(wind) = &self.wind {
            direction("wind", wind.direction)?;
            from_zero("wind", wind.speed)?;
            from_zero("wind", wind.drag)?;
            if let Some(gust) = &wind.gust {
                from_zero("gust", gust.strength)?;
                above("gust", gust.period)?;
            }
        }
        Ok(())
    }
}

fn wrong(name: &str, found: impl std::fmt::Display, expected: impl std::fmt::Display) -> Error {
    let name = if name.is_empty() { "a scene's entry" } else { name };
    Error::invalid(format_args!("{name}: found {found}, expected {expected}"))
}

fn above(name: &str, x: f64) -> Result<()> {
    if (1e-9..=MOST).contains(&x) { Ok(()) } else { Err(wrong(name, x, "a number from 1e-9 to 1e9")) }
}

fn from_zero(name: &str, x: f64) -> Result<()> {
    if (0.0..=MOST).contains(&x) { Ok(()) } else { Err(wrong(name, x, "a number from 0 to 1e9")) }
}

fn vector(name: &str, v: DVec3) -> Result<()> {
    let fine = v.to_array().iter().all(|x| x.abs() <= MOST);
    if fine { Ok(()) } else { Err(wrong(name, v, "numbers from -1e9 to 1e9")) }
}

fn direction(name: &str, v: DVec3) -> Result<()> {
    vector(name, v)?;
    if v.length() >= 1e-9 { Ok(()) } else { Err(wrong(name, v, "a vector with a direction")) }
}

fn friction(name: &str, friction: &Friction) -> Result<()> {
    from_zero(name, friction.fixed)?;
    from_zero(name, friction.sliding)?;
    if friction.sliding <= friction.fixed {
        Ok(())
    } else {
        let found = format!("kinetic friction {} above the static one", friction.sliding);
        Err(wrong(name, found, format_args!("at most {}", friction.fixed)))
    }
}

fn motions(name: &str, motions: &[Motion]) -> Result<()> {
    for motion in motions {
        direction(name, motion.axis)?;
        motion.center.map_or(Ok(()), |c| vector(name, c))?;
        if motion.keys.is_empty() {
            return Err(wrong(name, "a motion without keys", "at least one"));
        }
        for key in &motion.keys {
            vector(name, key.translate)?;
            vector(name, DVec3::new(key.turn, key.time, 0.0))?;
            if !key.scale.to_array().iter().all(|s| (1e-6..=1e6).contains(s)) {
                return Err(wrong(name, key.scale, "factors from 1e-6 to 1e6"));
            }
        }
        if let Some(pair) = motion.keys.windows(2).find(|k| k[0].time >= k[1].time) {
            let found = format!("time {} after time {}", pair[1].time, pair[0].time);
            return Err(wrong(name, found, "a later one"));
        }
    }
    Ok(())
}
