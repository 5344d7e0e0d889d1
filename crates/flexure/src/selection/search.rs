//! A parameter by leave-one-out or generalised cross-validation: the score of every candidate.

/// The score that a choice from the data minimises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Criterion {
    /// Leave-one-out cross-validation, exact: $\sum_i w_i (Y_i - m_{n,-i}(X_i))^2 / \sum_i w_i$ with the
    /// estimate $m_{n,-i}$ without point i.
    #[default]
    LeaveOneOut,
    /// Generalised cross-validation (Craven and Wahba 1979):
    /// $\sum_i w_i (Y_i - m_n(X_i))^2 / \sum_i w_i$ over $(1 - \mathrm{df}/n)^2$.
    Generalized,
}

/// A value that was tried for a parameter, and both its scores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredParameter<P> {
    /// The parameter's value.
    pub parameter: P,
    /// The trace of the hat matrix, which maps the ordinates to the fitted values.
    pub degrees_of_freedom: f64,
    /// The leave-one-out score, in the squared unit of y; infinite if the estimate without some point is not determined.
    pub leave_one_out: f64,
    /// The generalised cross-validation score, in the squared unit of y; infinite if there are as many degrees of freedom as points.
    pub generalized: f64,
}

impl<P> ScoredParameter<P> {
    /// The score by this criterion.
    pub fn score(&self, criterion: Criterion) -> f64 {
        match criterion {
            Criterion::LeaveOneOut => self.leave_one_out,
            Criterion::Generalized => self.generalized,
        }
    }

    /// A candidate from the weighted sums over all `n` points.
    pub(crate) fn new(parameter: P, trace: f64, left_out: f64, residual: f64, weight: f64, n: usize) -> Self {
        let rest = 1.0 - trace / n as f64;
        let finite = |score: f64| if score.is_finite() { score } else { f64::INFINITY };
        ScoredParameter {
            parameter,
            degrees_of_freedom: trace,
            leave_one_out: finite(left_out / weight),
            generalized: if rest > UNDETERMINED {
                finite(residual / weight / (rest * rest))
            } else {
                f64::INFINITY
            },
        }
    }
}

/// If 1 - h is below this, h being the leverage, the fit without that point is not determined.
pub(crate) const UNDETERMINED: f64 = 1e-10;

/// Two scores count as equal up to this relative difference. Convention; rounding errors are smaller.
pub(crate) const FLAT: f64 = 1e-9;

/// Root mean square errors below this share of the ordinates' size are rounding.
const ROUNDING: f64 = 1e-14;

/// The whole search. Its result is part of every fit that used it.
#[derive(Debug, Clone, PartialEq)]
pub struct Search<P> {
    /// The value with the smallest score. If scores are equal, it is the one with the fewest degrees of freedom.
    pub parameter: P,
    /// The score that was minimised.
    pub criterion: Criterion,
    /// All candidates in order of the parameter.
    pub curve: Vec<ScoredParameter<P>>,
    /// Whether the best candidate is the first or the last one tried and more could have been tried beyond it. The minimum may then lie
    /// there.
    pub at_edge: bool,
}

/// Whether values below the first of a curve, and above its last, would have been possible.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OpenEnds {
    pub below: bool,
    pub above: bool,
}

impl OpenEnds {
    /// For a curve whose first value is the smallest possible one.
    pub fn above(above: bool) -> Self {
        OpenEnds { below: false, above }
    }
}

/// The most values that are tried by refits.
const REFITTED: usize = 64;

impl<P: Copy> Search<P> {
    /// The values to try if every one needs refits: only the first ones, as refits of hundreds of terms take too long.
    pub(crate) fn for_refits(&self) -> Vec<P> {
        self.curve.iter().take(REFITTED).map(|c| c.parameter).collect()
    }

    /// The best of a curve that is not empty; `size` is the ordinates' root mean square.
    pub(crate) fn best(criterion: Criterion, curve: Vec<ScoredParameter<P>>, open: OpenEnds, size: f64) -> Self {
        let floor = (ROUNDING * size).powi(2);
        let score = |c: &ScoredParameter<P>| c.score(criterion).max(floor);
        let best = lowest(&curve, score);
        let last = curve.len() - 1;
        let steeper = |i: usize| score(&curve[i]) - score(&curve[best]) > FLAT * score(&curve[i]);
        let at_edge =
            last > 0 && (open.below && best == 0 && steeper(1) || open.above && best == last && steeper(last - 1));
        Search {
            parameter: curve[best].parameter,
            criterion,
            curve,
            at_edge,
        }
    }
}

/// The index of the lowest score. If scores are equal, it is the one with the fewest degrees of freedom.
pub(crate) fn lowest<P>(curve: &[ScoredParameter<P>], score: impl Fn(&ScoredParameter<P>) -> f64) -> usize {
    (0..curve.len())
        .min_by(|&i, &j| {
            let (a, b) = (&curve[i], &curve[j]);
            let by_freedom = a.degrees_of_freedom.total_cmp(&b.degrees_of_freedom);
            score(a).total_cmp(&score(b)).then(by_freedom)
        })
        .unwrap_or(0)
}
