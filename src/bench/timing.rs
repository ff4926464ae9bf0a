//! Repeats in turn, within a budget of seconds.

use std::time::{Duration, Instant};

use super::summary::Found;
use crate::error::Result;
use crate::stats::fit::{loglog_slope, slope_with_interval};

/// A quantity that each repeat of a case finds.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// What is added to the case's name; may be empty.
    pub suffix: String,
    /// Unit.
    pub unit: &'static str,
}

/// One repeat: a number for each part; one that is not finite was not found this time and does not count.
pub type Repeat = Box<dyn FnMut() -> Result<Vec<f64>>>;

/// One thing that is measured.
pub struct Case {
    /// Group, then what it is measured on, with slashes between.
    pub name: String,
    /// What each repeat finds.
    pub parts: Vec<Part>,
    /// Sizes that the parts belong to: then the parts are seconds, and their power of the size is found, too.
    pub sizes: Option<Vec<f64>>,
    /// Most repeats; the first of several is a warm-up and does not count.
    pub most: usize,
    /// Makes ready what the repeats need.
    pub prepare: Box<dyn FnOnce() -> Result<Repeat>>,
}

/// Repeats that are made even where the budget does not allow for them.
const LEAST: usize = 3;
/// Repeats beyond which nothing is learnt.
pub const MOST: usize = 40;

impl Case {
    /// A case with one quantity.
    pub fn one(
        name: String,
        unit: &'static str,
        prepare: impl FnOnce() -> Result<Box<dyn FnMut() -> f64>> + 'static,
    ) -> Self {
        let prepare = || {
            let mut once = prepare()?;
            let repeat: Repeat = Box::new(move || Ok(vec![once()]));
            Ok(repeat)
        };
        let parts = vec![Part { suffix: String::new(), unit }];
        Self { name, parts, sizes: None, most: MOST, prepare: Box::new(prepare) }
    }
}

/// Seconds that `work` takes.
pub fn seconds<T>(work: impl FnOnce() -> T) -> f64 {
    let started = Instant::now();
    std::hint::black_box(work());
    started.elapsed().as_secs_f64()
}

/// Measures the cases of one group within about `budget`: all are readied and warmed up, then repeated in turn.
///
/// # Errors
/// Those of a case.
pub fn run(cases: Vec<Case>, budget: Duration, told: &mut dyn FnMut(&str)) -> Result<Vec<Found>> {
    let started = Instant::now();
    let mut running = Vec::new();
    for case in cases {
        told(&case.name);
        let mut repeat = (case.prepare)()?;
        if case.most > 1 {
            repeat()?;
        }
        running.push((case.name, case.parts, case.sizes, case.most, repeat, Vec::<Vec<f64>>::new()));
    }
    for round in 0..MOST {
        if round >= LEAST && started.elapsed() >= budget {
            break;
        }
        for (name, _, _, most, repeat, values) in &mut running {
            if round < *most {
                told(name);
                values.push(repeat()?);
            }
        }
    }
    let mut found = Vec::new();
    for (name, parts, sizes, _, _, values) in &running {
        for (k, part) in parts.iter().enumerate() {
            let column: Vec<f64> = values.iter().map(|row| row[k]).collect();
            found.extend(Found::of(format!("{name}{}", part.suffix), part.unit, &column));
        }
        if let Some(sizes) = sizes {
            found.extend(exponent(name, sizes, values));
        }
    }
    Ok(found)
}

/// The power of the size by which the seconds grow: median over the repeats; the interval resamples them.
fn exponent(name: &str, sizes: &[f64], values: &[Vec<f64>]) -> Option<Found> {
    let slopes: Vec<f64> = values.iter().filter_map(|row| Some(loglog_slope(sizes, row)?.slope)).collect();
    let mut found = Found::of(format!("{name}/exponent"), "1", &slopes)?;
    // That fit is made for mean squares, of which it takes half the slope: squares go in.
    let squares: Vec<Vec<f64>> = (0..sizes.len()).map(|k| values.iter().map(|row| row[k] * row[k]).collect()).collect();
    found.interval = slope_with_interval(sizes, &squares, 1).and_then(|fit| fit.ci95);
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counting(name: &str, most: usize, sizes: Option<Vec<f64>>) -> Case {
        let powers = sizes.clone().unwrap_or(vec![1.0]);
        let parts = powers.iter().map(|n| Part { suffix: format!("/{n}"), unit: "s" }).collect();
        let prepare = move || {
            let mut count = 0.0;
            let repeat: Repeat = Box::new(move || {
                count += 1.0;
                let row = powers.iter().map(|n| (1.0 + 0.001 * count) * n * n.sqrt()).collect();
                Ok(row)
            });
            Ok(repeat)
        };
        Case { name: name.into(), parts, sizes, most, prepare: Box::new(prepare) }
    }

    #[test]
    fn repeats_come_in_turn_and_the_warm_up_does_not_count() {
        let mut order = Vec::new();
        let cases = vec![counting("a", MOST, None), counting("b", 1, None)];
        let found = run(cases, Duration::ZERO, &mut |name| order.push(name.to_owned())).unwrap();
        assert_eq!(order, ["a", "b", "a", "b", "a", "a"]);
        assert_eq!((found[0].runs, found[0].min), (3, 1.002));
        assert_eq!((found[1].runs, found[1].min), (1, 1.001));
    }

    #[test]
    fn a_power_of_the_size_is_found() {
        let cases = vec![counting("c", MOST, Some(vec![1.0, 10.0, 100.0]))];
        let found = run(cases, Duration::ZERO, &mut |_| ()).unwrap();
        let exponent = found.last().unwrap();
        assert_eq!((found.len(), exponent.name.as_str()), (4, "c/exponent"));
        assert!((exponent.median - 1.5).abs() < 1e-12);
        let [low, high] = exponent.interval.unwrap();
        assert!(low <= 1.5 && 1.5 <= high && high - low < 0.01);
    }
}
