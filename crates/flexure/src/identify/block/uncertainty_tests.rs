use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::super::signals::convolved;
use super::*;
use crate::identify::WIENER_HAMMERSTEIN;
use crate::linear::TransferFunction;
use crate::linear::least_squares::least_squares;
use crate::record::Record;

fn normal(n: usize, random: &mut Pcg64) -> Vec<f64> {
    (0..n).map(|_| StandardNormal.sample(random)).collect()
}

/// Residuals that are linear in the parameters.
struct Regression {
    columns: Vec<Vec<f64>>,
    y: Vec<f64>,
}

impl Residuals for Regression {
    fn from(&self) -> usize {
        0
    }

    fn residuals(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let fitted = |k: usize| parameters.iter().zip(&self.columns).map(|(p, c)| p * c[k]).sum::<f64>();
        Some((0..self.y.len()).map(|k| fitted(k) - self.y[k]).collect())
    }

    fn linearise(&self, parameters: &[f64]) -> Linearisation {
        Linearisation {
            residuals: self.residuals(parameters).unwrap(),
            jacobian: self.columns.clone(),
        }
    }
}

/// The estimates of 0 by (generalised) least squares under an error of this colour, and what is said of a function of them.
fn estimates(pole: f64, generalised: bool) -> ([f64; 2], [f64; 2]) {
    const RUNS: usize = 600;
    let mut random = Pcg64::seed_from_u64(3);
    let colour = TransferFunction::monic(vec![1.0], vec![-pole]);
    let slow = TransferFunction::monic(vec![1.0], vec![-0.9]);
    let columns = vec![slow.simulate(&normal(400, &mut random)), normal(400, &mut random)];
    let (mut squares, mut said) = ([0.0; 2], [0.0; 2]);
    for _ in 0..RUNS {
        let y = colour.simulate(&normal(400, &mut random));
        let problem = Regression {
            columns: columns.clone(),
            y: y.clone(),
        };
        let at = match generalised {
            false => least_squares(&y, &columns, 0).unwrap().coefficients,
            true => {
                let filter = whitening_filter(&problem, &y).unwrap_or(vec![1.0]);
                let white: Vec<Vec<f64>> = columns.iter().map(|c| convolved(&filter, c)).collect();
                least_squares(&convolved(&filter, &y), &white, filter.len() - 1)
                    .unwrap()
                    .coefficients
            }
        };
        // A number that follows from both parameters, and not linearly.
        let number = |p: &[f64]| p[0] + (2.0 * p[1]).sin();
        let uncertainty = Uncertainty::new(&problem, at.clone()).unwrap();
        let derived = uncertainty.of(|p| Some(vec![p[0], number(p)])).unwrap();
        for (i, value) in [at[0], number(&at)].into_iter().enumerate() {
            squares[i] += value * value / RUNS as f64;
            said[i] += derived.covariance(i, i) / RUNS as f64;
        }
    }
    (squares, said)
}

/// Variances are those over many records: of least squares and of the efficient estimate, under white and coloured errors.
#[test]
fn variances_are_those_over_many_records() {
    for (pole, generalised) in [(0.0, false), (0.8, false), (0.8, true), (-0.6, false)] {
        let (squares, said) = estimates(pole, generalised);
        for i in 0..2 {
            // The variance of 600 squares is known to 6 %.
            let ratio = said[i] / squares[i];
            assert!(
                (0.82..1.2).contains(&ratio),
                "{pole}, {generalised}: {squares:?} {said:?}"
            );
        }
    }
}

#[test]
fn a_band_is_straight_between_its_points_and_held_beyond() {
    let band = Band {
        x: vec![0.0, 1.0, 3.0],
        width: vec![2.0, 4.0, 0.0],
    };
    for (x, want) in [
        (-5.0, 2.0),
        (0.0, 2.0),
        (0.5, 3.0),
        (1.0, 4.0),
        (2.0, 2.0),
        (3.0, 0.0),
        (9.0, 0.0),
    ] {
        assert_eq!(band.at(x), want, "{x}");
    }
    let points = Band::points([-1.0, 1.0]);
    assert_eq!(
        (points[0], points[BAND_POINTS / 2], points.len()),
        (-1.0, 0.0, BAND_POINTS)
    );
}

/// A cubic between two poles, in the record's units: bands and standard errors contain the truth as often as they promise.
#[test]
fn bands_of_a_wiener_hammerstein_system_hold_its_curve() {
    let f = |x: f64| 3.0 + 2.0 * x + 0.3 * x * x - 0.1 * x * x * x;
    let front = TransferFunction::new(vec![0.3], vec![1.0, -0.7]).unwrap();
    let back = TransferFunction::new(vec![0.2], vec![1.0, -0.8]).unwrap();
    let (mut inside, mut all) = ([0_u32; 2], [0_u32; 2]);
    for seed in 1..=12 {
        let mut random = Pcg64::seed_from_u64(seed);
        let u: Vec<f64> = normal(2000, &mut random).iter().map(|u| 1.0 + 2.0 * u).collect();
        let between: Vec<f64> = front.simulate(&u).iter().map(|x| f(*x)).collect();
        let noise = normal(2000, &mut random);
        let y = back
            .simulate(&between)
            .iter()
            .zip(noise)
            .map(|(y, e)| y + 0.05 * e)
            .collect();
        let found = WIENER_HAMMERSTEIN
            .identify(&Record::new([("u", u), ("y", y)]).unwrap(), &["u"], "y")
            .unwrap();
        let path = &found.paths[0];
        for block in path.curves() {
            for ((x, y), half) in block.curve.x().iter().zip(block.curve.y()).zip(&block.band) {
                inside[0] += u32::from((y - f(*x)).abs() <= *half);
                all[0] += 1;
            }
        }
        for (block, truth) in path.linear().zip([[0.3, -0.7], [0.2, -0.8]]) {
            let errors = block.errors.as_ref().unwrap();
            if let ([b], [_, a]) = (block.system.b(), block.system.a()) {
                for (value, truth, error) in [(b, truth[0], errors.b[0]), (a, truth[1], errors.a[1])] {
                    inside[1] += u32::from((value - truth).abs() <= 2.0 * error);
                    all[1] += 1;
                }
            }
        }
    }
    let share = |i: usize| f64::from(inside[i]) / f64::from(all[i]);
    // Counts over 12 independent curves and 24 nearly independent poles.
    assert!(all[1] >= 40 && share(1) >= 0.85, "{inside:?} of {all:?}");
    assert!((0.8..1.0).contains(&share(0)), "{inside:?} of {all:?}");
}
