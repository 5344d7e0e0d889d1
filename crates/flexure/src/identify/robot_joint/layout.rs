//! Where the unknowns of equations of motion stand: named ranges of their numbers.

use std::ops::Range;

use super::forms::Term;

/// The unknowns of equations with free curves.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    /// The numbers of the unknown factors: inertias, gravity.
    pub factors: Vec<usize>,
    /// The coefficients of each curve's splines.
    pub curves: Vec<Range<usize>>,
}

impl Layout {
    /// Of `factors` factors and curves of `(after, splines)`: the number of factors that stand before the curve, and its splines.
    pub fn new(factors: usize, curves: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let mut layout = Layout {
            factors: Vec::with_capacity(factors),
            curves: Vec::new(),
        };
        let mut next = 0;
        for (after, splines) in curves {
            layout.factors.extend(next..next + after - layout.factors.len());
            next = layout.factors.len() + layout.curves.iter().map(Range::len).sum::<usize>();
            layout.curves.push(next..next + splines);
            next += splines;
        }
        layout.factors.extend(next..next + factors - layout.factors.len());
        layout
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
    /// The factors of each curve's terms, counted from the first curve's first.
    pub factors: Vec<Range<usize>>,
    /// The logarithms of each curve's shape parameters, likewise.
    pub logs: Vec<Range<usize>>,
}

/// A parameter of a form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FormParameter {
    /// The factor of a term, counted over all curves.
    Factor(usize),
    /// The logarithm of a shape parameter, likewise.
    Log(usize),
}

impl FormLayout {
    /// Of curves with these terms.
    pub fn new<'a>(fixed: usize, curves: impl IntoIterator<Item = &'a [Term]>) -> Self {
        let mut layout = FormLayout {
            fixed,
            factors: Vec::new(),
            logs: Vec::new(),
        };
        for terms in curves {
            let (factors, logs) = (layout.all_factors().end, layout.all_logs().end);
            layout.factors.push(factors..factors + terms.len());
            layout
                .logs
                .push(logs..logs + terms.iter().map(|t| t.shapes()).sum::<usize>());
        }
        layout
    }

    /// The factors of all curves.
    pub fn all_factors(&self) -> Range<usize> {
        0..self.factors.last().map_or(0, |r| r.end)
    }

    /// The logarithms of all curves.
    pub fn all_logs(&self) -> Range<usize> {
        0..self.logs.last().map_or(0, |r| r.end)
    }

    /// All parameters, in the order of the unknowns.
    pub fn parameters(&self) -> impl Iterator<Item = FormParameter> + use<> {
        let factors = self.all_factors().map(FormParameter::Factor);
        factors.chain(self.all_logs().map(FormParameter::Log))
    }

    /// The number of a parameter among all unknowns.
    pub fn unknown(&self, parameter: FormParameter) -> usize {
        match parameter {
            FormParameter::Factor(i) => self.fixed + i,
            FormParameter::Log(i) => self.fixed + self.all_factors().end + i,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknowns_stand_one_after_the_other() {
        let layout = Layout::new(3, [(1, 4), (2, 5)]);
        assert_eq!((layout.factors, layout.curves), (vec![0, 5, 11], vec![1..5, 6..11]));
        let layout = Layout::new(2, [(2, 3), (2, 1)]);
        assert_eq!((&layout.factors, &layout.curves), (&vec![0, 1], &vec![2..5, 5..6]));
        assert_eq!(layout.len(), 6);
        let terms = [vec![Term::TanhDifference, Term::Linear], vec![Term::Windup]];
        let layout = FormLayout::new(2, terms.iter().map(Vec::as_slice));
        assert_eq!((&layout.factors, &layout.logs), (&vec![0..2, 2..3], &vec![0..2, 2..3]));
        let unknowns: Vec<usize> = layout.parameters().map(|p| layout.unknown(p)).collect();
        assert_eq!(unknowns, [2, 3, 4, 5, 6, 7]);
    }
}
