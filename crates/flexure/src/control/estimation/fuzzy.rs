//! Fuzzy adaptation of a filter's process noise.
//!
//! The innovations' mean normalised square over a window, divided by its expectation, shows whether the filter trusts its model too much (r
//! above 1) or too little (r below 1). Three rules with trapezoidal memberships over ln r (Takagi & Sugeno 1985, constants as consequents)
//! move the factor on the process noise (Sasiadek & Wang 1999, Sensor fusion based on fuzzy Kalman filtering, AIAA GNC):
//!
//! | if r is | then the factor changes by |
//! |---|---|
//! | small | / 1.1 |
//! | as expected | 1 |
//! | large | * 1.1 |

/// ln r that chance explains: three standard deviations of the window's mean, sqrt(0.02 / 1.98). With a smaller value the factor follows
/// the random innovations of a correct filter: at two standard deviations, its NEES was in its band 0.5 % less of the time.
const BY_CHANCE: f64 = 0.3;
/// The weight of a new innovation in the mean: a window of about 50 samples.
const FORGETTING: f64 = 0.02;
/// ln r beyond which r is small or large without doubt: a factor of 2, seven standard deviations of the window's mean.
const WITHOUT_DOUBT: f64 = std::f64::consts::LN_2;
/// The largest ln of the factor's change by a rule.
const STEP: f64 = 0.095;
/// The range of the factor.
const RANGE: [f64; 2] = [1e-2, 1e6];
/// The degrees of freedom of an innovation.
const DEGREES: f64 = 2.0;

/// The state of the rules.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptation {
    factor: f64,
    mean: f64,
}

impl Default for Adaptation {
    fn default() -> Self {
        Adaptation {
            factor: 1.0,
            mean: DEGREES,
        }
    }
}

impl Adaptation {
    /// The factor on the process noise's variance.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Takes the normalised square of an innovation into account.
    pub fn learn(&mut self, nis: f64) {
        if !nis.is_finite() {
            return;
        }
        self.mean += FORGETTING * (nis - self.mean);
        let ratio = (self.mean / DEGREES).max(1e-12).ln();
        let beyond = |ratio: f64| ((ratio - BY_CHANCE) / (WITHOUT_DOUBT - BY_CHANCE)).clamp(0.0, 1.0);
        let (large, small) = (beyond(ratio), beyond(-ratio));
        // The memberships sum to 1 with that of "as expected", which changes nothing.
        let change = STEP * (large - small);
        self.factor = (self.factor * change.exp()).clamp(RANGE[0], RANGE[1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_innovations_raise_the_noise_and_small_ones_lower_it() {
        let settled = |nis: f64| {
            let mut adaptation = Adaptation::default();
            (0..300).for_each(|_| adaptation.learn(nis));
            adaptation.factor()
        };
        assert_eq!(settled(2.0), 1.0);
        assert!(settled(8.0) > 1e3 && settled(0.5) < 0.1);
        assert_eq!((settled(1e9), settled(0.0)), (RANGE[1], RANGE[0]));
        assert_eq!(settled(f64::NAN), 1.0);
    }
}
