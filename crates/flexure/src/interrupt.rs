//! Stopping a computation from another thread.
//!
//! Under [`Interrupt::watch`] every long loop of the library ends soon after [`Interrupt::stop`]: searches, descents, starts,
//! cross-validation. The partial result is discarded, and the error is [`Error::Stopped`], so that no loop has to say in its
//! result that it was cut short.
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
//! Progress functions stop simulations, studies and identifications as well: between their steps, with the same error and how far
//! the work had come in it ([`Stopped`]).

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::error::{Error, Result, Stopped};

thread_local! {
    /// What the thread's work is watched by.
    static CURRENT: RefCell<Option<Watched>> = const { RefCell::new(None) };
}

/// What a thread's work is watched by.
#[derive(Clone)]
struct Watched {
    interrupt: Interrupt,
    /// Whether the thread does the work of nothing else meanwhile, though it is a pool's.
    alone: bool,
    /// Whether the work is a job of a loop.
    is_job: bool,
}

impl Watched {
    /// Whether what the thread does now is what is watched.
    fn is_asked(&self) -> bool {
        self.alone || rayon::current_thread_index().is_none()
    }
}

/// Puts back what was watched by, also when work panics.
struct Before(Option<Watched>);

impl Drop for Before {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

/// What unwinds from work that was asked to stop.
struct Leaving;

/// Asks the computations that it watches to stop; clones ask the same ones, from any thread.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<State>);

#[derive(Debug, Default)]
struct State {
    requested: AtomicBool,
    /// The jobs of the outermost loop that are done, and all of them.
    progress: [AtomicU64; 2],
    /// In tests: the number of times still to be asked before it is requested by itself.
    #[cfg(test)]
    fuse: std::sync::Mutex<Option<u64>>,
}

impl Interrupt {
    /// Asks them to stop, for good.
    pub fn stop(&self) {
        self.0.requested.store(true, Ordering::Relaxed);
    }

    /// Whether they have been asked to stop.
    pub fn is_requested(&self) -> bool {
        #[cfg(test)]
        self.burn();
        self.0.requested.load(Ordering::Relaxed)
    }

    /// Whether to go on: what the library's progress functions return.
    pub fn flow(&self) -> ControlFlow<()> {
        match self.is_requested() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    /// How far the outermost loop over jobs is in the work that is watched: those that are done, and all; `None` before the first loop.
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

    /// Says to what watches this thread how far its work is: for long work beside the library's, such as reading a file.
    pub fn report(done: u64, all: u64) {
        if let Some(watching) = outermost() {
            watching.begin(all);
            watching.advance(done);
        }
    }

    /// A loop over so many jobs begins.
    fn begin(&self, all: u64) {
        let [done, of] = &self.0.progress;
        done.store(0, Ordering::Relaxed);
        of.store(all, Ordering::Relaxed);
    }

    /// So many more jobs are done.
    fn advance(&self, by: u64) {
        self.0.progress[0].fetch_add(by, Ordering::Relaxed);
    }

    /// Does `work` on this thread, which ends soon when asked to. Inside, another `watch` takes the place of this one.
    ///
    /// The threads of rayon's pools take work from each other: there, the loops do not ask, and `work` runs to its end;
    /// but see [`watch_alone`](Self::watch_alone).
    ///
    /// # Errors
    /// [`Error::Stopped`] if it was asked to stop before it ended, whatever its result.
    pub fn watch<T>(&self, work: impl FnOnce() -> T) -> Result<T> {
        self.watch_as(false, work)
    }

    /// As [`watch`](Self::watch), on a thread of a rayon pool that has no other work until this returns: whatever the thread
    /// takes from the others belongs to `work`, so that the loops ask there too.
    ///
    /// For a process that was forked, where the threads of rayon's global pool are not:
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

/// What this thread's work is watched by, for the closures that it hands to other threads; one that is never requested where
/// nothing watches.
///
/// A thread of rayon's pool that waits may meanwhile do what belongs to another computation: what it is watched by is not asked.
pub(crate) fn current() -> Interrupt {
    CURRENT.with_borrow(|current| match current {
        Some(watched) if watched.is_asked() => watched.interrupt.clone(),
        _ => Interrupt::default(),
    })
}

/// Whether this thread's work is asked to stop: some nanoseconds.
pub(crate) fn requested() -> bool {
    CURRENT.with_borrow(|current| {
        let asked = current.as_ref().filter(|watched| watched.interrupt.is_requested());
        asked.is_some_and(Watched::is_asked)
    })
}

/// What this thread's work is watched by, if it is.
pub(crate) fn watching() -> Option<Interrupt> {
    CURRENT.with_borrow(|current| {
        let asked = current.as_ref().filter(|watched| watched.is_asked());
        asked.map(|watched| watched.interrupt.clone())
    })
}

/// What hears of the jobs of a loop that begins on this thread: what watches it, unless it is itself such a job.
fn outermost() -> Option<Interrupt> {
    CURRENT.with_borrow(|current| {
        let asked = current.as_ref().filter(|watched| watched.is_asked() && !watched.is_job);
        asked.map(|watched| watched.interrupt.clone())
    })
}

/// Counts the jobs of a loop for what watches this thread.
pub(crate) struct Counted(Option<Interrupt>);

impl Counted {
    /// A loop over so many jobs begins.
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

/// The items between two questions whether a long loop is to stop: some milliseconds of work.
const PART: usize = 1 << 14;

/// At item `i` of a long loop, ends it now and then if it is to stop.
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
    /// A search can end before its last round: then the rest of the rounds is done too.
    fn drop(&mut self) {
        if let Some(watching) = &self.counted.0 {
            watching.begin(0);
        }
    }
}

/// Does a job of work that is watched so, on whatever thread: the job's loops ask there too. Unwinds if it is asked to stop.
///
/// Every job says so for itself. A thread that waits within one may take another computation's, and asks for that one meanwhile.
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

/// Unwinds to the watch of this thread's work, if that is asked to stop: for loops whose result has no place for that.
pub(crate) fn leave() {
    if requested() {
        resume_unwind(Box::new(Leaving));
    }
}

/// An error where this thread's work is asked to stop.
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
    /// One that is requested by itself once it has been asked so many times.
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
