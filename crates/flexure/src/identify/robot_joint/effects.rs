//! Effects of a joint in addition to inertias, a spring without memory and friction at the link.
//!
//! Each effect is a group of columns of the equations of motor and link, or a further free curve:
//!
//! | effect | motor | link |
//! |---|---|---|
//! | late samples of the link, by sigma | $-\sigma\kappa'(d)\,\dot q$ | $-\sigma\kappa'(d)\,\dot q_m$ |
//! | damping of the joint | $c\,\dot d$ | $c\,\dot d$ |
//! | friction at the motor, a free curve | $f_m(\dot q_m)$ | |
//! | gravity | | $-g_c \cos q - g_s \sin q$ |
//! | a spring with memory | $\sum_i h_i\, S_{r_i}[d]$ | the same |
//! | friction with memory at the link | | $-\sum_i p_i\, (S_{r_i}[q] - r_i \tanh(\dot q / w))$ |
//!
//! $S_r$ is the stop operator of radius r, the spring of a Maxwell slip element: $S_r \leftarrow \mathrm{clamp}(S_r + \Delta x, -r, r)$
//! (Krasnosel'skii & Pokrovskii 1989; Lampaert, Al-Bender & Swevers 2003). The limit of friction with memory in steady motion belongs to
//! the friction curve, so this curve is the friction of steady motion. The columns of late samples are of first order; the link's column
//! follows from its equation, which holds at every time.

use super::basis::range;
use super::clocks::Stiffness;
use super::equations::{Column, Lines};
use super::joint_signals::{Acting, JointSignals, Velocity};
use super::limits::{
    RESOLVED, STEADY_WITHIN, STOP_RADII_OF_ANGLE, STOP_RADII_OF_DEFLECTION, STOPS_ABOVE_NOISE, TORQUE_RATE,
};
use super::motion::Motion;
use super::outcome::Effect;
use super::rests::{Rests, rests, silence};
use super::smooth::Reflected;
use crate::linalg::Complex;

impl<'a> JointSignals<'a> {
    /// The same with these effects on the joint of this log, whose link has this angle. Late samples of the link need a stiffness: without
    /// one they are left out.
    pub fn with(mut self, motion: &Motion, link: &[f64], effects: &[Effect], stiffness: Option<&Stiffness>) -> Self {
        let modulation = self.modulation;
        let motor_resolution = RESOLVED * motion.motor_noise.velocity_sd(motion.step);
        let rests = Rests::new(
            rests(
                &self.v_motor,
                motor_resolution,
                motion.motor_noise.cut_off(),
                motion.step,
            ),
            rests(&self.v, self.resolution, motion.link_noise.cut_off(), motion.step),
        );
        silence(&mut self.v_motor, &rests.0[0]);
        silence(&mut self.v, &rests.0[1]);
        self.resting = rests.columns(modulation, motion.torque, &self.deflection.d);
        let moving = Moving {
            signals: &self,
            rests: &rests,
            motion,
            link,
        };
        let acting = effects.iter().filter_map(|effect| moving.acting(*effect, stiffness));
        let acting: Vec<Acting> = acting.collect();
        self.acting.extend(acting);
        self.motor_velocity = effects.contains(&Effect::MotorFriction).then(|| Velocity {
            v: self.v_motor.clone(),
            resolution: motor_resolution,
        });
        self.rests = rests;
        self
    }

    /// The same with a further delay of the torque.
    pub fn delayed(mut self, motion: &Motion) -> Self {
        let rate = Reflected::new(motion.torque, motion.step).velocity(TORQUE_RATE / motion.step);
        let of_rate = self.modulation.of_rate(motion.torque);
        let [rate, _] = self.rests.without(self.modulation, &of_rate, &rate);
        self.acting.push(Acting {
            effect: None,
            columns: vec![vec![Some(rate), None]],
            signals: Vec::new(),
        });
        self
    }
}

/// A joint while its bodies move, of which the columns of its effects are made.
struct Moving<'b> {
    signals: &'b JointSignals<'b>,
    rests: &'b Rests,
    motion: &'b Motion<'b>,
    /// The link's angle.
    link: &'b [f64],
}

impl Moving<'_> {
    /// The columns of an effect; `None` for friction at the motor, which is a curve, and for late samples without a stiffness.
    fn acting(&self, effect: Effect, stiffness: Option<&Stiffness>) -> Option<Acting> {
        let JointSignals { v, deflection, .. } = self.signals;
        let (signals, columns) = match effect {
            Effect::MotorFriction => return None,
            Effect::EncoderSkew => (Vec::new(), vec![self.late(stiffness?)]),
            Effect::Damping => self.damping(),
            Effect::Gravity => {
                let of_angle = [f64::cos, f64::sin].map(|f| self.link.iter().map(|&q| f(q)).collect());
                self.columns(of_angle.into(), [0.0, -1.0])
            }
            Effect::HystereticSpring => {
                let noise = self.motion.motor_noise.sd.hypot(self.motion.link_noise.sd);
                let signals = stops(&deflection.d, &STOP_RADII_OF_DEFLECTION, noise).map(|(stop, _)| stop);
                self.columns(signals.collect(), [1.0, 1.0])
            }
            Effect::Presliding => {
                let width = STEADY_WITHIN * v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                let noise = self.motion.link_noise.sd;
                let signals = stops(self.link, &STOP_RADII_OF_ANGLE, noise).map(|(stop, radius)| {
                    let both = stop.iter().zip(v);
                    both.map(|(s, v)| s - radius * (v / width).tanh()).collect()
                });
                self.columns(signals.collect(), [0.0, -1.0])
            }
        };
        Some(Acting {
            effect: Some(effect),
            columns,
            signals,
        })
    }

    /// Signals, and their columns with these signs at motor and link.
    fn columns(&self, signals: Vec<Vec<f64>>, signs: [f64; 2]) -> (Vec<Vec<f64>>, Vec<Column>) {
        let modulation = self.signals.modulation;
        let column = |(lines, signal): (Lines, &Vec<f64>)| {
            let of_bodies = self.rests.without(modulation, &lines, signal).into_iter().zip(signs);
            of_bodies
                .map(|(lines, s)| (s != 0.0).then(|| times(&lines, s)))
                .collect()
        };
        let columns = modulation.of_all(&signals).into_iter().zip(&signals).map(column);
        let columns = columns.collect();
        (signals, columns)
    }

    /// The columns of samples of the link that are late by 1 s.
    fn late(&self, stiffness: &Stiffness) -> Column {
        let JointSignals {
            modulation,
            v,
            v_motor,
            deflection,
            ..
        } = self.signals;
        let slopes = stiffness.slopes(&deflection.d);
        let of_velocity = |v: &[f64]| {
            let torque: Vec<f64> = slopes.iter().zip(v).map(|(slope, v)| -slope * v).collect();
            self.rests.without(modulation, &modulation.of(&torque), &torque)
        };
        let ([motor, _], [_, link]) = (of_velocity(v), of_velocity(v_motor));
        vec![Some(motor), Some(link)]
    }

    /// The rate of the deflection, and its columns.
    fn damping(&self) -> (Vec<Vec<f64>>, Vec<Column>) {
        let JointSignals {
            modulation,
            v,
            v_motor,
            deflection,
            ..
        } = self.signals;
        let rate: Vec<f64> = v_motor.iter().zip(v).map(|(m, q)| m - q).collect();
        let of_bodies = self
            .rests
            .without(modulation, &modulation.of_rate(&deflection.d), &rate);
        (vec![rate], vec![of_bodies.map(Some).into()])
    }
}
/// The stop operator of this radius along a signal, from zero on.
pub(super) fn stop(x: &[f64], radius: f64) -> Vec<f64> {
    let (mut value, mut before) = (0.0, x.first().copied().unwrap_or(0.0));
    let stopped = x.iter().map(|&x| {
        value = (value + x - before).clamp(-radius, radius);
        before = x;
        value
    });
    stopped.collect()
}

/// The stop operators of a signal with noise of this standard deviation, with their radii: these shares of half its range.
fn stops<'x>(x: &'x [f64], shares: &'x [f64], noise: f64) -> impl Iterator<Item = (Vec<f64>, f64)> + 'x {
    radii(x, shares, noise).map(|radius| (stop(x, radius), radius))
}

/// The radii of stop operators of a signal with noise of this standard deviation.
pub(super) fn radii<'x>(x: &[f64], shares: &'x [f64], noise: f64) -> impl Iterator<Item = f64> + use<'x> {
    let [low, high] = range(x);
    let radii = shares.iter().map(move |share| share * 0.5 * (high - low));
    radii.filter(move |radius| *radius > STOPS_ABOVE_NOISE * noise)
}

fn times(lines: &[Complex<f64>], factor: f64) -> Lines {
    lines.iter().map(|v| v * factor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_operator_is_a_spring_until_it_yields() {
        let up_and_down = [0.0, 0.1, 0.2, 0.4, 0.3, 0.1, -0.4, -0.3];
        let stopped = stop(&up_and_down, 0.25);
        for (got, want) in stopped.iter().zip([0.0, 0.1, 0.2, 0.25, 0.15, -0.05, -0.25, -0.15]) {
            assert!((got - want).abs() < 1e-15, "{stopped:?}");
        }
        // It remembers every turn within its radius, and does not depend on the rate.
        let slowly: Vec<f64> = up_and_down
            .windows(2)
            .flat_map(|w| [w[0], 0.5 * (w[0] + w[1])])
            .collect();
        let slow = stop(&slowly, 0.25);
        assert!(slow.iter().step_by(2).zip(&stopped).all(|(a, b)| (a - b).abs() < 1e-15));
    }
}
