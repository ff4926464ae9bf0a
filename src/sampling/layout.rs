//! Who decides what with which numbers.
//!
//! Compiling a scene claims a ticket for each decision it makes, in the order pixel, lens, light pick, light point. A
//! ticket cannot be copied and has private fields, so two decisions cannot share numbers by accident.

use std::fmt;

/// One use of randomness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Decision {
    /// Where in the pixel's square (2-D).
    Pixel,
    /// Where on the lens (2-D).
    Lens,
    /// Which light (1-D).
    LightPick,
    /// Where on that light (2-D).
    LightPoint,
}

impl Decision {
    /// All decisions, in the order in which they claim dimensions.
    pub const ALL: [Self; 4] = [Self::Pixel, Self::Lens, Self::LightPick, Self::LightPoint];

    /// The name in layouts, reports and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pixel => "pixel",
            Self::Lens => "lens",
            Self::LightPick => "light pick",
            Self::LightPoint => "light point",
        }
    }

    /// The word in texts and options: `pixel lens light-pick light`.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Pixel => "pixel",
            Self::Lens => "lens",
            Self::LightPick => "light-pick",
            Self::LightPoint => "light",
        }
    }

    /// How many coordinates it reads: 1 or 2.
    pub const fn dimensions(self) -> u32 {
        match self {
            Self::LightPick => 1,
            Self::Pixel | Self::Lens | Self::LightPoint => 2,
        }
    }

    /// The decisions that a layout's text names, in order: what a stored layout says without its tickets.
    pub fn named_in(layout: &str) -> Vec<Self> {
        Self::ALL.into_iter().filter(|decision| layout.contains(decision.name())).collect()
    }
}

/// The right to read one coordinate.
#[derive(Debug)]
pub struct Dim1 {
    claim: Claim,
}

/// The right to read two coordinates.
#[derive(Debug)]
pub struct Dim2 {
    claim: Claim,
}

impl Dim1 {
    /// The decision this ticket was given for.
    pub fn decision(&self) -> Decision {
        self.claim.decision
    }
}

impl Dim2 {
    /// The decision this ticket was given for.
    pub fn decision(&self) -> Decision {
        self.claim.decision
    }
}

/// A decision and the dimensions of a joint sequence that it owns: `first .. first + count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim {
    /// Who claimed.
    pub decision: Decision,
    /// First dimension, counted over all claims.
    pub first: u32,
    /// 1 or 2.
    pub count: u32,
}

/// The decisions a scene makes, in order; prints as `pixel 0–1, lens 2–3 (4 dimensions)`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SampleLayout {
    claims: Vec<Claim>,
}

impl SampleLayout {
    /// Claims the next coordinate for a 1-D decision.
    ///
    /// # Panics
    /// If the decision has claimed before: that is an error of the program.
    pub fn claim_1d(&mut self, decision: Decision) -> Dim1 {
        Dim1 { claim: self.claim(decision, 1) }
    }

    /// Claims the next two coordinates for a 2-D decision.
    ///
    /// # Panics
    /// If the decision has claimed before: that is an error of the program.
    pub fn claim_2d(&mut self, decision: Decision) -> Dim2 {
        Dim2 { claim: self.claim(decision, 2) }
    }

    fn claim(&mut self, decision: Decision, count: u32) -> Claim {
        assert!(self.find(decision).is_none(), "{} claims twice", decision.name());
        let claim = Claim { decision, first: self.dimensions(), count };
        self.claims.push(claim);
        claim
    }

    /// The layout that prints as `text`; `None` where none does.
    pub fn parse(text: &str) -> Option<Self> {
        let mut layout = Self::default();
        for decision in Decision::named_in(text) {
            layout.claim(decision, decision.dimensions());
        }
        (layout.to_string() == text).then_some(layout)
    }

    /// All claims in order.
    pub fn claims(&self) -> &[Claim] {
        &self.claims
    }

    /// The claim of a decision, where it is made at all.
    pub fn find(&self, decision: Decision) -> Option<Claim> {
        self.claims.iter().copied().find(|c| c.decision == decision)
    }

    /// Number of coordinates that one sample needs.
    pub fn dimensions(&self) -> u32 {
        self.claims.iter().map(|c| c.count).sum()
    }
}

impl fmt::Display for SampleLayout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for claim in &self.claims {
            match claim.count {
                1 => write!(f, "{} {}, ", claim.decision.name(), claim.first)?,
                _ => write!(f, "{} {}–{}, ", claim.decision.name(), claim.first, claim.first + claim.count - 1)?,
            }
        }
        match self.dimensions() {
            0 => write!(f, "no random decision (0 dimensions)"),
            n => write!(f, "{n} dimensions in all"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_are_numbered_in_order_and_print() {
        let mut layout = SampleLayout::default();
        assert_eq!(layout.to_string(), "no random decision (0 dimensions)");
        layout.claim_2d(Decision::Pixel);
        layout.claim_1d(Decision::LightPick);
        layout.claim_2d(Decision::LightPoint);
        assert_eq!(layout.to_string(), "pixel 0–1, light pick 2, light point 3–4, 5 dimensions in all");
        assert_eq!(layout.find(Decision::Lens), None);
        let named = Decision::named_in(&layout.to_string());
        assert_eq!(named, [Decision::Pixel, Decision::LightPick, Decision::LightPoint]);
        assert!(layout.claims().iter().all(|claim| claim.count == claim.decision.dimensions()));
        assert_eq!(Decision::named_in(&SampleLayout::default().to_string()), []);
        for layout in [SampleLayout::default(), layout] {
            assert_eq!(SampleLayout::parse(&layout.to_string()), Some(layout));
        }
        assert_eq!(SampleLayout::parse("pixel 0–1, lens 2–3, 5 dimensions in all"), None);
    }

    #[test]
    #[should_panic(expected = "lens claims twice")]
    fn a_decision_cannot_claim_twice() {
        let mut layout = SampleLayout::default();
        layout.claim_2d(Decision::Lens);
        layout.claim_2d(Decision::Lens);
    }
}
