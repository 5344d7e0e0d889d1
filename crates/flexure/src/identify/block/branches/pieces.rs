//! A nonlinearity on new breakpoints, its coefficients by least squares about the present system.

use rayon::prelude::*;

use super::super::{Roughness, Shape, convolved, normal_equations, solve, thinned};
use super::search::Candidate;
use super::start::coarse;
use super::system::{Signals, System};

pub(super) const MOST_PIECES: usize = 64;
/// A piece has at least the samples' number divided by this, within 8 to 50; the outermost ones twice as many.
const FINEST_PIECES: usize = 800;
const OUTSIDE: usize = 2;
/// The share of the breakpoints that are spread evenly.
const EVEN: f64 = 0.3;

/// One of a system's nonlinearities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// That of the branch of this index.
    Branch(usize),
    /// The last one.
    Output,
}

impl System {
    /// All nonlinearities, the last one first.
    pub(super) fn parts(&self) -> Vec<Part> {
        let last = self.output.iter().map(|_| Part::Output);
        last.chain((0..self.branches.len()).map(Part::Branch)).collect()
    }

    /// What is to be refitted; `None` where there is nothing of the kind.
    pub(super) fn shape(&self, part: Part) -> Option<&Shape> {
        match part {
            Part::Branch(i) => self.branches.get(i).map(|b| &b.shape),
            Part::Output => self.output.as_ref(),
        }
    }

    /// The number of pieces.
    pub(super) fn pieces(&self, part: Part) -> usize {
        self.shape(part).map_or(0, |s| s.breakpoints().len() - 1)
    }
}

/// The system with this many pieces in one nonlinearity, dense where it is rough; fewer where samples are few.
///
/// Where it is rough is read from the present curve, which is good for smooth ones, and from one on many even breakpoints,
/// which shows kinks; the better of the two is taken.
pub(super) fn with_pieces(system: &System, part: Part, pieces: usize, data: &Signals) -> Option<Candidate> {
    let shape = system.shape(part)?;
    let mut sorted = entering(system, part, data);
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    if !(high - low > 1e-9 * low.abs().max(high.abs()) && (high - low).is_finite()) {
        return None;
    }
    let fewest = fewest_in_piece(data);
    let on = |mut at: Vec<f64>| {
        // Breakpoints of a curve over another range, brought to this one.
        let (first, length) = (at[0], at[at.len() - 1] - at[0]);
        at.iter_mut()
            .for_each(|x| *x = low + (*x - first) / length * (high - low));
        if let Some(last) = at.last_mut() {
            *last = high;
        }
        let least = 1e-7 * (high - low);
        at.dedup_by(|b, a| *b - *a <= least && *b < high);
        if at.len() > 2 && at[at.len() - 1] - at[at.len() - 2] <= least {
            at.remove(at.len() - 2);
        }
        refitted(system, part, &thinned(&at, &sorted, fewest, OUTSIDE * fewest), data)
    };
    let smooth = on(shape.denser(pieces, Roughness::Fourth, EVEN));
    let even = (0..=MOST_PIECES).map(|i| i as f64);
    let kinked = on(even.collect()).and_then(|fine| {
        let fine = fine.system.shape(part)?.denser(pieces, Roughness::Second, EVEN);
        on(fine)
    });
    let both = [smooth, kinked].into_iter().flatten();
    both.min_by(|a, b| a.squares.total_cmp(&b.squares))
}

/// What enters a nonlinearity at the samples that count.
pub(super) fn entering(system: &System, part: Part, data: &Signals) -> Vec<f64> {
    match part {
        Part::Branch(i) => data.u[i][data.from..].to_vec(),
        Part::Output => system.inner(&data.u)[data.from..].to_vec(),
    }
}

/// The fewest samples in a piece.
pub(super) fn fewest_in_piece(data: &Signals) -> usize {
    (data.counted() / FINEST_PIECES).clamp(8, 50)
}

/// The system with a last nonlinearity of a few pieces.
pub(super) fn with_output(system: &System, pieces: usize, data: &Signals) -> Option<Candidate> {
    let x = system.inner(&data.u);
    let shape = coarse(&x[data.from..], pieces)?;
    let mut system = system.clone();
    let breakpoints = shape.breakpoints().to_vec();
    system.output = Some(shape);
    refitted(&system, Part::Output, &breakpoints, data)
}

/// One nonlinearity on other breakpoints, the rest as it is.
///
/// For the last nonlinearity that is linear least squares; for a branch's, one Gauss-Newton step.
pub(super) fn refitted(system: &System, part: Part, breakpoints: &[f64], data: &Signals) -> Option<Candidate> {
    let mut next = system.clone();
    let mut shape = Shape::new(breakpoints);
    shape.kinks = system.shape(part)?.kinks.clone();
    let x = system.inner(&data.u);
    let (columns, minus): (Vec<Vec<f64>>, Vec<f64>) = match part {
        Part::Output => {
            let local: Vec<_> = x.iter().map(|x| shape.local(*x)).collect();
            let columns = shape.linear_parameters().map(|j| shape.by_parameter(j, &x, &local));
            (columns.collect(), data.y.iter().map(|y| -y).collect())
        }
        Part::Branch(i) => {
            let (branch, u) = (&system.branches[i], &data.u[i]);
            let present = branch.run(u);
            let (output, slope): (Vec<f64>, Vec<f64>) = match &system.output {
                Some(g) => x.iter().map(|x| g.value_and_slope(*x, &g.local(*x))).unzip(),
                None => x.iter().map(|x| (*x, 1.0)).unzip(),
            };
            let input = branch.delayed(u);
            let local: Vec<_> = input.iter().map(|u| shape.local(*u)).collect();
            let column = |j| {
                let mut column = branch.linear.run(&shape.by_parameter(j, &input, &local));
                column.iter_mut().zip(&slope).for_each(|(c, d)| *c *= d);
                column
            };
            let target = output.iter().zip(&data.y).zip(slope.iter().zip(&present));
            let minus = target.map(|((p, y), (d, own))| p - y - d * own).collect();
            (shape.linear_parameters().map(column).collect(), minus)
        }
    };
    let through = |column: &Vec<f64>| convolved(&data.filter, column);
    let columns: Vec<Vec<f64>> = columns.par_iter().map(through).collect();
    shape.set_linear(solve(&normal_equations(&through(&minus), &columns, data.from))?);
    match part {
        Part::Branch(i) => next.branches[i].shape = shape,
        Part::Output => next.output = Some(shape),
    }
    let squares = data.squares(&next.run(&data.u));
    squares.is_finite().then_some(Candidate { system: next, squares })
}
