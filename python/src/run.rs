//! Work without the interpreter's lock: Ctrl-C stops it, threads share it, forks survive it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use flexure::Interrupt;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::of_library;

/// How often signals are looked for.
const POLL: Duration = Duration::from_millis(50);
/// How long a computation that was told to stop is waited for.
const PATIENCE: Duration = Duration::from_secs(2);

/// Runs `work` on a thread of its own, watched by the interrupt that it is given, while this one waits without the lock and looks
/// for signals.
///
/// # Errors
/// Whatever a signal's handler raises, `KeyboardInterrupt` above all: `work` is stopped first, and its result thrown away.
/// `RuntimeError` for a panic, which is a defect of Flexure.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Interrupt) -> T + Send + 'static,
) -> PyResult<T> {
    let interrupt = Interrupt::default();
    let theirs = interrupt.clone();
    let (send, receive) = sync_channel(1);
    let receive = Mutex::new(receive);
    std::thread::Builder::new()
        .name("flexure".to_owned())
        .spawn(move || {
            let watched = || theirs.watch(|| work(&theirs));
            let result = catch_unwind(AssertUnwindSafe(|| in_pool(watched)));
            // Nobody waits any more where a signal came and stopping took long.
            let _ = send.send(result);
        })
        .map_err(|error| PyRuntimeError::new_err(format!("no thread can be started: {error}")))?;
    let wait = |time: Duration| {
        py.detach(|| {
            receive
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .recv_timeout(time)
        })
    };
    loop {
        match wait(POLL) {
            Ok(Ok(result)) => return result.map_err(|error| of_library(&error)),
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => return Err(defect()),
            Err(RecvTimeoutError::Timeout) => {
                if let Err(raised) = py.check_signals() {
                    interrupt.stop();
                    // The cores are free again when the exception is seen, and so is the memory.
                    let _ = wait(PATIENCE);
                    return Err(raised);
                }
            }
        }
    }
}

/// Runs `work`, too short to be interrupted, without the lock.
///
/// # Errors
/// `RuntimeError` for a panic.
pub fn briefly<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(|| in_pool(work))).map_err(|_| defect()))
}

fn defect() -> PyErr {
    PyRuntimeError::new_err("Flexure failed inside (its message is above); please report this with the data")
}

/// Runs `work` where rayon has threads: those of the global pool do not survive a fork, and a child gets its own.
fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static FIRST: OnceLock<u32> = OnceLock::new();
    static CHILDS: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let process = std::process::id();
    if *FIRST.get_or_init(|| process) == process {
        return work();
    }
    let pool = {
        let mut kept = CHILDS.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some((of, pool)) if *of == process => Some(Arc::clone(pool)),
            _ => ThreadPoolBuilder::new().build().ok().map(|pool| {
                let pool = Arc::new(pool);
                // That of the parent, if any, has no threads here that could end it.
                std::mem::forget(kept.replace((process, Arc::clone(&pool))));
                pool
            }),
        }
    };
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}
