//! Names of lines: in a column at their ends, or together below a grid of plots.

use super::figure::{Align, Bounds, Dash, Drawing, PAGE_WIDTH, Place, shortened, text_width};
use super::frame::SMALL;
use super::labels::spread;
use super::plots::{Guide, Plot};
use super::style::{GREY, GRID, INK, PALE, Style, draw_key, lightened};

/// From a label's line to the next.
pub(super) const LABEL_STEP: f64 = 15.0;
/// From the plot's right edge to the keys of the labels beside it: room for leader lines.
pub(super) const LEADER: f64 = 20.0;
/// Width of the piece of line shown before a name.
pub(super) const KEY: f64 = 26.0;

/// A label beside the plot: where its line ends, what it says, and the key before it (none: a helper line, in grey).
pub(super) struct Ending {
    pub at: Place,
    pub text: String,
    pub style: Option<Style>,
}

/// Labels beside the plot, as near to their lines' ends as they can stand apart, each tied to its end.
pub(super) fn draw_column(drawing: &mut Drawing, b: &Bounds, endings: &[Ending], width: f64) {
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
pub(super) struct Legend {
    entries: Vec<(String, Style)>,
    floors: Vec<String>,
    guides: Vec<Guide>,
    columns: usize,
    step: f64,
}

const LEGEND_STEP: f64 = 18.0;

impl Legend {
    /// Labels in the order they first appear.
    pub fn of(plots: &[Plot]) -> Self {
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

    /// Room it takes, in pixels.
    pub fn height(&self) -> f64 {
        let helpers = usize::from(!self.floors.is_empty() || !self.guides.is_empty());
        10.0 + LEGEND_STEP * (self.rows() + helpers) as f64
    }

    /// Draws it with its upper left corner there.
    pub fn draw(&self, drawing: &mut Drawing, left: f64, top: f64) {
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
