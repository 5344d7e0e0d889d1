//! The figures by which a run is judged.

use super::{Run, tip};
use crate::manipulator::Link;

/// The figures of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// The largest distance of the tip from its reference, m.
    pub tip_error_max: f64,
    /// The root mean square of that distance, m.
    pub tip_error_rms: f64,
    /// Half of the widest range of either coordinate of the tip after the end of the motion, m; NaN if the run ends before.
    pub residual_vibration: f64,
    /// The largest torque of either motor, N m.
    pub torque_peak: f64,
    /// The root mean square of the error of the links' estimated velocities, rad/s.
    pub velocity_error_rms: f64,
}

impl Figures {
    /// Measures a run whose motion ends at `end`, s.
    pub fn new(run: &Run, links: &[Link; 2], end: f64) -> Self {
        let distance = |k: usize| {
            let [x, y] = tip(links, run.truth[k].q);
            let [rx, ry] = tip(links, run.reference[k]);
            (x - rx).hypot(y - ry)
        };
        let n = run.t.len() as f64;
        let distances: Vec<f64> = (0..run.t.len()).map(distance).collect();
        let squares: f64 = distances.iter().map(|d| d * d).sum();
        let behind: Vec<[f64; 2]> = (0..run.t.len())
            .filter(|&k| run.t[k] >= end)
            .map(|k| tip(links, run.truth[k].q))
            .collect();
        let half_range = |j: usize| {
            let values = || behind.iter().map(|p| p[j]);
            0.5 * (values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min))
        };
        let torques = run.torque.iter().flatten();
        let velocity = |k: usize| {
            [0, 1]
                .map(|j| (run.estimate[k].dq[j] - run.truth[k].dq[j]).powi(2))
                .iter()
                .sum::<f64>()
        };
        Figures {
            tip_error_max: distances.iter().fold(0.0, |m, d| f64::max(m, *d)),
            tip_error_rms: (squares / n).sqrt(),
            residual_vibration: match behind.len() {
                0 | 1 => f64::NAN,
                _ => half_range(0).max(half_range(1)),
            },
            torque_peak: torques.fold(0.0, |m, t| f64::max(m, t.abs())),
            velocity_error_rms: ((0..run.t.len()).map(velocity).sum::<f64>() / (2.0 * n)).sqrt(),
        }
    }
}
