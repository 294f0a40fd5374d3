//! `knotmesh relax --backend database`.

use crate::common::{fabric, npy::npy};
use crate::folder::Folder;
use glam::{DVec2, DVec3};
use knotmesh::database::{Bending, Compat, FaceWeights, Settings};
use knotmesh::io::{curves::read_curves, obj_mesh, yarn_model};
use serde_json::Value;
use std::path::Path;

const FORMATS: [&str; 7] = ["yarns", "bcc", "obj", "npz", "usda", "txt", "pbrt"];
/// Extra points a segment that uniform splines have at least.
const SPLINE: usize = 6;

#[test]
fn cloth_goes_into_every_format() {
    let folder = Folder::new();
    let outputs: String = FORMATS.iter().map(|f| format!(" -o a.{f}")).collect();
    folder.relax(&format!("cloth.obj --model model{outputs}"));
    let expected = folder.expected(Settings::default(), &folder.frames[..1]);
    for format in FORMATS {
        let file = folder.at(&format!("a.{format}"));
        let (code, message) = folder.knotmesh(&format!("info {}", file.display()));
        assert_eq!(code, 0, "{format}: {message}");
        let Ok(curves) = read_curves(&file) else {
            assert!(["txt", "pbrt"].contains(&format), "{format}");
            continue;
        };
        assert_eq!(curves.len(), 1, "{format}");
        assert_eq!(curves[0].closed.len(), expected.fabric.yarn_count(), "{format}");
        let subdivide = if ["bcc", "usda"].contains(&format) { SPLINE } else { 4 };
        let first = expected.fabric.yarn(0).len();
        assert_eq!(curves[0].offsets[1], (first - 1) * (subdivide + 1) + 1, "{format}");
        for point in 0..first {
            let off = curves[0].points[point * (subdivide + 1)] - expected.frames[0].0.world(point);
            // Single precision, of a decimetre.
            assert!(off.length() < 2e-8, "{format}: {off}");
        }
    }
}

/// The arrays are what the library gives, in either precision and however finely sampled. Seen red with rows and columns of
/// periods exchanged, and with arc lengths of the point before.
#[test]
fn result_files_hold_their_arrays() {
    let folder = Folder::new();
    let expected = folder.expected(Settings::default(), &folder.frames);
    let fabric = &expected.fabric;
    let (yarns, radius) = (fabric.yarn_count(), fabric.model.pattern.radius);
    for (subdivide, precision) in [(0usize, "f64"), (0, "f32"), (4, "f64"), (4, "f32")] {
        folder.relax(&format!(
            "cloth.bin --model model -o a.npz --subdivide {subdivide} --precision {precision}"
        ));
        let step = subdivide + 1;
        let samples: usize = (0..yarns).map(|y| (fabric.yarn(y).len() - 1) * step + 1).sum();
        let (float, size) = if precision == "f32" { ("<f4", 4) } else { ("<f8", 8) };
        let mut shapes = vec![
            format!("arclength [{samples}] '{float}'"),
            format!("director [5, {samples}, 3] '{float}'"),
            format!("point_face [{samples}] '<i4'"),
            format!("point_tile [{samples}, 2] '<i4'"),
            format!("point_vertex [{samples}] '<i4'"),
            format!("points [5, {samples}, 3] '{float}'"),
            format!("radius [] '{float}'"),
            format!("twist [5, {samples}] '{float}'"),
            format!("yarn_closed [{yarns}] '|b1'"),
            format!("yarn_offsets [{}] '<u4'", yarns + 1),
        ];
        let mut file = folder.result("a.npz");
        if size == 4 {
            shapes.insert(2, "origin [3] '<f8'".into());
        }
        assert_eq!(file.shapes(), shapes);

        let origin = if size == 4 { file.vectors("origin")[0] } else { DVec3::ZERO };
        let near = if size == 4 { 1.0 } else { 0.0 };
        assert!((file.floats("radius")[0] - radius).abs() <= 1e-9 * near);
        assert!(file.array::<bool>("yarn_closed").iter().all(|closed| !closed));
        let offsets = file.array::<u32>("yarn_offsets");
        let (tiles, vertices) = (file.array::<i32>("point_tile"), file.array::<i32>("point_vertex"));
        let (faces, lengths) = (file.array::<i32>("point_face"), file.floats("arclength"));
        let (points, directors) = (file.vectors("points"), file.vectors("director"));
        let twists = file.floats("twist");
        let (all_vertices, all_faces, all_lengths) =
            (fabric.point_vertices(), fabric.point_faces(), fabric.arclengths());
        for yarn in 0..yarns {
            let range = fabric.yarn(yarn);
            let begin = offsets[yarn] as usize;
            assert_eq!(offsets[yarn + 1] as usize - begin, (range.len() - 1) * step + 1);
            for sample in 0..(range.len() - 1) * step + 1 {
                let (point, at) = (range.start + sample / step, begin + sample);
                let tile = fabric.tiles[fabric.point_tiles[point] as usize];
                assert_eq!(tiles[2 * at..2 * at + 2], [tile.y, tile.x]);
                assert_eq!(vertices[at] as u32, all_vertices[point]);
                assert_eq!(faces[at] as u32, all_faces[point]);
                let edge = all_lengths.get(point + 1).filter(|_| point + 1 < range.end);
                let share = (sample % step) as f64 / step as f64;
                let length = all_lengths[point] + edge.map_or(0.0, |e| share * (e - all_lengths[point]));
                assert!((lengths[at] - length).abs() <= 1e-12 + 1e-7 * near, "{} {length}", lengths[at]);
                for (frame, (yarn, expected)) in expected.frames.iter().enumerate() {
                    let at = frame * samples + at;
                    assert!((twists[at] - yarn.twists[point]).abs() <= 1e-5 * near);
                    assert!((directors[at] - expected[point]).length() <= 1e-3 * near);
                    if sample % step == 0 {
                        let off = (points[at] + origin - yarn.world(point)).length();
                        assert!(off <= 1e-15 + 2e-7 * near, "{frame} {point}: {off}");
                    }
                }
            }
        }
    }
}

/// Frames of a range are those of a run of all frames, to the byte: numbered files, and what a result file holds of them.
/// Seen red with places relative to the middle of the range's first frame.
#[test]
fn a_range_of_frames_is_that_of_the_whole_run() {
    let folder = Folder::new();
    for skip in ["unmoved", "none"] {
        for precision in ["f32", "f64"] {
            let line = format!("cloth.bin --model model --skip {skip} --precision {precision}");
            folder.relax(&format!("{line} -o all.%04d.bcc -o all.npz"));
            folder.relax(&format!("{line} -o some.%04d.bcc -o some.npz --frame-range 2:-1"));
            for frame in 0..5 {
                let some = folder.at(&format!("some.{frame:04}.bcc"));
                if !(2..4).contains(&frame) {
                    assert!(!some.exists());
                    continue;
                }
                let all = folder.read(&format!("all.{frame:04}.bcc"));
                assert!(all == std::fs::read(some).unwrap(), "{skip} {precision} {frame}");
            }
            let (mut all, mut some) = (folder.result("all.npz"), folder.result("some.npz"));
            for name in ["points", "twist", "director"] {
                let (all, some) = (all.floats(name), some.floats(name));
                assert!(all[all.len() * 2 / 5..all.len() * 4 / 5] == some, "{name}");
            }
        }
    }
    // Frame 1 is frame 0 again.
    assert!(folder.read("all.0000.bcc") == folder.read("all.0001.bcc"));
    assert!(folder.read("all.0001.bcc") != folder.read("all.0002.bcc"));
}

/// Wherever mesh, frames and model come from, the file is the same.
#[test]
fn sources_do_not_matter() {
    let folder = Folder::new();
    folder.relax("cloth.bin --model model -o a.npz");
    folder.relax("cloth.obj --frames frames.npy --model model -o b.npz");
    folder.relax("cloth.bin --frames frames.npy --model model.npz --threads 1 --lanes 1 -o c.npz");
    assert!(folder.read("a.npz") == folder.read("b.npz"));
    assert!(folder.read("a.npz") == folder.read("c.npz"));
    // Without frames, an OBJ's own positions are the one frame.
    folder.relax("cloth.obj --model model --subdivide 0 --precision f64 -o d.npz");
    folder.relax("cloth.bin --model model --subdivide 0 --precision f64 --frame-range :1 -o e.npz");
    assert!(folder.read("d.npz") == folder.read("e.npz"));
}

/// Each switch is the library's setting. Seen red with each of them left out.
#[test]
fn switches_are_settings() {
    let folder = Folder::new();
    let default = Settings::default();
    let plain = folder.expected(default, &folder.frames[..1]);
    for (line, settings) in [
        ("", default),
        ("--compat madypg", Settings { compat: Compat::Madypg, ..default }),
        ("--bending none", Settings { bending: Bending::None, ..default }),
        ("--phong 0.25", Settings { phong: 0.25, ..default }),
        ("--displacement -0.5", Settings { displacement: -0.5, ..default }),
        ("--face-weights equal", Settings { weights: FaceWeights::Equal, ..default }),
        ("--min-eigenvalue 1", Settings { min_eigenvalue: 1.0, ..default }),
    ] {
        folder.relax(&format!("cloth.obj --model model --subdivide 0 --precision f64 {line} -o a.npz"));
        let expected = folder.expected(settings, &folder.frames[..1]);
        let (frame, directors) = &expected.frames[0];
        let mut file = folder.result("a.npz");
        let points = file.vectors("points");
        let same = points.iter().enumerate().all(|(p, place)| *place == frame.world(p));
        assert!(points.len() == expected.fabric.point_count() && same, "{line}");
        assert!(file.vectors("director") == *directors, "{line}");
        let changed = points.iter().enumerate().any(|(p, place)| *place != plain.frames[0].0.world(p));
        assert_eq!(changed, !line.is_empty(), "{line}");
    }
}

/// Centimetres in, centimetres out; frames as well. Seen red with positions of frames left as they are.
#[test]
fn scales_are_of_all_that_is_in_and_out() {
    let folder = Folder::new();
    let far: Vec<Vec<DVec3>> = folder.frames.iter().map(|f| f.iter().map(|p| *p * 100.0).collect()).collect();
    obj_mesh::write(&folder.at("large.obj"), &folder.mesh.clone().scaled(100.0)).unwrap();
    folder.write_frames("large.npy", &far);
    let line = "--model model --precision f64 --subdivide 3";
    folder.relax(&format!("cloth.obj --frames frames.npy {line} -o a.npz"));
    folder.relax(&format!("large.obj --frames large.npy {line} --scale 0.01 -o b.npz"));
    let (mut one, mut other) = (folder.result("a.npz"), folder.result("b.npz"));
    for name in ["points", "radius", "arclength"] {
        let (one, other) = (one.floats(name), other.floats(name));
        assert_eq!(one.len(), other.len());
        for (a, b) in one.iter().zip(other) {
            assert!((a * 100.0 - b).abs() < 1e-6, "{name}: {a} {b}");
        }
    }
    for (a, b) in one.floats("twist").iter().zip(other.floats("twist")) {
        assert!((a - b).abs() < 1e-6);
    }
}

/// Faces are those of the file: quads are two triangles each. Hidden ones keep their yarn. Seen red with triangles taken for
/// the file's faces, and with the mask of the first frame taken for all.
#[test]
fn hidden_polygons_keep_their_yarn() {
    const SIDE: usize = 8;
    let folder = Folder::new();
    let mut text = String::new();
    let places = || (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| DVec2::new(i as f64, j as f64) * 0.01));
    for uv in places() {
        text += &format!("v {} {} 0\nvt {} {}\n", uv.x, uv.y, uv.x, uv.y);
    }
    for face in 0..SIDE * SIDE {
        let a = face / SIDE * (SIDE + 1) + face % SIDE + 1;
        let corners = [a, a + 1, a + SIDE + 2, a + SIDE + 1].map(|v| format!(" {v}/{v}"));
        text += &format!("f{}\n", corners.concat());
    }
    std::fs::write(folder.at("quads.obj"), text).unwrap();
    let frames = [1.0, 1.1, 1.2].map(|s| places().map(|p| (p * s).extend(0.0)).collect());
    folder.write_frames("quads.npy", &frames);
    // All, the right half, the left half.
    let wanted = |frame: usize, face: usize| match frame {
        0 => true,
        1 => face % SIDE >= SIDE / 2,
        _ => face % SIDE < SIDE / 2,
    };
    let mask: Vec<u8> =
        (0..3).flat_map(|frame| (0..SIDE * SIDE).map(move |face| wanted(frame, face).into())).collect();
    std::fs::write(folder.at("mask.npy"), npy("|u1", false, &[3, SIDE * SIDE], &mask)).unwrap();
    let line = "quads.obj --frames quads.npy --model model --subdivide 0 --precision f64";
    folder.relax(&format!("{line} -o all.npz"));
    folder.relax(&format!("{line} --visible mask.npy -o seen.npz --report seen.json"));
    let (mut all, mut seen) = (folder.result("all.npz"), folder.result("seen.npz"));
    let faces = seen.array::<i32>("point_face");
    let (all, seen) = (all.vectors("points"), seen.vectors("points"));
    let count = faces.len();
    let report: Value = serde_json::from_slice(&folder.read("seen.json")).unwrap();
    for frame in 0..3 {
        let mut hidden = 0;
        for (point, face) in faces.iter().enumerate() {
            let at = frame * count + point;
            let shown = wanted(frame, *face as usize);
            hidden += usize::from(!shown);
            assert!(seen[at] == if shown { all[at] } else { seen[at - count] }, "{frame} {face}");
        }
        assert!(frame == 0 || hidden > count / 3 && hidden < count * 2 / 3);
        assert_eq!(report["frames"][frame]["skipped"]["hidden"], hidden);
    }
}

#[test]
fn reports_hold_counts_and_times() {
    let folder = Folder::new();
    // Stretched beyond the table.
    let far = folder.mesh.uvs.iter().map(|uv| DVec3::new(2.5 * uv.x, uv.y, 0.0)).collect();
    folder.write_frames("far.npy", &[folder.frames[0].clone(), far]);
    let line = "relax --backend database cloth.obj --frames far.npy --model model -o a.bcc --report a.json";
    let (code, message) = folder.knotmesh(line);
    assert_eq!(code, 0, "{message}");
    let fabric = folder.expected(Settings::default(), &[]).fabric;
    let points = fabric.point_count();
    assert_eq!(
        message.trim_end(),
        format!(
            "knotmesh: warning: strains beyond the table's: up to {points} of {points} points (frame 1), displaced as at \
             its border"
        )
    );
    let report: Value = serde_json::from_slice(&folder.read("a.json")).unwrap();
    for (name, expected) in [
        ("points", points),
        ("yarns", fabric.yarn_count()),
        ("yarns_closed", 0),
        ("vertices", folder.mesh.positions.len()),
        ("faces", folder.mesh.faces.len()),
        ("pattern_vertices", 40),
    ] {
        assert_eq!(report[name], expected, "{name}");
    }
    assert_eq!(report["files"], serde_json::json!(["a.0000.bcc", "a.0001.bcc"]));
    assert_eq!(report["frames"][1]["outside"], points);
    assert!(report["frames"][0]["outside"].as_u64().unwrap() < points as u64 / 2);
    assert_eq!(report["adapter"], Value::Null);
    for stage in ["parse", "compile", "read_frames", "solve", "write", "total"] {
        assert!(report["seconds"][stage].as_f64().unwrap() > 0.0, "{stage}");
    }
}

#[test]
fn errors_are_one_line_exit_2_and_leave_nothing_behind() {
    let folder = Folder::new();
    let text = String::from_utf8(folder.read("cloth.obj")).unwrap();
    let bare: String = text
        .lines()
        .filter(|line| !line.starts_with("vt "))
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => {
                let names = corners.split(' ').map(|c| c.split('/').next().unwrap());
                format!("f {}\n", names.collect::<Vec<_>>().join(" "))
            }
            None => format!("{line}\n"),
        })
        .collect();
    std::fs::write(folder.at("bare.obj"), bare).unwrap();
    obj_mesh::write(&folder.at("small.obj"), &folder.mesh.clone().scaled(1e-3)).unwrap();
    let fewer: Vec<Vec<DVec3>> = folder.frames.iter().map(|f| f[1..].to_vec()).collect();
    folder.write_frames("fewer.npy", &fewer);
    yarn_model::write_dir(&folder.at("bad"), &fabric::model(20, 4)).unwrap();
    let pattern = String::from_utf8(folder.read("bad/pyp")).unwrap();
    let line = pattern.lines().position(|l| l.starts_with("*Q")).unwrap() + 2;
    let row = pattern.lines().nth(line - 1).unwrap();
    std::fs::write(folder.at("bad/pyp"), pattern.replacen(row, "0.1 north 0 0", 1)).unwrap();
    std::fs::write(folder.at("mask.npy"), npy("|u1", false, &[3], &[1; 3])).unwrap();
    let malformed = format!("bad/pyp:{line}:5: found 'north', expected");
    let with_model = "--backend database --model model -o a.npz";
    let database = |line: &str| format!("{line} {with_model}");
    let vertices = folder.mesh.positions.len();
    let wrong_frames = format!("[frame, {vertices}, 3]");
    let mut cases: Vec<(String, &str)> = vec![
        ("cloth.obj --backend database -o a.npz".into(), "--model <DIR|FILE.npz>"),
        ("cloth.obj --model model -o a.npz".into(), "--model model: expected --backend database beside it"),
        ("cloth.obj --phong 0.5 -o a.npz".into(), "--model <DIR|FILE.npz>"),
        (database("bare.obj"), "a face without texture coordinates"),
        (database("small.obj"), "found no yarn on the mesh"),
        (database("none.obj"), "none.obj: "),
        (database("none.bin"), "none.bin: "),
        (database("model.npz"), "found a file of kind '.npz', expected cloth"),
        ("cloth.obj --backend database --model bad -o a.npz".into(), &malformed),
        ("cloth.obj --backend database --model none -o a.npz".into(), "none: "),
        ("cloth.obj --backend database --model cloth.obj -o a.npz".into(), "expected a yarn model"),
        ("cloth.obj --backend database --model model.npz -o model.npz".into(), "would replace an input"),
        (
            "cloth.obj --backend database --model model -o a.npz --report model/pyp".into(),
            "would replace an input",
        ),
        (database("cloth.obj --report cloth.obj"), "would replace an input"),
        (database("cloth.obj --frame-range 0:1"), "--frame-range: expected --frames or a .bin"),
        (database("cloth.bin --frame-range 7:9"), "frames '7:9': 7 is out of range"),
        (database("cloth.obj --frames fewer.npy"), &wrong_frames),
        (database("cloth.bin --frames fewer.npy"), &wrong_frames),
        (database("cloth.obj --visible mask.npy"), "mask.npy"),
        (database("cloth.obj --phong 2"), "phong"),
        (database("cloth.obj --min-eigenvalue nan"), "min-eigenvalue"),
        (database("cloth.obj --displacement inf"), "displacement"),
        (database("cloth.obj --scale 0"), "--scale: found 0, expected a positive number"),
        (database("cloth.obj --scale nan"), "--scale: found NaN, expected a positive number"),
        (database("cloth.obj --scale 1e12"), "--scale changes them"),
        (database("cloth.obj --subdivide 1001"), "--subdivide goes to 1000"),
        (database("cloth.obj --compat others"), "'others'"),
    ];
    let knots = [
        "--mode knots",
        "--solver gauss-newton",
        "--start affine",
        "--iterations 3",
        "--beta 0.5",
        "--weight-angle 2",
        "--weight-length 2",
        "--gauge 0.1",
        "--coordinates wachspress",
        "--skip-unknown",
        "--allow-degenerate",
    ];
    for option in knots {
        cases.push((database(&format!("cloth.obj {option}")), option.split(' ').next().unwrap()));
    }
    let names = folder.names();
    let model = folder.read("model.npz");
    for (line, expected) in cases {
        let (code, message) = folder.knotmesh(&format!("relax {line}"));
        assert_eq!(code, 2, "{line}: {message}");
        assert_eq!(message.trim_end().lines().count(), 1, "{line}: {message}");
        assert!(message.starts_with("knotmesh: ") && message.contains(expected), "{line}: {message}");
        assert_eq!(folder.names(), names, "{line}");
    }
    assert!(folder.read("model.npz") == model);
    assert!(yarn_model::read(Path::new(&folder.at("model"))).is_ok());
}
