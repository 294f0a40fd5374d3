//! What `view` does, without a window: a file and its edits, fabric that follows them, frames solved as they change.
//!
//! Time is given, in seconds, so that tests need not wait. Everything a window or a script does goes through here.

use super::disk::{Disk, MeshReader};
use super::fabric::{Fabric, Job, Outcome, Worker};
use super::history::{Edit, History};
use super::net::Along;
use super::solver::Solver;
use super::state::{Content, Kind, Pull, Settings, State};
use crate::io::frames::Frames;
use crate::template::TemplateLibrary;
use crate::{Error, Result};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Seconds between looks at the file.
const LOOKS: f64 = 0.5;

/// The pattern that one begins with where none is given.
pub const BLANK: &str = "\
# Knit and purl, as patterns say it; see docs/patterns.md.
title \"New swatch\"
gauge 22 x 30

co 24
Row 1 (RS): k
Row 2 (WS): k2, p to last 2 sts, k2
rep rows 1-2 until 24 rows
bo
";

/// What is wrong, and where in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Line and column, from 1, where it is in the file that is shown.
    pub place: Option<(usize, usize)>,
    /// What.
    pub text: String,
}

/// What is opened, and how.
pub struct Options {
    /// The stitches there are.
    pub library: Arc<TemplateLibrary>,
    /// Settings to begin with.
    pub settings: Settings,
    /// Motion of a mesh: as `--frames` takes it.
    pub frames: Option<String>,
    /// Reads meshes.
    pub reader: MeshReader,
    /// Called from another thread when there is something new.
    pub wake: Arc<dyn Fn() + Send + Sync>,
}

impl Options {
    /// The built-in library, meshes in `.smobj`, nobody to wake.
    pub fn new() -> Self {
        Self {
            library: Arc::new(TemplateLibrary::embedded()),
            settings: Settings::default(),
            frames: None,
            reader: Arc::new(crate::io::smobj::read_file),
            wake: Arc::new(|| {}),
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self::new()
    }
}

/// A file at work.
pub struct Session {
    pub(super) library: Arc<TemplateLibrary>,
    pub(super) disk: Disk,
    kind: Kind,
    history: History,
    /// The content as it is on disk, and settings and pulls as they were written last.
    pub(super) saved: Content,
    pub(super) exported: (Settings, Arc<Vec<Pull>>),
    /// What somebody else wrote while there were edits.
    conflict: Option<Content>,
    worker: Worker,
    asked: u64,
    /// What the last job was made from.
    made_from: (Content, Settings),
    pending: bool,
    fabric: Option<Arc<Fabric>>,
    message: Option<Message>,
    solvers: Vec<Solver>,
    places: Vec<DVec3>,
    /// The same with ribs folded, as yarn follows them.
    folded: Vec<DVec3>,
    /// Whether places or settings changed since the last frame.
    stale: bool,
    changes: u64,
    along: Vec<(Pull, u64, Along)>,
    looked: f64,
    frames: Option<(Frames, usize)>,
    pattern_of_frames: Option<String>,
}

impl Session {
    /// Opens a file, or begins a pattern.
    ///
    /// # Errors
    /// A file that cannot be read or is of no kind that is known; no thread to be had. A pattern need not be right.
    pub fn open(path: Option<&Path>, options: Options) -> Result<Self> {
        let (disk, content) = match path {
            Some(path) => Disk::open(path, options.reader)?,
            None => (Disk::nowhere(options.reader), Content::Text(BLANK.into())),
        };
        let kind = path.map_or(Ok(Kind::Pattern), Kind::of)?;
        let worker = Worker::new(options.library.clone(), options.wake)
            .map_err(|e| Error::invalid(format_args!("cannot start a thread: {e}")))?;
        let settings = options.settings;
        let state = State { content: content.clone(), settings: settings.clone(), pulls: Arc::default() };
        let mut session = Self {
            library: options.library,
            disk,
            kind,
            history: History::new(state),
            saved: content.clone(),
            exported: (settings.clone(), Arc::default()),
            conflict: None,
            worker,
            asked: 0,
            made_from: (content, settings),
            pending: false,
            fabric: None,
            message: None,
            solvers: Vec::new(),
            places: Vec::new(),
            folded: Vec::new(),
            stale: true,
            changes: 0,
            along: Vec::new(),
            looked: 0.0,
            frames: None,
            pattern_of_frames: options.frames,
        };
        session.ask();
        Ok(session)
    }

    /// Everything that edits change, as it is now.
    pub fn state(&self) -> &State {
        self.history.state()
    }

    /// What kind of file it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The file's name, if it has one.
    pub fn path(&self) -> Option<&Path> {
        self.disk.path.as_deref()
    }

    /// The name that messages give it.
    pub(super) fn name(&self) -> PathBuf {
        self.disk.path.clone().unwrap_or_else(|| "new.knit".into())
    }

    /// The fabric, if there was one already: that of the last content that could be worked.
    pub fn fabric(&self) -> Option<&Arc<Fabric>> {
        self.fabric.as_ref()
    }

    /// The modes at work, from left to right.
    pub fn solvers(&self) -> &[Solver] {
        &self.solvers
    }

    /// `[vertex]` where the fabric is, pulled.
    pub fn places(&self) -> &[DVec3] {
        &self.places
    }

    /// What is wrong with the content or the last thing asked, if anything.
    pub fn message(&self) -> Option<&Message> {
        self.message.as_ref()
    }

    /// Whether fabric is still being made or brought to rest.
    pub fn is_busy(&self) -> bool {
        self.pending
    }

    /// How many edits can be undone and done again.
    pub fn depth(&self) -> [usize; 2] {
        self.history.depth()
    }

    /// Changes the text of a pattern or chart.
    pub fn edit_text(&mut self, text: &str, time: f64) {
        if matches!(self.state().content, Content::Text(_)) {
            self.edit(Edit::Text, time, |s| s.content = Content::Text(text.into()));
        }
    }

    /// Changes the content as a whole: a square of a chart.
    pub fn edit_content(&mut self, content: Content) {
        self.edit(Edit::Alone, 0.0, |s| s.content = content);
    }

    /// Changes settings; `name` says which, so that a slider's way is undone as one.
    pub fn edit_settings(&mut self, name: &'static str, time: f64, change: impl FnOnce(&mut Settings)) {
        self.edit(Edit::Setting(name), time, |s| change(&mut s.settings));
    }

    /// Pulls a vertex by so much in all; pulls of the same `number`, one after the other, are one.
    pub fn pull(&mut self, number: u64, pull: Pull, time: f64) {
        let count = self.fabric.as_ref().map_or(0, |f| f.mesh.positions.len());
        if !((pull.vertex as usize) < count && pull.of == count && pull.by.is_finite() && pull.reach > 0.0) {
            return;
        }
        let goes_on = self.history.is_last(&Edit::Pull(number));
        self.edit(Edit::Pull(number), time, |s| {
            let pulls = Arc::make_mut(&mut s.pulls);
            if goes_on {
                pulls.pop();
            }
            pulls.push(pull);
        });
    }

    /// Takes back a pull that is under way.
    pub fn drop_pull(&mut self, number: u64) {
        if self.history.is_last(&Edit::Pull(number)) {
            self.history.drop_last();
            self.follow();
        }
    }

    /// Lets go of everything that is pulled.
    pub fn release(&mut self) {
        self.edit(Edit::Alone, 0.0, |s| s.pulls = Arc::default());
    }

    fn edit(&mut self, edit: Edit, time: f64, change: impl FnOnce(&mut State)) {
        let mut state = self.state().clone();
        change(&mut state);
        if self.history.push(edit, time, state) {
            self.follow();
        }
    }

    /// Takes the last edit back; whether there was one.
    pub fn undo(&mut self) -> bool {
        let done = self.history.undo();
        self.follow();
        done
    }

    /// Makes the edit again that was taken back last; whether there was one.
    pub fn redo(&mut self) -> bool {
        let done = self.history.redo();
        self.follow();
        done
    }

    /// Sees to what the state needs: other fabric, or another frame.
    fn follow(&mut self) {
        self.stale = true;
        let state = self.history.state();
        let (content, settings) = &self.made_from;
        let same = state.content == *content
            && state.settings.gauge == settings.gauge
            && state.settings.unit == settings.unit
            && state.settings.size == settings.size;
        if !same {
            self.ask();
        }
    }

    /// Has fabric made of the state.
    fn ask(&mut self) {
        let State { content, settings, .. } = self.state().clone();
        self.asked += 1;
        self.pending = true;
        self.made_from = (content.clone(), settings.clone());
        let (path, before) = (self.name(), self.fabric.clone());
        self.worker.ask(Job { number: self.asked, path, kind: self.kind, content, settings, before });
    }

    /// Has it all made again: something beside the file changed.
    pub fn again(&mut self) {
        self.ask();
    }

    /// Sees what there is: fabric that was made, a file that somebody wrote. Returns whether anything is new.
    pub fn tick(&mut self, time: f64) -> bool {
        let mut new = false;
        while let Some(outcome) = self.worker.fetch() {
            new |= self.take(outcome);
        }
        if time - self.looked >= LOOKS {
            self.looked = time;
            new |= self.look();
        }
        new
    }

    /// Waits until the fabric is at rest, at most so many seconds; whether it is.
    pub fn settle(&mut self, seconds: f64) -> bool {
        let until = std::time::Instant::now() + std::time::Duration::from_secs_f64(seconds);
        while self.pending {
            let left = until.saturating_duration_since(std::time::Instant::now()).as_secs_f64();
            match self.worker.wait(left) {
                Some(outcome) => drop(self.take(outcome)),
                None => return false,
            }
        }
        true
    }

    fn take(&mut self, outcome: Outcome) -> bool {
        // Of an older job: something newer is on its way.
        if outcome.number != self.asked {
            return false;
        }
        self.pending = !outcome.last;
        match outcome.fabric {
            Ok(fabric) => {
                self.message = None;
                self.fabric = Some(Arc::new(fabric));
                self.along.clear();
                self.stale = true;
                self.open_frames();
            }
            Err(error) => self.say(&error),
        }
        true
    }

    fn open_frames(&mut self) {
        let Some((pattern, fabric)) = self.pattern_of_frames.as_ref().zip(self.fabric.as_ref()) else {
            return;
        };
        let vertices = fabric.mesh.positions.len();
        if self.frames.as_ref().is_some_and(|(frames, _)| frames.vertex_count() == vertices) {
            return;
        }
        match Frames::open(pattern, vertices) {
            Ok(frames) => self.frames = Some((frames, 0)),
            Err(error) => {
                self.frames = None;
                self.say(&error);
            }
        }
    }

    /// Says what is wrong.
    pub(super) fn say(&mut self, error: &Error) {
        let message = match error {
            Error::Input { path, line, column, found, expected } if *path == self.name() => {
                Message { place: Some((*line, *column)), text: format!("found {found}, expected {expected}") }
            }
            other => Message { place: None, text: other.to_string() },
        };
        self.message = Some(message);
    }

    /// Looks whether somebody wrote the file.
    fn look(&mut self) -> bool {
        match self.disk.look() {
            Ok(None) => return false,
            Ok(Some(content)) if content == self.state().content => self.saved = content,
            Ok(Some(content)) if self.is_dirty() => self.conflict = Some(content),
            Ok(Some(content)) => {
                self.saved = content.clone();
                self.edit_content(content);
            }
            Err(error) => self.say(&error),
        }
        true
    }

    /// Whether the content is other than on disk.
    pub fn is_dirty(&self) -> bool {
        self.state().content != self.saved
    }

    /// Whether somebody wrote the file while there were edits: to be settled by [`Session::resolve`].
    pub fn has_conflict(&self) -> bool {
        self.conflict.is_some()
    }

    /// Takes what somebody else wrote (undo brings one's own back), or keeps one's own.
    pub fn resolve(&mut self, theirs: bool) {
        if let Some(content) = self.conflict.take() {
            self.saved = content.clone();
            if theirs {
                self.edit_content(content);
            }
        }
    }

    /// What would be lost if the window closed now, in words.
    pub fn unsaved(&self) -> Vec<&'static str> {
        let State { settings, pulls, .. } = self.state();
        let mut lost = Vec::new();
        if self.is_dirty() {
            lost.push(if self.kind == Kind::Pattern { "the pattern" } else { "the chart" });
        }
        if *pulls != self.exported.1 {
            lost.push("what was pulled");
        }
        // How it is looked at is nobody's work.
        let same = Settings { mode: settings.mode, compare: settings.compare, ..self.exported.0.clone() };
        if *settings != same {
            lost.push("settings");
        }
        lost
    }

    /// Number of frames there are; 0 without motion.
    pub fn frame_count(&self) -> usize {
        self.frames.as_ref().map_or(0, |(frames, _)| frames.len())
    }

    /// The frame that is shown.
    pub fn frame(&self) -> usize {
        self.frames.as_ref().map_or(0, |(_, frame)| *frame)
    }

    /// Shows a frame; beyond the last it begins again.
    pub fn show_frame(&mut self, frame: usize) {
        if let Some((frames, shown)) = &mut self.frames {
            *shown = frame % frames.len();
            self.stale = true;
        }
    }

    /// Solves what changed since it was last called; whether anything did.
    pub fn solve(&mut self) -> bool {
        let Some(fabric) = self.fabric.clone().filter(|_| self.stale) else { return false };
        self.stale = false;
        let number = fabric.number;
        if let Err(error) = self.work(fabric) {
            self.say(&error);
        }
        self.worker.seen(number);
        true
    }

    fn work(&mut self, mut fabric: Arc<Fabric>) -> Result<()> {
        let State { settings, pulls, .. } = self.history.state().clone();
        match &mut self.frames {
            Some((frames, shown)) => frames.read(*shown, &mut self.places)?,
            None => self.places.clone_from(&fabric.mesh.positions),
        }
        self.pull_along(&fabric, &pulls);
        self.folded.clone_from(&self.places);
        fabric.ribs.fold(&mut self.folded);
        self.changes += 1;
        let mut left = std::mem::take(&mut self.solvers);
        for mode in settings.modes() {
            let scene = match fabric.scene(mode) {
                Some(scene) => scene.clone(),
                None => {
                    let scene = Arc::make_mut(&mut fabric).compile(&self.library, mode)?;
                    self.fabric = Some(fabric.clone());
                    scene
                }
            };
            let solver = match left.iter().position(|s| Arc::ptr_eq(&s.scene, &scene)) {
                Some(at) => {
                    let mut solver = left.swap_remove(at);
                    solver.frame(&settings, &self.folded, self.changes)?;
                    solver
                }
                None => Solver::new(&fabric, &scene, &settings, &self.folded, self.changes)?,
            };
            self.solvers.push(solver);
        }
        Ok(())
    }

    /// Moves what is pulled, and what comes along.
    fn pull_along(&mut self, fabric: &Fabric, pulls: &[Pull]) {
        for (at, pull) in pulls.iter().enumerate() {
            let known = self.along.get(at).is_some_and(|(known, number, _)| {
                known.vertex == pull.vertex && known.reach == pull.reach && *number == fabric.number
            });
            if !known {
                self.along.truncate(at);
                self.along.push((*pull, fabric.number, fabric.net().along(&fabric.mesh.positions, pull)));
            }
            let of_this = pull.of == self.places.len();
            for (vertex, share) in self.along[at].2.iter().filter(|_| of_this) {
                self.places[*vertex as usize] += pull.by * *share;
            }
        }
    }
}
