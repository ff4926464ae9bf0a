//! Shares of an error, decision by decision: a grid of bar charts, a row of panels a scene.

use crate::sampling::Decision;
use crate::stats::Estimate;

use super::figure::{Align, Bounds, Colour, Dash, Drawing, Figure, PAGE_WIDTH, shortened, text_width};
use super::frame::{Frame, HEADING, Header, SMALL, TICK, draw_axis_names, draw_no_data};
use super::labels::kept_apart;
use super::numbers::percent;
use super::style::{GREY, GRID, INK, PALE, decision_colour, lightened};

/// One bar.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// Whose share; `None`: all decisions together.
    pub decision: Option<Decision>,
    /// The share, 1 for all of it; below 0 where the error grew.
    pub share: Estimate,
}

/// Bars under one heading.
#[derive(Debug, Clone, PartialEq)]
pub struct SharePanel {
    /// Heading: scene and what was exchanged.
    pub title: String,
    /// Bars, top to bottom.
    pub bars: Vec<Share>,
}

const BAR: f64 = 20.0;
const TITLE_STEP: f64 = 24.0;
const GAP: f64 = 22.0;
/// Room right of a panel for its bars' numbers.
const NUMBER: f64 = 54.0;
/// What a bar may say to the left: an error that doubled.
const LOWEST: f64 = -1.0;
const ALL_COLOUR: Colour = [136, 136, 136];

/// Panels in rows of `columns`, each bar from 0 to its share with its interval, on a common linear axis from the lowest
/// share (cut at −100 %) to 100 %. `None` stands for an empty place.
pub fn share_chart(frame: &Frame, panels: &[Option<SharePanel>], columns: usize) -> Figure {
    drawn(frame, panels, columns.max(1)).finish(&frame.title)
}

/// A linear axis.
#[derive(Clone, Copy)]
struct Axis {
    low: f64,
    left: f64,
    right: f64,
}

impl Axis {
    fn pixel(&self, share: f64) -> f64 {
        let at = (share.clamp(self.low, 1.0) - self.low) / (1.0 - self.low);
        self.left + at * (self.right - self.left)
    }

    /// Quarters, or halves where the axis is long for its panel.
    fn ticks(&self) -> Vec<f64> {
        let step = if self.right - self.left > 220.0 * (1.0 - self.low) { 0.25 } else { 0.5 };
        let first = (self.low / step).ceil() as i32;
        (first..=(1.0 / step) as i32).map(|i| f64::from(i) * step).collect()
    }
}

fn name(bar: &Share) -> &'static str {
    bar.decision.map_or("all at once", Decision::name)
}

fn drawn(frame: &Frame, panels: &[Option<SharePanel>], columns: usize) -> Drawing {
    let bars = || panels.iter().flatten().flat_map(|panel| &panel.bars);
    let names = 16.0 + bars().map(|bar| text_width(name(bar), SMALL, false)).fold(60.0, f64::max);
    let header = Header::new(frame, &[]);
    let heights: Vec<f64> = panels
        .chunks(columns)
        .map(|row| TITLE_STEP + BAR * row.iter().flatten().map(|p| p.bars.len()).max().unwrap_or(0) as f64 + GAP)
        .collect();
    let body = heights.iter().sum::<f64>().max(80.0);
    let mut drawing = Drawing::new(PAGE_WIDTH, header.height + body + 40.0);
    header.draw(&mut drawing);
    let ends = bars().flat_map(|bar| [Some(bar.share.value), bar.share.ci95.map(|[low, _]| low)]).flatten();
    let lowest = ends.filter(|end| !end.is_nan()).fold(0.0, f64::min);
    let low = ((4.0 * lowest).floor() / 4.0).clamp(LOWEST, 0.0);
    let width = (PAGE_WIDTH - names - 12.0) / columns as f64;
    let mut top = header.height;
    for (row, height) in panels.chunks(columns).zip(&heights) {
        for (i, panel) in row.iter().enumerate() {
            let left = names + i as f64 * width;
            let axis = Axis { low, left, right: left + width - NUMBER };
            if let Some(panel) = panel {
                draw_panel(&mut drawing, &axis, panel, (top, top + height - GAP), i == 0);
            }
        }
        top += height;
    }
    let b = Bounds { left: names, top: header.height, right: PAGE_WIDTH - 12.0, bottom: header.height + body - 8.0 };
    if bars().next().is_none() {
        draw_no_data(&mut drawing, &b);
    }
    draw_axis_names(&mut drawing, &b, &Frame { y_label: String::new(), ..frame.clone() });
    drawing
}

/// A panel from `top` to `bottom`, those of its whole row; `is_named`: the decisions stand to its left.
fn draw_panel(drawing: &mut Drawing, axis: &Axis, panel: &SharePanel, (top, bottom): (f64, f64), is_named: bool) {
    let room = axis.right - axis.left + NUMBER - 10.0;
    drawing.heading((axis.left, top + 14.0), &shortened(&panel.title, HEADING, true, room));
    let first = top + TITLE_STEP;
    let ticks = axis.ticks();
    let spans: Vec<(f64, f64)> =
        ticks.iter().map(|&tick| (axis.pixel(tick), text_width(&percent(tick), TICK, false))).collect();
    for ((&tick, &(x, _)), is_shown) in ticks.iter().zip(&spans).zip(kept_apart(&spans, 5.0)) {
        let colour = if tick == 0.0 { PALE } else { GRID };
        drawing.line(&[(x, first), (x, bottom)], 1.0, colour, Dash::Solid);
        if is_shown {
            drawing.text((x, bottom + 12.0), &percent(tick), TICK, GREY, Align::Centre);
        }
    }
    for (i, bar) in panel.bars.iter().enumerate() {
        let y = first + BAR * (i as f64 + 0.5);
        draw_bar(drawing, axis, bar, y);
        if is_named {
            drawing.text((axis.left - 8.0, y + 4.0), name(bar), SMALL, INK, Align::Right);
        }
    }
}

fn draw_bar(drawing: &mut Drawing, axis: &Axis, bar: &Share, y: f64) {
    let colour = bar.decision.map_or(ALL_COLOUR, decision_colour);
    let (zero, end) = (axis.pixel(0.0), axis.pixel(bar.share.value));
    let body = Bounds { left: zero.min(end), top: y - 6.0, right: zero.max(end), bottom: y + 6.0 };
    drawing.rectangle(body, lightened(colour, 0.35), 1.0);
    if let Some([low, high]) = bar.share.ci95.filter(|ends| !ends.iter().any(|end| end.is_nan())) {
        let (from, to) = (axis.pixel(low), axis.pixel(high));
        drawing.line(&[(from, y), (to, y)], 1.6, INK, Dash::Solid);
        // An end that lies off the axis has no cap but a point.
        for (x, is_cut) in [(from, low < axis.low), (to, false)] {
            match is_cut {
                true => drawing.area(&[(x, y), (x + 6.0, y - 3.5), (x + 6.0, y + 3.5)], INK, 1.0),
                false => drawing.line(&[(x, y - 3.5), (x, y + 3.5)], 1.4, INK, Dash::Solid),
            }
        }
    }
    let text = if bar.share.value.is_finite() { percent(bar.share.value) } else { "–".to_owned() };
    drawing.text(
        (axis.right + NUMBER - 8.0, y + 4.0),
        &shortened(&text, TICK, false, NUMBER - 10.0),
        TICK,
        colour,
        Align::Right,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share(decision: Option<Decision>, value: f64, half: f64) -> Share {
        Share { decision, share: Estimate { value, ci95: Some([value - half, value + half]) } }
    }

    fn panel(values: &[f64]) -> Option<SharePanel> {
        let decisions = Decision::ALL.into_iter().map(Some).chain([None]);
        let bars = decisions.zip(values).map(|(d, &v)| share(d, v, 0.1)).collect();
        Some(SharePanel { title: "a scene: a sampler to another one, at 64 spp".to_owned(), bars })
    }

    fn frame() -> Frame {
        let [title, subtitle, x_label] =
            ["Which decision", "made up", "share of the MSE that goes (%)"].map(str::to_owned);
        Frame { title, subtitle, x_label, ..Frame::default() }
    }

    #[test]
    fn whatever_the_shares_no_text_overlaps_another_and_nothing_leaves_the_page() {
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -7.0, 1.0];
        for columns in 1..=3 {
            for values in [&[0.7, 0.1, 0.0, 0.2, 0.98][..], &[-0.3, 0.2], &[], &odd] {
                let panels = [panel(values), None, panel(&[0.5, 0.4]), panel(values), panel(&[0.1])];
                drawn(&frame(), &panels, columns).assert_legible();
            }
        }
    }

    #[test]
    fn bars_say_their_numbers_and_without_any_there_is_no_data() {
        let svg = share_chart(&frame(), &[panel(&[0.71, -0.25])], 1).svg;
        for text in ["71 %", "−25 %", "pixel", "lens", "100 %"] {
            assert!(svg.contains(&format!("\n{text}\n")), "{text}");
        }
        assert!(!svg.contains("light pick") && !svg.contains("no data"));
        assert!(share_chart(&frame(), &[], 2).svg.contains("no data"));
        assert!(share_chart(&frame(), &[None], 2).svg.contains("no data"));
    }
}
