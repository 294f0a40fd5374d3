//! `knotmesh measure --against-database`: the knot model against a table of yarn-level simulation.

use super::inputs;
use super::progress::Progress;
use super::{Console, print};
use knotmesh::Error;
use knotmesh::Result;
use knotmesh::io::output::Output;
use knotmesh::io::yarn_model;
use knotmesh::measure::database::{Comparison, plot, run as compare, table};
use knotmesh::measure::machine::{machine, today};
use std::path::{Path, PathBuf};

/// Compares, prints and writes.
pub fn run(model: &Path, templates: &[PathBuf], folder: Option<&Path>, console: Console) -> Result<()> {
    let progress = Progress::new(console.quiet);
    progress.stage("reading");
    let library = inputs::library(templates)?;
    let read = yarn_model::read(model)?;
    // Made before the work, so that a place that cannot be written to is known at once.
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    }
    let mut begun = false;
    let comparison = compare(&read, &library, &mut |done, of| {
        if !begun {
            progress.steps(of, "comparing", "pose");
            begun = true;
        }
        progress.update(done);
    })
    .map_err(|e| Error::invalid(format_args!("{}: {e}", model.display())))?;
    progress.finish();
    let text = listing(model, &comparison);
    print(&text)?;
    match folder {
        Some(folder) => write(model, folder, &text, &comparison, console),
        None => Ok(()),
    }
}

fn name(model: &Path) -> String {
    model.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Where and when.
fn place() -> String {
    format!("knotmesh {}; {}; {}", env!("CARGO_PKG_VERSION"), machine(), today())
}

fn listing(model: &Path, comparison: &Comparison) -> String {
    format!(
        "the knot model against the table of {}\n{}\n\n{}",
        name(model),
        place(),
        table::printed(comparison)
    )
}

fn write(model: &Path, folder: &Path, text: &str, comparison: &Comparison, console: Console) -> Result<()> {
    let put = |name: &str, bytes: &[u8]| -> Result<()> {
        let path = folder.join(name);
        let mut out = Output::create(&path)?;
        out.put(bytes)?;
        out.commit()?;
        console.say(format_args!("wrote {}", path.display()));
        Ok(())
    };
    put("comparison.csv", table::csv(comparison).as_bytes())?;
    put("comparison.txt", text.as_bytes())?;
    let subtitle = |what: &str| vec![what.to_string(), place()];
    let title = format!("Contacts off the surface's motion: distance to the table of {}", name(model));
    let page = plot::distances(
        comparison,
        &title,
        &subtitle(
            "mean over the contacts of a stitch, yarn radii; 'pattern embedded' is how far the table moves them at all",
        ),
    );
    put("distances.svg", page.svg()?.as_bytes())?;
    put("distances.png", &page.png()?)?;
    let title = format!("Loops under stretch, beside the table of {}", name(model));
    let page = plot::shapes(comparison, &title, &subtitle("r: radius of the table's yarn"));
    put("shapes.svg", page.svg()?.as_bytes())?;
    put("shapes.png", &page.png()?)
}
