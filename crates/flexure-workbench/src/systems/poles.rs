//! Poles by their effect in time: natural frequency and damping of a pair, time constant of a real pole.
//!
//! A pole z of a system with the sample time T is the sampled pole $s = \log(z)/T$ of a continuous one. A pair has the natural
//! frequency $|s|/2\pi$ and the damping $-\Re(s)/|s|$, a real pole between 0 and 1 the time constant $-1/s$.

use flexure::linear::Complex;
use flexure::text::number;

use crate::lines::unbroken;

/// A pole this near to 1 is that of an integrator; the difference is rounding.
const INTEGRATOR: f64 = 1e-9;

/// The text if there are no roots.
pub const NONE: &str = "none";

/// Poles for reading, slowest first, a conjugate pair once; frequencies in cycles a sample without a sample time.
pub fn poles_text(list: Option<Vec<Complex<f64>>>, sample_time: Option<f64>) -> String {
    let Some(mut list) = list else {
        return "not found".to_owned();
    };
    list.retain(|z| z.im >= 0.0);
    list.sort_by(|a, b| (a.ln().norm()).total_cmp(&b.ln().norm()));
    let each: Vec<String> = list.iter().map(|&z| unbroken(&pole_text(z, sample_time))).collect();
    match each.is_empty() {
        true => NONE.to_owned(),
        false => each.join(", "),
    }
}

/// One pole, or a pair by the one of positive imaginary part.
fn pole_text(z: Complex<f64>, sample_time: Option<f64>) -> String {
    let step = sample_time.unwrap_or(1.0);
    let unstable = if z.norm() > 1.0 + INTEGRATOR { " (unstable)" } else { "" };
    if z.im > 0.0 {
        let s = z.ln() / step;
        let unit = if sample_time.is_some() { "Hz" } else { "cycles/sample" };
        let frequency = number(s.norm() / std::f64::consts::TAU);
        return format!("{frequency} {unit} with damping {:.3}{unstable}", -s.re / s.norm());
    }
    match z.re {
        r if (r - 1.0).abs() <= INTEGRATOR => "an integrator".to_owned(),
        r if r > 0.0 => {
            let unit = if sample_time.is_some() { "s" } else { "samples" };
            let constant = number((step / r.ln()).abs());
            format!("time constant {constant} {unit}{unstable}")
        }
        0.0 => "0".to_owned(),
        r => format!("{} (alternates from sample to sample){unstable}", number(r)),
    }
}

/// Roots for reading without conversion, a conjugate pair once.
pub fn roots_text(list: Option<Vec<Complex<f64>>>) -> String {
    let Some(list) = list else {
        return "not found".to_owned();
    };
    let each = list.iter().filter(|z| z.im >= 0.0).map(|z| match z.im {
        im if im > 0.0 => unbroken(&format!("{} ± {}i", number(z.re), number(im))),
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
        poles_text(Some(list.to_vec()), sample_time).replace('\u{a0}', " ")
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
            (text(&[], None), poles_text(None, None)),
            ("none".to_owned(), "not found".to_owned())
        );
    }

    #[test]
    fn roots_of_a_pair_stand_once() {
        assert_eq!(roots_text(None), "not found");
        assert_eq!(roots_text(Some(Vec::new())), "none");
        let list = vec![z(0.5, 0.25), z(0.5, -0.25), z(-2.0, 0.0)];
        assert_eq!(roots_text(Some(list)), "0.5000\u{a0}±\u{a0}0.2500i, -2.000");
    }
}
