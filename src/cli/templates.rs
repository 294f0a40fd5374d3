//! `knotmesh templates`: the stitches a library offers.

use super::print;
use knotmesh::Result;
use knotmesh::io::template_json;
use knotmesh::template::{Template, TemplateLibrary};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Arguments {
    /// Print every template fully expanded, as one JSON list.
    #[arg(long)]
    json: bool,
    /// Libraries (.json, .sf) or directories of them; the embedded library if none is given.
    #[arg(value_name = "FILE|DIR")]
    paths: Vec<PathBuf>,
}

/// Lists the templates.
pub fn run(arguments: &Arguments) -> Result<()> {
    let library = if arguments.paths.is_empty() {
        TemplateLibrary::embedded()
    } else {
        let mut library = TemplateLibrary::default();
        for path in &arguments.paths {
            library.add_path(path)?;
        }
        library
    };
    if arguments.json {
        let list: Vec<_> = library.templates().iter().map(template_json::to_value).collect();
        let text = serde_json::to_string_pretty(&list).expect("plain values");
        return print(&(text + "\n"));
    }
    print(&listing(library.templates()))
}

/// One line a template, and what the search for knots noted.
pub fn listing(templates: &[Template]) -> String {
    let mut text = String::new();
    let width = templates.iter().map(|t| t.key().len()).max().unwrap_or(0);
    for t in templates {
        let points: usize = t.strands.iter().map(Vec::len).sum();
        text += &format!(
            "{:width$}  {} corners, {} knots, {} yarns, {points} points, yarn radius {}\n",
            t.key(),
            t.corners.len(),
            t.knots.len(),
            t.strands.len(),
            t.yarn_radius
        );
        for note in &t.notes {
            text += &format!("{:width$}    {note}\n", "");
        }
    }
    text + &format!("{} templates\n", templates.len())
}
