//! Independent jobs over all cores.
//!
//! All jobs of the crate go through one loop, which calls them through a pointer. So rayon's code is compiled once, not for every kind of
//! job.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::interrupt;

/// Jobs are handed out in at most about this many pieces.
const PIECES: usize = 256;

/// The samples in a piece of a signal. The piece is so long that the cost of handing it out is negligible.
const PIECE: usize = 1 << 15;

/// Runs `run` on every job, over all cores of the current rayon thread pool.
///
/// The results are in the order of the jobs. A job does not see the others, so every result is the same, bit for bit, for any number of
/// threads.
pub fn batch<J, R, F>(jobs: &[J], run: F) -> Vec<R>
where
    J: Sync,
    R: Send,
    F: Fn(&J) -> R + Send + Sync,
{
    map(jobs.len(), |i| run(&jobs[i]))
}

/// The values of `of` at 0, 1, ..., `count` - 1, in pieces over all cores.
pub(crate) fn numbers(count: usize, of: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
    if count <= PIECE {
        return (0..count).map(of).collect();
    }
    let piece = |k: usize| -> Vec<f64> { (k * PIECE..count.min((k + 1) * PIECE)).map(&of).collect() };
    map(count.div_ceil(PIECE), piece).concat()
}

/// The values of `of` at 0, 1, ..., `count` - 1, as by [`batch`]. Work that is asked to stop ends between two jobs.
pub(crate) fn map<R: Send>(count: usize, of: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let results: Vec<Mutex<Option<R>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let watching = interrupt::watching();
    let counted = interrupt::Counted::new(count);
    for_each(count, &|i| {
        let result = interrupt::within(&watching, || of(i));
        *results[i].lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
        counted.one();
    });
    let taken = |result: Mutex<Option<R>>| result.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.into_iter().filter_map(taken).collect()
}

fn for_each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    let jobs = (0..count).into_par_iter().with_max_len(count.div_ceil(PIECES).max(1));
    jobs.for_each(work);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_the_order_of_the_jobs() {
        for count in [0, 1, 7, 10_000] {
            let want: Vec<String> = (0..count).map(|i| i.to_string()).collect();
            assert_eq!(map(count, |i| i.to_string()), want);
            let jobs: Vec<usize> = (0..count).collect();
            assert_eq!(batch(&jobs, usize::to_string), want);
        }
    }
}
