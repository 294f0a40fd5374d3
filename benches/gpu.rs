//! What a GPU takes for a tube of stockinette whose every vertex moves in every frame, and how near it comes to the CPU:
//! `cargo bench --bench gpu [-- [--adapter NAME] [STITCHES ...]]`.
//!
//! The table is printed, and put into `benches/runs/DATE-ADAPTER/gpu.txt`: commit it. Frames are timed in rounds, the CPU's
//! on all cores beside them; medians over the rounds.

#[cfg(all(feature = "gpu", feature = "measure"))]
#[path = "../examples/tube/mod.rs"]
#[allow(dead_code)]
mod tube;

#[cfg(all(feature = "gpu", feature = "measure"))]
fn main() -> std::process::ExitCode {
    match gpu::run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            std::process::ExitCode::FAILURE
        }
    }
}

#[cfg(not(all(feature = "gpu", feature = "measure")))]
fn main() {
    println!("this build lacks the feature gpu or measure");
}

#[cfg(all(feature = "gpu", feature = "measure"))]
mod gpu {
    use super::tube::{Vertices, moves::Motion, smobj};
    use glam::DVec3;
    use knotmesh::Result;
    use knotmesh::backend::gpu::{Adapter, GpuBackend, GpuOptions};
    use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running, Skip, Wanted, table_cache};
    use knotmesh::curve::FrameCurves;
    use knotmesh::io::smobj::read;
    use knotmesh::knot::{Settings, Solver, Start};
    use knotmesh::math::Width;
    use knotmesh::measure::machine::{machine, today};
    use knotmesh::measure::quantile;
    use knotmesh::scene::{Scene, SceneOptions};
    use knotmesh::template::TemplateLibrary;
    use knotmesh::yarn::CurveSource;
    use std::fmt::Write;
    use std::hint::black_box;
    use std::path::Path;
    use std::sync::Arc;
    use std::time::Instant;

    const FRAMES: usize = 4;
    const ROUNDS: usize = 7;

    /// How a frame is solved.
    struct Way {
        name: &'static str,
        settings: Settings,
        skip: Skip,
        wanted: Wanted,
    }

    fn ways() -> Vec<Way> {
        let way = |name, solver, start, iterations| Way {
            name,
            settings: Settings { solver, start, iterations, ..Settings::default() },
            skip: Skip::NOTHING,
            wanted: Wanted { points: true, knots: false, curves: 0 },
        };
        let table = || way("table, 2 steps", Solver::Safeguarded, Start::Table, 2);
        vec![
            way("Gauss-Newton, 3 steps", Solver::GaussNewton, Start::Affine, 3),
            way("safeguarded, 3 steps", Solver::Safeguarded, Start::Affine, 3),
            way("table, 1 step", Solver::Safeguarded, Start::Table, 1),
            table(),
            Way { name: "table, 2 steps, skips", skip: Skip::default(), ..table() },
            Way {
                name: "table, 2 steps, curves of 4",
                wanted: Wanted { points: true, knots: false, curves: 4 },
                ..table()
            },
        ]
    }

    /// How the device is used, by name.
    fn uses(software: bool) -> Vec<(String, GpuOptions)> {
        let plain = GpuOptions { timed: true, ..GpuOptions::default() };
        let size = |workgroup: u32| (format!("groups of {workgroup}"), GpuOptions { workgroup, ..plain });
        let mut all = vec![size(64)];
        if !software {
            all.extend([32, 128, 256].map(size));
            all.push(("own shaders".into(), GpuOptions { own_shaders: true, ..plain }));
            all.push(("sums as the driver likes".into(), GpuOptions { exact: false, ..plain }));
        }
        all
    }

    fn scene(stitches: usize) -> (Arc<Scene>, Vec<Vec<DVec3>>) {
        let text = smobj(stitches, Vertices::Shared);
        let mesh = read("tube.smobj".as_ref(), text.as_bytes()).expect("a mesh");
        let scene = Scene::compile(&mesh, &TemplateLibrary::embedded(), SceneOptions::default());
        let height = mesh.positions.iter().map(|p| p.z).fold(0.0, f64::max);
        let frame =
            |frame| mesh.positions.iter().map(|p| Motion::Noise.place(*p, height, frame, FRAMES)).collect();
        (Arc::new(scene.expect("compiles")), (0..FRAMES).map(frame).collect())
    }

    /// Times of a way on a device.
    #[derive(Default)]
    struct Times {
        frame: Vec<f64>,
        cpu: Vec<f64>,
        /// By the passes' names.
        passes: Vec<(&'static str, Vec<f64>)>,
        identical: f64,
        worst: f64,
    }

    fn times(
        adapter: &Adapter,
        options: &GpuOptions,
        way: &Way,
        scene: &Arc<Scene>,
        frames: &[Vec<DVec3>],
    ) -> Result<Times> {
        let running = Running { skip: way.skip, energies: false, ..Running::default() };
        let twin = Running { width: Width::One, ..running };
        let cache = table_cache::folder();
        let settings = &way.settings;
        let mut gpu = GpuBackend::new(scene.clone(), settings, &running, options, adapter, cache.as_deref())?;
        gpu.set_wanted(way.wanted)?;
        let mut cpu = CpuBackend::<f32>::with_cache(scene.clone(), settings, &running, cache.as_deref())?;
        let mut judge = CpuBackend::<f32>::with_cache(scene.clone(), settings, &twin, cache.as_deref())?;
        let [mut a, mut b, mut c] = [(); 3].map(|()| FrameOutput::default());
        let mut times = Times::default();
        for round in 0..=ROUNDS {
            for positions in frames {
                let began = Instant::now();
                gpu.frame(positions, &mut a)?;
                let frame = began.elapsed().as_secs_f64() * 1e3;
                let began = Instant::now();
                cpu.frame(positions, &mut b)?;
                if way.wanted.curves > 0 {
                    sample(scene, &b, way.wanted.curves)?;
                }
                let on_cpu = began.elapsed().as_secs_f64() * 1e3;
                if round == 0 {
                    judge.frame(positions, &mut c)?;
                    times.compare(&a, &c, scene.yarn_radius);
                    continue;
                }
                times.frame.push(frame);
                times.cpu.push(on_cpu);
                for (i, (name, seconds)) in gpu.device_times().iter().enumerate() {
                    if times.passes.len() == i {
                        times.passes.push((name, Vec::new()));
                    }
                    times.passes[i].1.push(seconds * 1e3);
                }
            }
        }
        times.identical /= frames.len() as f64;
        Ok(times)
    }

    /// Samples curves as writers do, on one thread.
    fn sample(scene: &Scene, output: &FrameOutput<f32>, subdivide: usize) -> Result<()> {
        let curves = FrameCurves::new(scene, output, subdivide, None);
        (0..curves.yarn_count()).try_for_each(|yarn| {
            curves.visit(yarn, &mut |points| {
                black_box(points);
                Ok(())
            })
        })
    }

    impl Times {
        fn compare(&mut self, device: &FrameOutput<f32>, twin: &FrameOutput<f32>, radius: f64) {
            let mut same = 0;
            for (p, q) in device.points.iter().zip(&twin.points) {
                same += usize::from(p == q);
                self.worst = self.worst.max((p.to_f64() - q.to_f64()).length() / radius);
            }
            self.identical += same as f64 / twin.points.len().max(1) as f64;
        }
    }

    fn usage(argument: &str) -> knotmesh::Error {
        knotmesh::Error::invalid(format_args!("{argument}: expected [--adapter NAME] [STITCHES ...]"))
    }

    pub fn run() -> Result<()> {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let (mut named, mut sizes) = (None, Vec::new());
        let mut rest = arguments.iter().filter(|a| *a != "--bench");
        while let Some(argument) = rest.next() {
            match (argument.as_str(), argument.parse()) {
                ("--adapter", _) => named = Some(rest.next().ok_or_else(|| usage(argument))?),
                (_, Ok(stitches)) if stitches > 0 => sizes.push(stitches),
                _ => return Err(usage(argument)),
            }
        }
        let adapter = match named {
            Some(name) => Adapter::choose(Some(name))?,
            None => match Adapter::hardware() {
                Some(adapter) => adapter,
                None => {
                    println!("no adapter of hardware; --adapter NAME measures one of software");
                    return Ok(());
                }
            },
        };
        let report = adapter.report();
        if sizes.is_empty() {
            sizes = if report.is_software() { vec![22_800] } else { vec![22_800, 228_000, 1_000_000] };
        }
        let mut text = format!(
            "{report}\n{}; {}\ncargo bench --bench gpu -- {}\n\n\
             Milliseconds a frame of a tube of which every vertex moves: `frame` is what the program waits for, upload and\n\
             download within; then the device's own times, pass by pass. `cpu`: the same on all cores (curves on one). `same`: share of control\n\
             points whose floats are those of the CPU's f32, one stitch at a time; `worst`: the largest distance, yarn radii.\n",
            machine(),
            today(),
            arguments.iter().filter(|a| *a != "--bench").cloned().collect::<Vec<_>>().join(" ")
        );
        for stitches in sizes {
            let (scene, frames) = scene(stitches);
            let points = scene.yarns.point_count();
            let mega = |count: usize| 12.0 * count as f64 / 1e6;
            writeln!(
                text,
                "\n{stitches} stitches: {:.2} MB of places up, {:.2} MB of control points down",
                mega(scene.vertex_count),
                mega(points)
            )
            .expect("memory");
            for (name, options) in uses(report.is_software()) {
                writeln!(text, "  {name}").expect("memory");
                for way in ways() {
                    let line = match times(&adapter, &options, &way, &scene, &frames) {
                        Ok(times) => line(&way, times),
                        Err(e) => format!("{:28} {e}", way.name),
                    };
                    println!("{stitches} {name}: {line}");
                    writeln!(text, "    {line}").expect("memory");
                }
            }
        }
        let slug: String = report
            .name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' })
            .collect();
        let slug = slug.split('-').filter(|w| !w.is_empty()).take(4).collect::<Vec<_>>().join("-");
        let folder =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/runs").join(format!("{}-{slug}", today()));
        std::fs::create_dir_all(&folder).map_err(|e| knotmesh::Error::io(&folder, e))?;
        let path = folder.join("gpu.txt");
        std::fs::write(&path, &text).map_err(|e| knotmesh::Error::io(&path, e))?;
        println!("\n{text}\nwritten to {}", path.display());
        Ok(())
    }

    fn line(way: &Way, mut times: Times) -> String {
        let median = |times: &mut Vec<f64>| quantile(times, 0.5);
        let mut line = format!(
            "{:28} frame {:8.3}  cpu {:8.3}  same {:.4}  worst {:.1e}  device",
            way.name,
            median(&mut times.frame),
            median(&mut times.cpu),
            times.identical,
            times.worst
        );
        for (name, passes) in &mut times.passes {
            write!(line, "  {name} {:.3}", median(passes)).expect("memory");
        }
        line
    }
}
