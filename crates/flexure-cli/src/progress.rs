//! A spinner or a bar on the terminal's error stream for work of over a second.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::Thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Nothing is drawn before this.
const PATIENCE: Duration = Duration::from_secs(1);

/// Work in progress; the drawing is removed when it is dropped, and absent where there is no terminal.
pub struct Progress {
    bar: ProgressBar,
    started: std::time::Instant,
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
            started: std::time::Instant::now(),
        }
    }

    /// `done` units of the total are done.
    pub fn at(&self, done: f64) {
        if self.bar.is_hidden() && self.started.elapsed() > PATIENCE {
            self.bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
        }
        self.bar.set_position((1000.0 * done) as u64);
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

/// What work says of itself.
#[derive(Default)]
pub struct Reported {
    stage: Mutex<Option<String>>,
    /// The units that are done, and all of them; 0 of 0 where that is not known.
    units: [AtomicUsize; 2],
}

impl Reported {
    /// So many units of the work are done, of so many in all.
    pub fn at(&self, done: usize, all: usize) {
        let [of_done, of_all] = &self.units;
        of_done.store(done, Ordering::Relaxed);
        of_all.store(all, Ordering::Relaxed);
    }

    /// Draws it anew.
    fn show(&self, what: &str, progress: &Progress) {
        if let Some(stage) = self.stage.lock().ok().and_then(|mut current| current.take()) {
            progress.bar.set_message(format!("{what}: {stage}"));
        }
        let [done, all] = self.units.each_ref().map(|units| units.load(Ordering::Relaxed));
        if all > 0 && progress.bar.length() != Some(1000 * all as u64) {
            progress.bar.set_style(style(true));
            progress.bar.set_length(1000 * all as u64);
        }
        progress.at(done as f64);
        progress.bar.tick();
    }
}

/// Runs `work` under a spinner that appears after a second, and becomes a bar once `work` says how much is done.
pub fn measured<T: Send>(what: &'static str, work: impl FnOnce(&Reported) -> T + Send) -> T {
    let done = AtomicBool::new(false);
    let reported = Reported::default();
    std::thread::scope(|scope| {
        let ticker = scope.spawn(|| {
            let progress = Progress::new(what, 0.0);
            while !done.load(Ordering::Relaxed) {
                reported.show(what, &progress);
                std::thread::park_timeout(Duration::from_millis(50));
            }
        });
        // Also when `work` panics, or the scope would wait for the ticker for ever.
        let _stop = Stop(&done, ticker.thread());
        work(&reported)
    })
}

struct Stop<'a>(&'a AtomicBool, &'a Thread);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
        self.1.unpark();
    }
}
