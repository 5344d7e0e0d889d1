//! The colour of the noise, from a system of high order.
//!
//! A difference equation of high order (ARX) has a white error for nearly any noise (Zhu 2001, chapter 6). So a filter with the coefficients of its
//! denominator makes the noise white. In the filtered signals, the iteration of Steiglitz and McBride finds the poles, and least squares is
//! efficient.

use super::super::block::{Signals, convolved};
use super::fit::equation_error;
use super::limits::{COLOUR_RATIO, FEWEST_OF_HIGH_ORDER, HIGH_ORDER, SAMPLES_OF_HIGH_ORDER};
use super::system::{Numerator, Orders};
use crate::linear::correlation::variance;

pub struct HighOrder {
    /// The polynomial that whitens the noise; monic, in powers of the delay.
    pub whitener: Vec<f64>,
    /// The signals filtered by it, for poles and delays.
    pub filtered: Signals,
}

impl HighOrder {
    /// `None` if the samples are too few, if the noise is nearly white, or if the system is unstable.
    pub fn new(data: &Signals) -> Option<HighOrder> {
        if data.y.len() < FEWEST_OF_HIGH_ORDER {
            return None;
        }
        let poles = HIGH_ORDER.min(data.y.len() / (SAMPLES_OF_HIGH_ORDER * (data.u.len() + 1)));
        let numerator = Numerator {
            delay: 0,
            count: poles + 1,
        };
        let orders = Orders {
            poles,
            integrators: 0,
            inputs: vec![numerator; data.u.len()],
        };
        let system = equation_error(&orders, data).filter(|s| s.denominator.is_stable())?;
        let output = system.run(&data.u);
        let noise: Vec<f64> = data.y.iter().zip(&output).map(|(y, x)| y - x).collect();
        let whitener = system.polynomial();
        let innovation = convolved(&whitener, &noise);
        let is_coloured = variance(&noise[poles..]) > COLOUR_RATIO * variance(&innovation[poles..]);
        if !is_coloured {
            return None;
        }
        // The first outputs of the filter lack earlier samples.
        let settled = |signal: &[f64]| convolved(&whitener, signal)[poles..].to_vec();
        let filtered = Signals {
            u: data.u.iter().map(|u| settled(u)).collect(),
            y: settled(&data.y),
            ..data.clone()
        };
        Some(HighOrder { whitener, filtered })
    }
}
