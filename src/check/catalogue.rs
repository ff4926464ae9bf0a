//! The catalogue of failures: where samplers, statistics and renderers go wrong, and which check shows it.

use std::fmt::Write;

use super::{Check, FAILURES};

/// A way to fail.
pub struct Failure {
    /// Input and method.
    pub input: &'static str,
    /// Why it goes wrong.
    pub why: &'static str,
    /// What is expected instead.
    pub expected: &'static str,
}

const fn failure(input: &'static str, why: &'static str, expected: &'static str) -> Failure {
    Failure { input, why, expected }
}

/// Row i + 1 of the catalogue is entry i.
pub const CATALOGUE: [Failure; FAILURES as usize] = [
    failure(
        "Halton's base 3 in f32, index 4 782 968 and beyond",
        "the mirrored digits times an inverse power round to 1",
        "every number below 1: integers, rounded down once",
    ),
    failure("van der Corput's 32 bits as f32", "words above 0xFFFFFF80 round to 1", "the top 24 bits alone"),
    failure("24 bits of each number", "all numbers are a little too small", "mean ½ − 2⁻²⁵, strata untouched; said so"),
    failure(
        "Halton's index in 32 bits, at 2³¹ and 2³²",
        "the index wraps around and the sequence starts again",
        "a count beyond 2²⁴ is refused",
    ),
    failure("i/n in f32 for n above 2²⁴", "neighbours become one number", "f64 or integers: n different numbers"),
    failure("frac(i·α) in f32", "at i = 10⁶ a step of 1/16 is all that is left", "fixed-point multiplication"),
    failure("a rank-1 lattice, (i·g) mod n in 32 bits", "i·g overflows", "64 bits"),
    failure(
        "plain Halton in every pixel",
        "all pixels make the same error: a pattern that more replicates do not remove",
        "the error counts as bias; a randomised form is offered",
    ),
    failure(
        "Halton's bases 17 and 19 at 64 points",
        "the points lie on few lines",
        "seen in D* and in the projection's t",
    ),
    failure(
        "one sequence for pixel and lens, or pixel and light",
        "the decisions march in step, only a diagonal is sampled",
        "decisions are decoupled; coupling has to be asked for by name",
    ),
    failure("two samplers of one seed", "their numbers are the same", "seeds are hashed with the decision"),
    failure(
        "the first k of n Hammersley points",
        "x reaches k/n only",
        "D* of half a set is about ½: such a set is fixed in n",
    ),
    failure("more points than a Hammersley set has", "x reaches 1 and beyond", "refused"),
    failure(
        "strata for 6, 7 or 13 samples",
        "strata are missing or count twice",
        "the next count with a factor pair, all strata equal, both counts said",
    ),
    failure(
        "drawing on after a stratified set's last point",
        "the set repeats, or runs over its end",
        "a sample is looked up: an index beyond the set is a mistake of the program",
    ),
    failure(
        "1-D strata for two dimensions, unshuffled",
        "the pairs lie on the diagonal: E xy comes out as ⅓",
        "shuffled: ¼",
    ),
    failure(
        "the (0,2)-sequence at 48 or 1000 points",
        "a net needs a power of two",
        "it works, less evenly, and t and D* show it",
    ),
    failure(
        "a digital shift called Owen scrambling",
        "the points of a net move together: variance of f = x is n times Owen's",
        "called `xor`, and told from `owen` by its variance",
    ),
    failure(
        "Owen scrambling by a weak hash",
        "not nested uniform: variances off by factors",
        "ratio to the exact variance within 5 %",
    ),
    failure(
        "Sobol' without its point 0",
        "what is left is no net: the rate falls from n^−1.5 to n^−1",
        "point 0 is kept",
    ),
    failure("a toroidal shift of a net", "elementary intervals are torn", "t grows; the set is called `shift`"),
    failure("Owen scrambling of both axes by one key", "the axes are coupled", "a key for each axis"),
    failure(
        "a blue-noise mask of few values at many samples",
        "the mask's own steps stay as an error",
        "no mask is used; the floor is shown on quantised numbers",
    ),
    failure(
        "a generator per thread with work stealing",
        "the image depends on who took which tile",
        "the same bits on 1, 2 and 7 threads",
    ),
    failure(
        "the pixel's number as seed of a linear generator",
        "neighbouring streams run side by side",
        "keys are hashed; neighbours are uncorrelated",
    ),
    failure(
        "0, 1 and 2³¹ samples",
        "division by 0, or by n − 1 = 0",
        "0 and more than 2²⁴ are refused; one replicate has no interval",
    ),
    failure("variance as E x² − (E x)², at 10⁹ + {4, 7, 13, 16}", "the digits cancel", "exactly 30"),
    failure("a running mean in f32 of 2²⁵ samples", "increments are lost, the mean stalls", "f64 sums"),
    failure("moments merged in the order of the threads", "not the same bits twice", "a fixed order"),
    failure(
        "L2 discrepancy in f32 at 4096 points",
        "its square comes out negative",
        "f64 with compensation, else no value",
    ),
    failure("an interval from one replicate", "no degrees of freedom", "none is given"),
    failure("replicates that are all equal", "no spread: p is 0/0", "a definite answer, equal or different"),
    failure(
        "Welch's test on rare binary pixels",
        "a hundred times more false alarms than stated",
        "pooled tiles or exact tests",
    ),
    failure("262 144 pixels tested at 1 %", "2621 of them \"differ\" although none does", "corrected for their number"),
    failure("Šidák's level in f32", "it rounds to 0", "by way of expm1 and log1p"),
    failure(
        "p-values 10⁻³⁰⁰, 0, 1 and NaN in Holm's and Benjamini–Hochberg's procedures",
        "order and overflow",
        "monotone, at most 1; NaN is refused",
    ),
    failure(
        "a reference of only four times the samples",
        "its noise adds 25 % to the MSE",
        "two halves make the error unbiased",
    ),
    failure("test and reference of one seed", "they share their error, which then looks small", "refused"),
    failure("s²/n within one correlated set", "off by factors of 13 to 750", "intervals over replicates"),
    failure(
        "a slope through counts that the sampler does not support, or into the reference's noise",
        "not the method's slope",
        "counts are checked, the floor is drawn",
    ),
    failure("NaN, infinite or negative pixels", "they poison a mean or are skipped", "counted; NaN and infinity fail"),
    failure("relative MSE over black, SMAPE of 0/0", "division by 0", "ε in the denominator; 0/0 is 0"),
    failure(
        "a receiver ever nearer to the light",
        "1/r² grows without bound",
        "0 where not in front, else finite and never capped",
    ),
    failure(
        "a point 10⁻⁶ above a light's inside",
        "the variance is huge, the mean is right only slowly",
        "heavy tails are told by the kurtosis",
    ),
    failure("receivers in the light's plane, behind it or turned away", "wrong signs leak light", "exactly 0"),
    failure("absolute values of cosines", "light from behind", "one-sided"),
    failure("light at a grazing angle", "surfaces shadow themselves", "the relative error stays small"),
    failure(
        "shadow rays as long as the distance to the light",
        "they meet the light itself",
        "visible wherever nothing stands between",
    ),
    failure(
        "an absolute epsilon at scales 10⁻⁶ and 10⁶",
        "light leaks or everything is in shadow",
        "offsets relative to the coordinates: the same picture",
    ),
    failure(
        "a light of a triangle without area",
        "its normal and density are 0/0",
        "it adds nothing and is never chosen",
    ),
    failure(
        "no light, a light of power 0, powers 10⁻³⁰ beside 10³⁰",
        "0/0 in the choice",
        "black, never chosen, exact mean",
    ),
    failure("the largest number below 1 picks a light", "index = count", "the last light"),
    failure("a triangle sampled without the root", "points crowd at a corner", "moments of the uniform triangle"),
    failure("a disk sampled at radius u", "points crowd at the centre", "E r = ⅔, E r² = ½"),
    failure("the concentric map at (½, ½)", "0/0", "the centre"),
    failure("a camera that looks along its up vector, or nowhere", "no basis", "refused"),
    failure("fields of view 0, 180, −10 and NaN", "tangents of 0 and infinity", "refused"),
    failure("lens radius 0 and 10⁹", "division by 0; rays start beside the scene", "a pinhole bit for bit; finite"),
    failure("focal depths 0, −1, infinity and NaN", "no direction", "refused; an infinite depth stays finite"),
    failure(
        "a pixel sample exactly on a shared edge",
        "counted twice or never",
        "every point in one pixel: areas add up to 1",
    ),
    failure("pixel coverage by an edge of slope 10⁻¹²", "0/0 by cancellation", "the limit form"),
    failure(
        "a checkerboard of the sample lattice's frequency",
        "aliases to a constant: no noise to be seen",
        "a spike in the spectrum",
    ),
    failure(
        "star discrepancy of tied and ulp-close coordinates",
        "open and closed boxes get confused",
        "the exact value, with its box",
    ),
    failure(
        "the mean of roots of squared discrepancies",
        "smaller than the root of the mean (Jensen)",
        "which one is said",
    ),
    failure(
        "1 and then n − 1 samples with restarted samplers",
        "the first points are drawn twice",
        "one pass; two passes are a named variant",
    ),
];

/// The catalogue as docs/failures.md has it, with the checks among `checks` that show each row.
pub fn markdown(checks: &[Check]) -> String {
    let mut text = String::from(
        "# Where methods fail\n\n\
         Written by `sampler-lab check --list --markdown > docs/failures.md`; not edited by hand.\n\n\
         Each row is a way in which samplers, statistics or renderers go wrong. The checks in its last column state what holds \
         here instead and find out whether it does; `sampler-lab check 12` runs those of row 12.\n\n\
         | # | input and method | why it fails | what is expected | shown by |\n|---|---|---|---|---|\n",
    );
    for (number, Failure { input, why, expected }) in (1u8..).zip(&CATALOGUE) {
        let shows = checks.iter().filter(|c| c.failures.contains(&number)).map(|c| format!("`{}`", c.name));
        let shows = shows.collect::<Vec<_>>().join(" ");
        let _ = writeln!(text, "| {number} | {input} | {why} | {expected} | {shows} |");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_breaks_its_row_and_no_check_names_a_row_that_is_none() {
        for Failure { input, why, expected } in &CATALOGUE {
            assert!([input, why, expected].iter().all(|cell| !cell.is_empty() && !cell.contains(['|', '\n'])));
        }
        for check in super::super::all() {
            assert!(check.failures.iter().all(|row| (1..=FAILURES).contains(row)), "{}", check.name);
        }
    }
}
