//! The structures next to a given one: a pole, a numerator coefficient or a sample of delay more or less.

use super::limits::{LONGEST_DELAY, LONGEST_NUMERATOR, MOST_POLES, NEARLY_CANCELLED, ROUNDS};
use super::rational::{Rational, Root, Section, groups, with_conjugates};
use super::system::{Branch, FreeParts, System};
use crate::linear::Complex;

/// Systems with one change of a linear block or of a delay. They start from `system`, or near it if something was removed.
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
    // A second instant has its own numerators, and a change of the delay would have to shift these too.
    let moves = free.delay && branch.between.is_none();
    let near = |g: &Rational| match moves {
        true => with_delays(g, branch.delay),
        false => changes(g).into_iter().map(|g| (g, branch.delay)).collect(),
    };
    let mut all = Vec::new();
    if free.front {
        all.extend(near(&branch.front).into_iter().map(|(front, delay)| Branch {
            front,
            delay,
            ..branch.clone()
        }));
    }
    if free.back {
        let near = match moves && !free.front {
            true => linear_parts(&branch.back, branch.delay),
            false => near(&branch.back),
        };
        all.extend(near.into_iter().map(|(back, delay)| Branch {
            back,
            delay,
            ..branch.clone()
        }));
    }
    all
}

/// All changes of a linear block after a delay, and of the delay.
fn with_delays(g: &Rational, delay: usize) -> Vec<(Rational, usize)> {
    let same = changes(g).into_iter().map(|g| (g, delay));
    same.chain(other_delays(g, delay)).collect()
}

/// The same if all linear dynamics are in this block: in addition, a pole may be absorbed by the numerator.
pub(in crate::identify) fn linear_parts(g: &Rational, delay: usize) -> Vec<(Rational, usize)> {
    let mut all = with_delays(g, delay);
    all.extend(without_fastest(g).map(|g| (g, delay)));
    all.extend(delay_for_pole(g, delay));
    all
}

/// A linear block with one sample more or less of delay before it.
fn other_delays(g: &Rational, delay: usize) -> impl Iterator<Item = (Rational, usize)> {
    let later = (g.b.len() > 1).then(|| (g.with_numerator(g.b[1..].to_vec()), delay + 1));
    let earlier = (delay > 0).then(|| (g.with_numerator([&[0.0], &g.b[..]].concat()), delay - 1));
    later.into_iter().chain(earlier)
}

/// Repeats the change with the smallest score while the score falls.
pub(in crate::identify) fn greedy<T>(
    mut best: T,
    score: impl Fn(&T) -> f64,
    mut changed: impl FnMut(&T) -> Vec<T>,
) -> T {
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
    [longer(g), shorter(g), with_pole(g), with_pole_for_tail(g), cancelled(g)]
        .into_iter()
        .flatten()
        .collect()
}

/// With one more numerator coefficient, zero.
fn longer(g: &Rational) -> Option<Rational> {
    let has_place = g.b.len() <= g.order() + LONGEST_NUMERATOR;
    has_place.then(|| g.with_numerator([&g.b[..], &[0.0]].concat()))
}

/// Without the numerator's last coefficient.
fn shorter(g: &Rational) -> Option<Rational> {
    let (_, others) = g.b.split_last().filter(|(_, others)| !others.is_empty())?;
    Some(g.with_numerator(others.to_vec()))
}

/// With one more pole and zero, both at the origin.
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

/// With a real pole in place of the numerator's last coefficients, which decay like its response: the reverse of [`without_fastest`].
fn with_pole_for_tail(g: &Rational) -> Option<Rational> {
    let [.., _, before, last] = g.b[..] else { return None };
    let pole = last / before;
    if g.order() >= MOST_POLES || !(pole.abs() < 1.0 && pole != 0.0) {
        return None;
    }
    let b = (0..g.b.len() - 1).map(|i| if i == 0 { g.b[0] } else { g.b[i] - pole * g.b[i - 1] });
    let poles = [g.poles(), vec![Complex::new(pole, 0.0)]].concat();
    Some(Rational::from_roots(&[], &poles).with_numerator(b.collect()))
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

/// All roots except the one of this index, with conjugates.
fn without(roots: &[Root], index: usize) -> Vec<Complex<f64>> {
    let rest = roots.iter().enumerate().filter(|(i, _)| *i != index);
    with_conjugates(rest.map(|(_, root)| root))
}

/// Removes the fastest real pole. The numerator takes over the first samples of its response.
///
/// Other poles are removed together with a zero. A pole near the origin stands for a numerator coefficient, so there is no zero to remove
/// with it.
fn without_fastest(g: &Rational) -> Option<Rational> {
    let all = groups(&g.poles());
    let (fastest, pole) = fastest_real(&all)?;
    let mut b = g.b.clone();
    for i in 1..b.len() {
        b[i] += pole * b[i - 1];
    }
    Some(Rational::from_roots(&[], &without(&all, fastest)).with_numerator(b))
}

/// With one pole less, whatever the others are: without the fastest pole, or with a real pole in place of the fastest pair.
pub(in crate::identify) fn with_a_pole_less(g: &Rational) -> Option<Rational> {
    let all = groups(&g.poles());
    let by_size = |a: &(usize, &Root), b: &(usize, &Root)| a.1.at.norm().total_cmp(&b.1.at.norm());
    let (fastest, root) = all.iter().enumerate().min_by(by_size)?;
    let mut poles = without(&all, fastest);
    if root.pair {
        poles.push(Complex::new(root.at.norm(), 0.0));
    }
    let kept = g.b.len().saturating_sub(1).max(1);
    with_gain(
        Rational::from_roots(&[], &poles).with_numerator(g.b[..kept].to_vec()),
        g,
    )
}

/// With a longer delay in place of the fastest real pole and of all but two numerator coefficients: a pole and zeros outside the unit circle
/// can stand for a delay.
///
/// Static gain and mean lag stay the same. The mean lag of the numerator is $\sum k b_k / \sum b_k$, that of a pole p is p / (1 - p).
fn delay_for_pole(g: &Rational, delay: usize) -> Option<(Rational, usize)> {
    let all = groups(&g.poles());
    let (fastest, pole) = fastest_real(&all)?;
    let sum: f64 = g.b.iter().sum();
    let first_moment: f64 = g.b.iter().enumerate().map(|(k, b)| k as f64 * b).sum();
    let lag = first_moment / sum + pole / (1.0 - pole);
    if !(pole > 0.0 && lag >= 1.0 && lag <= LONGEST_DELAY.saturating_sub(delay) as f64) {
        return None;
    }
    let share = lag.fract();
    let next = Rational::from_roots(&[], &without(&all, fastest)).with_numerator(vec![1.0 - share, share]);
    Some((with_gain(next, g)?, delay + lag as usize))
}

/// A linear block, multiplied to have the static gain of another one.
fn with_gain(mut g: Rational, of: &Rational) -> Option<Rational> {
    let gain = of.static_gain() / g.static_gain();
    (gain.is_finite() && gain != 0.0).then(|| {
        g.b.iter_mut().for_each(|b| *b *= gain);
        g
    })
}

/// The index and the place of the fastest real pole.
fn fastest_real(all: &[Root]) -> Option<(usize, f64)> {
    let real = all.iter().enumerate().filter(|(_, p)| !p.pair);
    let fastest = real.min_by(|a, b| a.1.at.norm().total_cmp(&b.1.at.norm()))?;
    Some((fastest.0, fastest.1.at.re))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_of_a_numerator_becomes_a_pole_again() {
        let g = Rational::from_roots(&[], &[Complex::new(0.7, 0.0), Complex::new(-0.3, 0.0)]);
        let g = g.with_numerator(vec![0.0, 0.5, 0.2]);
        let less = without_fastest(&g.with_numerator([&g.b[..], &[0.0; 4]].concat())).unwrap();
        let again = with_pole_for_tail(&less).unwrap();
        assert_eq!((less.order(), again.order(), again.b.len()), (1, 2, 6));
        let impulse: Vec<f64> = std::iter::once(1.0).chain([0.0; 39]).collect();
        for (a, b) in g.run(&impulse).iter().zip(again.run(&impulse)) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn a_pole_is_taken_from_any_system() {
        let pair = [Complex::new(0.3, 0.4), Complex::new(0.3, -0.4)];
        let g = Rational::from_roots(&[], &[pair[0], pair[1], Complex::new(0.9, 0.0)]).with_numerator(vec![0.5, 0.2]);
        let mut orders = Vec::new();
        let mut less = Some(g.clone());
        while let Some(now) = less {
            assert!((now.static_gain() / g.static_gain() - 1.0).abs() < 1e-9);
            orders.push(now.order());
            less = with_a_pole_less(&now);
        }
        assert_eq!(orders, [3, 2, 1, 0]);
    }

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
