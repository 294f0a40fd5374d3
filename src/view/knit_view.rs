//! The knit: orbit, pick, pull, as in Blender.

use super::orbit::{Orbit, nearest, per_point, project};
use super::session::Session;
use super::stage::Stage;
use super::state::Pull;
use crate::ids::FaceId;
use crate::render::{Camera, Look, Shading};
use crate::scene::Mode;
use crate::{Error, Result};
use eframe::egui;
use egui::{Color32, Key, PointerButton, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};
use glam::DVec2;

/// How yarn is drawn, one after the other by `Z`.
const STYLES: [&str; 3] = ["yarn", "smooth", "tension"];
/// Seconds after which what stands still is drawn with all there is, by adapters that are programs.
pub const STILL: f64 = 0.3;

/// The right side of the window.
#[derive(Debug)]
pub struct KnitView {
    /// Where it is seen from.
    pub orbit: Orbit,
    style: usize,
    /// Whether all of the fabric is kept in view while it changes.
    framed: bool,
    grab: Option<Grab>,
    grabs: u64,
    /// When something moved last.
    pub moved: f64,
    made: u64,
    /// The stitch that was clicked.
    pub selected: Option<u32>,
    /// How far along the fabric others come along when one is pulled, in course spacings.
    reach: f64,
}

/// A vertex on its way.
#[derive(Clone, Copy, Debug)]
struct Grab {
    number: u64,
    vertex: u32,
    from: Pos2,
    /// World units a point of the window.
    scale: f64,
}

impl Default for KnitView {
    fn default() -> Self {
        Self {
            orbit: Orbit::default(),
            style: 0,
            framed: true,
            grab: None,
            grabs: 0,
            moved: f64::NEG_INFINITY,
            made: 0,
            selected: None,
            reach: 6.0,
        }
    }
}

fn vector(v: egui::Vec2) -> DVec2 {
    DVec2::new(v.x.into(), v.y.into())
}

impl KnitView {
    /// How yarn is drawn.
    pub fn look(&self) -> Look {
        let look = Look::default();
        match STYLES[self.style] {
            "smooth" => Look { plies: false, ..look },
            "tension" => Look { shading: Shading::Tension([0.85, 1.15]), ..look },
            _ => look,
        }
    }

    /// The style's name.
    pub fn style(&self) -> &'static str {
        STYLES[self.style]
    }

    /// The next style.
    pub fn next_style(&mut self) {
        self.style = (self.style + 1) % STYLES.len();
    }

    /// Brings all into view, and keeps it there while the fabric changes.
    pub fn frame_all(&mut self) {
        (self.framed, self.made) = (true, 0);
    }

    /// Keys over the knit, while no text has them.
    pub fn keys(&mut self, ui: &Ui) {
        let pressed = |key| ui.input(|i| i.key_pressed(key));
        let ctrl = ui.input(|i| i.modifiers.command);
        let opposite = if ctrl { 180.0 } else { 0.0 };
        if pressed(Key::Num1) {
            self.orbit.look_from(opposite, 0.0);
        }
        if pressed(Key::Num3) {
            self.orbit.look_from(90.0 + opposite, 0.0);
        }
        if pressed(Key::Num7) {
            self.orbit.look_from(0.0, if ctrl { -90.0 } else { 90.0 });
        }
        if pressed(Key::Num5) {
            self.orbit.toggle_perspective();
        }
        if pressed(Key::Home) {
            self.frame_all();
        }
        if pressed(Key::Z) && !ctrl {
            self.next_style();
        }
    }

    /// Shows it; the face that was clicked, if one was.
    ///
    /// # Errors
    /// A device that fails.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        session: &mut Session,
        stage: &mut Stage,
        time: f64,
        keys: bool,
    ) -> Result<Option<u32>> {
        let (area, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        let count = session.solvers().len().max(1);
        let width = (area.width() - 2.0 * (count as f32 - 1.0)) / count as f32;
        if width < 8.0 || area.height() < 8.0 {
            return Ok(None);
        }
        let panes: Vec<Rect> = (0..count)
            .map(|k| {
                let corner = pos2(area.left() + k as f32 * (width + 2.0), area.top());
                Rect::from_min_size(corner, vec2(width, area.height()))
            })
            .collect();
        self.follow(session, f64::from(width / area.height()), time);
        let mouse = ui.input(|i| i.pointer.latest_pos());
        let pane = mouse.and_then(|p| panes.iter().find(|r| r.contains(p))).copied().unwrap_or(panes[0]);
        let before = (self.orbit, self.style);
        self.steer(ui, &response, pane);
        if keys {
            self.keys(ui);
        }
        self.pull(ui, session, mouse.filter(|_| keys || self.grab.is_some()), pane, time);
        // What was pulled just now is seen in this frame.
        session.solve();
        if before != (self.orbit, self.style) {
            self.moved = time;
        }

        let camera = self.orbit.camera();
        let mut look = self.look();
        // What moves is drawn plainly where a program draws it.
        if stage.software && time - self.moved < STILL {
            look = Look { shadows: false, occlusion: false, detail: 0.4, ..look };
            ui.ctx().request_repaint_after_secs(STILL as f32);
        }
        stage.keep(session.solvers().len());
        for (k, (solver, rect)) in session.solvers().iter().zip(&panes).enumerate() {
            let points = rect.size() * ui.ctx().pixels_per_point();
            let size = [points.x, points.y].map(|n| (n.round() as u32).max(1));
            let texture = stage.show(k, solver, &camera, &look, size)?;
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            ui.painter().image(texture, *rect, whole, Color32::WHITE);
            self.mark(ui, session, &camera, *rect);
            if count > 1 {
                let at = rect.center_top() + vec2(0.0, 8.0);
                tag(ui, at, egui::Align2::CENTER_TOP, mode_name(solver.mode));
            }
        }
        if session.solvers().is_empty() {
            let words = if session.is_busy() { "knitting ..." } else { "nothing to show yet" };
            tag(ui, area.center(), egui::Align2::CENTER_CENTER, words);
        }
        if response.clicked() && self.grab.is_none() {
            self.selected = mouse.and_then(|p| self.face_at(session, &camera, pane, p));
            return Ok(self.selected);
        }
        Ok(None)
    }

    /// Keeps all in view until somebody looks closer.
    fn follow(&mut self, session: &Session, aspect: f64, time: f64) {
        let Some(solver) = session.solvers().first() else { return };
        if solver.moved.max(solver.made) != self.made {
            self.moved = time;
            let first = self.made == 0;
            self.made = solver.moved.max(solver.made);
            if self.framed
                && (first || self.grab.is_none())
                && let Some(bounds) = solver.strands.bounds()
            {
                self.orbit.fit(bounds, aspect);
            }
        }
    }

    /// Turns, moves and zooms by the mouse.
    fn steer(&mut self, ui: &Ui, response: &egui::Response, pane: Rect) {
        if self.grab.is_some() {
            return;
        }
        let by = vector(response.drag_delta()) / f64::from(pane.height());
        let modifiers = ui.input(|i| i.modifiers);
        if response.dragged_by(PointerButton::Middle) || response.dragged_by(PointerButton::Primary) {
            if modifiers.shift {
                self.orbit.pan(by);
                self.framed = false;
            } else if modifiers.command {
                self.orbit.zoom((-3.0 * by.y).exp());
                self.framed = false;
            } else {
                self.orbit.turn(by);
            }
        }
        let scroll = ui.input(|i| i.smooth_scroll_delta.y + 200.0 * (i.zoom_delta() - 1.0));
        if response.hovered() && scroll != 0.0 {
            self.orbit.zoom((0.004 * f64::from(scroll)).exp());
            self.framed = false;
        }
    }

    /// Takes the vertex under the mouse with `G`, and along until a click; the wheel changes how much comes along.
    fn pull(&mut self, ui: &Ui, session: &mut Session, mouse: Option<Pos2>, pane: Rect, time: f64) {
        let Some(mouse) = mouse else { return };
        let pressed = |key| ui.input(|i| i.key_pressed(key));
        let camera = self.orbit.camera();
        let size = vector(pane.size());
        if self.grab.is_none() {
            let within = pane.contains(mouse) && pressed(Key::G);
            let at = vector(mouse - pane.min);
            let places = session.places().iter().copied();
            let found = within.then(|| nearest(&camera, size, at, 40.0, places)).flatten();
            let depth = found.and_then(|v| project(&camera, size, session.places()[v]));
            if let Some((vertex, (_, depth))) = found.zip(depth) {
                self.grabs += 1;
                let scale = per_point(&camera, size, depth);
                self.grab = Some(Grab { number: self.grabs, vertex: vertex as u32, from: mouse, scale });
            }
            return;
        }
        let Some(grab) = self.grab else { return };
        if pressed(Key::Escape) || ui.input(|i| i.pointer.secondary_pressed()) {
            self.grab = None;
            session.drop_pull(grab.number);
            return;
        }
        let scroll = ui.input(|i| i.smooth_scroll_delta.y);
        self.reach = (self.reach * (0.004 * f64::from(scroll)).exp()).clamp(0.5, 1000.0);
        let by = vector(mouse - grab.from) * grab.scale;
        let [right, up, _] = self.orbit.frame();
        let spacing = session.solvers().first().map_or(1.0, |s| s.scene.gauge);
        let (reach, of) = (self.reach * spacing, session.places().len());
        let pull = Pull { vertex: grab.vertex, by: right * by.x - up * by.y, reach, of };
        if by != DVec2::ZERO {
            session.pull(grab.number, pull, time);
        }
        if pressed(Key::Enter) || ui.input(|i| i.pointer.primary_pressed()) {
            self.grab = None;
        }
    }

    /// The stitch under the mouse.
    fn face_at(&self, session: &Session, camera: &Camera, pane: Rect, mouse: Pos2) -> Option<u32> {
        let mesh = &session.fabric()?.mesh;
        let places = session.places();
        if places.len() != mesh.positions.len() {
            return None;
        }
        let middle = |f: usize| {
            let corners = mesh.face(FaceId::from(f));
            corners.iter().map(|v| places[v.index()]).sum::<glam::DVec3>() / corners.len() as f64
        };
        let (size, at) = (vector(pane.size()), vector(mouse - pane.min));
        nearest(camera, size, at, 30.0, (0..mesh.face_count()).map(middle)).map(|f| f as u32)
    }

    /// Outlines the stitch that was clicked, and what is pulled.
    fn mark(&self, ui: &Ui, session: &Session, camera: &Camera, pane: Rect) {
        let Some(fabric) = session.fabric() else { return };
        let places = session.places();
        if places.len() != fabric.mesh.positions.len() {
            return;
        }
        let size = vector(pane.size());
        let on_screen = |vertex: usize| {
            let (point, _) = project(camera, size, places[vertex])?;
            Some(pane.min + vec2(point.x as f32, point.y as f32))
        };
        let painter = ui.painter().with_clip_rect(pane);
        let stroke = Stroke::new(2.0, ui.visuals().selection.stroke.color);
        if let Some(face) = self.selected.filter(|f| (*f as usize) < fabric.mesh.face_count()) {
            let corners = fabric.mesh.face(FaceId::from(face as usize));
            let line: Option<Vec<Pos2>> = corners.iter().map(|v| on_screen(v.index())).collect();
            if let Some(line) = line {
                painter.add(egui::Shape::closed_line(line, stroke));
            }
        }
        if let Some(grab) = self.grab
            && let Some(at) = on_screen(grab.vertex as usize)
        {
            let spacing = session.solvers().first().map_or(1.0, |s| s.scene.gauge);
            painter.circle_filled(at, 4.0, stroke.color);
            painter.circle_stroke(
                at,
                (self.reach * spacing / grab.scale) as f32,
                Stroke::new(1.0, stroke.color),
            );
        }
    }

    /// The picture by itself, with all there is.
    ///
    /// # Errors
    /// No yarn yet; a device that fails.
    pub fn picture(&self, session: &Session, stage: &Stage, area: Rect) -> Result<crate::render::Picture> {
        let solvers = session.solvers();
        let shown = solvers.iter().find(|s| s.mode == Mode::Relax).or(solvers.first());
        let Some(solver) = shown else {
            return Err(Error::invalid("found no yarn to save a picture of: the pattern is not whole yet"));
        };
        let look = Look { samples: 16, ..self.look() };
        let width = 1600.0_f32;
        let height = (width * area.height() / area.width().max(1.0)).clamp(100.0, 4000.0);
        stage.picture(solver, &self.orbit.camera(), &look, [width as u32, height as u32])
    }
}

/// A mode's name.
pub fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Relax => "relax",
        Mode::Knots => "knots",
        Mode::Embed => "embed",
    }
}

/// Words on the picture, on a ground that they can be read on.
pub fn tag(ui: &Ui, at: Pos2, align: egui::Align2, words: &str) {
    let font = egui::FontId::proportional(13.0);
    let galley = ui.painter().layout_no_wrap(words.into(), font, Color32::from_gray(30));
    let rect = align.anchor_size(at, galley.size()).expand2(vec2(7.0, 4.0));
    ui.painter().rect_filled(rect, 4.0, Color32::from_rgba_unmultiplied(255, 255, 255, 205));
    ui.painter().galley(rect.min + vec2(7.0, 4.0), galley, Color32::from_gray(30));
}
