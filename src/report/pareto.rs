//! Speed against accuracy: seconds and error of every sampler and count, and which of them nothing beats at both.

use super::axis::{LogAxis, number_label};
use super::figure::{Align, Bounds, Colour, Dash, Drawing, Figure, PAGE_WIDTH, Place, Text, shortened, text_width};
use super::frame::{
    FOOT, Frame, Header, LeftOut, SMALL, draw_axis_names, draw_corner, draw_no_data, draw_small_x_ticks, draw_x_grid,
    draw_y_grid, left_margin,
};
use super::labels::kept_apart;
use super::legend::KEY;
use super::style::{GREY, INK, Marker, PALE, Style, draw_key, draw_marker, lightened, style_of};

/// One sampler at one count: what it cost and how far off it was.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Its line in the legend; trials of one label are joined in the order given.
    pub label: String,
    /// What tells it from the others of its label: `16 spp`.
    pub detail: String,
    /// Colour and shape.
    pub style: Style,
    /// Median seconds.
    pub seconds: f64,
    /// Spread of the seconds, low and high.
    pub seconds_interval: Option<(f64, f64)>,
    /// Error in the units of the y axis.
    pub error: f64,
    /// Its interval, low and high.
    pub error_interval: Option<(f64, f64)>,
}

impl Trial {
    /// A trial of the sampler `name`, in its style, without intervals.
    pub fn of_sampler(name: &str, detail: &str, seconds: f64, error: f64) -> Self {
        let (label, detail, style) = (name.to_owned(), detail.to_owned(), style_of(name));
        Self { label, detail, style, seconds, seconds_interval: None, error, error_interval: None }
    }
}

impl Trial {
    /// A point of another program, the `number`-th of its scene's programs: a star, in a colour that no sampler has.
    pub fn of_peer(name: &str, number: usize, seconds: f64, error: f64) -> Self {
        const COLOURS: [Colour; 4] = [[170, 51, 119], [102, 102, 102], [120, 94, 240], [136, 34, 85]];
        let filled = number % (2 * COLOURS.len()) < COLOURS.len();
        let style = Style { colour: COLOURS[number % COLOURS.len()], marker: Marker::Star, filled, dash: Dash::Dotted };
        Self { style, ..Self::of_sampler(name, "", seconds, error) }
    }
}

/// Indices of the trials that no other beats: none is at least as good in both coordinates and better in one; by
/// ascending seconds, of equal trials the first. Coordinates must be finite.
pub fn pareto_front(trials: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..trials.len()).collect();
    order.sort_by(|&a, &b| trials[a].0.total_cmp(&trials[b].0).then(trials[a].1.total_cmp(&trials[b].1)));
    let mut least = f64::INFINITY;
    order.retain(|&i| {
        let better = trials[i].1 < least;
        least = least.min(trials[i].1);
        better
    });
    order
}

/// Seconds (x) against error (y), both logarithmic, with the Pareto front as a step line and its members named; the
/// others are drawn light. Grey diagonals join what is equally good for independent samples: error² · seconds is the same
/// along one and a tenth along the next. `peers` are other programs' points: in the legend, in no line and no front.
/// Axis names and title come from `frame`; its `x_ticks` are not used.
///
/// The front is that of the medians. Trials whose seconds or error are not above 0 or not finite are left out and
/// counted under the subtitle.
pub fn pareto_chart(frame: &Frame, trials: &[Trial], peers: &[Trial]) -> Figure {
    drawn(frame, trials, peers).finish(&frame.title)
}

fn drawn(frame: &Frame, trials: &[Trial], peers: &[Trial]) -> Drawing {
    let mut left_out = LeftOut::default();
    let mut shown = |trials: &[Trial]| -> Vec<Trial> {
        trials.iter().filter(|trial| left_out.admits(&[trial.seconds, trial.error])).map(cleaned).collect()
    };
    let (trials, peers) = (shown(trials), shown(peers));
    let header = Header::new(frame, &[left_out.note()]);
    let labels = [legend(&trials), legend(&peers)].concat();
    let widest = labels.iter().map(|(label, _)| text_width(label, SMALL, false)).fold(112.0, f64::max).min(200.0);
    let front = pareto_front(&trials.iter().map(|t| (t.seconds, t.error)).collect::<Vec<_>>());
    let body = 440.0_f64.max(20.0 * (labels.len() + 5) as f64).max(NAME_STEP * (front.len() + 4) as f64);
    let mut drawing = Drawing::new(PAGE_WIDTH, header.height + ISO_ROOM + body + FOOT);
    header.draw(&mut drawing);
    let all = [trials.as_slice(), &peers].concat();
    let bounds = Bounds {
        left: left_margin(&axis_of(&errors(&all), 0.0, 1.0).ticks(9)),
        top: header.height + ISO_ROOM,
        right: PAGE_WIDTH - widest - KEY - 32.0,
        bottom: drawing.height - FOOT,
    };
    let chart = Chart::new(&trials, &peers, front, bounds);
    chart.draw_frame(&mut drawing, frame);
    chart.draw_equally_good(&mut drawing);
    draw_legend(&mut drawing, &labels, (bounds.right + 16.0, bounds.top + 8.0), widest);
    chart.draw(&mut drawing);
    drawing
}

/// Above the plot, for what the diagonals stand for.
const ISO_ROOM: f64 = 14.0;

/// The trial without intervals that cannot be drawn.
fn cleaned(trial: &Trial) -> Trial {
    let drawable = |interval: &(f64, f64)| interval.0.is_finite() && interval.1.is_finite() && interval.1 > 0.0;
    Trial {
        seconds_interval: trial.seconds_interval.filter(drawable),
        error_interval: trial.error_interval.filter(drawable),
        ..trial.clone()
    }
}

fn legend(trials: &[Trial]) -> Vec<(String, Style)> {
    let mut labels: Vec<(String, Style)> = Vec::new();
    for trial in trials {
        if !labels.iter().any(|(label, _)| *label == trial.label) {
            labels.push((trial.label.clone(), trial.style));
        }
    }
    labels
}

fn draw_legend(drawing: &mut Drawing, labels: &[(String, Style)], (left, top): Place, width: f64) {
    for (i, (label, style)) in labels.iter().enumerate() {
        let y = top + 20.0 * i as f64;
        draw_key(drawing, left, y, KEY, style);
        drawing.text((left + KEY + 6.0, y + 4.0), &shortened(label, SMALL, false, width), SMALL, INK, Align::Left);
    }
    if !labels.is_empty() {
        let y = top + 20.0 * labels.len() as f64 + 8.0;
        let step = [(left, y - 5.0), (left + KEY / 2.0, y - 5.0), (left + KEY / 2.0, y + 5.0), (left + KEY, y + 5.0)];
        drawing.line(&step, 1.6, INK, Dash::Solid);
        drawing.text((left + KEY + 6.0, y + 4.0), "Pareto front", SMALL, INK, Align::Left);
        drawing.text((left + KEY + 6.0, y + 20.0), "light: beaten by it", SMALL, GREY, Align::Left);
        drawing.line(&[(left, y + 31.0), (left + KEY, y + 41.0)], 1.0, PALE, Dash::Solid);
        drawing.text((left + KEY + 6.0, y + 40.0), "equally good", SMALL, GREY, Align::Left);
    }
}

/// Trials on their axes.
struct Chart<'a> {
    trials: &'a [Trial],
    peers: &'a [Trial],
    front: Vec<usize>,
    x: LogAxis,
    y: LogAxis,
    b: Bounds,
}

fn errors(trials: &[Trial]) -> Vec<(f64, Option<(f64, f64)>)> {
    trials.iter().map(|t| (t.error, t.error_interval)).collect()
}

/// How far an interval may widen the axes beyond the values.
const INTERVAL_REACH: f64 = 2.0;

/// An axis that holds the values and, within reason, their intervals.
fn axis_of(values: &[(f64, Option<(f64, f64)>)], from: f64, to: f64) -> LogAxis {
    let (low, high) = values.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v.0), h.max(v.0)));
    let ends = values.iter().filter_map(|v| v.1);
    let ends =
        ends.flat_map(|(l, h)| [l.max(low / INTERVAL_REACH).max(f64::MIN_POSITIVE), h.min(high * INTERVAL_REACH)]);
    LogAxis::around(values.iter().map(|v| v.0).chain(ends), 0.06, from, to)
}

impl<'a> Chart<'a> {
    /// Leaves room for names at the left, and below where the names run over the bottom.
    fn new(trials: &'a [Trial], peers: &'a [Trial], front: Vec<usize>, b: Bounds) -> Self {
        let all = [trials, peers].concat();
        let seconds: Vec<_> = all.iter().map(|t| (t.seconds, t.seconds_interval)).collect();
        let widest = front.iter().map(|&i| text_width(&name(&trials[i]), NAME, false)).fold(0.0, f64::max);
        let x = axis_of(&seconds, b.left + widest.min(NAME_SHARE * (b.right - b.left)) + 10.0, b.right);
        let y = axis_of(&errors(&all), b.bottom - NAME_STEP, b.top);
        Self { trials, peers, front, x, y, b }
    }

    fn place(&self, trial: &Trial) -> Place {
        (self.x.pixel(trial.seconds), self.y.pixel(trial.error))
    }

    fn draw_frame(&self, drawing: &mut Drawing, frame: &Frame) {
        draw_y_grid(drawing, &self.b, &self.y, &self.y.ticks(9), true);
        draw_x_grid(drawing, &self.b, &self.x, &self.x.ticks(9), true);
        draw_small_x_ticks(drawing, &self.b, &self.x);
        draw_corner(drawing, &self.b);
        draw_axis_names(drawing, &self.b, frame);
    }

    /// Lines of error² · seconds = 10^k, named above the plot where they leave it there.
    fn draw_equally_good(&self, drawing: &mut Drawing) {
        if self.trials.is_empty() && self.peers.is_empty() {
            return;
        }
        let product = |(x, y): Place| {
            let (seconds, error) = (self.x.value(x), self.y.value(y));
            libm::log10(error * error * seconds)
        };
        let (least, most) = (product((self.b.left, self.b.bottom)), product((self.b.right, self.b.top)));
        let mut named: Vec<(f64, String)> = Vec::new();
        for k in libm::ceil(least) as i32..=libm::floor(most) as i32 {
            let level = libm::pow(10.0, f64::from(k));
            let x_at = |y: f64| self.x.pixel(level / (self.y.value(y) * self.y.value(y)));
            let y_at = |x: f64| self.y.pixel((level / self.x.value(x)).sqrt());
            let from = if x_at(self.b.top) >= self.b.left {
                named.push((x_at(self.b.top), number_label(level)));
                (x_at(self.b.top), self.b.top)
            } else {
                (self.b.left, y_at(self.b.left))
            };
            let to = if x_at(self.b.bottom) <= self.b.right {
                (x_at(self.b.bottom), self.b.bottom)
            } else {
                (self.b.right, y_at(self.b.right))
            };
            // Corners may miss the plot by a rounding.
            let inside = |(x, y): Place| (x.clamp(self.b.left, self.b.right), y.clamp(self.b.top, self.b.bottom));
            drawing.line(&[inside(from), inside(to)], 1.0, lightened(PALE, 0.4), Dash::Solid);
        }
        let first = named.iter_mut().min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, text)) = first {
            *text = format!("RMSE² · s = {text}");
        }
        let width = |text: &str| text_width(text, NAME, false);
        let spans: Vec<(f64, f64)> =
            named.iter().map(|(x, text)| (x.max(self.b.left + width(text) / 2.0), width(text))).collect();
        for (((_, text), &(x, _)), shown) in named.iter().zip(&spans).zip(kept_apart(&spans, 8.0)) {
            if shown {
                drawing.text((x, self.b.top - 4.0), text, NAME, GREY, Align::Centre);
            }
        }
    }

    fn draw(&self, drawing: &mut Drawing) {
        if self.trials.is_empty() && self.peers.is_empty() {
            draw_no_data(drawing, &self.b);
            return;
        }
        for (label, style) in legend(self.trials) {
            let line: Vec<Place> = self.trials.iter().filter(|t| t.label == label).map(|t| self.place(t)).collect();
            drawing.line(&line, 1.0, lightened(style.colour, 0.65), style.dash);
        }
        let on_front = |i: &usize| self.front.contains(i);
        let (front, others): (Vec<usize>, Vec<usize>) = (0..self.trials.len()).partition(on_front);
        for (trials, light) in [(&others, 0.55), (&front, 0.0)] {
            trials.iter().for_each(|&i| self.draw_box(drawing, &self.trials[i], light));
        }
        for &i in &others {
            self.draw_trial(drawing, &self.trials[i], 0.55);
        }
        self.draw_front(drawing);
        self.draw_names(drawing);
        for &i in &front {
            self.draw_trial(drawing, &self.trials[i], 0.0);
        }
        for peer in self.peers {
            self.draw_box(drawing, peer, 0.0);
            self.draw_trial(drawing, peer, 0.0);
        }
    }

    /// The two intervals of a trial as a box; a cross where there is but one of them.
    fn draw_box(&self, drawing: &mut Drawing, trial: &Trial, light: f64) {
        let ((x, y), colour) = (self.place(trial), lightened(trial.style.colour, light));
        let across = trial.seconds_interval.map(|(low, high)| (self.x.clamped(low), self.x.clamped(high)));
        let up = trial.error_interval.map(|(low, high)| (self.y.clamped(low), self.y.clamped(high)));
        let bars = lightened(trial.style.colour, light.max(0.35));
        match (across, up) {
            (Some((left, right)), Some((bottom, top))) => {
                drawing.rectangle(Bounds { left, top, right, bottom }, colour, 0.22);
                let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
                drawing.line(&corners, 0.9, bars, Dash::Solid);
            }
            (Some((left, right)), None) => drawing.line(&[(left, y), (right, y)], 1.6, bars, Dash::Solid),
            (None, Some((bottom, top))) => drawing.line(&[(x, bottom), (x, top)], 1.6, bars, Dash::Solid),
            (None, None) => {}
        }
    }

    /// A marker; `light` moves its colours towards white.
    fn draw_trial(&self, drawing: &mut Drawing, trial: &Trial, light: f64) {
        let style = Style { colour: lightened(trial.style.colour, light), ..trial.style };
        draw_marker(drawing, self.place(trial), if light > 0.0 { 3.0 } else { 4.2 }, &style);
    }

    /// From the top edge down to the cheapest member, along the steps, and out to the right edge.
    fn draw_front(&self, drawing: &mut Drawing) {
        let places: Vec<Place> = self.front.iter().map(|&i| self.place(&self.trials[i])).collect();
        let (Some(first), Some(last)) = (places.first(), places.last()) else { return };
        let mut steps = vec![(first.0, self.b.top), *first];
        for ends in places.windows(2) {
            steps.extend([(ends[1].0, ends[0].1), ends[1]]);
        }
        steps.push((self.b.right, last.1));
        drawing.line(&steps, 1.6, INK, Dash::Solid);
    }

    /// Names the members of the front. Below and left of it nothing stands, by its definition: each name goes there, right
    /// of nothing but its own marker, as high as the names before it allow; so no name or leader crosses another.
    fn draw_names(&self, drawing: &mut Drawing) {
        let room = NAME_SHARE * (self.b.right - self.b.left);
        let names = self.front.iter().map(|&i| shortened(&name(&self.trials[i]), NAME, false, room));
        for ((&i, name), baseline) in self.front.iter().zip(names).zip(self.baselines()) {
            let (x, y) = self.place(&self.trials[i]);
            let reach = |t: &Trial| t.seconds_interval.map_or(t.seconds, |(low, _)| low.min(t.seconds));
            let in_the_way = self.trials.iter().filter(|t| {
                let (top, bottom) = self.rows(t);
                top < baseline + 4.0 && bottom > baseline - NAME
            });
            let right =
                in_the_way.map(|t| self.x.clamped(reach(t)).min(self.place(t).0 - 7.0)).fold(x - 7.0, f64::min) - 3.0;
            let text = Text {
                at: (right.max(self.b.left + 4.0 + text_width(&name, NAME, false)), baseline),
                text: name,
                size: NAME,
                bold: false,
                colour: INK,
                align: Align::Right,
                turned: false,
            };
            if baseline - y > NAME + 4.0 {
                drawing.line(&[(text.at.0 + 2.0, baseline - 4.0), (x, y + 6.0)], 0.8, PALE, Dash::Solid);
            }
            drawing.add_text(text);
        }
    }

    /// First and last row of pixels that names keep clear of for a trial: its marker and its box, of a tall box (an error that is
    /// hardly known) the middle alone, since a name reads well on its light tint and would be far from its own marker else.
    fn rows(&self, trial: &Trial) -> (f64, f64) {
        let y = self.place(trial).1;
        let (low, high) = trial.error_interval.unwrap_or((trial.error, trial.error));
        let reach = |end: f64| self.y.clamped(end).clamp(y - TALL, y + TALL);
        (reach(high).min(y - 6.0), reach(low).max(y + 6.0))
    }

    /// Baselines of the front's names: each just below its marker or below the name before it; at the bottom moved up
    /// as far as needed.
    fn baselines(&self) -> Vec<f64> {
        let mut next = f64::NEG_INFINITY;
        let mut baselines: Vec<f64> = Vec::new();
        for &i in &self.front {
            let y = (self.place(&self.trials[i]).1 + NAME + 2.0).max(next);
            baselines.push(y);
            next = y + NAME_STEP;
        }
        let mut limit = self.b.bottom - 5.0;
        for y in baselines.iter_mut().rev() {
            *y = y.min(limit);
            limit = *y - NAME_STEP;
        }
        baselines
    }
}

/// Size of a name in pixels, and from one name's line to the next.
const NAME: f64 = 11.0;
const NAME_STEP: f64 = 12.5;
/// How far a box keeps names off above and below its marker.
const TALL: f64 = 20.0;
/// Names take at most this share of the plot's width.
const NAME_SHARE: f64 = 0.4;

/// The count alone: colour and shape name the sampler, and a longer text would take the plot's width.
fn name(trial: &Trial) -> String {
    trial.detail.clone()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRng, TestRunner};

    #[test]
    fn the_front_is_what_nothing_beats() {
        let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
        let config = Config { cases: 300, failure_persistence: None, ..Config::default() };
        let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(Default::default()));
        let trials = proptest::collection::vec((0u8..8, 0u8..8), 0..12);
        runner
            .run(&trials, |trials| {
                let trials: Vec<(f64, f64)> = trials.iter().map(|&(x, y)| (x.into(), y.into())).collect();
                let mut twin: Vec<usize> = (0..trials.len())
                    .filter(|&i| !trials.iter().any(|&other| beats(other, trials[i])))
                    .filter(|&i| !trials[..i].contains(&trials[i]))
                    .collect();
                twin.sort_by(|&a, &b| trials[a].0.total_cmp(&trials[b].0));
                prop_assert_eq!(pareto_front(&trials), twin);
                Ok(())
            })
            .unwrap();
    }

    #[test]
    fn trials_without_a_logarithm_are_counted_and_an_empty_chart_says_so() {
        let frame = Frame::default();
        let trials = [("ld:best", 0.0, 1.0), ("ld:best", 1.0, f64::NAN), ("ld:best", 1.0, -1.0)];
        let trials = trials.map(|(name, seconds, error)| Trial::of_sampler(name, "4 spp", seconds, error));
        let svg = pareto_chart(&frame, &trials, &[]).svg;
        assert!(svg.contains("2 points not shown: not above 0 · 1 point not shown: not finite"), "{svg}");
        assert!(svg.contains("no data"));
    }

    #[test]
    fn names_on_the_front_keep_apart_and_on_the_page() {
        let config = Config { cases: 80, failure_persistence: None, ..Config::default() };
        let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(Default::default()));
        let name =
            prop::sample::select(&["ld:best", "uniform:sheet", "halton:joint:digits@each, lens by sobol:best"][..]);
        let trial = (name, 0u32..20, -3.0..2.0f64, -12.0..3.0f64, prop::option::of(0.0..2.0f64));
        let trials = proptest::collection::vec(trial, 0..60);
        runner
            .run(&trials, |trials| {
                let trials: Vec<Trial> = trials
                    .into_iter()
                    .map(|(name, k, seconds, error, spread)| {
                        let (seconds, error) = (libm::pow(10.0, seconds), libm::pow(10.0, error));
                        let interval = |v: f64| spread.map(|s| (v * (1.0 - s), v * (1.0 + s)));
                        Trial {
                            seconds_interval: interval(seconds),
                            error_interval: interval(error),
                            ..Trial::of_sampler(name, &format!("{k} spp"), seconds, error)
                        }
                    })
                    .collect();
                let (ours, peers) = trials.split_at(trials.len() * 3 / 4);
                drawn(&Frame::default(), ours, peers).assert_legible();
                Ok(())
            })
            .unwrap();
    }

    #[test]
    fn a_front_of_forty_members_has_forty_names() {
        let trial = |i: i32| {
            Trial::of_sampler("ld:best", &format!("{i} spp"), 1.01 + 1e-3 * f64::from(i), 2.0 - 1e-3 * f64::from(i))
        };
        let drawing = drawn(&Frame::default(), &(0..40).map(trial).collect::<Vec<_>>(), &[]);
        drawing.assert_legible();
        assert_eq!(drawing.finish("").svg.matches(" spp\n").count(), 40);
    }
}
