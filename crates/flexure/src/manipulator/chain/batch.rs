//! Many states at once, several in the lanes of a register.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::data::length;
use super::model::Chain;
use crate::error::Result;
use crate::number::{LANES, Lanes, Wide};

/// What is computed of states.
#[derive(Debug, Clone, Copy)]
enum Dynamics {
    Forward,
    Inverse,
    Inertia,
}

/// States one after the other: positions, velocities, and torques or accelerations; positions alone, where inertia matrices are asked for.
#[derive(Clone, Copy)]
struct States<'a> {
    q: &'a [f64],
    v: &'a [f64],
    given: &'a [f64],
}

impl Chain {
    /// [`Chain::forward_dynamics`] of many states that lie one after the other in `q`, `v` and `tau`: the same accelerations to the last
    /// bit, in less time.
    ///
    /// # Errors
    /// Those of [`Chain::forward_dynamics`] of the first state that has one, and lengths that are not those of as many states.
    pub fn forward_dynamics_batch(&self, q: &[f64], v: &[f64], tau: &[f64], acceleration: &mut [f64]) -> Result<()> {
        self.lengths([("v", v), ("tau", tau), ("acceleration", acceleration)], q)?;
        let states = States { q, v, given: tau };
        self.on(Wide::all().next(), Dynamics::Forward, states, acceleration)
    }

    /// [`Chain::inverse_dynamics`] of many states that lie one after the other in `q`, `v` and `a`: the same torques to the last bit, in
    /// less time.
    ///
    /// # Errors
    /// Those of [`Chain::inverse_dynamics`] of the first state that has one, and lengths that are not those of as many states.
    pub fn inverse_dynamics_batch(&self, q: &[f64], v: &[f64], a: &[f64], tau: &mut [f64]) -> Result<()> {
        self.lengths([("v", v), ("a", a), ("tau", tau)], q)?;
        self.on(Wide::all().next(), Dynamics::Inverse, States { q, v, given: a }, tau)
    }

    /// [`Chain::mass_matrix`] of many positions that lie one after the other in `q`: the same matrices, one after the other, to the last
    /// bit, in less time.
    ///
    /// # Errors
    /// Those of [`Chain::mass_matrix`] of the first position that has one, and lengths that are not those of as many positions.
    pub fn mass_matrix_batch(&self, q: &[f64], matrices: &mut [f64]) -> Result<()> {
        let count = self.count(q)?;
        length("matrices", matrices, count * self.velocities() * self.velocities())?;
        let states = States { q, v: &[], given: &[] };
        self.on(Wide::all().next(), Dynamics::Inertia, states, matrices)
    }

    /// The number of positions that lie one after the other.
    fn count(&self, q: &[f64]) -> Result<usize> {
        let count = q.len() / self.positions();
        length("q", q, count * self.positions())?;
        Ok(count)
    }

    /// Checks that vectors belong to as many states as the positions do.
    fn lengths(&self, vectors: [(&str, &[f64]); 3], q: &[f64]) -> Result<()> {
        let expected = self.count(q)? * self.velocities();
        vectors
            .into_iter()
            .try_for_each(|(name, vector)| length(name, vector, expected))
    }

    /// The numbers of values of a position, of a velocity that is given, and of a result.
    #[inline(always)]
    fn widths(&self, dynamics: Dynamics) -> (usize, usize, usize) {
        let (p, n) = (self.positions(), self.velocities());
        match dynamics {
            Dynamics::Forward | Dynamics::Inverse => (p, n, n),
            Dynamics::Inertia => (p, 0, n * n),
        }
    }

    /// The results of states, with these registers.
    fn on(&self, wide: Option<Wide>, dynamics: Dynamics, states: States, results: &mut [f64]) -> Result<()> {
        let done = match wide {
            #[cfg(target_arch = "x86_64")]
            Some(Wide::Avx512(simd)) => simd.vectorize(
                #[inline(always)]
                || self.in_lanes(simd, dynamics, states, results),
            ),
            #[cfg(target_arch = "x86_64")]
            Some(Wide::Avx2(simd)) => simd.vectorize(
                #[inline(always)]
                || self.in_lanes(simd, dynamics, states, results),
            ),
            None => 0,
        };
        // What is left over, and groups with a state that has an error, one state after the other.
        let (p, n, width) = self.widths(dynamics);
        let mut data = self.data();
        for i in done..states.q.len() / p {
            let (q, v, given) = (
                &states.q[i * p..][..p],
                &states.v[i * n..][..n],
                &states.given[i * n..][..n],
            );
            let result = &mut results[i * width..][..width];
            match dynamics {
                Dynamics::Forward => self.forward_dynamics(&mut data, q, v, given, result)?,
                Dynamics::Inverse => self.inverse_dynamics(&mut data, q, v, given, result)?,
                Dynamics::Inertia => self.mass_matrix(&mut data, q, result)?,
            }
        }
        Ok(())
    }

    /// The results of full groups of states; returns how many states are done, all of them before the first group with an error.
    #[inline(always)]
    fn in_lanes<S: Simd>(&self, simd: S, dynamics: Dynamics, states: States, results: &mut [f64]) -> usize {
        let (p, n, width) = self.widths(dynamics);
        let zero = Lanes::splat(simd, 0.0);
        let mut data = self.data_like(zero);
        let (mut q, mut v, mut given, mut result) = (vec![zero; p], vec![zero; n], vec![zero; n], vec![zero; width]);
        let groups = states.q.len() / p / LANES;
        for group in 0..groups {
            take(&mut q, &states.q[group * LANES * p..]);
            take(&mut v, &states.v[group * LANES * n..]);
            take(&mut given, &states.given[group * LANES * n..]);
            let done = match dynamics {
                Dynamics::Forward => self.accelerations(&mut data, &q, &v, &given, &mut result),
                Dynamics::Inverse => self.torques(&mut data, &q, &v, &given, &mut result),
                Dynamics::Inertia => self.inertias(&mut data, &q, &mut result),
            };
            if done.is_err() {
                return group * LANES;
            }
            for (i, number) in result.iter().enumerate() {
                for lane in 0..LANES {
                    results[(group * LANES + lane) * width + i] = number[lane];
                }
            }
        }
        groups * LANES
    }
}

/// Takes the vectors of a group that lie one after the other, each into a lane.
#[inline(always)]
fn take<S: Simd>(vector: &mut [Lanes<S>], from: &[f64]) {
    let width = vector.len();
    for (i, number) in vector.iter_mut().enumerate() {
        for lane in 0..LANES {
            number[lane] = from[lane * width + i];
        }
    }
}

#[cfg(test)]
#[path = "batch_tests.rs"]
mod tests;
