//! The numbers of the equations of motion: one number, or those of several arms in the lanes of a register.
//!
//! A formula over [`Number`] serves both. Every lane goes through the same operations as one number does, so that it has the same bits.

use std::ops::{Add, Div, Mul, Neg, Sub};

use fearless_simd::prelude::*;
use fearless_simd::{f64x8, u64x8};

/// The lanes of a register.
pub(crate) const LANES: usize = 8;

/// The numbers of [`LANES`] arms.
pub(crate) type Lanes<S> = f64x8<S>;

/// Registers so wide that lanes are worth their while. Narrower ones do as well with one arm after the other.
#[derive(Clone, Copy)]
pub(crate) enum Wide {
    /// Of eight numbers.
    #[cfg(target_arch = "x86_64")]
    Avx512(fearless_simd::x86::Avx512),
    /// Of four.
    #[cfg(target_arch = "x86_64")]
    Avx2(fearless_simd::x86::Avx2),
}

impl Wide {
    /// Those of the processor, the widest first.
    pub fn all() -> impl Iterator<Item = Wide> {
        #[cfg(target_arch = "x86_64")]
        {
            let level = fearless_simd::Level::new();
            let (most, half) = (level.as_avx512().map(Wide::Avx512), level.as_avx2().map(Wide::Avx2));
            most.into_iter().chain(half)
        }
        #[cfg(not(target_arch = "x86_64"))]
        std::iter::empty()
    }
}

/// One number, or several in lanes.
pub(crate) trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// `value` in every lane of a number like this one.
    fn filled(self, value: f64) -> Self;

    /// The number in the first lane.
    fn first(self) -> f64;

    /// Whether the number in every lane is positive.
    fn is_positive(self) -> bool;

    /// The magnitude.
    fn abs(self) -> Self;

    /// The larger one; the other if one is NaN.
    fn max(self, other: Self) -> Self;

    /// The nearest number from `low` to `high`; NaN stays.
    fn clamp(self, low: f64, high: f64) -> Self;

    /// This magnitude with the sign of another number.
    fn copysign(self, sign: Self) -> Self;

    /// The square root.
    fn sqrt(self) -> Self;

    /// The sine and the cosine of an angle, from those of its rest after this number of right angles, which the lowest bits of the mantissa
    /// are.
    fn turned(self, sin: Self, cos: Self) -> (Self, Self);

    /// `near`, or what `far` says of this number where its magnitude is not within `limit`.
    fn within(self, limit: f64, near: (Self, Self), far: fn(f64) -> (f64, f64)) -> (Self, Self);

    /// `2^k`, where the lowest bits of this number's mantissa are the integer k.
    fn power_of_two(self) -> Self;
}

/// The exponent of 1, and where an exponent begins.
const BIAS: u64 = 1023;
const MANTISSA: u32 = 52;

impl Number for f64 {
    #[inline(always)]
    fn filled(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn first(self) -> f64 {
        self
    }

    #[inline(always)]
    fn is_positive(self) -> bool {
        self > 0.0
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        f64::max(self, other)
    }

    #[inline(always)]
    fn clamp(self, low: f64, high: f64) -> Self {
        f64::clamp(self, low, high)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f64::copysign(self, sign)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn turned(self, sin: Self, cos: Self) -> (Self, Self) {
        let turns = self.to_bits();
        let (sin, cos) = if turns & 1 == 0 { (sin, cos) } else { (cos, sin) };
        let signed = |x: f64, turns: u64| f64::from_bits(x.to_bits() ^ ((turns & 2) << 62));
        (signed(sin, turns), signed(cos, turns.wrapping_add(1)))
    }

    #[inline(always)]
    fn within(self, limit: f64, near: (Self, Self), far: fn(f64) -> (f64, f64)) -> (Self, Self) {
        if self.abs() <= limit { near } else { far(self) }
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        f64::from_bits(self.to_bits().wrapping_add(BIAS) << MANTISSA)
    }
}

impl<S: Simd> Number for Lanes<S> {
    #[inline(always)]
    fn filled(self, value: f64) -> Self {
        SimdBase::splat(self.simd, value)
    }

    #[inline(always)]
    fn first(self) -> f64 {
        self[0]
    }

    #[inline(always)]
    fn is_positive(self) -> bool {
        self.simd_gt(0.0).all_true()
    }

    #[inline(always)]
    fn abs(self) -> Self {
        SimdBase::abs(self)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.max_precise(other)
    }

    #[inline(always)]
    fn clamp(self, low: f64, high: f64) -> Self {
        let least = self.simd_lt(low).select(Number::filled(self, low), self);
        least.simd_gt(high).select(Number::filled(self, high), least)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        SimdFloat::copysign(self, sign)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        SimdFloat::sqrt(self)
    }

    #[inline(always)]
    fn turned(self, sin: Self, cos: Self) -> (Self, Self) {
        let turns: u64x8<S> = self.to_bits();
        let even = (turns & 1).simd_eq(0);
        let (x, y) = (even.select(sin, cos), even.select(cos, sin));
        let (x, y): (u64x8<S>, u64x8<S>) = (x.to_bits(), y.to_bits());
        let sin = x ^ ((turns & 2) << 62);
        let cos = y ^ (((turns + 1) & 2) << 62);
        (Self::from_bits(sin), Self::from_bits(cos))
    }

    #[inline(always)]
    fn within(self, limit: f64, near: (Self, Self), far: fn(f64) -> (f64, f64)) -> (Self, Self) {
        let (mut sin, mut cos) = near;
        if !SimdBase::abs(self).simd_le(limit).all_true() {
            for lane in 0..LANES {
                (sin[lane], cos[lane]) = self[lane].within(limit, (sin[lane], cos[lane]), far);
            }
        }
        (sin, cos)
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        let bits: u64x8<S> = self.to_bits();
        Self::from_bits((bits + BIAS) << MANTISSA)
    }
}
