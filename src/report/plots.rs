//! Charts with two logarithmic axes: one large one with labels at its lines' ends, or a grid of small ones.
//!
//! Points that a logarithm cannot show are left out and counted under the title, never moved or dropped in silence.

use super::axis::{LogAxis, number_label};
use super::figure::{
    Align, Bounds, Colour, Dash, Drawing, Figure, PAGE_WIDTH, Place, Text, shortened, text_width, wrapped,
};
use super::labels::{first_free, kept_apart, spread};
use super::style::{GREY, GRID, INK, PALE, Style, draw_key, draw_marker, lightened, style_of};

/// One measured value of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Datum {
    /// Where: samples per pixel, number of points, …
    pub x: f64,
    /// What was measured there.
    pub y: f64,
    /// Its interval, low and high, in the units of `y`; drawn as a translucent band.
    pub interval: Option<(f64, f64)>,
}

/// A named line of values.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Written at the line's end, or in the legend.
    pub label: String,
    /// Colour, shape and dash, by [`style_of`] its sampler's name.
    pub style: Style,
    /// The values, in any order; drawn by ascending `x`.
    pub points: Vec<Datum>,
}

impl Series {
    /// The series of a sampler, under its own name and in its own style.
    pub fn of_sampler(name: &str, points: Vec<Datum>) -> Self {
        Self { label: name.to_owned(), style: style_of(name), points }
    }
}

/// A line of known slope to compare with: y ∝ x^slope, drawn from the middle of the series' first values.
#[derive(Debug, Clone, PartialEq)]
pub struct Guide {
    /// Exponent of x; the expected RMSE of independent samples has −0.5.
    pub slope: f64,
    /// What it stands for, in a few letters: `slope −1/2`.
    pub label: String,
}

/// A level below which the measurement cannot see: the reference's own noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Floor {
    /// In the units of y.
    pub value: f64,
    /// Written beside it.
    pub label: String,
}

/// Series over a common pair of axes, and what helps to read them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plot {
    /// A line above the plot: in a grid, what tells this panel from its neighbours; empty: none.
    pub title: String,
    /// Lines in the order of the legend.
    pub series: Vec<Series>,
    /// Slopes to compare with.
    pub guides: Vec<Guide>,
    /// The measurement's floor.
    pub floor: Option<Floor>,
}

/// What a chart of [`Plot`]s says around them.
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
pub(super) const SMALL: f64 = 12.0;
pub(super) const TICK: f64 = 11.5;
/// From a label's line to the next.
const LABEL_STEP: f64 = 15.0;
/// From the plot's right edge to the keys of the labels beside it: room for leader lines.
const LEADER: f64 = 20.0;
pub(super) const KEY: f64 = 26.0;
const WARNING: Colour = [166, 64, 0];

/// One chart with every line labelled at its end; room is made where many lines end close together.
///
/// Values that are not above 0 or not finite are left out and counted under the subtitle; without any value left the
/// figure says "no data".
pub fn loglog_chart(frame: &Frame, plot: &Plot) -> Figure {
    drawn_large(frame, plot).finish(&frame.title)
}

fn drawn_large(frame: &Frame, plot: &Plot) -> Drawing {
    let (plot, left_out) = showable(plot);
    let axes = Axes::of(frame, std::slice::from_ref(&plot));
    let header = Header::new(frame, &[left_out.note(), axes.floor_note(&plot)]);
    let widest = column_texts(&plot).map(|text| text_width(&text, SMALL, false)).fold(0.0, f64::max).min(210.0);
    let labels = column_texts(&plot).count() as f64 + 1.0;
    let height = (header.height + 420.0_f64.max(labels * LABEL_STEP) + axes.foot()).round();
    let mut drawing = Drawing::new(PAGE_WIDTH, height);
    let bounds = Bounds {
        left: axes.left_margin(),
        top: header.height,
        right: PAGE_WIDTH - LEADER - KEY - 6.0 - widest - 8.0,
        bottom: height - axes.foot(),
    };
    header.draw(&mut drawing);
    let panel = Panel::new(&axes, bounds);
    panel.draw_frame(&mut drawing, true, true);
    axes.draw_names(&mut drawing, &bounds);
    let mut column = panel.draw_helpers(&mut drawing, &plot, true);
    column.extend(panel.draw_lines(&mut drawing, &plot));
    draw_column(&mut drawing, &bounds, &column, widest);
    drawing
}

/// Several plots side by side, `columns` in a row, under the same axes and one legend; series of the same label are
/// taken to look the same.
pub fn small_multiples(frame: &Frame, plots: &[Plot], columns: usize) -> Figure {
    drawn_grid(frame, plots, columns).finish(&frame.title)
}

fn drawn_grid(frame: &Frame, plots: &[Plot], columns: usize) -> Drawing {
    let (plots, left_out): (Vec<Plot>, Vec<LeftOut>) = plots.iter().map(showable).unzip();
    let columns = columns.clamp(1, plots.len().max(1));
    let rows = plots.len().max(1).div_ceil(columns);
    let axes = Axes::of(frame, &plots);
    let floors = plots.iter().map(|plot| axes.floor_note(plot).map(|note| format!("{}: {note}", plot.title)));
    let notes: Vec<_> = std::iter::once(LeftOut::sum(&left_out).note()).chain(floors).collect();
    let header = Header::new(frame, &notes);
    let legend = Legend::of(&plots);
    let (gap, title) = (18.0, 22.0);
    let width = (PAGE_WIDTH - axes.left_margin() - 14.0 - gap * (columns - 1) as f64) / columns as f64;
    let panel_height = (width * 0.95).clamp(210.0, 330.0);
    let last_row = plots.len().saturating_sub(columns);
    let foot = axes.foot();
    let height =
        header.height + rows as f64 * (title + panel_height) + (rows - 1) as f64 * 22.0 + foot + legend.height();
    let mut drawing = Drawing::new(PAGE_WIDTH, height);
    header.draw(&mut drawing);
    let at = |i: usize| {
        let left = axes.left_margin() + (i % columns) as f64 * (width + gap);
        let top = header.height + (i / columns) as f64 * (title + panel_height + 22.0) + title;
        Bounds { left, top, right: left + width, bottom: top + panel_height }
    };
    for (i, plot) in plots.iter().enumerate() {
        let panel = Panel::new(&axes, at(i));
        let name = shortened(&plot.title, 13.0, true, width);
        let place = (at(i).left, at(i).top - 7.0);
        drawing.add_text(Text {
            at: place,
            text: name,
            size: 13.0,
            bold: true,
            colour: INK,
            align: Align::Left,
            turned: false,
        });
        panel.draw_frame(&mut drawing, i % columns == 0, i >= last_row);
        panel.draw_helpers(&mut drawing, plot, false);
        panel.draw_lines(&mut drawing, plot);
    }
    let all = Bounds { bottom: at(plots.len().max(1) - 1).bottom, right: at(columns - 1).right, ..at(0) };
    if plots.is_empty() {
        Panel::new(&axes, all).draw_lines(&mut drawing, &Plot::default());
    }
    axes.draw_names(&mut drawing, &all);
    legend.draw(&mut drawing, axes.left_margin(), all.bottom + foot);
    drawing
}

/// How many points a logarithm cannot show.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct LeftOut {
    pub not_finite: usize,
    pub not_positive: usize,
}

impl LeftOut {
    fn sum(parts: &[Self]) -> Self {
        parts.iter().fold(Self::default(), |sum, part| Self {
            not_finite: sum.not_finite + part.not_finite,
            not_positive: sum.not_positive + part.not_positive,
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

    pub fn note(&self) -> Option<String> {
        let count = |n: usize, why: &str| {
            (n > 0).then(|| format!("{n} point{} not shown: {why}", if n == 1 { "" } else { "s" }))
        };
        let notes: Vec<_> = [count(self.not_positive, "not above 0"), count(self.not_finite, "not finite")]
            .into_iter()
            .flatten()
            .collect();
        (!notes.is_empty()).then(|| notes.join(" · "))
    }
}

/// The plot with only the points that can be shown, by ascending x, and only the series, guides and floor that are
/// left; an interval that is not finite is taken off its point.
fn showable(plot: &Plot) -> (Plot, LeftOut) {
    let mut left_out = LeftOut::default();
    let mut plot = plot.clone();
    for series in &mut plot.series {
        series.points.retain(|p| left_out.admits(&[p.x, p.y]));
        series.points.sort_by(|a, b| a.x.total_cmp(&b.x));
        for point in &mut series.points {
            point.interval = point.interval.filter(|(low, high)| low.is_finite() && high.is_finite() && *high > 0.0);
        }
    }
    plot.series.retain(|series| !series.points.is_empty());
    plot.guides.retain(|guide| guide.slope.is_finite());
    plot.floor = plot.floor.filter(|floor| floor.value.is_finite() && floor.value > 0.0);
    (plot, left_out)
}

fn data(plots: &[Plot]) -> impl Iterator<Item = &Datum> {
    plots.iter().flat_map(|plot| &plot.series).flat_map(|series| &series.points)
}

/// A floor further than this below the smallest value would squeeze the data; it is told in words instead.
const FLOOR_REACH: f64 = 20.0;
/// How far an interval may widen the range beyond the values: its low end can be anywhere above 0.
const INTERVAL_REACH: f64 = 3.0;

/// Ranges, ticks and names common to the panels of a figure.
struct Axes<'a> {
    frame: &'a Frame,
    x: LogAxis,
    y: LogAxis,
    x_ticks: Vec<f64>,
    y_ticks: Vec<f64>,
    x_names: Vec<String>,
}

impl<'a> Axes<'a> {
    fn of(frame: &'a Frame, plots: &[Plot]) -> Self {
        let (low, high) = data(plots).fold((f64::INFINITY, 0.0_f64), |(l, h), p| (l.min(p.y), h.max(p.y)));
        let reach = |p: &Datum| p.interval.map(|(l, h)| [l.max(low / INTERVAL_REACH), h.min(high * INTERVAL_REACH)]);
        let floors = plots.iter().filter_map(|plot| plot.floor.as_ref()).map(|floor| floor.value);
        let floors = floors.filter(|&value| value >= low / FLOOR_REACH && value <= high * FLOOR_REACH);
        let y_values =
            data(plots).flat_map(|p| std::iter::once(p.y).chain(reach(p).into_iter().flatten())).chain(floors);
        let (x, y) =
            (LogAxis::around(data(plots).map(|p| p.x), 0.03, 0.0, 1.0), LogAxis::around(y_values, 0.04, 0.0, 1.0));
        let mut measured: Vec<f64> = data(plots).map(|p| p.x).collect();
        measured.sort_by(f64::total_cmp);
        measured.dedup();
        let x_ticks: Vec<f64> = match (frame.x_ticks.is_empty(), measured.len()) {
            (false, _) => frame.x_ticks.iter().copied().filter(|&tick| x.holds(tick)).collect(),
            (true, 1..=12) => measured,
            (true, _) => x.ticks(10),
        };
        let x_names = x_ticks.iter().map(|&tick| number_label(tick)).collect();
        Self { frame, x, y, x_ticks, y_ticks: y.ticks(9), x_names }
    }

    /// Room for tick labels and the vertical name.
    fn left_margin(&self) -> f64 {
        let widest = self.y_ticks.iter().map(|&t| text_width(&number_label(t), TICK, false)).fold(0.0, f64::max);
        10.0 + SMALL + 8.0 + widest + 9.0
    }

    /// Room for tick labels and the horizontal name.
    fn foot(&self) -> f64 {
        46.0
    }

    fn floor_note(&self, plot: &Plot) -> Option<String> {
        let floor = plot.floor.as_ref().filter(|floor| !self.y.holds(floor.value))?;
        let side = if floor.value < self.y.ends().0 { "below" } else { "above" };
        Some(format!("{} = {}, {side} the range shown", floor.label, number_label(floor.value)))
    }

    fn draw_names(&self, drawing: &mut Drawing, b: &Bounds) {
        let middle = ((b.left + b.right) / 2.0, b.bottom + 36.0);
        drawing.text(middle, &self.frame.x_label, SMALL, INK, Align::Centre);
        drawing.add_text(Text {
            at: (10.0 + 0.76 * SMALL, (b.top + b.bottom) / 2.0),
            text: shortened(&self.frame.y_label, SMALL, false, b.bottom - b.top),
            size: SMALL,
            bold: false,
            colour: INK,
            align: Align::Centre,
            turned: true,
        });
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
            wrapped(text, size, bold, PAGE_WIDTH - 24.0).into_iter().map(move |line| (line, size, bold, colour))
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

/// The axes at the pixels of one panel.
struct Panel<'a> {
    axes: &'a Axes<'a>,
    x: LogAxis,
    y: LogAxis,
    b: Bounds,
}

/// A label beside the plot: where its line ends, what it says, and the key before it (none: a helper line, in grey).
struct Ending {
    at: Place,
    text: String,
    style: Option<Style>,
}

impl<'a> Panel<'a> {
    fn new(axes: &'a Axes, b: Bounds) -> Self {
        Self { axes, x: axes.x.moved(b.left, b.right), y: axes.y.moved(b.bottom, b.top), b }
    }

    /// Grid, ticks and, where asked, their labels.
    fn draw_frame(&self, drawing: &mut Drawing, y_names: bool, x_names: bool) {
        let b = self.b;
        for &tick in &self.axes.y_ticks {
            let y = self.y.pixel(tick);
            drawing.line(&[(b.left, y), (b.right, y)], 1.0, GRID, Dash::Solid);
            if y_names {
                drawing.text((b.left - 7.0, y + 4.0), &number_label(tick), TICK, GREY, Align::Right);
            }
        }
        for y in self.y.small_ticks().into_iter().map(|tick| self.y.pixel(tick)) {
            drawing.line(&[(b.left, y), (b.left + 3.0, y)], 1.0, PALE, Dash::Solid);
        }
        let places: Vec<f64> = self.axes.x_ticks.iter().map(|&tick| self.x.pixel(tick)).collect();
        let widths = self.axes.x_names.iter().map(|name| text_width(name, TICK, false));
        let shown = kept_apart(&places.iter().copied().zip(widths).collect::<Vec<_>>(), 5.0);
        for ((&x, name), shown) in places.iter().zip(&self.axes.x_names).zip(shown) {
            drawing.line(&[(x, b.top), (x, b.bottom)], 1.0, GRID, Dash::Solid);
            drawing.line(&[(x, b.bottom), (x, b.bottom + 4.0)], 1.0, PALE, Dash::Solid);
            if shown && x_names {
                drawing.text((x, b.bottom + 17.0), name, TICK, GREY, Align::Centre);
            }
        }
        let corner = [(b.left, b.top), (b.left, b.bottom), (b.right, b.bottom)];
        drawing.line(&corner, 1.0, PALE, Dash::Solid);
    }

    /// Guides and floor. With `beside`, labels of those that reach the right edge are returned for the column beside
    /// the plot; all others are written along the lines.
    fn draw_helpers(&self, drawing: &mut Drawing, plot: &Plot, beside: bool) -> Vec<Ending> {
        let mut column = Vec::new();
        let mut taken = self.obstacles(plot);
        let floor = plot.floor.iter().filter(|floor| self.y.holds(floor.value)).map(|floor| {
            let y = self.y.pixel(floor.value);
            (vec![(self.b.left, y), (self.b.right, y)], Dash::Dotted, floor.label.as_str())
        });
        let guides = plot
            .guides
            .iter()
            .filter_map(|guide| Some((self.guide(plot, guide.slope)?, Dash::Solid, guide.label.as_str())));
        for (line, dash, label) in floor.chain(guides) {
            drawing.line(&line, 1.1, PALE, dash);
            let end = line[1];
            if beside && end.0 > self.b.right - 0.5 {
                column.push(Ending { at: end, text: label.to_owned(), style: None });
                continue;
            }
            self.draw_inside_label(drawing, &line, label, &mut taken);
        }
        column
    }

    /// The visible part of the line of `slope` through the middle (in logarithms) of the series' first values.
    fn guide(&self, plot: &Plot, slope: f64) -> Option<Vec<Place>> {
        let firsts: Vec<&Datum> = plot.series.iter().filter_map(|series| series.points.first()).collect();
        let start = firsts.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
        let logs: Vec<f64> = firsts.iter().filter(|p| p.x == start).map(|p| libm::log(p.y)).collect();
        let middle = libm::exp(logs.iter().sum::<f64>() / logs.len() as f64);
        let (_, right) = self.x.ends();
        let from = (self.x.pixel(start), self.y.pixel(middle));
        let to = (
            self.b.right,
            self.y.pixel(1.0)
                + (self.y.pixel(10.0) - self.y.pixel(1.0)) * (libm::log10(middle) + slope * libm::log10(right / start)),
        );
        let edge = to.1.clamp(self.b.top, self.b.bottom);
        let part = if edge == to.1 { 1.0 } else { (edge - from.1) / (to.1 - from.1) };
        let visible = part.is_finite() && (0.0..=1.0).contains(&part) && from.0 < to.0;
        visible.then(|| vec![from, (from.0 + part * (to.0 - from.0), edge)])
    }

    /// Small boxes all along the series' lines, which labels inside the panel keep clear of.
    fn obstacles(&self, plot: &Plot) -> Vec<Bounds> {
        let mut boxes = Vec::new();
        for series in &plot.series {
            let places: Vec<Place> = series.points.iter().map(|p| (self.x.pixel(p.x), self.y.pixel(p.y))).collect();
            for ends in places.windows(2) {
                let (dx, dy) = (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1);
                let steps = (dx.abs().max(dy.abs()) / 4.0).ceil().max(1.0) as u32;
                let at = (0..=steps)
                    .map(|i| f64::from(i) / f64::from(steps))
                    .map(|t| (ends[0].0 + t * dx, ends[0].1 + t * dy));
                boxes.extend(at.map(|(x, y)| Bounds { left: x - 3.0, top: y - 3.0, right: x + 3.0, bottom: y + 3.0 }));
            }
        }
        boxes
    }

    /// Writes `label` beside the line, as near to its end as there is room; nowhere if there is none (a grid's
    /// legend names the guides too).
    fn draw_inside_label(&self, drawing: &mut Drawing, line: &[Place], label: &str, taken: &mut Vec<Bounds>) {
        let (from, to) = (line[0], line[1]);
        let text = |at: Place| Text {
            at,
            text: label.to_owned(),
            size: 10.5,
            bold: false,
            colour: GREY,
            align: Align::Right,
            turned: false,
        };
        let width = text_width(label, 10.5, false);
        let rise = if to.1 == from.1 { 0.0 } else { (to.1 - from.1) / (to.0 - from.0) };
        let candidates = (0..25).flat_map(|step| {
            let x = to.0 - 3.0 - f64::from(step) * 0.025 * (to.0 - from.0);
            let on_line = |x: f64| from.1 + rise * (x - from.0);
            // Above a falling line the text's left end is nearest to it from above, below it the right end.
            let above = (x, on_line(x - width).min(on_line(x)) - 4.0);
            let below = (x, on_line(x - width).max(on_line(x)) + 11.0);
            [above, below].map(|at| (text(at).bounds(), at))
        });
        if let Some((bounds, at)) = first_free(candidates, &self.b, taken) {
            taken.push(bounds);
            drawing.add_text(text(at));
        }
    }

    /// Bands below, then lines, then markers; returns where each line ends.
    fn draw_lines(&self, drawing: &mut Drawing, plot: &Plot) -> Vec<Ending> {
        if plot.series.is_empty() {
            let middle = ((self.b.left + self.b.right) / 2.0, (self.b.top + self.b.bottom) / 2.0);
            drawing.text(middle, "no data", TITLE, GREY, Align::Centre);
        }
        for series in &plot.series {
            self.draw_band(drawing, series);
        }
        let place = |p: &Datum| (self.x.pixel(p.x), self.y.pixel(p.y));
        for series in &plot.series {
            let line: Vec<Place> = series.points.iter().map(place).collect();
            drawing.line(&line, 1.8, series.style.colour, series.style.dash);
        }
        let radius = if self.b.right - self.b.left > 350.0 { 3.6 } else { 2.8 };
        for series in &plot.series {
            series.points.iter().for_each(|p| draw_marker(drawing, place(p), radius, &series.style));
        }
        let ending = |s: &Series| {
            let at = place(s.points.last()?);
            Some(Ending { at, text: s.label.clone(), style: Some(s.style) })
        };
        plot.series.iter().filter_map(ending).collect()
    }

    /// The intervals of neighbouring points as one band, that of a lone point as a bar.
    fn draw_band(&self, drawing: &mut Drawing, series: &Series) {
        for run in series.points.split(|p| p.interval.is_none()) {
            let edge = |p: &Datum, high: bool| {
                let (low, top) = p.interval.unwrap_or((p.y, p.y));
                (self.x.pixel(p.x), self.y.clamped(if high { top } else { low }))
            };
            match run {
                [] => {}
                [lone] => {
                    let ((x, top), (_, bottom)) = (edge(lone, true), edge(lone, false));
                    let bar = Bounds { left: x - 3.0, top, right: x + 3.0, bottom };
                    drawing.rectangle(bar, series.style.colour, 0.3);
                }
                _ => {
                    let there = run.iter().map(|p| edge(p, true));
                    let back = run.iter().rev().map(|p| edge(p, false));
                    let tint = lightened(series.style.colour, 0.3);
                    drawing.area(&there.chain(back).collect::<Vec<_>>(), tint, 0.18);
                }
            }
        }
    }
}

/// Everything that may be labelled in the column beside a chart.
fn column_texts(plot: &Plot) -> impl Iterator<Item = String> {
    let series = plot.series.iter().map(|series| series.label.clone());
    let guides = plot.guides.iter().map(|guide| guide.label.clone());
    series.chain(guides).chain(plot.floor.iter().map(|floor| floor.label.clone()))
}

/// Labels beside the plot, as near to their lines' ends as they can stand apart, each tied to its end.
fn draw_column(drawing: &mut Drawing, b: &Bounds, endings: &[Ending], width: f64) {
    let wanted: Vec<f64> = endings.iter().map(|ending| ending.at.1).collect();
    let places = spread(&wanted, LABEL_STEP, b.top + 4.0, b.bottom - 4.0);
    let left = b.right + LEADER;
    for (ending, y) in endings.iter().zip(places) {
        let from = (ending.at.0 + if ending.style.is_some() { 6.0 } else { 0.0 }, ending.at.1);
        let colour = ending.style.map_or(GRID, |style| lightened(style.colour, 0.55));
        drawing.line(
            &[from, (b.right.max(from.0) + 2.0, from.1), (left - 4.0, y), (left, y)],
            0.8,
            colour,
            Dash::Solid,
        );
        let text = shortened(&ending.text, SMALL, false, width);
        match &ending.style {
            Some(style) => {
                draw_key(drawing, left, y, KEY, style);
                drawing.text((left + KEY + 6.0, y + 4.0), &text, SMALL, INK, Align::Left);
            }
            None => drawing.text((left + 2.0, y + 4.0), &text, SMALL, GREY, Align::Left),
        }
    }
}

/// One key for all panels: the series, and below them what the grey lines are.
struct Legend {
    entries: Vec<(String, Style)>,
    floors: Vec<String>,
    guides: Vec<Guide>,
    columns: usize,
    step: f64,
}

const LEGEND_STEP: f64 = 18.0;

impl Legend {
    /// Labels in the order they first appear.
    fn of(plots: &[Plot]) -> Self {
        let mut entries: Vec<(String, Style)> = Vec::new();
        for series in plots.iter().flat_map(|plot| &plot.series) {
            if !entries.iter().any(|(label, _)| *label == series.label) {
                entries.push((series.label.clone(), series.style));
            }
        }
        let mut floors: Vec<String> =
            plots.iter().filter_map(|plot| plot.floor.as_ref()).map(|f| f.label.clone()).collect();
        floors.dedup();
        let mut guides: Vec<Guide> = plots.iter().flat_map(|plot| plot.guides.iter().cloned()).collect();
        guides.sort_by(|a, b| b.slope.total_cmp(&a.slope));
        guides.dedup();
        let widest = entries.iter().map(|(text, _)| text_width(text, SMALL, false)).fold(40.0, f64::max);
        let step = (KEY + 6.0 + widest + 16.0).min(PAGE_WIDTH - 80.0);
        let fitting = (((PAGE_WIDTH - 60.0) / step) as usize).max(1);
        // As few rows as fit, and those equally long.
        let rows = entries.len().div_ceil(fitting).max(1);
        Self { columns: entries.len().div_ceil(rows).max(1), entries, floors, guides, step }
    }

    fn rows(&self) -> usize {
        self.entries.len().div_ceil(self.columns)
    }

    fn height(&self) -> f64 {
        let helpers = usize::from(!self.floors.is_empty() || !self.guides.is_empty());
        10.0 + LEGEND_STEP * (self.rows() + helpers) as f64
    }

    fn draw(&self, drawing: &mut Drawing, left: f64, top: f64) {
        // Presets of one family that follow each other stand below each other.
        let by_column = self.entries.len() > 1 && self.entries[0].1.colour == self.entries[1].1.colour;
        for (i, (text, style)) in self.entries.iter().enumerate() {
            let (column, row) =
                if by_column { (i / self.rows(), i % self.rows()) } else { (i % self.columns, i / self.columns) };
            let (x, y) = (left + column as f64 * self.step, top + 8.0 + row as f64 * LEGEND_STEP);
            draw_key(drawing, x, y, KEY, style);
            let text = shortened(text, SMALL, false, self.step - KEY - 10.0);
            drawing.text((x + KEY + 6.0, y + 4.0), &text, SMALL, INK, Align::Left);
        }
        self.draw_helpers(drawing, left, top + 8.0 + self.rows() as f64 * LEGEND_STEP);
    }

    fn draw_helpers(&self, drawing: &mut Drawing, left: f64, y: f64) {
        let guides = self.guides.iter().map(|guide| guide.label.as_str()).collect::<Vec<_>>().join(", ");
        let order = if self.guides.len() > 1 { " (from the top)" } else { "" };
        let entries = [(self.floors.join(", "), Dash::Dotted), (format!("{guides}{order}"), Dash::Solid)];
        let mut x = left;
        for (text, dash) in entries.iter().filter(|entry| !entry.0.is_empty()) {
            drawing.line(&[(x, y), (x + KEY, y)], 1.1, PALE, *dash);
            drawing.text((x + KEY + 6.0, y + 4.0), text, SMALL, INK, Align::Left);
            x += KEY + 6.0 + text_width(text, SMALL, false) + 24.0;
        }
    }
}
