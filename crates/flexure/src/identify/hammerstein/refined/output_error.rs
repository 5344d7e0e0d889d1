//! Another start, if the first one leads to a poor free run: the Hammerstein branch of least output error.
//!
//! Under a slow input, slow dynamics look like coloured noise: the autoregression that whitens the error then imitates the dynamics, and
//! hardly anything is left for the linear part. This cannot happen with the output error. Its branch, with its order and delay or those that
//! the user gave, goes through the same steps as the plain start, without a noise model.

use std::ops::{ControlFlow, Range};

use super::super::super::block::{
    Branch, Candidate, Monitor, Prepared, Rational, Signals, System, hammerstein_branches, linear_parts,
    with_a_pole_less,
};
use super::super::options::RefinedHammerstein;
use super::alternation::{Alternation, Minimum, input_correlations, memory};
use super::blocks::Observed;
use super::cells::Cells;
use super::experiments::Experiments;
use super::limits::{BRANCH_CHANGE, BRANCH_SAMPLES, POOR};
use super::linear_part::LinearPart;
use crate::interrupt;
use crate::linear::correlation::about_mean;

impl RefinedHammerstein {
    /// The minimum from the branch of least output error, if `first` leaves much of the output unexplained and the other leaves less;
    /// otherwise `first`.
    pub(super) fn or_by_output_error(
        &self,
        first: Option<Minimum>,
        all: &Experiments,
        cells: &Cells,
    ) -> Option<Minimum> {
        let longest = first.as_ref().map_or(0, |m| memory(&m.blocks.linear.transfer));
        let observed = Observed::new(all, longest);
        let poor = |m: &Minimum| m.blocks.unexplained(&observed) > POOR;
        if !first.as_ref().is_none_or(poor) {
            return first;
        }
        let Some(other) = self.by_output_error(all, cells) else {
            return first;
        };
        let longest = longest.max(memory(&other.blocks.linear.transfer));
        let observed = Observed::new(all, longest);
        let better = |first: &Minimum| first.blocks.unexplained(&observed) <= other.blocks.unexplained(&observed);
        match first.filter(better) {
            Some(first) => Some(first),
            None => Some(other),
        }
    }

    /// The minimum from the branch of the longest experiment, interpolated where samples are missing.
    fn by_output_error(&self, all: &Experiments, cells: &Cells) -> Option<Minimum> {
        let u = &all.u[..all.fitted];
        let longest = all.fitted_parts().into_iter().max_by_key(Range::len)?;
        let prepared = Prepared::new(&[&u[longest.clone()]], &all.y[longest]);
        let mut go_on = |_: &str| ControlFlow::Continue(());
        let monitor = &mut Monitor::new(&mut go_on);
        let found = hammerstein_branches::find(&prepared.data, false, monitor)?;
        let system = self.as_wanted(found.system, &prepared.data.head(BRANCH_SAMPLES), monitor)?;
        let branch = system.branches.first()?;
        let transfer = branch.back.transfer_function(0).ok()?;
        let standardised = prepared.inputs.first()?.standardised(u);
        let curve = standardised
            .iter()
            .map(|u| prepared.output.spread * branch.spline.value(*u));
        let w = about_mean(&curve.collect::<Vec<_>>());
        let method = self.without_noise_model();
        let linear = LinearPart::new(transfer.b(), &transfer.a()[1..], branch.delay);
        let input = input_correlations(u);
        let alternation = Alternation {
            keeps_orders: true,
            ..Alternation::new(cells, &method, &input, w, linear)
        };
        alternation.minimum(&mut Observed::new(all, memory(&transfer)))
    }

    /// The branch with the order and the delay that the user gave: changed step by step, each time to the best of the changes that come nearer.
    fn as_wanted(&self, mut system: System, data: &Signals, monitor: &mut Monitor<'_>) -> Option<System> {
        let distance = |g: &Rational, delay: usize| {
            let order = self.order.map_or(0, |l| l.abs_diff(g.order()));
            order + self.delay.map_or(0, |s| s.abs_diff(delay))
        };
        loop {
            interrupt::check().ok()?;
            let branch = system.branches.first()?;
            let left = distance(&branch.back, branch.delay);
            if left == 0 {
                return Some(system);
            }
            let mut nearer = linear_parts(&branch.back, branch.delay);
            // The only coefficient of a numerator cannot become part of the delay, nor every pole of the numerator.
            nearer.push((branch.back.clone(), branch.delay + 1));
            nearer.extend(with_a_pole_less(&branch.back).map(|back| (back, branch.delay)));
            nearer.retain(|(g, delay)| distance(g, *delay) < left);
            let fitted = nearer.into_iter().map(|(back, delay)| {
                let mut next = system.clone();
                next.branches[0] = Branch {
                    back,
                    delay,
                    ..branch.clone()
                };
                Candidate::new(next, data).fitted(data, BRANCH_CHANGE, monitor)
            });
            let best = fitted.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
            system = best.system;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};

    use std::ops::ControlFlow;

    use super::RefinedHammerstein;
    use crate::identify::{HAMMERSTEIN, Options, Request};
    use crate::record::Record;

    /// The level of the second of two tanks, every 4 s, under a slow multisine of the pump's voltage.
    fn tanks(seed: u64) -> Record {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let n = 1024;
        let phases: Vec<f64> = (0..59).map(|_| rng.random_range(0.0..std::f64::consts::TAU)).collect();
        let turn = |k: usize, t: usize| std::f64::consts::TAU * (k + 1) as f64 * t as f64 / n as f64;
        let voltage = |t: usize| {
            phases
                .iter()
                .enumerate()
                .map(|(k, p)| (turn(k, t) + p).cos())
                .sum::<f64>()
        };
        let u: Vec<f64> = (0..n).map(|t| (3.5 + 0.24 * voltage(t)).clamp(0.0, 10.0)).collect();
        let (mut upper, mut lower) = (5.0_f64, 5.0_f64);
        let step = 0.1;
        let mut level = |u: &f64| {
            for _ in 0..40 {
                let flow = 0.05 * upper.sqrt();
                upper = (upper + step * (0.025 * u - flow)).clamp(0.0, 10.0);
                lower = (lower + step * (flow - 0.048 * lower.sqrt())).clamp(0.0, 10.0);
            }
            let e: f64 = StandardNormal.sample(&mut rng);
            lower + 0.02 * e
        };
        let y = u.iter().map(&mut level).collect();
        Record::new([("u", u), ("y", y)]).unwrap()
    }

    /// This is no Hammerstein system, but its two slow poles belong to the linear part and not to the noise. Without another start, the
    /// order is 0, the delay 80 to 150, and the model explains nothing.
    #[test]
    fn slow_dynamics_are_not_taken_for_coloured_noise() {
        for seed in 1..6 {
            let found = HAMMERSTEIN.identify(&tanks(seed), &["u"], "y").unwrap();
            assert!(
                found.order >= 2 && found.delay < 10,
                "{seed}: {} {}",
                found.order,
                found.delay
            );
            let explained = found.verdict.measures.r_squared;
            assert!(explained > 0.85, "{seed}: {explained}");
        }
    }

    /// The same with an order or a delay that the user gives: it is kept.
    #[test]
    fn slow_dynamics_are_found_with_a_given_order_and_delay() {
        let cases = [
            (Some(2), None),
            (Some(2), Some(1)),
            (Some(1), Some(3)),
            (None, Some(4)),
            (Some(4), None),
        ];
        for (order, delay) in cases {
            let method = RefinedHammerstein {
                order,
                delay,
                ..RefinedHammerstein::default()
            };
            let found = method.identify(&tanks(1), "u", "y").unwrap();
            let has = (order.unwrap_or(found.order), delay.unwrap_or(found.delay));
            assert_eq!((found.order, found.delay), has);
            let explained = found.verdict.measures.r_squared;
            assert!(explained > 0.85, "{order:?} {delay:?}: {explained}");
        }
    }

    /// The same where a few outputs are missing, and from two experiments.
    #[test]
    fn slow_dynamics_are_found_among_missing_outputs_and_in_experiments() {
        for seed in 1..3 {
            let whole = tanks(seed);
            let mut y = whole.column("y").unwrap().to_vec();
            y[300..303].fill(f64::NAN);
            let gap = Record::new([("u", whole.column("u").unwrap().to_vec()), ("y", y)]).unwrap();
            let (first, second) = (tanks(seed + 10), whole);
            for records in [vec![&gap], vec![&first, &second]] {
                let options = Options {
                    missing: true,
                    ..Options::default()
                };
                let request = Request::new(&records, &["u"], "y", options);
                let found = HAMMERSTEIN
                    .identify_with(&request, &mut |_| ControlFlow::Continue(()))
                    .unwrap();
                let explained = found.verdict.measures.r_squared;
                assert!(
                    found.order >= 2 && explained > 0.85,
                    "{seed}, {}: {} {explained}",
                    records.len(),
                    found.order
                );
            }
        }
    }
}
