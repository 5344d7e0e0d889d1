//! Where the velocity of a rigid axis changes its sign.
//!
//! Friction then jumps, and so does the acceleration: the velocity has a kink, which smoothing rounds off. The zero of the smoothed velocity is
//! late, since the axis brakes harder before the kink than it accelerates after it. The friction taken from it is late too. In the fit, a
//! larger inertia and a delay of the torque compensate for this. So the part of the velocity that smoothing removes is taken from the equation of
//! motion, $\ddot q = (\tau - f(\dot q) - \ldots) / M$, integrated above the cut-off ([`kinks`]).
//!
//! While an axis sticks, its velocity is zero, but its friction follows the torque. No function of velocity describes that, and in the fit it looks like
//! a delay of the torque: eight of eight simulated axes with a held torque seemed to have a delay of two samples. So the delay is estimated without
//! slow samples: their torque is replaced by what the equation of motion says. If all samples together give another delay, the axis is identified with
//! and without a held torque. The torque counts as held unless the friction then is much farther from all forms.

use super::clock_offset::ClockOffset;
use super::division::RIGID_FRICTION;
use super::kinks::{kinks, with_kinks};
use super::limits::{LARGEST_ERROR, SLOW, SLOW_SHARE};
use super::rigid::{INERTIA, Signals};
use super::smooth::Reflected;
use super::system::System;
use crate::sort;

/// What a solution says of the equation of motion at every sample.
struct Balance {
    inertia: f64,
    /// The friction and the position-dependent torques.
    others: Vec<f64>,
}

/// A torque that is held from sample to sample.
pub(super) struct Hold {
    /// The delay that was estimated, s.
    pub delay: f64,
    /// Whether all samples agree.
    pub is_sure: bool,
}

impl Signals {
    /// The equation of motion at every sample, with noise of these spectra; `None` if the inertia is not determined.
    fn balance(&self, weights: &[Vec<f64>]) -> Option<Balance> {
        let system = self.system();
        let curve = &system.curves[0];
        let splines = curve.splines(&self.modulation, RIGID_FRICTION.coarse);
        let solved = system.solve(&[&splines], weights)?;
        let factors = solved.factors();
        let inertia = factors[INERTIA];
        let error = solved.solution.covariance.error(solved.layout.factors[INERTIA]);
        let others = |(i, v): (usize, &f64)| {
            let extras = self.extras.iter().zip(&factors[INERTIA + 1..]);
            let position_dependent: f64 = extras.map(|(extra, factor)| factor * extra.values[i]).sum();
            position_dependent + curve.value(&splines.basis, solved.coefficients(0), *v)
        };
        (error < LARGEST_ERROR * inertia).then(|| Balance {
            inertia,
            others: self.velocity.iter().enumerate().map(others).collect(),
        })
    }

    /// The velocity with its kinks; `None` if the inertia is not determined.
    pub fn sharpened(&self, torque: &[f64], weights: &[Vec<f64>]) -> Option<Vec<f64>> {
        let Balance { inertia, others } = self.balance(weights)?;
        let both = torque.iter().zip(&others);
        let acceleration = both.map(|(torque, others)| (torque - others) / inertia).collect();
        let fast = kinks(&self.velocity, acceleration, self.resolution, self.cut_off, self.step);
        Some(with_kinks(self.velocity.clone(), &fast))
    }

    /// The torque with what the equation of motion says in place of slow samples; `None` if the inertia is not determined.
    fn without_slow(&self, torque: &[f64], weights: &[Vec<f64>]) -> Option<Vec<f64>> {
        let Balance { inertia, others } = self.balance(weights)?;
        let acceleration = Reflected::new(&self.velocity, self.step).velocity(self.cut_off);
        let speeds: Vec<f64> = self.velocity.iter().map(|v| v.abs()).collect();
        let slow = sort::sorted(&speeds)[(SLOW_SHARE * speeds.len() as f64) as usize].max(SLOW * self.resolution);
        let at = |i: usize| match speeds[i] < slow {
            true => inertia * acceleration[i] + others[i],
            false => torque[i],
        };
        Some((0..speeds.len()).map(at).collect())
    }

    /// Whether the torque is held from sample to sample, as all but slow samples say.
    pub fn hold(&self, torque: &[f64], band: f64, weights: &[Vec<f64>]) -> Option<Hold> {
        let without_slow = self.without_slow(torque, weights);
        let moving = without_slow.as_deref().unwrap_or(torque);
        let system = self.system_of(self.modulation.of(moving));
        let delay = self.delay(&system, moving, &self.weights_of(&system, band)?)?;
        let of_all = self.delay(&self.system(), torque, weights)?;
        delay.is_hold(self.step).then_some(Hold {
            delay: delay.value,
            is_sure: of_all.is_hold(self.step),
        })
    }

    /// The time from a sample of this torque, which moves the system, to its effect.
    fn delay(&self, system: &System, torque: &[f64], noise: &[Vec<f64>]) -> Option<ClockOffset> {
        let splines = system.curves[0].tested(&self.modulation);
        let equations = system.equations(&[&splines], noise);
        let last = equations.columns.len();
        let rate = vec![Some(self.modulation.of_rate(torque))];
        let solution = equations.with_column(rate).solve()?;
        Some(ClockOffset::new(
            solution.x[last],
            solution.covariance.error(last),
            self.step,
        ))
    }
}
