//! Questions that the window asks.

use super::session::Session;
use super::state::Kind;
use crate::Result;
use eframe::egui;
use egui::{Context, Id, Modal, Ui};
use std::path::{Path, PathBuf};

/// What is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Whether to close, though something would be lost.
    Close,
    /// Under which name to save something; and whether to close then.
    Name(What, String, bool),
}

/// What is saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// The pattern or chart.
    Source,
    /// The picture.
    Picture,
    /// The yarn.
    Yarn,
    /// The mesh.
    Mesh,
}

impl What {
    /// A name beside what is open.
    pub fn name(self, session: &Session) -> String {
        let own = session.path().map_or_else(|| PathBuf::from("new.knit"), Path::to_path_buf);
        let extension = match self {
            Self::Source => return own.display().to_string(),
            Self::Picture => "view.png",
            Self::Yarn => "bcc",
            Self::Mesh if session.kind() == Kind::Mesh => "view.smobj",
            Self::Mesh => "smobj",
        };
        own.with_extension(extension).display().to_string()
    }
}

/// What came of a question.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Nothing yet.
    None,
    /// Never mind.
    Cancel,
    /// Close, whatever is lost.
    Close,
    /// Save under a name; and whether to close then.
    Save(What, PathBuf, bool),
}

impl Ask {
    /// Shows it.
    pub fn show(&mut self, context: &Context, session: &Session) -> Answer {
        let modal = Modal::new(Id::unique("ask")).show(context, |ui| {
            ui.set_width(420.0);
            match self {
                Ask::Close => close(ui, session),
                Ask::Name(what, name, closing) => save(ui, *what, name, *closing),
            }
        });
        if modal.should_close() { Answer::Cancel } else { modal.inner }
    }
}

fn close(ui: &mut Ui, session: &Session) -> Answer {
    let lost = session.unsaved();
    ui.heading("Close without saving?");
    ui.label(format!("These edits are nowhere but here: {}.", lost.join(", ")));
    if lost.iter().any(|l| matches!(*l, "settings" | "what was pulled")) {
        ui.label("Settings and what was pulled are kept in the yarn or the mesh that is saved.");
    }
    ui.add_space(8.0);
    let mut answer = Answer::None;
    ui.horizontal(|ui| {
        let what = if session.is_dirty() { What::Source } else { What::Mesh };
        let label = if session.is_dirty() { "Save and close" } else { "Save the mesh and close" };
        if ui.button(label).clicked() {
            answer = Answer::Save(what, what.name(session).into(), true);
        }
        if ui.button("Close, lose them").clicked() {
            answer = Answer::Close;
        }
        if ui.button("Go on").clicked() {
            answer = Answer::Cancel;
        }
    });
    answer
}

fn save(ui: &mut Ui, what: What, name: &mut String, closing: bool) -> Answer {
    let (title, kinds) = match what {
        What::Source => ("Save the pattern", ""),
        What::Picture => ("Save the picture", ".png"),
        What::Yarn => ("Save the yarn", ".bcc, .obj, .usda, .npz, .yarns, .txt (Mitsuba), .pbrt"),
        What::Mesh => ("Save the mesh", ".smobj"),
    };
    ui.heading(title);
    let field = ui.add(egui::TextEdit::singleline(name).desired_width(400.0));
    if !field.has_focus() && !field.lost_focus() {
        field.request_focus();
    }
    if !kinds.is_empty() {
        ui.weak(kinds);
    }
    if Path::new(name.as_str()).exists() {
        ui.colored_label(ui.visuals().warn_fg_color, "There is such a file: it is replaced.");
    }
    ui.add_space(8.0);
    let enter = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
    let mut answer = Answer::None;
    ui.horizontal(|ui| {
        if (ui.button("Save").clicked() || enter) && !name.trim().is_empty() {
            answer = Answer::Save(what, name.trim().into(), closing);
        }
        if ui.button("Cancel").clicked() {
            answer = Answer::Cancel;
        }
    });
    answer
}

/// Saves what needs no picture.
///
/// # Errors
/// Those of the session.
pub fn write(session: &mut Session, what: What, path: &Path) -> Result<()> {
    match what {
        What::Source if session.path() == Some(path) => session.save(),
        What::Source => session.save_as(path),
        What::Yarn => session.save_yarn(path),
        What::Mesh => session.save_mesh(path),
        What::Picture => Ok(()),
    }
}

/// The question that somebody else's changes raise: `Some(true)` to take them.
pub fn conflict(context: &Context) -> Option<bool> {
    let modal = Modal::new(Id::unique("conflict")).show(context, |ui| {
        ui.set_width(420.0);
        ui.heading("The file was changed");
        ui.label("Another program wrote it while there were edits here. Undo brings yours back if you take the file's.");
        ui.add_space(8.0);
        let mut answer = None;
        ui.horizontal(|ui| {
            if ui.button("Take the file's").clicked() {
                answer = Some(true);
            }
            if ui.button("Keep mine").clicked() {
                answer = Some(false);
            }
        });
        answer
    });
    modal.inner
}
