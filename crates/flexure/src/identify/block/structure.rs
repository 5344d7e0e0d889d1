//! The structures next to a given one: a pole or a numerator coefficient more or less.

use super::loss::Cascade;
use super::rational::{Rational, Section, groups};
use crate::linear::Complex;

/// A numerator is at most this much longer than the denominator.
const LONGEST_NUMERATOR: usize = 8;
/// Most poles of one block.
const MOST_POLES: usize = 12;
/// A pole and a zero that are farther apart than this do not nearly cancel.
const NEARLY: f64 = 0.3;

/// The blocks that a cascade has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::identify) enum Form {
    /// Static, linear; the front is a gain.
    Hammerstein,
    /// Linear, static.
    Wiener,
    /// Linear, static, linear.
    WienerHammerstein,
}

/// Cascades of this form, without an instant between the samples, with one structural change, that start where `s` is (or nearly, where something was removed).
pub(super) fn neighbours(s: &Cascade, form: Form) -> Vec<Cascade> {
    let of = |block: &Rational, free: bool| if free { changes(block) } else { Vec::new() };
    let fronts = of(&s.front, form != Form::Hammerstein).into_iter();
    let backs = of(&s.back, form != Form::Wiener).into_iter();
    let front = fronts.map(|front| Cascade { front, ..s.clone() });
    front.chain(backs.map(|back| Cascade { back, ..s.clone() })).collect()
}

/// All changes of one linear block.
pub(in crate::identify) fn changes(g: &Rational) -> Vec<Rational> {
    [longer(g), shorter(g), with_pole(g), cancelled(g)]
        .into_iter()
        .flatten()
        .collect()
}

/// One numerator coefficient more, zero.
fn longer(g: &Rational) -> Option<Rational> {
    (g.b.len() <= g.order() + LONGEST_NUMERATOR).then(|| {
        let mut next = g.clone();
        next.b.push(0.0);
        next
    })
}

/// Without the numerator's last coefficient.
fn shorter(g: &Rational) -> Option<Rational> {
    (g.b.len() > 1).then(|| {
        let mut next = g.clone();
        next.b.pop();
        next
    })
}

/// One more pole and zero, both at the origin.
fn with_pole(g: &Rational) -> Option<Rational> {
    (g.order() < MOST_POLES).then(|| {
        let mut next = g.clone();
        next.b.push(0.0);
        match next.sections.iter_mut().find(|s| s.order == 1) {
            Some(single) => single.order = 2,
            None => next.sections.push(Section { a: [0.0; 2], order: 1 }),
        }
        next
    })
}

/// Without the pole (or pair) and the zero (or pair) that are nearest to one another.
fn cancelled(g: &Rational) -> Option<Rational> {
    let (poles, zeros) = (groups(&g.poles()), groups(&g.zeros()?));
    let mut nearest: Option<(f64, usize, usize)> = None;
    for (i, p) in poles.iter().enumerate() {
        for (j, z) in zeros.iter().enumerate().filter(|(_, z)| z.1 == p.1) {
            let distance = (p.0 - z.0).norm();
            if distance < NEARLY && nearest.is_none_or(|n| distance < n.0) {
                nearest = Some((distance, i, j));
            }
        }
    }
    let (_, i, j) = nearest?;
    let without = |all: &[(Complex<f64>, bool)], k: usize| -> Vec<Complex<f64>> {
        let rest = all.iter().enumerate().filter(|(l, _)| *l != k);
        rest.flat_map(|(_, &(z, pair))| std::iter::once(z).chain(pair.then(|| z.conj())))
            .collect()
    };
    let mut next = Rational::from_roots(&without(&zeros, j), &without(&poles, i));
    let gain = g.static_gain() / next.static_gain();
    if gain.is_finite() && gain != 0.0 {
        next.b.iter_mut().for_each(|b| *b *= gain);
    }
    Some(next)
}
