//! Random faces far beyond what cloth does, run as users run them, and what must hold of each.
//!
//! Faces are numbered through: [`round::FRAMES`] frames of [`round::FACES`] faces make a round, which has one
//! mesh, one gauge and one way of solving. A face's shape follows from the seed and its number alone, and it shares
//! nothing with the others, so that it can be run again by itself, with the frames before it.

pub mod checks;
pub mod precision;
pub mod round;
pub mod shapes;
pub mod tally;
pub mod variants;

use crate::Result;
use crate::backend::DeviceKind;
use crate::template::TemplateLibrary;
use checks::Check;
use round::{FACES, FRAMES, Place, Plan, Round, Threaded};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};
use tally::{Offence, Report};

/// How long a run goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// So many faces.
    Count(u64),
    /// Until the time is up; the round under way is finished.
    Time(Duration),
}

/// What is run.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    /// Of all random numbers.
    pub seed: u64,
    /// How long.
    pub length: Length,
    /// N of 'the same bytes at 1 and N threads'; 0 takes one per core, but 2 at least.
    pub threads: usize,
    /// Where the f32 backend of those N threads runs: it may be a GPU.
    pub device: DeviceKind,
    /// Part of the name of the GPU adapter to take.
    pub adapter: Option<&'a str>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self { seed: 1, length: Length::Count(100_000), threads: 0, device: DeviceKind::Cpu, adapter: None }
    }
}

impl<'a> Options<'a> {
    fn threaded(&self) -> Threaded<'a> {
        let threads = match self.threads {
            0 => std::thread::available_parallelism().map_or(2, |n| n.get().max(2)),
            n => n,
        };
        Threaded { threads, device: self.device, adapter: self.adapter }
    }
}

/// Runs faces from number 0 on; `progress` is told how many are done, after each frame.
///
/// # Errors
/// Threads that cannot be started.
pub fn run(options: &Options, mut progress: impl FnMut(u64)) -> Result<Report> {
    let began = Instant::now();
    let library = TemplateLibrary::embedded();
    let mut report = Report::new(options.seed);
    let until = match options.length {
        Length::Count(count) => count,
        Length::Time(_) => u64::MAX,
    };
    let mut first = 0;
    while first < until {
        if matches!(options.length, Length::Time(time) if began.elapsed() >= time) {
            break;
        }
        let plan = Plan::new(&library, options.seed, first / (FACES * FRAMES));
        let mut round = Round::new(plan, 0..FACES, options.threaded())?;
        for frame in 0..FRAMES {
            let begin = first + frame * FACES;
            if begin >= until {
                break;
            }
            if let Some(words) = panics(|| round.frame(frame))? {
                blame(&library, options, Place::of(begin), &words, &mut report)?;
                break;
            }
            for face in round.faces(frame).take_while(|face| face.place.number() < until) {
                report.add(&round.plan, &face);
            }
            progress(report.faces);
        }
        first += FACES * FRAMES;
    }
    report.time = began.elapsed();
    Ok(report)
}

/// Runs one face by itself, with its frames before, and reports on it alone.
///
/// # Errors
/// Threads that cannot be started.
pub fn run_one(options: &Options, number: u64) -> Result<Report> {
    let began = Instant::now();
    let library = TemplateLibrary::embedded();
    let mut report = Report::new(options.seed);
    one(&library, options, Place::of(number), &mut report)?;
    report.time = began.elapsed();
    Ok(report)
}

fn one(library: &TemplateLibrary, options: &Options, place: Place, report: &mut Report) -> Result<()> {
    let plan = Plan::new(library, options.seed, place.round);
    let mut round = Round::new(plan, place.slot..place.slot + 1, options.threaded())?;
    for frame in 0..=place.frame {
        if let Some(words) = panics(|| round.frame(frame))? {
            report.check(Check::Panic, place.number(), || Some(words));
            return Ok(());
        }
    }
    for face in round.faces(place.frame) {
        report.add(&round.plan, &face);
        report.describe(&round.plan, &face);
    }
    Ok(())
}

/// The message of a panic within `work`.
pub fn panics(work: impl FnOnce() -> Result<()>) -> Result<Option<String>> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result.map(|()| None),
        Err(cause) => {
            let text = cause.downcast_ref::<&str>().map(|s| (*s).to_string());
            let text = text.or_else(|| cause.downcast_ref::<String>().cloned());
            Ok(Some(format!("panics: {}", text.unwrap_or_default())))
        }
    }
}

/// Finds the faces that make a frame panic by running each alone.
fn blame(
    library: &TemplateLibrary,
    options: &Options,
    begin: Place,
    words: &str,
    report: &mut Report,
) -> Result<()> {
    let before = report.tally(Check::Panic).failed;
    for slot in 0..FACES {
        let mut alone = Report::new(options.seed);
        let place = Place { slot, ..begin };
        one(library, options, place, &mut alone)?;
        if let Some(Offence { words, .. }) = &alone.tally(Check::Panic).first {
            report.check(Check::Panic, place.number(), || Some(words.clone()));
        }
    }
    if report.tally(Check::Panic).failed == before {
        let words = format!("{words} (only with the other faces of its frame)");
        report.check(Check::Panic, begin.number(), || Some(words));
    }
    Ok(())
}
