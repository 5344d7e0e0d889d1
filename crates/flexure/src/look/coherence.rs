//! The share of a column's power that any linear system could explain by another column.

use super::spectrum::{Segments, segment, starts};
use crate::linalg::Complex;

/// Longest segment, samples. Convention: slow systems need long segments, but they take more time.
const LONGEST: usize = 1 << 15;
/// Each segment, with half overlap and Hann windows, is worth this many independent ones (Welch 1967).
const INDEPENDENT: f64 = 0.95;

/// The power of `effect` that is coherent with `cause`, as a share of its power without the mean.
///
/// The squared coherence of K independent segments is $1/K$ on average even without coherence; this is subtracted.
pub(super) fn coherent_share(cause: &[f64], effect: &[f64]) -> f64 {
    let Some(segment) = segment(effect.len(), LONGEST) else {
        return 0.0;
    };
    let mut segments = Segments::new(segment);
    let (mut aa, mut bb) = (vec![0.0; segment / 2 + 1], vec![0.0; segment / 2 + 1]);
    let mut ab = vec![Complex::new(0.0, 0.0); segment / 2 + 1];
    let mut count = 0.0;
    for start in starts(effect.len(), segment) {
        let a = segments.transform(&cause[start..start + segment]).to_vec();
        let b = segments.transform(&effect[start..start + segment]);
        for (k, (a, b)) in a.iter().zip(b).enumerate() {
            aa[k] += a.norm_sqr();
            bb[k] += b.norm_sqr();
            ab[k] += a.conj() * b;
        }
        count += 1.0;
    }
    let chance = 1.0 / (INDEPENDENT * count);
    let coherence = |k: usize| match aa[k] * bb[k] {
        product if product > 0.0 => ((ab[k].norm_sqr() / product - chance) / (1.0 - chance)).clamp(0.0, 1.0),
        _ => 0.0,
    };
    let sum: f64 = (1..bb.len()).map(|k| coherence(k) * bb[k]).sum();
    sum / bb[1..].iter().sum::<f64>().max(f64::MIN_POSITIVE)
}
