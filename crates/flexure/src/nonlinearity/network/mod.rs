//! A neural network with one hidden layer (Cybenko 1989; Haykin 1999, ch. 4).
//!
//! $$ m(x) = b + \sum_{k \le K} c_k \tanh(d_k + v_k \cdot z), $$
//! with z the columns of x, each centred at its median and divided by its quartiles' distance; y is centred at
//! its mean and divided by its standard deviation. The parameters minimise
//! $$ \sum_i w_i (Y_i - m(X_i))^2 + \lambda \sum_k (c_k^2 + d_k^2 + |v_k|^2) $$
//! by the method of Levenberg and Marquardt. There are several starts as in Nguyen and Widrow (1990); the one with the lowest minimum goes
//! on. The decay lambda is given, or it is the one of largest evidence (MacKay 1992; with Levenberg-Marquardt: Foresee and Hagan 1997).
//!
//! There is no guarantee that a minimum is the lowest one. The same data and the same seed give the same network.

mod layer;
mod sample;
mod train;

use super::Outside;
use super::estimator::{Choice, Estimator, Points, Regression, check_queries};
use crate::error::{DataError, Error, Result};
use crate::nonlinearity::estimator::MOST_COLUMNS;
use crate::parallel;
use crate::selection::{OpenEnds, Search};
use layer::Layer;
use sample::{Sample, Scaling, Standardised};
use train::{Trained, train};

/// The most units, given or tried.
const MOST_UNITS: usize = 64;
/// The most starts.
const MOST_STARTS: usize = 100;
/// Numbers of units tried when the data choose.
const TRIED: [usize; 9] = [1, 2, 3, 4, 5, 6, 8, 11, 16];

/// How strongly large parameters are penalised.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Decay {
    /// The lambda of largest evidence, between 1e-8 and 1e8.
    #[default]
    Evidence,
    /// This lambda, with y in units of its standard deviation and x in units of its quartiles.
    Fixed(f64),
}

/// A neural network with one hidden layer, in one to six variables.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `units` | the hidden units K | 1 to 64 | by leave-one-out, among 1 to 16 with at least two points per parameter |
/// | `decay` | lambda | positive and finite | by the evidence |
/// | `starts` | the starts of the training | 1 to 100 | 5 |
/// | `seed` | of the starts | any | 1 |
/// | `outside` | the estimate where a coordinate lies beyond its column's range | | NaN |
///
/// The scores of a number of units are those of the network linearised at its optimum, with the decay held fixed. Its leverages are w
/// j'(J'WJ + lambda D)^-1 j, where j are the derivatives of m by the parameters (Seber and Wild 1989, ch. 5). Refits of the network itself
/// would cost n trainings.
///
/// A step of the training costs O(n P^2), P = 1 + K (d + 2). The starts compete on at most 2000 points, evenly by rank. Beyond 100,000
/// points the number of steps is limited.
///
/// ```
/// use flexure::nonlinearity::{Estimator, NetworkRegression, Regression};
/// let x: Vec<f64> = (0..200).map(|i| i as f64 / 50.0 - 2.0).collect();
/// let y: Vec<f64> = x.iter().map(|x| (3.0 * x).sin()).collect();
/// let fit = NetworkRegression::default().fit(&[&x], &y, None)?;
/// assert!((fit.predict(&[&[0.5]])?[0] - 1.5_f64.sin()).abs() < 1e-3);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkRegression {
    /// The number of hidden units.
    pub units: Choice<usize>,
    /// The penalty of large parameters.
    pub decay: Decay,
    /// The starts of the training.
    pub starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// The estimate where a coordinate lies beyond its column's range. The linear choice continues it from the nearest point of the ranges
    /// with the gradient there.
    pub outside: Outside,
}

impl Default for NetworkRegression {
    fn default() -> Self {
        NetworkRegression {
            units: Choice::default(),
            decay: Decay::default(),
            starts: 5,
            seed: 1,
            outside: Outside::default(),
        }
    }
}

impl NetworkRegression {
    fn check(&self) -> Result<()> {
        let refuse = |name: &str, value: f64, requirement| Err(Error::parameter(name, value, requirement));
        if let Choice::Fixed(units) = self.units
            && !(1..=MOST_UNITS).contains(&units)
        {
            return refuse("the number of units", units as f64, "between 1 and 64");
        }
        if let Decay::Fixed(decay) = self.decay
            && !(decay > 0.0 && decay.is_finite())
        {
            return refuse("the decay", decay, "positive and finite");
        }
        if !(1..=MOST_STARTS).contains(&self.starts) {
            return refuse("the number of starts", self.starts as f64, "between 1 and 100");
        }
        Ok(())
    }
}

impl Estimator for NetworkRegression {
    type Fit = NetworkFit;

    /// # Errors
    /// Those of [`Estimator::fit`]; [`Error::Data`]: `Unit` for values whose squares overflow or vanish.
    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<NetworkFit> {
        self.check()?;
        let points = Points::new("a neural network", MOST_COLUMNS, x, y, weights)?;
        let Standardised { sample, inputs, output } = Sample::standardised(&points);
        let layer = |units| Layer {
            inputs: inputs.len(),
            units,
        };
        let tried: Vec<usize> = match self.units {
            Choice::Fixed(units) => vec![units],
            Choice::FromData(_) => (TRIED.into_iter())
                .filter(|&k| k == 1 || 2 * layer(k).parameters() <= sample.len())
                .collect(),
        };
        let train = |&units: &usize| train(&sample, layer(units), self.decay, self.starts, self.seed);
        let trained: Vec<Trained> = parallel::batch(&tried, train)
            .into_iter()
            .collect::<Option<_>>()
            .ok_or_else(|| {
                Error::Data(DataError::Unit {
                    column: "weights".to_owned(),
                    largest: points.w.iter().copied().fold(0.0, f64::max),
                })
            })?;
        let search = match self.units {
            Choice::Fixed(_) => None,
            Choice::FromData(criterion) => {
                let curve = trained.iter().map(|t| t.score(&sample, output.scale)).collect();
                let open = OpenEnds::above(true);
                Some(Search::best(criterion, curve, open, points.size()))
            }
        };
        let best = search
            .as_ref()
            .and_then(|s| tried.iter().position(|&k| k == s.parameter));
        let trained = &trained[best.unwrap_or(0)];
        Ok(NetworkFit {
            layer: trained.layer,
            theta: trained.theta.clone(),
            decay: trained.decay,
            degrees_of_freedom: trained.degrees_of_freedom(),
            inputs,
            output,
            ranges: (0..x.len()).map(|j| points.range(j)).collect(),
            outside: self.outside,
            search,
        })
    }
}

/// A fitted neural network.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkFit {
    layer: Layer,
    theta: Vec<f64>,
    decay: f64,
    degrees_of_freedom: f64,
    inputs: Vec<Scaling>,
    output: Scaling,
    ranges: Vec<(f64, f64)>,
    outside: Outside,
    search: Option<Search<usize>>,
}

impl NetworkFit {
    /// The number of hidden units, given or chosen.
    pub fn units(&self) -> usize {
        self.layer.units
    }

    /// The decay lambda, given or of largest evidence.
    pub fn decay(&self) -> f64 {
        self.decay
    }

    /// The effective number of parameters: the trace of the hat matrix of the network linearised at its optimum,
    /// between 1 and 1 + K (d + 2).
    pub fn degrees_of_freedom(&self) -> f64 {
        self.degrees_of_freedom
    }

    /// The scores of all numbers of units that were tried, where the number was chosen from the data.
    pub fn search(&self) -> Option<&Search<usize>> {
        self.search.as_ref()
    }

    fn at(&self, x: &[f64]) -> f64 {
        if x.iter().any(|x| x.is_nan()) {
            return f64::NAN;
        }
        let end: Vec<f64> = x.iter().zip(&self.ranges).map(|(x, r)| x.clamp(r.0, r.1)).collect();
        let inside = end == x;
        if !inside && self.outside == Outside::Nan {
            return f64::NAN;
        }
        let z: Vec<f64> = end.iter().zip(&self.inputs).map(|(&x, s)| s.apply(x)).collect();
        let mut value = self.layer.value(&self.theta, &z);
        if !inside && self.outside == Outside::Linear {
            let gradient = self.layer.gradient(&self.theta, &z);
            for (j, slope) in gradient.iter().enumerate().filter(|(j, _)| x[*j] != end[*j]) {
                value += slope * (x[j] - end[j]) / self.inputs[j].scale;
            }
        }
        self.output.centre + self.output.scale * value
    }
}

impl Regression for NetworkFit {
    fn dimension(&self) -> usize {
        self.ranges.len()
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        let x = check_queries(x, self.dimension())?;
        let mut point = vec![0.0; x.len()];
        let estimates = (0..x[0].len()).map(|i| {
            for (p, column) in point.iter_mut().zip(x) {
                *p = column[i];
            }
            self.at(&point)
        });
        Ok(estimates.collect())
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
