//! Scripts: what a person would do, line by line, for tests and pictures of the window. Mouse and keys are fed in as the window's own
//! events; the rest calls what they call.

use crate::{Error, Result};
use eframe::egui;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, pos2};
use std::path::{Path, PathBuf};

/// A line of a script.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Lets so many frames go by.
    Wait(u32),
    /// Lets so many seconds go by.
    Pause(f64),
    /// Waits until the fabric is at rest and painted.
    Settle,
    /// Replaces text of the pattern, everywhere.
    Replace(String, String),
    /// Changes a setting.
    Set(String, String),
    /// Pulls a vertex by so much, with a reach; world units.
    Pull(u32, [f64; 3], f64),
    /// Looks from a side.
    View(f64, f64),
    /// Shows a frame.
    Frame(usize),
    /// Events, a frame each.
    Events(Vec<Vec<Event>>),
    /// Saves the window, the picture, the yarn or the mesh.
    Write(Written, PathBuf),
    /// Prints what there is as a line of JSON.
    Print,
    /// Asks the window to close, as its corner does.
    Close,
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// The window.
    Screenshot,
    /// The knit.
    Picture,
    /// The yarn.
    Yarn,
    /// The mesh.
    Mesh,
}

/// Reads a script: a step a line, `#` begins a comment.
///
/// # Errors
/// The first line that is none.
pub fn parse(path: &Path, text: &str) -> Result<Vec<Step>> {
    let mut steps = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let step = step(line).ok_or_else(|| {
            Error::input(path, number, 1, format_args!("'{line}'"), "a step of a script, see docs/view.md")
        })?;
        steps.push(step);
    }
    Ok(steps)
}

fn step(line: &str) -> Option<Step> {
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    let rest = rest.trim();
    let numbers = || rest.split_whitespace().map(|w| w.parse::<f64>().ok()).collect::<Option<Vec<f64>>>();
    let write = |what| (!rest.is_empty()).then(|| Step::Write(what, rest.into()));
    Some(match word {
        "wait" => Step::Wait(rest.parse().ok()?),
        "pause" => match numbers()?[..] {
            [seconds] if (0.0..=60.0).contains(&seconds) => Step::Pause(seconds),
            _ => return None,
        },
        "settle" => Step::Settle,
        "replace" => {
            let (from, to) = rest.split_once(" => ")?;
            Step::Replace(from.replace("\\n", "\n"), to.replace("\\n", "\n"))
        }
        "set" => {
            let (name, value) = rest.split_once(' ')?;
            Step::Set(name.into(), value.trim().into())
        }
        "pull" => match numbers()?[..] {
            [vertex, x, y, z, reach] => Step::Pull(vertex as u32, [x, y, z], reach),
            _ => return None,
        },
        "view" => match numbers()?[..] {
            [azimuth, elevation] => Step::View(azimuth, elevation),
            _ => return None,
        },
        "frame" => Step::Frame(rest.parse().ok()?),
        "key" => Step::Events(key(rest)?),
        "type" => Step::Events(vec![vec![Event::Text(rest.replace("\\n", "\n"))]]),
        "move" | "click" | "drag" | "scroll" => mouse(word, rest)?,
        "screenshot" => write(Written::Screenshot)?,
        "picture" => write(Written::Picture)?,
        "yarn" => write(Written::Yarn)?,
        "mesh" => write(Written::Mesh)?,
        "print" => Step::Print,
        "close" => Step::Close,
        _ => return None,
    })
}

/// `ctrl+shift+z`: pressed in a frame, let go in the next.
fn key(text: &str) -> Option<Vec<Vec<Event>>> {
    let mut modifiers = Modifiers::NONE;
    let mut words: Vec<&str> = text.split('+').collect();
    let name = words.pop()?;
    for word in words {
        modifiers |= modifier(word)?;
    }
    let mut capital = name.to_string();
    if let Some(first) = capital.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    let key = Key::from_name(&capital)?;
    let event =
        |pressed| vec![Event::Key { key, physical_key: Some(key), pressed, repeat: false, modifiers }];
    Some(vec![event(true), event(false)])
}

fn modifier(word: &str) -> Option<Modifiers> {
    Some(match word {
        "ctrl" => Modifiers { ctrl: true, command: true, ..Modifiers::NONE },
        "shift" => Modifiers::SHIFT,
        "alt" => Modifiers::ALT,
        _ => return None,
    })
}

/// `move X Y`, `click BUTTON X Y`, `drag BUTTON X Y X Y`, `scroll X Y LINES`; buttons as `left`, `shift+middle`.
fn mouse(word: &str, rest: &str) -> Option<Step> {
    let mut words: Vec<&str> = rest.split_whitespace().collect();
    let (mut modifiers, mut button) = (Modifiers::NONE, PointerButton::Primary);
    if matches!(word, "click" | "drag") && !words.is_empty() {
        for name in words.remove(0).split('+') {
            match name {
                "left" => button = PointerButton::Primary,
                "middle" => button = PointerButton::Middle,
                "right" => button = PointerButton::Secondary,
                other => modifiers |= modifier(other)?,
            }
        }
    }
    let numbers = words.iter().map(|w| w.parse::<f32>().ok()).collect::<Option<Vec<f32>>>()?;
    let press = |pos: Pos2, pressed| Event::PointerButton { pos, button, pressed, modifiers };
    Some(Step::Events(match (word, &numbers[..]) {
        ("move", [x, y]) => vec![vec![Event::PointerMoved(pos2(*x, *y))]],
        ("click", [x, y]) => {
            let at = pos2(*x, *y);
            vec![vec![Event::PointerMoved(at)], vec![press(at, true)], vec![press(at, false)]]
        }
        ("drag", [x0, y0, x1, y1]) => {
            let (from, to) = (pos2(*x0, *y0), pos2(*x1, *y1));
            let mut frames = vec![vec![Event::PointerMoved(from)], vec![press(from, true)]];
            frames.extend((1..=8).map(|k| vec![Event::PointerMoved(from + (to - from) * (k as f32 / 8.0))]));
            frames.push(vec![press(to, false)]);
            frames
        }
        ("scroll", [x, y, lines]) => {
            let wheel = Event::MouseWheel {
                unit: egui::MouseWheelUnit::Line,
                delta: egui::vec2(0.0, *lines),
                phase: egui::TouchPhase::Move,
                source: egui::MouseWheelSource::Wheel,
                modifiers,
            };
            vec![vec![Event::PointerMoved(pos2(*x, *y))], vec![wheel]]
        }
        _ => return None,
    }))
}

/// The modifiers that an event says are down.
pub fn modifiers_of(event: &Event) -> Modifiers {
    match event {
        Event::Key { modifiers, pressed: true, .. } | Event::PointerButton { modifiers, .. } => *modifiers,
        _ => Modifiers::NONE,
    }
}
