//! A script at work.

use super::app::App;
use super::ask::What;
use super::script::{Step, Written, modifiers_of};
use super::state::{Content, Pull};
use crate::io::output::Output;
use crate::render::Picture;
use crate::scene::Mode;
use crate::{Error, Result};
use eframe::egui;
use egui::{ColorImage, Context, Event, Modifiers, RawInput, ScreenshotCallback, ViewportCommand};
use glam::DVec3;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Seconds that a step may take.
const PATIENCE: f64 = 120.0;

/// A script, and how far it is.
pub struct Play {
    steps: VecDeque<Step>,
    events: VecDeque<Vec<Event>>,
    /// Keys that are held while the mouse is dragged.
    held: Modifiers,
    wait: u32,
    /// Nothing is done before.
    until: Option<Instant>,
    since: Instant,
    shot: Option<(PathBuf, Shot)>,
    pulls: u64,
}

/// Where a picture of the window arrives.
type Shot = Arc<Mutex<Option<Arc<ColorImage>>>>;

/// Whether a script has ended.
pub enum Stop {
    /// Not yet.
    No,
    /// It has.
    Yes,
}

impl Play {
    /// A script at its beginning.
    pub fn new(steps: Vec<Step>) -> Self {
        let (events, since) = (VecDeque::new(), Instant::now());
        // Numbers beyond those of the mouse's pulls.
        Self {
            steps: steps.into(),
            events,
            held: Modifiers::NONE,
            wait: 2,
            until: None,
            since,
            shot: None,
            pulls: 1 << 32,
        }
    }

    /// The events of a frame.
    pub fn feed(&mut self, raw: &mut RawInput) {
        // The mouse that lies on the table has no part in it.
        raw.events.retain(|e| {
            !matches!(e, Event::PointerMoved(_) | Event::PointerButton { .. } | Event::PointerGone)
        });
        if let Some(events) = self.events.pop_front() {
            for event in events {
                // What was down when a button was pressed stays down while it is dragged.
                let modifiers = match &event {
                    Event::PointerMoved(_) => self.held,
                    other => modifiers_of(other),
                };
                if let Event::PointerButton { pressed, .. } = &event {
                    self.held = if *pressed { modifiers } else { Modifiers::NONE };
                }
                raw.events.push(Event::ModifiersChanged(modifiers));
                raw.events.push(event);
            }
        }
    }

    /// Goes on as far as can be.
    ///
    /// # Errors
    /// A step that cannot be made; one that takes too long.
    pub fn step(&mut self, app: &mut App, context: &Context, time: f64) -> Result<Stop> {
        loop {
            if self.since.elapsed().as_secs_f64() > PATIENCE {
                let step = self.steps.front();
                return Err(Error::invalid(format_args!("script: no end of what comes before {step:?}")));
            }
            if !self.events.is_empty() {
                self.wait = 2;
                return Ok(Stop::No);
            }
            if self.wait > 0 {
                self.wait -= 1;
                return Ok(Stop::No);
            }
            if self.until.is_some_and(|until| Instant::now() < until) {
                return Ok(Stop::No);
            }
            if let Some((path, shot)) = &self.shot {
                let Some(image) = shot.lock().ok().and_then(|mut s| s.take()) else { return Ok(Stop::No) };
                write(path, &image)?;
                self.shot = None;
            }
            if matches!(self.steps.front(), Some(Step::Settle)) && !app.is_still(time) {
                if !app.session.is_busy()
                    && app.session.message().is_some()
                    && app.session.solvers().is_empty()
                {
                    return Err(Error::invalid(format_args!("script: {:?}", app.session.message())));
                }
                return Ok(Stop::No);
            }
            let Some(step) = self.steps.pop_front() else { return Ok(Stop::Yes) };
            self.since = Instant::now();
            self.make(step, app, context, time)?;
        }
    }

    fn make(&mut self, step: Step, app: &mut App, context: &Context, time: f64) -> Result<()> {
        match step {
            Step::Wait(frames) => self.wait = frames,
            Step::Pause(seconds) => self.until = Some(Instant::now() + Duration::from_secs_f64(seconds)),
            // Each edit is followed by a frame in which it is drawn.
            Step::Settle => self.wait = 2,
            Step::Replace(from, to) => {
                let Content::Text(text) = app.session.state().content.clone() else {
                    return Err(Error::invalid("script: there is no text"));
                };
                if !text.contains(&from) {
                    return Err(Error::invalid(format_args!("script: the text has no '{from}'")));
                }
                app.session.edit_text(&text.replace(&from, &to), time);
                self.wait = 1;
            }
            Step::Set(name, value) => {
                set(app, &name, &value, time)?;
                self.wait = 1;
            }
            Step::Pull(vertex, by, reach) => {
                self.pulls += 1;
                let of = app.session.places().len();
                app.session.pull(self.pulls, Pull { vertex, by: DVec3::from(by), reach, of }, time);
                self.wait = 1;
            }
            Step::View(azimuth, elevation) => {
                app.knit.orbit.look_from(azimuth, elevation);
                app.knit.frame_all();
                app.knit.moved = time;
                self.wait = 1;
            }
            Step::Frame(frame) => {
                app.session.show_frame(frame);
                self.wait = 1;
            }
            Step::Events(events) => self.events = events.into(),
            Step::Write(Written::Screenshot, path) => {
                let shot = Shot::default();
                let sink = shot.clone();
                let callback = ScreenshotCallback::new(move |image| {
                    if let Ok(mut slot) = sink.lock() {
                        *slot = Some(image);
                    }
                });
                context.send_viewport_cmd(ViewportCommand::Screenshot(callback));
                (self.shot, self.wait) = (Some((path, shot)), 1);
            }
            Step::Write(written, path) => {
                let what = match written {
                    Written::Yarn => What::Yarn,
                    Written::Mesh => What::Mesh,
                    _ => What::Picture,
                };
                if !app.save(what, &path, time) {
                    return Err(Error::invalid(format_args!("script: cannot save {}", path.display())));
                }
            }
            Step::Print => print(app),
            Step::Close => {
                context.send_viewport_cmd(ViewportCommand::Close);
                self.wait = 4;
            }
        }
        Ok(())
    }
}

fn set(app: &mut App, name: &str, value: &str, time: f64) -> Result<()> {
    let fault = || Error::invalid(format_args!("script: found '{name} {value}', expected a setting"));
    let number = || value.parse::<f64>().map_err(|_| fault());
    let session = &mut app.session;
    match name {
        "beta" => {
            let beta = number()?;
            session.edit_settings("beta", time, |s| s.beta = beta);
        }
        "weight-angle" => {
            let weight = number()?;
            session.edit_settings("weight of angles", time, |s| s.weight_angle = weight);
        }
        "weight-length" => {
            let weight = number()?;
            session.edit_settings("weight of lengths", time, |s| s.weight_length = weight);
        }
        "gauge" => {
            let both = value.split_once('x').and_then(|(s, r)| Some([s.parse().ok()?, r.parse().ok()?]));
            let gauge = Some(both.ok_or_else(fault)?);
            session.edit_settings("gauge", time, |s| s.gauge = gauge);
        }
        "mode" => {
            let (mode, compare) = match value {
                "relax" => (Mode::Relax, false),
                "knots" => (Mode::Knots, false),
                "embed" => (Mode::Embed, false),
                "compare" => (session.state().settings.mode, true),
                _ => return Err(fault()),
            };
            session.edit_settings("mode", time, |s| (s.mode, s.compare) = (mode, compare));
        }
        "style" => {
            for _ in 0..3 {
                if app.knit.style() != value {
                    app.knit.next_style();
                }
            }
        }
        _ => return Err(fault()),
    }
    Ok(())
}

/// What there is, as a line of JSON.
fn print(app: &App) {
    use std::io::Write;
    let session = &app.session;
    let settings = &session.state().settings;
    let camera = app.knit.orbit.camera();
    let [undo, redo] = session.depth();
    let fabric = session.fabric();
    let line = serde_json::json!({
        "stitches": fabric.map(|f| f.stitches),
        "gauge": fabric.and_then(|f| f.gauge),
        "beta": settings.beta,
        "modes": session.solvers().iter().map(|s| super::knit_view::mode_name(s.mode)).collect::<Vec<_>>(),
        "message": session.message().map(|m| m.text.clone()),
        "undo": undo,
        "redo": redo,
        "pulls": session.state().pulls.len(),
        "unsaved": session.unsaved(),
        "asked": app.ask.is_some() || session.has_conflict(),
        "frame": session.frame(),
        "eye": camera.eye.to_array(),
        "target": camera.target.to_array(),
        "selected": app.knit.selected,
        "solve_ms": session.solvers().iter().map(|s| s.seconds * 1e3).sum::<f64>(),
        "picture_ms": app.stage.seconds() * 1e3,
        "knit_area": [app.knit_area.min.x, app.knit_area.min.y, app.knit_area.max.x, app.knit_area.max.y],
    });
    // A reader that is gone is no reason to stop.
    let _ = writeln!(std::io::stdout(), "{line}");
}

fn write(path: &Path, image: &ColorImage) -> Result<()> {
    let [width, height] = image.size.map(|n| n as u32);
    let pixels = image.pixels.iter().map(|p| [p.r(), p.g(), p.b(), 255]).collect();
    let mut output = Output::create(path)?;
    Picture { width, height, pixels }.write_png(&mut output)?;
    output.commit()
}
