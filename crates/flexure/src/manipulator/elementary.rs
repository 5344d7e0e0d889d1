//! `tanh` and `exp` of several arguments at once, sine and cosine: the main cost of a simulated joint.
//!
//! All arguments go through the same branch-free arithmetic, so that the compiler uses vector
//! instructions. With \\(x = k \ln 2 + r\\), \\(|r| \le \tfrac12 \ln 2\\),
//! \\(e^x = 2^k + 2^k (e^r - 1)\\), where \\(e^r - 1\\) is a polynomial (Taylor's series to
//! \\(r^{13}\\), remainder below 2e-17 of it), and \\(\tanh x = m / (m + 2)\\) with
//! \\(m = e^{2x} - 1\\) computed without cancellation. Errors are a few units in the last place.

use crate::number::Number;

/// 1.5 * 2^52: adding it rounds a small number to an integer, held in the lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, the first of them short enough for exact products with small integers.
const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Half of pi in three parts, the first two of them short enough for exact products with integers of 20 bits.
const RIGHT_ANGLE: [f64; 3] = [
    f64::from_bits(0x3FF9_21FB_5440_0000),
    f64::from_bits(0x3DD0_B461_1A60_0000),
    f64::from_bits(0x3BA3_198A_2E03_7073),
];
/// The largest angle that these parts are enough for.
const FARTHEST: f64 = 1e6;

/// e^x in two parts, for `x = k ln 2 + r`.
struct SplitExp<T> {
    /// `2^k`
    power: T,
    /// `e^r - 1`
    rest: T,
}

/// `even + odd r`.
#[inline(always)]
fn pair<T: Number>(r: T, even: f64, odd: f64) -> T {
    r * odd + even
}

/// e^x for `x` within -700 .. 700 or NaN.
#[inline(always)]
fn split_exp<T: Number>(x: T) -> SplitExp<T> {
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (x - k * LN2_HIGH) - k * LN2_LOW;
    // Estrin's scheme: short chains of dependent operations.
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = pair(r, 1.0 / 2.0, 1.0 / 6.0) + r2 * pair(r, 1.0 / 24.0, 1.0 / 120.0);
    let middle = pair(r, 1.0 / 720.0, 1.0 / 5040.0) + r2 * pair(r, 1.0 / 40_320.0, 1.0 / 362_880.0);
    let high =
        pair(r, 1.0 / 3_628_800.0, 1.0 / 39_916_800.0) + r2 * pair(r, 1.0 / 479_001_600.0, 1.0 / 6_227_020_800.0);
    let tail = low + r4 * (middle + r4 * high);
    SplitExp {
        power: shifted.power_of_two(),
        rest: r + r2 * tail,
    }
}

/// `tanh` of every argument.
#[inline(always)]
pub fn tanh<T: Number, const N: usize>(mut x: [T; N]) -> [T; N] {
    for x in &mut x {
        // Beyond 20 the result is 1 to the last bit.
        let SplitExp { power, rest } = split_exp(x.abs().clamp(0.0, 20.0) * 2.0);
        let m = power * rest + (power - 1.0);
        *x = (m / (m + 2.0)).copysign(*x);
    }
    x
}

/// `exp` of every argument; none is positive. Below -700 it is `exp(-700)`, 1e-304.
#[inline(always)]
pub fn exp_nonpositive<T: Number, const N: usize>(mut x: [T; N]) -> [T; N] {
    for x in &mut x {
        let SplitExp { power, rest } = split_exp(x.clamp(-700.0, 0.0));
        *x = power * rest + power;
    }
    x
}

/// Sine and cosine.
///
/// The angle is a number of right angles and a rest of at most an eighth of a turn, to about twice the precision of a number. The rest goes
/// through Taylor's series to \\(r^{17}\\), remainder below 1e-18. Angles beyond a million, which no joint has, go to the system's library.
#[inline(always)]
pub fn sin_cos<T: Number>(x: T) -> (T, T) {
    let shifted = x * std::f64::consts::FRAC_2_PI + ROUND;
    let k = shifted - ROUND;
    // All but the last of these differences and products are exact; `left` is what is lost to rounding.
    let (most, next) = (x - k * RIGHT_ANGLE[0], k * RIGHT_ANGLE[1]);
    let near = most - next;
    let last = k * RIGHT_ANGLE[2];
    let r = near - last;
    let left = ((most - near) - next) + ((near - r) - last);
    let r2 = r * r;
    let r4 = r2 * r2;
    let r8 = r4 * r4;
    let odd = pair(r2, -1.0 / 6.0, 1.0 / 120.0) + r4 * pair(r2, -1.0 / 5040.0, 1.0 / 362_880.0);
    let odd_high = pair(r2, -1.0 / 39_916_800.0, 1.0 / 6_227_020_800.0)
        + r4 * pair(r2, -1.0 / 1_307_674_368_000.0, 1.0 / 355_687_428_096_000.0);
    let even = pair(r2, 1.0 / 24.0, -1.0 / 720.0) + r4 * pair(r2, 1.0 / 40_320.0, -1.0 / 3_628_800.0);
    let even_high = pair(r2, 1.0 / 479_001_600.0, -1.0 / 87_178_291_200.0) + r4 * (1.0 / 20_922_789_888_000.0);
    let half = r2 * 0.5;
    let main = -half + 1.0;
    let sin = r + (r * r2 * (odd + r8 * odd_high) + left * main);
    let cos = main + (((-main + 1.0) - half) + (r4 * (even + r8 * even_high) - r * left));
    x.within(FARTHEST, shifted.turned(sin, cos), f64::sin_cos)
}

#[cfg(test)]
mod tests {
    use fearless_simd::prelude::*;
    use fearless_simd::{Level, Simd, dispatch};

    use super::*;
    use crate::number::{LANES, Lanes};

    /// Arguments over many magnitudes and a dense middle, of both signs.
    fn arguments() -> Vec<f64> {
        let mut all = vec![0.0, 1e-300, 1e-9, 18.9, 19.1, 25.0, 1e5, f64::MAX];
        all.extend((0..200_000).map(|i| i as f64 * 1.3e-4));
        let negative: Vec<f64> = all.iter().map(|x| -x).collect();
        all.extend(negative);
        all
    }

    #[test]
    fn tanh_is_right_to_a_few_units_in_the_last_place() {
        for x in arguments() {
            let ([got], expected) = (tanh([x]), x.tanh());
            assert!(
                (got - expected).abs() <= 1e-15 * expected.abs(),
                "{x}: {got} {expected}"
            );
            assert_eq!(got, -tanh([-x])[0], "odd at {x}");
        }
        assert!(tanh([f64::NAN])[0].is_nan());
        assert_eq!(tanh([f64::INFINITY]), [1.0]);
    }

    #[test]
    fn exp_is_right_to_a_few_units_in_the_last_place() {
        for x in arguments().into_iter().filter(|x| *x <= 0.0 && *x >= -700.0) {
            let ([got], expected) = (exp_nonpositive([x]), x.exp());
            assert!((got - expected).abs() <= 5e-16 * expected, "{x}: {got} {expected}");
        }
        assert!(exp_nonpositive([-1e9])[0] < 1e-300);
        assert!(exp_nonpositive([f64::NAN])[0].is_nan());
    }

    #[test]
    fn sine_and_cosine_are_right_to_a_few_units_in_the_last_place() {
        let right_angles = (0..600_000).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_2);
        let far = [1e6, 1.1e6, -3e9, f64::MAX];
        for x in arguments().into_iter().chain(right_angles).chain(far) {
            let ((sin, cos), (s, c)) = (sin_cos(x), x.sin_cos());
            assert!((sin - s).abs() <= 4e-16 * s.abs(), "{x}: {sin} {s}");
            assert!((cos - c).abs() <= 4e-16 * c.abs(), "{x}: {cos} {c}");
        }
        for x in [f64::NAN, f64::INFINITY] {
            assert!(sin_cos(x).0.is_nan() && sin_cos(x).1.is_nan());
        }
    }

    #[inline(always)]
    fn all<T: Number>(x: T) -> [T; 4] {
        let (sin, cos) = sin_cos(x);
        let ([tanh], [exp]) = (tanh([x]), exp_nonpositive([x]));
        [sin, cos, tanh, exp]
    }

    #[inline(always)]
    fn all_in_lanes<S: Simd>(simd: S, x: &[f64; LANES]) -> [[f64; LANES]; 4] {
        all(Lanes::from_fn(simd, |lane| x[lane])).map(|lanes| *lanes)
    }

    #[test]
    fn lanes_have_the_bits_of_single_numbers() {
        let mut arguments = arguments();
        arguments.extend([f64::NAN, f64::INFINITY, 1e9, f64::NEG_INFINITY]);
        for x in arguments.as_chunks::<LANES>().0 {
            let lanes = dispatch!(Level::new(), simd => all_in_lanes(simd, x));
            for (lane, &x) in x.iter().enumerate() {
                let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
                for (lanes, single) in lanes.iter().zip(all(x)) {
                    assert!(same(lanes[lane], single), "{x}: {} {single}", lanes[lane]);
                }
            }
        }
    }
}
