//! The breaks of a usual form as those of the curve.
//!
//! The searches add, move and drop one breakpoint at a time. Under a controlled input or in coloured noise they may end with one kink between
//! two, or with several around one, and then say something else than the form that the same data support. So a curve that is straight between
//! the places of such a form is tried too, unless the curve is already straight between as many. Schwarz's criterion of the whitened error decides.

use super::blocks::Observed;
use super::cells::Cells;
use super::form_fit::MemoryRemoved;
use super::forms::PhysicalForm;
use super::kinks::PlacedKinks;
use super::piecewise::Term;
use crate::interrupt;

/// The forms with places where they break.
const FORMS: [PhysicalForm; 3] = [
    PhysicalForm::DeadZone,
    PhysicalForm::Saturation,
    PhysicalForm::LimitedDeadZone,
];

impl PlacedKinks {
    /// These kinks, or those of a form that the data do not refute, if the criterion is smaller with them.
    pub fn or_of_a_form(self, cells: &Cells, observed: &Observed) -> PlacedKinks {
        let minimum = &self.minimum;
        let phi = minimum.blocks.nonlinearity();
        let points = MemoryRemoved {
            x: cells.s.clone(),
            value: minimum.values.clone(),
            samples: cells.count.clone(),
            deviation: minimum.variance.sqrt(),
        }
        .allowing_for(
            minimum.dependence,
            |s| phi.value(cells.unit.back(s)),
            minimum.terms.len(),
        );
        let all: Vec<usize> = (0..minimum.terms.len()).collect();
        let others = FORMS.iter().filter_map(|form| {
            let fit = points.fit_form(*form).ok().filter(|_| !interrupt::requested())?;
            let terms = straight_between(fit.holds().then(|| fit.places())?);
            (terms.len() != all.len() || has_curvature(&minimum.terms))
                .then(|| minimum.replaced(&all, &terms, cells, observed))?
        });
        let least = others.min_by(|a, b| a.minimum.criterion().total_cmp(&b.minimum.criterion()));
        match least.filter(|other| other.minimum.criterion() < minimum.criterion()) {
            Some(other) => other,
            None => self,
        }
    }
}

/// A line with a kink at each of these places.
fn straight_between(places: Vec<f64>) -> Vec<Term> {
    let kinks = places.into_iter().map(|at| Term::TruncatedPower { at, degree: 1 });
    [Term::Power(0), Term::Power(1)].into_iter().chain(kinks).collect()
}

/// Whether one of the terms is neither a line nor a kink.
fn has_curvature(terms: &[Term]) -> bool {
    let is_straight = |t: &Term| matches!(t, Term::Power(0 | 1) | Term::TruncatedPower { degree: 1, .. });
    !terms.iter().all(is_straight)
}
