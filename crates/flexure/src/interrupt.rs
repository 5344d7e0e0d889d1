//! Stopping a computation from another thread.
//!
//! Under [`Interrupt::watch`] every long loop of the library ends soon after [`Interrupt::stop`]: searches, descents, starts,
//! cross-validation. The partial result is discarded, and the error is [`Error::Stopped`], so no loop needs a result for an early end.
//!
//! ```
//! use flexure::{Interrupt, error::Stopped};
//!
//! let interrupt = Interrupt::default();
//! let theirs = interrupt.clone();
//! std::thread::spawn(move || theirs.stop()).join().unwrap();
//! assert_eq!(interrupt.watch(|| 1 + 1), Err(Stopped::Interrupted.into()));
//! ```
//!
//! Progress functions stop simulations, studies and identifications as well: between their steps, with the same error, which contains the
//! progress ([`Stopped`]).

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::error::{Error, Result, Stopped};

thread_local! {
    /// The watcher of the thread's work.
    static CURRENT: RefCell<Option<Watched>> = const { RefCell::new(None) };
}

/// The watcher of a thread's work.
#[derive(Clone)]
struct Watched {
    interrupt: Interrupt,
    /// Whether the thread, although it belongs to a pool, does no other work meanwhile.
    alone: bool,
    /// Whether the work is a job of a loop.
    is_job: bool,
}

impl Watched {
    /// Whether the thread's present work is the watched work.
    fn is_asked(&self) -> bool {
        self.alone || rayon::current_thread_index().is_none()
    }
}

/// Restores the earlier watcher, even if the work panics.
struct Before(Option<Watched>);

impl Drop for Before {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

/// The payload of the unwinding when work was asked to stop.
struct Leaving;

/// Asks the computations that it watches to stop. Clones ask the same computations, from any thread.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<State>);

#[derive(Debug, Default)]
struct State {
    requested: AtomicBool,
    /// The jobs of the outermost loop that are done, and all of them.
    progress: [AtomicU64; 2],
    /// In tests: after this number of further checks the interrupt requests itself.
    #[cfg(test)]
    fuse: std::sync::Mutex<Option<u64>>,
}

impl Interrupt {
    /// Asks the computations to stop; this cannot be undone.
    pub fn stop(&self) {
        self.0.requested.store(true, Ordering::Relaxed);
    }

    /// Whether they have been asked to stop.
    pub fn is_requested(&self) -> bool {
        #[cfg(test)]
        self.burn();
        self.0.requested.load(Ordering::Relaxed)
    }

    /// Whether to continue, as the return value of a progress function.
    pub fn flow(&self) -> ControlFlow<()> {
        match self.is_requested() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    /// The progress of the outermost loop over jobs in the watched work: the numbers of done jobs and of all; `None` before the first loop.
    /// One loop may follow another.
    ///
    /// ```
    /// use flexure::{Interrupt, simulation::batch};
    ///
    /// let interrupt = Interrupt::default();
    /// interrupt.watch(|| batch(&[1, 2, 3], |job| 2 * job))?;
    /// assert_eq!(interrupt.progress(), Some((3, 3)));
    /// # Ok::<(), flexure::Error>(())
    /// ```
    pub fn progress(&self) -> Option<(u64, u64)> {
        let [done, all] = self.0.progress.each_ref().map(|count| count.load(Ordering::Relaxed));
        (all > 0).then_some((done, all))
    }

    /// Reports the progress of this thread's work to its watcher: for long work outside the library, such as reading a file.
    pub fn report(done: u64, all: u64) {
        if let Some(watching) = outermost() {
            watching.begin(all);
            watching.advance(done);
        }
    }

    /// Begins a loop over `all` jobs.
    fn begin(&self, all: u64) {
        let [done, of] = &self.0.progress;
        done.store(0, Ordering::Relaxed);
        of.store(all, Ordering::Relaxed);
    }

    /// Counts `by` further jobs as done.
    fn advance(&self, by: u64) {
        self.0.progress[0].fetch_add(by, Ordering::Relaxed);
    }

    /// Does `work` on this thread; it ends soon when asked to stop. Inside, another `watch` replaces this one.
    ///
    /// The threads of rayon's pools take work from each other: there, the loops do not check, and `work` runs to its end; but see
    /// [`watch_alone`](Self::watch_alone).
    ///
    /// # Errors
    /// [`Error::Stopped`] if it was asked to stop before it ended, whatever its result.
    pub fn watch<T>(&self, work: impl FnOnce() -> T) -> Result<T> {
        self.watch_as(false, work)
    }

    /// As [`watch`](Self::watch), on a thread of a rayon pool that has no other work until this returns: all jobs that the thread takes
    /// from others belong to `work`, so the loops check there too.
    ///
    /// For a forked process, in which the threads of rayon's global pool do not exist:
    ///
    /// ```
    /// use flexure::{Error, Interrupt};
    ///
    /// let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    /// let interrupt = Interrupt::default();
    /// assert_eq!(pool.install(|| interrupt.watch_alone(|| 1 + 1)), Ok(2));
    /// ```
    ///
    /// # Errors
    /// [`Error::Stopped`] if it was asked to stop before it ended, whatever its result.
    pub fn watch_alone<T>(&self, work: impl FnOnce() -> T) -> Result<T> {
        self.watch_as(true, work)
    }

    fn watch_as<T>(&self, alone: bool, work: impl FnOnce() -> T) -> Result<T> {
        let interrupt = self.clone();
        let watched = Watched {
            interrupt,
            alone,
            is_job: false,
        };
        let _before = Before(CURRENT.replace(Some(watched)));
        match catch_unwind(AssertUnwindSafe(work)) {
            Ok(result) if !self.is_requested() => Ok(result),
            Err(payload) if !payload.is::<Leaving>() => resume_unwind(payload),
            _ => Err(Error::Stopped(Stopped::Interrupted)),
        }
    }
}

/// The watcher of this thread's work, for the closures that it passes to other threads; without a watcher, an interrupt that is never
/// requested.
///
/// A waiting thread of rayon's pool may meanwhile do work of another computation: its watcher is then not asked.
pub(crate) fn current() -> Interrupt {
    CURRENT.with_borrow(|current| match current {
        Some(watched) if watched.is_asked() => watched.interrupt.clone(),
        _ => Interrupt::default(),
    })
}

/// Whether this thread's work is asked to stop. The call takes some nanoseconds.
pub(crate) fn requested() -> bool {
    CURRENT.with_borrow(|current| {
        let asked = current.as_ref().filter(|watched| watched.interrupt.is_requested());
        asked.is_some_and(Watched::is_asked)
    })
}

/// The watcher of this thread's work, if there is one.
pub(crate) fn watching() -> Option<Interrupt> {
    CURRENT.with_borrow(|current| {
        let asked = current.as_ref().filter(|watched| watched.is_asked());
        asked.map(|watched| watched.interrupt.clone())
    })
}

/// The receiver of the job counts of a loop that begins on this thread: the thread's watcher, unless the thread itself works on such a job.
fn outermost() -> Option<Interrupt> {
    CURRENT.with_borrow(|current| {
        let asked = current.as_ref().filter(|watched| watched.is_asked() && !watched.is_job);
        asked.map(|watched| watched.interrupt.clone())
    })
}

/// Counts the jobs of a loop for the watcher of this thread.
pub(crate) struct Counted(Option<Interrupt>);

impl Counted {
    /// Begins a loop over `all` jobs.
    pub(crate) fn new(all: usize) -> Self {
        let watching = outermost();
        if let Some(watching) = &watching {
            watching.begin(all as u64);
        }
        Counted(watching)
    }

    /// A job is done.
    pub(crate) fn one(&self) {
        if let Some(watching) = &self.0 {
            watching.advance(1);
        }
    }
}

/// A long loop checks whether to stop after this many items: some milliseconds of work.
const PART: usize = 1 << 14;

/// Called at item `i` of a long loop; checks now and then whether to stop, and then unwinds.
pub(crate) fn leave_at(i: usize) {
    if i.is_multiple_of(PART) {
        leave();
    }
}

/// The rounds of a search, counted for its progress: each round is one job. Loops within a round are not counted.
pub(crate) struct Rounds {
    counted: Counted,
    rounds: std::ops::Range<usize>,
    _before: Before,
}

/// Begins a search of at most `most` rounds.
pub(crate) fn rounds(most: usize) -> Rounds {
    let counted = Counted::new(most);
    let before = CURRENT.with_borrow_mut(|current| {
        let before = current.clone();
        current.iter_mut().for_each(|watched| watched.is_job = true);
        before
    });
    Rounds {
        counted,
        rounds: 0..most,
        _before: Before(before),
    }
}

impl Iterator for Rounds {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let round = self.rounds.next()?;
        if round > 0 {
            self.counted.one();
        }
        Some(round)
    }
}

impl Drop for Rounds {
    /// A search can end before its last round: then the remaining rounds count as done.
    fn drop(&mut self) {
        if let Some(watching) = &self.counted.0 {
            watching.begin(0);
        }
    }
}

/// Does a job of work with this watcher, on any thread: the job's loops ask there too. Unwinds if it is asked to stop.
///
/// Every job sets its own watcher: a thread that waits within one job may take a job of another computation, and then asks that one's
/// watcher.
pub(crate) fn within<T>(watching: &Option<Interrupt>, job: impl FnOnce() -> T) -> T {
    let watched = watching.clone().map(|interrupt| Watched {
        interrupt,
        alone: true,
        is_job: true,
    });
    let _before = Before(CURRENT.replace(watched));
    leave();
    job()
}

/// Unwinds to the watch of this thread's work, if that is asked to stop: for loops that cannot return an error.
pub(crate) fn leave() {
    if requested() {
        resume_unwind(Box::new(Leaving));
    }
}

/// An error if this thread's work is asked to stop.
///
/// # Errors
/// [`Error::Stopped`].
pub(crate) fn check() -> Result<()> {
    match requested() {
        true => Err(Error::Stopped(Stopped::Interrupted)),
        false => Ok(()),
    }
}

#[cfg(test)]
impl Interrupt {
    /// An interrupt that requests itself after it has been asked `times` times.
    pub(crate) fn after(times: u64) -> Self {
        let interrupt = Interrupt::default();
        *interrupt.0.fuse.lock().unwrap() = Some(times);
        interrupt
    }

    /// How often it can still be asked.
    pub(crate) fn left(&self) -> u64 {
        self.0.fuse.lock().unwrap().unwrap_or(0)
    }

    fn burn(&self) {
        if let Some(left) = &mut *self.0.fuse.lock().unwrap() {
            match left.checked_sub(1) {
                Some(less) => *left = less,
                None => self.stop(),
            }
        }
    }
}

#[cfg(test)]
#[path = "interrupt_tests.rs"]
mod tests;
