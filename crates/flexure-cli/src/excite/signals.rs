//! The signals, of largest absolute value 1.

use anyhow::Result;
use flexure::signal::{Chirp, Phases, Sweep, multilevel, multisine, zero};

use super::{Arguments, SignalKind};
use crate::arguments::Usage;

/// Keeps the joints' seeds apart.
const APART: u64 = 0x9E37_79B9_7F4A_7C15;

/// The signals of both joints; zero where a joint is not free.
///
/// A chirp rises at joint 1 while it falls at joint 2, so that the joints never move in the same way.
pub fn unit(rows: usize, free: [bool; 2], arguments: &Arguments) -> Result<[Vec<f64>; 2]> {
    let one = |joint: usize| match free[joint] {
        true => of_joint(rows, joint, arguments),
        false => Ok(zero(rows)),
    };
    Ok([one(0)?, one(1)?])
}

/// The signal of one joint.
pub fn of_joint(rows: usize, joint: usize, arguments: &Arguments) -> Result<Vec<f64>> {
    let Arguments {
        sample_time: step,
        f_min,
        f_max,
        ..
    } = *arguments;
    let seed = arguments.seed.wrapping_add((joint as u64).wrapping_mul(APART));
    Ok(match arguments.kind {
        SignalKind::Multisine if 1.0 / (rows as f64 * step) > f_max => {
            let lowest = 1.0 / (rows as f64 * step);
            return Err(Usage(format!(
                "--duration {}: the lowest harmonic is at {lowest:.3} Hz, above --f-max {f_max} Hz; give a longer duration",
                arguments.duration
            ))
            .into());
        }
        SignalKind::Multisine => multisine(rows, step, 1.0, f_min, f_max, Phases::LowCrest { seed })?,
        SignalKind::Multilevel => {
            let hold = ((arguments.hold / step).round() as usize).max(1);
            multilevel(rows, 1.0, usize::from(arguments.levels), hold, seed)?
        }
        SignalKind::Chirp => {
            let duration = (rows - 1) as f64 * step;
            let mut chirp = Chirp::new(1.0, f_min, f_max, duration, Sweep::Logarithmic)?.samples(rows, step)?;
            if joint % 2 == 1 {
                chirp.reverse();
            }
            chirp
        }
    })
}

/// The largest absolute value over the root mean square, both about the mean; NaN of a constant.
pub fn crest_factor(x: &[f64]) -> f64 {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let peak = x.iter().fold(0.0_f64, |m, v| m.max((v - mean).abs()));
    let square: f64 = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    peak / square.sqrt()
}
