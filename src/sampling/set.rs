//! A sampler for each decision, as data.

use std::fmt;

use crate::error::{Error, Result, did_you_mean};

use super::layout::{Decision, SampleLayout};
use super::spec::{Order, Points, Preset, Random, SamplerSpec};

/// Which sampler serves which decision.
///
/// Written as the one sampler where all decisions read the same, else `pixel=A lens=B light-pick=C light=D`, where each of
/// A … D is a sampler's full form. A decision reads the numbers that its sampler alone would give it under the same seed
/// and for the same count taken: keys depend on the decision, not on its neighbours' samplers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SamplerSet {
    by_decision: [SamplerSpec; 4],
}

impl From<SamplerSpec> for SamplerSet {
    fn from(spec: SamplerSpec) -> Self {
        Self { by_decision: [spec; 4] }
    }
}

impl SamplerSet {
    /// Reads a sampler for all decisions, as [`SamplerSpec::parse`], or `pixel=A lens=B light-pick=C light=D` in any order.
    ///
    /// # Errors
    /// Kind `Input`: as [`SamplerSpec::parse`]; an unknown, repeated or missing decision.
    pub fn parse(text: &str, bare: Preset) -> Result<Self> {
        if !text.contains('=') {
            return SamplerSpec::parse(text, bare).map(Self::from);
        }
        let wrong = |what: String| Error::input(format!("samplers \"{text}\""), what);
        let keys = Decision::ALL.map(Decision::key);
        let mut found: [Option<SamplerSpec>; 4] = [None; 4];
        for part in text.split_whitespace() {
            let Some((key, sampler)) = part.split_once('=') else {
                return Err(wrong(format!("expected DECISION=SAMPLER, found \"{part}\"")));
            };
            let Some(decision) = Decision::ALL.into_iter().find(|d| d.key() == key) else {
                let hint = did_you_mean(key, keys).map_or(String::new(), |k| format!("; did you mean \"{k}\"?"));
                return Err(wrong(format!("expected a decision ({}), found \"{key}\"{hint}", keys.join(", "))));
            };
            let spec = SamplerSpec::parse(sampler, bare).map_err(|e| wrong(format!("{key}: {e}")))?;
            if found[decision as usize].replace(spec).is_some() {
                return Err(wrong(format!("expected each decision once, found \"{key}\" again")));
            }
        }
        match found {
            [Some(pixel), Some(lens), Some(pick), Some(light)] => Ok(Self { by_decision: [pixel, lens, pick, light] }),
            _ => {
                let missing: Vec<&str> =
                    keys.into_iter().zip(found).filter(|(_, spec)| spec.is_none()).map(|(key, _)| key).collect();
                Err(wrong(format!(
                    "expected a sampler for each of the decisions {}, found none for {}",
                    keys.join(", "),
                    missing.join(", ")
                )))
            }
        }
    }

    /// The same but for one decision.
    #[must_use]
    pub fn with(mut self, decision: Decision, spec: SamplerSpec) -> Self {
        self.by_decision[decision as usize] = spec;
        self
    }

    /// The sampler of a decision.
    pub fn of(&self, decision: Decision) -> SamplerSpec {
        self.by_decision[decision as usize]
    }

    /// The one sampler of all decisions; `None` where they differ.
    pub fn single(&self) -> Option<SamplerSpec> {
        self.single_of(&Decision::ALL)
    }

    /// The one sampler of `decisions`; `None` where they differ or there are none.
    pub fn single_of(&self, decisions: &[Decision]) -> Option<SamplerSpec> {
        let (&first, rest) = decisions.split_first()?;
        let first = self.of(first);
        rest.iter().all(|&d| self.of(d) == first).then_some(first)
    }

    /// Samples taken where `asked` are asked for, by the decisions that `layout` makes: the most that one of them takes,
    /// and all of them are readied for that count.
    pub fn taken(&self, asked: u32, layout: &SampleLayout) -> u32 {
        // On a line any number of strata is equal: only a 2-D decision may need another count.
        let two_d = layout.claims().iter().filter(|claim| claim.count == 2);
        two_d.map(|claim| self.of(claim.decision).taken(asked)).max().unwrap_or(asked)
    }

    /// Whether anything that `layout` uses is random.
    pub fn is_random(&self, layout: &SampleLayout) -> bool {
        self.is_random_for(&layout.claims().iter().map(|claim| claim.decision).collect::<Vec<_>>())
    }

    /// Whether anything that `decisions` read is random.
    pub fn is_random_for(&self, decisions: &[Decision]) -> bool {
        decisions.iter().any(|&decision| read_by(self.of(decision), decision).is_random())
    }

    /// What it means where only `decisions` are made: equal exactly where two sets hand out the same numbers there.
    pub fn meaning(&self, decisions: &[Decision]) -> String {
        let part = |&d: &Decision| format!("{}={}", d.key(), read_by(self.of(d), d));
        decisions.iter().map(part).collect::<Vec<_>>().join(" ")
    }

    /// The sampler that most decisions read (of equally many the first), and the decisions that read another.
    pub fn majority(&self) -> (SamplerSpec, Vec<Decision>) {
        let readers = |spec: &SamplerSpec| Decision::ALL.iter().filter(|&&d| self.of(d) == *spec).count();
        let mut most = self.of(Decision::Pixel);
        for spec in self.by_decision {
            most = if readers(&spec) > readers(&most) { spec } else { most };
        }
        (most, Decision::ALL.into_iter().filter(|&d| self.of(d) != most).collect())
    }

    /// The decisions among `decisions` for which two sets hand out different numbers.
    pub fn differing(&self, other: &Self, decisions: &[Decision]) -> Vec<Decision> {
        decisions.iter().copied().filter(|&d| read_by(self.of(d), d) != read_by(other.of(d), d)).collect()
    }

    /// The whole meaning in words of the vocabulary, also of presets.
    pub fn expansion(&self) -> String {
        self.written(SamplerSpec::expansion, ", ")
    }

    fn written(&self, text: impl Fn(&SamplerSpec) -> String, between: &str) -> String {
        match self.single() {
            Some(spec) => text(&spec),
            None => {
                let part = |d: Decision| format!("{}={}", d.key(), text(&self.of(d)));
                Decision::ALL.map(part).join(between)
            }
        }
    }
}

/// What `spec` is for one decision: the sheet's rule for 1-D decisions is followed or, for others, gone.
fn read_by(spec: SamplerSpec, decision: Decision) -> SamplerSpec {
    match (spec.sheet_1d, decision.dimensions()) {
        (false, _) => spec,
        (true, 1) => sheet_1d(spec),
        (true, _) => SamplerSpec { sheet_1d: false, ..spec },
    }
}

/// The sheet's own 1-D sampler: strata, also where the 2-D set is another.
pub(super) fn sheet_1d(spec: SamplerSpec) -> SamplerSpec {
    SamplerSpec { points: Points::Stratified, order: Order::Step, random: Random::Jitter, sheet_1d: false, ..spec }
}

/// The canonical text: equal exactly where the sets are equal.
impl fmt::Display for SamplerSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.written(SamplerSpec::to_string, " "))
    }
}

#[cfg(test)]
mod tests {
    use super::super::hash::mix64;
    use super::super::sampler::{PixelKey, PointSource, Sampler};
    use super::super::spec::every_legal_spec;
    use super::*;

    fn set(text: &str) -> SamplerSet {
        SamplerSet::parse(text, Preset::Best).unwrap()
    }

    #[test]
    fn a_set_of_one_sampler_is_written_as_that_sampler() {
        for spec in every_legal_spec() {
            assert_eq!(SamplerSet::from(spec).to_string(), spec.to_string());
            assert_eq!(set(&format!("light={spec} pixel={spec} lens={spec} light-pick={spec}")).single(), Some(spec));
        }
    }

    #[test]
    fn every_set_reads_back_from_its_text_and_different_sets_have_different_texts() {
        let all = every_legal_spec();
        let pick = |i: u64| all[(mix64(i) % all.len() as u64) as usize];
        let mut texts = std::collections::HashMap::new();
        for i in 0..500 {
            let mut s = SamplerSet::from(pick(8 * i));
            for (k, decision) in (1..).zip(Decision::ALL) {
                s = if mix64(i ^ (k << 40)) & 1 == 0 { s } else { s.with(decision, pick(8 * i + k)) };
            }
            assert_eq!(set(&s.to_string()), s, "{s}");
            assert_eq!(*texts.entry(s.to_string()).or_insert(s), s);
        }
    }

    #[test]
    fn a_set_is_written_decision_by_decision_in_their_order() {
        let text = "light=ld:sheet lens=uniform  pixel=ld light-pick=halton:plain";
        let canonical =
            "pixel=ld:shuffle:owen@each lens=uniform:step:fresh@each light-pick=halton:step:none light=ld:sheet";
        assert_eq!(set(text).to_string(), canonical);
        assert_eq!(set(canonical), set(text));
    }

    #[test]
    fn nonsense_names_the_decision() {
        for (text, needle) in [
            ("pixel=ld lens=ld light=ld", "found none for light-pick"),
            ("pixel=ld", "found none for lens, light-pick, light"),
            ("pixel=ld pixel=ld lens=ld light-pick=ld light=ld", "\"pixel\" again"),
            ("pixel=ld lense=ld light-pick=ld light=ld", "did you mean \"lens\"?"),
            ("pixel=ld lens=haltn light-pick=ld light=ld", "lens: sampler \"haltn\""),
            ("pixel=ld lens", "expected DECISION=SAMPLER, found \"lens\""),
            ("=ld", "expected a decision"),
            ("halton", ""),
        ] {
            match SamplerSet::parse(text, Preset::Best) {
                Ok(_) => assert_eq!(text, "halton"),
                Err(e) => assert!(e.to_string().contains(needle) && e.exit_code() == 2, "{text}: {e}"),
            }
        }
    }

    #[test]
    fn a_scene_s_meaning_knows_only_the_decisions_it_makes() {
        let pinhole = [Decision::Pixel, Decision::LightPick, Decision::LightPoint];
        let base = set("ld:sheet");
        let lens_apart = base.with(Decision::Lens, set("ld").of(Decision::Lens));
        assert_eq!(lens_apart.meaning(&pinhole), base.meaning(&pinhole));
        assert_ne!(lens_apart.meaning(&Decision::ALL), base.meaning(&Decision::ALL));
        assert_eq!(lens_apart.differing(&base, &Decision::ALL), [Decision::Lens]);
        assert_eq!(lens_apart.differing(&base, &pinhole), []);
        // The sheet's preset differs from its expansion in the 1-D decision alone.
        let expanded = set("ld:step:xor@each");
        assert_eq!(base.differing(&expanded, &pinhole), [Decision::LightPick]);
        assert_eq!(base.meaning(&[Decision::Pixel]), expanded.meaning(&[Decision::Pixel]));
        assert_eq!(lens_apart.single_of(&pinhole), base.single());
        assert_eq!((lens_apart.single(), lens_apart.single_of(&[])), (None, None));
        assert_eq!(lens_apart.majority(), (base.of(Decision::Pixel), vec![Decision::Lens]));
        assert_eq!(base.majority(), (base.of(Decision::Pixel), vec![]));
    }

    /// A scene with all decisions, and the span of each that a sampler hands out.
    fn spans(set: SamplerSet, asked: u32) -> (u32, [Vec<f32>; 4]) {
        let mut layout = SampleLayout::default();
        let (pixel, lens) = (layout.claim_2d(Decision::Pixel), layout.claim_2d(Decision::Lens));
        let (pick, light) = (layout.claim_1d(Decision::LightPick), layout.claim_2d(Decision::LightPoint));
        let sampler = Sampler::new(set, &layout, asked, 99).unwrap();
        let n = sampler.samples();
        let key = PixelKey::new(5, 8);
        let two = |dim| (0..n).flat_map(|i| sampler.get_2d(key, i, dim)).collect();
        let one = (0..n).map(|i| sampler.get_1d(key, i, &pick)).collect();
        (n, [two(&pixel), two(&lens), one, two(&light)])
    }

    /// So that a comparison of two sets that differ in one decision, at one seed, changes the numbers of that one alone.
    #[test]
    fn a_decision_reads_what_its_sampler_alone_would_give_it() {
        let texts = ["uniform", "ld:sheet", "ld", "halton:joint:digits@pixel", "sobol:joint:owen@image", "hammersley"];
        for (a, b) in texts.iter().flat_map(|a| texts.iter().map(move |b| (set(a), set(b)))) {
            for decision in Decision::ALL {
                let (_, mixed) = spans(a.with(decision, b.of(decision)), 24);
                let ((_, of_a), (_, of_b)) = (spans(a, 24), spans(b, 24));
                for d in Decision::ALL {
                    let alone = if d == decision { &of_b } else { &of_a };
                    assert_eq!(mixed[d as usize], alone[d as usize], "{a} with {b} in {}", d.name());
                }
            }
        }
    }

    #[test]
    fn the_count_that_one_decision_takes_is_taken_by_all_and_each_is_made_for_it() {
        let base = set("hammersley:plain");
        for decision in [Decision::Pixel, Decision::Lens, Decision::LightPoint] {
            let mixed = base.with(decision, set("stratified").of(decision));
            let (n, numbers) = spans(mixed, 26);
            assert_eq!(n, 28);
            for d in Decision::ALL.into_iter().filter(|&d| d != decision && d != Decision::LightPick) {
                // Hammersley's x is i/n for the count taken, not the one asked for.
                let x = numbers[d as usize].iter().step_by(2);
                assert!(x.zip(0..).all(|(&x, i)| (x - i as f32 / 28.0).abs() < 1e-6), "{}", d.name());
            }
            let of_strata = spans(set("stratified"), 28).1;
            assert_eq!(numbers[decision as usize], of_strata[decision as usize]);
        }
        // n strata on a line are equal for any n.
        let pick_alone = base.with(Decision::LightPick, set("stratified").of(Decision::LightPick));
        let (n, numbers) = spans(pick_alone, 26);
        assert_eq!(n, 26);
        let mut strata: Vec<u32> = numbers[2].iter().map(|x| (x * 26.0) as u32).collect();
        strata.sort_unstable();
        assert!(strata.into_iter().eq(0..26));
    }
}
