//! The window: the pattern on the left, the knit on the right.

use super::ask::{self, Answer, Ask, What};
use super::chart_view::ChartView;
use super::editor::Editor;
use super::fabric::drawing;
use super::knit_view::{KnitView, STILL, tag};
use super::panel;
use super::play::{Play, Stop};
use super::session::Session;
use super::stage::Stage;
use super::state::{Content, Kind};
use crate::io::chart::Drawing;
use crate::io::output::Output;
use crate::{Error, Result};
use eframe::egui;
use egui::{Align2, Context, Key, Modifiers, Panel, Rect, RichText, Ui, ViewportCommand};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Frames a second when playing.
const RATE: f64 = 24.0;

/// What went wrong for good, told when the window is gone.
pub type Failure = Arc<Mutex<Option<Error>>>;

/// The window.
pub struct App {
    /// What is shown.
    pub session: Session,
    pub(super) stage: Stage,
    pub(super) knit: KnitView,
    editor: Editor,
    chart: ChartView,
    drawn: Option<(Content, Option<Drawing>)>,
    pub(super) ask: Option<Ask>,
    /// Whether the next wish to close is granted.
    pub(super) closing: bool,
    playing: Option<f64>,
    note: Option<(String, f64)>,
    pub(super) knit_area: Rect,
    play: Option<Play>,
    failure: Failure,
    title: String,
}

impl App {
    /// The window of a session; `play` is a script.
    pub fn new(session: Session, stage: Stage, play: Option<Play>, failure: Failure) -> Self {
        Self {
            session,
            stage,
            knit: KnitView::default(),
            editor: Editor::default(),
            chart: ChartView::default(),
            drawn: None,
            ask: None,
            closing: false,
            playing: None,
            note: None,
            knit_area: Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(4.0, 3.0)),
            play,
            failure,
            title: String::new(),
        }
    }

    fn say(&mut self, text: impl std::fmt::Display, time: f64) {
        self.note = Some((text.to_string(), time));
    }

    fn name(&self) -> String {
        let name = self.session.path().and_then(Path::file_name);
        name.map_or_else(|| "new pattern".into(), |n| n.to_string_lossy().into_owned())
    }

    /// Keys that hold everywhere, letters being typed or not.
    fn shortcuts(&mut self, ui: &Ui, time: f64) {
        let pressed = |modifiers, key| ui.ctx().input_mut(|i| i.consume_key(modifiers, key));
        if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) || pressed(Modifiers::COMMAND, Key::Y) {
            self.session.redo();
        }
        if pressed(Modifiers::COMMAND, Key::Z) {
            self.session.undo();
        }
        if pressed(Modifiers::COMMAND, Key::S) {
            self.ask_to_save(if self.session.kind() == Kind::Mesh { What::Mesh } else { What::Source }, time);
        }
        if pressed(Modifiers::NONE, Key::F12) {
            let path = What::Picture.name(&self.session);
            self.save(What::Picture, path.as_ref(), time);
        }
    }

    /// Keys that hold while no text has them.
    fn keys(&mut self, ui: &Ui, time: f64) {
        if ui.input(|i| i.key_pressed(Key::Space)) && self.session.frame_count() > 0 {
            self.playing = if self.playing.is_some() { None } else { Some(time) };
        }
    }

    fn ask_to_save(&mut self, what: What, time: f64) {
        match self.session.path().map(Path::to_path_buf).filter(|_| what == What::Source) {
            Some(path) => drop(self.save(what, &path, time)),
            None => self.ask = Some(Ask::Name(what, what.name(&self.session), false)),
        }
    }

    /// Saves; whether it could.
    pub(super) fn save(&mut self, what: What, path: &Path, time: f64) -> bool {
        let saved = if what == What::Picture {
            self.save_picture(path)
        } else {
            ask::write(&mut self.session, what, path)
        };
        match &saved {
            Ok(()) => self.say(format_args!("saved {}", path.display()), time),
            Err(error) => self.say(error, time),
        }
        saved.is_ok()
    }

    fn save_picture(&self, path: &Path) -> Result<()> {
        let picture = self.knit.picture(&self.session, &self.stage, self.knit_area)?;
        let mut output = Output::create(path)?;
        picture.write_png(&mut output)?;
        output.commit()
    }

    /// Asks what is to be asked, and does as is answered.
    fn questions(&mut self, context: &Context, time: f64) {
        let asked = context.input(|i| i.viewport().close_requested());
        if asked && !self.closing && !self.session.unsaved().is_empty() {
            context.send_viewport_cmd(ViewportCommand::CancelClose);
            self.ask.get_or_insert(Ask::Close);
        }
        if self.session.has_conflict() {
            if let Some(theirs) = ask::conflict(context) {
                self.session.resolve(theirs);
            }
            return;
        }
        let Some(mut ask) = self.ask.take() else { return };
        match ask.show(context, &self.session) {
            Answer::None => self.ask = Some(ask),
            Answer::Cancel => {}
            Answer::Close => self.close(context),
            Answer::Save(What::Source, _, closing) if closing && self.session.path().is_none() => {
                self.ask = Some(Ask::Name(What::Source, What::Source.name(&self.session), true));
            }
            Answer::Save(what, path, closing) => {
                let saved = self.save(what, &path, time);
                if saved && closing && self.session.unsaved().is_empty() {
                    self.close(context);
                } else if closing || !saved {
                    // Something is left to be asked for, or another name.
                    self.ask = Some(if saved { Ask::Close } else { ask });
                }
            }
        }
    }

    /// Closes without another question.
    pub(super) fn close(&mut self, context: &Context) {
        self.closing = true;
        context.send_viewport_cmd(ViewportCommand::Close);
    }

    fn fail(&mut self, context: &Context, error: Error) {
        if let Ok(mut failure) = self.failure.lock() {
            failure.get_or_insert(error);
        }
        self.close(context);
    }

    fn bar(&mut self, ui: &mut Ui, time: f64) {
        ui.horizontal(|ui| {
            let dirty = if self.session.is_dirty() { " *" } else { "" };
            ui.label(RichText::new(format!("{}{dirty}", self.name())).strong());
            ui.separator();
            let [back, forward] = self.session.depth();
            if ui.add_enabled(back > 0, egui::Button::new("Undo")).on_hover_text("Ctrl+Z").clicked() {
                self.session.undo();
            }
            let redo = ui.add_enabled(forward > 0, egui::Button::new("Redo"));
            if redo.on_hover_text("Ctrl+Shift+Z").clicked() {
                self.session.redo();
            }
            ui.separator();
            for (what, name, hint) in [
                (What::Source, "Save", "Ctrl+S"),
                (What::Picture, "Save picture", "F12"),
                (What::Yarn, "Save yarn", "as curves"),
                (What::Mesh, "Save mesh", "pulled corners and all"),
            ] {
                let there = what != What::Source || self.session.kind() != Kind::Mesh;
                if there && ui.button(name).on_hover_text(hint).clicked() {
                    self.ask_to_save(what, time);
                }
            }
            ui.separator();
            if ui.button("All").on_hover_text("Home").clicked() {
                self.knit.frame_all();
            }
            if ui.button(format!("Drawn as {}", self.knit.style())).on_hover_text("Z").clicked() {
                self.knit.next_style();
            }
            if !self.session.state().pulls.is_empty() && ui.button("Let go").clicked() {
                self.session.release();
            }
        });
    }

    fn left(&mut self, ui: &mut Ui, time: f64) {
        Panel::bottom("settings").resizable(false).show(ui, |ui| {
            ui.add_space(4.0);
            panel::show(ui, &mut self.session, time);
            ui.add_space(4.0);
        });
        Panel::bottom("message").resizable(false).min_size(30.0).show(ui, |ui| {
            ui.add_space(3.0);
            match (self.session.message().cloned(), &self.note) {
                (Some(message), _) => {
                    let colour = ui.visuals().error_fg_color;
                    let place =
                        message.place.map_or(String::new(), |(l, c)| format!("line {l}, column {c}: "));
                    let text = RichText::new(format!("{place}{}", message.text)).color(colour);
                    let label = ui.add(egui::Label::new(text).wrap().sense(egui::Sense::click()));
                    if let (true, Some((line, column))) = (label.clicked(), message.place) {
                        self.editor.go(line, column);
                    }
                }
                (None, Some((note, _))) => drop(ui.add(egui::Label::new(note).wrap())),
                (None, None) => drop(ui.weak("No mistakes.")),
            }
            ui.add_space(3.0);
        });
        egui::CentralPanel::default().show(ui, |ui| {
            let content = self.session.state().content.clone();
            let kind = self.session.kind();
            if self.drawn.as_ref().is_none_or(|(of, _)| *of != content) {
                let drawing = drawing(&self.session.name(), &content).filter(|_| kind != Kind::Pattern);
                self.drawn = Some((content.clone(), drawing));
            }
            let drawing = self.drawn.as_ref().and_then(|(_, d)| d.clone());
            if let Some(drawing) = &drawing
                && let Some(content) = self.chart.show(ui, &content, drawing)
            {
                self.session.edit_content(content);
            }
            match &content {
                // A chart that cannot be read is shown as what it is.
                Content::Text(text) if drawing.is_none() => {
                    if let Some(text) = self.editor.show(ui, text, self.session.message()) {
                        self.session.edit_text(&text, time);
                    }
                }
                Content::Picture(_) if drawing.is_none() => drop(ui.label("Not a picture that can be read.")),
                Content::Mesh(mesh) => stitches(ui, mesh),
                _ => {}
            }
        });
    }

    fn motion(&mut self, ui: &mut Ui, time: f64) {
        ui.horizontal(|ui| {
            let playing = self.playing.is_some();
            if ui.button(if playing { "Stop" } else { "Play" }).on_hover_text("Space").clicked() {
                self.playing = (!playing).then_some(time);
            }
            let mut frame = self.session.frame();
            let last = self.session.frame_count() - 1;
            ui.spacing_mut().slider_width = (ui.available_width() - 90.0).max(50.0);
            if ui.add(egui::Slider::new(&mut frame, 0..=last)).changed() {
                self.session.show_frame(frame);
            }
        });
    }

    fn counts(&self, ui: &Ui, area: Rect) {
        let Some((fabric, solver)) = self.session.fabric().zip(self.session.solvers().last()) else { return };
        let (seconds, yarns) = (fabric.seconds, &solver.scene.yarns);
        let solve: f64 = self.session.solvers().iter().map(|s| s.seconds).sum();
        let rest = if self.session.is_busy() { ", settling" } else { "" };
        let words = format!(
            "{} stitches, {} knots, yarns: {}, {} points{rest}\nknit {:.1} ms   mesh {:.0} ms   compile {:.1} ms   solve {:.1} ms   \
             picture {:.1} ms\n{}",
            fabric.stitches,
            solver.scene.knot_count,
            yarns.len(),
            yarns.point_count(),
            seconds.knit * 1e3,
            seconds.relax * 1e3,
            seconds.compile * 1e3,
            solve * 1e3,
            self.stage.seconds() * 1e3,
            self.stage.adapter
        );
        tag(ui, area.left_bottom() + egui::vec2(8.0, -8.0), Align2::LEFT_BOTTOM, &words);
    }

    /// Points out where a stitch comes from.
    fn point_out(&mut self, face: u32) {
        let Some(fabric) = self.session.fabric() else { return };
        let line = fabric.mesh.face_source.get(face as usize).copied().filter(|l| *l > 0);
        let column = fabric.mesh.face_origins.get(face as usize).map(|o| o.column);
        let Some((line, column)) = line.zip(column) else { return };
        if let Some((_, Some(drawing))) = &self.drawn {
            let marked = drawing.rows.iter().enumerate().find_map(|(number, row)| {
                let at = row.squares.iter().position(|s| s.place.line == line && s.place.column == column)?;
                Some((number, at))
            });
            self.chart.marked = marked;
        } else {
            self.editor.go(line as usize, column as usize);
        }
    }

    /// Whether all there is is painted as it stays.
    pub(super) fn is_still(&self, time: f64) -> bool {
        !self.session.is_busy() && !self.session.solvers().is_empty() && time - self.knit.moved > 2.0 * STILL
    }
}

/// The stitches of a mesh, by type.
fn stitches(ui: &mut Ui, mesh: &crate::mesh::StitchMesh) {
    let mut counts = vec![0usize; mesh.types.len()];
    mesh.face_types.iter().for_each(|t| counts[t.index()] += 1);
    egui::ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        ui.label("A mesh has no pattern to edit. Its stitches:");
        ui.add_space(6.0);
        egui::Grid::new("stitches").striped(true).show(ui, |ui| {
            for (stitch, count) in mesh.types.iter().zip(counts).filter(|(_, count)| *count > 0) {
                ui.label(RichText::new(count.to_string()).monospace());
                ui.label(RichText::new(stitch.key()).monospace());
                ui.end_row();
            }
        });
    });
}

impl eframe::App for App {
    fn raw_input_hook(&mut self, _: &Context, raw: &mut egui::RawInput) {
        if let Some(play) = &mut self.play {
            play.feed(raw);
        }
    }

    fn ui(&mut self, ui: &mut Ui, _: &mut eframe::Frame) {
        let context = ui.ctx().clone();
        let time = context.input(|i| i.time);
        if let Some(mut play) = self.play.take() {
            match play.step(self, &context, time) {
                Ok(Stop::No) => self.play = Some(play),
                Ok(Stop::Yes) => self.close(&context),
                Err(error) => self.fail(&context, error),
            }
            context.request_repaint();
        }
        self.shortcuts(ui, time);
        let typing = context.memory(|m| m.focused()).is_some() || self.ask.is_some();
        if !typing {
            self.keys(ui, time);
        }
        self.session.tick(time);
        if let Some(since) = self.playing {
            let frames = ((time - since) * RATE) as usize;
            if frames > 0 {
                self.session.show_frame(self.session.frame() + frames);
                self.playing = Some(since + frames as f64 / RATE);
            }
            context.request_repaint();
        }

        Panel::top("bar").show(ui, |ui| self.bar(ui, time));
        Panel::left("pattern")
            .default_size(470.0)
            .size_range(260.0..=900.0)
            .show(ui, |ui| self.left(ui, time));
        if self.session.frame_count() > 0 {
            Panel::bottom("motion").show(ui, |ui| self.motion(ui, time));
        }
        // After what was edited in this frame, before it is drawn.
        self.session.solve();
        let shown = egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
            self.knit_area = ui.available_rect_before_wrap();
            let shown = self.knit.show(ui, &mut self.session, &mut self.stage, time, !typing);
            self.counts(ui, self.knit_area);
            shown
        });
        match shown.inner {
            Ok(Some(face)) => self.point_out(face),
            Ok(None) => {}
            Err(error) => self.fail(&context, error),
        }
        self.questions(&context, time);
        let dirty = if self.session.unsaved().is_empty() { "" } else { "* " };
        let title = format!("{dirty}{} - knotmesh", self.name());
        if title != self.title {
            self.title.clone_from(&title);
            context.send_viewport_cmd(ViewportCommand::Title(title));
        }
        // The file is looked at.
        context.request_repaint_after_secs(0.5);
    }
}
