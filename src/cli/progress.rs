//! What long commands show while they work.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;

/// A bar on a terminal, for anything over a second.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// None is shown with `quiet`.
    pub fn new(quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        bar.set_style(ProgressStyle::with_template("{spinner} {msg}").expect("a valid template"));
        if !quiet {
            let later = bar.clone();
            std::thread::spawn(move || {
                std::thread::sleep(Duration::from_secs(1));
                if !later.is_finished() {
                    // Draws nothing unless standard error is a terminal.
                    later.set_draw_target(ProgressDrawTarget::stderr());
                    later.enable_steady_tick(Duration::from_millis(100));
                }
            });
        }
        Self { bar }
    }

    /// Names what is being done.
    pub fn stage(&self, name: impl Into<std::borrow::Cow<'static, str>>) {
        self.bar.set_message(name);
    }

    /// Begins `count` steps; `step` is what one is called.
    pub fn steps(&self, count: usize, name: &'static str, step: &str) {
        self.stage(name);
        if count > 1 {
            let template = format!("{{bar:40}} {step} {{pos}}/{{len}}, {{eta}} left  {{msg}}");
            self.bar.set_style(ProgressStyle::with_template(&template).expect("a valid template"));
            self.bar.set_length(count as u64);
        }
    }

    /// So many steps are done.
    pub fn update(&self, done: usize) {
        self.bar.set_position(done as u64);
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for Progress {
    /// An error's line is not to stand beside a bar.
    fn drop(&mut self) {
        self.finish();
    }
}
