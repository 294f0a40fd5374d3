//! Data flows one way: which module may import which. Seen red with `use crate::backend` in `mesh`.

use std::collections::BTreeMap;
use std::path::Path;

/// Each module of `src/` and what of the crate it may import, in the order of the flow.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("ids", &[]),
    ("math", &[]),
    ("yarn", &["error"]),
    ("mesh", &["error", "ids"]),
    ("pattern", &["error"]),
    ("template", &["error", "ids", "mesh"]),
    ("design", &["error", "ids", "mesh"]),
    ("cloth", &["error", "ids", "math", "mesh", "template"]),
    // Readers and writers of plain data; `io::result` alone knows solved frames.
    ("io", &["error", "ids", "mesh", "pattern", "template", "yarn", "design"]),
    ("scene", &["error", "ids", "math", "mesh", "template"]),
    ("knot", &["error", "math", "scene"]),
    ("backend", &["error", "ids", "math", "mesh", "scene", "knot"]),
    ("drape", &["error", "ids", "math", "mesh", "template", "cloth"]),
    ("database", &["error", "math", "mesh", "pattern", "yarn", "knot", "backend"]),
    ("curve", &["error", "ids", "math", "mesh", "scene", "knot", "backend", "yarn"]),
    (
        "measure",
        &[
            "error", "ids", "math", "mesh", "pattern", "template", "scene", "knot", "backend", "database",
            "curve", "yarn",
        ],
    ),
    ("render", &["error", "math", "mesh", "scene", "backend", "measure", "yarn"]),
    // On top of everything but the command line.
    (
        "view",
        &[
            "error", "ids", "math", "mesh", "template", "design", "cloth", "io", "scene", "knot", "backend",
            "curve", "yarn", "render",
        ],
    ),
];

/// Files that may import more than their module, and what.
const EXCEPTIONS: &[(&str, &[&str])] = &[
    // Result files are written from solved frames.
    ("io/result.rs", &["math", "scene", "backend", "curve"]),
    // Scenes are read into what `drape` takes.
    ("io/scene_json.rs", &["drape"]),
    ("io/scene_json/entries.rs", &["drape"]),
    ("io/fabric_result.rs", &["math", "database", "curve"]),
];

/// The modules of the crate that a source file names, by `crate::module` or `crate::{...}`.
fn imports(text: &str) -> Vec<String> {
    let code: String =
        text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        let word = |s: &str| s.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
        if let Some(list) = rest.strip_prefix('{') {
            let mut depth = 0;
            let end = list.find(|c| {
                depth += i32::from(c == '{') - i32::from(c == '}');
                depth < 0
            });
            let mut depth = 0;
            let top: String = list[..end.unwrap_or(0)]
                .chars()
                .filter(|c| {
                    depth += i32::from(*c == '{') - i32::from(*c == '}');
                    depth == 0
                })
                .collect();
            found.extend(top.split(',').map(|item| word(item.trim())));
        } else {
            found.push(word(rest));
        }
    }
    found
}

fn files(folder: &Path, all: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, all);
        } else if path.extension().is_some_and(|e| e == "rs") {
            all.push(path);
        }
    }
}

#[test]
fn imports_go_one_way() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let may: BTreeMap<_, _> = MAY_IMPORT.iter().copied().collect();
    let mut all = Vec::new();
    files(&src, &mut all);
    assert!(all.len() > 30, "the sources are found");
    let mut faults = Vec::new();
    let mut seen = 0;
    for path in all {
        let name = path.strip_prefix(&src).unwrap().to_string_lossy().replace('\\', "/");
        let module = name.split(['/', '.']).next().unwrap();
        if matches!(module, "lib" | "main" | "cli") {
            // The command line is a crate of its own on top of the library.
            continue;
        }
        let allowed =
            may.get(module).unwrap_or_else(|| panic!("{name}: module '{module}' is not in the list"));
        let extra = EXCEPTIONS.iter().find(|(f, _)| *f == name).map_or(&[][..], |(_, e)| e);
        for import in imports(&std::fs::read_to_string(&path).unwrap()) {
            let fine = ["Error", "Result"].contains(&import.as_str())
                || import == module
                || allowed.contains(&import.as_str())
                || extra.contains(&import.as_str());
            seen += 1;
            if !fine {
                faults.push(format!("{name} imports {import}"));
            }
        }
    }
    assert!(seen > 50, "imports are found");
    assert!(faults.is_empty(), "back edges: {faults:#?}");
}

#[test]
fn import_lists_are_understood() {
    let found =
        imports("use crate::{Error, io::{text, sf}, mesh};\nuse crate::knot::solve;\n// use crate::backend;");
    assert_eq!(found, ["Error", "io", "mesh", "knot"]);
}
