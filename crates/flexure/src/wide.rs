//! Inner loops with the widest registers that the processor has.
//!
//! The crate is compiled for every processor of its kind: on x86-64, for registers of two numbers. The code that [`widest`] calls is also
//! compiled for wider registers (AVX2, and AVX-512 as in Ice Lake), and the processor at run time decides which version is used. The
//! results are the same to the last bit: no operation is contracted or moved.

use fearless_simd::{Level, dispatch};

/// Calls `work`, compiled for the present processor. The closure must be marked `#[inline(always)]`. So must every function that it calls
/// and that is to be compiled in this way.
#[inline(always)]
pub(crate) fn widest<R>(work: impl FnOnce() -> R) -> R {
    dispatch!(Level::new(), _ => work())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums in lanes. Some operations could be contracted, and some could be made in another order.
    #[inline(always)]
    fn sums(x: &[f64]) -> [f64; 4] {
        let mut sums = [0.0; 4];
        for x in x.as_chunks::<4>().0 {
            for (sum, x) in sums.iter_mut().zip(x) {
                *sum = *sum * 0.999 + x * x / (1.0 + x.abs());
            }
        }
        sums
    }

    #[test]
    fn wide_registers_change_no_bit() {
        let x: Vec<f64> = (0..4003).map(|i| (i as f64 * 0.7).sin() * 10_f64.powi(i % 7)).collect();
        let plain = std::hint::black_box(sums as fn(&[f64]) -> [f64; 4])(&x);
        let wide = widest(
            #[inline(always)]
            || sums(&x),
        );
        assert_eq!(plain.map(f64::to_bits), wide.map(f64::to_bits));
    }
}
