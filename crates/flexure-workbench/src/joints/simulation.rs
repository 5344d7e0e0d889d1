//! Simulated motions of identified joints, compared with the measured ones.

use flexure::manipulator::{Arm, ArmParameters, Drive, SimulationOptions, State, simulate};

use super::Log;

/// The simulated motion of one axis.
pub struct Motion {
    /// What drove it, for reading.
    pub drive: &'static str,
    /// The positions of the axis or its link.
    pub position: Vec<f64>,
    /// How close they are to the measured ones.
    pub fit: Fit,
    /// The fit of the link's velocity in percent; not known for a rigid axis.
    pub velocity_fit_percent: f64,
}

/// How near a simulated signal is to the measured one.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    /// The root mean square of measured less simulated.
    pub rms: f64,
    /// 100 (1 - |q - qh| / |q - mean q|).
    pub percent: f64,
}

impl Fit {
    /// Over the samples that both have.
    pub fn new(measured: &[f64], simulated: &[f64]) -> Self {
        let measured = &measured[..measured.len().min(simulated.len())];
        let n = measured.len() as f64;
        let mean = measured.iter().sum::<f64>() / n;
        let both = measured.iter().zip(simulated);
        let (off, spread) = both.fold((0.0, 0.0), |(off, spread), (q, p)| {
            (off + (q - p).powi(2), spread + (q - mean).powi(2))
        });
        Fit {
            rms: (off / n).sqrt(),
            percent: 100.0 * (1.0 - (off / spread).sqrt()),
        }
    }
}

/// The motion of every joint that the log has, simulated under its torques, held from sample to sample; none where the simulation
/// fails. If only one joint of an arm moves, the log has one axis, and the other joint gets no torque. `velocities` are those of the log.
///
/// # Errors
/// For a sample time with which nothing can be simulated.
pub fn motions(arm: ArmParameters, initial: State, log: &Log, velocities: &[&[f64]]) -> flexure::Result<Vec<Motion>> {
    let duration = (log.samples() - 1) as f64 * log.sample_time;
    let options = SimulationOptions {
        initial,
        ..SimulationOptions::new(duration, log.sample_time)?
    };
    // Rounding may make the last row one too many.
    let rows = options.sampling.rows();
    let torque = log.torques(rows, [false, log.axes.len() == 1]);
    let drive = Drive::Held([&torque[0], &torque[1]]);
    let Ok(simulated) = Arm::new(arm).and_then(|arm| simulate(&arm, &drive, &options)) else {
        return Ok(Vec::new());
    };
    let motion = |(i, measured): (usize, &&[f64])| {
        let position = simulated.column(["q1", "q2"][i])?.to_vec();
        let velocity = simulated.column(["dq1", "dq2"][i])?;
        Ok(Motion {
            drive: "under the recorded torque",
            fit: Fit::new(&log.axes[i].position, &position),
            velocity_fit_percent: Fit::new(measured, velocity).percent,
            position,
        })
    };
    velocities.iter().enumerate().map(motion).collect()
}
