//! The structures next to a given one: a pole, a numerator coefficient or a sample of delay more or less.

use super::limits::{LONGEST_NUMERATOR, MOST_POLES, NEARLY_CANCELLED, ROUNDS};
use super::rational::{Rational, Root, Section, groups, with_conjugates};
use super::system::{Branch, FreeParts, System};
use crate::linear::Complex;

/// Systems with one change of a linear block or of a delay, that start where `system` is (or nearly, where something was removed).
pub(super) fn neighbours(system: &System, free: FreeParts) -> Vec<System> {
    let each = system.branches.iter().enumerate();
    each.flat_map(|(i, branch)| {
        branches(branch, free).into_iter().map(move |branch| {
            let mut next = system.clone();
            next.branches[i] = branch;
            next
        })
    })
    .collect()
}

/// Branches with one change.
fn branches(branch: &Branch, free: FreeParts) -> Vec<Branch> {
    let with = |back: Rational, delay: usize| Branch {
        back,
        delay,
        ..branch.clone()
    };
    let mut all = Vec::new();
    if free.front {
        let front = |front| Branch {
            front,
            ..branch.clone()
        };
        all.extend(changes(&branch.front).into_iter().map(front));
    }
    if free.back {
        all.extend(changes(&branch.back).into_iter().map(|back| with(back, branch.delay)));
    }
    if free.delay {
        all.extend(without_fastest(&branch.back).map(|back| with(back, branch.delay)));
        let b = &branch.back.b;
        let numerator = |b: Vec<f64>| branch.back.with_numerator(b);
        if b.len() > 1 {
            all.push(with(numerator(b[1..].to_vec()), branch.delay + 1));
        }
        if branch.delay > 0 {
            all.push(with(numerator([&[0.0], &b[..]].concat()), branch.delay - 1));
        }
    }
    all
}

/// The change of the smallest score, over and over, while the score falls.
pub(super) fn greedy<T>(mut best: T, score: impl Fn(&T) -> f64, mut changed: impl FnMut(&T) -> Vec<T>) -> T {
    for _ in 0..ROUNDS {
        let next = changed(&best).into_iter().min_by(|a, b| score(a).total_cmp(&score(b)));
        match next.filter(|n| score(n) < score(&best)) {
            Some(n) => best = n,
            None => break,
        }
    }
    best
}

/// All changes of one linear block.
pub(super) fn changes(g: &Rational) -> Vec<Rational> {
    [longer(g), shorter(g), with_pole(g), cancelled(g)]
        .into_iter()
        .flatten()
        .collect()
}

/// One numerator coefficient more, zero.
fn longer(g: &Rational) -> Option<Rational> {
    let has_place = g.b.len() <= g.order() + LONGEST_NUMERATOR;
    has_place.then(|| g.with_numerator([&g.b[..], &[0.0]].concat()))
}

/// Without the numerator's last coefficient.
fn shorter(g: &Rational) -> Option<Rational> {
    let (_, others) = g.b.split_last().filter(|(_, others)| !others.is_empty())?;
    Some(g.with_numerator(others.to_vec()))
}

/// One more pole and zero, both at the origin.
fn with_pole(g: &Rational) -> Option<Rational> {
    if g.order() >= MOST_POLES {
        return None;
    }
    let mut next = g.with_numerator([&g.b[..], &[0.0]].concat());
    match next.sections.iter_mut().find(|s| s.order == 1) {
        Some(single) => single.order = 2,
        None => next.sections.push(Section { a: [0.0; 2], order: 1 }),
    }
    Some(next)
}

/// Without the pole (or pair) and the zero (or pair) that are nearest to one another.
fn cancelled(g: &Rational) -> Option<Rational> {
    let (poles, zeros) = (groups(&g.poles()), groups(&g.zeros()?));
    let mut nearest: Option<(f64, usize, usize)> = None;
    for (i, p) in poles.iter().enumerate() {
        for (j, z) in zeros.iter().enumerate().filter(|(_, z)| z.pair == p.pair) {
            let distance = (p.at - z.at).norm();
            if distance < NEARLY_CANCELLED && nearest.is_none_or(|n| distance < n.0) {
                nearest = Some((distance, i, j));
            }
        }
    }
    let (_, i, j) = nearest?;
    let mut next = Rational::from_roots(&without(&zeros, j), &without(&poles, i));
    let gain = g.static_gain() / next.static_gain();
    if gain.is_finite() && gain != 0.0 {
        next.b.iter_mut().for_each(|b| *b *= gain);
    }
    Some(next)
}

/// All roots but that of this index, with conjugates.
fn without(roots: &[Root], index: usize) -> Vec<Complex<f64>> {
    let rest = roots.iter().enumerate().filter(|(i, _)| *i != index);
    with_conjugates(rest.map(|(_, root)| root))
}

/// Removes the fastest real pole. The numerator takes over the first samples of its response.
///
/// Other poles are removed together with a zero. A pole near the origin stands for a numerator coefficient, and the system has no
/// zero to spare for it.
fn without_fastest(g: &Rational) -> Option<Rational> {
    let all = groups(&g.poles());
    let real = all.iter().enumerate().filter(|(_, p)| !p.pair);
    let (fastest, pole) = real.min_by(|a, b| a.1.at.norm().total_cmp(&b.1.at.norm()))?;
    let mut b = g.b.clone();
    for i in 1..b.len() {
        b[i] += pole.at.re * b[i - 1];
    }
    Some(Rational::from_roots(&[], &without(&all, fastest)).with_numerator(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_pole_goes_on_in_the_numerator() {
        let pair = [Complex::new(0.9, 0.3), Complex::new(0.9, -0.3)];
        let poles = [pair[0], pair[1], Complex::new(0.1, 0.0), Complex::new(-0.6, 0.0)];
        let g = Rational::from_roots(&[], &poles).with_numerator(vec![0.5, 0.8, 0.0, 0.0]);
        let less = without_fastest(&g).unwrap();
        assert_eq!((less.order(), less.b.len()), (3, 4));
        let impulse: Vec<f64> = std::iter::once(1.0).chain([0.0; 39]).collect();
        for (a, b) in g.run(&impulse).iter().zip(less.run(&impulse)) {
            assert!((a - b).abs() < 1e-2, "{a} {b}");
        }
        assert!(without_fastest(&Rational::from_roots(&[], &pair)).is_none());
    }
}
