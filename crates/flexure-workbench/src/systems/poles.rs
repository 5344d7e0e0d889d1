//! Poles by their effect in time: natural frequency and damping of a pair, time constant of a real pole.
//!
//! A pole z of a system with the sample time T is the sampled pole $s = \log(z)/T$ of a continuous one. A pair has the natural
//! frequency $|s|/2\pi$ and the damping $-\Re(s)/|s|$, a real pole between 0 and 1 the time constant $-1/s$.

use flexure::identify::result::{LinearBlock, PoleCovariance};
use flexure::linear::Complex;
use flexure::text::{number, with_error};

use crate::lines::unbroken;

/// A pole this near to 1 is that of an integrator; the difference is rounding.
const INTEGRATOR: f64 = 1e-9;

/// The remark on a pole outside of the unit circle.
pub const UNSTABLE: &str = " (unstable)";

/// The text if there are no roots.
pub const NONE: &str = "none";

/// Poles for reading, slowest first, a conjugate pair once, with standard errors where they are known; frequencies in cycles a sample without a
/// sample time.
pub fn poles_text(block: &LinearBlock, sample_time: Option<f64>) -> String {
    listed(block.system.poles(), sample_time, |z| block.pole_covariance(z))
}

fn listed(
    list: Option<Vec<Complex<f64>>>,
    sample_time: Option<f64>,
    covariance: impl Fn(Complex<f64>) -> Option<PoleCovariance>,
) -> String {
    let Some(mut list) = list else {
        return "not found".to_owned();
    };
    list.retain(|z| z.im >= 0.0);
    list.sort_by(|a, b| (a.ln().norm()).total_cmp(&b.ln().norm()));
    let text = |&z: &Complex<f64>| unbroken(&pole_text(z, sample_time, covariance(z)));
    let each: Vec<String> = list.iter().map(text).collect();
    match each.is_empty() {
        true => NONE.to_owned(),
        false => each.join(", "),
    }
}

/// Whether the standard error of ln z is smaller than ln z itself. Otherwise neither time constant nor frequency is known.
pub fn is_determined(z: Complex<f64>, covariance: &PoleCovariance) -> bool {
    (covariance.real + covariance.imaginary).max(0.0).sqrt() < z.norm() * z.ln().norm()
}

/// The standard error of a function of a pole with these derivatives with respect to its real and its imaginary part; 0 where it is not known.
fn propagated(covariance: Option<PoleCovariance>, [re, im]: [f64; 2]) -> f64 {
    let variance = |c: PoleCovariance| re * re * c.real + 2.0 * re * im * c.both + im * im * c.imaginary;
    covariance.map_or(0.0, |c| variance(c).max(0.0).sqrt())
}

/// One pole, or a pair by the one of positive imaginary part.
fn pole_text(z: Complex<f64>, sample_time: Option<f64>, covariance: Option<PoleCovariance>) -> String {
    let step = sample_time.unwrap_or(1.0);
    let determined = covariance.filter(|c| is_determined(z, c));
    let remark = match z.norm() > 1.0 + INTEGRATOR {
        _ if covariance.is_some() && determined.is_none() => " (not determined)",
        true => UNSTABLE,
        false => "",
    };
    let covariance = determined;
    if z.im > 0.0 {
        let s = z.ln() / step;
        let unit = if sample_time.is_some() { "Hz" } else { "cycles/sample" };
        // ds = dz / (z T), and d|s| = Re(s* ds) / |s|.
        let slopes: [Complex<f64>; 2] = [Complex::<f64>::ONE, Complex::I].map(|dz| dz / (z * step));
        let of_size = slopes.map(|ds| (s.conj() * ds).re / s.norm());
        let of_damping = [0, 1].map(|i| (-slopes[i].re + s.re / s.norm() * of_size[i]) / s.norm());
        let frequency = with_error(
            s.norm() / std::f64::consts::TAU,
            propagated(covariance, of_size) / std::f64::consts::TAU,
        );
        let damping = match propagated(covariance, of_damping) {
            error if error > 0.0 => with_error(-s.re / s.norm(), error),
            _ => format!("{:.3}", -s.re / s.norm()),
        };
        return format!("{frequency} {unit} with damping {damping}{remark}");
    }
    match z.re {
        r if (r - 1.0).abs() <= INTEGRATOR => "an integrator".to_owned(),
        r if r > 0.0 => {
            let unit = if sample_time.is_some() { "s" } else { "samples" };
            let slope = step / (r * r.ln().powi(2));
            let constant = with_error((step / r.ln()).abs(), propagated(covariance, [slope, 0.0]));
            format!("time constant {constant} {unit}{remark}")
        }
        0.0 => "0".to_owned(),
        r => format!("{} (alternates from sample to sample){remark}", number(r)),
    }
}

/// Roots for reading without conversion, a conjugate pair once.
pub fn roots_text(list: Option<Vec<Complex<f64>>>) -> String {
    let Some(list) = list else {
        return "not found".to_owned();
    };
    let each = list.iter().filter(|z| z.im >= 0.0).map(|z| match z.im {
        im if im > 0.0 => unbroken(&format!("{} + {}i and conjugate", number(z.re), number(im))),
        _ => number(z.re),
    });
    let each: Vec<String> = each.collect();
    match each.is_empty() {
        true => NONE.to_owned(),
        false => each.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn z(re: f64, im: f64) -> Complex<f64> {
        Complex::new(re, im)
    }

    fn text(list: &[Complex<f64>], sample_time: Option<f64>) -> String {
        listed(Some(list.to_vec()), sample_time, |_| None).replace('\u{a0}', " ")
    }

    #[test]
    fn a_sampled_oscillator_has_its_frequency_and_damping() {
        // s^2 + 2 d w s + w^2 = 0 with w = 2 pi 3 Hz, d = 0.2, sampled every 10 ms.
        let (w, d, step) = (TAU * 3.0, 0.2_f64, 0.01);
        let s = z(-d * w, w * (1.0 - d * d).sqrt());
        let pair = [(s * step).exp(), (s.conj() * step).exp()];
        assert_eq!(text(&pair, Some(step)), "3.000 Hz with damping 0.200");
        assert_eq!(text(&pair, None), "0.03000 cycles/sample with damping 0.200");
    }

    #[test]
    fn real_poles_have_time_constants_slowest_first() {
        // Time constants of 0.05 s and 2 s, sampled every 0.1 s.
        let list = [z((-2.0_f64).exp(), 0.0), z((-0.05_f64).exp(), 0.0), z(1.0, 0.0)];
        assert_eq!(
            text(&list, Some(0.1)),
            "an integrator, time constant 2.000 s, time constant 0.05000 s"
        );
        assert_eq!(text(&list[..1], None), "time constant 0.5000 samples");
        assert_eq!(
            text(&[z(-0.5, 0.0)], None),
            "-0.5000 (alternates from sample to sample)"
        );
        assert_eq!(text(&[z(1.5, 0.0)], None), "time constant 2.466 samples (unstable)");
        assert_eq!(text(&[z(0.0, 0.0)], None), "0");
        assert!(text(&[z(0.0, 1.1), z(0.0, -1.1)], None).ends_with("damping -0.061 (unstable)"));
        assert_eq!(
            (text(&[], None), listed(None, None, |_| None)),
            ("none".to_owned(), "not found".to_owned())
        );
    }

    /// Against differences of the formulas in the head of this file.
    #[test]
    fn errors_of_poles_become_those_of_time_constant_frequency_and_damping() {
        let covariance = PoleCovariance {
            real: 1e-6,
            both: 3e-7,
            imaginary: 4e-6,
        };
        let error = |z: Complex<f64>, of: &dyn Fn(Complex<f64>) -> f64| {
            let h = 1e-6;
            let slope = |dz: Complex<f64>| (of(z + dz * h) - of(z - dz * h)) / (2.0 * h);
            propagated(Some(covariance), [slope(Complex::ONE), slope(Complex::I)])
        };
        let (step, real, pair) = (0.1, z(0.9, 0.0), z(0.8, 0.4));
        let s = |z: Complex<f64>| z.ln() / step;
        let constant = with_error(-1.0 / s(real).re, error(real, &|z| -1.0 / s(z).re));
        let frequency = with_error(s(pair).norm() / TAU, error(pair, &|z| s(z).norm() / TAU));
        let damping = with_error(-s(pair).re / s(pair).norm(), error(pair, &|z| -s(z).re / s(z).norm()));
        let text = |z| pole_text(z, Some(step), Some(covariance));
        assert_eq!(text(real), format!("time constant {constant} s"));
        assert_eq!(text(pair), format!("{frequency} Hz with damping {damping}"));
        // With an error as large as ln z, nothing else can be said.
        let wide = PoleCovariance {
            real: 0.04,
            ..covariance
        };
        assert_eq!(
            pole_text(real, Some(step), Some(wide)),
            "time constant 0.9491 s (not determined)"
        );
    }

    #[test]
    fn roots_of_a_pair_stand_once() {
        assert_eq!(roots_text(None), "not found");
        assert_eq!(roots_text(Some(Vec::new())), "none");
        let list = vec![z(0.5, 0.25), z(0.5, -0.25), z(-2.0, 0.0)];
        assert_eq!(
            roots_text(Some(list)),
            "0.5000\u{a0}+\u{a0}0.2500i\u{a0}and\u{a0}conjugate, -2.000"
        );
    }
}
