//! Where the velocity of a rigid axis changes its sign.
//!
//! Friction then jumps, and so does the acceleration: the velocity has a kink, which smoothing rounds off. The zero of the smoothed velocity
//! is late, since the axis brakes harder before the kink than it accelerates after it, and the friction taken from it is late too. The inertia, and a
//! delay of the torque, would make up for that. So the part of the velocity that smoothing removes is taken from the equation of motion,
//! $\ddot q = (\tau - f(\dot q) - \ldots) / M$, integrated above the cut-off.
//!
//! An axis that sticks has no velocity, but a friction that follows the torque. No function of velocity describes that, and a delay of the torque
//! imitates it: six of eight simulated axes with a held torque seemed to have a delay of two samples and more. So the delay is estimated while
//! slow samples tell nothing: their torque is replaced by what the equation of motion says.

use super::division::RIGID_FRICTION;
use super::limits::{LARGEST_ERROR, SLOW, SLOW_SHARE};
use super::rigid::{INERTIA, Signals};
use super::smooth::Reflected;
use crate::sort;

/// What a solution says of the equation of motion at every sample.
struct Balance {
    inertia: f64,
    /// The friction and the position-dependent torques.
    others: Vec<f64>,
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
        let acceleration: Vec<f64> = both.map(|(torque, others)| (torque - others) / inertia).collect();
        let fast = Reflected::new(&acceleration, self.step).integral_above(self.cut_off);
        Some(self.velocity.iter().zip(&fast).map(|(v, fast)| v + fast).collect())
    }

    /// The torque with what the equation of motion says in place of slow samples; `None` if the inertia is not determined.
    pub fn without_slow(&self, torque: &[f64], weights: &[Vec<f64>]) -> Option<Vec<f64>> {
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
}
