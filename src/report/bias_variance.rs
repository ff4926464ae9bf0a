//! Bias² beside variance, sampler by sampler: which part of the error more samples will not cure.

use super::axis::LogAxis;
use super::figure::{Align, Bounds, Colour, Dash, Drawing, Figure, PAGE_WIDTH, Place, shortened, text_width};
use super::frame::{
    FOOT, Frame, HEADING, Header, SMALL, TICK, draw_axis_names, draw_corner, draw_no_data, draw_small_x_ticks,
    draw_x_grid,
};
use super::style::{GREY, INK, Marker, Style, draw_marker, style_of};

/// An estimate that may come out at or below 0, where noise is larger than what is estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The estimate itself.
    pub value: f64,
    /// Its interval, low and high.
    pub interval: Option<(f64, f64)>,
}

/// One sampler: its bias² and variance in the units of the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct BiasVariance {
    /// The sampler, and the count where several are shown.
    pub label: String,
    /// Its style in the other figures; the marker stands before the label.
    pub style: Style,
    /// Squared bias, an unbiased estimate of which may be negative.
    pub bias_squared: Estimate,
    /// Variance between replicates; `None` where nothing is random.
    pub variance: Option<Estimate>,
}

impl BiasVariance {
    /// The row of the sampler `name`, in its style.
    pub fn of_sampler(name: &str, bias_squared: Estimate, variance: Option<Estimate>) -> Self {
        Self { label: name.to_owned(), style: style_of(name), bias_squared, variance }
    }
}

/// Rows under a common heading: a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Heading; empty: none.
    pub title: String,
    /// Samplers, top to bottom.
    pub rows: Vec<BiasVariance>,
}

const ROW: f64 = 25.0;
/// Every second row stands on it.
const STRIPE: Colour = [245; 3];
const HEADING_STEP: f64 = 26.0;
const BIAS: Style = Style { colour: [213, 94, 0], marker: Marker::Diamond, filled: true, dash: Dash::Solid };
const VARIANCE: Style = Style { colour: [0, 114, 178], marker: Marker::Circle, filled: true, dash: Dash::Solid };
/// Width of the strip at the left in which estimates at or below 0 are noted.
const BELOW: f64 = 30.0;

/// One line a sampler on a logarithmic axis (named by `frame.x_label`), bias² and variance side by side with their
/// intervals.
///
/// An estimate at or below 0 is an arrow that points left, from its interval's upper end, or from the left edge where
/// that too is at or below 0: below noise. An interval that reaches down to 0 ends in the same arrow behind its
/// marker. An estimate that is not finite is said to be so. `frame.y_label` and
/// `frame.x_ticks` are not used.
pub fn bias_variance_chart(frame: &Frame, groups: &[Group]) -> Figure {
    drawn(frame, groups).finish(&frame.title)
}

fn drawn(frame: &Frame, groups: &[Group]) -> Drawing {
    let rows = groups.iter().flat_map(|group| &group.rows);
    let widest = rows.clone().map(|row| text_width(&row.label, SMALL, false)).fold(60.0, f64::max).min(220.0);
    let header = Header::new(frame, &[]);
    let headings = groups.iter().filter(|group| !group.title.is_empty()).count() as f64;
    let body = (rows.clone().count() as f64 * ROW + headings * HEADING_STEP).max(60.0) + 8.0;
    let top = header.height + 24.0;
    let mut drawing = Drawing::new(PAGE_WIDTH, top + body + FOOT);
    header.draw(&mut drawing);
    let b = Bounds { left: 12.0 + 20.0 + widest + 12.0, top, right: PAGE_WIDTH - 24.0, bottom: top + body };
    draw_key_line(&mut drawing, b.left, header.height + 6.0);
    let axis = LogAxis::around(rows.flat_map(ends), 0.04, b.left + BELOW, b.right);
    draw_stripes(&mut drawing, groups, &b);
    draw_x_grid(&mut drawing, &b, &axis, &axis.ticks(10), true);
    draw_small_x_ticks(&mut drawing, &b, &axis);
    draw_corner(&mut drawing, &b);
    drawing.text((b.left + BELOW / 2.0 - 2.0, b.bottom + 17.0), "≤ 0", TICK, GREY, Align::Centre);
    draw_axis_names(&mut drawing, &b, &Frame { y_label: String::new(), ..frame.clone() });
    let mut y = b.top + 4.0;
    for group in groups {
        if !group.title.is_empty() {
            drawing.heading((12.0, y + 18.0), &shortened(&group.title, HEADING, true, b.left - 24.0));
            y += HEADING_STEP;
        }
        for row in &group.rows {
            draw_row(&mut drawing, &axis, &b, row, y + ROW / 2.0, widest);
            y += ROW;
        }
    }
    if y < b.top + ROW {
        draw_no_data(&mut drawing, &b);
    }
    drawing
}

fn draw_stripes(drawing: &mut Drawing, groups: &[Group], b: &Bounds) {
    let mut top = b.top + 4.0;
    for group in groups {
        top += if group.title.is_empty() { 0.0 } else { HEADING_STEP };
        for i in (0..group.rows.len()).step_by(2) {
            let y = top + i as f64 * ROW;
            drawing.rectangle(Bounds { left: 12.0, top: y, right: b.right, bottom: y + ROW }, STRIPE, 1.0);
        }
        top += group.rows.len() as f64 * ROW;
    }
}

/// How far below its value an interval's low end may stretch the axis.
const INTERVAL_REACH: f64 = 10.0;

/// What the axis has to hold of a row.
fn ends(row: &BiasVariance) -> Vec<f64> {
    let estimates = std::iter::once(row.bias_squared).chain(row.variance);
    let all = estimates.flat_map(|e| {
        let (low, high) = e.interval.unwrap_or((e.value, e.value));
        [e.value, low.max(e.value / INTERVAL_REACH), high]
    });
    all.filter(|end| end.is_finite() && *end > 0.0).collect()
}

fn draw_key_line(drawing: &mut Drawing, left: f64, y: f64) {
    let mut x = left;
    for (style, name) in [(BIAS, "bias²"), (VARIANCE, "variance")] {
        drawing.line(&[(x, y), (x + 26.0, y)], 2.0, style.colour, Dash::Solid);
        draw_marker(drawing, (x + 13.0, y), 3.8, &style);
        drawing.text((x + 32.0, y + 4.0), name, SMALL, INK, Align::Left);
        x += 32.0 + text_width(name, SMALL, false) + 24.0;
    }
    arrow(drawing, x + 22.0, x, y, GREY);
    drawing.text(
        (x + 30.0, y + 4.0),
        "reaches 0 or below; without a marker the estimate itself does (below noise)",
        SMALL,
        GREY,
        Align::Left,
    );
}

fn draw_row(drawing: &mut Drawing, axis: &LogAxis, b: &Bounds, row: &BiasVariance, y: f64, width: f64) {
    draw_marker(drawing, (21.0, y), 3.6, &row.style);
    drawing.text((32.0, y + 4.0), &shortened(&row.label, SMALL, false, width), SMALL, INK, Align::Left);
    draw_estimate(drawing, axis, b, row.bias_squared, &BIAS, y - 5.5);
    match row.variance {
        Some(variance) => draw_estimate(drawing, axis, b, variance, &VARIANCE, y + 5.5),
        None => drawing.text((b.right - 4.0, y + 9.5), "no variance: nothing random", 10.5, GREY, Align::Right),
    }
}

fn draw_estimate(drawing: &mut Drawing, axis: &LogAxis, b: &Bounds, estimate: Estimate, style: &Style, y: f64) {
    let interval = estimate.interval.filter(|(low, high)| low.is_finite() && high.is_finite());
    if !estimate.value.is_finite() {
        drawing.text((b.left + BELOW + 4.0, y + 4.0), "not finite", 10.5, style.colour, Align::Left);
        return;
    }
    if estimate.value <= 0.0 {
        let from = interval.map_or(0.0, |(_, high)| high);
        let tip = b.left + 5.0;
        arrow(drawing, if from > 0.0 { axis.clamped(from) } else { b.left + BELOW - 6.0 }, tip, y, style.colour);
        return;
    }
    if let Some((low, high)) = interval {
        if low <= 0.0 {
            arrow(drawing, axis.clamped(high), b.left + 5.0, y, style.colour);
        }
        drawing.line(&[(axis.clamped(low), y), (axis.clamped(high), y)], 2.0, style.colour, Dash::Solid);
    }
    draw_marker(drawing, (axis.pixel(estimate.value), y), 3.8, style);
}

/// A horizontal arrow to `tip`.
fn arrow(drawing: &mut Drawing, from: f64, tip: f64, y: f64, colour: Colour) {
    let side = if from > tip { 1.0 } else { -1.0 };
    let head: [Place; 3] = [(tip, y), (tip + side * 7.0, y - 3.5), (tip + side * 7.0, y + 3.5)];
    drawing.line(&[(from, y), (tip + side * 6.0, y)], 1.4, colour, Dash::Solid);
    drawing.area(&head, colour, 1.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64, low: f64, high: f64) -> Estimate {
        Estimate { value, interval: Some((low, high)) }
    }

    fn chart(rows: Vec<BiasVariance>) -> Figure {
        bias_variance_chart(&Frame::default(), &[Group { title: String::new(), rows }])
    }

    #[test]
    fn a_sampler_without_randomness_is_said_to_have_no_variance() {
        let row = BiasVariance::of_sampler("halton:sheet", estimate(1e-3, 5e-4, 2e-3), None);
        assert!(chart(vec![row]).svg.contains("no variance: nothing random"));
    }

    #[test]
    fn estimates_that_no_logarithm_shows_are_drawn_within_the_page() {
        let odd = [f64::NAN, f64::INFINITY, 0.0, -1e-6, 1e-12, 1e3];
        let row = |value| {
            BiasVariance::of_sampler("ld", estimate(value, -value, 2.0 * value), Some(estimate(value, f64::NAN, 1.0)))
        };
        let svg = chart(odd.into_iter().map(row).collect()).svg;
        assert!(svg.contains("not finite") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn without_rows_the_chart_says_no_data() {
        assert!(chart(vec![]).svg.contains("no data"));
        assert!(bias_variance_chart(&Frame::default(), &[]).svg.contains("no data"));
    }

    #[test]
    fn thirty_rows_of_any_size_stay_legible() {
        let row = |i: i32| {
            let value = libm::pow(10.0, f64::from(i) * 0.5 - 12.0) * if i % 3 == 0 { -1.0 } else { 1.0 };
            let variance = (i % 4 != 0).then(|| estimate(value.abs(), value.abs() / 2.0, 2.0 * value.abs()));
            BiasVariance::of_sampler("halton:joint:digits@each", estimate(value, -1e-9, 2.0 * value), variance)
        };
        let group = |title: &str| Group { title: title.to_owned(), rows: (0..30).map(row).collect() };
        drawn(
            &Frame::default(),
            &[group("a01"), group(""), group("a scene with a very long name indeed, wider than the labels")],
        )
        .assert_legible();
    }
}
