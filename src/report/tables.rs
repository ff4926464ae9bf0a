//! Summaries as comma-separated tables. Nothing in them comes from a clock.

use std::fmt::Write;

use crate::stats::{Estimate, IntervalKind};

use super::provenance;
use super::summarise::{Cell, Summary};

/// `summary.csv`: one line a scene, sampler and count, below one line of provenance. Intervals are 95 % ones; empty
/// fields stand for what cannot be had.
pub fn summary_csv(summary: &Summary) -> String {
    let mut text = format!("# {}\n", provenance::line(&summary.about));
    text += "scene,sampler,stands_for,row,spp_asked,spp_taken,replicates,nothing_random";
    for metric in ["rmse", "mse", "rel_mse", "bias2", "variance", "bias", "error_autocorrelation"] {
        let _ = write!(text, ",{metric},{metric}_low,{metric}_high");
    }
    text += ",reference_noise_mse,reference_limited";
    for metric in ["flip", "low_frequency_share", "blur_1", "blur_2"] {
        let _ = write!(text, ",{metric},{metric}_low,{metric}_high");
    }
    text += ",white_low_frequency_share,p_white\n";
    for cell in &summary.cells {
        text += &cell_line(summary, cell);
    }
    text
}

fn cell_line(summary: &Summary, cell: &Cell) -> String {
    let (scene, sampler) = (&summary.scenes[cell.scene], &summary.samplers[cell.sampler]);
    let mut line = [
        quoted(&scene.name),
        quoted(&sampler.names.join(" = ")),
        quoted(&sampler.canonical),
        cell.id.clone(),
        cell.spp.asked.to_string(),
        cell.spp.taken.to_string(),
        cell.replicates.to_string(),
        cell.is_fixed.to_string(),
    ]
    .join(",");
    let estimates = [
        cell.rmse,
        Some(cell.mse),
        Some(cell.rel_mse),
        Some(cell.bias2),
        cell.variance,
        Some(cell.bias),
        cell.error_autocorrelation,
    ];
    for estimate in estimates {
        line += &estimate_fields(estimate);
    }
    let noise = scene.reference.as_ref().map(|reference| reference.noise_mse.to_string());
    let _ = write!(line, ",{},{}", noise.unwrap_or_default(), cell.is_reference_limited);
    let spectrum = cell.error_spectrum.as_ref();
    let [share, blur_1, blur_2] = [
        spectrum.and_then(|found| found.low_share),
        spectrum.and_then(|found| found.blur_1),
        spectrum.and_then(|found| found.blur_2),
    ];
    for estimate in [cell.flip, share, blur_1, blur_2] {
        line += &estimate_fields(estimate);
    }
    let field = |number: Option<f64>| number.map(|number| number.to_string()).unwrap_or_default();
    let _ = writeln!(
        line,
        ",{},{}",
        field(spectrum.map(|found| found.white_low_share)),
        field(spectrum.and_then(|found| found.p_white))
    );
    line
}

/// `slopes.csv`: one line a scene and sampler, below one line of provenance.
pub fn slopes_csv(summary: &Summary) -> String {
    let mut text = format!("# {}\n", provenance::line(&summary.about));
    text += "scene,sampler,stands_for,slope,slope_low,slope_high,points,interval,counts\n";
    for slope in &summary.slopes {
        let (scene, sampler) = (&summary.scenes[slope.scene], &summary.samplers[slope.sampler]);
        let names = [quoted(&scene.name), quoted(&sampler.names.join(" = ")), quoted(&sampler.canonical)];
        text += &names.join(",");
        let fit = slope.fit.as_ref();
        // Six digits, as all intervals: resampling deserves no more.
        let estimate = fit.map(|fit| Estimate { value: fit.slope, ci95: fit.ci95.map(|ends| ends.map(six_digits)) });
        text += &estimate_fields(estimate);
        let kind = fit.map(|fit| match fit.interval {
            IntervalKind::Bootstrap => "bootstrap",
            IntervalKind::Residuals => "residuals",
        });
        let counts: Vec<String> = slope.counts.iter().map(u32::to_string).collect();
        let points = fit.map_or(0, |fit| fit.points);
        let _ = writeln!(text, ",{points},{},{}", kind.unwrap_or_default(), counts.join(" "));
    }
    text
}

/// `,value,low,high`.
pub(super) fn estimate_fields(estimate: Option<Estimate>) -> String {
    let field = |number: Option<f64>| number.map(|number| number.to_string()).unwrap_or_default();
    let ends = estimate.and_then(|estimate| estimate.ci95);
    format!(
        ",{},{},{}",
        field(estimate.map(|estimate| estimate.value)),
        field(ends.map(|ends| ends[0])),
        field(ends.map(|ends| ends[1]))
    )
}

fn six_digits(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// A field as RFC 4180 wants it.
pub(super) fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_with_commas_and_quotes_are_quoted() {
        assert_eq!(quoted("plain"), "plain");
        assert_eq!(quoted("a, \"b\""), "\"a, \"\"b\"\"\"");
        assert_eq!(estimate_fields(None), ",,,");
        assert_eq!(estimate_fields(Some(Estimate::without_interval(-0.5))), ",-0.5,,");
    }
}
