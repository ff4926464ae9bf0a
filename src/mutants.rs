//! Planted bugs: mistakes that people make in samplers, estimators and statistics, each of which a check must catch.
//!
//! They exist behind the cargo feature `mutants` alone. Without it [`planted`] is the constant `false`, so the code of a
//! mistake is compiled away; with it one of them is on at a time, and `sampler-lab check --mutant NAME` is expected to fail.
//!
//! A mutant stands where the mistake would be made, as `if planted(Mutant::Name) { wrong } else { right }`.

macro_rules! mutants {
    ($($variant:ident = $name:literal in $room:literal: $mistake:literal, caught by $check:literal;)+) => {
        /// A mistake that can be planted.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Mutant { $(#[doc = $mistake] $variant),+ }

        impl Mutant {
            /// All of them, in the order of their declaration.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The name under which it is planted.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }

            /// The room of the house in which it stands.
            pub fn room(self) -> &'static str {
                match self { $(Self::$variant => $room),+ }
            }

            /// What is done wrong.
            pub fn mistake(self) -> &'static str {
                match self { $(Self::$variant => $mistake),+ }
            }

            /// The cheapest check that catches it.
            pub fn caught_by(self) -> &'static str {
                match self { $(Self::$variant => $check),+ }
            }
        }
    };
}

mutants! {
    DiskWithoutRoot = "disk-without-root" in "sampling": "a point of the lens at radius u in place of √u", caught by "disk-moments";
    TriangleWithoutRoot = "triangle-without-root" in "sampling": "barycentric weights from u in place of √u", caught by "quick-lights";
    ShuffleForgotten = "shuffle-forgotten" in "sampling": "strata of all decisions in step: the index order is never shuffled", caught by "quick-pairing";
    ShuffleShared = "shuffle-shared" in "sampling": "one shuffle for all decisions", caught by "quick-pairing";
    ShuffleWithReplacement = "shuffle-with-replacement" in "sampling": "indices drawn at random, some twice, in place of a permutation", caught by "quick-nets";
    DecisionsShareSeed = "decisions-share-seed" in "sampling": "lens, light and pixel randomised by the same seed", caught by "quick-pairing";
    AxesShareKey = "axes-share-key" in "sampling": "both axes of a decision randomised by the same key", caught by "quick-pairing";
    PixelKeyDropped = "pixel-key-dropped" in "sampling": "all pixels read the same numbers", caught by "quick-pairing";
    SeedsReused = "seeds-reused" in "sampling": "replicates 2k and 2k + 1 have the same seed", caught by "quick-pairing";
    OwenOfBurley = "owen-of-burley" in "sampling": "the hash constants of Burley 2020 in the Owen scramble", caught by "quick-variances";
    XorForOwen = "xor-for-owen" in "sampling": "a digital shift in place of the Owen scramble", caught by "quick-variances";
    DigitsNotNested = "digits-not-nested" in "sampling": "digit permutations that ignore the digits above", caught by "quick-variances";
    ShiftClamped = "shift-clamped" in "sampling": "a shift that stops at 1 in place of wrapping around", caught by "quick-marginals";
    JitterForgotten = "jitter-forgotten" in "sampling": "the lower corner of each stratum in place of a point in it", caught by "quick-marginals";
    StrataTransposed = "strata-transposed" in "sampling": "rows counted as columns where a × b strata are no square", caught by "quick-nets";
    DividedByOneLess = "divided-by-one-less" in "sampling": "Hammersley's x = i/(n − 1)", caught by "quick-nets";
    FirstPointDropped = "first-point-dropped" in "sampling": "van der Corput and Sobol' from point 1 on", caught by "quick-nets";
    BytesReversed = "bytes-reversed" in "sampling": "bytes reversed in place of bits in van der Corput's sequence", caught by "quick-nets";
    RadicalInverseInSingle = "radical-inverse-in-single" in "sampling": "radical inverses summed up in f32, which reach 1", caught by "quick-radical-inverse";
    PixelOffByHalf = "pixel-off-by-half" in "scene": "the pixel's corner taken for its centre: an image half a pixel off", caught by "quick-camera";
    LensOfDiameter = "lens-of-diameter" in "scene": "the lens radius taken for its diameter, the other way round", caught by "quick-camera";
    FocusOnSphere = "focus-on-sphere" in "scene": "the focal depth measured along the ray, not along the axis", caught by "quick-camera";
    LightAreaHalved = "light-area-halved" in "scene": "the area of one triangle for a light of two", caught by "quick-lights";
    LightsPickedEvenly = "lights-picked-evenly" in "scene": "lights picked evenly, and weighted as if by power", caught by "quick-pixels";
    EpsilonAbsolute = "epsilon-absolute" in "scene": "rays start 1e-3 off their surface whatever the scene's scale", caught by "quick-scale";
    CosineSquared = "cosine-squared" in "render": "the surface's cosine counted twice", caught by "quick-lights";
    LightCosineForgotten = "light-cosine-forgotten" in "render": "no cosine at the light", caught by "quick-lights";
    LightFromBehind = "light-from-behind" in "render": "|cos| at the light: it shines from its back", caught by "quick-lights";
    LitFromBehind = "lit-from-behind" in "render": "|cos| at the surface: it is lit through its back", caught by "quick-lights";
    DistanceNotSquared = "distance-not-squared" in "render": "1/r in place of 1/r²", caught by "quick-lights";
    ProbabilityMissing = "probability-missing" in "render": "not divided by the light's probability", caught by "quick-pixels";
    ShadowRayTooLong = "shadow-ray-too-long" in "render": "shadow rays that reach beyond the light, and meet it", caught by "quick-pixels";
    SampleClamped = "sample-clamped" in "render": "samples clamped to radiance 1", caught by "quick-pixels";
    MeanOverOneMore = "mean-over-one-more" in "render": "a pixel's sum divided by n + 1", caught by "quick-pixels";
    VarianceByN = "variance-by-n" in "stats": "squared deviations divided by n, not n − 1", caught by "quick-tests";
    PooledFreedom = "pooled-freedom" in "stats": "n_a + n_b − 2 degrees of freedom in Welch's test", caught by "quick-tests";
    NormalForStudent = "normal-for-student" in "stats": "the normal distribution in place of Student's t", caught by "quick-tests";
    SmirnovOneSided = "smirnov-one-sided" in "stats": "the distribution function compared on one side of each step", caught by "quick-tests";
    CellsAsFreedom = "cells-as-freedom" in "stats": "as many degrees of freedom as cells in χ²", caught by "quick-tests";
    HolmFromTheWrongEnd = "holm-from-the-wrong-end" in "stats": "the smallest p-value multiplied by 1, the largest by N", caught by "quick-tests";
    SidakInSingle = "sidak-in-single" in "stats": "1 − (1 − α)^(1/N) in f32", caught by "quick-tests";
    WaldInterval = "wald-interval" in "stats": "p ± z √(p(1 − p)/n) in place of Clopper and Pearson's interval", caught by "quick-tests";
    ReferenceNoiseKept = "reference-noise-kept" in "stats": "both factors of the unbiased MSE from one reference", caught by "quick-errors";
    StarWithoutOne = "star-without-one" in "stats": "star discrepancy by boxes with corners at sample points alone, never at 1", caught by "quick-errors";
    L2WithoutDiagonal = "l2-without-diagonal" in "stats": "pairs i ≠ j alone in the double sum of an L2 discrepancy", caught by "quick-errors";
}

impl Mutant {
    /// The mutant of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|m| m.name() == name)
    }
}

/// Is this mistake planted? Without the feature `mutants`: never, known to the compiler.
#[cfg(not(feature = "mutants"))]
#[inline(always)]
pub const fn planted(_: Mutant) -> bool {
    false
}

/// Is this mistake planted?
#[cfg(feature = "mutants")]
#[inline(always)]
pub fn planted(mutant: Mutant) -> bool {
    active::is(mutant)
}

#[cfg(feature = "mutants")]
pub use self::active::{plant, plants};

/// Kernels that are a mistake as a whole.
pub mod wrong {
    /// The scramble of Burley 2020 (JCGT 9(4)): its constants miss Owen's variances by factors 0.26 to 2.24.
    #[inline(always)]
    pub const fn burley_scramble(fraction: u32, seed: u32) -> u32 {
        let mut x = fraction.reverse_bits().wrapping_add(seed);
        x ^= x.wrapping_mul(0x6c50_b47c);
        x ^= x.wrapping_mul(0xb82f_1e52);
        x ^= x.wrapping_mul(0xc7af_e638);
        x ^= x.wrapping_mul(0x8d22_f6e6);
        x.reverse_bits()
    }

    /// φ_b summed up digit by digit in single precision, as a 32-bit fraction: 1 is reached, and wraps around to 0.
    pub fn radical_inverse(base: u32, mut index: u32) -> u32 {
        let (mut sum, mut weight) = (0.0f32, 1.0 / base as f32);
        while index > 0 {
            sum += weight * (index % base) as f32;
            weight /= base as f32;
            index /= base;
        }
        (f64::from(sum) * 4_294_967_296.0) as u64 as u32
    }
}

#[cfg(feature = "mutants")]
mod active {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::Mutant;

    /// 0 for none, otherwise 1 + the place in [`Mutant::ALL`].
    static PLANTED: AtomicUsize = AtomicUsize::new(0);

    #[inline(always)]
    pub fn is(mutant: Mutant) -> bool {
        PLANTED.load(Ordering::Relaxed) == mutant as usize + 1
    }

    /// What is planted.
    pub fn plants() -> Option<Mutant> {
        PLANTED.load(Ordering::Relaxed).checked_sub(1).map(|place| Mutant::ALL[place])
    }

    /// Plants one mistake in the whole process, or takes it out again. Never while work is under way.
    pub fn plant(mutant: Option<Mutant>) {
        PLANTED.store(mutant.map_or(0, |m| m as usize + 1), Ordering::Relaxed);
    }
}
