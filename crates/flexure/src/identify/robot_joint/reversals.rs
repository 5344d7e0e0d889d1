//! Where the velocity of a rigid axis changes its sign.
//!
//! Friction then jumps, and so does the acceleration: the velocity has a kink, which smoothing rounds off. The zero of the smoothed velocity is
//! late, since the axis brakes harder before the kink than it accelerates after it. The friction taken from it is late too. In the fit, a
//! larger inertia and a delay of the torque compensate for this. So the part of the velocity that smoothing removes is taken from the equation of
//! motion, $\ddot q = (\tau - f(\dot q) - \ldots) / M$, integrated above the cut-off ([`kinks`]).
//!
//! That is right from sample to sample. What happens within samples is simulated: see [`passages`](super::passages).

use super::division::RIGID_FRICTION;
use super::kinks::{kinks, with_kinks};
use super::limits::LARGEST_ERROR;
use super::rigid::{INERTIA, Signals};

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
        let acceleration = both.map(|(torque, others)| (torque - others) / inertia).collect();
        let fast = kinks(&self.velocity, acceleration, self.resolution, self.cut_off, self.step);
        Some(with_kinks(self.velocity.clone(), &fast))
    }
}
