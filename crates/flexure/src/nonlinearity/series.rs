//! Orthogonal series: least squares on the first functions of a sequence.
//!
//! $$ m_n(x) = \sum_{k < K} c_k \varphi_k(x), \qquad c = \arg\min \sum_i w_i \Bigl(Y_i - \sum_k c_k \varphi_k(X_i)\Bigr)^2 . $$
//!
//! Least squares on the abscissas of the data, not integrals with an estimated density: if m is such a sum, the fit is exact for any
//! distribution of X. References: Greblicki and Pawlak (1985; 2008, ch. 6).

use serde::{Deserialize, Serialize};

use super::Outside;
use super::estimator::{Choice, Estimator, Points, Regression, check_queries, evaluate};
use super::functions::Functions;
use super::least_squares::Nested;
use crate::error::{Error, ParameterError, Result};
use crate::selection::{OpenEnds, Search};
use crate::vectors::dot;

/// The most terms of a series. For more terms another estimator is better: the cost is O(n K^2), and the functions' rounding grows.
const MOST_TERMS: usize = 256;
/// The most terms tried when the data choose.
const ALWAYS_TRIED: usize = 64;
/// If the search takes at most this many products, all terms are tried.
const MOST_WORK: f64 = 1e9;

/// The functions of an orthogonal series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// 1, cos, sin, cos 2, sin 2, ... with the data's range as the period: for m with equal values and slopes at the ends. The number of
    /// terms is chosen among the odd numbers, so that every frequency has both functions.
    Fourier,
    /// 1, cos, cos 2, ... with the data's range as half the period: m need not be periodic.
    Cosine,
    /// Legendre polynomials on the data's range.
    Legendre,
    /// Hermite functions, centred at the data's median and scaled by their quartiles: for unbounded X. They
    /// vanish far out, and the constant is not among them.
    Hermite,
}

impl Basis {
    /// All bases.
    pub const ALL: [Basis; 4] = [Basis::Fourier, Basis::Cosine, Basis::Legendre, Basis::Hermite];

    /// The name in lower case, as it is written in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Basis::Fourier => "fourier",
            Basis::Cosine => "cosine",
            Basis::Legendre => "legendre",
            Basis::Hermite => "hermite",
        }
    }

    /// The name of a series of these functions.
    pub fn title(self) -> &'static str {
        match self {
            Basis::Fourier => "Fourier series",
            Basis::Cosine => "cosine series",
            Basis::Legendre => "Legendre series",
            Basis::Hermite => "Hermite series",
        }
    }

    fn functions(self, points: &Points) -> Functions {
        let (low, high) = points.range(0);
        let length = positive(high - low);
        match self {
            Basis::Fourier => Functions::Fourier { low, length },
            Basis::Cosine => Functions::Cosine { low, length },
            Basis::Legendre => Functions::Legendre {
                centre: 0.5 * (low + high),
                half: 0.5 * length,
            },
            Basis::Hermite => {
                let Location { centre, scale } = location(&points.x[0], &points.w);
                Functions::Hermite { centre, scale }
            }
        }
    }
}

fn positive(length: f64) -> f64 {
    if length > 0.0 { length } else { 1.0 }
}

/// The median, and the standard deviation of the normal distribution with the quartiles of the data.
pub(super) struct Location {
    pub centre: f64,
    pub scale: f64,
}

/// Centre and scale of the increasing data `x` with the weights `w`.
pub(super) fn location(x: &[f64], w: &[f64]) -> Location {
    let total: f64 = w.iter().sum();
    // The mean of the lower and the upper quantile, so that mirrored data give the mirrored result.
    let quantile = |p: f64| {
        let (mut sum, mut lower, mut upper) = (0.0, None, x[x.len() - 1]);
        for (x, w) in x.iter().zip(w) {
            sum += w;
            if lower.is_none() && sum >= p * total {
                lower = Some(*x);
            }
            if sum > p * total {
                upper = *x;
                break;
            }
        }
        0.5 * (lower.unwrap_or(upper) + upper)
    };
    let quartiles = quantile(0.75) - quantile(0.25);
    let scale = if quartiles > 0.0 {
        quartiles / 1.348_979_500_392_163_6
    } else {
        0.25 * (x[x.len() - 1] - x[0])
    };
    Location {
        centre: quantile(0.5),
        scale: positive(scale),
    }
}

/// An orthogonal series in one variable.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `basis` | the functions | | Legendre |
/// | `terms` | their number | 1 to 256, and the number of distinct x | by leave-one-out, up to the larger of n/3 and 8 n^(1/3), and 256 (15,000 points or fewer) to 64 (250,000 or more) |
/// | `outside` | the estimate beyond the data's range | | NaN |
///
/// ```
/// use flexure::nonlinearity::{Basis, Estimator, Regression, SeriesRegression};
/// let x: Vec<f64> = (0..400).map(|i| i as f64 / 100.0 - 2.0).collect();
/// let y: Vec<f64> = x.iter().map(|x| x.tanh()).collect();
/// let fit = SeriesRegression { basis: Basis::Legendre, ..Default::default() }.fit(&[&x], &y, None)?;
/// assert!((fit.predict(&[&[0.5]])?[0] - 0.5_f64.tanh()).abs() < 1e-6);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesRegression {
    /// The functions.
    pub basis: Basis,
    /// Their number.
    pub terms: Choice<usize>,
    /// The estimate beyond the data's range.
    pub outside: Outside,
}

impl Default for SeriesRegression {
    fn default() -> Self {
        SeriesRegression {
            basis: Basis::Legendre,
            terms: Choice::default(),
            outside: Outside::default(),
        }
    }
}

impl Estimator for SeriesRegression {
    type Fit = SeriesFit;

    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<SeriesFit> {
        if let Choice::Fixed(terms) = self.terms
            && !(1..=MOST_TERMS).contains(&terms)
        {
            return Err(Error::parameter(
                "the number of terms",
                terms as f64,
                "between 1 and 256",
            ));
        }
        let points = Points::new("a series regression", 1, x, y, weights)?;
        let family = Family {
            functions: self.basis.functions(&points),
            constant: self.basis != Basis::Hermite,
            step: if self.basis == Basis::Fourier { 2 } else { 1 },
            parameter: "the number of terms",
            less: 0,
        };
        family.fit(&points, self.terms, most_tried(&points), self.outside)
    }
}

/// The most terms worth trying for n points: n/3, or 8 n^(1/3) if that is more, as far as the cost of the search, n K^2, allows.
pub(super) fn most_tried(points: &Points) -> usize {
    let n = points.len() as f64;
    let affordable = ((MOST_WORK / n).sqrt() as usize).clamp(ALWAYS_TRIED, MOST_TERMS);
    affordable.min((n / 3.0).max(8.0 * n.cbrt()) as usize)
}

/// A sequence of functions and the name of its length.
pub(super) struct Family {
    pub functions: Functions,
    /// Whether the first function is the constant.
    pub constant: bool,
    /// Candidates are 1, 1 + step, 1 + 2 step, ... terms.
    pub step: usize,
    /// The public name of the number of terms.
    pub parameter: &'static str,
    /// The public value is the number of terms minus this.
    pub less: usize,
}

impl Family {
    /// Fits the given number of terms, or the best number up to `tried`.
    pub fn fit(self, points: &Points, terms: Choice<usize>, tried: usize, outside: Outside) -> Result<SeriesFit> {
        let distinct = points.distinct().len();
        let (wanted, most) = match terms {
            Choice::Fixed(terms) => (terms, terms),
            Choice::FromData(_) => (1, tried.min(distinct)),
        };
        let enough = |most: usize, reason| {
            if wanted <= most {
                return Ok(());
            }
            Err(Error::Parameter(ParameterError::BeyondData {
                parameter: self.parameter,
                value: wanted - self.less,
                most: most.saturating_sub(self.less),
                reason,
            }))
        };
        enough(distinct, "there are no more distinct values of x")?;
        let offset = if self.constant { points.mean() } else { 0.0 };
        let nested = Nested::fit(self.functions, most, points, offset);
        enough(
            nested.terms(),
            "at these x the next function is a combination of those before it",
        )?;
        let (terms, search) = match terms {
            Choice::Fixed(terms) => (terms, None),
            Choice::FromData(criterion) => {
                let curve = nested.scores(points).into_iter().step_by(self.step).collect();
                let open = OpenEnds::above(nested.terms() == tried);
                let search = Search::best(criterion, curve, open, points.size());
                (search.parameter, Some(search))
            }
        };
        Ok(SeriesFit {
            coefficients: nested.coefficients(terms),
            functions: nested.into_functions(),
            offset,
            range: points.range(0),
            outside,
            search,
        })
    }
}

/// A fitted series or polynomial.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesFit {
    functions: Functions,
    coefficients: Vec<f64>,
    offset: f64,
    range: (f64, f64),
    outside: Outside,
    search: Option<Search<usize>>,
}

impl SeriesFit {
    /// The number of terms; for a polynomial, one more than the degree.
    pub fn terms(&self) -> usize {
        self.coefficients.len()
    }

    /// The scores of all numbers of terms that were tried, where the number was chosen from the data.
    pub fn search(&self) -> Option<&Search<usize>> {
        self.search.as_ref()
    }

    fn sum(&self, functions: impl Fn(&Functions, &mut [f64])) -> f64 {
        let mut v = vec![0.0; self.coefficients.len()];
        functions(&self.functions, &mut v);
        dot(&v, &self.coefficients)
    }
}

impl Regression for SeriesFit {
    fn dimension(&self) -> usize {
        1
    }

    fn predict(&self, x: &[&[f64]]) -> Result<Vec<f64>> {
        let x = check_queries(x, 1)?[0];
        let value = |x| self.offset + self.sum(|f, v| f.values(x, v));
        let slope = |x| self.sum(|f, v| f.slopes(x, v));
        Ok(evaluate(x, self.range, self.outside, value, slope))
    }
}
