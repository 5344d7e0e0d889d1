//! A spinner or a bar on the terminal's error stream for work of over a second; where that is no terminal, a line now and then.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::thread::Thread;
use std::time::{Duration, Instant};

use flexure::Interrupt;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

/// Nothing is drawn before this.
const PATIENCE: Duration = Duration::from_secs(1);
/// Where there is no terminal, a line follows after this time, the next one after twice the time, and so on: a log stays short.
const FIRST_LINE: Duration = Duration::from_secs(30);

/// The variable that asks for progress in lines, for a program that shows it itself.
pub const LINES: &str = "FLEXURE_PROGRESS";
/// What such a line begins with.
pub const MARK: &str = "progress: ";

/// Work in progress; the drawing is removed when it is dropped.
pub struct Progress {
    bar: ProgressBar,
    started: Instant,
    lines: Lines,
}

/// What is written where nothing can be drawn.
enum Lines {
    /// Nothing: there is a terminal.
    None,
    /// A line for each step, as is asked for; the one that was written last.
    All(Mutex<String>),
    /// A line now and then; the seconds after which the next one follows.
    Few(AtomicU64),
}

impl Lines {
    fn new() -> Self {
        if std::env::var_os(LINES).is_some() {
            Lines::All(Mutex::default())
        } else if std::io::stderr().is_terminal() {
            Lines::None
        } else {
            Lines::Few(AtomicU64::new(FIRST_LINE.as_secs()))
        }
    }

    /// The line to write now, for work with this message, this share of it done, after this time.
    fn next(&self, message: &str, share: Option<u64>, passed: Duration) -> Option<String> {
        let line = message.to_owned() + &share.map_or(String::new(), |share| format!(", {share} %"));
        match self {
            Lines::None => None,
            Lines::All(last) => {
                let mut last = last.lock().ok()?;
                (*last != line).then(|| {
                    last.clone_from(&line);
                    format!("{MARK}{line}")
                })
            }
            Lines::Few(next) => {
                let due = next.load(Ordering::Relaxed);
                (passed.as_secs() >= due).then(|| {
                    next.store(2 * due, Ordering::Relaxed);
                    format!("still {line} ({} s)", passed.as_secs())
                })
            }
        }
    }
}

impl Progress {
    /// Work of `total` units, for example seconds of simulated time; 0 if that is not known.
    pub fn new(what: &'static str, total: f64) -> Self {
        let bar = ProgressBar::new((1000.0 * total) as u64);
        bar.set_style(style(total > 0.0));
        bar.set_message(what);
        bar.set_draw_target(indicatif::ProgressDrawTarget::hidden());
        Progress {
            bar,
            started: Instant::now(),
            lines: Lines::new(),
        }
    }

    /// `done` units of the total are done.
    pub fn at(&self, done: f64) {
        if self.bar.is_hidden() && self.started.elapsed() > PATIENCE {
            self.bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
        }
        self.bar.set_position((1000.0 * done) as u64);
        let share = (100 * self.bar.position()).checked_div(self.bar.length().unwrap_or(0));
        if let Some(line) = self.lines.next(&self.bar.message(), share, self.started.elapsed()) {
            eprintln!("{line}");
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Runs `work` under a spinner that appears after a second.
pub fn spinning<T: Send>(what: &'static str, work: impl FnOnce() -> T + Send) -> T {
    spinning_through(what, |_| work())
}

/// How work in progress is drawn: as a bar with the time that is left, or as a spinner with the time that has passed.
fn style(is_bar: bool) -> ProgressStyle {
    let template = match is_bar {
        true => "{msg} {wide_bar} {percent} %, {eta} left (Ctrl-C stops)",
        false => "{msg} {spinner} {elapsed} (Ctrl-C stops)",
    };
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Runs `work` under a spinner that appears after a second, and shows the stage that `work` reported last.
pub fn spinning_through<T: Send>(what: &'static str, work: impl FnOnce(&dyn Fn(&str)) -> T + Send) -> T {
    measured(what, |reported| {
        work(&|now| {
            if let Ok(mut current) = reported.stage.lock() {
                *current = Some(now.to_owned());
            }
        })
    })
}

/// The progress that the work reports.
#[derive(Default)]
pub struct Reported {
    stage: Mutex<Option<String>>,
    /// The units that are done, and all of them; 0 of 0 where that is not known.
    units: [AtomicUsize; 2],
}

impl Reported {
    /// Reports that `done` of `all` units of the work are done.
    pub fn at(&self, done: usize, all: usize) {
        let [of_done, of_all] = &self.units;
        of_done.store(done, Ordering::Relaxed);
        of_all.store(all, Ordering::Relaxed);
    }

    /// Draws the progress anew; `step` says how much of the present step is left.
    fn show(&self, what: &str, step: Option<String>, progress: &Progress) {
        let stage = self.stage.lock().ok().and_then(|current| current.clone());
        let [done, all] = self.units.each_ref().map(|units| units.load(Ordering::Relaxed));
        // The time left for the step is not shown once that for all of the work is.
        let step = step.filter(|_| done == 0);
        let parts = [Some(what.to_owned()), stage, step];
        let message = parts.into_iter().flatten().collect::<Vec<_>>().join(": ");
        progress.bar.set_message(message);
        // Before any unit is done, the time left is unknown.
        if done > 0 && progress.bar.length() != Some(1000 * all as u64) {
            progress.bar.set_style(style(true));
            progress.bar.set_length(1000 * all as u64);
        }
        progress.at(done as f64);
        progress.bar.tick();
    }
}

/// The present step of the work, a loop of the library: how much of it is left.
struct Step {
    began: Instant,
    /// The jobs that were done then or when last seen, and all.
    first: u64,
    done: u64,
    all: u64,
}

impl Step {
    fn new(now: Instant) -> Self {
        Step {
            began: now,
            first: 0,
            done: 0,
            all: 0,
        }
    }

    /// How much of the step is left; known after a second, once some of it is done.
    fn left(&mut self, now: Instant, progress: Option<(u64, u64)>) -> Option<String> {
        let (done, all) = progress?;
        if all != self.all || done < self.done {
            (self.began, self.first, self.all) = (now, done, all);
        }
        self.done = done;
        let passed = now.saturating_duration_since(self.began);
        if passed < PATIENCE || done <= self.first {
            return None;
        }
        let share = all.saturating_sub(done) as f64 / (done - self.first) as f64;
        let left = HumanDuration(Duration::try_from_secs_f64(passed.as_secs_f64() * share).ok()?);
        Some(format!(
            "this step {:.0} %, {left} left",
            100.0 * done as f64 / all as f64
        ))
    }
}

/// Runs `work` under a spinner that appears after a second, and becomes a bar once `work` says how much is done.
pub fn measured<T: Send>(what: &'static str, work: impl FnOnce(&Reported) -> T + Send) -> T {
    let done = AtomicBool::new(false);
    let reported = Reported::default();
    let interrupt = Interrupt::default();
    std::thread::scope(|scope| {
        let ticker = std::thread::Builder::new().spawn_scoped(scope, || {
            let progress = Progress::new(what, 0.0);
            let mut step = Step::new(Instant::now());
            while !done.load(Ordering::Relaxed) {
                let left = step.left(Instant::now(), interrupt.progress());
                reported.show(what, left, &progress);
                std::thread::park_timeout(Duration::from_millis(50));
            }
        });
        // Stops the ticker even if `work` panics; otherwise the scope would wait for it for ever.
        let _stop = ticker.as_ref().ok().map(|ticker| Stop(&done, ticker.thread()));
        match interrupt.watch(|| work(&reported)) {
            Ok(result) => result,
            // This work is never asked to stop: signals end the process.
            Err(_) => std::process::exit(1),
        }
    })
}

struct Stop<'a>(&'a AtomicBool, &'a Thread);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
        self.1.unpark();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_said_of_the_time_before_something_is_done() {
        let (reported, progress) = (Reported::default(), Progress::new("identifying", 0.0));
        let length = |done: usize| {
            reported.at(done, 8);
            reported.show("identifying", None, &progress);
            progress.bar.length()
        };
        assert_eq!(length(0), Some(0));
        assert_eq!(length(1), Some(8000));
    }

    #[test]
    fn one_estimate_is_shown_of_what_is_left() {
        let (reported, progress) = (Reported::default(), Progress::new("identifying", 0.0));
        let message = |done: usize| {
            reported.at(done, 8);
            reported.show("identifying", Some("this step 20 %".to_owned()), &progress);
            progress.bar.message()
        };
        assert_eq!(message(0), "identifying: this step 20 %");
        assert_eq!(message(1), "identifying");
    }

    #[test]
    fn a_log_gets_few_lines() {
        let lines = Lines::Few(AtomicU64::new(FIRST_LINE.as_secs()));
        let at = |seconds: u64| lines.next("identifying: wiener", None, Duration::from_secs(seconds));
        assert_eq!(at(29), None);
        assert_eq!(at(31).as_deref(), Some("still identifying: wiener (31 s)"));
        assert_eq!(at(59), None);
        assert_eq!(at(60).as_deref(), Some("still identifying: wiener (60 s)"));
        assert_eq!(at(119), None);
        assert_eq!(
            lines.next("simulating", Some(40), Duration::from_secs(130)).as_deref(),
            Some("still simulating, 40 % (130 s)")
        );
    }

    #[test]
    fn lines_that_are_asked_for_come_once_for_each_step() {
        let lines = Lines::All(Mutex::default());
        let next = |what: &str, share| lines.next(what, share, Duration::ZERO);
        assert_eq!(next("reading", None).as_deref(), Some("progress: reading"));
        assert_eq!(next("reading", None), None);
        assert_eq!(next("reading", Some(1)).as_deref(), Some("progress: reading, 1 %"));
    }

    #[test]
    fn what_is_left_of_a_step_follows_from_its_jobs() {
        let start = Instant::now();
        let at = |seconds: f64| start + Duration::from_secs_f64(seconds);
        let mut step = Step::new(start);
        assert_eq!(step.left(at(0.5), None), None);
        assert_eq!(step.left(at(1.0), Some((0, 100))), None);
        // Nothing is known before the first job is done, and nothing is said before a second.
        assert_eq!(step.left(at(2.5), Some((0, 100))), None);
        assert_eq!(
            step.left(at(3.0), Some((20, 100))).as_deref(),
            Some("this step 20 %, 8 seconds left")
        );
        // The next step begins anew, also where it has as many jobs.
        assert_eq!(step.left(at(3.5), Some((1, 100))), None);
        assert_eq!(
            step.left(at(5.5), Some((51, 100))).as_deref(),
            Some("this step 51 %, 2 seconds left")
        );
        assert_eq!(step.left(at(6.0), Some((1, 4))), None);
    }
}
