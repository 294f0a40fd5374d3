//! From content to fabric: knit, compiled for the modes that are shown, and brought to rest on a thread of its own.

use super::net::Net;
use super::state::{Content, Kind, Settings};
use crate::cloth::{Cloth, ClothOptions, RelaxOptions, Ribs, SMOOTH, Sizes, relax};
use crate::design::expression::Gauge;
use crate::design::{self, Knitted};
use crate::io::chart::{self, Drawing, swatch};
use crate::io::pattern::Beside;
use crate::mesh::StitchMesh;
use crate::scene::{Mode, Scene, SceneOptions};
use crate::template::TemplateLibrary;
use crate::{Error, Result, design::Settings as KnitSettings};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::SeqCst};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// What fabric is made from.
#[derive(Clone, Debug)]
pub struct Job {
    /// Later ones have higher numbers.
    pub number: u64,
    /// Where the content is from, for messages and files beside it.
    pub path: PathBuf,
    /// What kind it is.
    pub kind: Kind,
    /// The content.
    pub content: Content,
    /// Gauge, size and modes are read.
    pub settings: Settings,
    /// The fabric before: where it has the same faces, this one begins with its places.
    pub before: Option<Arc<Fabric>>,
}

/// Fabric, compiled.
#[derive(Clone, Debug)]
pub struct Fabric {
    /// Of the job.
    pub number: u64,
    /// The mesh.
    pub mesh: Arc<StitchMesh>,
    net: Arc<OnceLock<Net>>,
    /// Its ribs, which yarn finds folded.
    pub ribs: Arc<Ribs>,
    /// The chart, if it is one.
    pub drawing: Option<Arc<Drawing>>,
    /// `[mode]` scenes, where they were asked for; see [`Fabric::scene`].
    pub scenes: [Option<Arc<Scene>>; 3],
    /// World units per course spacing, if they were chosen.
    pub unit: Option<f64>,
    /// The gauge it was worked at: stitches and rows on 10 cm.
    pub gauge: Option<[f64; 2]>,
    /// Stitches.
    pub stitches: usize,
    /// Its title, if it has one.
    pub title: Option<String>,
    /// Whether it is at rest.
    pub settled: bool,
    /// What took how long.
    pub seconds: Seconds,
}

/// What took how long, seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Knitting.
    pub knit: f64,
    /// Bringing the mesh to rest.
    pub relax: f64,
    /// Compiling scenes.
    pub compile: f64,
}

/// Where a mode's scene is kept.
fn slot(mode: Mode) -> usize {
    match mode {
        Mode::Embed => 0,
        Mode::Knots => 1,
        Mode::Relax => 2,
    }
}

impl Fabric {
    /// What is beside what. Made when first asked for.
    pub fn net(&self) -> &Net {
        self.net.get_or_init(|| Net::new(&self.mesh))
    }

    /// The scene of a mode, if there is one already.
    pub fn scene(&self, mode: Mode) -> Option<&Arc<Scene>> {
        self.scenes[slot(mode)].as_ref()
    }

    /// Compiles the scene of a mode, where there is none.
    ///
    /// # Errors
    /// Those of [`Scene::compile`].
    pub fn compile(&mut self, library: &TemplateLibrary, mode: Mode) -> Result<Arc<Scene>> {
        let began = Instant::now();
        let scene = match &self.scenes[slot(mode)] {
            Some(scene) => scene.clone(),
            None => {
                let options = SceneOptions { mode, gauge: self.unit, ..SceneOptions::default() };
                Arc::new(Scene::compile(&self.mesh, library, options)?)
            }
        };
        self.scenes[slot(mode)] = Some(scene.clone());
        self.seconds.compile += began.elapsed().as_secs_f64();
        Ok(scene)
    }
}

/// What came of a job, or came of it so far.
#[derive(Debug)]
pub struct Outcome {
    /// Of the job.
    pub number: u64,
    /// The fabric, or why there is none.
    pub fabric: Result<Fabric>,
    /// Whether nothing more comes.
    pub last: bool,
}

/// Seconds that fabric waits to be seen before it is brought to rest.
const PATIENCE: f64 = 0.05;

/// A thread that makes fabric; the latest job wins.
#[derive(Debug)]
pub struct Worker {
    jobs: Sender<Job>,
    seen: Sender<u64>,
    outcomes: Receiver<Outcome>,
    latest: Arc<AtomicU64>,
}

impl Worker {
    /// Starts one. `wake` is called when there is something to fetch.
    ///
    /// # Errors
    /// No thread to be had.
    pub fn new(library: Arc<TemplateLibrary>, wake: Arc<dyn Fn() + Send + Sync>) -> std::io::Result<Self> {
        let (jobs, queue) = channel::<Job>();
        let (sender, outcomes) = channel();
        let (seen, sights) = channel::<u64>();
        let latest = Arc::new(AtomicU64::new(0));
        let current = latest.clone();
        std::thread::Builder::new().name("fabric".into()).spawn(move || {
            while let Ok(mut job) = queue.recv() {
                while let Ok(later) = queue.try_recv() {
                    job = later;
                }
                let number = job.number;
                let say = |fabric: Result<Fabric>, last: bool| {
                    let sent = sender.send(Outcome { number, fabric, last }).is_ok();
                    wake();
                    sent && current.load(SeqCst) == number
                };
                let mut first = true;
                let mut tell = |fabric: Fabric, last: bool| {
                    let goes_on = say(Ok(fabric), last);
                    if std::mem::take(&mut first) && goes_on && !last {
                        // Whoever waits has the processor to itself until the fabric is solved.
                        let until = Instant::now() + Duration::from_secs_f64(PATIENCE);
                        let left = || until.saturating_duration_since(Instant::now());
                        while sights.recv_timeout(left()).is_ok_and(|seen| seen < number) {}
                    }
                    goes_on
                };
                // A fault of ours ends the job, not the thread: nothing would ever come of later jobs.
                let made = catch_unwind(AssertUnwindSafe(|| make(&job, &library, &mut tell)));
                let fault = || Error::invalid("found a fault of knotmesh itself, please report it");
                if let Err(fault) = made.unwrap_or_else(|_| Err(fault())) {
                    say(Err(fault), true);
                }
            }
        })?;
        Ok(Self { jobs, seen, outcomes, latest })
    }

    /// Hands over a job; earlier ones are dropped.
    pub fn ask(&self, job: Job) {
        self.latest.store(job.number, SeqCst);
        // Nobody will look at an earlier one.
        self.seen(job.number - 1);
        // A thread that is gone says nothing either way.
        let _ = self.jobs.send(job);
    }

    /// Says that the fabric of a job is solved and about to be drawn.
    pub fn seen(&self, number: u64) {
        let _ = self.seen.send(number);
    }

    /// What there is to fetch.
    pub fn fetch(&self) -> Option<Outcome> {
        self.outcomes.try_recv().ok()
    }

    /// What comes next, within seconds.
    pub fn wait(&self, seconds: f64) -> Option<Outcome> {
        self.outcomes.recv_timeout(std::time::Duration::from_secs_f64(seconds)).ok()
    }
}

/// Makes the fabric of a job. `say` is given what there is so far, and whether that is all; it says whether to go on.
fn make(job: &Job, library: &TemplateLibrary, say: &mut dyn FnMut(Fabric, bool) -> bool) -> Result<()> {
    let began = Instant::now();
    let (mut mesh, drawing, knitted) = match &job.content {
        Content::Mesh(mesh) => (mesh.as_ref().clone(), None, None),
        Content::Text(text) => knit(job, text.as_bytes())?,
        Content::Picture(bytes) => knit(job, bytes)?,
    };
    let mut seconds = Seconds { knit: began.elapsed().as_secs_f64(), ..Seconds::default() };
    let sizes = knitted.as_ref().map(|k| Sizes { course: k.gauge.width, wale: k.gauge.height });
    let options = ClothOptions { sizes, ..ClothOptions::default() };
    let mut begun = false;
    if let (true, Some(before)) = (job.kind.is_knit(), &job.before)
        && same_faces(&before.mesh, &mesh)
    {
        let of = |g: Option<[f64; 2]>| g.map(|g| 1.0 / (g[0] * g[1]).sqrt());
        let now = knitted.as_ref().map(|k| (k.gauge.width * k.gauge.height).sqrt() / 0.1);
        let scale = now.zip(of(before.gauge)).map_or(1.0, |(now, before)| now / before);
        mesh.positions = before.mesh.positions.iter().map(|p| *p * scale).collect();
        begun = true;
    }
    let mut fabric = Fabric {
        number: job.number,
        mesh: Arc::new(mesh),
        net: Arc::default(),
        ribs: Arc::default(),
        drawing: drawing.map(Arc::new),
        scenes: [const { None }; 3],
        unit: job.settings.unit.filter(|_| !job.kind.is_knit()),
        gauge: knitted.as_ref().map(|k| [0.1 / k.gauge.width, 0.1 / k.gauge.height]),
        stitches: 0,
        title: knitted.as_ref().and_then(|k| k.title.clone()),
        settled: !job.kind.is_knit(),
        seconds,
    };
    fabric.stitches = knitted.as_ref().map_or(fabric.mesh.face_count(), |k| k.made.total());
    let compiled = |fabric: &mut Fabric| -> Result<Fabric> {
        fabric.scenes = [const { None }; 3];
        for mode in job.settings.modes() {
            fabric.compile(library, mode)?;
        }
        Ok(fabric.clone())
    };
    let mesh = fabric.mesh.clone();
    // What was knitted here has no height yet; a mesh may.
    let ribs = || knitted.as_ref().map(|k| Ribs::new(&mesh, library, k.gauge.width)).unwrap_or_default();
    let (first, ribs) = rayon::join(|| compiled(&mut fabric), ribs);
    fabric.ribs = Arc::new(ribs);
    if !say(Fabric { ribs: fabric.ribs.clone(), ..first? }, fabric.settled) || fabric.settled {
        return Ok(());
    }
    // In a few steps at first: whoever waits sees it settle, and a later job need not wait long.
    let began = Instant::now();
    let cloth = Cloth::new(&fabric.mesh, library, &options)?;
    let mut nodes = cloth.nodes_of(&fabric.mesh.positions)?;
    let whole = RelaxOptions::garment();
    let mut options = RelaxOptions { iterations: 8, rescale: !begun, stiffer: 1.0, ..whole.clone() };
    // What begins anew is smooth before it buckles, as `knit --relax` has it.
    let mut stiff = (!begun).then(|| cloth.stiffer(whole.stiffer));
    let (mut steps, mut rounds) = (0, 0);
    loop {
        options.residual = if stiff.is_some() { SMOOTH } else { whole.residual };
        let report = relax(stiff.as_ref().unwrap_or(&cloth), &mut nodes, &options)?;
        (steps, rounds) = (steps + report.iterations, rounds + report.rounds);
        let spent = steps >= whole.iterations || rounds >= whole.rounds;
        let stuck = report.iterations < options.iterations;
        let last = spent || (report.converged || stuck) && stiff.is_none();
        if report.converged || stuck || steps >= whole.iterations / 2 || rounds >= whole.rounds / 2 {
            stiff = None;
        }
        let mut mesh = StitchMesh::clone(&fabric.mesh);
        cloth.write_back(&nodes, &mut mesh.positions);
        fabric.mesh = Arc::new(mesh);
        fabric.settled = last;
        seconds.relax = began.elapsed().as_secs_f64();
        fabric.seconds = seconds;
        if !say(compiled(&mut fabric)?, last) || last {
            return Ok(());
        }
        options.iterations = (options.iterations * 2).min(64);
        (options.rescale, options.rounds) = (false, whole.rounds - rounds);
    }
}

/// Knits a pattern or a chart.
fn knit(job: &Job, bytes: &[u8]) -> Result<(StitchMesh, Option<Drawing>, Option<Knitted>)> {
    let gauge = job.settings.gauge.map(|[stitches, rows]| Gauge::per_10_cm(stitches, Some(rows)));
    // More than a window can show is a slip of the keyboard.
    let size = job.settings.size.as_ref().map(|s| s.to_lowercase());
    let settings = KnitSettings { gauge, size, most_faces: Some(2_000_000) };
    let (mut knitted, drawing) = if job.kind == Kind::Pattern {
        let text = std::str::from_utf8(bytes).unwrap_or_default();
        (design::knit(&job.path, text, &settings, &Beside::new(&job.path))?, None)
    } else {
        let drawing = chart::read(&job.path, bytes)?;
        let knitted = swatch::knit(&job.path, &drawing, &settings, swatch::Swatch::default())?;
        (knitted, Some(drawing))
    };
    Ok((std::mem::take(&mut knitted.mesh), drawing, Some(knitted)))
}

/// Whether places of one mesh mean something in another.
fn same_faces(a: &StitchMesh, b: &StitchMesh) -> bool {
    a.positions.len() == b.positions.len()
        && a.face_offsets == b.face_offsets
        && a.face_vertices == b.face_vertices
        && a.joins == b.joins
}

/// A chart as it is drawn, whether or not it can be knit.
pub fn drawing(path: &Path, content: &Content) -> Option<Drawing> {
    match content {
        Content::Text(text) => chart::read(path, text.as_bytes()).ok(),
        Content::Picture(bytes) => chart::read(path, bytes).ok(),
        Content::Mesh(_) => None,
    }
}
