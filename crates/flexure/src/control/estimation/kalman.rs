//! Kalman filters of the arm that read the motors' encoders.
//!
//! $$ \hat x_{k|k-1} = F(\hat x_{k-1}, \tau), \quad P_{k|k-1} = F_x P F_x^T + G G^T \sigma_\tau^2 + Q, \qquad
//!    \nu = q_m - \hat q_m, \quad S = H P H^T + \sigma^2 I, \quad K = P H^T S^{-1} $$
//!
//! The two encoders are independent, so their readings are processed one after the other: S is a scalar instead of a matrix.

use super::super::{Estimator, Moment};
use super::fuzzy::Adaptation;
use super::matrix::{Matrix8, squared_distance};
use super::prediction::{Gaussian, extended, unscented};
use crate::error::{Error, Result};
use crate::manipulator::{Arm, State};

/// The noise that a filter assumes; standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// Noise of an encoder's reading, rad; positive. Rounding to counts of q adds q / sqrt(12).
    pub encoder: f64,
    /// Noise of the torque held over a sample time, N m; not negative.
    pub torque: f64,
    /// Drift of each velocity, for errors of the model, rad/s per root of a second; not negative.
    pub drift: f64,
    /// Spread of angles (rad) and velocities (rad/s) at the start; positive.
    pub start: [f64; 2],
}

impl NoiseModel {
    fn check(&self) -> Result<()> {
        let positive = [
            ("the encoder noise", self.encoder, "positive and finite (in rad)"),
            (
                "the spread of angles at the start",
                self.start[0],
                "positive and finite (in rad)",
            ),
            (
                "the spread of velocities at the start",
                self.start[1],
                "positive and finite (in rad/s)",
            ),
        ];
        for (name, value, requirement) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::parameter(name, value, requirement));
            }
        }
        for (name, value) in [("the torque noise", self.torque), ("the drift", self.drift)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::parameter(name, value, "not negative and finite"));
            }
        }
        Ok(())
    }
}

/// How the covariance is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Prediction {
    Extended,
    Unscented,
}

/// A Kalman filter of the arm.
#[derive(Debug, Clone)]
pub struct KalmanFilter {
    model: Arm,
    noise: NoiseModel,
    prediction: Prediction,
    adaptation: Option<Adaptation>,
    belief: Gaussian,
    /// The normalised square of the last innovation.
    nis: f64,
    /// The normalised squares of error and innovation at every instant, if they are kept.
    kept: Option<Vec<[f64; 2]>>,
}

impl KalmanFilter {
    fn new(model: Arm, noise: NoiseModel, prediction: Prediction) -> Result<Self> {
        noise.check()?;
        Ok(KalmanFilter {
            model,
            noise,
            prediction,
            adaptation: None,
            belief: Gaussian {
                x: [0.0; 8],
                p: [[0.0; 8]; 8],
            },
            nis: f64::NAN,
            kept: None,
        })
    }

    /// The extended filter.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a noise outside its range.
    pub fn extended(model: Arm, noise: NoiseModel) -> Result<Self> {
        Self::new(model, noise, Prediction::Extended)
    }

    /// The unscented filter.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a noise outside its range.
    pub fn unscented(model: Arm, noise: NoiseModel) -> Result<Self> {
        Self::new(model, noise, Prediction::Unscented)
    }

    /// The filter with its process noise adapted by fuzzy rules.
    #[must_use]
    pub fn adaptive(self) -> Self {
        KalmanFilter {
            adaptation: Some(Adaptation::default()),
            ..self
        }
    }

    /// The filter, set to keep the normalised squares of its error and its innovation at every instant.
    #[must_use]
    pub fn judged(self) -> Self {
        KalmanFilter {
            kept: Some(Vec::new()),
            ..self
        }
    }

    /// NEES and NIS of every instant of the last run, if they were kept.
    pub fn kept(&self) -> &[[f64; 2]] {
        self.kept.as_deref().unwrap_or_default()
    }

    /// The estimated state.
    pub fn state(&self) -> State {
        State::from_array(self.belief.x)
    }

    /// Its covariance, in the order of [`State::to_array`].
    pub fn covariance(&self) -> &[[f64; 8]; 8] {
        &self.belief.p
    }

    /// The present factor on the process noise from the rules; 1 without them.
    pub fn factor(&self) -> f64 {
        self.adaptation.as_ref().map_or(1.0, Adaptation::factor)
    }

    /// Starts near a state.
    pub fn start(&mut self, near: &State) {
        let [angle, velocity] = self.noise.start;
        let mut p: Matrix8 = [[0.0; 8]; 8];
        for (i, row) in p.iter_mut().enumerate() {
            let spread = if i < 4 { angle } else { velocity };
            row[i] = spread * spread;
        }
        self.belief = Gaussian { x: near.to_array(), p };
        if let Some(adaptation) = &mut self.adaptation {
            *adaptation = Adaptation::default();
        }
        if let Some(kept) = &mut self.kept {
            kept.clear();
        }
    }

    /// Carries the state through a sample time under this torque.
    pub fn predict(&mut self, torque: [f64; 2], step: f64) {
        let factor = self.factor().sqrt();
        let noise = [factor * self.noise.torque, factor * self.noise.drift];
        let wide = || extended(&self.model, &self.belief, torque, step, noise);
        self.belief = match self.prediction {
            Prediction::Extended => wide(),
            Prediction::Unscented => unscented(&self.model, &self.belief, torque, step, noise).unwrap_or_else(wide),
        };
    }

    /// Takes the motors' encoders into account; returns the normalised square of the innovation, of two degrees of freedom.
    pub fn correct(&mut self, qm: [f64; 2]) -> f64 {
        let Gaussian { x, p } = &mut self.belief;
        let variance = self.noise.encoder * self.noise.encoder;
        self.nis = 0.0;
        for (i, reading) in qm.into_iter().enumerate() {
            let i = 2 + i;
            let s = p[i][i] + variance;
            let innovation = reading - x[i];
            self.nis += innovation * innovation / s;
            let row = p[i];
            for a in 0..8 {
                let gain = row[a] / s;
                x[a] += gain * innovation;
                for b in 0..8 {
                    p[a][b] -= gain * row[b];
                }
            }
        }
        // Keeps it symmetric despite rounding.
        for a in 0..8 {
            for b in 0..a {
                let middle = 0.5 * (p[a][b] + p[b][a]);
                (p[a][b], p[b][a]) = (middle, middle);
            }
        }
        if let Some(adaptation) = &mut self.adaptation {
            adaptation.learn(self.nis);
        }
        self.nis
    }

    /// The normalised square of the error against a true state, of eight degrees of freedom.
    pub fn nees(&self, truth: &State) -> f64 {
        let truth = truth.to_array();
        squared_distance(&self.belief.p, &std::array::from_fn(|i| self.belief.x[i] - truth[i]))
    }
}

impl Estimator for KalmanFilter {
    fn estimate(&mut self, moment: &Moment) -> State {
        match moment.step {
            None => self.start(&moment.start),
            Some(step) => self.predict(moment.torque, step),
        }
        self.correct(moment.encoders.qm);
        if self.kept.is_some() {
            let squares = [self.nees(&moment.truth), self.nis];
            self.kept.iter_mut().for_each(|kept| kept.push(squares));
        }
        self.state()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manipulator::{JointKind, space_arm};

    /// The covariance of the references below, in units of 1e-8.
    fn covariance() -> Matrix8 {
        let lower = [
            vec![43468],
            vec![-4680, 17791],
            vec![-3752, -2165, 36288],
            vec![-34895, -36595, 22530, 170_423],
            vec![-3301, 14756, -5121, -34626, 82937],
            vec![-1378, -14305, -404, 56678, -17613, 32473],
            vec![14534, -14825, -746, 973, 17419, -1336, 47276],
            vec![3506, -1535, -13612, -28684, -21646, -1757, 6074, 48629],
        ];
        std::array::from_fn(|i| std::array::from_fn(|j| 1e-8 * f64::from(lower[i.max(j)][i.min(j)])))
    }

    /// A filter's prediction from the state of the references below.
    fn predicted(made: fn(Arm, NoiseModel) -> Result<KalmanFilter>) -> Gaussian {
        let noise = NoiseModel {
            encoder: 1e-2,
            torque: 0.2,
            drift: 0.01,
            start: [1.0, 1.0],
        };
        let mut filter = made(Arm::new(space_arm(JointKind::Nonlinear)).unwrap(), noise).unwrap();
        filter.belief = Gaussian {
            x: [0.3, 1.0, 0.32, 0.97, 0.4, -0.3, 0.35, -0.2],
            p: covariance(),
        };
        filter.predict([3.0, -2.0], 0.01);
        filter.belief
    }

    /// scripts/reference/arm_control.py: FilterPy's prediction with the exact derivatives and SciPy's exponential. Ours has differences, and
    /// the exponential to the fourth order.
    #[test]
    fn the_extended_prediction_is_that_of_filterpy() {
        let diagonal = [
            0.000_433_766_998_810_4,
            0.000_171_213_850_936_63,
            0.000_343_275_946_090_43,
            0.001_598_106_103_969_49,
            0.000_985_261_868_736_77,
            0.002_498_754_346_679_7,
            0.023_807_202_399_915_66,
            0.065_927_473_300_520_6,
        ];
        let first = [
            4.337_669_988_103_980_3e-4,
            -4.559_255_564_961_742e-5,
            -2.456_328_186_332_923e-5,
            -3.450_047_327_199_698e-4,
            -5.776_359_622_696_356e-5,
            -1.066_809_819_680_812_2e-4,
            2.504_714_846_817_32e-3,
            1.606_069_717_019_386_5e-3,
        ];
        let p = predicted(KalmanFilter::extended).p;
        for i in 0..8 {
            assert!(
                (p[i][i] / diagonal[i] - 1.0).abs() < 1e-4,
                "{i}: {} {}",
                p[i][i],
                diagonal[i]
            );
            let scale = (diagonal[0] * diagonal[i]).sqrt();
            assert!(
                (p[0][i] - first[i]).abs() < 1e-4 * scale,
                "{i}: {} {}",
                p[0][i],
                first[i]
            );
        }
    }

    /// scripts/reference/arm_control.py: FilterPy's prediction through the same sigma points.
    #[test]
    fn the_unscented_prediction_is_that_of_filterpy() {
        let belief = predicted(KalmanFilter::unscented);
        let x = [
            0.304_029_059_647_281_05,
            0.996_874_969_417_076_7,
            0.323_156_497_410_320_04,
            0.968_615_386_633_302,
            0.405_758_976_215_084_8,
            -0.324_776_736_821_246_97,
            0.282_034_991_635_440_4,
            -0.078_349_929_035_859_19,
        ];
        let p = [
            0.000_433_767_497_601_63,
            0.000_171_177_322_827_14,
            0.000_343_377_961_796_04,
            0.001_597_701_885_500_66,
            0.000_986_851_605_894_92,
            0.002_519_842_499_522_17,
            0.023_594_934_822_710_9,
            0.066_547_753_414_626,
        ];
        for i in 0..8 {
            assert!((belief.x[i] - x[i]).abs() < 1e-10, "{i}");
            assert!((belief.p[i][i] / p[i] - 1.0).abs() < 1e-10, "{i}");
        }
    }

    /// scripts/reference/arm_control.py: FilterPy's correction with both readings at once.
    #[test]
    fn the_correction_is_that_of_filterpy() {
        let noise = NoiseModel {
            encoder: 1e-2,
            torque: 0.0,
            drift: 0.0,
            start: [1.0, 1.0],
        };
        let mut filter = KalmanFilter::extended(Arm::new(space_arm(JointKind::Nonlinear)).unwrap(), noise).unwrap();
        filter.belief.x = [0.2, -0.467, 0.236, 0.76, -1.649, 0.254, 1.225, -0.298];
        filter.belief.p = covariance();
        let nis = filter.correct([0.236 + 0.01, 0.76 - 0.02]);
        assert!((nis - 0.580_960_632_078_967_8).abs() < 1e-10, "{nis}");
        let x = [
            0.204_042_178_541_754_44,
            -0.462_252_142_596_503_43,
            0.243_125_341_594_639_8,
            0.741_467_473_957_714_7,
            -1.645_390_837_243_401_8,
            0.245_566_514_902_887_9,
            1.224_642_765_266_874_5,
            -0.297_703_682_721_067_34,
        ];
        let p = [
            3.671_064_466_319_901_5e-4,
            1.023_546_165_393_466e-4,
            7.699_806_666_261_18e-5,
            9.409_879_289_049_228e-5,
            7.627_711_201_752_318e-4,
            1.338_069_296_090_395e-4,
            4.725_344_241_148_165_5e-4,
            4.175_468_352_678_611_5e-4,
        ];
        for i in 0..8 {
            assert!((filter.belief.x[i] - x[i]).abs() < 1e-10, "{i}");
            assert!((filter.belief.p[i][i] / p[i] - 1.0).abs() < 1e-10, "{i}");
        }
    }

    #[test]
    fn noise_outside_its_range_is_refused() {
        let arm = Arm::new(space_arm(JointKind::Nonlinear)).unwrap();
        let noise = NoiseModel {
            encoder: 0.0,
            torque: 0.1,
            drift: 0.0,
            start: [1e-3, 1e-2],
        };
        assert!(
            KalmanFilter::unscented(arm, noise)
                .unwrap_err()
                .to_string()
                .contains("encoder noise")
        );
    }
}
