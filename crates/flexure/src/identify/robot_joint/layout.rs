//! The order of the unknowns: of equations with free curves, and of equations in which curves have physical forms.

use std::ops::Range;

use super::forms::Term;

/// The unknowns of equations with free curves. A curve's coefficients follow some of the factors: they are next to the factors that are
/// determined with them.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Layout {
    /// The number of each factor.
    pub factors: Vec<usize>,
    /// The numbers of each curve's coefficients.
    pub curves: Vec<Range<usize>>,
}

impl Layout {
    /// Adds factors, up to the number `until`.
    pub fn add_factors(&mut self, until: usize) {
        let next = self.len();
        let more = until - self.factors.len();
        self.factors.extend(next..next + more);
    }

    /// Adds a curve with this number of coefficients.
    pub fn add_curve(&mut self, coefficients: usize) {
        let next = self.len();
        self.curves.push(next..next + coefficients);
    }

    /// The number of unknowns.
    pub fn len(&self) -> usize {
        self.factors.len() + self.curves.iter().map(Range::len).sum::<usize>()
    }
}

/// The unknowns of equations in which curves have physical forms: those of the fixed columns, then the factors of all terms curve by
/// curve, then the logarithms of all shape parameters curve by curve.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FormLayout {
    /// The number of fixed columns.
    pub fixed: usize,
    pub curves: Vec<Numbers>,
}

/// The numbers of a curve's parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Numbers {
    /// The numbers of its terms' factors, counted from the first curve's first factor.
    pub factors: Range<usize>,
    /// The numbers of the logarithms of its shape parameters, counted in the same way.
    pub logs: Range<usize>,
}

/// A parameter of a form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FormParameter {
    /// The factor of a term, counted over all curves.
    Factor(usize),
    /// The logarithm of a shape parameter, counted over all curves.
    Log(usize),
}

impl FormLayout {
    /// The layout for curves with these terms.
    pub fn new<'a>(fixed: usize, curves: impl IntoIterator<Item = &'a [Term]>) -> Self {
        let mut layout = FormLayout {
            fixed,
            curves: Vec::new(),
        };
        for terms in curves {
            let (factors, logs) = (layout.factors(), layout.logs());
            layout.curves.push(Numbers {
                factors: factors..factors + terms.len(),
                logs: logs..logs + terms.iter().map(|t| t.shapes()).sum::<usize>(),
            });
        }
        layout
    }

    /// The number of factors of all curves.
    pub fn factors(&self) -> usize {
        self.curves.last().map_or(0, |c| c.factors.end)
    }

    /// The number of logarithms of all curves.
    pub fn logs(&self) -> usize {
        self.curves.last().map_or(0, |c| c.logs.end)
    }

    /// All parameters, in the order of the unknowns.
    pub fn parameters(&self) -> impl Iterator<Item = FormParameter> + use<> {
        let factors = (0..self.factors()).map(FormParameter::Factor);
        factors.chain((0..self.logs()).map(FormParameter::Log))
    }

    /// The number of a parameter among all unknowns.
    pub fn unknown(&self, parameter: FormParameter) -> usize {
        match parameter {
            FormParameter::Factor(i) => self.fixed + i,
            FormParameter::Log(i) => self.fixed + self.factors() + i,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknowns_stand_one_after_the_other() {
        let mut layout = Layout::default();
        layout.add_factors(1);
        layout.add_curve(4);
        layout.add_curve(2);
        layout.add_factors(3);
        assert_eq!((&layout.factors, &layout.curves), (&vec![0, 7, 8], &vec![1..5, 5..7]));
        assert_eq!(layout.len(), 9);
        let terms = [vec![Term::TanhDifference, Term::Linear], vec![Term::Windup]];
        let layout = FormLayout::new(2, terms.iter().map(Vec::as_slice));
        let numbers = |from: usize, to: usize| Numbers {
            factors: from..to,
            logs: from..to,
        };
        assert_eq!(layout.curves, [numbers(0, 2), numbers(2, 3)]);
        let unknowns: Vec<usize> = layout.parameters().map(|p| layout.unknown(p)).collect();
        assert_eq!(unknowns, [2, 3, 4, 5, 6, 7]);
    }
}
