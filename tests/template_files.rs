//! Template files: broken ones end in one line with the right place, and the library keeps its promises.

mod common;

use common::Random;
use common::grid::stitch;
use knotmesh::io::template_json::{EntryKind, read, to_value};
use knotmesh::template::check::check;
use knotmesh::template::{Place, Template, TemplateLibrary};
use std::path::{Path, PathBuf};

/// A template, one turned over, and one derived from that.
const SAMPLE: &str = r#"[
{ "format": "knotmesh-template", "version": 1, "name": "a", "edges": ["-l1", "+y", "+l", "-y"],
  "corners": [[-0.5, -0.3], [0.5, -0.3], [0.5, 0.3], [-0.5, 0.3]], "yarn_radius": 0.1,
  "knots": [{"center": [-0.2, 0.0], "tilt": 1.06, "half_length": 0.14}],
  "yarns": [[{"edge": 3, "along": 0.75, "z": 0.0}, {"knot": 0, "contact": -1, "z": -0.1},
             {"knot": 0, "control": 1, "z": 0}, {"at": [0.1, 1e-1], "z": 0.1}],
            [{"edge": 1, "along": 0, "z": 0}, {"at": [0.2, 0.1], "z": 0.1}, {"edge": 2, "along": 0.7, "z": 0}]] },
{ "name": "b", "edges": ["-l1", "-y", "+l", "+y"], "derive": {"from": "a -l1 +y +l -y", "by": ["mirror-x"]} },
{ "name": "c", "edges": ["-l1", "+y", "+l", "-y"],
  "derive": {"from": "b -l1 -y +l +y", "by": ["reverse-yarn", "mirror-z"]} }
]
"#;

/// Files in a folder of their own, in memory where that is quick.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap())
    }
    fn file(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

/// Reads a file. Returns whether it was well-formed; a message must name a place in the file.
fn try_bytes(path: &Path, bytes: &[u8]) -> bool {
    std::fs::write(path, bytes).unwrap();
    let mut library = TemplateLibrary::default();
    let Err(error) = library.add_path(path) else {
        library.templates().iter().for_each(|t| check(t).unwrap());
        return true;
    };
    let message = error.to_string();
    let place = message.strip_prefix(&format!("{}:", path.display())).unwrap_or_else(|| panic!("{message}"));
    let parts: Vec<_> = place.splitn(3, ':').collect();
    let [line, column] = [parts[0], parts[1]].map(|n| n.parse::<usize>().unwrap());
    assert!(parts[2].starts_with(" found ") && parts[2].contains(", expected "), "{message}");
    assert!(!message.contains(char::is_control), "{message:?}");
    let lines: Vec<_> = bytes.split(|&b| b == b'\n').collect();
    assert!(line >= 1 && line <= lines.len() && column >= 1, "{message}");
    assert!(column <= lines[line - 1].len() + 1, "{message}");
    false
}

#[test]
fn broken_files() {
    let folder = Folder::new();
    let path = folder.file("t.json", SAMPLE);
    let good = SAMPLE.as_bytes();
    assert!(try_bytes(&path, good));
    for length in 0..SAMPLE.trim_end().len() {
        assert!(!try_bytes(&path, &good[..length]), "{length} bytes are taken as whole");
    }
    let mut bytes = good.to_vec();
    for at in 0..good.len() {
        for byte in *b"\"]}{[,:0-9e.\\\n\x00\xff" {
            bytes[at] = byte;
            try_bytes(&path, &bytes);
        }
        bytes[at] = good[at];
    }
    let words = [
        "1e400",
        "-1e308",
        "1e-320",
        "NaN",
        "Infinity",
        "null",
        "true",
        "4294967295",
        "4294967296",
        "-9223372036854775809",
        "99999999999999999999999999",
        "\"\"",
        "\"a\\nb\"",
        "\"\\ud800\"",
        "[]",
        "{}",
        "[[[[[[[[",
        "{\"a\":{\"a\":{\"a\":",
        "\"z\": 0, \"z\": 1",
        "\"derive\": {\"from\": \"c -l1 +y +l -y\", \"by\": []}",
    ];
    let mut random = Random::new(5);
    let is_word = |b: &u8| !b.is_ascii_whitespace() && !b"[]{}:,".contains(b);
    for _ in 0..20_000 {
        bytes.clear();
        bytes.extend_from_slice(good);
        for _ in 0..=random.below(3) {
            let at = random.below(bytes.len());
            let begin = at - bytes[..at].iter().rev().take_while(|b| is_word(b)).count();
            let end = at + bytes[at..].iter().take_while(|b| is_word(b)).count();
            match random.below(4) {
                0 => bytes[at] = random.bits() as u8,
                1 => drop(bytes.drain(at..(at + random.below(60)).min(good.len() / 2).max(at))),
                2 => drop(bytes.splice(begin..end, words[random.below(words.len())].bytes())),
                _ => {
                    let piece = bytes[at..(at + random.below(200)).min(bytes.len())].to_vec();
                    let to = random.below(bytes.len());
                    bytes.splice(to..to, piece);
                }
            }
        }
        try_bytes(&path, &bytes);
    }
    // Nested deeper than any stack.
    for (open, close) in [("[", "]"), ("{\"a\":", "}"), ("[{\"name\":", "}]")] {
        let deep = open.repeat(100_000) + "0" + &close.repeat(100_000);
        assert!(!try_bytes(&path, deep.as_bytes()));
        assert!(!try_bytes(&path, SAMPLE.replace("0.14", &deep).as_bytes()));
    }
}

/// The message for the sample with one piece exchanged, without the path.
fn message(from: &str, to: &str) -> String {
    assert_eq!(SAMPLE.matches(from).count(), 1, "{from}");
    let folder = Folder::new();
    let path = folder.file("t.json", SAMPLE.replace(from, to));
    let error = TemplateLibrary::default().add_path(&path).unwrap_err().to_string();
    error.strip_prefix(&format!("{}:", path.display())).unwrap_or(&error).to_string()
}

#[test]
fn messages_name_the_place() {
    // A wrong value or key is known for one at its last character.
    for (from, to, expected) in [
        ("0.14", "1e400", "4:70: found number out of range, expected a template as JSON"),
        ("0.14", "NaN", "4:66: found 'N', expected value"),
        ("0.14}", "0.14]", "4:70: found ']', expected `,` or `}`"),
        ("\"tilt\": 1.06", "\"tilt\": \"x\"", "4:47: found string \"x\", expected f64"),
        ("\"edge\": 3", "\"edge\": 4294967296", "5:32: found integer `4294967296`, expected u32"),
        (
            "\"tilt\"",
            "\"tile\"",
            "4:42: found unknown field `tile`, expected one of `center`, `tilt`, `half_length`",
        ),
        ("\"z\": -0.1", "\"z\": 0, \"z\": 1", "5:89: found duplicate field `z`, expected a template as JSON"),
        ("} }\n]\n", "} }\n", "11:1: found the end of the file, expected the rest of a list"),
        ("\"version\": 1", "\"version\": 2", "2:1: found version 2, expected version 1"),
        ("\"contact\": -1", "\"contact\": 2", "2:1: found sign 2 at point 1 of a yarn, expected 1 or -1"),
        (
            "\"edge\": 3",
            "\"edge\": 4294967295",
            "2:1: found edge 4294967295, fraction 0.75 at point 0 of yarn 0 in 'a -l1 +y +l -y', expected an edge counted from 0 and a fraction from 0 to 1",
        ),
        (
            "[-0.2, 0.0]",
            "[1e300, 0.0]",
            "2:1: found a centre or tilt of knot 0 out of range in 'a -l1 +y +l -y', expected finite numbers",
        ),
        (
            "\"from\": \"a -l1 +y +l -y\"",
            "\"from\": \"a\\n-l1\"",
            "8:1: found the unknown source 'a\u{fffd}-l1' in 'b -l1 -y +l +y', expected the key of a template",
        ),
        (
            "\"from\": \"a -l1 +y +l -y\"",
            "\"from\": \"c -l1 +y +l -y\"",
            "8:1: found 'b -l1 -y +l +y' derived in a circle, expected 'c -l1 +y +l -y' to lead to a template",
        ),
        (
            "[\"-l1\", \"-y\", \"+l\", \"+y\"]",
            "[\"-l1\", \"+y\", \"-y\", \"+l\"]",
            "8:1: found edges '-l1 +y -y +l' in 'b -l1 +y -y +l', expected '-l1 -y +l +y', as the operations give",
        ),
        ("\"c\"", "\"a\"", "9:1: found a second 'a -l1 +y +l -y', expected each key once"),
    ] {
        assert_eq!(message(from, to), expected, "{from} -> {to}");
    }
}

#[test]
fn derived_in_any_order() {
    let value: serde_json::Value = serde_json::from_str(SAMPLE).unwrap();
    let entries = value.as_array().unwrap();
    let folder = Folder::new();
    let mut results: Vec<Vec<Template>> = Vec::new();
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let text = serde_json::to_string(&order.map(|i| &entries[i])).unwrap();
        let mut library = TemplateLibrary::default();
        library.add_path(&folder.file("t.json", text)).unwrap();
        let mut templates = library.templates().to_vec();
        templates.sort_by_key(Template::key);
        results.push(templates);
    }
    assert!(results.iter().all(|r| *r == results[0]));
    // Mirrored in z on the way from b to c, on the other side of the face.
    let [a, _, c] = &results[0][..] else { panic!("three templates") };
    assert_eq!(a.strands[0][1].z, -c.strands[0][1].z);
    assert_eq!(a.knots[0].center.x, -c.knots[0].center.x);
    assert!(matches!(c.strands[0][0].place, Place::Boundary { edge: 1, along: 0.25 }));
}

#[test]
fn the_last_definition_wins() {
    let folder = Folder::new();
    let mut library = TemplateLibrary::embedded();
    let count = library.templates().len();
    library.add_path(&folder.file("first.json", SAMPLE)).unwrap();
    let first = library.by_key("a -l1 +y +l -y").unwrap().clone();
    let id = library.find(&stitch("a -l1 +y +l -y")).unwrap();
    library.add_path(&folder.file("second.json", SAMPLE.replace("1.06", "1.07"))).unwrap();
    assert_eq!(library.templates().len(), count + 3);
    let second = library.by_key("a -l1 +y +l -y").unwrap();
    assert_ne!(first.knots, second.knots);
    assert_eq!(library.find(&stitch("a -l1 +y +l -y")), Some(id));
    // The derived ones follow the file they stand in.
    let c = library.by_key("c -l1 +y +l -y").unwrap();
    assert_eq!(c.knots[0].direction.y, second.knots[0].direction.y);
}

#[test]
fn rotated_labels_are_found() {
    let folder = Folder::new();
    let mut library = TemplateLibrary::default();
    library.add_path(&folder.file("t.json", SAMPLE)).unwrap();
    let labels = ["-l1", "+y", "+l", "-y"];
    let (id, none) = library.find(&stitch("a -l1 +y +l -y")).unwrap();
    assert_eq!(none, 0);
    for k in 0..4 {
        let mut rotated = labels;
        rotated.rotate_right(k);
        let found = library.find(&stitch(&format!("a {}", rotated.join(" ")))).unwrap();
        assert_eq!(found, (id, k));
        assert_eq!(rotated[k], labels[0], "corner 0 of the template is corner k of the face");
    }
    for other in ["a -l1 -y +l +y", "a -l1 +y +l", "A -l1 +y +l -y", "a"] {
        assert_eq!(library.find(&stitch(other)), None, "{other}");
    }
}

#[test]
fn all_template_files_are_embedded() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = std::fs::read_to_string(root.join("src/io/embedded.rs")).unwrap();
    for entry in std::fs::read_dir(root.join("templates")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if !name.ends_with(".json") {
            continue;
        }
        assert!(list.contains(&format!("(\"templates/{name}\", include_str!")), "{name} is not embedded");
    }
}

#[test]
fn embedded_templates_are_right_and_printed_exactly() {
    let library = TemplateLibrary::embedded();
    assert!(!library.templates().is_empty());
    for template in library.templates() {
        check(template).unwrap_or_else(|e| panic!("{}: {e:?}", template.key()));
        let text = to_value(template).to_string();
        let mut entries = read(Path::new("t.json"), text.as_bytes()).unwrap();
        let EntryKind::Full(mut back) = entries.remove(0).kind else { panic!("printed in full") };
        for (knot, expected) in back.knots.iter_mut().zip(&template.knots) {
            assert!(knot.direction.distance(expected.direction) < 1e-15, "{}", template.key());
            knot.direction = expected.direction;
        }
        assert_eq!(*back, *template);
    }
}
