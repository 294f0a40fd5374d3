//! Undo: states one after the other, edits of one kind in one go taken as one.

use super::state::State;

/// What an edit was of; successive ones of the same kind within [`TOGETHER`] are undone together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Edit {
    /// Letters of the pattern.
    Text,
    /// A setting, by name.
    Setting(&'static str),
    /// A pull, by a number of its own.
    Pull(u64),
    /// Something that stands alone.
    Alone,
}

/// Seconds within which edits of one kind count as one.
pub const TOGETHER: f64 = 0.8;
/// States kept.
const MOST: usize = 1000;

/// States, and which one it is now.
#[derive(Debug)]
pub struct History {
    states: Vec<State>,
    now: usize,
    last: Option<(Edit, f64)>,
}

impl History {
    /// Begins.
    pub fn new(state: State) -> Self {
        Self { states: vec![state], now: 0, last: None }
    }

    /// The state it is now.
    pub fn state(&self) -> &State {
        &self.states[self.now]
    }

    /// Makes a new state; what was undone is gone. Returns whether anything is different.
    pub fn push(&mut self, edit: Edit, time: f64, state: State) -> bool {
        if state == *self.state() {
            return false;
        }
        self.states.truncate(self.now + 1);
        let joins = self.last.as_ref().is_some_and(|(last, at)| {
            *last == edit
                && edit != Edit::Alone
                && (matches!(edit, Edit::Pull(_)) || time - at < TOGETHER)
                && self.now > 0
        });
        if joins {
            self.states[self.now] = state;
        } else {
            self.states.push(state);
            if self.states.len() > MOST {
                self.states.remove(0);
            }
            self.now = self.states.len() - 1;
        }
        self.last = Some((edit, time));
        true
    }

    /// Whether the last thing that happened was this edit.
    pub fn is_last(&self, edit: &Edit) -> bool {
        self.last.as_ref().is_some_and(|(last, _)| last == edit)
    }

    /// One back; whether there was one.
    pub fn undo(&mut self) -> bool {
        self.last = None;
        let can = self.now > 0;
        self.now -= usize::from(can);
        can
    }

    /// Takes the last edit back for good.
    pub fn drop_last(&mut self) {
        self.undo();
        self.states.truncate(self.now + 1);
    }

    /// One forward again; whether there was one.
    pub fn redo(&mut self) -> bool {
        self.last = None;
        let can = self.now + 1 < self.states.len();
        self.now += usize::from(can);
        can
    }

    /// How many can be undone and done again.
    pub fn depth(&self) -> [usize; 2] {
        [self.now, self.states.len() - 1 - self.now]
    }
}
