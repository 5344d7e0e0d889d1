//! Points in units of their own spread.

use super::super::blocks::{Row, load};
use super::super::estimator::Points;
use super::super::series::{Location, location};
use crate::interrupt::{self, Interrupt};
use crate::sort::order;
use std::ops::Range;

/// A scale is at least this share of the range, so that no standardised coordinate exceeds the inverse of the share.
const NARROWEST: f64 = 1e-9;

/// (value - centre)/scale
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scaling {
    pub centre: f64,
    pub scale: f64,
}

impl Scaling {
    fn robust(x: &[f64], w: &[f64]) -> Scaling {
        let order = order(&[x, w]).into_iter();
        let (x, w): (Vec<f64>, Vec<f64>) = order.map(|i| (x[i], w[i])).unzip();
        let Location { centre, scale } = location(&x, &w);
        let range = x[x.len() - 1] - x[0];
        Scaling {
            centre,
            scale: scale.max(NARROWEST * range),
        }
    }

    /// From the mean and the standard deviation. If the deviation is zero, the scale is 1.
    fn moments(points: &Points) -> Scaling {
        let centre = points.mean();
        let square: f64 = points
            .y
            .iter()
            .zip(&points.w)
            .map(|(y, w)| w * (y - centre).powi(2))
            .sum();
        let scale = (square / points.total_weight()).sqrt();
        Scaling {
            centre,
            scale: if scale > 0.0 { scale } else { 1.0 },
        }
    }

    pub fn apply(self, value: f64) -> f64 {
        (value - self.centre) / self.scale
    }
}

/// Standardised points, in the order of [`Points`].
#[derive(Debug, Clone)]
pub(super) struct Sample {
    /// The coordinates by columns.
    pub z: Vec<Vec<f64>>,
    pub u: Vec<f64>,
    pub w: Vec<f64>,
    /// The sum of the weights.
    pub total: f64,
    /// What may stop the training.
    pub interrupt: Interrupt,
}

/// A sample and the units of its coordinates and ordinates.
pub(super) struct Standardised {
    pub sample: Sample,
    pub inputs: Vec<Scaling>,
    pub output: Scaling,
}

/// The coordinates, ordinates and weights of a block; the weights beyond its end are zero.
pub(super) struct SampleBlock {
    pub z: Vec<Row>,
    pub u: Row,
    pub w: Row,
}

impl Sample {
    /// Standardises the coordinates by their medians and quartiles, and the ordinates by their mean and standard deviation.
    pub fn standardised(points: &Points) -> Standardised {
        let inputs: Vec<Scaling> = points.x.iter().map(|x| Scaling::robust(x, &points.w)).collect();
        let output = Scaling::moments(points);
        let columns = points.x.iter().zip(&inputs);
        let sample = Sample {
            z: columns.map(|(x, s)| x.iter().map(|&x| s.apply(x)).collect()).collect(),
            u: points.y.iter().map(|&y| output.apply(y)).collect(),
            w: points.w.clone(),
            total: points.total_weight(),
            interrupt: interrupt::current(),
        };
        Standardised { sample, inputs, output }
    }

    pub fn len(&self) -> usize {
        self.u.len()
    }

    /// At most `most` points, evenly by rank.
    pub fn thinned(&self, most: usize) -> Sample {
        let n = self.len();
        let m = most.min(n);
        let pick = |v: &[f64]| -> Vec<f64> { (0..m).map(|i| v[(2 * i + 1) * n / (2 * m)]).collect() };
        let w = pick(&self.w);
        Sample {
            z: self.z.iter().map(|z| pick(z)).collect(),
            u: pick(&self.u),
            total: w.iter().sum(),
            w,
            interrupt: self.interrupt.clone(),
        }
    }

    /// The coordinates of one point.
    pub fn point(&self, i: usize) -> Vec<f64> {
        self.z.iter().map(|z| z[i]).collect()
    }

    /// The points of a block.
    pub fn block(&self, range: &Range<usize>) -> SampleBlock {
        SampleBlock {
            z: self.z.iter().map(|z| load(z, range, None)).collect(),
            u: load(&self.u, range, None),
            w: load(&self.w, range, Some(0.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standardised_points_have_no_units() {
        let x: Vec<f64> = (0..41).map(|i| f64::from((7 * i) % 41) / 10.0).collect();
        let y: Vec<f64> = x.iter().map(|x| x.sin()).collect();
        let of = |gain: f64, offset: f64| {
            let moved = |v: &[f64]| v.iter().map(|v| gain * v + offset).collect::<Vec<_>>();
            let points = Points::new("a test", 2, &[&moved(&x), &moved(&y)], &moved(&y), None).unwrap();
            Sample::standardised(&points).sample
        };
        let (one, other) = (of(1.0, 0.0), of(1e-3, 5.0));
        for (a, b) in one
            .z
            .iter()
            .flatten()
            .chain(&one.u)
            .zip(other.z.iter().flatten().chain(&other.u))
        {
            assert!((a - b).abs() < 1e-11, "{a} {b}");
        }
        let square: f64 = one.u.iter().map(|u| u * u).sum();
        assert!((square - 41.0).abs() < 1e-12);
    }

    #[test]
    fn far_outliers_and_ties_leave_a_scale() {
        let mut x = vec![2.0; 30];
        x[29] = 1e90;
        let points = Points::new("a test", 1, &[&x], &x, None).unwrap();
        let sample = Sample::standardised(&points).sample;
        assert!(sample.z[0].iter().all(|z| z.abs() <= 1e9), "{:?}", sample.z);
    }

    #[test]
    fn thinning_keeps_the_spread() {
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        let points = Points::new("a test", 1, &[&x], &x, None).unwrap();
        let sample = Sample::standardised(&points).sample;
        let few = sample.thinned(10);
        assert_eq!((few.len(), few.total), (10, 10.0));
        assert_eq!(few.z[0][0], sample.z[0][50]);
        assert_eq!(few.z[0][9], sample.z[0][950]);
        assert_eq!(sample.thinned(5000).u, sample.u);
    }
}
