//! `tanh` and `exp` of several arguments at once: the main cost of a simulated joint.
//!
//! All lanes go through the same branch-free arithmetic, so that the compiler uses vector
//! instructions. With \\(x = k \ln 2 + r\\), \\(|r| \le \tfrac12 \ln 2\\),
//! \\(e^x = 2^k + 2^k (e^r - 1)\\), where \\(e^r - 1\\) is a polynomial (Taylor's series to
//! \\(r^{13}\\), remainder below 2e-17 of it), and \\(\tanh x = m / (m + 2)\\) with
//! \\(m = e^{2x} - 1\\) computed without cancellation. Errors are a few units in the last place.

/// 1.5 * 2^52: adding it rounds a small number to an integer, held in the lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, the first of them short enough for exact products with small integers.
const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// e^x in two parts, for `x = k ln 2 + r`.
struct SplitExp {
    /// `2^k`
    power: f64,
    /// `e^r - 1`
    rest: f64,
}

/// e^x for `x` within -700 .. 700 or NaN.
#[inline(always)]
fn split_exp(x: f64) -> SplitExp {
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (x - k * LN2_HIGH) - k * LN2_LOW;
    let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    // Estrin's scheme: short chains of dependent operations.
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = (1.0 / 2.0 + r * (1.0 / 6.0)) + r2 * (1.0 / 24.0 + r * (1.0 / 120.0));
    let middle = (1.0 / 720.0 + r * (1.0 / 5040.0)) + r2 * (1.0 / 40_320.0 + r * (1.0 / 362_880.0));
    let high =
        (1.0 / 3_628_800.0 + r * (1.0 / 39_916_800.0)) + r2 * (1.0 / 479_001_600.0 + r * (1.0 / 6_227_020_800.0));
    let tail = low + r4 * (middle + r4 * high);
    SplitExp {
        power,
        rest: r + r2 * tail,
    }
}

/// `tanh` of every lane.
#[inline(always)]
pub fn tanh<const N: usize>(x: [f64; N]) -> [f64; N] {
    // Beyond 20 the result is 1 to the last bit.
    x.map(|x| {
        let SplitExp { power, rest } = split_exp(2.0 * x.abs().clamp(0.0, 20.0));
        let m = power * rest + (power - 1.0);
        (m / (m + 2.0)).copysign(x)
    })
}

/// `exp` of every lane, for arguments that are not positive; below -700 it is `exp(-700)`, 1e-304.
#[inline(always)]
pub fn exp_nonpositive<const N: usize>(x: [f64; N]) -> [f64; N] {
    x.map(|x| {
        let SplitExp { power, rest } = split_exp(x.clamp(-700.0, 0.0));
        power * rest + power
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
