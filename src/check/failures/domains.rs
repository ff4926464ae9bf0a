//! Every sampler at the ends of its documented domain: counts, indices, dimensions, and what lies beyond.

use crate::sampling::hash::unit_f32;
use crate::sampling::radical::{PRIMES, radical_inverse, radical_inverse_f64};
use crate::sampling::sobol::{DIMENSIONS, SobolAxis};
use crate::sampling::{
    LAYOUT_DIMENSIONS, MAX_SAMPLES, PixelKey, PointSource, Points, Sampler, SamplerSpec, every_legal_spec,
};

use super::super::{Check, Context, Finding, Kind, Tally};
use super::common::{Tickets, all, net_t, pixel};

/// The checks of this file.
pub fn checks() -> Vec<Check> {
    let check = |name, claim, run| Check {
        name,
        group: "failures: counts",
        claim,
        failures: &[13, 15],
        kind: Kind::Exact,
        run,
    };
    vec![
        check(
            "domain-of-counts",
            "every sampler gives numbers in [0, 1) at 1, 2, 3, 2²⁴ − 1 and 2²⁴ samples, first and last, and refuses 0 and more, and indices beyond",
            domain_of_counts,
        ),
        check(
            "domain-of-sets",
            "every sampler is a net at powers of two, and may be stopped early, exactly where docs/domains.md says so",
            domain_of_sets,
        ),
        check(
            "domain-of-dimensions",
            "Halton's 16 bases and Sobol's 256 dimensions hold to the last index; there is no 257th, and no scene asks for more than 7",
            domain_of_dimensions,
        ),
    ]
}

fn with_numbers() -> Vec<SamplerSpec> {
    every_legal_spec().into_iter().filter(|s| s.points != Points::Center).collect()
}

fn domain_of_counts(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    let seed = context.seed_of(0, 0);
    let corners = [PixelKey::new(0, 0), PixelKey::new(u32::MAX, u32::MAX)];
    let (mut numbers, mut refused) = (0, 0);
    for spec in with_numbers() {
        for asked in [1, 2, 3, MAX_SAMPLES - 1, MAX_SAMPLES] {
            let sampler = match Sampler::new(spec, &tickets.layout, asked, seed) {
                Ok(sampler) => sampler,
                Err(error) => {
                    tally.fact(format!("{spec} takes {asked} samples, but: {error}"), false);
                    continue;
                }
            };
            let n = sampler.samples();
            tally.fact(
                format!("{spec} takes {n} for {asked}"),
                n == spec.taken(asked)
                    && (asked..=spec.domain().most).contains(&n)
                    && (n == asked || spec.domain().raises_count),
            );
            let ends = [0, n / 2, n - 1];
            let inside = corners.iter().all(|&key| {
                ends.iter().all(|&i| tickets.coordinates(&sampler, key, i).iter().all(|u| (0.0..1.0).contains(u)))
            });
            numbers += corners.len() * ends.len() * LAYOUT_DIMENSIONS as usize;
            tally.fact(format!("{spec}, {n} samples: first, middle and last numbers lie in [0, 1)"), inside);
            let last = sampler.check_index(u64::from(n) - 1).is_ok();
            let beyond = [u64::from(n), u64::from(u32::MAX), u64::MAX];
            tally.fact(
                format!("{spec}, {n} samples: index n − 1 is there, n and beyond are refused"),
                last && beyond.iter().all(|&i| sampler.check_index(i).is_err_and(|e| e.exit_code() == 2)),
            );
        }
        for asked in [0, spec.domain().most + 1, u32::MAX] {
            let error = Sampler::new(spec, &tickets.layout, asked, seed).err();
            let named =
                |e: crate::error::Error| e.exit_code() == 2 && e.to_string().ends_with(&format!("found {asked}"));
            tally.fact(format!("{spec} refuses {asked} samples and names them"), error.is_some_and(named));
            refused += 1;
        }
    }
    tally.saying(format!("{numbers} numbers of {} samplers in [0, 1), {refused} counts refused", with_numbers().len()))
}

fn domain_of_sets(context: &Context) -> Finding {
    let mut tally = Tally::new();
    let tickets = Tickets::new();
    let seed = context.seed_of(0, 0);
    let (mut nets, mut sequences) = (0, 0);
    for spec in with_numbers() {
        let sampler = |n, seed| Sampler::new(spec, &tickets.layout, n, seed).unwrap_or_else(|e| panic!("{e}"));
        let sets = |n: u32| {
            let set = |i| net_t(&all(&sampler(n, context.seed_of(1, i)), pixel(i as u32), &tickets.pixel));
            (0..8).map(set).collect::<Vec<_>>()
        };
        let domain = spec.domain();
        if domain.is_net {
            nets += 1;
            for m in 0..=8 {
                let found = sets(1 << m);
                tally.fact(format!("{spec}: t of 2^{m} points {found:?}"), found.iter().all(|t| *t == Some(0)));
            }
        } else {
            // By chance one may be: a shifted Hammersley set of 256 points in 3.6 % of cases, all 8 in 3e-12.
            let found = sets(256);
            tally.fact(format!("{spec} is no net: t of 256 points {found:?}"), found.iter().any(|t| *t != Some(0)));
        }
        // 60 samples and 100 both have a grid; 100 need one digit more in bases 3 and 7.
        let (short, long) = (sampler(60, seed), sampler(100, seed));
        let first = |sampler: &Sampler| (0..60).map(|i| tickets.coordinates(sampler, pixel(1), i)).collect::<Vec<_>>();
        let same = first(&short) == first(&long);
        sequences += u32::from(domain.is_sequence);
        tally.fact(
            format!("{spec}: the first 60 of 100 samples are{} the 60 of 60", if same { "" } else { " not" }),
            same == domain.is_sequence,
        );
    }
    tally.saying(format!(
        "{nets} of {} samplers are nets at powers of two, {sequences} may be stopped early",
        with_numbers().len()
    ))
}

fn domain_of_dimensions(_: &Context) -> Finding {
    let mut tally = Tally::new();
    let last = MAX_SAMPLES - 1;
    for base in PRIMES {
        for index in [0, 1, base - 1, base, last - 1, last] {
            let found = f64::from(unit_f32(radical_inverse(base, index)));
            let below = radical_inverse_f64(base, index) - found;
            tally.fact(
                format!("base {base}, index {index}: {found} is below 1, and {below:e} below the exact value"),
                found < 1.0 && (-f64::EPSILON..2f64.powi(-24) + 2f64.powi(-32)).contains(&below),
            );
        }
    }
    for dimension in [0, 1, LAYOUT_DIMENSIONS - 1, DIMENSIONS - 1] {
        match SobolAxis::new(dimension) {
            Some(axis) => {
                // An upper triangular matrix with ones on the diagonal is what makes each axis a permutation of strata.
                let triangular = axis.columns().iter().enumerate().all(|(j, c)| c.trailing_zeros() == 31 - j as u32);
                tally.fact(format!("Sobol' dimension {dimension} has a triangular matrix"), triangular);
                let inside = [0, 1, last].iter().all(|&i| unit_f32(axis.fraction(i)) < 1.0);
                tally.fact(format!("Sobol' dimension {dimension} stays below 1"), inside);
            }
            None => {
                tally.fact(format!("there is a Sobol' dimension {dimension}"), false);
            }
        }
    }
    tally.fact("there is no Sobol' dimension 256", SobolAxis::new(DIMENSIONS).is_none());
    let claimed = Tickets::new().layout.dimensions();
    tally.fact(format!("a scene claims at most {claimed} dimensions"), claimed == LAYOUT_DIMENSIONS && claimed == 7);
    tally.saying(format!(
        "16 bases and {DIMENSIONS} Sobol' dimensions hold at indices 0 to 2²⁴ − 1; a scene claims {claimed}"
    ))
}
