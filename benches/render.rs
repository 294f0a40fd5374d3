//! Time per frame of pictures: a tube of stockinette whose loops are drawn after a formula, so that nothing but drawing is measured.
//!
//! `cargo bench --bench render [-- POINTS...]`; a million and ten million control points unless told otherwise. Each line is the median of
//! a few frames, from new places on the CPU to a picture on the device; a first frame, which compiles shaders, is not counted.
//!
//! `-- shimmer`: how much pixels flicker as a tube turns, by samples a pixel and the yarn's radius in pixels. `rms` is the root mean square,
//! of 255, of the second differences of three pictures half a degree apart; the part that 128 samples do not have is noise, and `flicker`
//! is that of one picture: the root of the squares' difference over 6.

use knotmesh::backend::gpu::Adapter;
use knotmesh::measure::machine::heading;
use knotmesh::render::camera::Axes;
use knotmesh::render::{Camera, Look, Painter, Strands, View};
use std::f32::consts::TAU;
use std::time::Instant;

const SIZE: [u32; 2] = [1280, 720];
/// Control points of a stitch, as most templates have them.
const A_STITCH: usize = 8;

/// So many control points on a tube as high as it is wide, after the curve of Peirce (1947) and its kin.
fn tube(points: usize) -> Strands {
    let stitches = points / A_STITCH;
    let around = ((stitches as f32).sqrt() as usize).max(8);
    let place = |i: usize| {
        let t = i as f32 / A_STITCH as f32;
        let phase = TAU * t.fract();
        let along = t + 0.24 * (2.0 * phase).sin();
        let up = t / around as f32 * 0.7 + 0.55 * -phase.cos();
        let radius = around as f32 / TAU + 0.18 * (2.0 * phase).cos();
        let (sin, cos) = (along / around as f32 * TAU).sin_cos();
        [radius * sin, up, radius * cos]
    };
    Strands {
        unit: 0.005,
        points: (0..points).map(place).collect(),
        offsets: vec![0, points as u32],
        closed: vec![false],
        radius: vec![0.13],
        rest: vec![0.0; points],
        colours: vec![[196, 84, 76]; points],
        ..Strands::default()
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Second differences between three pictures half a degree apart.
fn shimmer(painter: &Painter) {
    println!("{:>8} {:>8} {:>8} {:>10}", "radius", "samples", "rms", "flicker");
    let strands = tube(10_000);
    let mut yarn = painter.yarn(&strands).expect("there is room");
    for height in [60, 120, 240, 480_u32] {
        let canvas = painter.canvas(height, height).expect("there is room");
        let camera = Camera::framing(yarn.bounds(), &Axes::Y_UP, View::FRONT, 1.0, 1.0);
        let distance = camera.eye.distance(camera.target);
        let length = f64::from(strands.radius[0]) * strands.unit;
        let radius = length * f64::from(height) / (2.0 * (camera.field / 2.0).tan() * distance);
        let mut rms = |samples: u32| {
            let look = Look { samples, ..Look::default() };
            let [a, b, c] = [0.0, 0.5, 1.0].map(|degrees| {
                let camera = camera.turned(&Axes::Y_UP, degrees);
                painter.paint(&canvas, &mut yarn, &camera, &look).expect("it is painted");
                painter.picture(&canvas).expect("the device answers").pixels.into_flattened()
            });
            let second = |i: usize| f64::from(a[i]) - 2.0 * f64::from(b[i]) + f64::from(c[i]);
            ((0..a.len()).map(|i| second(i).powi(2)).sum::<f64>() / a.len() as f64 * 4.0 / 3.0).sqrt()
        };
        let many = rms(128);
        for samples in [4, 8, 16, 32, 64] {
            let of = rms(samples);
            println!(
                "{radius:>8.2} {samples:>8} {of:>8.2} {:>10.2}",
                ((of * of - many * many).max(0.0) / 6.0).sqrt()
            );
        }
    }
}

fn main() {
    println!("{}", heading("render"));
    let asked: Vec<usize> =
        std::env::args().filter_map(|a| a.parse::<f64>().ok()).map(|n| n as usize).collect();
    let asked = if asked.is_empty() { vec![1_000_000, 10_000_000] } else { asked };
    let adapter = match Adapter::choose(None) {
        Ok(adapter) => adapter,
        Err(e) => return println!("{e}"),
    };
    if std::env::args().any(|a| a == "shimmer") {
        println!("{}", adapter.report());
        return shimmer(&Painter::open(&adapter).expect("the adapter opens"));
    }
    println!("{}, {} x {} pixels, 4 samples a pixel", adapter.report(), SIZE[0], SIZE[1]);
    println!(
        "{:>10} {:>12} {:>28} {:>10} {:>10} {:>10}",
        "points", "view", "drawn by level", "ms", "no shadow", "update ms"
    );
    let painter = Painter::open(&adapter).expect("the adapter opens");
    let canvas = painter.canvas(SIZE[0], SIZE[1]).expect("there is room");
    for points in asked {
        let strands = tube(points);
        let mut yarn = match painter.yarn(&strands) {
            Ok(yarn) => yarn,
            Err(e) => {
                println!("{points:>10} {e}");
                continue;
            }
        };
        for (name, zoom) in [("whole", 1.0), ("close", 12.0)] {
            let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
            let camera = Camera::framing(yarn.bounds(), &Axes::Y_UP, View::FRONT, aspect, zoom);
            let mut frame = |look: &Look, update: bool| {
                let began = Instant::now();
                if update {
                    painter.update(&mut yarn, &strands).expect("the same yarn");
                }
                painter.paint(&canvas, &mut yarn, &camera, look).expect("it is painted");
                let counts = painter.counts(&yarn).expect("the device answers");
                (began.elapsed().as_secs_f64() * 1e3, counts)
            };
            let (look, bare) = (Look::default(), Look { shadows: false, ..Look::default() });
            let (_, counts) = frame(&look, false);
            frame(&bare, false);
            let mut times = |look: &Look, update| median((0..3).map(|_| frame(look, update).0).collect());
            let (all, no_shadow, update) = (times(&look, false), times(&bare, false), times(&look, true));
            println!(
                "{points:>10} {name:>12} {:>28} {all:>10.1} {no_shadow:>10.1} {update:>10.1}",
                format!("{:?}", counts.drawn)
            );
        }
    }
}
