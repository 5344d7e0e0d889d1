//! Linear systems with one denominator by the equation error (Steiglitz and McBride 1965).

use super::rational::Rational;
use super::signals::delayed;
use crate::linear::least_squares::least_squares;

/// The systems of this order with one denominator from several signals to one output.
pub(in crate::identify) struct EquationError<'a> {
    pub signals: &'a [Vec<f64>],
    pub y: &'a [f64],
    /// Whether a constant is added to the output.
    pub constant: bool,
    pub order: usize,
    /// Samples from here on count.
    pub from: usize,
}

/// The result of a pass of the iteration, and its score: smaller is better.
pub(in crate::identify) struct Judged<T> {
    pub score: f64,
    pub of: T,
}

/// The result of a pass, and 1 over its denominator.
struct Pass<T> {
    judged: Judged<T>,
    denominator: Rational,
}

impl EquationError<'_> {
    /// The best among the passes of the Steiglitz-McBride iteration: repeated least squares of the equation error, with the signals
    /// filtered by the last denominator. `judge` takes the numerators, one signal after the other, and 1 over the denominator; it ends the
    /// iteration by `None`.
    pub fn best<T>(&self, passes: usize, judge: impl Fn(&[f64], &Rational) -> Option<Judged<T>>) -> Option<Judged<T>> {
        let mut best: Option<Judged<T>> = None;
        let mut filter = Rational::pass();
        for _ in 0..passes {
            let Some(Pass { judged, denominator }) = self.pass(&filter, &judge) else {
                break;
            };
            if judged.score.is_finite() && best.as_ref().is_none_or(|b| judged.score < b.score) {
                best = Some(judged);
            }
            filter = denominator;
        }
        best
    }

    /// One pass with the signals filtered.
    fn pass<T>(&self, filter: &Rational, judge: &impl Fn(&[f64], &Rational) -> Option<Judged<T>>) -> Option<Pass<T>> {
        let y = filter.all_pole(self.y);
        let filtered = self.signals.iter().map(|signal| filter.all_pole(signal));
        let mut columns: Vec<Vec<f64>> = filtered
            .flat_map(|signal| (0..=self.order).map(move |k| delayed(&signal, k, 1.0)))
            .collect();
        columns.extend((1..=self.order).map(|k| delayed(&y, k, -1.0)));
        if self.constant {
            columns.push(filter.all_pole(&vec![1.0; y.len()]));
        }
        let coefficients = least_squares(&y, &columns, self.from)?.coefficients;
        let (numerators, others) = coefficients.split_at(self.signals.len() * (self.order + 1));
        let a: Vec<f64> = std::iter::once(1.0)
            .chain(others[..self.order].iter().copied())
            .collect();
        let denominator = Rational::from_polynomials(vec![1.0], &a)?;
        Some(Pass {
            judged: judge(numerators, &denominator)?,
            denominator,
        })
    }
}
