//! Work compiled once for each vector width and run at the widest that this processor has.

/// A piece of work that [`widest`] runs.
///
/// `run` and everything it is to take along must be `#[inline(always)]`: only what is inlined is compiled for the wider
/// vectors. The compiler keeps every IEEE operation and their order (it neither reassociates nor fuses), so all widths give
/// the same bits.
pub trait Wide {
    /// What the work gives.
    type Output;
    /// Does it.
    fn run(self) -> Self::Output;
}

/// Runs `work` compiled for the widest vectors that this processor has.
#[inline]
pub fn widest<W: Wide>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,bmi1,bmi2,lzcnt,popcnt")]
        fn avx512<W: Wide>(work: W) -> W::Output {
            work.run()
        }
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
        fn avx2<W: Wide>(work: W) -> W::Output {
            work.run()
        }
        let small = is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        if small
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
        {
            // SAFETY: the function is safe but for needing the processor features just detected.
            #[allow(unsafe_code, reason = "calling a function compiled for features that were detected")]
            return unsafe { avx512(work) };
        }
        if small && is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            #[allow(unsafe_code, reason = "calling a function compiled for features that were detected")]
            return unsafe { avx2(work) };
        }
    }
    work.run()
}
