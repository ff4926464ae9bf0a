//! A comparison as text for people.

use std::fmt;

use super::{Comparison, Errors, Metric};
use crate::stats::Estimate;

/// Metrics of the table of images; the others have a line below it.
const COLUMNS: [Metric; 9] = [
    Metric::Mse,
    Metric::Rmse,
    Metric::MseUnbiased,
    Metric::RelMse,
    Metric::Mae,
    Metric::Smape,
    Metric::Bias,
    Metric::MaxAbs,
    Metric::Flip,
];

/// Width of a column of numbers.
const WIDTH: usize = 13;

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "reference  {}", self.reference)?;
        if let (Some(name), Some(noise)) = (&self.reference2, self.reference_noise_mse) {
            write!(f, " and {name}, whose mean has a mean square error of {noise:.5e}")?;
        }
        writeln!(f, "; {} pixels\n", self.size)?;
        let names = self.images.iter().map(|image| image.file.as_str());
        let width = names.map(|name| name.chars().count()).max().unwrap_or(0).max("image".len());
        let columns =
            || COLUMNS.into_iter().filter(|&metric| self.images.iter().any(|i| i.errors.get(metric).is_some()));
        write!(f, "{:width$}", "image")?;
        for metric in columns() {
            write!(f, " {:>WIDTH$}", metric.name())?;
        }
        for image in &self.images {
            write!(f, "\n{:width$}", image.file)?;
            for metric in columns() {
                write!(f, " {:>WIDTH$}", number(image.errors.get(metric).map(|e| e.value)))?;
            }
        }
        writeln!(f, "\n\nwithout the worst {} of the pixels (0.01 %, at least one)", self.trimmed_pixels)?;
        for image in &self.images {
            write!(f, "{:width$}", image.file)?;
            for metric in [Metric::MseTrimmed, Metric::RelMseTrimmed] {
                let value = |metric| number(image.errors.get(metric).map(|e: Estimate| e.value));
                write!(f, "  {} {}", metric.name(), value(metric))?;
            }
            writeln!(f)?;
        }
        writeln!(f, "\n{}", self.viewing)?;
        if let Some(replicates) = &self.replicates {
            writeln!(f, "\n{} replicates of one estimator: mean and 95 % interval", replicates.count)?;
            write_ensemble(f, &replicates.errors)?;
        }
        if let Some(gate) = &self.gate {
            writeln!(f, "\ngate  {}: {}", gate.expression, if gate.passed { "holds" } else { "FAILS" })?;
        }
        Ok(())
    }
}

/// A line for each metric that has a number.
fn write_ensemble(f: &mut fmt::Formatter<'_>, errors: &Errors) -> fmt::Result {
    for (metric, estimate) in errors.iter() {
        let Some(estimate) = estimate else { continue };
        write!(f, "  {:<16}{:>WIDTH$}", metric.name(), number(Some(estimate.value)))?;
        match estimate.ci95 {
            Some([low, high]) => writeln!(f, "  [{low:.5e}, {high:.5e}]")?,
            None => writeln!(f, "  no interval")?,
        }
    }
    Ok(())
}

/// Six significant digits, or a dash.
fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.5e}"))
}
