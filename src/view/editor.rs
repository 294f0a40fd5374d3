//! The pattern as text: line numbers, what is wrong where it is.

use super::session::Message;
use eframe::egui;
use egui::text::{CCursor, CCursorRange, LayoutJob, TextFormat};
use egui::{Align, Color32, FontId, Id, RichText, Stroke, TextEdit, Ui};

/// The editor's text, which follows the session's.
#[derive(Debug, Default)]
pub struct Editor {
    text: String,
    /// Line and column, from 1, that the cursor is to go to.
    go: Option<(usize, usize)>,
}

fn id() -> Id {
    Id::unique("pattern")
}

impl Editor {
    /// Puts the cursor somewhere, and it into view.
    pub fn go(&mut self, line: usize, column: usize) {
        self.go = Some((line, column));
    }

    /// Shows it; the text, where a person changed it.
    pub fn show(&mut self, ui: &mut Ui, text: &str, message: Option<&Message>) -> Option<String> {
        if self.text != text {
            text.clone_into(&mut self.text);
        }
        if let Some((line, column)) = self.go.take() {
            let line_begins: usize =
                self.text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
            let rest = &self.text[line_begins.min(self.text.len())..];
            // Columns are counted in bytes.
            let within = rest.char_indices().take_while(|(at, _)| at + 1 < column).count();
            let at = self.text[..line_begins.min(self.text.len())].chars().count() + within;
            let word = rest.chars().skip(within).take_while(|c| c.is_alphanumeric()).count();
            let mut state = TextEdit::load_state(ui.ctx(), id()).unwrap_or_default();
            let range = CCursorRange::two(CCursor::new(at), CCursor::new(at + word));
            state.cursor.set_char_range(Some(range));
            TextEdit::store_state(ui.ctx(), id(), state);
            ui.memory_mut(|m| m.request_focus(id()));
        }
        let wrong = message.and_then(|m| m.place).map(|(line, _)| line);
        let font = egui::TextStyle::Monospace.resolve(ui.style());
        let colours = Colours::of(ui);
        let mut layouter = |ui: &Ui, text: &dyn egui::TextBuffer, _: f32| {
            let job = layout(text.as_str(), wrong, &font, &colours);
            ui.fonts_mut(|f| f.layout_job(job))
        };
        let mut changed = false;
        egui::ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
            ui.horizontal_top(|ui| {
                let lines = self.text.split('\n').count().max(1);
                let digits = lines.to_string().len().max(2);
                let numbers: Vec<String> = (1..=lines).map(|n| format!("{n:>digits$}")).collect();
                ui.add(
                    egui::Label::new(RichText::new(numbers.join("\n")).monospace().weak()).selectable(false),
                );
                let edit = TextEdit::multiline(&mut self.text)
                    .id(id())
                    .code_editor()
                    .margin(egui::Margin::ZERO)
                    .frame(egui::Frame::NONE)
                    .desired_rows(24)
                    .desired_width(ui.available_width().max(2000.0))
                    .layouter(&mut layouter);
                changed = edit.show(ui).response.changed();
            });
        });
        changed.then(|| self.text.clone())
    }
}

struct Colours {
    text: Color32,
    comment: Color32,
    quoted: Color32,
    wrong: Color32,
}

impl Colours {
    fn of(ui: &Ui) -> Self {
        let visuals = ui.visuals();
        Self {
            text: visuals.text_color(),
            comment: visuals.weak_text_color(),
            quoted: visuals.hyperlink_color,
            wrong: visuals.error_fg_color,
        }
    }
}

/// Comments and names in quotes in their colours, the line that is wrong underlined.
fn layout(text: &str, wrong: Option<usize>, font: &FontId, colours: &Colours) -> LayoutJob {
    let mut job = LayoutJob::default();
    job.wrap.max_width = f32::INFINITY;
    for (number, line) in (1..).zip(text.split_inclusive('\n')) {
        let underline = if wrong == Some(number) { Stroke::new(1.5, colours.wrong) } else { Stroke::NONE };
        let mut put = |part: &str, color: Color32| {
            if !part.is_empty() {
                let font_id = font.clone();
                let format =
                    TextFormat { font_id, color, underline, valign: Align::BOTTOM, ..Default::default() };
                job.append(part, 0.0, format);
            }
        };
        let (mut from, mut quoted) = (0, false);
        for (at, c) in line.char_indices() {
            match c {
                '"' => {
                    let end = at + usize::from(quoted);
                    put(&line[from..end], if quoted { colours.quoted } else { colours.text });
                    (from, quoted) = (end, !quoted);
                }
                '#' if !quoted && !line[at + 1..].starts_with(|c: char| c.is_ascii_hexdigit()) => {
                    put(&line[from..at], colours.text);
                    put(&line[at..], colours.comment);
                    from = line.len();
                    break;
                }
                _ => {}
            }
        }
        put(&line[from..], if quoted { colours.quoted } else { colours.text });
    }
    job
}
