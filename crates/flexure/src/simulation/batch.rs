//! Independent jobs over all cores.

use rayon::prelude::*;

/// Runs `run` on every job, over all cores of the current rayon thread pool.
///
/// The results are in the order of the jobs. A job sees nothing of the others, so that every result
/// is, bit for bit, the same for any number of threads.
pub fn batch<J, R, F>(jobs: &[J], run: F) -> Vec<R>
where
    J: Sync,
    R: Send,
    F: Fn(&J) -> R + Send + Sync,
{
    jobs.par_iter().with_max_len(1).map(run).collect()
}
