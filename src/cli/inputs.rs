//! Meshes and libraries as the commands take them.

use knotmesh::io::text::extension;
use knotmesh::io::{obj_mesh, smobj};
use knotmesh::mesh::{StitchMesh, StitchType};
use knotmesh::scene::rename_types;
use knotmesh::template::{Template, TemplateLibrary};
use knotmesh::{Error, Result};
use std::path::{Path, PathBuf};

/// The embedded library with those of the command line on top.
pub fn library(paths: &[PathBuf]) -> Result<TemplateLibrary> {
    let mut library = TemplateLibrary::embedded();
    for path in paths {
        library.add_path(path)?;
    }
    Ok(library)
}

/// The mesh of a command, the library, and the rest mesh's positions if one is named.
pub fn all(
    mesh: &Path,
    templates: &[PathBuf],
    map: &[Rename],
    rest: Option<&Path>,
) -> Result<(StitchMesh, TemplateLibrary, Option<Vec<glam::DVec3>>)> {
    let library = library(templates)?;
    let at_rest = |path| self::mesh(path, &library, map).map(|m| m.positions);
    let (mesh, rest) = (self::mesh(mesh, &library, map)?, rest.map(at_rest).transpose()?);
    Ok((mesh, library, rest))
}

/// A `--map OLDKEY=KEY` rule.
#[derive(Clone, Debug)]
pub struct Rename {
    from: String,
    to: String,
}

impl std::str::FromStr for Rename {
    type Err = String;

    fn from_str(rule: &str) -> std::result::Result<Self, String> {
        let (from, to) = rule.split_once('=').ok_or("expected OLDKEY=KEY")?;
        let words = |s: &str| s.split_whitespace().collect::<Vec<_>>().join(" ");
        let (from, to) = (words(from), words(to));
        if from.is_empty() || to.is_empty() {
            return Err("expected a key on both sides of '='".into());
        }
        Ok(Self { from, to })
    }
}

/// Reads a mesh (`.smobj`, or `.obj` with stitches named by material or group) and renames its stitches.
pub fn mesh(path: &Path, library: &TemplateLibrary, renames: &[Rename]) -> Result<StitchMesh> {
    match extension(path).as_str() {
        "smobj" => {
            let mut mesh = smobj::read_file(path)?;
            for rule in renames {
                rename_types(&mut mesh, &rule.from, &rule.to)?;
            }
            Ok(mesh)
        }
        "obj" => {
            let mesh = obj_mesh::read_file(path)?;
            let mut hits = vec![false; renames.len()];
            let mesh = mesh.into_stitch_mesh(&mut |name, uvs, corners| {
                let mut key = spaced(name);
                for (rule, hit) in renames.iter().zip(&mut hits) {
                    if spaced(&rule.from) == key {
                        key.clone_from(&rule.to);
                        *hit = true;
                    }
                }
                resolve(library, &key, uvs, corners)
            })?;
            match hits.iter().position(|hit| !hit) {
                Some(i) => Err(Error::invalid(format_args!(
                    "--map '{}={}': the mesh has no stitch of that name",
                    renames[i].from, renames[i].to
                ))),
                None => Ok(mesh),
            }
        }
        other => Err(Error::invalid(format_args!(
            "{}: found a file of kind '.{other}', expected a mesh: .smobj or .obj",
            path.display()
        ))),
    }
}

/// A material's name as a key: without the ending that modelling tools add (`.001`), blanks for underscores
/// and commas.
fn spaced(name: &str) -> String {
    let stem = match name.rsplit_once('.') {
        Some((stem, digits)) if digits.len() == 3 && digits.bytes().all(|b| b.is_ascii_digit()) => stem,
        _ => name,
    };
    stem.split([' ', ',', '_']).filter(|w| !w.is_empty()).collect::<Vec<_>>().join(" ")
}

/// The stitch type that a name means for a face of so many corners, and which corner is the template's first:
/// the file's first, or the one that turns the face upright in its texture coordinates. A name is a full key,
/// or a template's name where only one template with that many corners has it. One that nothing has becomes a
/// type of its own, which no library knows.
fn resolve(
    library: &TemplateLibrary,
    key: &str,
    uvs: Option<&[glam::DVec2]>,
    corners: usize,
) -> std::result::Result<(StitchType, usize), String> {
    let fitting = |t: &&Template| t.corners.len() == corners;
    let mut named = library.by_key(key).into_iter().chain(library.by_name(key)).filter(fitting);
    let Some(template) = named.next() else {
        let name = if key.is_empty() { "(no name)" } else { key };
        return Ok((StitchType { name: name.into(), labels: vec!["?".into(); corners] }, 0));
    };
    if library.by_key(key).is_none() && named.next().is_some() {
        let keys: Vec<String> =
            library.by_name(key).filter(fitting).map(|t| format!("'{}'", t.key())).collect();
        return Err(format!("a full key, one of {}", keys.join(", ")));
    }
    let stitch = StitchType { name: template.name.clone(), labels: template.labels.clone() };
    Ok((stitch, uvs.map_or(0, |uvs| upright(uvs, &template.corners))))
}

/// The corner that, taken as the first, lays the texture polygon best onto the template's: u along the
/// course, v along the wale.
fn upright(uvs: &[glam::DVec2], corners: &[glam::DVec2]) -> usize {
    let n = uvs.len();
    let middle = |points: &[glam::DVec2]| points.iter().sum::<glam::DVec2>() / n as f64;
    let (uv_middle, middle) = (middle(uvs), middle(corners));
    let score =
        |k: usize| (0..n).map(|i| (uvs[(i + k) % n] - uv_middle).dot(corners[i] - middle)).sum::<f64>();
    (0..n).rev().max_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap_or(0)
}
