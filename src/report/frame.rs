//! What every chart has around its data: titles, grid, ticks and names of axes.

use super::axis::{LogAxis, number_label};
use super::figure::{Align, Bounds, Colour, Dash, Drawing, PAGE_WIDTH, Text, shortened, text_width, wrapped};
use super::labels::kept_apart;
use super::style::{GREY, GRID, INK, PALE};

/// What stands around the plots of a figure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Frame {
    /// First line, bold.
    pub title: String,
    /// Second line: metric, n, scene, replicates, level.
    pub subtitle: String,
    /// Quantity and unit of the horizontal axis.
    pub x_label: String,
    /// Quantity and unit of the vertical axis.
    pub y_label: String,
    /// Values of x to label; empty: every measured x where they are at most 12, else powers of ten.
    pub x_ticks: Vec<f64>,
}

/// Text sizes in pixels.
pub(super) const TITLE: f64 = 16.0;
pub(super) const HEADING: f64 = 13.0;
pub(super) const SMALL: f64 = 12.0;
pub(super) const TICK: f64 = 11.5;
/// Room below a plot for tick labels and the horizontal name.
pub(super) const FOOT: f64 = 46.0;
const WARNING: Colour = [166, 64, 0];

/// How many points a logarithm cannot show.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct LeftOut {
    pub not_finite: usize,
    pub not_positive: usize,
    /// Labels of series that have no point to show.
    pub empty: Vec<String>,
}

impl LeftOut {
    /// All of them together.
    pub fn sum(parts: &[Self]) -> Self {
        parts.iter().fold(Self::default(), |sum, part| Self {
            not_finite: sum.not_finite + part.not_finite,
            not_positive: sum.not_positive + part.not_positive,
            empty: sum.empty.iter().chain(&part.empty).cloned().collect(),
        })
    }

    /// Whether a point of these coordinates can be shown; counts it where not.
    pub fn admits(&mut self, coordinates: &[f64]) -> bool {
        let finite = coordinates.iter().all(|c| c.is_finite());
        let positive = coordinates.iter().all(|&c| c > 0.0);
        self.not_finite += usize::from(!finite);
        self.not_positive += usize::from(finite && !positive);
        finite && positive
    }

    /// What the header says about them.
    pub fn note(&self) -> Option<String> {
        let count = |n: usize, why: &str| {
            (n > 0).then(|| format!("{n} point{} not shown: {why}", if n == 1 { "" } else { "s" }))
        };
        let mut empty = self.empty.clone();
        empty.sort();
        empty.dedup();
        let empty = (!empty.is_empty()).then(|| format!("no data: {}", empty.join(", ")));
        let notes = [count(self.not_positive, "not above 0"), count(self.not_finite, "not finite"), empty];
        let notes: Vec<String> = notes.into_iter().flatten().collect();
        (!notes.is_empty()).then(|| notes.join(" · "))
    }
}

/// Title, subtitle and notes, wrapped to the page.
pub(super) struct Header {
    lines: Vec<(String, f64, bool, Colour)>,
    pub height: f64,
}

impl Header {
    pub fn new(frame: &Frame, notes: &[Option<String>]) -> Self {
        let wrap = |text: &str, size: f64, bold: bool, colour: Colour| {
            let lines = wrapped(text, size, bold, PAGE_WIDTH - 24.0).into_iter();
            lines.map(move |line| (shortened(&line, size, bold, PAGE_WIDTH - 24.0), size, bold, colour))
        };
        let mut lines: Vec<_> = wrap(&frame.title, TITLE, true, INK).collect();
        lines.extend(wrap(&frame.subtitle, SMALL, false, GREY));
        lines.extend(notes.iter().flatten().flat_map(|note| wrap(note, SMALL, false, WARNING)));
        let height = 10.0 + lines.iter().map(|line| 1.4 * line.1).sum::<f64>() + 10.0;
        Self { lines, height }
    }

    pub fn draw(&self, drawing: &mut Drawing) {
        let mut y = 10.0;
        for (text, size, bold, colour) in &self.lines {
            let at = (12.0, y + size);
            let (text, size, bold, colour) = (text.clone(), *size, *bold, *colour);
            drawing.add_text(Text { at, text, size, bold, colour, align: Align::Left, turned: false });
            y += 1.4 * size;
        }
    }
}

/// Room left of a plot for the vertical name and these tick labels.
pub(super) fn left_margin(y_ticks: &[f64]) -> f64 {
    let widest = y_ticks.iter().map(|&tick| text_width(&number_label(tick), TICK, false)).fold(0.0, f64::max);
    10.0 + SMALL + 8.0 + widest + 9.0
}

/// Horizontal grid lines at `ticks`, small ticks between them, and, where asked, labels at the left.
pub(super) fn draw_y_grid(drawing: &mut Drawing, b: &Bounds, axis: &LogAxis, ticks: &[f64], named: bool) {
    for &tick in ticks {
        let y = axis.pixel(tick);
        drawing.line(&[(b.left, y), (b.right, y)], 1.0, GRID, Dash::Solid);
        if named {
            drawing.text((b.left - 7.0, y + 4.0), &number_label(tick), TICK, GREY, Align::Right);
        }
    }
    for y in axis.small_ticks().into_iter().map(|tick| axis.pixel(tick)) {
        drawing.line(&[(b.left, y), (b.left + 3.0, y)], 1.0, PALE, Dash::Solid);
    }
}

/// Vertical grid lines at `ticks` and, where asked, as many labels below as stand apart.
pub(super) fn draw_x_grid(drawing: &mut Drawing, b: &Bounds, axis: &LogAxis, ticks: &[f64], named: bool) {
    let names: Vec<String> = ticks.iter().map(|&tick| number_label(tick)).collect();
    let spans = ticks.iter().zip(&names).map(|(&tick, name)| (axis.pixel(tick), text_width(name, TICK, false)));
    let spans: Vec<(f64, f64)> = spans.collect();
    for ((&(x, _), name), shown) in spans.iter().zip(&names).zip(kept_apart(&spans, 5.0)) {
        drawing.line(&[(x, b.top), (x, b.bottom)], 1.0, GRID, Dash::Solid);
        drawing.line(&[(x, b.bottom), (x, b.bottom + 4.0)], 1.0, PALE, Dash::Solid);
        if shown && named {
            drawing.text((x, b.bottom + 17.0), name, TICK, GREY, Align::Centre);
        }
    }
}

/// Small unlabelled ticks on the horizontal axis.
pub(super) fn draw_small_x_ticks(drawing: &mut Drawing, b: &Bounds, axis: &LogAxis) {
    for x in axis.small_ticks().into_iter().map(|tick| axis.pixel(tick)) {
        drawing.line(&[(x, b.bottom - 3.0), (x, b.bottom)], 1.0, PALE, Dash::Solid);
    }
}

/// The two axes' lines.
pub(super) fn draw_corner(drawing: &mut Drawing, b: &Bounds) {
    drawing.line(&[(b.left, b.top), (b.left, b.bottom), (b.right, b.bottom)], 1.0, PALE, Dash::Solid);
}

/// Names of the axes, below and, reading upwards, at the page's left edge.
pub(super) fn draw_axis_names(drawing: &mut Drawing, b: &Bounds, frame: &Frame) {
    let middle = (b.left + b.right) / 2.0;
    // Centred on the plot, but never over the page's edge.
    let room = 2.0 * (middle.min(PAGE_WIDTH - middle) - 4.0);
    let name = shortened(&frame.x_label, SMALL, false, room);
    drawing.text((middle, b.bottom + 36.0), &name, SMALL, INK, Align::Centre);
    drawing.add_text(Text {
        at: (10.0 + 0.76 * SMALL, (b.top + b.bottom) / 2.0),
        text: shortened(&frame.y_label, SMALL, false, b.bottom - b.top),
        size: SMALL,
        bold: false,
        colour: INK,
        align: Align::Centre,
        turned: true,
    });
}

/// What stands in a plot without data.
pub(super) fn draw_no_data(drawing: &mut Drawing, b: &Bounds) {
    let (x, y) = ((b.left + b.right) / 2.0, (b.top + b.bottom) / 2.0);
    // Covers the grid lines behind the words.
    drawing.rectangle(Bounds { left: x - 40.0, top: y - 14.0, right: x + 40.0, bottom: y + 14.0 }, [255; 3], 1.0);
    drawing.text((x, y + 5.0), "no data", TITLE, GREY, Align::Centre);
}
