//! Kernels: the same work compiled for several widths of vectors.

use std::fmt;
use std::sync::OnceLock;

/// Which instructions ray queries and the loops around them are made of. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// What every processor of the target has: the reference.
    Scalar,
    /// Loops over lanes compiled for 256-bit vectors.
    Avx2,
    /// The same for 512-bit vectors, and packets in these registers.
    Avx512,
}

impl Kernel {
    /// All kernels, narrowest first.
    pub const ALL: [Self; 3] = [Self::Scalar, Self::Avx2, Self::Avx512];

    /// The widest that this processor can run.
    pub fn detected() -> Self {
        static DETECTED: OnceLock<Kernel> = OnceLock::new();
        *DETECTED.get_or_init(|| *Self::available().last().expect("every processor runs the reference"))
    }

    /// Those that this processor can run, narrowest first.
    pub fn available() -> Vec<Self> {
        Self::ALL.into_iter().filter(|kernel| kernel.is_available()).collect()
    }

    /// Whether this processor can run it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 | Self::Avx512 => {
                let small = is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("avx2");
                let wide = is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq");
                small && (wide || self == Self::Avx2)
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The word on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// The kernel of that name.
    ///
    /// # Errors
    /// What was expected and found, where there is none or this processor cannot run it.
    pub fn parse(name: &str) -> Result<Self, String> {
        let list = |kernels: &[Self]| kernels.iter().map(|kernel| kernel.name()).collect::<Vec<_>>().join(", ");
        match Self::ALL.into_iter().find(|kernel| kernel.name() == name) {
            None => Err(format!("expected one of {}, found \"{name}\"", list(&Self::ALL))),
            Some(kernel) if !kernel.is_available() => {
                Err(format!("expected what this processor can run: {}, found \"{name}\"", list(&Self::available())))
            }
            Some(kernel) => Ok(kernel),
        }
    }

    /// Runs `work` compiled for this kernel's vectors; as it is where the processor does not have them.
    #[inline]
    pub fn run<W: Wide>(self, work: W) -> W::Output {
        #[cfg(target_arch = "x86_64")]
        if self <= Self::detected() {
            match self {
                Self::Scalar => {}
                Self::Avx2 => {
                    // SAFETY: the function is safe but for needing the processor features just detected.
                    #[allow(unsafe_code, reason = "calling a function compiled for features that were detected")]
                    return unsafe { avx2(work) };
                }
                Self::Avx512 => {
                    // SAFETY: as above.
                    #[allow(unsafe_code, reason = "calling a function compiled for features that were detected")]
                    return unsafe { avx512(work) };
                }
            }
        }
        work.run()
    }
}

impl PartialOrd for Kernel {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some((*self as u8).cmp(&(*other as u8)))
    }
}

impl fmt::Display for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A piece of work that [`Kernel::run`] runs.
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

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,bmi1,bmi2,lzcnt,popcnt")]
fn avx512<W: Wide>(work: W) -> W::Output {
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn avx2<W: Wide>(work: W) -> W::Output {
    work.run()
}
