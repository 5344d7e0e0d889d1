//! Inner loops with the widest registers that the processor has.
//!
//! The crate is compiled for every processor of its kind: on x86-64, for registers of two numbers. What [`widest`]
//! calls is compiled for wider ones as well, and the processor at hand tells which of these is taken. The results are
//! the same to the last bit: no operation is contracted or made in another order.

/// Calls `work`, compiled for the processor at hand. The closure must be marked `#[inline(always)]`, as must whatever
/// it calls that is to be compiled so.
#[inline(always)]
pub(crate) fn widest<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn of_four<R>(work: impl FnOnce() -> R) -> R {
            work()
        }

        #[target_feature(enable = "avx2,avx512f,avx512vl,avx512bw,avx512dq")]
        fn of_eight<R>(work: impl FnOnce() -> R) -> R {
            work()
        }

        use std::arch::is_x86_feature_detected as has;
        if has!("avx2") {
            #[expect(
                unsafe_code,
                reason = "called where the processor has just been asked for what they need"
            )]
            return match has!("avx512f") && has!("avx512vl") && has!("avx512bw") && has!("avx512dq") {
                // SAFETY: the processor has all that the function was compiled for.
                true => unsafe { of_eight(work) },
                // SAFETY: as above.
                false => unsafe { of_four(work) },
            };
        }
    }
    work()
}
