//! Ratios sampler by sampler: several dots with intervals on one line, about a value at which nothing differs.

use super::axis::LogAxis;
use super::figure::{Align, Bounds, Colour, Dash, Drawing, Figure, PAGE_WIDTH, shortened, text_width};
use super::frame::{
    FOOT, Frame, HEADING, Header, LeftOut, SMALL, draw_axis_names, draw_corner, draw_no_data, draw_small_x_ticks,
    draw_x_grid,
};
use super::style::{GREY, INK, Marker, Style, draw_marker, style_of};

/// One number with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// Index of what it is a number of, see [`dot_chart`].
    pub kind: usize,
    /// The number, above 0.
    pub value: f64,
    /// Low and high end of its interval.
    pub interval: Option<(f64, f64)>,
}

/// One sampler and its dots.
#[derive(Debug, Clone, PartialEq)]
pub struct DotRow {
    /// The sampler, in the style of the other figures.
    pub label: String,
    /// Its dots, each in a lane of its own.
    pub dots: Vec<Dot>,
}

/// Rows under a common heading: a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct DotGroup {
    /// Heading.
    pub title: String,
    /// Samplers, top to bottom.
    pub rows: Vec<DotRow>,
}

/// Height of one dot's lane, and room about the lanes of a row.
const LANE: f64 = 8.0;
const ROOM: f64 = 7.0;
const HEADING_STEP: f64 = 26.0;
const STRIPE: Colour = [245; 3];

/// Colours and shapes of the kinds, by their index: told apart by the colour-blind, and in grey.
const KINDS: [(Colour, Marker); 5] = [
    ([0, 114, 178], Marker::TriangleDown),
    ([213, 94, 0], Marker::TriangleUp),
    ([0, 158, 115], Marker::Diamond),
    ([0, 0, 0], Marker::Circle),
    ([204, 121, 167], Marker::Square),
];

fn kind_style(kind: usize) -> Style {
    let (colour, marker) = KINDS[kind % KINDS.len()];
    Style { colour, marker, filled: true, dash: Dash::Solid }
}

/// A logarithmic axis (named by `frame.x_label`) with a row a sampler and a dot for each of up to five `kinds`, and a line at
/// `middle`. Numbers that a logarithm cannot show are counted in the header.
pub fn dot_chart(frame: &Frame, kinds: &[String], middle: f64, groups: &[DotGroup]) -> Figure {
    drawn(frame, kinds, middle, groups).finish(&frame.title)
}

fn drawn(frame: &Frame, kinds: &[String], middle: f64, groups: &[DotGroup]) -> Drawing {
    let mut left_out = LeftOut::default();
    let shown: Vec<DotGroup> = groups.iter().map(|group| admitted(group, &mut left_out)).collect();
    let rows = || shown.iter().flat_map(|group| &group.rows);
    let widest = rows().map(|row| text_width(&row.label, SMALL, false)).fold(60.0, f64::max).min(220.0);
    let header = Header::new(frame, &[left_out.note()]);
    let row_height = kinds.len().max(1) as f64 * LANE + ROOM;
    let body = (rows().count() as f64 * row_height + shown.len() as f64 * HEADING_STEP).max(60.0) + 8.0;
    let top = header.height + 24.0;
    let mut drawing = Drawing::new(PAGE_WIDTH, top + body + FOOT);
    header.draw(&mut drawing);
    let b = Bounds { left: 12.0 + 20.0 + widest + 12.0, top, right: PAGE_WIDTH - 24.0, bottom: top + body };
    draw_key(&mut drawing, kinds, b.left, header.height + 6.0);
    let values = rows().flat_map(|row| &row.dots).flat_map(|dot| {
        let (low, high) = dot.interval.unwrap_or((dot.value, dot.value));
        // An interval that reaches far is cut, or it would press all others together.
        [dot.value, low.max(dot.value / 4.0), high.min(dot.value * 4.0)]
    });
    let axis = LogAxis::around(values.chain([middle]), 0.04, b.left, b.right);
    draw_stripes(&mut drawing, &shown, row_height, &b);
    draw_x_grid(&mut drawing, &b, &axis, &axis.ticks(10), true);
    draw_small_x_ticks(&mut drawing, &b, &axis);
    drawing.line(&[(axis.pixel(middle), b.top), (axis.pixel(middle), b.bottom)], 1.4, GREY, Dash::Dashed);
    draw_corner(&mut drawing, &b);
    draw_axis_names(&mut drawing, &b, &Frame { y_label: String::new(), ..frame.clone() });
    let mut y = b.top + 4.0;
    for group in &shown {
        drawing.heading((12.0, y + 18.0), &shortened(&group.title, HEADING, true, b.left - 24.0));
        y += HEADING_STEP;
        for row in &group.rows {
            draw_row(&mut drawing, &axis, row, y, row_height, widest);
            y += row_height;
        }
    }
    if rows().next().is_none() {
        draw_no_data(&mut drawing, &b);
    }
    drawing
}

/// The group without the dots that no logarithm shows.
fn admitted(group: &DotGroup, left_out: &mut LeftOut) -> DotGroup {
    let mut group = group.clone();
    for row in &mut group.rows {
        row.dots.retain(|dot| left_out.admits(&[dot.value]));
    }
    group
}

fn draw_key(drawing: &mut Drawing, kinds: &[String], left: f64, y: f64) {
    let mut x = left;
    for (kind, name) in kinds.iter().enumerate() {
        let style = kind_style(kind);
        drawing.line(&[(x, y), (x + 22.0, y)], 2.0, style.colour, Dash::Solid);
        draw_marker(drawing, (x + 11.0, y), 3.4, &style);
        drawing.text((x + 27.0, y + 4.0), name, SMALL, INK, Align::Left);
        x += 27.0 + text_width(name, SMALL, false) + 20.0;
    }
}

fn draw_stripes(drawing: &mut Drawing, groups: &[DotGroup], row_height: f64, b: &Bounds) {
    let mut top = b.top + 4.0;
    for group in groups {
        top += HEADING_STEP;
        for i in (0..group.rows.len()).step_by(2) {
            let y = top + i as f64 * row_height;
            drawing.rectangle(Bounds { left: 12.0, top: y, right: b.right, bottom: y + row_height }, STRIPE, 1.0);
        }
        top += group.rows.len() as f64 * row_height;
    }
}

fn draw_row(drawing: &mut Drawing, axis: &LogAxis, row: &DotRow, top: f64, height: f64, width: f64) {
    let middle = top + height / 2.0;
    draw_marker(drawing, (21.0, middle), 3.6, &style_of(&row.label));
    drawing.text((32.0, middle + 4.0), &shortened(&row.label, SMALL, false, width), SMALL, INK, Align::Left);
    for dot in &row.dots {
        let y = top + (ROOM + LANE) / 2.0 + dot.kind as f64 * LANE;
        let style = kind_style(dot.kind);
        if let Some((low, high)) = dot.interval.filter(|(low, high)| !low.is_nan() && !high.is_nan()) {
            let high = if high.is_finite() { high } else { f64::MAX };
            drawing.line(&[(axis.clamped(low), y), (axis.clamped(high), y)], 2.0, style.colour, Dash::Solid);
        }
        draw_marker(drawing, (axis.pixel(dot.value), y), 3.2, &style);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds() -> Vec<String> {
        ["63 spp", "65 spp", "26 spp", "two passes"].map(str::to_owned).to_vec()
    }

    fn group(title: &str, rows: usize) -> DotGroup {
        let dot = |kind: usize| Dot { kind, value: 1.0 + 0.1 * kind as f64, interval: Some((0.9, 1.5)) };
        let row = |_| DotRow { label: "halton:joint:digits@each".to_owned(), dots: (0..4).map(dot).collect() };
        DotGroup { title: title.to_owned(), rows: (0..rows).map(row).collect() }
    }

    #[test]
    fn thirty_rows_stay_legible() {
        drawn(&Frame::default(), &kinds(), 1.0, &[group("a01", 20), group("a scene of a very long name indeed", 10)])
            .assert_legible();
    }

    #[test]
    fn numbers_that_no_logarithm_shows_are_counted_and_nothing_is_no_data() {
        let mut odd = group("a01", 1);
        for (dot, value) in odd.rows[0].dots.iter_mut().zip([f64::NAN, -1.0, 1e-9, 1e9]) {
            *dot = Dot { value, interval: Some((f64::NAN, f64::INFINITY)), ..*dot };
        }
        let svg = dot_chart(&Frame::default(), &kinds(), 1.0, &[odd]).svg;
        assert!(svg.contains("1 point not shown: not above 0 · 1 point not shown: not finite"), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert!(dot_chart(&Frame::default(), &kinds(), 1.0, &[]).svg.contains("no data"));
    }
}
