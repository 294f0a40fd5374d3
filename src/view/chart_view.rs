//! A chart as a grid of squares; a click changes one.

use super::chart_edit::{Brush, brush, brushes, paint};
use super::state::Content;
use crate::io::chart::Drawing;
use eframe::egui;
use egui::{Align2, Color32, CornerRadius, FontId, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

/// The grid, and what it is painted with.
#[derive(Debug, Default)]
pub struct ChartView {
    brush: Option<Brush>,
    /// The square that is pointed out: row from the bottom, column.
    pub marked: Option<(usize, usize)>,
}

impl ChartView {
    /// Shows a chart; the content with a square changed, where a person changed it.
    pub fn show(&mut self, ui: &mut Ui, content: &Content, drawing: &Drawing) -> Option<Content> {
        self.palette(ui, content, drawing);
        ui.separator();
        let widest = drawing.rows.iter().map(|r| r.squares.len()).max().unwrap_or(1);
        let mut changed = None;
        let room = ui.available_size();
        let side = ((room.x - 44.0) / widest as f32).min((room.y - 24.0) / drawing.rows.len() as f32);
        let side = side.clamp(9.0, 28.0).floor();
        egui::ScrollArea::both().auto_shrink([false, false]).id_salt("chart").show(ui, |ui| {
            let size = vec2(widest as f32 * side + 30.0, drawing.rows.len() as f32 * side + 4.0);
            let (area, response) = ui.allocate_exact_size(size, Sense::click());
            let painter = ui.painter_at(area.expand(2.0));
            let line = Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.5));
            let at_click = response.interact_pointer_pos().filter(|_| response.clicked());
            for (number, row) in drawing.rows.iter().enumerate() {
                let top = area.top() + (drawing.rows.len() - 1 - number) as f32 * side;
                // Rows are read from the right: so they are numbered there.
                let label = pos2(area.left() + row.squares.len() as f32 * side + 4.0, top + side / 2.0);
                if side >= 12.0 || (number + 1) % 5 == 0 {
                    let font = FontId::monospace((side * 0.6).clamp(8.0, 12.0));
                    let colour = ui.visuals().weak_text_color();
                    painter.text(label, Align2::LEFT_CENTER, (number + 1).to_string(), font, colour);
                }
                for (column, square) in row.squares.iter().enumerate() {
                    let corner = pos2(area.left() + column as f32 * side, top);
                    let rect = Rect::from_min_size(corner, vec2(side, side));
                    if !ui.is_rect_visible(rect) {
                        continue;
                    }
                    let [r, g, b] = square.colour.unwrap_or([250, 249, 246]);
                    painter.rect(
                        rect,
                        CornerRadius::ZERO,
                        Color32::from_rgb(r, g, b),
                        line,
                        StrokeKind::Inside,
                    );
                    if let Brush::Symbol(symbol) = brush(content, drawing, square)
                        && symbol != "."
                    {
                        let small = side * if symbol.chars().count() > 2 { 0.35 } else { 0.65 };
                        let dark = u32::from(r) * 3 + u32::from(g) * 6 + u32::from(b) < 1000;
                        let colour = if dark { Color32::WHITE } else { Color32::BLACK };
                        let font = FontId::monospace(small);
                        painter.text(rect.center(), Align2::CENTER_CENTER, symbol, font, colour);
                    }
                    if self.marked == Some((number, column)) {
                        let thick = Stroke::new(2.0, ui.visuals().selection.stroke.color);
                        painter.rect_stroke(rect, CornerRadius::ZERO, thick, StrokeKind::Inside);
                    }
                    if at_click.is_some_and(|p| rect.contains(p))
                        && let Some(brush) = &self.brush
                    {
                        changed = paint(content, drawing, square, brush);
                    }
                }
            }
        });
        changed
    }

    fn palette(&mut self, ui: &mut Ui, content: &Content, drawing: &Drawing) {
        let all = brushes(content, drawing);
        if self.brush.is_none() {
            self.brush = all.first().cloned();
        }
        ui.horizontal_wrapped(|ui| {
            ui.label("Paint with");
            for brush in all {
                let chosen = self.brush.as_ref() == Some(&brush);
                let clicked = match &brush {
                    Brush::Symbol(symbol) => {
                        let text = egui::RichText::new(symbol).monospace();
                        ui.selectable_label(chosen, text).clicked()
                    }
                    Brush::Colour([r, g, b]) => {
                        let (rect, response) = ui.allocate_exact_size(vec2(20.0, 20.0), Sense::click());
                        ui.painter().rect_filled(rect.shrink(2.0), 2.0, Color32::from_rgb(*r, *g, *b));
                        if chosen {
                            let stroke = ui.visuals().selection.stroke;
                            ui.painter().rect_stroke(rect, 2.0, stroke, StrokeKind::Inside);
                        }
                        response.clicked()
                    }
                };
                if clicked {
                    self.brush = Some(brush);
                }
            }
            if let Some(Brush::Colour(colour)) = &mut self.brush {
                ui.color_edit_button_srgb(colour);
            }
        });
    }
}
