//! Where each sampler is defined and what its sets keep there: counts, indices, dimensions.

use std::fmt;

use super::layout::Decision;
use super::radical::PRIMES;
use super::sobol::DIMENSIONS;
use super::spec::{MAX_SAMPLES, Order, Points, Random, SamplerSpec, every_legal_spec};

/// What a sampler accepts and what holds for the sets that it hands out. Everything else is refused with a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Domain {
    /// Most samples per pixel that may be asked for; the fewest are 1. Indices run from 0 to one below the count taken.
    pub most: u32,
    /// Whether the count taken may be above the one asked for.
    pub raises_count: bool,
    /// Whether a 2-D decision's set is a (0, m, 2)-net in base 2 at every n = 2ᵐ, the first such decision's in order `joint`.
    pub is_net: bool,
    /// Whether the first k of n points are, bit for bit, the set for k: then sampling may stop anywhere.
    pub is_sequence: bool,
    /// Dimensions that the set has; `None` where every decision has a set of its own or there is no end to them.
    pub dimensions: Option<u32>,
}

/// Coordinates that a layout can claim: each decision claims once.
pub const LAYOUT_DIMENSIONS: u32 = {
    let (mut sum, mut i) = (0, 0);
    while i < Decision::ALL.len() {
        sum += Decision::ALL[i].dimensions();
        i += 1;
    }
    sum
};

// So that no layout asks for a dimension that a set does not have.
const _: () = assert!(LAYOUT_DIMENSIONS as usize <= PRIMES.len() && LAYOUT_DIMENSIONS <= DIMENSIONS);

impl SamplerSpec {
    /// Where this sampler is defined.
    pub fn domain(&self) -> Domain {
        use Points as P;
        let net = matches!(self.points, P::Ld | P::Sobol | P::Hammersley) && self.random != Random::Shift;
        // Hammersley's x and strata belong to n, as does a permutation of 0..n. Digits are permuted down to the last
        // that n needs; what follows is one uniform tail.
        let by_count =
            matches!(self.points, P::Hammersley | P::Stratified) || self.order == Order::Shuffle || self.sheet_1d;
        Domain {
            most: MAX_SAMPLES,
            raises_count: self.points == P::Stratified,
            is_net: net,
            is_sequence: !by_count && self.random != Random::Digits,
            dimensions: match self.points {
                P::Uniform | P::Stratified | P::Center => None,
                P::Halton => Some(PRIMES.len() as u32),
                P::Hammersley | P::Ld => Some(2),
                P::Sobol => Some(DIMENSIONS),
            },
        }
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "1 to {} samples, indices from 0 to one below the count", self.most)?;
        if self.raises_count {
            write!(f, " taken, which is the next with a grid")?;
        }
        match self.is_net {
            true => write!(f, "; a net at powers of two")?,
            false => write!(f, "; no net")?,
        }
        match self.is_sequence {
            true => write!(f, "; the first k points are the set for k")?,
            false => write!(f, "; a set for its count alone, not to be stopped early")?,
        }
        match self.dimensions {
            Some(dimensions) => write!(f, "; {dimensions} dimensions."),
            None => write!(f, "; a set for every decision."),
        }
    }
}

/// The domains as a Markdown table, a row for each point set, order and randomisation: `docs/domains.md`.
pub fn domain_table() -> String {
    let mut text =
        "| sampler | samples | taken | net at 2ᵐ | first k are the set for k | dimensions | each number uniform |\n\
                    |---|---|---|---|---|---|---|\n"
            .to_owned();
    let mut last = String::new();
    // `center` has no numbers to speak of.
    for spec in every_legal_spec().into_iter().filter(|spec| spec.points != Points::Center) {
        let name = spec.to_string();
        let name = name.split('@').next().unwrap_or_default();
        if name == last {
            continue;
        }
        name.clone_into(&mut last);
        let domain = spec.domain();
        let yes = |is: bool| if is { "yes" } else { "no" };
        text += &format!(
            "| `{name}` | 1 to {} | {} | {} | {} | {} | {} |\n",
            domain.most,
            if domain.raises_count { "the next a×b, b/a ≤ 2" } else { "as asked" },
            yes(domain.is_net),
            yes(domain.is_sequence),
            domain.dimensions.map_or("a set a decision".to_owned(), |d| d.to_string()),
            yes(spec.is_uniform_marginally()),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check `sampler-domains` holds the table against the samplers; this holds the page against the table.
    #[test]
    fn the_documented_table_is_this_one() {
        let page = include_str!("../../docs/domains.md");
        assert!(page.contains(&domain_table()), "docs/domains.md should contain\n{}", domain_table());
    }
}
