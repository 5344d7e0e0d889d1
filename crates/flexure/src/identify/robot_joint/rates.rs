//! Velocity and acceleration from logged positions.

use super::smooth::{Noise, Reflected};

/// A velocity and its acceleration.
pub(super) struct Rates {
    pub velocity: Vec<f64>,
    pub acceleration: Vec<f64>,
    /// The cut-off of their smoothing, Hz.
    pub cut_off: f64,
}

impl Rates {
    /// Of a position; the velocity is derived from it if it was not measured.
    pub fn new(position: &[f64], measured: Option<&[f64]>, step: f64) -> Rates {
        let cut_off = Noise::of(position, step).cut_off();
        let velocity = match measured {
            Some(velocity) => velocity.to_vec(),
            None => Reflected::new(position, step).velocity(cut_off),
        };
        Rates {
            acceleration: Reflected::new(&velocity, step).velocity(cut_off),
            velocity,
            cut_off,
        }
    }

    /// Of so many samples at rest.
    pub fn at_rest(samples: usize) -> Rates {
        Rates {
            velocity: vec![0.0; samples],
            acceleration: vec![0.0; samples],
            cut_off: 0.0,
        }
    }
}
