//! Samplers as data: `POINTS[:ORDER[:RANDOM[@SCOPE]]]`, the presets, and which combinations mean something.

use std::fmt;

use crate::error::{Error, Result, did_you_mean};

use super::layout::Claim;
use super::radical::PRIMES;
use super::strata::strata_taken;

/// Largest number of samples per pixel, asked or taken.
pub const MAX_SAMPLES: u32 = 1 << 24;

/// Declares a closed vocabulary: an enum, its words and the way back.
macro_rules! vocabulary {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $word:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$variant_doc])* $variant),+ }

        impl $name {
            /// Every value, in the order of the documentation.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The word for it in sampler names.
            pub const fn word(self) -> &'static str {
                match self { $(Self::$variant => $word),+ }
            }

            fn from_word(word: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|v| v.word() == word)
            }
        }
    };
}

vocabulary! {
    /// The point set P.
    Points {
        /// Independent uniform numbers.
        Uniform = "uniform",
        /// Jittered strata, the factor pair nearest to a square.
        Stratified = "stratified",
        /// Halton's sequence, bases 2, 3, 5, …
        Halton = "halton",
        /// Hammersley's set (i/n, φ₂(i)).
        Hammersley = "hammersley",
        /// The sheet's (0,2)-sequence: van der Corput and Sobol' dimension 2.
        Ld = "ld",
        /// Sobol's sequence with Joe & Kuo's direction numbers.
        Sobol = "sobol",
        /// The centre of the pixel and of the lens: no numbers.
        Center = "center",
    }
}

vocabulary! {
    /// The index order π and the dimensions D that a decision reads.
    Order {
        /// Every decision reads the set's first dimensions at the same index.
        Step = "step",
        /// The same dimensions, the index permuted by a key of the decision (and of the pixel, as the scope says).
        Shuffle = "shuffle",
        /// Each decision reads dimensions of its own.
        Joint = "joint",
    }
}

vocabulary! {
    /// The randomisation R.
    Random {
        /// Nothing.
        None = "none",
        /// Fresh uniform numbers (uniform).
        Fresh = "fresh",
        /// A uniform place in the stratum (stratified).
        Jitter = "jitter",
        /// One random 32-bit word an axis, by exclusive or (digital shift).
        Xor = "xor",
        /// The same on Hammersley's y alone.
        Yxor = "yxor",
        /// Addition modulo 1 (Cranley–Patterson).
        Shift = "shift",
        /// Nested uniform scramble in base 2 (Owen).
        Owen = "owen",
        /// Nested random digit permutations (Halton).
        Digits = "digits",
    }
}

vocabulary! {
    /// What the key depends on besides seed and replicate.
    Scope {
        /// Nothing: one pattern for all decisions and pixels.
        Image = "image",
        /// The decision: one pattern for all pixels.
        Decision = "decision",
        /// The pixel: one pattern for all decisions of a pixel.
        Pixel = "pixel",
        /// Decision and pixel.
        Each = "each",
    }
}

/// The preset that a bare name stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// The sheet read literally.
    Sheet,
    /// What we recommend.
    Best,
    /// The set itself, nothing random.
    Plain,
}

impl Preset {
    const fn word(self) -> &'static str {
        match self {
            Self::Sheet => "sheet",
            Self::Best => "best",
            Self::Plain => "plain",
        }
    }

    /// What the preset is for a point set, where it exists.
    pub fn of(self, points: Points) -> Option<SamplerSpec> {
        use {Order::*, Points::*, Random as R};
        let (order, random) = match (self, points) {
            (_, Center) => (Step, R::None),
            (Self::Sheet | Self::Best, Uniform) => (Step, R::Fresh),
            (Self::Sheet, Stratified) => (Step, R::Jitter),
            (Self::Sheet | Self::Plain, Halton) | (Self::Plain, Hammersley | Ld | Sobol) => (Step, R::None),
            (Self::Sheet, Hammersley) => (Step, R::Yxor),
            (Self::Sheet, Ld) => (Step, R::Xor),
            (Self::Best, Stratified) => (Shuffle, R::Jitter),
            (Self::Best, Halton) => (Joint, R::Digits),
            (Self::Best, Hammersley) => (Shuffle, R::Shift),
            (Self::Best, Ld) => (Shuffle, R::Owen),
            (Self::Best, Sobol) => (Joint, R::Owen),
            (Self::Sheet, Sobol) | (Self::Plain, Uniform | Stratified) => return None,
        };
        // The sheet has 1-D samplers of its own: strata for every set but the uniform one.
        let sheet_1d = self == Self::Sheet && !matches!(points, Uniform | Center);
        Some(SamplerSpec { points, order, random, scope: Scope::Each, sheet_1d })
    }
}

/// A sampler: R_key(P(π(i), D)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SamplerSpec {
    /// Point set P.
    pub points: Points,
    /// Index order π and dimensions D.
    pub order: Order,
    /// Randomisation R.
    pub random: Random,
    /// What the key depends on; [`Scope::Each`] where nothing is keyed.
    pub scope: Scope,
    /// 1-D decisions read the sheet's jittered 1-D strata instead of the set's first axis (`:sheet` presets).
    pub sheet_1d: bool,
}

impl SamplerSpec {
    /// Reads `POINTS[:ORDER[:RANDOM[@SCOPE]]]`, `POINTS:PRESET`, or a bare name, which stands for `bare`.
    ///
    /// A left-out RANDOM is the point set's own in `:best`; a left-out SCOPE is `each`.
    ///
    /// # Errors
    /// Kind `Input`: an unknown word with the nearest known one, or a combination without meaning with the legal ones.
    pub fn parse(text: &str, bare: Preset) -> Result<Self> {
        let place = format!("sampler \"{text}\"");
        let mut parts = text.split(':');
        let points = word(
            &place,
            "a point set",
            parts.next().unwrap_or(""),
            Points::from_word,
            Points::ALL.iter().map(|p| p.word()),
        )?;
        let missing = |preset: Preset| {
            let have: Vec<_> = [Preset::Sheet, Preset::Best, Preset::Plain]
                .into_iter()
                .filter(|p| p.of(points).is_some())
                .map(Preset::word)
                .collect();
            Error::input(
                &place,
                format!("expected a preset that {} has ({}), found {}", points.word(), have.join(", "), preset.word()),
            )
        };
        let Some(second) = parts.next() else {
            // `sobol` has no sheet preset: what it has is the best one.
            return bare.of(points).or_else(|| Preset::Best.of(points)).ok_or_else(|| missing(bare));
        };
        let (random, extra) = (parts.next(), parts.next());
        if let Some(extra) = extra {
            return Err(Error::input(
                &place,
                format!("expected POINTS[:ORDER[:RANDOM[@SCOPE]]], found a further part \"{extra}\""),
            ));
        }
        if let Some(preset) = [Preset::Sheet, Preset::Best, Preset::Plain].into_iter().find(|p| p.word() == second) {
            if let Some(random) = random {
                return Err(Error::input(
                    &place,
                    format!("expected nothing after the preset \"{second}\", found \"{random}\""),
                ));
            }
            return preset.of(points).ok_or_else(|| missing(preset));
        }
        let orders = Order::ALL.iter().map(|o| o.word()).chain(["sheet", "best", "plain"]);
        let order = word(&place, "an order or preset", second, Order::from_word, orders)?;
        let (random, scope) = match random.map(|r| r.split_once('@').map_or((r, None), |(r, s)| (r, Some(s)))) {
            None => (None, None),
            Some((random, scope)) => {
                let random =
                    word(&place, "a randomisation", random, Random::from_word, Random::ALL.iter().map(|r| r.word()))?;
                let scope = scope
                    .map(|s| word(&place, "a scope", s, Scope::from_word, Scope::ALL.iter().map(|s| s.word())))
                    .transpose()?;
                (Some(random), scope)
            }
        };
        Self::checked(&place, points, order, random, scope)
    }

    /// Puts a specification together, or says which ones are legal.
    ///
    /// # Errors
    /// Kind `Input`, with every legal combination of the point set.
    pub fn checked(
        place: &str,
        points: Points,
        order: Order,
        random: Option<Random>,
        scope: Option<Scope>,
    ) -> Result<Self> {
        let default = Preset::Best.of(points).expect("every point set has a best preset").random;
        let random = random.unwrap_or(default);
        let spec = Self { points, order, random, scope: scope.unwrap_or(Scope::Each), sheet_1d: false };
        let legal = legal_orders(points).contains(&order) && legal_randoms(points).contains(&random);
        if !legal || (scope.is_some() && !spec.is_random()) {
            let orders: Vec<_> = legal_orders(points).iter().map(|o| o.word()).collect();
            let randoms: Vec<_> = legal_randoms(points).iter().map(|r| r.word()).collect();
            let scopes: Vec<_> = Scope::ALL.iter().map(|s| s.word()).collect();
            return Err(Error::input(
                place,
                format!(
                    "expected {}:({}):({})[@({})], a scope only where something is keyed; found {}",
                    points.word(),
                    orders.join("|"),
                    randoms.join("|"),
                    scopes.join("|"),
                    spec.written(scope)
                ),
            ));
        }
        Ok(spec)
    }

    fn written(&self, scope: Option<Scope>) -> String {
        let mut text = format!("{}:{}:{}", self.points.word(), self.order.word(), self.random.word());
        if let Some(scope) = scope {
            text += &format!("@{}", scope.word());
        }
        text
    }

    /// Whether anything is random: otherwise there is one image only, with an error but no variance.
    pub fn is_random(&self) -> bool {
        self.random != Random::None || self.order == Order::Shuffle
    }

    /// Whether a single number of a 2-D decision, over all seeds, is uniform on [0, 1): then an image is unbiased sample by sample.
    pub fn is_uniform_marginally(&self) -> bool {
        match self.random {
            Random::None | Random::Yxor => false,
            Random::Jitter => self.order == Order::Shuffle,
            _ => true,
        }
    }

    /// Samples taken where `asked` are asked for: as asked, but for [`Points::Stratified`].
    pub fn taken(&self, asked: u32) -> u32 {
        if self.points == Points::Stratified { strata_taken(asked) } else { asked }
    }

    /// The whole meaning in words of the vocabulary, also for presets: `halton:step:none`.
    pub fn expansion(&self) -> String {
        if self.points == Points::Center {
            return self.points.word().to_owned();
        }
        let mut text = self.written(self.is_random().then_some(self.scope));
        if self.sheet_1d {
            text += " (1-D: strata, step:jitter@each)";
        }
        text
    }

    /// What the decision behind `claim` reads, in words: `Halton's bases 5 and 7`.
    pub fn reads(&self, claim: Claim) -> String {
        let one_d = claim.count == 1;
        if self.sheet_1d && one_d {
            return "n jittered strata on a line (the sheet's 1-D sampler)".to_owned();
        }
        let first = if self.order == Order::Joint { claim.first } else { 0 };
        let axes: Vec<u32> = (first..first + claim.count).collect();
        let list = |name: &dyn Fn(u32) -> String| axes.iter().map(|&a| name(a)).collect::<Vec<_>>().join(" and ");
        let plural = if one_d { "" } else { "s" };
        match self.points {
            Points::Uniform => format!("uniform stream{plural} {}", list(&|a| a.to_string())),
            Points::Stratified if one_d => "n jittered strata on a line".to_owned(),
            Points::Stratified => "a×b = n jittered cells".to_owned(),
            Points::Halton => format!("Halton's base{plural} {}", list(&|a| PRIMES[a as usize].to_string())),
            Points::Hammersley => list(&|a| (if a == 0 { "i/n" } else { "φ₂(i)" }).to_owned()),
            Points::Ld | Points::Sobol => format!("Sobol' dimension{plural} {}", list(&|a| (a + 1).to_string())),
            Points::Center => "the centre: no numbers".to_owned(),
        }
    }

    /// What the sampler does, in a sentence or three.
    pub fn describe(&self) -> String {
        let points = match self.points {
            Points::Uniform => "independent uniform numbers",
            Points::Stratified => {
                "one point in each of n equal strata: a×b = n cells, the factor pair nearest to a square (n in 1-D)"
            }
            Points::Halton => "Halton's sequence: radical inverses in the bases 2, 3, 5, 7, …, indices 0 … n−1",
            Points::Hammersley => "Hammersley's set (i/n, φ₂(i)), i = 0 … n−1: fixed together for one n",
            Points::Ld => {
                "the (0,2)-sequence: van der Corput's radical inverse and Sobol' dimension 2, indices 0 … n−1"
            }
            Points::Sobol => "Sobol's sequence with Joe & Kuo's direction numbers, indices 0 … n−1",
            Points::Center => {
                return "The centre of the pixel and of the lens, for every sample. Nothing is random.".to_owned();
            }
        };
        let order = match self.order {
            Order::Step => "Decisions march in step: each reads the set's first dimensions at the same index.",
            Order::Shuffle => {
                "Each decision reads the same dimensions in an order of its own: the index is permuted under a key."
            }
            Order::Joint => "Each decision reads dimensions of its own.",
        };
        let random = match self.random {
            Random::None => "The points are not randomised.",
            Random::Fresh => "Every number is drawn afresh.",
            Random::Jitter => "Each point is uniform in its stratum.",
            Random::Xor => "Randomised by a digital shift: one random 32-bit word an axis, by exclusive or.",
            Random::Yxor => "Randomised by a digital shift of y alone; x = i/n is the same in every pixel.",
            Random::Shift => "Randomised by a toroidal shift: one random number an axis, added modulo 1.",
            Random::Owen => "Randomised by a nested uniform (Owen) scramble, an axis at a time.",
            Random::Digits => "Randomised by nested random digit permutations in each base.",
        };
        let scope = match (self.is_random(), self.scope) {
            (false, _) => "There is one image only: it has an error, but no variance.",
            (_, Scope::Image) => "One key for the whole image: every pixel and decision sees the same pattern.",
            (_, Scope::Decision) => "One key a decision: every pixel sees the same pattern.",
            (_, Scope::Pixel) => "One key a pixel: its decisions share it.",
            (_, Scope::Each) => "One key for each decision of each pixel.",
        };
        let mut text = format!("Reads {points}. {order} {random} {scope}");
        if self.sheet_1d {
            text += " A 1-D decision reads the sheet's 1-D sampler: n jittered strata, in step.";
        }
        text
    }
}

/// The canonical name: equal exactly where the numbers are equal. `:sheet` presets keep their name, since their 1-D rule has no other.
impl fmt::Display for SamplerSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.sheet_1d { write!(f, "{}:sheet", self.points.word()) } else { write!(f, "{}", self.expansion()) }
    }
}

fn word<'a, T>(
    place: &str,
    kind: &str,
    found: &str,
    read: impl Fn(&str) -> Option<T>,
    known: impl Iterator<Item = &'a str> + Clone,
) -> Result<T> {
    read(found).ok_or_else(|| {
        let all: Vec<_> = known.clone().collect();
        let hint = did_you_mean(found, known).map_or(String::new(), |k| format!("; did you mean \"{k}\"?"));
        Error::input(place, format!("expected {kind} ({}), found \"{found}\"{hint}", all.join(", ")))
    })
}

fn legal_orders(points: Points) -> &'static [Order] {
    use Order::*;
    match points {
        Points::Uniform | Points::Halton | Points::Sobol => &[Step, Shuffle, Joint],
        Points::Stratified | Points::Hammersley | Points::Ld => &[Step, Shuffle],
        Points::Center => &[Step],
    }
}

fn legal_randoms(points: Points) -> &'static [Random] {
    use Random as R;
    match points {
        Points::Uniform => &[R::Fresh],
        Points::Stratified => &[R::Jitter],
        Points::Halton => &[R::None, R::Shift, R::Digits],
        Points::Hammersley => &[R::None, R::Xor, R::Yxor, R::Shift],
        Points::Ld | Points::Sobol => &[R::None, R::Xor, R::Shift, R::Owen],
        Points::Center => &[R::None],
    }
}

/// Every legal specification, for tests that walk them all.
pub fn every_legal_spec() -> Vec<SamplerSpec> {
    let mut all = Vec::new();
    for &points in Points::ALL {
        for &order in legal_orders(points) {
            for &random in legal_randoms(points) {
                for &scope in Scope::ALL {
                    let spec = SamplerSpec { points, order, random, scope, sheet_1d: false };
                    if spec.is_random() || scope == Scope::Each {
                        all.push(spec);
                    }
                }
            }
        }
        all.extend(Preset::Sheet.of(points).filter(|s| s.sheet_1d));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(text: &str) -> SamplerSpec {
        SamplerSpec::parse(text, Preset::Best).unwrap()
    }

    #[test]
    fn presets_stand_for_the_documented_combinations() {
        for (name, meaning) in [
            ("uniform:sheet", "uniform:step:fresh@each"),
            ("stratified:sheet", "stratified:step:jitter@each"),
            ("halton:sheet", "halton:step:none"),
            ("hammersley:sheet", "hammersley:step:yxor@each"),
            ("ld:sheet", "ld:step:xor@each"),
            ("stratified:best", "stratified:shuffle:jitter@each"),
            ("halton:best", "halton:joint:digits@each"),
            ("hammersley:best", "hammersley:shuffle:shift@each"),
            ("ld:best", "ld:shuffle:owen@each"),
            ("sobol:best", "sobol:joint:owen@each"),
            ("sobol", "sobol:joint:owen@each"),
            ("halton:plain", "halton:step:none"),
            ("ld:shuffle", "ld:shuffle:owen@each"),
            ("center", "center"),
        ] {
            assert!(spec(name).expansion().starts_with(meaning), "{name}: {}", spec(name).expansion());
        }
        assert_eq!(spec("uniform:sheet"), spec("uniform:best"));
        assert_eq!(SamplerSpec::parse("ld", Preset::Sheet).unwrap(), spec("ld:sheet"));
        assert_eq!(spec("halton:sheet").to_string(), "halton:sheet");
    }

    #[test]
    fn every_legal_spec_reads_back_from_its_name() {
        let all = every_legal_spec();
        assert!(all.len() > 80);
        for s in all {
            assert_eq!(spec(&s.to_string()), s, "{s}");
        }
    }

    #[test]
    fn nonsense_names_the_legal_combinations() {
        for (text, needle) in [
            ("haltn", "did you mean \"halton\""),
            ("halton:step:owen", "halton:(step|shuffle|joint):(none|shift|digits)"),
            ("ld:joint", "ld:(step|shuffle)"),
            ("halton:step:none@pixel", "scope only where"),
            ("uniform:plain", "sheet, best"),
            ("sobol:sheet", "best, plain"),
            ("ld:step:xor@each:more", "further part"),
            ("ld:best:owen", "nothing after the preset"),
            ("", "expected a point set"),
        ] {
            let error = SamplerSpec::parse(text, Preset::Best).unwrap_err();
            assert!(error.to_string().contains(needle), "{text}: {error}");
            assert_eq!(error.exit_code(), 2);
        }
    }
}
