//! What is set beside the pattern.

use super::session::Session;
use super::state::{Kind, Settings};
use crate::scene::Mode;
use eframe::egui;
use egui::{DragValue, Grid, Slider, Ui};

/// What a value was before a widget had it, and what it is after.
fn edited<T: Copy + PartialEq>(before: T, show: impl FnOnce(&mut T)) -> Option<T> {
    let mut value = before;
    show(&mut value);
    (value != before).then_some(value)
}

/// Shows all settings, and makes edits of what is changed.
pub fn show(ui: &mut Ui, session: &mut Session, time: f64) {
    let settings = session.state().settings.clone();
    Grid::new("settings").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
        ui.label("Mode");
        ui.horizontal(|ui| {
            let now = (settings.mode, settings.compare);
            let names = [
                ((Mode::Relax, false), "relax", "solves for the yarn"),
                ((Mode::Knots, false), "knots", "carries knots rigidly"),
                ((Mode::Embed, false), "embed", "interpolates every point"),
                ((settings.mode, true), "compare", "all three side by side"),
            ];
            for ((mode, compare), name, hint) in names {
                let chosen = compare == now.1 && (compare || mode == now.0);
                if ui.selectable_label(chosen, name).on_hover_text(hint).clicked() {
                    session.edit_settings("mode", time, |s| (s.mode, s.compare) = (mode, compare));
                }
            }
        });
        ui.end_row();
        gauge(ui, session, &settings, time);
        ui.label("Knot spacing")
            .on_hover_text("beta: towards 0, loops keep their width and tighten under tension");
        if let Some(beta) =
            edited(settings.beta, |v| drop(ui.add(Slider::new(v, 0.0..=1.0).fixed_decimals(2))))
        {
            session.edit_settings("beta", time, |s| s.beta = beta);
        }
        ui.end_row();
        ui.label("Weights").on_hover_text("of angles and of lengths in the energy");
        ui.horizontal(|ui| {
            let drag = |v: &mut f64, ui: &mut Ui| {
                let speed = (0.02 * *v).max(0.01);
                ui.add(DragValue::new(v).range(0.0..=1e6).speed(speed).max_decimals(2));
            };
            ui.label("angle");
            if let Some(weight) = edited(settings.weight_angle, |v| drag(v, ui)) {
                session.edit_settings("weight of angles", time, |s| s.weight_angle = weight);
            }
            ui.label("length");
            if let Some(weight) = edited(settings.weight_length, |v| drag(v, ui)) {
                session.edit_settings("weight of lengths", time, |s| s.weight_length = weight);
            }
        });
        ui.end_row();
        ui.label("Iterations");
        let steps = edited(settings.iterations, |v| drop(ui.add(DragValue::new(v).range(0..=50).speed(0.1))));
        if let Some(steps) = steps {
            session.edit_settings("iterations", time, |s| s.iterations = steps);
        }
        ui.end_row();
    });
}

/// Stitches and rows on 10 cm; of meshes, units per course spacing.
fn gauge(ui: &mut Ui, session: &mut Session, settings: &Settings, time: f64) {
    let Some(fabric) = session.fabric().cloned() else { return };
    ui.label("Gauge");
    ui.horizontal(|ui| {
        if session.kind().is_knit() {
            let now = settings.gauge.or(fabric.gauge).unwrap_or([22.0, 36.0]);
            let gauge = edited(now, |[stitches, rows]| {
                for (value, hint) in [(stitches, "stitches"), (rows, "rows")] {
                    let drag = DragValue::new(value).range(1.0..=200.0).speed(0.1).max_decimals(2);
                    ui.add(drag.suffix(format!(" {hint}")));
                }
            });
            ui.label("on 10 cm");
            if gauge.is_some() {
                session.edit_settings("gauge", time, |s| s.gauge = gauge);
            }
            let own =
                settings.gauge.is_some() && ui.small_button("own").on_hover_text("the pattern's").clicked();
            if own {
                session.edit_settings("own gauge", time, |s| s.gauge = None);
            }
        } else {
            let scene = fabric.scenes.iter().flatten().next();
            let now = settings.unit.or(scene.map(|s| s.gauge)).unwrap_or(1.0);
            let unit = edited(now, |v| {
                let speed = 0.005 * *v;
                ui.add(DragValue::new(v).range(1e-9..=1e9).speed(speed).max_decimals(6));
            });
            ui.label("units per stitch");
            if unit.is_some() {
                session.edit_settings("gauge", time, |s| s.unit = unit);
            }
            if settings.unit.is_some() && ui.small_button("measure").clicked() {
                session.edit_settings("own gauge", time, |s| s.unit = None);
            }
        }
    });
    ui.end_row();
    if session.kind() == Kind::Pattern {
        ui.label("Size").on_hover_text("one of the pattern's sizes; empty for the first");
        let mut size = settings.size.clone().unwrap_or_default();
        if ui.add(egui::TextEdit::singleline(&mut size).desired_width(80.0)).changed() {
            let size = Some(size).filter(|s| !s.trim().is_empty());
            session.edit_settings("size", time, |s| s.size = size);
        }
        ui.end_row();
    }
}
