//! Cubic regression splines with the penalty of the smoothing spline.
//!
//! m minimises $\sum_i w_i (Y_i - m(X_i))^2 + \lambda \int m''(x)^2 dx$ over the cubic splines with given knots. With a knot at every
//! distinct x this is the smoothing spline itself (Reinsch 1967). With fewer knots it is the penalised B-spline of O'Sullivan (1986; Wand
//! and Ormerod 2008). The normal equations are banded. The leverages need only the same band of their inverse (Hutchinson and de Hoog
//! 1985). So a fit with its exact leave-one-out score takes O(n).

pub(crate) mod banded;
pub(crate) mod basis;

use super::Outside;
use super::estimator::{Choice, Estimator, Points, Regression, check_queries, evaluate};
use crate::error::{DataError, Error, ParameterError, Result};
use crate::interrupt;
use crate::parallel;
use crate::selection::{OpenEnds, ScoredParameter, Search, UNDETERMINED, lowest};
use crate::sort;
use banded::{Banded, Factor};
use basis::{CubicSplines, LocalValues};

/// Penalties of the logarithmic grid.
const GRID: usize = 40;
/// Further penalties on either side of the best, in each of two refinements.
const FINER: usize = 4;
/// The largest penalty tried, in units of the weight of all points, on [0, 1]. The fit is then practically a straight line.
const LARGEST: f64 = 1.0;
/// The smallest penalty tried reduces the shortest wave that the knots can follow by this share.
const SMALLEST: f64 = 0.03;
/// If the degrees of freedom lie farther than this outside their range, the leverages have lost their digits.
const ROUNDING: f64 = 1e-3;
/// Knots closer than this share of the quartiles' distance are taken as one, as the roughness grows with the inverse cube of the distance.
const CLOSEST: f64 = 1e-6;

/// A penalised cubic spline in one variable.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `penalty` | lambda, in the unit of x cubed times that of the weights | zero or positive, finite | by leave-one-out |
/// | `knots` | the most knots; fewer distinct x all become knots, more are thinned by rank | at least 2 | 200 |
/// | `outside` | the estimate beyond the data's range | | NaN |
///
/// ```
/// use flexure::nonlinearity::{Estimator, Regression, SplineRegression};
/// let x: Vec<f64> = (0..400).map(|i| i as f64 / 100.0 - 2.0).collect();
/// let y: Vec<f64> = x.iter().map(|x| x.tanh()).collect();
/// let fit = SplineRegression::default().fit(&[&x], &y, None)?;
/// assert!((fit.predict(&[&[0.5]])?[0] - 0.5_f64.tanh()).abs() < 1e-6);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplineRegression {
    /// The weight of the roughness, lambda.
    pub penalty: Choice<f64>,
    /// The most knots.
    pub knots: usize,
    /// The estimate beyond the data's range.
    pub outside: Outside,
}

impl Default for SplineRegression {
    fn default() -> Self {
        SplineRegression {
            penalty: Choice::default(),
            knots: 200,
            outside: Outside::default(),
        }
    }
}

impl Estimator for SplineRegression {
    type Fit = SplineFit;

    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<SplineFit> {
        if let Choice::Fixed(penalty) = self.penalty
            && !(penalty >= 0.0 && penalty.is_finite())
        {
            return Err(Error::parameter("the penalty", penalty, "zero or positive, and finite"));
        }
        if self.knots < 2 {
            return Err(Error::parameter("the number of knots", self.knots as f64, "at least 2"));
        }
        let points = Points::new("a spline regression", 1, x, y, weights)?;
        let distinct = points.distinct();
        if distinct.len() < 2 {
            return Err(Error::constant("x", distinct[0]));
        }
        let singular = || {
            Error::Parameter(ParameterError::BeyondData {
                parameter: "the number of knots",
                value: self.knots.min(distinct.len()),
                most: 2,
                reason: "x is spread so unevenly that with this penalty the normal equations for more are singular in double \
                     precision (points far from all others may be wrong)",
            })
        };
        let problem = Problem::new(&points, &distinct, self.knots);
        if !problem.unit().is_normal() {
            return Err(Error::Data(DataError::Unit {
                column: "x".to_owned(),
                largest: problem.high - problem.low,
            }));
        }
        let search = match self.penalty {
            Choice::Fixed(_) => None,
            Choice::FromData(criterion) => {
                let curve = problem.curve(|c| c.score(criterion));
                if curve.is_empty() {
                    return Err(singular());
                }
                let open = OpenEnds {
                    below: true,
                    above: true,
                };
                Some(Search::best(criterion, curve, open, points.size()))
            }
        };
        let penalty = match self.penalty {
            Choice::Fixed(penalty) => penalty,
            Choice::FromData(_) => search.as_ref().map_or(0.0, |s| s.parameter),
        };
        problem.fit(penalty, self.outside, search).ok_or_else(singular)
    }
}

/// At most `most` of the increasing abscissas `u` on [0, 1], evenly by rank, the ends included.
fn thinned(u: &[f64], most: usize, closest: f64) -> Vec<f64> {
    let (d, m) = (u.len(), most.min(u.len()));
    // Counted from the nearer end, so that mirrored data give mirrored knots.
    let rank = |i: usize| i * (d - 1) / (m - 1);
    let knots = (0..m).map(|i| u[if 2 * i < m { rank(i) } else { d - 1 - rank(m - 1 - i) }]);
    let mut kept = vec![0.0];
    for knot in knots {
        if knot - kept[kept.len() - 1] > closest && 1.0 - knot > closest {
            kept.push(knot);
        }
    }
    kept.push(1.0);
    kept
}

/// The banded normal equations of the residuals from a straight line.
///
/// The line is subtracted first. The penalty does not affect a line, so a heavy penalty then cannot drown it in rounding.
struct Problem<'a> {
    points: &'a Points,
    low: f64,
    high: f64,
    /// The distance of the quartiles of the distinct abscissas, on [0, 1].
    bulk: f64,
    splines: CubicSplines,
    /// The four B-splines of every point.
    rows: Vec<LocalValues<4>>,
    gram: Banded,
    roughness: Banded,
    moment: Vec<f64>,
    residual: Vec<f64>,
    line: StraightLine,
}

impl<'a> Problem<'a> {
    fn new(points: &'a Points, distinct: &[f64], most: usize) -> Problem<'a> {
        let (low, high) = points.range(0);
        let unit = |x: f64| (x - low) / (high - low);
        let d = distinct.len();
        let breakpoints: Vec<f64> = distinct.iter().map(|x| unit(*x)).collect();
        let bulk = breakpoints[d - 1 - d / 4] - breakpoints[d / 4];
        let bulk = if bulk > 0.0 { bulk } else { 1.0 };
        let splines = CubicSplines::new(&thinned(&breakpoints, most, CLOSEST * bulk));
        let u: Vec<f64> = points.x[0].iter().map(|x| unit(*x)).collect();
        let line = StraightLine::new(&u, points);
        interrupt::leave();
        let rows: Vec<LocalValues<4>> = u.iter().map(|u| splines.at(*u)).collect();
        let residual: Vec<f64> = (u.iter().zip(&points.y)).map(|(u, y)| y - line.value(*u)).collect();
        interrupt::leave();
        let mut gram = Banded::zeros(splines.len());
        let mut moment = vec![0.0; splines.len()];
        for ((row, w), r) in rows.iter().zip(&points.w).zip(&residual) {
            gram.add_products(row.first, &row.values, *w);
            for (m, v) in moment[row.first..].iter_mut().zip(row.values) {
                *m += w * v * r;
            }
        }
        let roughness = splines.roughness();
        Problem {
            points,
            low,
            high,
            bulk,
            splines,
            rows,
            gram,
            roughness,
            moment,
            residual,
            line,
        }
    }

    /// From the penalty on [0, 1] to that on the data's range.
    fn unit(&self) -> f64 {
        (self.high - self.low).powi(3)
    }

    fn solve(&self, penalty: f64) -> Option<SplineSolution> {
        let factor = self.gram.plus(penalty / self.unit(), &self.roughness).factor()?;
        let coefficients = factor.solve(self.moment.clone());
        coefficients
            .iter()
            .all(|c| c.is_finite())
            .then_some(SplineSolution { factor, coefficients })
    }

    /// Both scores and the degrees of freedom for one penalty. `None` if the normal equations are singular to working precision.
    fn candidate(&self, penalty: f64) -> Option<ScoredParameter<f64>> {
        let (n, weight) = (self.points.len(), self.points.total_weight());
        let SplineSolution {
            factor,
            coefficients: c,
        } = self.solve(penalty)?;
        let inverse = factor.inverse_band();
        let (mut trace, mut left_out, mut residual) = (0.0, 0.0, 0.0);
        for ((row, w), y) in self.rows.iter().zip(&self.points.w).zip(&self.residual) {
            let LocalValues { first, values: v } = row;
            let (mut leverage, mut fitted) = (0.0, 0.0);
            for i in 0..4 {
                let band = &inverse.rows[first + i];
                let beyond: f64 = (1..4 - i).map(|k| band[k] * v[i + k]).sum();
                leverage += w * v[i] * (band[0] * v[i] + 2.0 * beyond);
                fitted += v[i] * c[first + i];
            }
            let rest = 1.0 - leverage;
            trace += leverage;
            residual += w * (y - fitted).powi(2);
            left_out += if rest > UNDETERMINED {
                w * ((y - fitted) / rest).powi(2)
            } else {
                f64::INFINITY
            };
        }
        // A straight line has two degrees of freedom.
        let sound = trace > 2.0 - ROUNDING && trace < n as f64 + ROUNDING;
        sound.then(|| ScoredParameter::new(penalty, trace, left_out, residual, weight, n))
    }

    /// A logarithmic grid of penalties, from interpolation to a straight line, refined around the best.
    fn curve(&self, score: impl Fn(&ScoredParameter<f64>) -> f64 + Copy) -> Vec<ScoredParameter<f64>> {
        let heaviest = LARGEST * self.points.total_weight() * self.unit();
        let candidate = |t: &f64| Some((*t, self.candidate(heaviest * t.exp())?));
        let candidates = |at: &[f64]| parallel::batch(at, candidate).into_iter().flatten();
        let shortest = self.bulk / (std::f64::consts::PI * self.splines.len() as f64);
        let start = (SMALLEST * shortest.powi(4) / LARGEST).ln();
        let mut step = -start / (GRID - 1) as f64;
        let grid: Vec<f64> = (0..GRID).map(|i| start + step * i as f64).collect();
        let mut tried: Vec<(f64, ScoredParameter<f64>)> = candidates(&grid).collect();
        for _ in 0..2 {
            if tried.is_empty() {
                break;
            }
            let curve: Vec<_> = tried.iter().map(|t| t.1).collect();
            let centre = tried[lowest(&curve, score)].0;
            step /= (FINER + 1) as f64;
            let finer = (1..=FINER).flat_map(|i| [centre - step * i as f64, centre + step * i as f64]);
            let finer: Vec<f64> = finer.filter(|t| (start..=0.0).contains(t)).collect();
            tried.extend(candidates(&finer));
            sort::by_key(&mut tried, |t| t.0);
        }
        tried.into_iter().map(|t| t.1).collect()
    }

    fn fit(self, penalty: f64, outside: Outside, search: Option<Search<f64>>) -> Option<SplineFit> {
        let coefficients = self.solve(penalty)?.coefficients;
        Some(SplineFit {
            penalty,
            degrees_of_freedom: self.candidate(penalty)?.degrees_of_freedom,
            splines: self.splines,
            coefficients,
            line: self.line,
            range: (self.low, self.high),
            outside,
            search,
        })
    }
}

/// The spline's coefficients, and the factor of its normal equations.
struct SplineSolution {
    factor: Factor,
    coefficients: Vec<f64>,
}

/// A straight line by its values at 0 and 1.
#[derive(Debug, Clone, Copy, PartialEq)]
struct StraightLine {
    ends: [f64; 2],
}

impl StraightLine {
    /// The weighted least-squares line through (u, y).
    fn new(u: &[f64], points: &Points) -> StraightLine {
        let total = points.total_weight();
        let centre = u.iter().zip(&points.w).map(|(u, w)| w * u).sum::<f64>() / total;
        let mean = points.mean();
        let (mut square, mut product) = (0.0, 0.0);
        for ((u, y), w) in u.iter().zip(&points.y).zip(&points.w) {
            square += w * (u - centre).powi(2);
            product += w * (u - centre) * (y - mean);
        }
        let slope = product / square;
        StraightLine {
            ends: [mean - slope * centre, mean + slope * (1.0 - centre)],
        }
    }

    fn slope(self) -> f64 {
        self.ends[1] - self.ends[0]
    }

    fn value(self, u: f64) -> f64 {
        self.ends[0] + u * self.slope()
    }
}

/// A fitted penalised spline.
#[derive(Debug, Clone, PartialEq)]
pub struct SplineFit {
    penalty: f64,
    degrees_of_freedom: f64,
    splines: CubicSplines,
    coefficients: Vec<f64>,
    line: StraightLine,
    range: (f64, f64),
    outside: Outside,
    search: Option<Search<f64>>,
}

impl SplineFit {
    /// The penalty lambda, given or chosen.
    pub fn penalty(&self) -> f64 {
        self.penalty
    }

    /// The trace of the hat matrix: from 2, a straight line, to the number of B-splines.
    pub fn degrees_of_freedom(&self) -> f64 {
        self.degrees_of_freedom
    }

    /// The scores of all penalties that were tried, where the penalty was chosen from the data.
    pub fn search(&self) -> Option<&Search<f64>> {
        self.search.as_ref()
    }
}

impl Regression for SplineFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        let x = check_queries(x, 1)?[0];
        let length = self.range.1 - self.range.0;
        let value = |x: f64| {
            let u = (x - self.range.0) / length;
            self.line.value(u) + self.splines.at(u).combined(&self.coefficients)
        };
        let [left, right] = self.splines.end_slopes(&self.coefficients);
        let slope = |x| (self.line.slope() + if x == self.range.0 { left } else { right }) / length;
        Ok(evaluate(x, self.range, self.outside, value, slope))
    }
}
