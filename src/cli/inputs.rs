//! Meshes and libraries as the commands take them.

use knotmesh::io::text::extension;
use knotmesh::io::{obj_mesh, smobj};
use knotmesh::mesh::{StitchMesh, StitchType};
use knotmesh::scene::rename_types;
use knotmesh::template::TemplateLibrary;
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
            mesh.into_stitch_mesh(&mut |name, uvs, corners| {
                let renamed = renames.iter().rev().find(|r| r.from == name).map_or(name, |r| &r.to);
                resolve(library, renamed, uvs, corners)
            })
        }
        other => Err(Error::invalid(format_args!(
            "{}: found a file of kind '.{other}', expected a mesh: .smobj or .obj",
            path.display()
        ))),
    }
}

/// The stitch type that a material or group name means for a face of so many corners, and which corner is
/// the template's first: the file's first, or the one that turns the face upright in its texture coordinates.
///
/// A name is a full key with blanks, commas or underscores between its words, or a template's name where
/// only one template with that many corners has it. Endings that modelling tools add (`.001`) are ignored.
fn resolve(
    library: &TemplateLibrary,
    name: &str,
    uvs: Option<&[glam::DVec2]>,
    corners: usize,
) -> std::result::Result<(StitchType, usize), String> {
    let stem = match name.rsplit_once('.') {
        Some((stem, digits)) if digits.len() == 3 && digits.bytes().all(|b| b.is_ascii_digit()) => stem,
        _ => name,
    };
    let spaced = stem.split([' ', ',', '_']).filter(|w| !w.is_empty()).collect::<Vec<_>>().join(" ");
    let exact = [stem, &spaced].into_iter().find_map(|key| library.by_key(key));
    let template = match exact {
        Some(template) => template,
        None => {
            let mut named: Vec<_> = library.by_name(stem).filter(|t| t.corners.len() == corners).collect();
            match named.len() {
                0 => {
                    return Err(format!(
                        "the key or name of a stitch with {corners} corners ('knotmesh templates' lists them; --map renames)"
                    ));
                }
                1 => named.pop().expect("there is one"),
                _ => {
                    let keys: Vec<String> = named.iter().map(|t| format!("'{}'", t.key())).collect();
                    return Err(format!("a full key, one of {}", keys.join(", ")));
                }
            }
        }
    };
    if template.corners.len() != corners {
        return Err(format!("{} corners, as '{}' has", template.corners.len(), template.key()));
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
