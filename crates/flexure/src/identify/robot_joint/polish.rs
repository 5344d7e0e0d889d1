//! A rigid axis polished by its free run: least squares of the simulated motion's error under the recorded torque, starting from the
//! parameters of the equations of motion (DIDIM has the same idea in a control loop; Gautier, Janot & Vandanjon 2013).
//!
//! Inertia and the factors of the best form's terms are refined. Shape parameters, the Stribeck parts and the terms of the position stay: a
//! free run passes the slow motion of a Stribeck part too fast to determine it, and least squares would misuse it. A free run accumulates
//! errors that the equations of motion hardly show, such as a slightly wrong friction or offset; but it also accumulates any drift of the
//! axis itself. So both results are kept. The halves of the record decide between them: each half is simulated with the parameters polished
//! on the other half, and with the equations' result.

use super::finding::Finding;
use super::forms::{ParametricCurve, Term};
use super::limits::{
    BETTER_BY, POLISH_DIFFERENCE, POLISH_DIFFERS, POLISH_ROUNDS, POLISH_SETTLED, POLISH_SUBSTEPS, POLISHED_SAMPLES,
};
use super::outcome::{Estimated, Fitted, Polished, RigidAxis};
use super::replay::{AxisDrive, Movable};
use crate::linalg::least_squares;
use crate::linear::correlation::mean_square;
use crate::parallel;

/// A part of the record under its torque.
struct Run<'a> {
    axis: &'a RigidAxis,
    torque: &'a [f64],
    position: &'a [f64],
    /// The velocity at its first sample.
    velocity: f64,
    /// One in this many samples counts.
    every: usize,
}

/// Inertia and the factors of a form's terms.
#[derive(Clone)]
struct Unknowns(Vec<f64>);

impl Run<'_> {
    /// The error of the free run with these unknowns, at the samples that count; `None` if it runs away.
    fn error(&self, unknowns: &Unknowns, form: &ParametricCurve) -> Option<Vec<f64>> {
        let friction = ParametricCurve {
            factors: unknowns.0[1..].to_vec(),
            ..form.clone()
        };
        let axis = Movable {
            inertia: unknowns.0[0],
            friction: &friction,
            extras: self.axis.position_dependent(),
            sample_time: self.axis.sample_time,
            substeps: POLISH_SUBSTEPS,
        };
        let motion = axis.positions(AxisDrive::Torque(self.torque), [self.position[0], self.velocity]);
        let both = motion.iter().zip(self.position).step_by(self.every);
        let error: Vec<f64> = both.map(|(simulated, measured)| simulated - measured).collect();
        (unknowns.0[0] > 0.0 && error.iter().all(|e| e.is_finite())).then_some(error)
    }

    /// The unknowns with the least squares of the error, by Gauss-Newton steps from these; `sizes` are significant changes, 0 for fixed
    /// unknowns.
    fn polished(&self, start: &Unknowns, sizes: &[f64], form: &ParametricCurve) -> Option<Unknowns> {
        let mut at = start.clone();
        let mut error = self.error(&at, form)?;
        let free: Vec<usize> = (0..sizes.len()).filter(|&i| sizes[i] > 0.0).collect();
        for _ in 0..POLISH_ROUNDS {
            let columns = parallel::map(free.len(), |i| {
                let mut moved = at.clone();
                moved.0[free[i]] += POLISH_DIFFERENCE * sizes[free[i]];
                let there = self.error(&moved, form)?;
                let rates = there.iter().zip(&error);
                Some(
                    rates
                        .map(|(e, before)| (e - before) / POLISH_DIFFERENCE)
                        .collect::<Vec<f64>>(),
                )
            });
            let columns: Vec<Vec<f64>> = columns.into_iter().collect::<Option<_>>()?;
            let rows: Vec<f64> = (0..error.len())
                .flat_map(|row| columns.iter().map(move |column| column[row]))
                .collect();
            let step = least_squares(&rows, columns.len(), &error)?;
            let before = mean_square(&error);
            let better = [1.0, 0.5, 0.25, 0.1].into_iter().find_map(|part| {
                let mut moved = at.clone();
                for (&i, s) in free.iter().zip(&step) {
                    moved.0[i] -= part * s * sizes[i];
                }
                let error = self.error(&moved, form)?;
                (mean_square(&error) < before).then_some((moved, error))
            });
            let Some((moved, there)) = better else { break };
            (at, error) = (moved, there);
            if mean_square(&error) > (1.0 - POLISH_SETTLED) * before {
                break;
            }
        }
        Some(at)
    }
}

impl RigidAxis {
    /// The best form polished by the free run under this torque; `None` if the axis or its free run runs away, or if other torques act too.
    pub(super) fn polish(&self, torque: &[f64], position: &[f64]) -> Option<Polished> {
        let form = self.friction.best();
        let clipped = |f: &Finding| matches!(f, Finding::ClippedTorque { .. });
        if !form.inertia.is_positive() || self.findings.iter().any(clipped) {
            return None;
        }
        let n = position.len();
        let run = |first: usize, last: usize| Run {
            axis: self,
            torque: &torque[first..last],
            position: &position[first..last],
            velocity: self.starting_velocity(
                form,
                AxisDrive::Torque(&torque[first..last]),
                &position[first..last],
                self.friction.x[first],
            ),
            every: (last - first).div_ceil(POLISHED_SAMPLES),
        };
        let start = Unknowns([&[form.inertia.value], &form.curve.factors[..]].concat());
        let sizes = self.sizes(form);
        let (whole, halves) = (run(0, n), [run(0, n / 2), run(n / 2, n)]);
        let polished = whole.polished(&start, &sizes, &form.curve)?;
        let error = |run: &Run, unknowns: &Unknowns| Some(mean_square(&run.error(unknowns, &form.curve)?));
        let mut held_back = [0.0; 2];
        for (half, other) in [(0, 1), (1, 0)] {
            let of_other = halves[other].polished(&start, &sizes, &form.curve)?;
            for (sum, unknowns) in held_back.iter_mut().zip([&start, &of_other]) {
                *sum += 0.5 * error(&halves[half], unknowns)?;
            }
        }
        let held_back = held_back.map(f64::sqrt);
        let refined = refined(form, &polished);
        Some(Polished {
            error: [error(&whole, &start)?.sqrt(), error(&whole, &polished)?.sqrt()],
            is_used: held_back[1] < (1.0 - BETTER_BY) * held_back[0],
            held_back,
            differs: differing(form, &refined),
            form: refined,
        })
    }

    /// The significant size of each unknown: the inertia itself, and for a term's factor the value that makes the term as large as the
    /// friction; 0 for fixed ones.
    fn sizes(&self, form: &Fitted) -> Vec<f64> {
        let curve = &form.curve;
        let v = &self.friction.x;
        let friction: Vec<f64> = v.iter().map(|&v| curve.value(v)).collect();
        [
            vec![form.inertia.value],
            curve.factor_sizes(v, mean_square(&friction).sqrt()),
        ]
        .concat()
    }
}

/// The form with these unknowns.
fn refined(form: &Fitted, Unknowns(unknowns): &Unknowns) -> Fitted {
    let mut refined = form.clone();
    refined.inertia = Estimated {
        value: unknowns[0],
        standard_error: f64::NAN,
    };
    refined.curve.factors = unknowns[1..].to_vec();
    for parameter in &mut refined.parameters {
        parameter.standard_error = f64::NAN;
    }
    let factor = |wanted: Term| {
        let mut both = form.curve.terms.iter().zip(&unknowns[1..]);
        both.find(|(term, _)| **term == wanted)
            .map_or(0.0, |(_, factor)| *factor)
    };
    for &term in &form.curve.terms {
        // Static friction is Coulomb's and the Stribeck part together.
        let (symbol, value) = match term {
            Term::Stribeck => ("Fs", factor(Term::Sign) + factor(term)),
            _ => (form.form.symbol(term), factor(term)),
        };
        let parameter = refined.parameters.iter_mut().find(|p| p.symbol == symbol);
        if let Some(parameter) = parameter {
            parameter.value = value;
        }
    }
    refined
}

/// The symbols of the parameters that differ by more than chance.
fn differing(form: &Fitted, refined: &Fitted) -> Vec<String> {
    let inertia = (
        "M",
        form.inertia.value,
        form.inertia.standard_error,
        refined.inertia.value,
    );
    let parameters = form.parameters.iter().zip(&refined.parameters);
    let parameters = parameters.filter(|(p, _)| p.identifiable);
    let parameters = parameters.map(|(p, r)| (p.symbol.as_str(), p.value, p.standard_error, r.value));
    std::iter::once(inertia)
        .chain(parameters)
        .filter(|(_, before, error, after)| (after - before).abs() > POLISH_DIFFERS * error)
        .map(|(symbol, ..)| symbol.to_owned())
        .collect()
}
