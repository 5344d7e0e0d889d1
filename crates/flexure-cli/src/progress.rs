//! A spinner or a bar on the terminal's error stream for work of over a second.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
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
        let template = if total > 0.0 {
            "{msg} {wide_bar} {percent} % (Ctrl-C stops)"
        } else {
            "{msg} {spinner} (Ctrl-C stops)"
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
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

/// Runs `work` under a spinner that appears after a second, and shows the stage that `work` reported last.
pub fn spinning_through<T: Send>(what: &'static str, work: impl FnOnce(&dyn Fn(&str)) -> T + Send) -> T {
    let done = AtomicBool::new(false);
    let stage: Mutex<Option<String>> = Mutex::new(None);
    std::thread::scope(|scope| {
        let ticker = scope.spawn(|| {
            let progress = Progress::new(what, 0.0);
            while !done.load(Ordering::Relaxed) {
                if let Some(stage) = stage.lock().ok().and_then(|mut current| current.take()) {
                    progress.bar.set_message(format!("{what}: {stage}"));
                }
                progress.at(0.0);
                progress.bar.tick();
                std::thread::park_timeout(Duration::from_millis(50));
            }
        });
        // Also when `work` panics, or the scope would wait for the ticker for ever.
        let _stop = Stop(&done, ticker.thread());
        work(&|now| {
            if let Ok(mut current) = stage.lock() {
                *current = Some(now.to_owned());
            }
        })
    })
}

struct Stop<'a>(&'a AtomicBool, &'a Thread);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
        self.1.unpark();
    }
}
