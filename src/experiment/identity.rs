//! Ids and seeds: what an item *is*, hashed.

use sha2::{Digest, Sha256};

/// Characters of an id: 64 bits in hex.
pub const ID_LENGTH: usize = 16;

/// SHA-256 over named fields in a fixed order; each field's name and value go in with their lengths, so that no two
/// different lists of fields feed the same bytes.
pub struct Fingerprint(Sha256);

impl Fingerprint {
    /// Starts the fingerprint of one sort of thing; different sorts never meet.
    pub fn new(sort: &str) -> Self {
        Self(Sha256::new()).with("sampler-lab", sort)
    }

    /// Adds one field.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl std::fmt::Display) -> Self {
        for text in [name, value.to_string().as_str()] {
            self.0.update((text.len() as u64).to_le_bytes());
            self.0.update(text.as_bytes());
        }
        self
    }

    /// The id: the first [`ID_LENGTH`] hex digits.
    pub fn id(self) -> String {
        hex(&self.0.finalize()[..ID_LENGTH / 2])
    }

    /// A seed: the first eight bytes, little-endian.
    pub fn seed(self) -> u64 {
        self.0.finalize().iter().take(8).rev().fold(0, |seed, &byte| seed << 8 | u64::from(byte))
    }
}

/// What a seed is derived from: the experiment's seed and the item's own fields, never its place in a list.
#[derive(Debug, Clone, Copy)]
pub struct SeedOf<'a> {
    /// The experiment's seed.
    pub experiment: u64,
    /// What the randomisation is for: `render`, `reference`, `picture`…
    pub purpose: &'a str,
    /// Scene name; empty for point sets.
    pub scene: &'a str,
    /// Sampler in canonical form.
    pub sampler: &'a str,
    /// Samples (or points) asked for.
    pub asked: u32,
    /// Replicate, or half of a reference.
    pub replicate: u32,
}

impl SeedOf<'_> {
    /// The seed.
    pub fn derive(self) -> u64 {
        Fingerprint::new("seed")
            .with("experiment", self.experiment)
            .with("purpose", self.purpose)
            .with("scene", self.scene)
            .with("sampler", self.sampler)
            .with("asked", self.asked)
            .with("replicate", self.replicate)
            .seed()
    }
}

/// Digest of pixels: SHA-256 over the little-endian bytes of the `f32` channels, row by row, as 16 hex digits.
pub fn pixel_hash(pixels: &[[f32; 3]]) -> String {
    let mut digest = Sha256::new();
    for pixel in pixels {
        for channel in pixel {
            digest.update(channel.to_le_bytes());
        }
    }
    hex(&digest.finalize()[..ID_LENGTH / 2])
}

/// Lower-case hex.
fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_cannot_flow_into_each_other() {
        let a = Fingerprint::new("t").with("a", "bc").with("d", "").id();
        let b = Fingerprint::new("t").with("a", "b").with("cd", "").id();
        let c = Fingerprint::new("u").with("a", "bc").with("d", "").id();
        assert!(a != b && a != c && b != c);
        assert_eq!(a.len(), ID_LENGTH);
    }

    #[test]
    fn an_id_is_the_start_of_the_published_hash() {
        // SHA-256 of no bytes: FIPS 180-4 example, e3b0c442 98fc1c14…
        assert_eq!(pixel_hash(&[]), "e3b0c44298fc1c14");
        assert_eq!(
            Fingerprint(Sha256::new()).seed(),
            u64::from_le_bytes([0xe3, 0xb0, 0xc4, 0x42, 0x98, 0xfc, 0x1c, 0x14])
        );
    }

    #[test]
    fn a_seed_depends_on_each_of_its_fields() {
        let base = SeedOf { experiment: 7, purpose: "render", scene: "a", sampler: "ld", asked: 4, replicate: 0 };
        let others = [
            SeedOf { experiment: 8, ..base },
            SeedOf { purpose: "picture", ..base },
            SeedOf { scene: "b", ..base },
            SeedOf { sampler: "halton", ..base },
            SeedOf { asked: 5, ..base },
            SeedOf { replicate: 1, ..base },
        ];
        for other in others {
            assert_ne!(base.derive(), other.derive(), "{other:?}");
        }
    }

    #[test]
    fn minus_zero_is_another_pixel_than_zero() {
        assert_ne!(pixel_hash(&[[0.0; 3]]), pixel_hash(&[[-0.0, 0.0, 0.0]]));
    }
}
