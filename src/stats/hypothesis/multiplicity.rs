//! Many tests at once: p-values adjusted for their number.

use crate::error::{Error, Result};
use crate::mutants::{Mutant, planted};

/// p-values are probabilities: anything else is an error that names its place in the list.
fn ranked(p_values: &[f64]) -> Result<Vec<usize>> {
    if let Some(i) = p_values.iter().position(|p| !(0.0..=1.0).contains(p)) {
        return Err(Error::input(
            format!("p-value {i}"),
            format!("expected a number in [0, 1], found {}", p_values[i]),
        ));
    }
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    Ok(order)
}

/// Holm's adjusted p-values, in input order: max over j ≤ i of min(1, (N − j + 1) p_(j)). Controls the family-wise
/// rate.
///
/// # Errors
/// A value that is NaN or outside [0, 1].
pub fn holm(p_values: &[f64]) -> Result<Vec<f64>> {
    let mut adjusted = vec![0.0; p_values.len()];
    let mut largest: f64 = 0.0;
    for (rank, i) in ranked(p_values)?.into_iter().enumerate() {
        let left = if planted(Mutant::HolmFromTheWrongEnd) { rank + 1 } else { p_values.len() - rank };
        largest = largest.max((left as f64 * p_values[i]).min(1.0));
        adjusted[i] = largest;
    }
    Ok(adjusted)
}

/// Benjamini and Hochberg's adjusted p-values, in input order: min over j ≥ i of min(1, N p_(j)/j). Controls the
/// share of false finds.
///
/// # Errors
/// A value that is NaN or outside [0, 1].
pub fn benjamini_hochberg(p_values: &[f64]) -> Result<Vec<f64>> {
    let mut adjusted = vec![0.0; p_values.len()];
    let mut smallest: f64 = 1.0;
    for (rank, i) in ranked(p_values)?.into_iter().enumerate().rev() {
        smallest = smallest.min(p_values.len() as f64 * p_values[i] / (rank + 1) as f64);
        adjusted[i] = smallest;
    }
    Ok(adjusted)
}
