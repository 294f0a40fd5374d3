//! `knotmesh render`: exit codes and messages, inputs of every kind, numbered pictures, GIFs, legends.
#![cfg(feature = "gpu")]

#[path = "common/command.rs"]
mod command;
#[path = "common/gpu.rs"]
mod gpu;

use command::knotmesh;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running};
use knotmesh::knot::Settings;
use knotmesh::mesh::StitchMesh;
use knotmesh::render::style::kinds;
use knotmesh::render::{Strands, Style};
use knotmesh::scene::{Mode, Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::path::{Path, PathBuf};

/// Small and quick.
const SMALL: [&str; 6] = ["--width", "200", "--height", "150", "--samples", "4"];

/// Draws, and expects that to work.
fn render(input: &str, output: &Path, more: &[&str]) -> String {
    let output = output.to_string_lossy();
    let mut arguments = vec!["render", input, "-o", &output];
    arguments.extend(SMALL);
    arguments.extend(more);
    let (code, _, message) = knotmesh(&arguments);
    assert_eq!(code, 0, "{input} {more:?}: {message}");
    message
}

struct Png {
    width: usize,
    /// `[row][column]`
    pixels: Vec<Vec<[u8; 4]>>,
}

fn read(path: &Path) -> Png {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let size = info.color_type.samples();
    let pixel = |p: &[u8]| [p[0], p[1], p[2], if size == 4 { p[3] } else { 255 }];
    let row = |r: &[u8]| r.chunks_exact(size).map(pixel).collect();
    let width = info.width as usize;
    Png { width, pixels: bytes[..info.buffer_size()].chunks_exact(size * width).map(row).collect() }
}

/// Pixels that are not see-through, and the box around them: left, right, top, bottom.
fn drawn(picture: &Png) -> (usize, [usize; 4]) {
    let mut count = 0;
    let mut ends = [usize::MAX, 0, usize::MAX, 0];
    for (y, row) in picture.pixels.iter().enumerate() {
        for (x, _) in row.iter().enumerate().filter(|(_, p)| p[3] > 128) {
            count += 1;
            ends = [ends[0].min(x), ends[1].max(x), ends[2].min(y), ends[3].max(y)];
        }
    }
    (count, ends)
}

fn names(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name());
    let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Positions of the swatch, each frame stretched by a factor along x, as `.npy`.
fn stretched(folder: &Path, factors: &[f64]) -> PathBuf {
    let mesh = knotmesh::io::smobj::read_file(Path::new("stitches/swatch.smobj")).unwrap();
    let header = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}, 3), }}",
        factors.len(),
        mesh.positions.len()
    );
    let header = format!("{header:117}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for factor in factors {
        for p in &mesh.positions {
            bytes.extend([p.x * factor, p.y, p.z].iter().flat_map(|x| x.to_le_bytes()));
        }
    }
    let path = folder.join("stretch.npy");
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Seen red with a message of two lines.
#[test]
fn what_cannot_be_is_refused_in_one_line() {
    let out = tempfile::tempdir().unwrap();
    let curves = out.path().join("c.obj");
    std::fs::write(&curves, "v 0 0 0\nv 1 0 0\nl 1 2\n").unwrap();
    let curves = curves.to_string_lossy();
    let png = out.path().join("a.png");
    let png = png.to_string_lossy();
    let swatch = "stitches/swatch.smobj";
    let cases: &[(&[&str], &str)] = &[
        (&["nothing.smobj", "-o", &png], "nothing.smobj"),
        (&["Cargo.toml", "-o", &png], "another kind, expected a mesh"),
        (&["stitches", "-o", &png], "--backend database"),
        (&["cloth.bin", "-o", &png], "found a sequence of cloth"),
        (&[swatch, "-o", &png, "--backend", "database"], "-o yarn.npz"),
        (&[swatch, "-o", "a.mp4"], "ffmpeg -framerate 24 -i a.%04d.png -c:v libx264"),
        (&[swatch, "-o", "a.webm", "--width", "99"], "pad=ceil(iw/2)*2"),
        (&[swatch, "-o", "a.mp4", "--frame-range", "7:"], "-start_number 7"),
        (&[swatch, "-o", "a.bmp"], "expected .png, .gif or a folder"),
        (&[swatch, "-o", "none/a.png"], "its folder does not exist"),
        (&["stitches/fair-isle.png", "-o", "stitches/fair-isle.png"], "would replace an input"),
        (&[swatch, "-o", &png, "--camera", "above"], "expected front, back"),
        (&[swatch, "-o", &png, "--target", "1,2"], "expected three numbers"),
        (&[swatch, "-o", &png, "--range", "2,1"], "the lower first"),
        (&[swatch, "-o", &png, "--range", "1,2"], "expected a --style of numbers"),
        (&[swatch, "-o", &png, "--range", "0,2", "--style", "energy"], "expected numbers above 0"),
        (&[swatch, "-o", &png, "--colour", "red"], "#rrggbb"),
        (&[swatch, "-o", &png, "--colour", "#aabbcc", "--style", "type"], "expected --style yarn"),
        (&[swatch, "-o", &png, "--background", "#00"], "paper, white, transparent"),
        (&[swatch, "-o", &png, "--zoom", "0"], "--zoom: found 0"),
        (&[swatch, "-o", &png, "--width", "1"], "1 is not in 16..=16384"),
        (&[swatch, "-o", &png, "--size", "M"], "found --size for a stitch mesh, expected a pattern"),
        (&[swatch, "-o", &png, "--gauge", "22x36"], "expected world units"),
        (&[swatch, "-o", &png, "--radius", "1"], "found --radius for a stitch mesh"),
        (&[swatch, "-o", &png, "--mode", "embed", "--style", "energy"], "expected --mode relax"),
        (&[swatch, "-o", &png, "--frame-range", "1:"], "expected --frames"),
        (&["stitches/scarf.knit", "-o", &png, "--frames", "a.npy"], "found --frames for a pattern"),
        (&[&curves, "-o", &png, "--style", "type"], "for a curve file, expected a stitch mesh"),
        (&[&curves, "-o", &png, "--style", "tension"], "found curves of one frame"),
        (&[&curves, "-o", &png, "--frame-range", "3:"], "frame"),
    ];
    for (arguments, expected) in cases {
        let mut all = vec!["render"];
        all.extend(*arguments);
        let (code, _, message) = knotmesh(&all);
        assert_eq!(code, 2, "{arguments:?}: {message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
        assert_eq!(message.trim_end().lines().count(), 1, "{arguments:?}: {message}");
    }
    assert_eq!(names(out.path()), ["c.obj"]);
}

/// Seen red with framing at two thirds of the distance.
#[test]
fn every_kind_of_input_is_drawn_and_framed() {
    let Some(_) = gpu::adapter() else { return };
    let out = tempfile::tempdir().unwrap();
    let at = |name: &str| out.path().join(name);
    let text = |name: &str| at(name).to_string_lossy().into_owned();
    let mut inputs = vec!["stitches/swatch.smobj".into(), "stitches/swatch.obj".into()];
    inputs.extend(["stitches/motif.json".to_string(), "stitches/button-band.knit".into()]);
    for extension in ["yarns", "bcc", "obj", "npz", "usda", "txt", "pbrt"] {
        let name = text(&format!("swatch.{extension}"));
        assert_eq!(knotmesh(&["relax", "stitches/swatch.smobj", "-q", "-o", &name]).0, 0);
        inputs.push(name);
    }
    for input in inputs {
        render(&input, &at("a.png"), &["--background", "transparent"]);
        let picture = read(&at("a.png"));
        let (count, [left, right, top, bottom]) = drawn(&picture);
        assert!(count > 1500, "{input}: {count} pixels");
        assert!(left > 2 && right < 197 && top > 2 && bottom < 147, "{input}: cut off at the border");
        assert!(right - left > 175 || bottom - top > 130, "{input}: {left} to {right}, {top} to {bottom}");
        let (x, y) = (left + right, top + bottom);
        assert!(x.abs_diff(199) <= 6 && y.abs_diff(149) <= 6, "{input}: not in the middle");
    }
}

/// Seen red with frames numbered from 0.
/// What a pattern lays along z lies there (the foot of a sock, which may be longer than the leg); as a mesh, too. Seen red with the
/// wales' axis taken there.
#[test]
fn patterns_have_y_upwards() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [pattern, mesh] = ["tube.knit", "tube.smobj"].map(|name| at(name).display().to_string());
    std::fs::write(&pattern, "piece tube round toward (0, 0, 1)\nco 16\nRnds 1-24: k\nbo\n").unwrap();
    let (code, _, message) = knotmesh(&["knit", &pattern, "-o", &mesh]);
    assert_eq!(code, 0, "{message}");
    render(&mesh, &at("a.png"), &[]);
    render(&mesh, &at("b.png"), &["--up", "y"]);
    let [a, b] = ["a.png", "b.png"].map(|name| std::fs::read(at(name)).unwrap());
    assert!(a == b);
    // Without what it was made from.
    let text = std::fs::read_to_string(&mesh).unwrap();
    let bare: String = text.lines().filter(|l| !l.starts_with("N ")).flat_map(|l| [l, "\n"]).collect();
    std::fs::write(&mesh, bare).unwrap();
    render(&mesh, &at("c.png"), &[]);
    assert!(std::fs::read(at("c.png")).unwrap() != a, "its wales run along z");
}

/// What moves has as many samples as its yarn is thin; a still picture has the usual number.
#[test]
fn thin_yarn_that_moves_has_more_samples() {
    let Some(adapter) = gpu::adapter() else { return };
    let out = tempfile::tempdir().unwrap();
    let picture = |name: &str, more: &[&str]| {
        let folder = out.path().join(name).to_string_lossy().into_owned() + "/";
        let size = ["render", "stitches/tube.smobj", "-o", &folder, "--width", "64", "--height", "48"];
        let (code, _, message) = knotmesh(&[&size[..], more].concat());
        assert_eq!(code, 0, "{message}");
        let first = names(Path::new(&folder)).into_iter().next().unwrap();
        std::fs::read(Path::new(&folder).join(first)).unwrap()
    };
    let usual = if adapter.report().is_software() { "8" } else { "16" };
    let turned = picture("turned", &["--turntable", "2"]);
    assert!(turned == picture("many", &["--turntable", "2", "--samples", "64"]));
    assert!(turned != picture("few", &["--turntable", "2", "--samples", usual]));
    assert!(picture("still", &[]) == picture("asked", &["--samples", usual]));
}

/// Charts are worked as often as asked, as `knit` works them: the same types of stitches are drawn.
#[test]
fn charts_are_repeated() {
    let Some(_) = gpu::adapter() else { return };
    let out = tempfile::tempdir().unwrap();
    let at = |name: &str| out.path().join(name);
    let how = ["--repeat", "2x3", "--border", "2"];
    let chart = "stitches/lace.chart";
    let look = ["--style", "type", "--camera", "front", "--no-shadows"];
    render(chart, &at("chart.png"), &[&look[..], &how].concat());
    render(chart, &at("once.png"), &look);
    let mesh = at("mesh.smobj").to_string_lossy().into_owned();
    assert_eq!(knotmesh(&[&["knit", chart, "--relax", "-q", "-o", &mesh][..], &how].concat()).0, 0);
    render(&mesh, &at("mesh.png"), &[&look[..], &["--fold-ribs"]].concat());
    let [chart, once, mesh] = ["chart.png", "once.png", "mesh.png"].map(|name| read(&at(name)));
    let apart = |a: &Png, b: &Png| {
        let pixels = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
        pixels.filter(|(p, q)| (0..3).any(|c| p[c].abs_diff(q[c]) > 60)).count()
    };
    assert!(apart(&chart, &mesh) < 300, "{}", apart(&chart, &mesh));
    assert!(apart(&chart, &once) > 3000, "{}", apart(&chart, &once));
    // Not of patterns, nor of meshes.
    for (input, expected) in
        [("stitches/tuck.knit", "expected a chart"), ("stitches/rib.smobj", "expected a pattern")]
    {
        let output = at("no.png").to_string_lossy().into_owned();
        let (code, _, message) = knotmesh(&["render", input, "-o", &output, "--repeat", "2x2"]);
        assert!(code == 2 && message.contains(expected), "{message}");
    }
}

#[test]
fn pictures_are_numbered_and_gifs_have_all_frames() {
    let Some(_) = gpu::adapter() else { return };
    let out = tempfile::tempdir().unwrap();
    let motion = stretched(out.path(), &[1.0, 1.1, 1.2, 1.3]);
    let motion = motion.to_string_lossy();
    let frames = ["--frames", &motion];
    let folder = |name: &str| out.path().join(name);

    std::fs::create_dir(folder("a")).unwrap();
    render("stitches/swatch.smobj", &folder("a/f.png"), &[&frames[..], &["--frame-range", "1:3"]].concat());
    assert_eq!(names(&folder("a")), ["f.0001.png", "f.0002.png"]);
    // One of several is numbered, and not another picture than it is among others.
    render("stitches/swatch.smobj", &folder("a/g%d.png"), &[&frames[..], &["--frame-range", "2"]].concat());
    assert_eq!(names(&folder("a")), ["f.0001.png", "f.0002.png", "g2.png"]);

    let tube = "stitches/tube.smobj";
    render(tube, &folder("b/"), &["--turntable", "3"]);
    assert_eq!(names(&folder("b")), ["tube.0000.png", "tube.0001.png", "tube.0002.png"]);
    let [a, b] = ["b/tube.0000.png", "b/tube.0001.png"].map(|n| std::fs::read(folder(n)).unwrap());
    assert_ne!(a, b);
    render(tube, &folder("b"), &["--camera", "front"]);
    assert!(folder("b/tube.png").is_file());

    render("stitches/swatch.smobj", &folder("m.gif"), &[&frames[..], &["--fps", "10"]].concat());
    let mut decoder =
        gif::DecodeOptions::new().read_info(std::fs::File::open(folder("m.gif")).unwrap()).unwrap();
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        assert_eq!((frame.width, frame.height), (200, 150));
        delays.push(frame.delay);
    }
    assert_eq!(delays, [10; 4]);
    assert_eq!(std::fs::read(folder("m.gif")).unwrap().last(), Some(&0x3b));

    let output = folder("c.png");
    let output = output.to_string_lossy();
    let both = ["render", "stitches/swatch.smobj", "-o", &output, "--frames", &motion, "--turntable", "3"];
    let (code, _, message) = knotmesh(&both);
    assert!(code == 2 && message.contains("found 4 frames, expected one: --frame-range 0:1"), "{message}");
}

/// The yarn is where the legend is not. Seen red with the legend's width left out of the framing.
#[test]
fn legends_stand_beside_the_yarn() {
    let Some(_) = gpu::adapter() else { return };
    let out = tempfile::tempdir().unwrap();
    let at = |name: &str| out.path().join(name);
    for style in ["tension", "error", "energy", "type", "tightness"] {
        let options = ["--style", style, "--background", "transparent"];
        render("stitches/rib.smobj", &at("with.png"), &options);
        render("stitches/rib.smobj", &at("without.png"), &[&options[..], &["--no-legend"]].concat());
        let (with, without) = (read(&at("with.png")), read(&at("without.png")));
        assert_eq!((with.width, without.width), (200, 200));
        let empty = |x: usize| with.pixels.iter().all(|row| row[x][3] == 0);
        let ends = drawn(&without).1;
        assert!(ends[1] - ends[0] > 150 || ends[3] - ends[2] > 120, "{style}: {ends:?}");
        // From the right: a margin, the legend, a gap, yarn.
        let columns: Vec<bool> = (0..200).rev().map(empty).collect();
        let legend = columns.iter().position(|e| !e).unwrap();
        assert!((2..60).contains(&legend), "{style}: the legend begins at {legend}");
        let gap = columns.windows(8).enumerate().find(|(i, w)| *i > legend && w.iter().all(|e| *e));
        let (gap, _) = gap.unwrap_or_else(|| panic!("{style}: the legend is not beside the yarn"));
        assert!(gap > 30 && columns[gap..].iter().any(|e| !e), "{style}: {gap}");
    }
}

/// A swatch that is stretched uniformly and embedded, so that the yarn follows: all the yarn along x is red, in the colours of the
/// range. Curves give the same over their frame 0. Seen red with frame 1 for frame 0.
#[test]
fn tension_colours_a_stretched_swatch() {
    let Some(_) = gpu::adapter() else { return };
    let out = tempfile::tempdir().unwrap();
    let motion = stretched(out.path(), &[1.0, 1.3]);
    let (motion, curves) = (motion.to_string_lossy(), out.path().join("c.npz"));
    let curves = curves.to_string_lossy();
    let swatch = "stitches/swatch.smobj";
    let embedded = ["--frames", &motion, "--mode", "embed"];
    let relax = [&["relax", swatch, "-q", "-o", &curves][..], &embedded].concat();
    assert_eq!(knotmesh(&relax).0, 0);
    let look = ["--style", "tension", "--range", "0.7,1.3", "--no-legend", "--background", "transparent"];
    render(&curves, &out.path().join("c.png"), &look);
    let balance = |name: &str| {
        let picture = read(&out.path().join(name));
        let all = picture.pixels.iter().flatten().filter(|p| p[3] == 255);
        let (sum, count) = all.fold((0, 0), |(s, n), p| (s + i64::from(p[0]) - i64::from(p[2]), n + 1));
        sum as f64 / f64::from(count)
    };
    // Off-white at rest: about as much red as blue.
    assert!(balance("c.0000.png").abs() < 12.0, "{}", balance("c.0000.png"));
    assert!(balance("c.0001.png") > 25.0, "{}", balance("c.0001.png"));
}

/// A mesh's frame at its own positions, in the mode `embed`.
fn embedded(mesh: &StitchMesh) -> (Scene, FrameOutput<f64>) {
    let options = SceneOptions { mode: Mode::Embed, gauge: Some(1.0), ..SceneOptions::default() };
    let scene = Scene::compile(mesh, &TemplateLibrary::embedded(), options).unwrap();
    let shared = std::sync::Arc::new(scene.clone());
    let mut backend = CpuBackend::new(shared, &Settings::default(), &Running::default()).unwrap();
    let mut output = FrameOutput::default();
    backend.frame(&mesh.positions, &mut output).unwrap();
    (scene, output)
}

/// Of one face, tightness is the length of all of its yarn times its width, over a rectangle's area.
///
/// Seen red with the radius for the width.
#[test]
fn tightness_of_one_face_is_what_it_is_by_hand() {
    let mut mesh = knotmesh::io::smobj::read_file(Path::new("stitches/swatch.smobj")).unwrap();
    let face = (0..mesh.face_count()).find(|f| mesh.face_type((*f).into()).name == "knit+").unwrap();
    let [begin, end] = [0, 1].map(|k| mesh.face_offsets[face + k] as usize);
    mesh.face_vertices = mesh.face_vertices[begin..end].to_vec();
    mesh.face_offsets = vec![0, 4];
    mesh.face_types = vec![mesh.face_types[face]];
    (mesh.face_source, mesh.face_origins) = (Vec::new(), Vec::new());
    mesh.joins.clear();
    mesh.checkpoints.clear();
    for width in [1.0, 2.0] {
        let corners = [(0.0, 0.0), (width, 0.0), (width, 0.61), (0.0, 0.61)];
        for (vertex, (x, y)) in mesh.face_vertices.iter().zip(corners) {
            mesh.positions[vertex.index()] = glam::DVec3::new(x, y, 0.0);
        }
        let (scene, output) = embedded(&mesh);
        let strands = Strands::of_frame(&mesh, &scene, &output);
        let length = |yarn: usize| {
            let points = &output.points[scene.yarns.range(yarn)];
            points.windows(2).map(|p| (p[1] - p[0]).to_f64().length()).sum::<f64>()
        };
        let length: f64 = (0..scene.yarns.len()).map(length).sum();
        let expected = length * 0.2 / (width * 0.61);
        let found = Style::Tightness.of_frame(&strands, &scene, &output, &mesh.positions);
        let near = |t: &f32| (f64::from(*t) / expected - 1.0).abs() < 1e-5;
        assert!(found.iter().all(near), "{found:?}, by hand {expected}");
        assert!(expected > 0.3 && expected < 2.0, "{expected}");
    }
}

/// The rib has 12 columns: 6 of knits, 6 of purls. Seen red with the least frequent first.
#[test]
fn kinds_are_counted_the_most_frequent_first() {
    let mesh = knotmesh::io::smobj::read_file(Path::new("stitches/rib.smobj")).unwrap();
    let found = kinds(&mesh, &embedded(&mesh).0);
    let found: Vec<(&str, usize)> = found.iter().map(|k| (k.name.as_str(), k.count)).collect();
    assert_eq!(found[..4], [("knit-", 42), ("purl-", 42), ("knit+", 36), ("purl+", 36)]);
    assert_eq!(found.iter().map(|k| k.1).sum::<usize>(), mesh.face_count());
}
