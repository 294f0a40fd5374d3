//! Light, valleys, colours. (`proved.rs` runs these, and sees each fail.)

use super::scenes::{apart, far, paint, plain, yarn};
use glam::DVec3;
use knotmesh::render::{Background, Look, Painter, Picture, Shading, Strands};

const SIZE: [u32; 2] = [300, 300];

/// Two yarns across each other, the second in front; 300 pixels are 3 units.
fn cross(gap: f64) -> Strands {
    let line = |d: DVec3, z: f64| (0..13).map(move |i| d * (f64::from(i) / 4.0 - 1.5) + DVec3::Z * z);
    let points: Vec<DVec3> = line(DVec3::X, 0.0).chain(line(DVec3::Y, gap)).collect();
    let mut strands = yarn(&points, false, 0.15);
    strands.offsets = vec![0, 13, 26];
    strands.closed = vec![false; 2];
    strands.radius = vec![0.15; 2];
    strands
}

fn grey(p: [u8; 4]) -> f64 {
    (f64::from(p[0]) + f64::from(p[1]) + f64::from(p[2])) / 3.0
}

/// The mean grey of a box.
fn mean(picture: &Picture, x: std::ops::Range<u32>, y: std::ops::Range<u32>) -> f64 {
    let n = (x.len() * y.len()) as f64;
    y.flat_map(|y| x.clone().map(move |x| (x, y))).map(|(x, y)| grey(picture.at(x, y))).sum::<f64>() / n
}

/// Light comes from the left above, so the yarn in front throws its shadow to the right.
pub fn shadows_fall_away_from_the_light(painter: &Painter) {
    let look = Look { occlusion: false, plies: false, ..plain() };
    let picture =
        |shadows| paint(painter, &cross(0.6), &far(DVec3::ZERO, 3.0), &Look { shadows, ..look }, SIZE);
    let (with, without) = (picture(true), picture(false));
    // The yarn that lies across, beside the other on its right and on its left.
    let (right, left) = (170..215, 85..130);
    let darker = |x: std::ops::Range<u32>| mean(&without, x.clone(), 145..155) - mean(&with, x, 145..155);
    assert!(darker(right.clone()) > 15.0, "right: {}", darker(right));
    assert!(darker(left.clone()).abs() < 2.0, "left: {}", darker(left));
    // Soft edges: the further what throws a shadow, the wider they are (here in columns of one row).
    let edge = |gap: f64| {
        // One pass: the light does not move about.
        let look = |shadows| Look { shadows, samples: 4, ..look };
        let picture = |shadows| paint(painter, &cross(gap), &far(DVec3::ZERO, 3.0), &look(shadows), SIZE);
        let (with, without) = (picture(true), picture(false));
        let row = |p: &Picture, x: u32| mean(p, x..x + 1, 150..151);
        let dark: Vec<f64> = (166..290).map(|x| row(&without, x) - row(&with, x)).collect();
        let most = dark.iter().copied().fold(0.0, f64::max);
        let darkest = dark.iter().rposition(|d| *d > 0.9 * most).unwrap_or(0);
        dark[darkest..].iter().filter(|d| **d > 0.1 * most && **d <= 0.9 * most).count()
    };
    let (near, distant) = (edge(0.4), edge(1.2));
    assert!(distant >= near + 4, "{near} {distant}");
    // What is in front has no shadow.
    assert!((mean(&without, 145..155, 40..60) - mean(&with, 145..155, 40..60)).abs() < 1.0);
}

pub fn valleys_are_darker(painter: &Painter) {
    let look = Look { shadows: false, plies: false, ..plain() };
    let picture =
        |occlusion| paint(painter, &cross(0.3), &far(DVec3::ZERO, 3.0), &Look { occlusion, ..look }, SIZE);
    let (with, without) = (picture(true), picture(false));
    let darker = |x: std::ops::Range<u32>, y: std::ops::Range<u32>| {
        mean(&without, x.clone(), y.clone()) - mean(&with, x, y)
    };
    // Beside the crossing, and far from it.
    assert!(darker(167..171, 145..155) > 4.0, "{}", darker(167..171, 145..155));
    assert!(darker(260..280, 145..155) < 2.0, "{}", darker(260..280, 145..155));
}

pub fn tension_has_the_colours_of_its_range(painter: &Painter) {
    let look = Look { shading: Shading::Tension([0.5, 1.5]), shadows: false, occlusion: false, ..plain() };
    let middle = |stretch: f32| {
        let points: Vec<DVec3> = (0..13).map(|i| DVec3::X * (f64::from(i) / 4.0 - 1.5)).collect();
        let mut strands = yarn(&points, false, 0.4);
        strands.rest = vec![0.25 / stretch; 13];
        paint(painter, &strands, &far(DVec3::ZERO, 3.0), &look, SIZE).at(150, 150)
    };
    let (slack, rest, tense) = (middle(0.5), middle(1.0), middle(1.5));
    assert!(slack[2] > 100 && slack[2] > 2 * slack[0], "{slack:?}");
    assert!(tense[0] > 100 && tense[0] > 2 * tense[2], "{tense:?}");
    assert!(rest[0].abs_diff(rest[2]) < 12 && rest[0] > 180, "{rest:?}");
}

pub fn the_background_is_what_was_asked_for(painter: &Painter) {
    let strands = yarn(&[DVec3::ZERO, DVec3::X * 0.1], false, 0.01);
    let background = Background::Gradient([200, 10, 30], [20, 150, 250]);
    let look = Look { background, ..Look::default() };
    let picture = paint(painter, &strands, &far(DVec3::ZERO, 3.0), &look, SIZE);
    let (top, bottom) = (picture.at(5, 0), picture.at(5, 299));
    assert!(top[0].abs_diff(200) < 3 && top[1].abs_diff(10) < 6 && top[3] == 255, "{top:?}");
    assert!(bottom[0].abs_diff(20) < 6 && bottom[2].abs_diff(250) < 3, "{bottom:?}");
    let clear = paint(painter, &strands, &far(DVec3::ZERO, 3.0), &plain(), SIZE);
    assert_eq!(clear.at(5, 5)[3], 0);
}

/// The same picture, to the byte; more samples change it a little.
pub fn pictures_repeat(painter: &Painter) {
    let strands = cross(0.3);
    // On one canvas, with what was there before.
    let canvas = painter.canvas(SIZE[0], SIZE[1]).expect("there is room");
    let picture = |samples| {
        let mut yarn = painter.yarn(&strands).expect("the strands are whole");
        let look = Look { samples, ..Look::default() };
        painter.paint(&canvas, &mut yarn, &far(DVec3::ZERO, 3.0), &look).expect("it is painted");
        painter.picture(&canvas).expect("it comes back")
    };
    let (four, again, many) = (picture(4), picture(4), picture(32));
    assert!(four == again, "{}", apart(&four, &again));
    let again = picture(32);
    assert!(many == again, "{}", apart(&many, &again));
    let apart = apart(&four, &many);
    assert!(apart > 0.0 && apart < 2.0, "{apart}");
}

/// Yarns half a pixel thick that move by parts of a pixel: what changes from picture to picture and back is noise, for the most part.
pub fn thin_yarn_does_not_flicker(painter: &Painter) {
    let lines = |d: DVec3, across: DVec3, z: f64| {
        let line = move |k: usize| across * (0.06 * k as f64 - 1.2) + DVec3::Z * z;
        (0..41).flat_map(move |k| (0..13).map(move |i| line(k) + d * (f64::from(i) / 5.0 - 1.2)))
    };
    let points: Vec<DVec3> = lines(DVec3::X, DVec3::Y, 0.0).chain(lines(DVec3::Y, DVec3::X, 0.03)).collect();
    let mut strands = yarn(&points, false, 0.01);
    strands.offsets = (0..=82).map(|k| 13 * k).collect();
    (strands.closed, strands.radius) = (vec![false; 82], vec![0.01; 82]);
    let size = [120, 120];
    // 40 pixels are one unit.
    let radius = 0.01 * 40.0;
    let differences = |samples| {
        let look = Look { samples, ..Look::default() };
        let places = [0.0, 0.3, 0.6].map(|pixels| DVec3::new(pixels / 40.0, pixels / 80.0, 0.0));
        let [a, b, c] =
            places.map(|p| paint(painter, &strands, &far(p, 3.0), &look, size).pixels.into_flattened());
        let second = |i: usize| f64::from(a[i]) - 2.0 * f64::from(b[i]) + f64::from(c[i]);
        ((0..a.len()).map(|i| second(i).powi(2)).sum::<f64>() / a.len() as f64 * 4.0 / 3.0).sqrt()
    };
    let (few, steady) = (differences(4), differences(Look::steady(radius)));
    assert!(few > 35.0 && steady < 17.0, "{few} {steady}");
}
