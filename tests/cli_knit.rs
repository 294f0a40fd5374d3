//! `knotmesh knit` from the command line: what it writes, what it says, what it refuses.

use assert_cmd::Command;
use knotmesh::io::smobj;
use std::path::Path;

fn knotmesh() -> Command {
    Command::cargo_bin("knotmesh").unwrap()
}

const PATTERN: &str = "\
title \"Cuff\"
gauge 20 x 30
size S: n = 16
size M: n = 20
color red #c0392b
piece cuff round
co {n}
Rnds 1-4: *k1, p1; rep from *
Rnd 5: with red, k
bo
";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cuff.knit"), PATTERN).unwrap();
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output = knotmesh().current_dir(folder).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

/// Seen red with the `N` line's column left out, and with the first size always.
#[test]
fn a_pattern_becomes_a_mesh() {
    let folder = folder();
    let (code, out, err) = run(folder.path(), &["knit", "cuff.knit", "-o", "cuff.smobj"]);
    assert_eq!((code, out.as_str(), err.as_str()), (0, "", ""));
    let mesh = smobj::read_file(&folder.path().join("cuff.smobj")).unwrap();
    // Cast-on, five rounds, bind-off, where the yarn begins and ends.
    assert_eq!(mesh.face_count(), 16 * 7 + 2);
    let lines: Vec<u32> = mesh.face_source.clone();
    assert_eq!(lines.iter().filter(|l| **l == 8).count(), 4 * 16, "four rounds of line 8");
    // `*k1, p1`: the asterisk is column 12, k 13, p 17.
    let columns: Vec<u32> =
        (0..mesh.face_count()).filter(|f| lines[*f] == 8).map(|f| mesh.face_origins[f].column).collect();
    assert_eq!(&columns[..4], &[12, 16, 12, 16]);
    let red = mesh.face_origins.iter().filter(|o| o.colour == Some([0xc0, 0x39, 0x2b])).count();
    // The round, the bind-off after it, the end of the yarn.
    assert_eq!(red, 16 + 16 + 1);
    // 20 stitches on 10 cm: 16 of them are 8 cm around.
    let around = mesh.positions.iter().map(|p| p.truncate().length().max(p.z.abs())).fold(0.0, f64::max);
    assert!(around < 0.1, "metres: {around}");

    let (code, ..) =
        run(folder.path(), &["knit", "cuff.knit", "-o", "m.smobj", "--size", "M", "--gauge", "40"]);
    assert_eq!(code, 0);
    assert_eq!(smobj::read_file(&folder.path().join("m.smobj")).unwrap().face_count(), 20 * 7 + 2);
}

/// Seen red with bound-off stitches left out of the total.
#[test]
fn check_counts_and_writes_nothing() {
    let folder = folder();
    let (code, out, err) = run(folder.path(), &["knit", "cuff.knit", "--check", "--size", "m"]);
    assert_eq!((code, err.as_str()), (0, ""));
    for line in [
        "Cuff",
        "size: m",
        "gauge: 20.0000 x 30.0000 on 10 cm",
        "stitches: 140",
        "piece cuff: in the round, 7 rounds, at most 20 stitches",
    ] {
        assert!(out.lines().any(|l| l == line), "{line} in\n{out}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn what_is_wrong_is_one_line() {
    let folder = folder();
    let path = folder.path();
    std::fs::write(path.join("bad.knit"), "co 10\nRow 1: k4, k2tog, k5\n").unwrap();
    std::fs::write(path.join("bytes.knit"), b"co 10\nRow\xff").unwrap();
    let cases: &[(&[&str], &str)] = &[
        (
            &["knit", "bad.knit", "-o", "x.smobj"],
            "knotmesh: bad.knit:2:19: found a stitch that uses 1, with 0 left, expected as many stitches as the row before made",
        ),
        (
            &["knit", "bytes.knit", "-o", "x.smobj"],
            "knotmesh: bytes.knit:2:4: found bytes that are not UTF-8, expected a text file",
        ),
        (
            &["knit", "cuff.knit", "-o", "x.smobj", "--size", "XL"],
            "knotmesh: cuff.knit:1:1: found no size 'xl', expected one of its sizes (m, s)",
        ),
        (
            &["knit", "cuff.knit", "-o", "x.obj"],
            "knotmesh: x.obj: found another kind of output, expected .smobj",
        ),
        (
            &["knit", "none.knit", "-o", "x.smobj"],
            "knotmesh: none.knit: No such file or directory (os error 2)",
        ),
        (
            &["knit", "cuff.knit", "-o", "none/x.smobj"],
            "knotmesh: none/x.smobj: No such file or directory (os error 2)",
        ),
    ];
    for (arguments, message) in cases {
        let (code, out, err) = run(path, arguments);
        assert_eq!((code, out.as_str(), err.trim_end()), (2, "", *message), "{arguments:?}");
    }
    for gauge in ["x", "0", "22x", "22x0", "1e9", "nan"] {
        let (code, _, err) = run(path, &["knit", "cuff.knit", "-o", "x.smobj", "--gauge", gauge]);
        assert_eq!(code, 2, "{gauge}: {err}");
    }
    assert!(!path.join("x.smobj").exists());
}

/// Yarn is as thick as the gauge has it, though ribs are narrow; sizes are those of the gauge, whatever unit the mesh is in. Another gauge
/// takes its place. Seen red with the comment not read, and with its unit forgotten.
#[test]
fn the_gauge_stays_with_the_mesh() {
    let folder = folder();
    let path = folder.path();
    let at = |name: &str| path.join(name);
    std::fs::write(
        at("rib.knit"),
        "gauge 20 x 28\nco 20\nRow 1: *k1, p1; rep from *\nrep row 1 until 16 rows\nbo\n",
    )
    .unwrap();
    let ran = |line: &str| {
        let (code, _, err) = run(path, &line.split(' ').collect::<Vec<_>>());
        assert_eq!((code, err.as_str()), (0, ""), "{line}");
    };
    let report = |name: &str| -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(at(name)).unwrap()).unwrap()
    };
    let near = |value: &serde_json::Value, expected: f64| {
        let value = value.as_f64().unwrap();
        assert!((value - expected).abs() < 1e-12 * expected.abs().max(1.0), "{value} {expected}");
    };
    ran("knit rib.knit -o rough.smobj");
    ran("knit rib.knit -o rib.smobj --relax");
    ran("relax rib.smobj -q -o rib.obj --report a.json");
    near(&report("a.json")["gauge"], 0.005);
    ran("relax-mesh rough.smobj -q -o fine.smobj --report b.json");
    near(&report("b.json")["natural_width"], 0.005);
    near(&report("b.json")["natural_height"], 0.1 / 28.0);

    // In centimetres.
    let mut mesh = knotmesh::io::smobj::read_file(&at("rough.smobj")).unwrap();
    assert_eq!(mesh.gauge, Some([0.1 / 20.0, 0.1 / 28.0]));
    mesh.positions.iter_mut().for_each(|p| *p *= 100.0);
    mesh.gauge = mesh.gauge.map(|size| size.map(|x| x * 100.0));
    let mut out = knotmesh::io::output::Output::create(&at("cm.smobj")).unwrap();
    knotmesh::io::smobj::write(&mesh, &mut out).unwrap();
    out.commit().unwrap();
    ran("relax-mesh cm.smobj -q -o cm-fine.smobj --unit 0.01 --report c.json");
    near(&report("c.json")["natural_width"], 0.005);
    let read = |name: &str| knotmesh::io::smobj::read_file(&at(name)).unwrap();
    assert!((read("cm-fine.smobj").gauge.unwrap()[0] - 0.5).abs() < 1e-12);
    ran("relax-mesh rough.smobj -q -o wide.smobj --gauge 10x14");
    assert!((read("wide.smobj").gauge.unwrap()[0] - 0.01).abs() < 1e-12);
    // Of meshes of other programs nothing is known.
    assert_eq!(knotmesh::io::smobj::read_file("stitches/rib.smobj".as_ref()).unwrap().gauge, None);
}

/// Ribs are given height where that is asked for, in frames of a shard as in those of a whole run. Seen red with the first frame alone
/// folded, and with ribs that keep the height of the first frame.
#[test]
fn ribs_are_folded_when_asked() {
    let folder = folder();
    let path = folder.path();
    let rib = "gauge 20 x 30\nco 10\nRow 1 (RS): k2, *p2, k2; rep from *\nRow 2 (WS): p2, *k2, p2; rep from *\n\
               rep rows 1-2 until 12 rows\nbo\n";
    std::fs::write(path.join("rib.knit"), rib).unwrap();
    std::fs::write(path.join("plain.knit"), "gauge 20 x 30\nco 10\nRow 1: k\nRow 2: p\nRow 3: k\nbo\n")
        .unwrap();
    let ran = |arguments: &[&str]| {
        let (code, _, err) = run(path, arguments);
        assert_eq!((code, err.as_str()), (0, ""), "{arguments:?}");
    };
    let read = |name: &str| std::fs::read_to_string(path.join(name)).unwrap();
    for name in ["rib", "plain"] {
        let (pattern, mesh) = (format!("{name}.knit"), format!("{name}.smobj"));
        ran(&["knit", &pattern, "-o", &mesh, "--relax"]);
        for (out, more) in [("flat", vec![]), ("fold", vec!["--fold-ribs"])] {
            let out = format!("{name}-{out}.obj");
            ran(&[&["relax", &mesh, "--gauge", "0.005", "-q", "-o", &out][..], &more].concat());
        }
    }
    assert_eq!(read("plain-flat.obj"), read("plain-fold.obj"));
    let thick = |text: &str| {
        let z: Vec<f64> = text
            .lines()
            .filter_map(|l| l.strip_prefix("v "))
            .map(|l| l.split(' ').nth(2).unwrap().parse().unwrap())
            .collect();
        z.iter().copied().fold(f64::MIN, f64::max) - z.iter().copied().fold(f64::MAX, f64::min)
    };
    let grown = thick(&read("rib-fold.obj")) - thick(&read("rib-flat.obj"));
    // Crests are twice 2.4 mm apart (0.6 of what keeps 5 mm where 3.1 mm are left); yarn lies between them.
    assert!((0.001..0.003).contains(&grown), "{grown}");

    let mesh = knotmesh::io::smobj::read_file(&path.join("rib.smobj")).unwrap();
    let mut frames = knotmesh::io::frames::FramesWriter::create(&path.join("walk.npy"), 2, &mesh).unwrap();
    for k in 0..2 {
        let wider = glam::DVec3::new(1.0 + 0.2 * f64::from(k), 1.0, 1.0);
        let places: Vec<glam::DVec3> = mesh.positions.iter().map(|p| *p * wider).collect();
        frames.frame(k as usize, &places).unwrap();
    }
    frames.finish().unwrap();
    let relax = ["relax", "rib.smobj", "--gauge", "0.005", "--frames", "walk.npy", "--fold-ribs", "-q"];
    ran(&[&relax[..], &["--skip", "none", "-o", "all.%04d.obj"]].concat());
    ran(&[&relax[..], &["--skip", "none", "-o", "part.%04d.obj", "--frame-range", "1:2"]].concat());
    assert_eq!(read("all.0001.obj"), read("part.0001.obj"));
    ran(&[&relax[..6], &["-q", "--skip", "none", "-o", "flat.%04d.obj"]].concat());
    let [rest, wider, flat] =
        ["all.0000", "all.0001", "flat.0001"].map(|n| thick(&read(&format!("{n}.obj"))));
    assert!(wider < rest - 0.0001, "a stretched rib is flatter: {wider} of {rest}");
    assert!(wider > flat + 0.0005, "but not flat: {wider} of {flat}");
}
