//! Charts with two logarithmic axes: one large one with labels at its lines' ends, or a grid of small ones.
//!
//! Points that a logarithm cannot show are left out and counted under the title, never moved or dropped in silence.

use super::axis::{LogAxis, number_label};
use super::figure::{Align, Bounds, Dash, Drawing, Figure, PAGE_WIDTH, Place, Text, shortened, text_width};
use super::frame::{
    FOOT, Frame, HEADING, Header, LeftOut, SMALL, draw_axis_names, draw_corner, draw_no_data, draw_x_grid, draw_y_grid,
    left_margin,
};
use super::labels::first_free;
use super::legend::{Ending, KEY, LABEL_STEP, LEADER, Legend, draw_column};
use super::style::{GREY, INK, PALE, Style, draw_marker, lightened, style_of};

/// One measured value of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Datum {
    /// Where: samples per pixel, number of points, …
    pub x: f64,
    /// What was measured there.
    pub y: f64,
    /// Its interval, low and high, in the units of `y`; drawn as a translucent band.
    pub interval: Option<(f64, f64)>,
    /// Drawn with a pale marker: to be read with care.
    pub is_pale: bool,
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
    let height = (header.height + 420.0_f64.max(labels * LABEL_STEP) + FOOT).round();
    let mut drawing = Drawing::new(PAGE_WIDTH, height);
    let bounds = Bounds {
        left: left_margin(&axes.y_ticks),
        top: header.height,
        right: PAGE_WIDTH - LEADER - KEY - 6.0 - widest - 8.0,
        bottom: height - FOOT,
    };
    header.draw(&mut drawing);
    let panel = Panel::new(&axes, bounds);
    panel.draw_frame(&mut drawing, true, true);
    draw_axis_names(&mut drawing, &bounds, frame);
    let mut column = panel.draw_helpers(&mut drawing, &plot, true, &mut panel.boxes(&plot));
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
    let axes = Axes::of(frame, &plots);
    let floors = plots.iter().map(|plot| axes.floor_note(plot).map(|note| format!("{}: {note}", plot.title)));
    let notes: Vec<_> = std::iter::once(LeftOut::sum(&left_out).note()).chain(floors).collect();
    let header = Header::new(frame, &notes);
    let legend = Legend::of(&plots);
    let cells = Cells::new(plots.len(), columns, left_margin(&axes.y_ticks), header.height);
    let all = cells.all();
    let mut drawing = Drawing::new(PAGE_WIDTH, all.bottom + FOOT + legend.height());
    header.draw(&mut drawing);
    for (i, plot) in plots.iter().enumerate() {
        let b = cells.at(i);
        let panel = Panel::new(&axes, b);
        drawing.heading((b.left, b.top - 7.0), &shortened(&plot.title, HEADING, true, b.right - b.left));
        panel.draw_frame(&mut drawing, i % cells.columns == 0, i + cells.columns >= plots.len());
        let mut taken = panel.boxes(plot);
        panel.draw_series_labels(&mut drawing, plot, &mut taken);
        panel.draw_helpers(&mut drawing, plot, false, &mut taken);
        panel.draw_lines(&mut drawing, plot);
    }
    if plots.is_empty() {
        draw_no_data(&mut drawing, &all);
    }
    draw_axis_names(&mut drawing, &all, frame);
    legend.draw(&mut drawing, all.left, all.bottom + FOOT);
    drawing
}

/// Where the panels of a grid stand.
struct Cells {
    count: usize,
    columns: usize,
    first: Bounds,
}

impl Cells {
    const GAP: f64 = 18.0;
    /// Above each panel, for its title; and between rows, for tick labels of a row that is not the last.
    const TITLE_ROOM: f64 = 22.0;

    /// At least one panel, the first column's left edge at `left`, the first title's top at `top`.
    fn new(count: usize, columns: usize, left: f64, top: f64) -> Self {
        let count = count.max(1);
        let columns = columns.clamp(1, count);
        let width = (PAGE_WIDTH - left - 14.0 - Self::GAP * (columns - 1) as f64) / columns as f64;
        let top = top + Self::TITLE_ROOM;
        let height = (width * 0.95).clamp(210.0, 330.0);
        Self { count, columns, first: Bounds { left, top, right: left + width, bottom: top + height } }
    }

    fn at(&self, i: usize) -> Bounds {
        let Bounds { left, top, right, bottom } = self.first;
        let across = (i % self.columns) as f64 * (right - left + Self::GAP);
        let down = (i / self.columns) as f64 * (bottom - top + 2.0 * Self::TITLE_ROOM);
        Bounds { left: left + across, top: top + down, right: right + across, bottom: bottom + down }
    }

    /// The box around all panels.
    fn all(&self) -> Bounds {
        Bounds { right: self.at(self.columns - 1).right, bottom: self.at(self.count - 1).bottom, ..self.first }
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
    left_out.empty.extend(plot.series.iter().filter(|series| series.points.is_empty()).map(|s| s.label.clone()));
    plot.series.retain(|series| !series.points.is_empty());
    plot.guides.retain(|guide| guide.slope.is_finite());
    plot.floor = plot.floor.filter(|floor| floor.value.is_finite() && floor.value > 0.0);
    (plot, left_out)
}

fn data(plots: &[Plot]) -> impl Iterator<Item = &Datum> {
    plots.iter().flat_map(|plot| &plot.series).flat_map(|series| &series.points)
}

/// Half the width that a series takes for its line and markers, and how far names keep from lines that are not theirs.
const SERIES_ROOM: f64 = 3.0;
const CLEAR: f64 = 9.0;

/// A floor further than this below the smallest value would squeeze the data; it is told in words instead.
const FLOOR_REACH: f64 = 20.0;
/// How far an interval may widen the range beyond the values: its low end can be anywhere above 0.
const INTERVAL_REACH: f64 = 3.0;

/// Ranges, ticks and names common to the panels of a figure.
struct Axes {
    x: LogAxis,
    y: LogAxis,
    x_ticks: Vec<f64>,
    y_ticks: Vec<f64>,
}

impl Axes {
    fn of(frame: &Frame, plots: &[Plot]) -> Self {
        let (low, high) = data(plots).fold((f64::INFINITY, 0.0_f64), |(l, h), p| (l.min(p.y), h.max(p.y)));
        let reach = |p: &Datum| {
            p.interval.map(|(l, h)| [l.max(low / INTERVAL_REACH).max(f64::MIN_POSITIVE), h.min(high * INTERVAL_REACH)])
        };
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
        Self { x, y, x_ticks, y_ticks: y.ticks(9) }
    }

    fn floor_note(&self, plot: &Plot) -> Option<String> {
        let floor = plot.floor.as_ref().filter(|floor| !self.y.holds(floor.value))?;
        let side = if floor.value < self.y.ends().0 { "below" } else { "above" };
        Some(format!("{} = {}, {side} the range shown", floor.label, number_label(floor.value)))
    }
}

/// The axes at the pixels of one panel.
struct Panel<'a> {
    axes: &'a Axes,
    x: LogAxis,
    y: LogAxis,
    b: Bounds,
}

impl<'a> Panel<'a> {
    fn new(axes: &'a Axes, b: Bounds) -> Self {
        Self { axes, x: axes.x.moved(b.left, b.right), y: axes.y.moved(b.bottom, b.top), b }
    }

    /// Grid, ticks and, where asked, their labels.
    fn draw_frame(&self, drawing: &mut Drawing, y_named: bool, x_named: bool) {
        draw_y_grid(drawing, &self.b, &self.y, &self.axes.y_ticks, y_named);
        draw_x_grid(drawing, &self.b, &self.x, &self.axes.x_ticks, x_named);
        draw_corner(drawing, &self.b);
    }

    /// Guides and floor. With `beside`, labels of those that reach the right edge are returned for the column beside
    /// the plot; all others are written along the lines.
    fn draw_helpers(&self, drawing: &mut Drawing, plot: &Plot, beside: bool, taken: &mut Vec<Bounds>) -> Vec<Ending> {
        let mut column = Vec::new();
        for (line, dash, label) in self.helpers(plot) {
            drawing.line(&line, 1.1, PALE, dash);
            let end = line[1];
            if beside && end.0 > self.b.right - 0.5 {
                column.push(Ending { at: end, text: label.to_owned(), style: None });
                continue;
            }
            self.draw_inside_label(drawing, &line, label, taken);
        }
        column
    }

    /// Guides and floor: where they run, their dash and their name.
    fn helpers<'p>(&self, plot: &'p Plot) -> Vec<(Vec<Place>, Dash, &'p str)> {
        let floor = plot.floor.iter().filter(|floor| self.y.holds(floor.value)).map(|floor| {
            let y = self.y.pixel(floor.value);
            (vec![(self.b.left, y), (self.b.right, y)], Dash::Dotted, floor.label.as_str())
        });
        let guides = plot
            .guides
            .iter()
            .filter_map(|guide| Some((self.guide(plot, guide.slope)?, Dash::Solid, guide.label.as_str())));
        floor.chain(guides).collect()
    }

    /// What labels keep clear of: series and helper lines.
    fn boxes(&self, plot: &Plot) -> Vec<Bounds> {
        let series = plot.series.iter().flat_map(|series| boxes_along(&self.places(series), SERIES_ROOM));
        series.chain(self.helpers(plot).iter().flat_map(|(line, ..)| boxes_along(line, 1.0))).collect()
    }

    /// Writes each series' name along its last steps, where there is room beside it and no other line is as near; lines that
    /// run together have the legend alone.
    fn draw_series_labels(&self, drawing: &mut Drawing, plot: &Plot, taken: &mut Vec<Bounds>) {
        for (i, series) in plot.series.iter().enumerate() {
            let places = self.places(series);
            let others = plot.series.iter().enumerate().filter(|(other, _)| *other != i);
            let near: Vec<Bounds> = others
                .flat_map(|(_, other)| boxes_along(&self.places(other), CLEAR))
                .chain(taken.iter().copied())
                .collect();
            let text = |at: Place| Text {
                at,
                text: series.label.clone(),
                size: 10.5,
                bold: false,
                colour: INK,
                align: Align::Right,
                turned: false,
            };
            let width = text_width(&series.label, 10.5, false);
            let candidates = places.windows(2).rev().take(2).flat_map(|ends| {
                let (from, to) = (ends[0], ends[1]);
                let places = &places;
                (0..12).flat_map(move |step| {
                    let x = to.0 - f64::from(step) * (to.0 - from.0) / 12.0;
                    let (highest, lowest) = span(places, x - width, x);
                    [(x, highest - SERIES_ROOM - 4.0), (x, lowest + SERIES_ROOM + 11.0)]
                })
            });
            let candidates = candidates.map(|at| (text(at).bounds(), at));
            if let Some((bounds, at)) = first_free(candidates, &self.b, &near) {
                taken.push(bounds);
                drawing.add_text(text(at));
            }
        }
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

    fn places(&self, series: &Series) -> Vec<Place> {
        series.points.iter().map(|p| (self.x.pixel(p.x), self.y.pixel(p.y))).collect()
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
        // Between the grid's vertical lines where there is room, so that none cuts the text.
        let rulers = self.axes.x_ticks.iter().map(|&tick| self.x.pixel(tick));
        let ruled: Vec<Bounds> = rulers
            .map(|x| Bounds { left: x - 1.0, top: self.b.top, right: x + 1.0, bottom: self.b.bottom })
            .chain(taken.iter().copied())
            .collect();
        let found = first_free(candidates.clone(), &self.b, &ruled).or_else(|| first_free(candidates, &self.b, taken));
        if let Some((bounds, at)) = found {
            taken.push(bounds);
            drawing.add_text(text(at));
        }
    }

    /// Bands below, then lines, then markers; returns where each line ends.
    fn draw_lines(&self, drawing: &mut Drawing, plot: &Plot) -> Vec<Ending> {
        if plot.series.is_empty() {
            draw_no_data(drawing, &self.b);
        }
        for series in &plot.series {
            self.draw_band(drawing, series);
        }
        for series in &plot.series {
            drawing.line(&self.places(series), 1.8, series.style.colour, series.style.dash);
        }
        let radius = if self.b.right - self.b.left > 350.0 { 3.6 } else { 2.8 };
        for series in &plot.series {
            let pale = Style { colour: lightened(series.style.colour, 0.65), ..series.style };
            for (point, at) in series.points.iter().zip(self.places(series)) {
                draw_marker(drawing, at, radius, if point.is_pale { &pale } else { &series.style });
            }
        }
        let ending = |s: &Series| {
            let at = *self.places(s).last()?;
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

/// Small boxes all along a line, `half` pixels to each side of it: labels keep clear of them.
fn boxes_along(line: &[Place], half: f64) -> Vec<Bounds> {
    let pieces = line.windows(2).flat_map(|ends| {
        let (dx, dy) = (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1);
        let steps = (dx.abs().max(dy.abs()) / 4.0).ceil().max(1.0) as u32;
        let at = move |i| {
            (ends[0].0 + dx * f64::from(i) / f64::from(steps), ends[0].1 + dy * f64::from(i) / f64::from(steps))
        };
        (0..=steps).map(at)
    });
    pieces.map(|(x, y)| Bounds { left: x - half, top: y - half, right: x + half, bottom: y + half }).collect()
}

/// The least and the largest y of a line between two x, the line going on level beyond its ends.
fn span(line: &[Place], left: f64, right: f64) -> (f64, f64) {
    let at = |x: f64| {
        let step = line.windows(2).find(|ends| ends[0].0 <= x && x <= ends[1].0 && ends[0].0 < ends[1].0);
        let beyond = line.first().filter(|first| x < first.0).or(line.last()).map_or(0.0, |place| place.1);
        step.map_or(beyond, |e| e[0].1 + (x - e[0].0) / (e[1].0 - e[0].0) * (e[1].1 - e[0].1))
    };
    let inner = line.iter().filter(|place| left < place.0 && place.0 < right).map(|place| place.1);
    inner.chain([at(left), at(right)]).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)))
}

/// Everything that may be labelled in the column beside a chart.
fn column_texts(plot: &Plot) -> impl Iterator<Item = String> {
    let series = plot.series.iter().map(|series| series.label.clone());
    let guides = plot.guides.iter().map(|guide| guide.label.clone());
    series.chain(guides).chain(plot.floor.iter().map(|floor| floor.label.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRng, TestRunner};

    const NAMES: [&str; 8] = [
        "uniform:best",
        "stratified:sheet",
        "halton:joint:digits@each",
        "hammersley:plain",
        "ld:sheet",
        "sobol",
        "a name far longer than any sampler that the vocabulary can spell, cut with an ellipsis",
        "blue noise",
    ];

    fn datum(x: f64, y: f64) -> Datum {
        Datum { x, y, interval: Some((0.9 * y, 1.1 * y)), is_pale: false }
    }

    fn frame() -> Frame {
        let [title, subtitle, x_label, y_label] =
            ["Error", "made up", "samples per pixel", "RMSE (radiance)"].map(str::to_owned);
        Frame { title, subtitle, x_label, y_label, x_ticks: Vec::new() }
    }

    fn plot(series: Vec<Series>) -> Plot {
        let guide = |slope, label: &str| Guide { slope, label: label.to_owned() };
        Plot {
            title: "scene".to_owned(),
            series,
            guides: vec![guide(-0.5, "slope −1/2"), guide(-1.0, "slope −1"), guide(-1.5, "slope −3/2")],
            floor: Some(Floor { value: 1e-3, label: "reference noise".to_owned() }),
        }
    }

    fn line(name: &str, start: f64, slope: f64) -> Series {
        let at = |x: f64| datum(x, start * libm::pow(x, slope));
        Series::of_sampler(name, [1.0, 4.0, 16.0, 26.0, 64.0, 256.0].map(at).to_vec())
    }

    /// Exponents of ten from 1e-12 to 1e3, and now and then what no logarithm shows.
    fn value() -> impl Strategy<Value = f64> {
        let odd = prop::sample::select(vec![0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e-300, 1e300]);
        prop_oneof![20 => (-12.0..3.0f64).prop_map(|e| libm::pow(10.0, e)), 1 => odd]
    }

    fn any_plot() -> impl Strategy<Value = Plot> {
        let point = (0u32..12, value(), prop::option::of((value(), value())));
        let point =
            point.prop_map(|(k, y, interval)| Datum { x: libm::exp2(k.into()), y, interval, is_pale: k % 2 == 0 });
        let series = (prop::sample::select(&NAMES[..]), prop::collection::vec(point, 0..9));
        let series = series.prop_map(|(name, points)| Series::of_sampler(name, points));
        (prop::collection::vec(series, 0..14), value()).prop_map(|(series, floor)| Plot {
            floor: Some(Floor { value: floor, label: "reference noise".to_owned() }),
            ..plot(series)
        })
    }

    fn runner(cases: u32) -> TestRunner {
        let config = Config { cases, failure_persistence: None, ..Config::default() };
        TestRunner::new_with_rng(config, TestRng::deterministic_rng(Default::default()))
    }

    #[test]
    fn whatever_the_data_no_text_overlaps_another_and_nothing_leaves_the_page() {
        let panels = (prop::collection::vec(any_plot(), 0..5), 1usize..4);
        runner(60)
            .run(&panels, |(plots, columns)| {
                plots.iter().for_each(|plot| drawn_large(&frame(), plot).assert_legible());
                drawn_grid(&frame(), &plots, columns).assert_legible();
                Ok(())
            })
            .unwrap();
    }

    #[test]
    fn fourteen_lines_that_end_together_are_all_labelled_apart() {
        let lines = (0..14).map(|i| line(&format!("variant {i}"), 1.0 + 1e-6 * f64::from(i), -0.5)).collect();
        let drawing = drawn_large(&frame(), &plot(lines));
        drawing.assert_legible();
        let svg = drawing.finish("").svg;
        assert!((0..14).all(|i| svg.contains(&format!("variant {i}\n"))));
    }

    #[test]
    fn the_same_input_gives_the_same_bytes() {
        let plot = plot(vec![line("ld:best", 1.0, -0.75), line("uniform:sheet", 0.9, -0.5)]);
        assert_eq!(loglog_chart(&frame(), &plot), loglog_chart(&frame(), &plot));
        let plots = [plot.clone(), plot];
        assert_eq!(small_multiples(&frame(), &plots, 2), small_multiples(&frame(), &plots, 2));
    }

    #[test]
    fn points_that_no_logarithm_shows_are_counted_by_cause_and_their_series_named() {
        let bad =
            [0.0, -1.0, f64::NAN, f64::INFINITY, 0.0].map(|y| Datum { x: 1.0, y, interval: None, is_pale: false });
        let series = vec![line("uniform", 1.0, -0.5), Series::of_sampler("ld:best", bad.to_vec())];
        let svg = loglog_chart(&frame(), &plot(series)).svg;
        let note = "3 points not shown: not above 0 · 2 points not shown: not finite · no data: ld:best";
        assert!(svg.contains(note), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn without_data_a_chart_says_so() {
        assert!(loglog_chart(&frame(), &Plot::default()).svg.contains("no data"));
        assert!(small_multiples(&frame(), &[], 3).svg.contains("no data"));
        let panels = [Plot::default(), plot(vec![line("ld", 1.0, -1.0)])];
        assert!(small_multiples(&frame(), &panels, 2).svg.contains("no data"));
    }

    #[test]
    fn a_floor_far_below_the_data_is_told_in_words() {
        let mut plot = plot(vec![line("ld:best", 1.0, -0.25)]);
        plot.floor = Some(Floor { value: 0.25 / 19.0, label: "reference noise".to_owned() });
        assert!(!loglog_chart(&frame(), &plot).svg.contains("the range shown"), "near enough to be drawn");
        plot.floor = Some(Floor { value: 1e-9, label: "reference noise".to_owned() });
        let svg = loglog_chart(&frame(), &plot).svg;
        assert!(svg.contains("reference noise = 1e-9, below the range shown"), "{svg}");
    }

    #[test]
    fn a_guide_runs_through_the_middle_of_the_first_values_with_its_slope() {
        let plot = Plot { floor: None, ..plot(vec![line("ld", 4.0, -0.5), line("uniform", 1.0, -0.5)]) };
        let axes = Axes::of(&frame(), std::slice::from_ref(&plot));
        let panel = Panel::new(&axes, Bounds { left: 0.0, top: 0.0, right: 300.0, bottom: 200.0 });
        let guide = panel.guide(&plot, -0.5).unwrap();
        assert!((guide[0].1 - panel.y.pixel(2.0)).abs() < 1e-9, "the geometric mean of 4 and 1 is 2");
        let (_, end) = panel.x.ends();
        assert!((guide[1].1 - panel.y.pixel(2.0 / end.sqrt())).abs() < 1e-9, "{guide:?}");
        assert!((guide[1].0 - 300.0).abs() < 1e-9);
    }

    #[test]
    fn measured_counts_label_the_horizontal_axis() {
        let svg = loglog_chart(&frame(), &plot(vec![line("ld", 1.0, -1.0)])).svg;
        for count in ["1", "4", "16", "26", "64", "256"] {
            assert!(svg.contains(&format!(">\n{count}\n</text>")), "{count}");
        }
    }
}
