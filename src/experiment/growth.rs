//! How large a reference has to be: until its own noise is a stated share of the error it judges.
//!
//! Each half of a growing reference is the mean of K independent batches, K = 1, 2, 4, … With A and B the two halves,
//! n pixel-channels and T_p the *pilots* (replicate 0 of every compared sampler at its most samples):
//!
//! - noise N = mean over pixel-channels of s²/(2K), with s² the variance among all 2K batches: the mean square error of
//!   (A + B)/2. For K = 1 this is mean((A − B)²)/4. It falls as 1/K.
//! - error e_p = mean((T_p − A)(T_p − B)): the pilot's own mean square error, free of the reference's noise on average.
//! - **Rule.** K is the first of 1, 2, 4, … with N⁺ ≤ f² · max(0, min_p e_p), else the most allowed; then the reference
//!   is *limited*: it is not known to be good enough. f is `reference.noise`, N⁺ the upper end of N's 95 % interval.
//!
//! All of it is a function of images that are functions of their ids, so K is the same for any order of work, any number
//! of threads, any interruption, and any part of the plan. Why so, and what the rule may get wrong:
//!
//! - *The noise is estimated, too.* It may sit in a handful of pixels (the rim of a light), and from two halves alone each
//!   pixel's is known with one degree of freedom: small by luck as often as not. Hence the variance among batches, with
//!   2K − 1 of them, and its upper end: at each look a noise above f is let pass at most one time in forty. Freedom over
//!   pixels is Welch–Satterthwaite's, ν = (2K − 1)(Σσ²)²/Σσ⁴ with σ² a pixel's variance summed over its channels (they
//!   share their samples), as measured: on the cautious side.
//! - *A minimum is too small on average*, E min e_p ≤ min E e_p. That errs to a larger K: samples, never accuracy.
//! - *An error below the noise* comes out near 0 or below, and the reference grows on. To stop by mistake a pilot of no
//!   error would have to come out at N/f², where its standard deviation is 2N/√n: √n/(2f²) of them, more than 15 from
//!   n = 1000 alike pixel-channels on for any f ≤ 1. At the border N = f²e it is 2f√(1 + f²)/√n of e: 4 % at f = 0.2 even
//!   if only 100 hold all of the error.
//! - *A pilot is one replicate.* Its error scatters about its sampler's. Reports look again, with all replicates at every
//!   count, and mark what the reference does not reach.
//!
//! Where N = 0, as on a black image, nothing is left to reach.

use serde::{Deserialize, Serialize};

use crate::stats::{Estimate, sum, variance_interval};

/// Raised whenever the rule may stop at another K.
pub const RULE: u32 = 1;

/// How far a reference grew, in its row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Growth {
    /// Batches of each half, K.
    pub batches: u32,
    /// The most that K might have been.
    pub most_batches: u32,
    /// f: the share of the smallest RMSE judged that the reference's own RMSE had to reach.
    pub noise: f64,
    /// 95 % interval of the row's `noise_mse`; its upper end is what the rule compares.
    pub noise_mse_ci95: [f64; 2],
    /// Smallest unbiased mean square error of the pilots, min e_p; at or below 0 where it drowns in the noise.
    pub pilot_mse: f64,
    /// Id of that pilot.
    pub pilot: String,
    /// Whether the most was reached and the noise is still above its share.
    pub is_limited: bool,
}

/// Whether noise of mean square `noise_mse` is at most the share `f` (of roots) of an error of mean square `mse`.
pub fn is_enough(noise_mse: f64, mse: f64, f: f64) -> bool {
    noise_mse <= f * f * mse.max(0.0)
}

/// The smallest of the pilots' errors, the first of equal ones.
///
/// # Panics
/// Without a pilot: every scene compares a sampler.
pub fn least(pilots: &[(String, f64)]) -> &(String, f64) {
    pilots.iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("an experiment compares at least one sampler")
}

/// Sums of the batches of the two halves, pixel-channel by pixel-channel in the order of the batches, and their spread.
pub struct Sums {
    halves: [Vec<[f64; 3]>; 2],
    /// Mean of all batches of both halves so far.
    mean: Vec<[f64; 3]>,
    /// Sum of their squared deviations from it (Welford 1962).
    squares: Vec<[f64; 3]>,
    /// Batches in each half's sum.
    batches: u32,
}

impl Sums {
    /// Nothing yet, of an image of so many pixels.
    pub fn new(pixels: usize) -> Self {
        let nothing = || vec![[0.0; 3]; pixels];
        Self { halves: [nothing(), nothing()], mean: nothing(), squares: nothing(), batches: 0 }
    }

    /// How many batches each half is the sum of.
    pub fn batches(&self) -> u32 {
        self.batches
    }

    /// Adds the next batch of both halves.
    ///
    /// # Panics
    /// Where an image is of another size.
    pub fn add(&mut self, batch: [&[[f32; 3]]; 2]) {
        for (half, pixels) in batch.into_iter().enumerate() {
            assert_eq!(self.mean.len(), pixels.len(), "batches of one size");
            let count = f64::from(2 * self.batches) + half as f64 + 1.0;
            for (i, pixel) in pixels.iter().enumerate() {
                for (c, channel) in pixel.iter().map(|&channel| f64::from(channel)).enumerate() {
                    self.halves[half][i][c] += channel;
                    let before = channel - self.mean[i][c];
                    self.mean[i][c] += before / count;
                    self.squares[i][c] += before * (channel - self.mean[i][c]);
                }
            }
        }
        self.batches += 1;
    }

    /// Mean square error of the mean of all batches, with its 95 % interval as it is written.
    ///
    /// # Panics
    /// Before the first batch.
    pub fn noise_mse(&self) -> Estimate {
        assert!(self.batches > 0, "noise of nothing");
        let batches = f64::from(2 * self.batches);
        let by_pixel = || self.squares.iter().map(|[r, g, b]| (r + g + b) / (batches - 1.0));
        let total = sum(by_pixel());
        let noise = total / batches / (3.0 * self.squares.len() as f64);
        // In shares of the total, so that tiny variances do not underflow when squared.
        let shares = sum(by_pixel().map(|variance| (variance / total) * (variance / total)));
        let freedom = (batches - 1.0) / shares;
        let ends = if total > 0.0 { variance_interval(noise, freedom, 0.95) } else { [noise; 2] };
        Estimate { value: noise, ci95: Some(ends) }.with_rounded_interval()
    }

    /// The halves: means over the batches, rounded once to `f32`; one batch is its own mean bit for bit.
    pub fn means(&self) -> [Vec<[f32; 3]>; 2] {
        let count = f64::from(self.batches);
        self.halves.each_ref().map(|sums| sums.iter().map(|sum| sum.map(|sum| (sum / count) as f32)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enough_is_a_share_of_roots_and_an_error_below_the_noise_never_is() {
        assert!(is_enough(4.0e-4, 0.01, 0.2) && !is_enough(4.1e-4, 0.01, 0.2));
        assert!(!is_enough(1e-30, 0.0, 1.0) && !is_enough(1e-30, -1.0, 1.0));
        assert!(is_enough(0.0, 0.0, 0.1) && is_enough(0.0, -0.0, 0.1), "nothing left to reach");
        assert!(!is_enough(f64::NAN, 1.0, 1.0) && !is_enough(1.0, f64::NAN, 1.0));
    }

    #[test]
    fn the_least_pilot_is_the_first_of_the_smallest() {
        let pilots = [("a", 2.0), ("b", -1.0), ("c", -1.0)].map(|(id, mse)| (id.to_owned(), mse));
        assert_eq!(least(&pilots), &("b".to_owned(), -1.0));
    }

    #[test]
    fn one_batch_is_its_own_mean_and_two_are_averaged_once() {
        let (a, b) = ([[0.1f32, -0.0, 3e38]], [[0.2f32, 1.0, 3e38]]);
        let mut sums = Sums::new(1);
        sums.add([&a, &b]);
        assert_eq!(sums.means(), [a.to_vec(), b.to_vec()]);
        sums.add([&b, &a]);
        // The f32 sum of two such channels would be infinite.
        assert_eq!(sums.means()[0], [[((f64::from(0.1f32) + f64::from(0.2f32)) / 2.0) as f32, 0.5, 3e38]]);
        assert_eq!(sums.batches(), 2);
    }

    #[test]
    fn noise_is_the_variance_of_the_mean_of_all_batches() {
        let image = |value: f32| [[value, 0.0, 2.0 * value], [5.0; 3]];
        let mut sums = Sums::new(2);
        sums.add([&image(1.0), &image(4.0)]);
        // Two numbers 3 and 6 apart: ((3² + 6²)/4)/6 over six channels, as mean((A − B)²)/4 has it.
        let Estimate { value: noise, ci95: Some([low, high]) } = sums.noise_mse() else { panic!("an interval") };
        assert!((noise - 45.0 / 24.0).abs() < 1e-15);
        // One pixel has it all: one degree of freedom, χ² quantiles 0.000982 and 5.024 (tables).
        assert!((noise / high / 9.820_69e-4 - 1.0).abs() < 1e-5 && (noise / low / 5.023_886 - 1.0).abs() < 1e-5);
        sums.add([&image(2.0), &image(3.0)]);
        // 1 2 3 4 has variance 5/3: (1 + 4)(5/3)/4 over six channels.
        assert!((sums.noise_mse().value - 5.0 * (5.0 / 3.0) / 4.0 / 6.0).abs() < 1e-15);
        let mut dark = Sums::new(1);
        dark.add([&[[0.0; 3]], &[[0.0; 3]]]);
        assert_eq!(dark.noise_mse(), Estimate { value: 0.0, ci95: Some([0.0; 2]) });
    }

    /// 400 references of 300 pixels, of which three have all the noise: the interval's upper end is below the truth at
    /// most about 1 time in 40 (expected 10 of 400, 22 is four standard errors), for two batches and for eight.
    #[test]
    fn the_upper_end_of_the_noise_is_seldom_below_the_truth_even_where_few_pixels_have_it() {
        use rand_pcg::Pcg64;
        use rand_pcg::rand_core::Rng;
        let mut random = Pcg64::new(7, 1);
        // Twelve uniform numbers: variance 1, near enough to normal.
        let mut normal = || (0..12).map(|_| (random.next_u64() >> 11) as f64 * 0.5f64.powi(53)).sum::<f64>() - 6.0;
        for batches in [1, 4] {
            let mut misses = 0;
            for _ in 0..400 {
                let mut sums = Sums::new(300);
                for _ in 0..batches {
                    let mut batch = || {
                        let mut pixels = vec![[1.0f32; 3]; 300];
                        pixels[..3].iter_mut().for_each(|pixel| *pixel = [normal() as f32; 3]);
                        pixels
                    };
                    sums.add([&batch(), &batch()]);
                }
                let truth = 3.0 / 300.0 / f64::from(2 * batches);
                misses += i32::from(sums.noise_mse().ci95.is_some_and(|[_, high]| high < truth));
            }
            assert!(misses <= 22, "{batches}: {misses} of 400");
        }
    }
}
