//! Signals that end the process: first its temporary files are removed and its commands ended.

use std::sync::OnceLock;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

/// Work to do before a signal ends the process.
static BEFORE: OnceLock<Box<dyn Fn() + Send + Sync>> = OnceLock::new();

/// Registers work to do before a signal ends the process. Only the first registration counts.
pub fn before_end(work: impl Fn() + Send + Sync + 'static) {
    let _ = BEFORE.set(Box::new(work));
}

/// Ends the process at once on SIGINT, SIGTERM and SIGHUP, as by default, but removes unfinished files.
pub fn watch() {
    let heard = [SIGINT, SIGTERM, SIGHUP, SIGXFSZ]
        .into_iter()
        .filter(|signal| !is_ignored(*signal));
    let Ok(mut signals) = Signals::new(heard) else {
        return;
    };
    // If no thread can be started, the signals keep their default effect.
    let _ = std::thread::Builder::new().spawn(move || {
        // A file that is larger than the system allows becomes a write error.
        if let Some(signal) = signals.forever().find(|signal| *signal != SIGXFSZ) {
            if let Some(work) = BEFORE.get() {
                work();
            }
            flexure_io::remove_temporaries();
            let _ = emulate_default_handler(signal);
        }
    });
}

/// Whether the parent process set this signal to be ignored, as shells do for background jobs; only Linux tells.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
