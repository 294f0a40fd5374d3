//! `knotmesh info`: what is in a file.

use super::inputs::{self, Rename};
use super::{print, templates};
use knotmesh::io::curve_info::curve_info;
use knotmesh::io::text::extension;
use knotmesh::measure::misfit::misfit;
use knotmesh::mesh::StitchMesh;
use knotmesh::mesh::corners::{CornerGroups, gaps};
use knotmesh::scene::{Scene, SceneOptions, find_templates};
use knotmesh::template::TemplateLibrary;
use knotmesh::{Error, Result};
use std::collections::BTreeMap;
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Arguments {
    /// A mesh (.smobj, .obj), a library (.sf, .json) or curves (.yarns, .bcc, .obj, .npz, .usda, .txt, .pbrt).
    #[arg(required_unless_present = "adapters")]
    file: Option<PathBuf>,
    /// List the GPU adapters that `--device gpu` can take, the best first.
    #[arg(long, conflicts_with = "file")]
    adapters: bool,
    /// Template libraries that a mesh is held against, on top of the embedded one.
    #[arg(long, value_name = "FILE|DIR")]
    templates: Vec<PathBuf>,
    /// Rename stitches of a mesh, as `relax` does.
    #[arg(long = "map", value_name = "OLDKEY=KEY")]
    map: Vec<Rename>,
}

/// Says what is in the file.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Some(path) = &arguments.file else { return print(&adapters()) };
    match extension(path).as_str() {
        "smobj" => mesh_info(path, arguments),
        "obj" if has_faces(path)? => mesh_info(path, arguments),
        "sf" | "json" => {
            let mut library = TemplateLibrary::default();
            library.add_path(path)?;
            print(&templates::listing(library.templates()))
        }
        _ => print(&format!("{}\n", curve_info(path)?)),
    }
}

#[cfg(feature = "gpu")]
fn adapters() -> String {
    let line = |adapter: &knotmesh::backend::gpu::Adapter| {
        let report = adapter.report();
        let sums = if report.exact { "sums as on the CPU" } else { "sums as the driver sees fit" };
        format!("{report}: buffers of {} MiB, {sums}\n", report.largest_binding >> 20)
    };
    let all = knotmesh::backend::gpu::Adapter::all();
    if all.is_empty() { "no GPU adapter\n".into() } else { all.iter().map(line).collect() }
}

#[cfg(not(feature = "gpu"))]
fn adapters() -> String {
    "no GPU adapter: this build has no GPU backend\n".into()
}

/// Whether an OBJ file holds polygons (a mesh) rather than lines (curves).
pub(super) fn has_faces(path: &std::path::Path) -> Result<bool> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let face = |line: &[u8]| matches!(line.trim_ascii_start(), [b'f', b' ' | b'\t', ..]);
    Ok(bytes.split(|b| *b == b'\n').any(face))
}

fn mesh_info(path: &std::path::Path, arguments: &Arguments) -> Result<()> {
    let library = inputs::library(&arguments.templates)?;
    let mesh = inputs::mesh(path, &library, &arguments.map)?;
    let mut text = contents(&mesh, &library);
    let mut problems = Vec::new();
    let (apart, greatest) = gaps(&mesh);
    if apart > 0 {
        problems.push(format!("{apart} joined edges do not coincide, they lie up to {greatest:.6} apart"));
    }
    let found = find_templates(&mesh, &library);
    let missing = mesh.face_types.iter().filter(|t| found[t.index()].is_none()).count();
    if missing > 0 {
        problems.push(format!(
            "{missing} faces have a stitch that the library lacks: add it with --templates, rename it with \
             --map, or leave the faces out with --skip-unknown"
        ));
    }
    match Scene::compile(&mesh, &library, SceneOptions { skip_unknown: true, ..SceneOptions::default() }) {
        Err(error) => problems.push(error.to_string()),
        Ok(scene) => {
            let closed = scene.yarns.closed.iter().filter(|c| **c).count();
            text += &format!(
                "yarns: {} ({closed} closed), {} control points, {} knots\n",
                scene.yarns.len(),
                scene.yarns.point_count(),
                scene.knot_count
            );
            text += &format!(
                "gauge: {:.6} per course, yarn radius {:.6}\n",
                scene.gauge,
                scene.gauge * scene.yarn_radius
            );
            let misfit = misfit(&scene, &mesh.positions);
            text += &format!(
                "fit: median strain {:+.1} % along the course, {:+.1} % along the wale\n",
                100.0 * misfit.median_course_strain,
                100.0 * misfit.median_wale_strain
            );
            if misfit.faces_without_frame > 0 {
                problems.push(format!(
                    "{} faces are degenerate and would only be interpolated",
                    misfit.faces_without_frame
                ));
            }
            problems.extend(misfit.warning(&scene, |f| mesh.face_type(f).key()));
        }
    }
    text += if problems.is_empty() { "nothing would go wrong\n" } else { "what would go wrong:\n" };
    for problem in problems {
        text += &format!("  {problem}\n");
    }
    print(&text)
}

fn contents(mesh: &StitchMesh, library: &TemplateLibrary) -> String {
    let groups = CornerGroups::new(mesh);
    let mut text = format!(
        "vertices: {} in {} places\nfaces: {}\njoined edges: {}, {} of them not flipped\n",
        mesh.positions.len(),
        groups.len(),
        mesh.face_count(),
        mesh.joins.len(),
        mesh.joins.iter().filter(|j| !j.flipped).count()
    );
    let mut counts: BTreeMap<String, (usize, bool)> = BTreeMap::new();
    let found = find_templates(mesh, library);
    for t in &mesh.face_types {
        let key = mesh.types[t.index()].key();
        counts.entry(key).or_insert((0, found[t.index()].is_some())).0 += 1;
    }
    for (key, (count, known)) in counts {
        text += &format!("  {count:7}  {key}{}\n", if known { "" } else { "   (not in the library)" });
    }
    if !mesh.units.is_empty() {
        text += &format!("yarn units: {}, checkpoints: {}\n", mesh.units.len(), mesh.checkpoints.len());
    }
    if !mesh.face_source.is_empty() {
        text += "pattern lines: one per face\n";
    }
    if !mesh.hints.is_empty() {
        text += &format!("machine hints, kept and not used: {}\n", mesh.hints.len());
    }
    for (kind, count) in &mesh.ignored {
        text += &format!("ignored lines: {count} '{kind}'\n");
    }
    text
}
