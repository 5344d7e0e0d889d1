//! A nonlinearity of a system on other breakpoints, its coefficients by least squares about the present system.

use super::candidate::Candidate;
use super::limits::{CONSTANT_RANGE, EVEN, FINEST_PIECES, LARGEST_RISE, MOST_PIECES, OUTERMOST, SAMPLES_IN_PIECE};
use super::loss::through_back;
use super::signals::{Signals, add, convolved};
use super::spline::{KinkedSpline, Roughness, Tangent, thinned};
use super::system::{Level, Part, System};
use crate::linear::correlation::{mean, variance};
use crate::linear::least_squares::least_squares;
use crate::nonlinearity::spline::basis::LocalCubics;
use crate::parallel;

/// The system with this many pieces in one nonlinearity, dense where it is rough, with fewer pieces for few samples. A front's output has
/// unit variance.
///
/// The roughness is taken from the present curve, which is good for smooth curves, and from a curve on many even breakpoints, which shows
/// kinks; the better result is taken.
pub(in crate::identify) fn with_pieces(
    system: &System,
    part: Part,
    pieces: usize,
    data: &Signals,
) -> Option<Candidate> {
    let spline = system.spline(part)?;
    let mut sorted = system.entering(part, data);
    let scaled_front = match part {
        Part::Branch(i) if !system.branches[i].front_is_gain() => Some(i),
        _ => None,
    };
    let spread = if scaled_front.is_some() {
        variance(&sorted).sqrt()
    } else {
        1.0
    };
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    if !(high - low > CONSTANT_RANGE * low.abs().max(high.abs()) && (high - low).is_finite() && spread > 0.0) {
        return None;
    }
    let fewest = fewest_in_piece(data);
    let on = |mut at: Vec<f64>| {
        let last = at.len() - 1;
        (at[0], at[last]) = (low, high);
        let at = thinned(&at, &sorted, fewest, OUTERMOST * fewest);
        let mut scaled = system.clone();
        if let Some(branch) = scaled_front {
            scaled.divide_front(branch, spread);
        }
        let at: Vec<f64> = at.iter().map(|x| x / spread).collect();
        refitted(&scaled, part, &at, data)
    };
    let smooth = on(spline.denser(pieces, Roughness::Fourth, EVEN));
    let even = (0..=MOST_PIECES).map(|i| low + (high - low) * i as f64 / MOST_PIECES as f64);
    let rough = on(even.collect()).and_then(|fine| {
        let at = fine.system.spline(part)?.denser(pieces, Roughness::Second, EVEN);
        on(at.iter().map(|x| x * spread).collect())
    });
    let both = [smooth, rough].into_iter().flatten();
    both.min_by(|a, b| a.squares.total_cmp(&b.squares))
}

/// The fewest samples in a piece of a nonlinearity.
pub(in crate::identify) fn fewest_in_piece(data: &Signals) -> usize {
    let [fewest, most] = SAMPLES_IN_PIECE;
    (data.counted() / FINEST_PIECES).clamp(fewest, most)
}

/// One nonlinearity on other breakpoints; everything else is unchanged, kinks included.
///
/// Without a last nonlinearity, and for the last one itself, this is linear least squares; otherwise one Gauss-Newton step.
pub(in crate::identify) fn refitted(
    system: &System,
    part: Part,
    breakpoints: &[f64],
    data: &Signals,
) -> Option<Candidate> {
    let mut system = system.clone();
    let spline = system.spline_mut(part)?;
    let kinks = std::mem::take(&mut spline.kinks);
    let mut spline = KinkedSpline::new(breakpoints);
    spline.kinks = kinks;
    let Equation { target, columns } = match part {
        Part::Output => {
            let x = system.inner(&data.u);
            let local: Vec<LocalCubics> = x.iter().map(|x| spline.local(*x)).collect();
            let columns = spline.linear_parameters().map(|j| spline.by_parameter(j, &x, &local));
            Equation {
                target: data.y.clone(),
                columns: columns.collect(),
            }
        }
        Part::Branch(i) => branch_equation(&mut system, i, &spline, data),
    };
    let columns = parallel::batch(&columns, |c| convolved(&data.filter, c));
    let target = convolved(&data.filter, &target);
    spline.set_linear(least_squares(&target, &columns, data.from)?.coefficients);
    *system.spline_mut(part)? = spline;
    let candidate = Candidate::new(system, data);
    candidate.squares.is_finite().then_some(candidate)
}

/// A linear equation for the coefficients of a spline: the columns should sum to the signal.
struct Equation {
    target: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

/// The part of the output that is missing without the branch's nonlinearity, and the contribution of each coefficient of `spline` in its
/// place. If the nonlinearities have the level, the branch's offset becomes the mean of the remainder of the others.
fn branch_equation(system: &mut System, i: usize, spline: &KinkedSpline, data: &Signals) -> Equation {
    let mut others = vec![0.0; data.y.len()];
    let rest = system.branches.iter().enumerate().filter(|(j, _)| *j != i);
    rest.for_each(|(_, b)| add(&mut others, &b.run(&data.u)));
    if system.level == Level::Nonlinearity {
        let remainder: Vec<f64> = data.y.iter().zip(&others).map(|(y, o)| y - o).collect();
        system.branches[i].offset = mean(&remainder[data.from..]);
    }
    let branch = &system.branches[i];
    let without: Vec<f64> = others.iter().map(|o| branch.offset + o).collect();
    // The last nonlinearity's tangents: its value without the branch, and its slope.
    let (values, slopes): (Vec<f64>, Option<Vec<f64>>) = match &system.output {
        None => (without, None),
        Some(g) => {
            let own = branch.run(&data.u).into_iter().map(|y| y - branch.offset);
            let tangent = |(x, own): (&f64, f64)| {
                let Tangent { value, slope } = g.tangent(x + own, &g.local(x + own));
                (value - slope * own, slope)
            };
            let (values, slopes) = without.iter().zip(own).map(tangent).unzip();
            (values, Some(slopes))
        }
    };
    let target = data.y.iter().zip(&values).map(|(y, p)| y - p).collect();
    let instants: Vec<_> = (branch.instants().map(|instant| instant.back))
        .zip(branch.intermediate(&data.u))
        .map(|(back, w)| {
            let local: Vec<LocalCubics> = w.iter().map(|w| spline.local(*w)).collect();
            (back, w, local)
        })
        .collect();
    let column = |j: usize| {
        let each = instants
            .iter()
            .map(|(back, w, local)| (*back, spline.by_parameter(j, w, local)));
        let mut column = through_back(&branch.back, each);
        let slopes = slopes.iter().flatten();
        column.iter_mut().zip(slopes).for_each(|(c, d)| *c *= d);
        column
    };
    let linear: Vec<usize> = spline.linear_parameters().collect();
    Equation {
        target,
        columns: parallel::batch(&linear, |&j| column(j)),
    }
}

/// The system with a last nonlinearity of a few pieces.
pub(super) fn with_output(system: &System, pieces: usize, data: &Signals) -> Option<Candidate> {
    let x = system.inner(&data.u);
    let spline = KinkedSpline::coarse(&x[data.from..], pieces)?;
    let breakpoints = spline.breakpoints().to_vec();
    let system = System {
        output: Some(spline),
        ..system.clone()
    };
    refitted(&system, Part::Output, &breakpoints, data)
}

/// The same blocks, with every branch's outermost breakpoints moved back into the range of the samples if the descent has moved them out:
/// without samples, the coefficients of a piece are not determined.
pub(super) fn anchored(mut c: Candidate, data: &Signals) -> Candidate {
    for branch in 0..c.system.branches.len() {
        // A slightly larger error is accepted: the outer pieces also affected samples inside.
        let moved = with_ends_inside(&c.system, branch, data).filter(|m| m.squares <= LARGEST_RISE * c.squares);
        c = moved.unwrap_or(c);
    }
    c
}

/// `None` if no breakpoint is outside.
fn with_ends_inside(system: &System, branch: usize, data: &Signals) -> Option<Candidate> {
    let of = &system.branches[branch];
    let mut sorted: Vec<f64> = of.intermediate(&data.u).flat_map(|w| w[data.from..].to_vec()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    let present = of.spline.breakpoints();
    let (first, last) = (present[0].max(low), present[present.len() - 1].min(high));
    if first == present[0] && last == present[present.len() - 1] || !(first < last) {
        return None;
    }
    let inside = present
        .iter()
        .copied()
        .filter(|x| (first..last).contains(x) && *x > first);
    let at: Vec<f64> = std::iter::once(first).chain(inside).chain([last]).collect();
    let fewest = fewest_in_piece(data);
    let at = thinned(&at, &sorted, fewest, OUTERMOST * fewest);
    refitted(system, Part::Branch(branch), &at, data)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::super::system::Branch;
    use super::*;

    #[test]
    fn pieces_without_samples_are_taken_away_and_others_stay() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        let u: Vec<f64> = (0..2000).map(|_| rng.random_range(-1.0..1.0)).collect();
        let y: Vec<f64> = u.iter().map(|u| u.max(0.0)).collect();
        let data = Signals::of_input(u, y, 0);
        let candidate = |breakpoints: &[f64]| {
            let mut spline = KinkedSpline::new(breakpoints);
            let last = spline.c.len() - 1;
            spline.c.fill(0.5);
            // The samples, all below 1, hardly feel this coefficient.
            spline.c[last] = 1e3;
            Candidate::new(System::sum(vec![Branch::of(spline)]), &data)
        };
        let outside = anchored(candidate(&[-2.0, -0.5, 0.0, 0.5, 0.999, 3.0]), &data);
        let at = outside.system.branches[0].spline.breakpoints();
        assert!(at[0] >= -1.0 && at[at.len() - 1] <= 1.0 && at.contains(&0.5), "{at:?}");
        let beyond = outside.system.branches[0].spline.value(1.5);
        assert!((beyond - 1.5).abs() < 0.2, "{beyond}");
        let inside = candidate(&[-0.9, 0.0, 0.9]);
        let same = anchored(inside.clone(), &data);
        assert_eq!(same.system, inside.system);
    }
}
