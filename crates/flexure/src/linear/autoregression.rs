//! An autoregression of a signal, which whitens it.

use crate::linear::correlation::cross_covariance;

/// The largest order tried. Convention.
const LARGEST: usize = 30;
/// Samples for each coefficient of an autoregression that whitens a fit's errors. Convention.
pub(crate) const SAMPLES_PER_COEFFICIENT: usize = 50;

/// The whitening polynomial 1 + r_1 z^-1 + ... of Schwarz's order (Levinson 1947), for a zero-mean signal, with at least
/// `samples_per_coefficient` samples for each coefficient.
pub(crate) fn whitening(e: &[f64], samples_per_coefficient: usize) -> Vec<f64> {
    let n = e.len();
    let largest = LARGEST.min(n / samples_per_coefficient);
    let r = cross_covariance(e, e, largest);
    if !(r[0] > 0.0) {
        return vec![1.0];
    }
    let per = (n as f64).ln() / n as f64;
    let mut a = vec![1.0];
    let mut power = r[0];
    let mut best = (a.clone(), power.ln());
    for order in 1..=largest {
        let reflection = -(0..order).map(|i| a[i] * r[order - i]).sum::<f64>() / power;
        if !(reflection.abs() < 1.0) {
            break;
        }
        let mut next = a.clone();
        next.push(0.0);
        for i in 1..=order {
            next[i] += reflection * a.get(order - i).copied().unwrap_or(0.0);
        }
        a = next;
        power *= 1.0 - reflection * reflection;
        let score = power.ln() + order as f64 * per;
        if score < best.1 {
            best = (a.clone(), score);
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::linear::TransferFunction;

    #[test]
    fn an_autoregression_is_found_with_its_order() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        let white: Vec<f64> = (0..20_000).map(|_| StandardNormal.sample(&mut rng)).collect();
        assert_eq!(whitening(&white, 50), [1.0]);
        let e = TransferFunction::monic(vec![1.0], vec![-1.2, 0.52]).simulate(&white);
        let r = whitening(&e, 50);
        assert_eq!(r.len(), 3);
        assert!((r[1] + 1.2).abs() < 0.03 && (r[2] - 0.52).abs() < 0.03, "{r:?}");
        assert_eq!(whitening(&[0.0; 500], 50), [1.0]);
    }
}
