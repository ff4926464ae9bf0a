//! Other ways to make one and the same image: what should make no difference, made so that it can be seen whether it does.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// How an image is made beside its scene, sampler, count and size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Variant {
    /// As everybody makes it.
    #[default]
    Plain,
    /// The scene with all its lengths (mesh, camera position, lens radius, focal depth) multiplied by this power of ten.
    /// Radiance does not depend on the unit of length, so the picture should not change.
    Scaled(i8),
    /// Two passes, of 1 and of n − 1 samples, with samplers that begin anew in the second, as the driver of the sheet's
    /// framework makes them; their mean is weighted by the samples taken.
    TwoPasses,
}

impl Variant {
    /// The variants whose images are held against the plain ones, in the order in which they are made.
    pub const COMPARED: [Self; 3] = [Self::Scaled(-6), Self::Scaled(6), Self::TwoPasses];

    /// Whether this is no variant at all: such rows and ids do not mention it.
    pub fn is_plain(&self) -> bool {
        *self == Self::Plain
    }

    /// The factor of all lengths.
    pub fn scale(self) -> f32 {
        match self {
            Self::Scaled(power) => libm::pow(10.0, f64::from(power)) as f32,
            Self::Plain | Self::TwoPasses => 1.0,
        }
    }

    /// The counts asked for pass by pass, where `asked` are asked for in all: one pass, or two where there are enough.
    pub fn passes(self, asked: u32) -> Vec<u32> {
        match self {
            Self::TwoPasses if asked > 1 => vec![1, asked - 1],
            _ => vec![asked],
        }
    }

    /// The variant called `word`; `None` for any other word.
    pub fn from_word(word: &str) -> Option<Self> {
        match word {
            "plain" => Some(Self::Plain),
            "two-passes" => Some(Self::TwoPasses),
            _ => {
                let power = word.strip_prefix("scaled(1e")?.strip_suffix(')')?;
                let power: i8 = power.parse().ok()?;
                // One variant has one word: `+6` and `06` are none.
                Some(Self::Scaled(power)).filter(|variant| variant.to_string() == word)
            }
        }
    }
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plain => write!(f, "plain"),
            Self::Scaled(power) => write!(f, "scaled(1e{power})"),
            Self::TwoPasses => write!(f, "two-passes"),
        }
    }
}

impl Serialize for Variant {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Variant {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = String::deserialize(deserializer)?;
        Self::from_word(&word).ok_or_else(|| serde::de::Error::custom(format!("expected a variant, found {word:?}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variant_reads_back_from_its_word_and_no_other_word_is_one() {
        for variant in Variant::COMPARED.into_iter().chain([Variant::Plain]) {
            assert_eq!(Variant::from_word(&variant.to_string()), Some(variant));
        }
        for bad in ["", "Plain", "scaled", "scaled(1e)", "scaled(1e+6)", "scaled(1e06)", "scaled(1e6", "scaled(1e999)"]
        {
            assert_eq!(Variant::from_word(bad), None, "{bad}");
        }
    }

    #[test]
    fn factors_are_the_nearest_floats_and_passes_add_up() {
        assert_eq!((Variant::Scaled(-6).scale(), Variant::Scaled(6).scale()), (1e-6, 1e6));
        assert_eq!((Variant::Plain.scale(), Variant::TwoPasses.scale()), (1.0, 1.0));
        assert_eq!(Variant::TwoPasses.passes(64), [1, 63]);
        assert_eq!(Variant::TwoPasses.passes(1), [1]);
        assert_eq!(Variant::Plain.passes(64), [64]);
    }
}
