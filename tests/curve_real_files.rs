//! Real curve files hold what an independent parser found in them, and pass through every format.

mod common;

use common::curves::{EXTENSIONS, assert_same};
use common::data;
use knotmesh::io::convert::convert;
use knotmesh::io::curve_info::curve_info;
use knotmesh::io::curves::{CurveReader, UpAxis, WriteOptions, read_curves};
use knotmesh::yarn::Curves;

/// Curves, closed ones, points, length, box and a word of the notes, computed by a separate script.
type Facts = (&'static str, usize, usize, usize, f64, [f64; 3], [f64; 3], &'static str);

#[rustfmt::skip]
const REAL: [Facts; 11] = [
    ("bcc/glove.bcc", 70, 70, 58537, 13925.146478, [-13.90100, -17.32785, -12.99660], [13.90100, 17.32785, 12.99660], "8 closed curves repeated"),
    ("bcc/openwork_trellis_pattern.bcc", 1, 0, 19730, 2734.712151, [-10.84405, -7.30163, -0.56954], [10.84405, 7.30163, 0.56954], ""),
    ("bcc/tea_cozy.bcc", 22, 22, 184151, 37418.499392, [-19.71785, -11.54141, -20.38320], [19.71785, 11.54141, 20.38320], "2 closed curves end far"),
    ("smobj/decrease.yarns", 1, 0, 103, 69.029053, [-4.38247, -0.30500, -0.34487], [4.07771, 4.43015, 0.40318], ""),
    ("smobj/k.yarns", 1, 0, 5745, 1421.319790, [-0.75000, 0.25000, -1.08444], [21.87500, 21.62732, 1.08444], ""),
    ("smobj/twill.yarns", 10, 0, 160, 23.538702, [-0.20000, -0.20000, -0.10939], [1.80000, 1.80000, 0.10939], ""),
    ("yarns/knit-4x4.yarns", 1, 0, 225, 72.032023, [-0.37500, 0.25000, -0.11875], [4.37500, 4.75232, 0.09310], ""),
    ("yarns/short-row.yarns", 1, 0, 304, 165.657006, [-5.75440, -3.34900, -0.19413], [6.97005, 3.42372, 0.15220], ""),
    ("yarns/sock.yarns", 1, 0, 29280, 8510.994575, [-0.67188, 0.25000, -1.10072], [25.04690, 107.75232, 1.10072], ""),
    ("obj-lines/blenderobj.obj", 2, 2, 9600, 152.953317, [-1.01, -1.00514, -1.00514], [1.01, 1.00514, 1.00514], "2 curves of two-point lines"),
    ("obj-lines/houdiniobj.obj", 2, 2, 9600, 150.940816, [-1.0, -0.99518, -0.99518], [1.0, 0.99518, 0.99518], ""),
];

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn real_files() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    for (name, curves, closed, points, length, low, high, note) in REAL {
        let info = curve_info(&data.join(name)).unwrap();
        assert_eq!(
            (info.frames, info.curves, info.closed, info.points),
            (1, curves, closed, points),
            "{name}"
        );
        assert!((info.length - length).abs() < 1e-5, "{name}: {}", info.length);
        let bounds = info.bounds.unwrap();
        for k in 0..3 {
            assert!(
                (bounds[0][k] - low[k]).abs() < 6e-6 && (bounds[1][k] - high[k]).abs() < 6e-6,
                "{name}: {bounds:?}"
            );
        }
        assert_eq!(info.notes.is_empty(), note.is_empty(), "{name}: {:?}", info.notes);
        assert!(
            note.is_empty() || info.notes.iter().any(|n| n.starts_with(note)),
            "{name}: {:?}",
            info.notes
        );
        // Through every other format and back.
        let original = read_curves(&data.join(name)).unwrap().remove(0);
        for extension in EXTENSIONS {
            let path = folder.path().join(format!("a.{extension}"));
            convert(&data.join(name), &path, &WriteOptions { radius: Some(0.1), ..Default::default() })
                .unwrap();
            let found = read_curves(&path).unwrap().remove(0);
            assert_same(&found, &Curves { radius: found.radius.clone(), ..original.clone() }, 1e-5, name);
        }
    }
    let up = |name: &str| CurveReader::open(&data.join(name)).unwrap().header.up;
    assert_eq!(up("bcc/glove.bcc"), Some(UpAxis::Y));
    assert_eq!(up("bcc/openwork_trellis_pattern.bcc"), Some(UpAxis::Z));
    let cozy = curve_info(&data.join("bcc/tea_cozy.bcc")).unwrap();
    assert!(cozy.notes.iter().any(|n| n.contains("36.236782, of curve 2")), "{:?}", cozy.notes);
}

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn real_yarns() {
    let Some(data) = data() else { return };
    let sock = read_curves(&data.join("yarns/sock.yarns")).unwrap().remove(0);
    assert_eq!(sock.radius, [Some(0.0657692551612854)]);
    let names: Vec<_> = sock.units.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["1", "in", "na", "nb", "l67", "g", "l78", "h78", "out"]);
    assert_eq!(sock.units[2].1, 0.1f32 as f64);
    assert_eq!(sock.checkpoints.len(), 3100);
    let first: Vec<_> = sock.checkpoints[..3].iter().map(|c| (c.point, c.length, c.unit)).collect();
    assert_eq!(first, [(0, 1.0, 1), (0, 56.0, 2), (0, 28.0, 3)]);
    assert_eq!((sock.sources[0], sock.sources[12], sock.sources.len()), (5, 27, 29280));
    let twill = read_curves(&data.join("smobj/twill.yarns")).unwrap().remove(0);
    assert!(twill.radius.iter().all(|r| *r == Some(0.09999999403953552)));
    // What is written again is the same but for colours.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.yarns");
    for name in ["yarns/sock.yarns", "smobj/twill.yarns", "smobj/k.yarns"] {
        convert(&data.join(name), &path, &WriteOptions::default()).unwrap();
        let mut expected = std::fs::read(data.join(name)).unwrap();
        let found = std::fs::read(&path).unwrap();
        let yarn = expected.windows(4).position(|w| w == b"yarn").unwrap();
        let size = u32::from_le_bytes(expected[yarn + 4..yarn + 8].try_into().unwrap()) as usize;
        for at in (yarn + 8..yarn + 8 + size).step_by(16) {
            expected[at + 12..at + 16].copy_from_slice(&found[at + 12..at + 16]);
        }
        assert!(found == expected, "{name}");
    }
}
