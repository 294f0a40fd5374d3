//! Tables of optima: what is looked up, in every precision and width, and the cache.
//!
//! Seeded faults, each seen red: every lane takes the first one's shares (lanes), the simplex's last axis wrong
//! (continuity, rest), cells of negative shear not mirrored (mirror), no weight of lengths in the key (keys,
//! rebuilding), the hash not compared (damaged files, rebuilding).

mod common;

use common::Random;
use common::grid::{Wrap, grid, single};
use glam::{DMat3, DVec3};
use knotmesh::backend::{Backend, CpuBackend, Precision, Running, TableSource, Tables, table_cache};
use knotmesh::knot::frame::Frame;
use knotmesh::knot::table::{GROUP, Grid, Table, deformation, strains};
use knotmesh::knot::tabulate::{Subject, tabulate};
use knotmesh::knot::{KnotState, Settings, Start, Status};
use knotmesh::math::{Real, Scalar, V2, Wide, Width};
use knotmesh::scene::{Mode, Scene, SceneOptions, Stencil};
use knotmesh::template::{Coordinates, Template, TemplateLibrary};
use std::path::Path;
use std::sync::Arc;

const KNIT: &str = "knit+ -lX +yX +lX -yX";
const SMALL: Grid = Grid { density: 12, below: [1; 3], above: [2, 1, 1] };

fn knit() -> Template {
    TemplateLibrary::embedded().by_key(KNIT).expect("it is there").clone()
}

fn stencil(template: &Template) -> Stencil<f64> {
    Stencil::new(template, Mode::Relax, Coordinates::MeanValue)
}

fn table(template: &Template, grid: &Grid) -> Table<f32> {
    let stencil = stencil(template);
    tabulate(Subject::new(&stencil, &template.corners, &Settings::default()), grid).expect("it has knots")
}

fn frame<T: Real>(f: [f64; 3]) -> Frame<T> {
    Frame { f11: T::of(f[0]), f12: T::of(f[1]), f22: T::of(f[2]), ..Frame::default() }
}

/// The affine start, then the table's.
fn looked_up<T: Scalar>(template: &Template, table: &Table<T>, f: [f64; 3]) -> Vec<KnotState<T>> {
    let frame = frame::<T>(f);
    let mut state: Vec<_> =
        template.knots.iter().map(|k| affine(&frame, k.direction, k.half_length)).collect();
    table.correct(&frame, &mut state);
    state
}

fn affine<T: Scalar>(frame: &Frame<T>, direction: glam::DVec2, half_length: f64) -> KnotState<T> {
    let v = frame.apply(V2::of(direction) * T::of(half_length));
    let length = v.dot(v).sqrt();
    KnotState { direction: v * (T::one() / length), half_length: length }
}

fn apart<A: Scalar, B: Scalar>(a: &[KnotState<A>], b: &[KnotState<B>]) -> f64 {
    let numbers = |s: &KnotState<A>| [s.direction.u, s.direction.v, s.half_length].map(Scalar::to_f64);
    let others = |s: &KnotState<B>| [s.direction.u, s.direction.v, s.half_length].map(Scalar::to_f64);
    let all = a.iter().flat_map(numbers).zip(b.iter().flat_map(others));
    all.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn grids() {
    let grid = Grid::default();
    for node in (0..grid.node_count()).step_by(7) {
        assert_eq!(grid.node(grid.offset(node)), Some(node));
    }
    assert_eq!(grid.node([0, 0, 9]), None);
    assert_eq!(grid.node([-9, 0, 0]), None);
    let mut random = Random::new(1);
    for _ in 0..100 {
        let s = [random.between(-1.0, 1.0), random.between(-0.9, 0.9), random.between(-1.0, 1.0)];
        let back = strains(&frame::<f64>(deformation(s)));
        assert!((0..3).all(|a| (s[a] - back[a]).abs() < 1e-12), "{s:?} {back:?}");
    }
}

/// At the nodes the table holds optima: a solve from there stays.
#[test]
fn nodes_are_optima() {
    let template = knit();
    let grid = Grid::default();
    let table = table(&template, &grid).cast::<f64>();
    let trial = knotmesh::measure::accuracy::Trial::new(&template);
    let mut random = Random::new(2);
    for _ in 0..50 {
        let offset = [8, 9, 8].map(|n: i32| random.below(n as usize) as i32 - n / 2);
        let f = deformation(grid.strains(offset));
        let state = looked_up(&template, &table, f);
        let face = knotmesh::measure::accuracy::Deformation {
            course: glam::DVec2::new(f[0], 0.0),
            wale: glam::DVec2::new(f[1], f[2]),
        };
        let end = trial.run(&Settings { iterations: 50, ..Settings::default() }, &face, Some(&state));
        let off = apart(&state, &end.state);
        assert!(off < 1e-6, "{offset:?}: {off:e}");
    }
}

/// Across the borders of cells and simplices, and of the grid.
#[test]
fn lookup_is_continuous() {
    let template = knit();
    let table = table(&template, &Grid::default()).cast::<f64>();
    let mut random = Random::new(3);
    let by = 1e-9;
    for i in 0..3000 {
        let mut at: [f64; 3] = std::array::from_fn(|_| random.between(-0.4, 0.4));
        let axis = random.below(3);
        let step = 1.0 / 12.0;
        match i % 3 {
            0 => at[axis] = (at[axis] / step).round() * step,
            1 => {
                // Two fractions alike.
                let other = (axis + 1) % 3;
                at[axis] = at[other] + step * (random.below(5) as f64 - 2.0);
            }
            _ => at[1] = if random.below(2) == 0 { 0.75 } else { -0.75 },
        }
        let [mut below, mut above] = [at, at];
        let moved = if i % 3 == 2 { 1 } else { axis };
        below[moved] -= by;
        above[moved] += by;
        let [below, above] = [below, above].map(|s| looked_up(&template, &table, deformation(s)));
        let off = apart(&below, &above);
        assert!(off < 100.0 * by, "{at:?}: {off:e} over {by:e}");
    }
}

/// Invariant 4: the plain knit is its own mirror image, its knots changing places.
#[test]
fn mirrored_faces_start_alike() {
    let mut template = knit();
    // Its angles have six digits.
    let tilt = template.knots[0].direction;
    template.knots[1].direction = glam::DVec2::new(-tilt.x, tilt.y);
    let table = table(&template, &Grid::default()).cast::<f64>();
    let mut random = Random::new(7);
    for _ in 0..500 {
        let s = [random.between(-0.5, 0.6), random.between(-0.8, 0.8), random.between(-0.5, 0.6)];
        let state = looked_up(&template, &table, deformation(s));
        let mut other = looked_up(&template, &table, deformation([s[0], -s[1], s[2]]));
        other.reverse();
        for s in &mut other {
            s.direction.u = -s.direction.u;
        }
        assert!(apart(&state, &other) < 1e-6, "{s:?}: {state:?}, {other:?}");
    }
}

#[test]
fn single_precision_agrees() {
    let template = knit();
    let table = table(&template, &Grid::default());
    let wide = table.cast::<f64>();
    let mut random = Random::new(4);
    for _ in 0..2000 {
        let s = [random.between(-0.5, 0.6), random.between(-0.6, 0.6), random.between(-0.5, 0.6)];
        let f = deformation(s);
        let off = apart(&looked_up(&template, &table, f), &looked_up(&template, &wide, f));
        assert!(off < 2e-5, "{s:?}: {off:e}");
    }
}

/// Lanes give the bits of the scalar, in range and far out of it.
#[test]
fn lanes_agree() {
    struct Look<'a>(&'a Template, &'a Table<f32>, &'a [[f64; 3]]);
    impl Wide<f32> for Look<'_> {
        type Output = Vec<Vec<KnotState<f32>>>;
        fn run<R: Real<Scalar = f32>>(self) -> Self::Output {
            let mut all = Vec::new();
            for chunk in self.2.chunks(R::LANES) {
                let mut wide = Frame::<R>::default();
                let mut state = vec![KnotState::<R>::default(); self.0.knots.len()];
                for lane in 0..R::LANES {
                    let f = frame::<f32>(chunk[lane.min(chunk.len() - 1)]);
                    wide.f11.set_lane(lane, f.f11);
                    wide.f12.set_lane(lane, f.f12);
                    wide.f22.set_lane(lane, f.f22);
                    for (state, k) in state.iter_mut().zip(&self.0.knots) {
                        let s = affine(&f, k.direction, k.half_length);
                        state.direction.u.set_lane(lane, s.direction.u);
                        state.direction.v.set_lane(lane, s.direction.v);
                        state.half_length.set_lane(lane, s.half_length);
                    }
                }
                self.1.correct(&wide, &mut state);
                for lane in 0..chunk.len() {
                    let one = |s: &KnotState<R>| KnotState {
                        direction: V2::new(s.direction.u.lane(lane), s.direction.v.lane(lane)),
                        half_length: s.half_length.lane(lane),
                    };
                    all.push(state.iter().map(one).collect());
                }
            }
            all
        }
    }
    let library = TemplateLibrary::embedded();
    for key in [KNIT, "knittuck+ -lX +yX +lX -yX", "start> -lX +lX +yX"] {
        let template = library.by_key(key).expect("it is there");
        let table = table(template, &Grid::default());
        let mut random = Random::new(6);
        let mut faces: Vec<[f64; 3]> = (0..3000)
            .map(|_| {
                deformation([random.between(-1.5, 1.5), random.between(-1.0, 1.0), random.between(-1.5, 1.5)])
            })
            .collect();
        faces.extend([[1.0, 0.0, 1.0], [1e30, 0.0, 1e-30], [1e-20, 1e20, 1.0], [f64::NAN, 0.0, 1.0]]);
        let bits = |states: Vec<Vec<KnotState<f32>>>| -> Vec<u32> {
            let numbers = |s: KnotState<f32>| [s.direction.u, s.direction.v, s.half_length];
            // NaN has many bits.
            states
                .into_iter()
                .flatten()
                .flat_map(numbers)
                .map(|x| if x.is_nan() { 0 } else { x.to_bits() })
                .collect()
        };
        let one = bits(faces.iter().map(|f| looked_up(template, &table, *f)).collect());
        for width in [Width::One, Width::Eight, Width::Sixteen, Width::Auto] {
            assert_eq!(bits(f32::widen(width, Look(template, &table, &faces))), one, "{key}, {width:?}");
        }
    }
}

/// Invariant 1: a face at rest, however it lies, is at rest, with E = 0 to rounding and no step.
#[test]
fn rest_stays_at_rest() {
    fn check<T: Precision>() {
        let settings = Settings { start: Start::Table, ..Settings::default() };
        let library = TemplateLibrary::embedded();
        for key in [KNIT, "decrease-left+ -lX -lX +yX +lX -yX", "make-left-tuck+ -lX +yX +lX +lX -yX"] {
            let template = library.by_key(key).expect("it is there");
            let flat = single(template);
            for turn in 0..5 {
                let mut mesh = flat.clone();
                let matrix =
                    DMat3::from_rotation_x(0.7 * f64::from(turn)) * DMat3::from_rotation_z(f64::from(turn));
                for p in &mut mesh.positions {
                    *p = matrix * *p + DVec3::splat(f64::from(turn));
                }
                let run = common::run::run::<T>(&mesh, &library, SceneOptions::default(), &settings, 1);
                assert_eq!(run.backend.tables().reports.len(), 1);
                let result = run.output.faces[0];
                assert_eq!(result.status, Status::AtRest, "{key}, turn {turn}: {result:?}");
                for (state, rest) in run.output.knots.iter().zip(&template.knots) {
                    let off = (state.half_length.to_f64() - rest.half_length).abs();
                    assert!(off < 2e-6, "{key}: {off:e}");
                }
            }
        }
    }
    check::<f32>();
    check::<f64>();
}

fn subject_key(template: &Template, settings: &Settings, grid: &Grid) -> u128 {
    let stencil = stencil(template);
    table_cache::key(&Subject::new(&stencil, &template.corners, settings), grid)
}

#[test]
fn keys_tell_subjects_apart() {
    let knit = knit();
    let settings = Settings::default();
    let key = subject_key(&knit, &settings, &SMALL);
    assert_eq!(key, subject_key(&knit.clone(), &settings, &SMALL));
    // Nothing of how a table is used is in its key.
    assert_eq!(key, subject_key(&knit, &Settings { iterations: 7, start: Start::Table, ..settings }, &SMALL));
    let mut tilted = knit.clone();
    tilted.knots[1].half_length += 1e-12;
    let mut moved = knit.clone();
    moved.corners[2].x += 1e-12;
    let other = [
        subject_key(&knit, &Settings { weight_length: 99.0, ..settings }, &SMALL),
        subject_key(&knit, &Settings { weight_angle: 1.5, ..settings }, &SMALL),
        subject_key(&knit, &Settings { beta: 0.5, ..settings }, &SMALL),
        subject_key(&knit, &settings, &Grid::default()),
        subject_key(&tilted, &settings, &SMALL),
        subject_key(&moved, &settings, &SMALL),
        subject_key(TemplateLibrary::embedded().by_key("knit- -lX -yX +lX +yX").unwrap(), &settings, &SMALL),
    ];
    for (i, a) in other.iter().enumerate() {
        assert_ne!(*a, key, "{i}");
        assert!(!other[i + 1..].contains(a), "{i}");
    }
}

/// Whatever happens to a file, it is read as it was written or not at all.
#[test]
fn damaged_files_are_not_read() {
    let template = knit();
    let stencil = stencil(&template);
    let subject = Subject::new(&stencil, &template.corners, &Settings::default());
    let table = table(&template, &SMALL);
    assert_eq!(table.blocks().len(), SMALL.node_count() * (2 * template.knots.len()).div_ceil(GROUP));
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("made/on the way");
    let key = table_cache::key(&subject, &SMALL);
    let read = || table_cache::read(&folder, key, &subject, &SMALL);
    assert!(read().is_none());
    table_cache::write(&folder, key, &table).unwrap();
    assert_eq!(read(), Some(table.clone()));
    let path = table_cache::path(&folder, key);
    let whole = std::fs::read(&path).unwrap();
    for byte in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[byte] ^= 1 << (byte % 8);
        std::fs::write(&path, bytes).unwrap();
        assert!(read().is_none(), "byte {byte}");
    }
    for length in (0..whole.len()).step_by(13) {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(read().is_none(), "{length} bytes");
    }
    std::fs::write(&path, [&whole[..], &[0]].concat()).unwrap();
    assert!(read().is_none(), "a byte more");
    // Another table under this name, sound in itself.
    table_cache::write(&folder, key ^ 1, &table).unwrap();
    std::fs::copy(table_cache::path(&folder, key ^ 1), &path).unwrap();
    assert!(read().is_none(), "another key");
    // A number that is none, with the right hash.
    let mut bytes = whole.clone();
    let (end, at) = (bytes.len() - 8, 100);
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let hash = xxhash_rust::xxh3::xxh3_64(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&hash);
    std::fs::write(&path, bytes).unwrap();
    assert!(read().is_none(), "NaN");
    table_cache::write(&folder, key, &table).unwrap();
    assert_eq!(read(), Some(table));
}

fn scene() -> Scene {
    let mesh = grid(3, 2, Wrap::Flat, true, |_, _| KNIT.into());
    Scene::compile(&mesh, &TemplateLibrary::embedded(), SceneOptions::default()).unwrap()
}

fn sources(scene: &Scene, settings: &Settings, cache: Option<&Path>) -> Vec<TableSource> {
    Tables::new(scene, settings, cache).reports.iter().map(|r| r.source).collect()
}

#[test]
fn tables_are_kept_and_rebuilt() {
    let scene = scene();
    let settings = Settings { start: Start::Table, ..Settings::default() };
    let folder = tempfile::tempdir().unwrap();
    let cache = Some(folder.path());
    assert_eq!(sources(&scene, &Settings::default(), cache), []);
    assert_eq!(sources(&scene, &settings, cache), [TableSource::Built]);
    assert_eq!(sources(&scene, &settings, cache), [TableSource::Cached]);
    let file = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
    let whole = std::fs::read(&file).unwrap();
    let mut bytes = whole.clone();
    bytes[5000] ^= 4;
    std::fs::write(&file, bytes).unwrap();
    assert_eq!(sources(&scene, &settings, cache), [TableSource::Built]);
    // Replaced, and by the same bytes.
    assert_eq!(std::fs::read(&file).unwrap(), whole);
    assert_eq!(sources(&scene, &Settings { weight_length: 50.0, ..settings }, cache), [TableSource::Built]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    // A folder that is none is no reason to stop.
    let tables = Tables::new(&scene, &settings, Some(&file));
    assert_eq!(tables.reports[0].source, TableSource::Built);
    assert!(tables.note.is_some_and(|n| n.lines().count() == 1));
    assert!(CpuBackend::<f32>::with_cache(Arc::new(scene), &settings, &Running::default(), cache).is_ok());
}

/// Builders of the same table at once get it, and leave it whole.
#[test]
fn builders_do_not_disturb_each_other() {
    let template = knit();
    let stencil = stencil(&template);
    let subject = Subject::new(&stencil, &template.corners, &Settings::default());
    let table = table(&template, &SMALL);
    let folder = tempfile::tempdir().unwrap();
    let key = table_cache::key(&subject, &SMALL);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..50 {
                    table_cache::write(folder.path(), key, &table).unwrap();
                    assert_eq!(
                        table_cache::read(folder.path(), key, &subject, &SMALL).as_ref(),
                        Some(&table)
                    );
                }
            });
        }
    });
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// The same table from any number of threads.
#[test]
fn threads_do_not_matter() {
    let library = TemplateLibrary::embedded();
    let template = library.by_key("decrease-left+ -lX -lX +yX +lX -yX").unwrap();
    let grid = Grid { density: 6, below: [3; 3], above: [3; 3] };
    let [one, three] = [1, 3].map(|n| {
        rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap().install(|| table(template, &grid))
    });
    assert!(one == three);
}

#[test]
fn command_line() {
    let folder = tempfile::tempdir().unwrap();
    let (cache, report) = (folder.path().join("cache"), folder.path().join("report.json"));
    for source in ["built", "cached"] {
        let status = std::process::Command::new(env!("CARGO_BIN_EXE_knotmesh"))
            .args([
                "relax",
                "stitches/garter.smobj",
                "--start",
                "table",
                "--iterations",
                "1",
                "-q",
                "--report",
            ])
            .arg(&report)
            .arg("-o")
            .arg(folder.path().join("out.npz"))
            .env(table_cache::VARIABLE, &cache)
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .status()
            .unwrap();
        assert!(status.success());
        let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&report).unwrap()).unwrap();
        let tables = report["tables"].as_array().unwrap();
        assert!(!tables.is_empty());
        assert!(tables.iter().all(|t| t["source"] == source && t["seconds"].as_f64().unwrap() >= 0.0));
    }
}
