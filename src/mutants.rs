//! Planted bugs: mistakes that people make in samplers, estimators and statistics, each of which a check must catch.
//!
//! They exist behind the cargo feature `mutants` alone. Without it [`planted`] is the constant `false`, so the code of a
//! mistake is compiled away; with it one of them is on at a time, and `sampler-lab check --mutant NAME` is expected to fail.
//!
//! A mutant stands where the mistake would be made, as `if planted(Mutant::Name) { wrong } else { right }`.

macro_rules! mutants {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $mistake:literal;)+) => {
        /// A mistake that can be planted.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Mutant { $($(#[$doc])* $variant),+ }

        impl Mutant {
            /// All of them, in the order of their declaration.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The name under which it is planted.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }

            /// What is done wrong.
            pub fn mistake(self) -> &'static str {
                match self { $(Self::$variant => $mistake),+ }
            }
        }
    };
}

mutants! {
    /// `r = u` in place of `r = √u`.
    DiskWithoutRoot = "disk-without-root", "a point of the lens at radius u in place of √u";
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
pub use self::active::plant;

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

    /// Plants one mistake in the whole process, or takes it out again. Never while work is under way.
    pub fn plant(mutant: Option<Mutant>) {
        PLANTED.store(mutant.map_or(0, |m| m as usize + 1), Ordering::Relaxed);
    }
}
