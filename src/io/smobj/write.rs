//! Writing `.smobj`: what [`read`](super::read) understands, with every digit that f64 needs.

use crate::mesh::{FaceEdge, FaceOrigin, StitchMesh};
use std::fmt;
use std::io::{Error, ErrorKind, Result, Write};

/// Writes a stitch mesh; reading it gives the same mesh back. Kinds of lines that were only counted
/// (`StitchMesh::ignored`) have no content and are not written.
///
/// A mesh that the format cannot hold (a name with a blank or `#`, a coordinate that is not finite) is
/// an error of kind `InvalidInput`.
pub fn write(mesh: &StitchMesh, out: &mut impl Write) -> Result<()> {
    if let Some([width, height]) = mesh.gauge {
        writeln!(out, "# gauge {} {}", Number::new(width)?, Number::new(height)?)?;
    }
    for stitch in &mesh.types {
        write!(out, "L {}", Name::new(&stitch.name)?)?;
        for label in &stitch.labels {
            write!(out, " {}", Name::new(label)?)?;
        }
        writeln!(out)?;
    }
    for p in &mesh.positions {
        writeln!(out, "v {} {} {}", Number::new(p.x)?, Number::new(p.y)?, Number::new(p.z)?)?;
    }
    for (face, stitch) in mesh.face_types.iter().enumerate() {
        write!(out, "f")?;
        for vertex in mesh.face(face.into()) {
            write!(out, " {}", u64::from(vertex.0) + 1)?;
        }
        writeln!(out, "\nT {}", u64::from(stitch.0) + 1)?;
        if let Some(source) = mesh.face_source.get(face) {
            write!(out, "N {source}")?;
            if let Some(origin) = mesh.face_origins.get(face).filter(|o| **o != FaceOrigin::default()) {
                write!(out, " # column {}", origin.column)?;
                if let Some([r, g, b]) = origin.colour {
                    write!(out, " color {r:02x}{g:02x}{b:02x}")?;
                }
            }
            writeln!(out)?;
        }
    }
    for join in &mesh.joins {
        let sign = if join.flipped { "-" } else { "" };
        let [a, b] = [join.a, join.b].map(one_based);
        writeln!(out, "e {}/{} {}/{sign}{}", a.0, a.1, b.0, b.1)?;
    }
    for unit in &mesh.units {
        writeln!(out, "U {} {}", Name::new(&unit.name)?, Number::new(unit.length)?)?;
    }
    for checkpoint in &mesh.checkpoints {
        let at = one_based(checkpoint.at);
        write!(out, "c {}/{}/{}", at.0, at.1, u64::from(checkpoint.crossing) + 1)?;
        for &(length, unit) in &checkpoint.lengths {
            write!(out, " {} {}", Number::new(length)?, u64::from(unit) + 1)?;
        }
        writeln!(out)?;
    }
    for hint in &mesh.hints {
        if hint.contains(['\n', '#']) {
            return Err(invalid(format_args!("the hint {hint:?} is not one line without comment")));
        }
        writeln!(out, "{hint}")?;
    }
    Ok(())
}

fn one_based(edge: FaceEdge) -> (u64, u64) {
    (u64::from(edge.face.0) + 1, u64::from(edge.edge) + 1)
}

fn invalid(message: impl fmt::Display) -> Error {
    Error::new(ErrorKind::InvalidInput, message.to_string())
}

/// A word without blanks and comment signs.
struct Name<'a>(&'a str);

impl<'a> Name<'a> {
    fn new(name: &'a str) -> Result<Self> {
        if name.is_empty() || name.contains(|c: char| c.is_ascii_whitespace() || c == '#') {
            return Err(invalid(format_args!("the name {name:?} is not one word without '#'")));
        }
        Ok(Self(name))
    }
}

impl fmt::Display for Name<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.0)
    }
}

/// A finite number in the fewest digits that read back the same.
struct Number(f64);

impl Number {
    fn new(x: f64) -> Result<Self> {
        if x.is_finite() { Ok(Self(x)) } else { Err(invalid(format_args!("{x} is not a finite number"))) }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        // Outside this range plain decimals would be long rows of zeros.
        if self.0 == 0.0 || (1e-5..1e16).contains(&self.0.abs()) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}
