//! Errors that come in bursts.
//!
//! Errors of one spectrum at all times are independent from frequency to frequency. Those of a velocity are not: friction turns them into
//! torque only while the velocity changes sign, and these samples determine the curve's steep part. So the products of columns and
//! residuals are also summed over stretches of time, and the scatter of these sums is the variance (batch means; a covariance for clusters,
//! Liang & Zeger 1986).

use realfft::RealFftPlanner;

use super::equations::Equations;
use super::fourier::smooth_from;
use super::limits::{FEWEST_IN_STRETCH, STRETCHES};
use crate::linalg::{Complex, Matrix};
use crate::parallel;
use crate::vectors::dot;

/// The covariance of the equations' moments by their scatter over time.
pub(super) fn over_time(equations: &Equations, residuals: &[Vec<Complex<f64>>]) -> Matrix {
    let lines = residuals.iter().map(Vec::len).max().unwrap_or(0);
    // Products reach twice as far in frequency.
    let length = smooth_from(4 * lines.max(1));
    let stretches = STRETCHES.min(length / FEWEST_IN_STRETCH).max(1);
    let inverse = RealFftPlanner::new().plan_fft_inverse(length);
    let in_time = |lines: &[Complex<f64>], noise: &[f64]| -> Vec<f64> {
        let mut spectrum = inverse.make_input_vec();
        let weighted = lines.iter().zip(noise).map(|(v, s)| v * (2.0 / s).sqrt());
        spectrum.iter_mut().zip(weighted).for_each(|(a, b)| *a = b);
        // A real signal has a real mean.
        spectrum[0].im = 0.0;
        let mut signal = inverse.make_output_vec();
        // Cannot fail: the lengths are the plan's own.
        let _ = inverse.process(&mut spectrum, &mut signal);
        signal
    };
    let errors: Vec<Vec<f64>> = residuals
        .iter()
        .zip(&equations.noise)
        .map(|(r, noise)| in_time(r, noise))
        .collect();
    let sums: Vec<Vec<f64>> = parallel::batch(&equations.columns, |column| {
        let mut sums = vec![0.0; stretches];
        for ((lines, noise), errors) in column.iter().zip(&equations.noise).zip(&errors) {
            let Some(lines) = lines else { continue };
            for (t, (a, b)) in in_time(lines, noise).iter().zip(errors).enumerate() {
                // Each side of the spectrum has half of the sum.
                sums[t * stretches / length] += 0.5 * a * b / length as f64;
            }
        }
        let mean = sums.iter().sum::<f64>() / stretches as f64;
        sums.iter_mut().for_each(|s| *s -= mean);
        sums
    });
    Matrix::from_fn(sums.len(), sums.len(), |i, j| dot(&sums[i], &sums[j]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::robot_joint::fourier::Modulation;

    /// Noise occurs only where the column is not zero: four times the variance that follows from the spectrum.
    #[test]
    fn bursts_count_where_they_meet_the_column() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let n = 8000;
        let modulation = Modulation::new(n, 0.01, 40.0);
        let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
        let inside = |i: usize| (i / 50).is_multiple_of(4);
        let column: Vec<f64> = (0..n)
            .map(|i| if inside(i) { (0.3 * i as f64).sin() } else { 0.0 })
            .collect();
        let mut ratio = [0.0; 2];
        const RUNS: usize = 20;
        for _ in 0..RUNS {
            for (kind, ratio) in ratio.iter_mut().enumerate() {
                let errors: Vec<f64> = (0..n)
                    .map(|i| {
                        let e: f64 = StandardNormal.sample(&mut rng);
                        match (kind, inside(i)) {
                            (0, _) => e,
                            (_, true) => 2.0 * e,
                            (_, false) => 0.0,
                        }
                    })
                    .collect();
                let noise = vec![1.0; modulation.len()];
                let equations = Equations {
                    columns: vec![vec![Some(modulation.of(&column))]],
                    right: vec![modulation.of(&errors)],
                    noise: vec![&noise],
                    noisy: Vec::new(),
                    given: Vec::new(),
                };
                let solution = equations.solve().unwrap();
                let over_time = over_time(&equations, &solution.residuals)[0];
                *ratio += over_time * solution.covariance.at(0, 0) / RUNS as f64;
            }
        }
        assert!((ratio[0] - 1.0).abs() < 0.25, "{ratio:?}");
        assert!((ratio[1] - 4.0).abs() < 0.8, "{ratio:?}");
    }
}
