//! The window of `knotmesh view`: it opens, mouse and keys do what they should, pictures change with edits. On a display of its own
//! (Xvfb) where there is none; without Xvfb these tests are skipped, unless `KNOTMESH_REQUIRE_WINDOW` is set.
#![cfg(all(feature = "view", target_os = "linux"))]

use knotmesh::io::frames::FramesWriter;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;

/// A display; the one it started ends with it.
struct Display {
    name: String,
    server: Option<Child>,
}

impl Drop for Display {
    fn drop(&mut self) {
        if let Some(server) = &mut self.server {
            let _ = server.kill();
            let _ = server.wait();
        }
    }
}

/// The display of the tests of this file, or `None` where there is none to be had.
fn display() -> Option<Display> {
    if let Some(name) = std::env::var("DISPLAY").ok().filter(|d| !d.is_empty()) {
        return Some(Display { name, server: None });
    }
    // The server itself picks a number that is free and writes it.
    let server = Command::new("Xvfb")
        .args(["-displayfd", "1", "-screen", "0", "1400x1000x24", "-nolisten", "tcp"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn();
    let mut server = match server {
        Ok(server) => server,
        Err(error) => {
            assert!(std::env::var_os("KNOTMESH_REQUIRE_WINDOW").is_none(), "no Xvfb: {error}");
            eprintln!("skipped: no display and no Xvfb");
            return None;
        }
    };
    let mut line = String::new();
    BufReader::new(server.stdout.take().unwrap()).read_line(&mut line).unwrap();
    Some(Display { name: format!(":{}", line.trim()), server: Some(server) })
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs a script on a file; what was printed, line by line. `None` where there is nothing to draw with.
fn play(display: &Display, folder: &Path, file: &Path, script: &str) -> Option<Vec<Value>> {
    play_on(display, folder, &[file.to_str().unwrap()], script, |_| ())
}

/// The same with arguments; `seen` is called with the number of each line as it is printed.
fn play_on(
    display: &Display,
    folder: &Path,
    args: &[&str],
    script: &str,
    mut seen: impl FnMut(usize),
) -> Option<Vec<Value>> {
    static ONE: OnceLock<std::sync::Mutex<()>> = OnceLock::new();
    // Windows share the screen and the processor.
    let _one = ONE.get_or_init(Default::default).lock();
    let path = folder.join("script.txt");
    std::fs::write(&path, script).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_knotmesh"))
        .current_dir(folder)
        .env("DISPLAY", &display.name)
        .env_remove("WAYLAND_DISPLAY")
        .arg("view")
        .args(args)
        .args(["--window", "800x480", "--script"])
        .arg(&path)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut printed: Vec<Value> = Vec::new();
    for line in BufReader::new(child.stdout.take().unwrap()).lines() {
        printed.push(serde_json::from_str(&line.unwrap()).unwrap());
        seen(printed.len() - 1);
    }
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    if err.contains("no adapter") && std::env::var_os("KNOTMESH_REQUIRE_WINDOW").is_none() {
        eprintln!("skipped: {err}");
        return None;
    }
    assert_eq!((output.status.code(), err), (Some(0), String::new()));
    Some(printed)
}

/// Width, height and pixels.
fn picture(path: &Path) -> (usize, usize, Vec<[u8; 3]>) {
    let decoder = png::Decoder::new(BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let samples = info.color_type.samples();
    let pixels = bytes[..info.buffer_size()].chunks_exact(samples).map(|p| [p[0], p[1], p[2]]).collect();
    (info.width as usize, info.height as usize, pixels)
}

/// The share of a rectangle's pixels that differ by more than a little.
fn differing(a: &Path, b: &Path, area: [usize; 4]) -> f64 {
    let ((width, height, a), (_, _, b)) = (picture(a), picture(b));
    let [left, top, right, bottom] = area;
    assert!(right <= width && bottom <= height && left < right && top < bottom, "{area:?} {width} {height}");
    let mut count = 0;
    for y in top..bottom {
        for x in left..right {
            let (p, q) = (a[y * width + x], b[y * width + x]);
            count += usize::from((0..3).any(|c| p[c].abs_diff(q[c]) > 24));
        }
    }
    count as f64 / ((right - left) * (bottom - top)) as f64
}

fn area(value: &Value) -> [usize; 4] {
    let numbers: Vec<usize> =
        value["knit_area"].as_array().unwrap().iter().map(|n| n.as_f64().unwrap() as usize).collect();
    // Without the counts in the corner.
    [numbers[0] + 4, numbers[1] + 4, numbers[2] - 4, numbers[3] - 90]
}

fn place(value: &Value, name: &str) -> glam::DVec3 {
    let n = |k: usize| value[name][k].as_f64().unwrap();
    glam::DVec3::new(n(0), n(1), n(2))
}

/// Seen red with yarn never updated on the device, and with undo that does not knit again.
#[test]
fn an_edit_is_seen_and_undone() {
    let Some(display) = display() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rib.knit");
    std::fs::copy(root().join("stitches/rib-2x2.knit"), &file).unwrap();
    let script = "\
settle\nprint\nscreenshot a.png\n\
replace *k2, p2; rep from * to last 2 sts, k2 => k\n\
settle\nprint\nscreenshot b.png\n\
key ctrl+z\nsettle\nprint\nscreenshot c.png\n\
key ctrl+shift+z\nkey ctrl+z\nsettle\nset beta 0.2\nsettle\nscreenshot f.png\n\
set mode compare\nsettle\nprint\nscreenshot d.png\n\
set mode relax\npull 0 -0.02 -0.02 0.01 0.05\nsettle\nscreenshot e.png\npicture p.png\nyarn y.bcc\nmesh m.smobj\nprint\n";
    let Some(printed) = play(&display, folder.path(), &file, script) else { return };
    let shot = |name: &str| folder.path().join(name);
    let knit = area(&printed[0]);
    let text = [60, 60, 400, 220];
    assert_eq!(printed[0]["stitches"], printed[1]["stitches"]);
    let (edit, words) =
        (differing(&shot("a.png"), &shot("b.png"), knit), differing(&shot("a.png"), &shot("b.png"), text));
    assert!(edit > 0.1, "the knit is another: {edit}");
    assert!(words > 0.002, "and so is the text: {words}");
    assert_eq!(printed[2]["redo"], 1);
    let back = differing(&shot("a.png"), &shot("c.png"), knit);
    assert!(back < edit / 3.0, "undone, it is what it was: {back} of {edit}");
    let loops = differing(&shot("c.png"), &shot("f.png"), knit);
    assert!(loops > 0.1, "beta is seen: {loops}");
    assert_eq!(printed[3]["modes"], serde_json::json!(["embed", "knots", "relax"]));
    assert!(differing(&shot("c.png"), &shot("d.png"), knit) > 0.1);
    assert!(differing(&shot("f.png"), &shot("e.png"), knit) > 0.1, "a corner is pulled");
    assert_eq!(printed[4]["pulls"], 1);
    assert_eq!(printed[4]["unsaved"], serde_json::json!([]), "saved with the mesh");
    assert_eq!(printed[4]["message"], Value::Null);
    let (width, ..) = picture(&shot("p.png"));
    assert_eq!(width, 1600);
    for name in ["y.bcc", "m.smobj"] {
        assert!(std::fs::metadata(shot(name)).unwrap().len() > 10_000, "{name}");
    }
    // The file itself was not written.
    let before = std::fs::read_to_string(root().join("stitches/rib-2x2.knit")).unwrap();
    assert_eq!(std::fs::read_to_string(&file).unwrap(), before);
}

/// Seen red with shift not asked for (a pan that turns), with the wheel's sign turned, with keys that a text has taken for the knit's
/// own, and with a window that closes unasked.
#[test]
fn mouse_and_keys_are_those_of_blender_and_nothing_is_lost() {
    let Some(display) = display() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rib.knit");
    std::fs::copy(root().join("stitches/rib-2x2.knit"), &file).unwrap();
    let script = "\
settle\nprint\n\
drag middle 600 250 660 250\nprint\n\
drag shift+middle 600 250 630 270\nprint\n\
scroll 600 250 3\nwait 40\nprint\n\
key num1\nkey home\nsettle\nprint\n\
click left 635 250\nwait 3\nprint\n\
key escape\nmove 600 250\nkey g\nmove 600 200\nclick left 600 200\nprint\n\
key ctrl+z\nprint\n\
click left 200 120\nmove 600 250\nwait 2\ntype g\nkey g\nmove 600 220\nwait 2\nprint\n\
close\nwait 3\nprint\nscreenshot ask.png\nkey escape\nwait 3\nprint\n";
    let script = script.replace("num1", "1");
    let Some(printed) = play(&display, folder.path(), &file, &script) else { return };
    let [start, turned, panned, zoomed, home, clicked, pulled, undone, typed, asked, gone_on] = &printed[..]
    else {
        panic!("{}", printed.len());
    };
    let far = |v: &Value| place(v, "eye").distance(place(v, "target"));
    assert_eq!(place(start, "target"), place(turned, "target"), "an orbit");
    assert!(place(start, "eye").distance(place(turned, "eye")) > 0.1 * far(start));
    assert!((far(start) - far(turned)).abs() < 1e-9);
    assert!(place(panned, "target").distance(place(turned, "target")) > 0.01 * far(start), "a pan");
    assert!((far(panned) - far(turned)).abs() < 1e-9);
    assert!(far(zoomed) < 0.95 * far(panned), "nearer: {} {}", far(zoomed), far(panned));
    assert!(place(home, "eye").distance(place(start, "eye")) < 0.01 * far(start), "all, from the front");
    assert!(clicked["selected"].is_u64(), "{clicked}");
    assert_eq!((&pulled["pulls"], &undone["pulls"]), (&1.into(), &0.into()));
    assert_eq!(typed["pulls"], 0, "letters are the text's");
    assert_eq!(typed["unsaved"], serde_json::json!(["the pattern"]));
    assert_eq!((&asked["asked"], &gone_on["asked"]), (&true.into(), &false.into()));
}

/// A file that another program writes is read again; where there are edits, one is asked which to keep. Seen red with the answers
/// exchanged.
#[test]
fn the_file_and_ones_own_edits_are_told_apart() {
    let Some(display) = display() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("patch.knit");
    let pattern = |stitches: usize| format!("co {stitches}\nRow 1: k\nrep row 1 until 6 rows\nbo\n");
    std::fs::write(&file, pattern(10)).unwrap();
    let script = "settle\nprint\npause 1.5\nsettle\nprint\n\
                  replace co 11 => co 12\nsettle\nprint\npause 1.5\nprint\nscreenshot asked.png\n\
                  key tab\nkey enter\nwait 3\nsettle\nprint\n\
                  key ctrl+z\nsettle\nprint\npause 1.5\nprint\n\
                  key tab\nkey tab\nkey enter\nwait 3\nsettle\nprint\nscreenshot gone.png\n";
    // After the first line, while there are edits, and once more.
    let write = |line: usize| {
        let stitches = [(0, 11), (2, 13), (5, 14)].iter().find(|(at, _)| *at == line);
        if let Some((_, stitches)) = stitches {
            std::fs::write(&file, pattern(*stitches)).unwrap();
        }
    };
    let args = [file.to_str().unwrap()];
    let Some(printed) = play_on(&display, folder.path(), &args, script, write) else { return };
    let [start, read, edited, asked, taken, undone, again, kept] = &printed[..] else {
        panic!("{}", printed.len());
    };
    let of = |v: &Value| (v["stitches"].as_u64().unwrap() / 8, v["asked"].as_bool().unwrap());
    let mine = serde_json::json!(["the pattern"]);
    assert_eq!([start, read, edited].map(of), [(10, false), (11, false), (12, false)]);
    assert_eq!([asked, taken].map(of), [(12, true), (13, false)], "the file's");
    assert_eq!([undone, again, kept].map(of), [(12, false), (12, true), (12, false)], "mine");
    assert_eq!([read, taken].map(|v| &v["unsaved"]), [&serde_json::json!([]); 2]);
    assert_eq!([edited, undone, kept].map(|v| &v["unsaved"]), [&mine; 3]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), pattern(14), "nobody wrote it but the other");
    let beside = [40, 130, 440, 180];
    let dim = differing(&folder.path().join("asked.png"), &folder.path().join("gone.png"), beside);
    assert!(dim > 0.9, "all but the question is dim: {dim}");
}

/// Motion plays on the space bar, at its rate, and stops there. Seen red with a frame a picture, whatever that takes.
#[test]
fn frames_are_played() {
    let Some(display) = display() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mesh = knotmesh::io::smobj::read_file(&root().join("stitches/swatch.smobj")).unwrap();
    let frames = folder.path().join("grow.npy");
    let mut writer = FramesWriter::create(&frames, 200, &mesh).unwrap();
    for k in 0..200 {
        let places: Vec<glam::DVec3> = mesh.positions.iter().map(|p| *p * (1.0 - 0.004 * k as f64)).collect();
        writer.frame(k, &places).unwrap();
    }
    writer.finish().unwrap();
    let file = root().join("stitches/swatch.smobj");
    let script = "settle\nprint\nscreenshot a.png\nmove 600 250\nkey space\npause 2\nprint\nkey space\nwait 3\nprint\n\
                  pause 0.7\nsettle\nprint\nscreenshot b.png\nframe 0\nwait 2\nsettle\nprint\nscreenshot c.png\n";
    let args = [file.to_str().unwrap(), "--frames", frames.to_str().unwrap()];
    let Some(printed) = play_on(&display, folder.path(), &args, script, |_| ()) else { return };
    let at: Vec<u64> = printed.iter().map(|v| v["frame"].as_u64().unwrap()).collect();
    let [start, playing, stopped, later, back] = at[..] else { panic!("{at:?}") };
    assert_eq!((start, later, back), (0, stopped, 0));
    // 24 a second, whatever a picture takes.
    assert!((40..=150).contains(&playing) && stopped < playing + 60, "{at:?}");
    let (knit, shot) = (area(&printed[0]), |name: &str| folder.path().join(name));
    let moved = differing(&shot("a.png"), &shot("b.png"), knit);
    let same = differing(&shot("a.png"), &shot("c.png"), knit);
    assert!(moved > 0.1 && same < moved / 20.0, "{moved} {same}");
}

/// Seen red without a look at the display's name before the window library's.
#[test]
fn without_a_display_it_says_so() {
    let run = |name: Option<&str>| -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_knotmesh"));
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        if let Some(name) = name {
            command.env("DISPLAY", name);
        }
        command.arg("view").arg(root().join("stitches/rib-2x2.knit")).output().unwrap()
    };
    // None, and one that nobody answers at.
    for (name, words) in [(None, "display"), (Some(":987"), "window")] {
        let output = run(name);
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{err}");
        assert_eq!(err.lines().count(), 1, "{err}");
        assert!(err.starts_with("knotmesh: ") && err.contains(words), "{err}");
        assert!(output.stdout.is_empty());
    }
}
