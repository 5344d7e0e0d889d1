//! Polynomial least squares, in the polynomials that are orthogonal on the data.
//!
//! Their three-term recurrence is found by the procedure of Stieltjes (Forsythe 1957), on the data's range mapped to [-1, 1]. So neither a
//! large offset of x nor a high degree costs digits.

use super::Outside;
use super::estimator::{Choice, Estimator, Points};
use super::functions::{Functions, RecurrenceStep};
use super::series::{Family, SeriesFit, most_tried};
use crate::error::{Error, Result};

/// The highest degree.
const HIGHEST: usize = 64;
/// The highest degree tried when the data choose.
const HIGHEST_TRIED: usize = 20;

/// A polynomial in one variable, by least squares.
///
/// | parameter | purpose | valid range | default |
/// |---|---|---|---|
/// | `degree` | the degree | 0 to 64, less than the number of distinct x | by leave-one-out, at most 20 |
/// | `outside` | the estimate beyond the data's range | | NaN |
///
/// [`SeriesFit::terms`] is the degree plus one, and so are the parameters in [`SeriesFit::search`].
///
/// ```
/// use flexure::nonlinearity::{Choice, Estimator, Outside, PolynomialRegression, Regression};
/// let x: Vec<f64> = (0..50).map(|i| 1e6 + i as f64).collect();
/// let y: Vec<f64> = x.iter().map(|x| (x - 1e6).powi(2)).collect();
/// let method = PolynomialRegression { degree: Choice::Fixed(2), outside: Outside::Nearest };
/// let fit = method.fit(&[&x], &y, None)?;
/// assert!((fit.predict(&[&[1e6 + 2.5]])?[0] - 6.25).abs() < 1e-10);
/// # Ok::<(), flexure::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PolynomialRegression {
    /// The degree.
    pub degree: Choice<usize>,
    /// The estimate beyond the data's range.
    pub outside: Outside,
}

impl Estimator for PolynomialRegression {
    type Fit = SeriesFit;

    fn fit(self, x: &[&[f64]], y: &[f64], weights: Option<&[f64]>) -> Result<SeriesFit> {
        if let Choice::Fixed(degree) = self.degree
            && degree > HIGHEST
        {
            return Err(Error::parameter("the degree", degree as f64, "at most 64"));
        }
        let points = Points::new("a polynomial regression", 1, x, y, weights)?;
        let tried = most_tried(&points).min(HIGHEST_TRIED + 1);
        let terms = match self.degree {
            Choice::Fixed(degree) => Choice::Fixed(degree + 1),
            Choice::FromData(criterion) => Choice::FromData(criterion),
        };
        let most = match terms {
            Choice::Fixed(terms) => terms,
            Choice::FromData(_) => tried,
        };
        let family = Family {
            functions: orthogonal(&points, most.min(points.distinct().len())),
            constant: true,
            step: 1,
            parameter: "the degree",
            less: 1,
        };
        family.fit(&points, terms, tried, self.outside)
    }
}

/// The first `count` polynomials that are orthonormal on the points.
fn orthogonal(points: &Points, count: usize) -> Functions {
    let (low, high) = points.range(0);
    let centre = low + 0.5 * (high - low);
    let half = if high > low { 0.5 * (high - low) } else { 1.0 };
    let t: Vec<f64> = points.x[0].iter().map(|x| (x - centre) / half).collect();
    let first = 1.0 / points.total_weight().sqrt();
    let (mut before, mut now, mut b) = (vec![0.0; t.len()], vec![first; t.len()], 0.0);
    let mut steps = Vec::with_capacity(count);
    for _ in 1..count {
        let terms = t.iter().zip(&points.w).zip(&now);
        let a: f64 = terms.map(|((t, w), p)| w * t * p * p).sum();
        for ((before, now), t) in before.iter_mut().zip(&mut now).zip(&t) {
            (*before, *now) = (*now, (t - a) * *now - b * *before);
        }
        b = now.iter().zip(&points.w).map(|(p, w)| w * p * p).sum::<f64>().sqrt();
        now.iter_mut().for_each(|p| *p /= b);
        steps.push(RecurrenceStep { a, next_b: b });
    }
    Functions::Discrete {
        centre,
        half,
        first,
        steps,
    }
}
