//! Work without the interpreter's lock: Ctrl-C stops it, threads share it, forks survive it.

use std::fmt::Display;
use std::hint::black_box;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Mutex, Once, OnceLock, PoisonError};
use std::time::Duration;

use flexure::Interrupt;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::errors::of_library;

/// How often signals are looked for.
const POLL: Duration = Duration::from_millis(50);
/// How long to wait for a computation after it was stopped.
const PATIENCE: Duration = Duration::from_secs(2);

/// Size of a block in bytes. With the bytes that the C library adds, it is below 32 MiB: larger blocks do not change the library's
/// thresholds.
const LARGE: usize = (32 << 20) - (64 << 10);

/// Runs `work` on a new thread, with an interrupt that can stop it. This thread waits without the lock and looks for signals.
///
/// # Errors
/// The exception of a signal's handler, usually `KeyboardInterrupt`: `work` is stopped first, and its result dropped.
/// `RuntimeError` for a panic, which is a defect of Flexure.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Interrupt) -> T + Send + 'static,
) -> PyResult<T> {
    keep_what_is_freed();
    let interrupt = Interrupt::default();
    let theirs = interrupt.clone();
    let (send, receive) = sync_channel(1);
    let receive = Mutex::new(receive);
    std::thread::Builder::new()
        .name("flexure".to_owned())
        .spawn(move || {
            let watched = |place| match place {
                Place::Thread => theirs.watch(|| work(&theirs)),
                Place::Pool => theirs.watch_alone(|| work(&theirs)),
            };
            let result = catch_unwind(AssertUnwindSafe(|| in_pool(watched)));
            // After a signal and a long stop, nobody waits for the result any more.
            let _ = send.send(result);
        })
        .map_err(no_thread)?;
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
            Ok(Ok(result)) => return result.map_err(no_thread)?.map_err(|error| of_library(&error)),
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => return Err(defect()),
            Err(RecvTimeoutError::Timeout) => {
                if let Err(raised) = py.check_signals() {
                    interrupt.stop();
                    // When the caller sees the exception, the cores and the memory should be free again.
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
    let result = py.detach(|| catch_unwind(AssertUnwindSafe(|| in_pool(|_| work()))));
    result.map_err(|_| defect())?.map_err(no_thread)
}

/// Lets threads keep memory from one computation to the next.
///
/// The GNU C library gives freed memory back to the system beyond twice the size of the largest block that was ever freed, at most
/// 64 MiB. The threads of a fresh interpreter would get their arrays from the system at every call, page by page: a tenth of the time of a
/// kernel regression of a million points. Freeing one untouched block of the largest size that counts raises the library's limit.
fn keep_what_is_freed() {
    static ONCE: Once = Once::new();
    if cfg!(all(target_env = "gnu", target_pointer_width = "64")) {
        ONCE.call_once(|| drop(black_box(Vec::<u8>::with_capacity(LARGE))));
    }
}

fn defect() -> PyErr {
    PyRuntimeError::new_err("Flexure failed inside (its message is above); please report this with the data")
}

fn no_thread(error: impl Display) -> PyErr {
    PyRuntimeError::new_err(format!("no thread can be started: {error}"))
}

/// Where a computation runs.
enum Place {
    /// On the calling thread, with rayon's global pool.
    Thread,
    /// On a thread of a pool that does nothing else.
    Pool,
}

/// Runs `work` where rayon has threads: the threads of the global pool do not survive a fork. A child process uses its own pools, one for
/// each simultaneous computation.
fn in_pool<T: Send>(work: impl FnOnce(Place) -> T + Send) -> Result<T, ThreadPoolBuildError> {
    static FIRST: OnceLock<u32> = OnceLock::new();
    static IDLE: Mutex<Vec<(u32, ThreadPool)>> = Mutex::new(Vec::new());
    let process = std::process::id();
    if *FIRST.get_or_init(|| process) == process {
        return Ok(work(Place::Thread));
    }
    // The lock is only tried: if the parent held it at the fork, it is never released.
    let mut kept = None;
    while let Some((of, pool)) = IDLE.try_lock().ok().and_then(|mut idle| idle.pop()) {
        if of == process {
            kept = Some(pool);
            break;
        }
        // A pool of the parent has no threads in this process that could end it.
        std::mem::forget(pool);
    }
    let pool = match kept {
        Some(pool) => pool,
        None => ThreadPoolBuilder::new().build()?,
    };
    let result = pool.install(|| work(Place::Pool));
    if let Ok(mut idle) = IDLE.try_lock() {
        idle.push((process, pool));
    }
    Ok(result)
}
