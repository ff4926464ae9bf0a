//! A figure is a list of marks, in pixels of a page; plotters paints the list twice, as SVG and as pixels.
//!
//! Charts only ever add marks, so what they draw can be tested without looking at pixels, and both files show the
//! same thing. Fonts come from a crate and are registered once: no font of the machine is asked for.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Once;

use plotters::backend::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{PathElement, Polygon};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    FontDesc, FontFamily, FontStyle, FontTransform, RGBAColor, ShapeStyle, TextStyle, register_font,
};

use crate::error::Result;
use crate::film::{write_png_rgb8, write_whole};

/// Width of a figure on the page, in pixels: the width of a report's column.
pub const PAGE_WIDTH: f64 = 860.0;

/// sRGB, 8 bits a channel.
pub type Colour = [u8; 3];

/// A place on the page: pixels from the left and from the top.
pub type Place = (f64, f64);

/// Units of the SVG per pixel of the page: plotters writes whole numbers, and a tenth of a pixel is fine enough.
const SVG_UNITS: f64 = 10.0;
/// Pixels painted per pixel of the page.
const PAINTED_PIXELS: u32 = 3;
/// Each PNG pixel is the mean of this many painted pixels squared, because plotters smooths thin strokes poorly on its
/// own: 1.5 PNG pixels for one of the page stay sharp on a dense screen.
const OVERSAMPLING: u32 = 2;

/// 8-bit sRGB pixels, top row first, three bytes each: `bytes[3 * (y * width + x)]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rgb8 {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `3 * width * height` bytes.
    pub bytes: Vec<u8>,
}

impl Rgb8 {
    /// A raster of one colour.
    pub fn filled(width: u32, height: u32, colour: Colour) -> Self {
        Self { width, height, bytes: colour.repeat(width as usize * height as usize) }
    }

    /// The colour at column `x`, row `y` from the top; both must be inside.
    pub fn pixel(&self, x: u32, y: u32) -> Colour {
        let at = 3 * (y as usize * self.width as usize + x as usize);
        [self.bytes[at], self.bytes[at + 1], self.bytes[at + 2]]
    }

    /// Sets the pixel at column `x`, row `y`; what lies outside is clipped.
    pub fn set(&mut self, x: i64, y: i64, colour: Colour) {
        if (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y) {
            let at = 3 * (y as usize * self.width as usize + x as usize);
            self.bytes[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Writes a PNG.
    ///
    /// # Errors
    /// Kind `Write` where the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_png_rgb8(path, self.width, self.height, &self.bytes)
    }

    /// Paints `marks` over the raster, `scale` pixels for one pixel of the page; what they leave free keeps its bits.
    pub(super) fn annotate(&mut self, marks: &[Mark], scale: f64) {
        let mut large = self.enlarged(OVERSAMPLING);
        large.paint(marks, scale * f64::from(OVERSAMPLING));
        *self = large.shrunk(OVERSAMPLING);
    }

    /// Paints without smoothing.
    fn paint(&mut self, marks: &[Mark], scale: f64) {
        let size = (self.width, self.height);
        paint(&BitMapBackend::with_buffer(&mut self.bytes, size).into_drawing_area(), marks, scale, &PIXEL_TEXT);
    }

    /// Each pixel becomes a square of `factor`² pixels.
    fn enlarged(&self, factor: u32) -> Self {
        let mut bytes = Vec::with_capacity(self.bytes.len() * (factor * factor) as usize);
        for row in self.bytes.chunks_exact(3 * self.width as usize) {
            let wide: Vec<u8> = row.chunks_exact(3).flat_map(|pixel| pixel.repeat(factor as usize)).collect();
            bytes.extend(wide.repeat(factor as usize));
        }
        Self { width: self.width * factor, height: self.height * factor, bytes }
    }

    /// Each output pixel is the mean of a square of `factor`² pixels, rounded to nearest.
    fn shrunk(&self, factor: u32) -> Self {
        let (width, height) = (self.width / factor, self.height / factor);
        let mut bytes = Vec::with_capacity(3 * width as usize * height as usize);
        let area = factor * factor;
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0u32; 3];
                for (dy, dx) in (0..factor).flat_map(|dy| (0..factor).map(move |dx| (dy, dx))) {
                    let colour = self.pixel(x * factor + dx, y * factor + dy);
                    sum.iter_mut().zip(colour).for_each(|(s, c)| *s += u32::from(c));
                }
                bytes.extend(sum.map(|s| ((s + area / 2) / area) as u8));
            }
        }
        Self { width, height, bytes }
    }
}

/// One chart, drawn twice: as vectors and as pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// An SVG document that carries its own text and names fallback fonts.
    pub svg: String,
    /// The same picture, 1.5 pixels for one of the page.
    pub raster: Rgb8,
}

impl Figure {
    /// Writes `NAME.svg` and `NAME.png` into `folder`.
    ///
    /// # Errors
    /// Kind `Write` where a file cannot be written.
    pub fn write(&self, folder: &Path, name: &str) -> Result<()> {
        write_whole(&folder.join(format!("{name}.svg")), self.svg.as_bytes())?;
        self.raster.write(&folder.join(format!("{name}.png")))
    }
}

/// How a line is broken: lengths of dash and gap in pixels, in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dash {
    /// Unbroken.
    Solid,
    /// Long dashes.
    Dashed,
    /// Short dashes.
    Dotted,
    /// Long and short in turn.
    DashDot,
}

impl Dash {
    fn pattern(self) -> &'static [f64] {
        match self {
            Self::Solid => &[],
            Self::Dashed => &[6.0, 3.5],
            Self::Dotted => &[1.8, 2.6],
            Self::DashDot => &[7.0, 2.6, 1.8, 2.6],
        }
    }
}

/// Which part of a text its place names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Centre,
    Right,
}

/// A line of text; `at` is on its baseline.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Text {
    pub at: Place,
    pub text: String,
    /// Height of the em square in pixels.
    pub size: f64,
    pub bold: bool,
    pub colour: Colour,
    pub align: Align,
    /// Reads upwards, for a vertical axis.
    pub turned: bool,
}

/// An axis-parallel box: left, top, right, bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Bounds {
    pub fn overlaps(&self, other: &Self) -> bool {
        self.left < other.right && other.left < self.right && self.top < other.bottom && other.top < self.bottom
    }

    pub fn inside(&self, other: &Self) -> bool {
        self.left >= other.left && self.right <= other.right && self.top >= other.top && self.bottom <= other.bottom
    }
}

impl Text {
    /// The box the letters stand in: ascenders to descenders (0.76 em above the baseline, 0.24 below).
    pub fn bounds(&self) -> Bounds {
        let width = text_width(&self.text, self.size, self.bold);
        let before = match self.align {
            Align::Left => 0.0,
            Align::Centre => width / 2.0,
            Align::Right => width,
        };
        let (x, y) = self.at;
        let (above, below) = (0.76 * self.size, 0.24 * self.size);
        if self.turned {
            Bounds { left: x - above, top: y + before - width, right: x + below, bottom: y + before }
        } else {
            Bounds { left: x - before, top: y - above, right: x - before + width, bottom: y + below }
        }
    }
}

/// One thing drawn. Lines are opaque (a light line has a light colour), so their joints need no care.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Mark {
    Line { points: Vec<Place>, width: f64, colour: Colour, dash: Dash },
    Area { points: Vec<Place>, colour: Colour, alpha: f64 },
    Text(Text),
}

/// Marks on a white page.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drawing {
    pub width: f64,
    pub height: f64,
    pub marks: Vec<Mark>,
}

impl Drawing {
    /// A page of whole pixels.
    pub fn new(width: f64, height: f64) -> Self {
        Self { width: width.round(), height: height.round(), marks: Vec::new() }
    }

    /// A line through at least two points; fewer leave no mark.
    pub fn line(&mut self, points: &[Place], width: f64, colour: Colour, dash: Dash) {
        if points.len() > 1 {
            self.marks.push(Mark::Line { points: points.to_vec(), width, colour, dash });
        }
    }

    pub fn area(&mut self, points: &[Place], colour: Colour, alpha: f64) {
        self.marks.push(Mark::Area { points: points.to_vec(), colour, alpha });
    }

    pub fn rectangle(&mut self, b: Bounds, colour: Colour, alpha: f64) {
        let corners = [(b.left, b.top), (b.right, b.top), (b.right, b.bottom), (b.left, b.bottom)];
        self.area(&corners, colour, alpha);
    }

    /// Horizontal text; empty text leaves no mark.
    pub fn text(&mut self, at: Place, text: &str, size: f64, colour: Colour, align: Align) {
        self.add_text(Text { at, text: text.to_owned(), size, bold: false, colour, align, turned: false });
    }

    /// Bold text over a part of the page.
    pub fn heading(&mut self, at: Place, text: &str) {
        let (text, colour) = (text.to_owned(), super::style::INK);
        self.add_text(Text {
            at,
            text,
            size: super::frame::HEADING,
            bold: true,
            colour,
            align: Align::Left,
            turned: false,
        });
    }

    pub fn add_text(&mut self, text: Text) {
        if !text.text.is_empty() {
            self.marks.push(Mark::Text(text));
        }
    }

    /// Paints the page; `title` is what a reader of the SVG without eyes is told.
    pub fn finish(&self, title: &str) -> Figure {
        Figure { svg: self.svg(title), raster: self.raster() }
    }

    fn svg(&self, title: &str) -> String {
        let mut body = String::new();
        let size = ((self.width * SVG_UNITS) as u32, (self.height * SVG_UNITS) as u32);
        {
            let area = SVGBackend::with_string(&mut body, size).into_drawing_area();
            paint(&area, &self.marks, SVG_UNITS, &SVG_TEXT);
        }
        finished_svg(self, &body, title)
    }

    fn raster(&self) -> Rgb8 {
        let (width, height) = (self.width as u32 * PAINTED_PIXELS, self.height as u32 * PAINTED_PIXELS);
        let mut raster = Rgb8::filled(width, height, [255; 3]);
        raster.paint(&self.marks, f64::from(PAINTED_PIXELS));
        let mut raster = raster.shrunk(OVERSAMPLING);
        self.coarsen_blends(&mut raster);
        raster
    }

    /// Rounds every colour that no mark has to 16 levels a channel: edges and overlaps look the same, and the PNG is
    /// half as large.
    fn coarsen_blends(&self, raster: &mut Rgb8) {
        let own: BTreeSet<Colour> = self
            .marks
            .iter()
            .map(|mark| match mark {
                Mark::Line { colour, .. } | Mark::Area { colour, .. } => *colour,
                Mark::Text(text) => text.colour,
            })
            .collect();
        for pixel in raster.bytes.chunks_exact_mut(3) {
            if !own.contains(&[pixel[0], pixel[1], pixel[2]]) {
                pixel.iter_mut().for_each(|c| *c = ((u32::from(*c) * 15 + 127) / 255 * 17) as u8);
            }
        }
    }
}

/// How a plotters backend wants text: font size per em, and how far below the given place the baseline lands, in ems.
struct TextRules {
    size_per_em: f64,
    baseline: f64,
    /// The backend draws letters and strokes itself: glyphs that the font lacks are replaced, and wide lines are drawn
    /// as areas, because its own wide paths have poor joints.
    pixels: bool,
}

/// plotters' SVG divides sizes by 1.24; its offset to the baseline is taken out again by [`finished_svg`].
const SVG_TEXT: TextRules = TextRules { size_per_em: 1.24, baseline: 0.0, pixels: false };
/// Its pixel text takes ascent − descent for the size, (2189 + 600) / 2048 em in Noto Sans, and puts the baseline half
/// a size below the place.
const PIXEL_TEXT: TextRules = TextRules { size_per_em: NOTO_HEIGHT, baseline: NOTO_HEIGHT / 2.0, pixels: true };
const NOTO_HEIGHT: f64 = 2789.0 / 2048.0;

const FAMILY: &str = "Noto Sans";
const FALLBACKS: &str = "Noto Sans, DejaVu Sans, Arial, sans-serif";
/// Memory cannot refuse to be written, and the fonts are compiled in.
const CANNOT_FAIL: &str = "painting into memory with fonts that are compiled in does not fail";

fn font(size: f64, bold: bool) -> FontDesc<'static> {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        let fonts = [(FontStyle::Normal, ttf_noto_sans::REGULAR), (FontStyle::Bold, ttf_noto_sans::BOLD)];
        for (style, bytes) in fonts {
            assert!(register_font(FAMILY, style, bytes).is_ok(), "the font crate holds readable fonts");
        }
    });
    FontDesc::new(FontFamily::Name(FAMILY), size, if bold { FontStyle::Bold } else { FontStyle::Normal })
}

/// The font has raised digits but no raised minus; its macron looks like one.
fn in_font(text: &str) -> String {
    text.replace('⁻', "¯")
}

/// Width of a line of text in pixels, where the em square is `size` pixels high.
pub(super) fn text_width(text: &str, size: f64, bold: bool) -> f64 {
    // Measured large, because plotters rounds widths to whole pixels.
    const LARGE: f64 = 1000.0;
    let (width, _) = font(LARGE * NOTO_HEIGHT, bold).box_size(&in_font(text)).expect(CANNOT_FAIL);
    f64::from(width) * size / LARGE
}

/// `text` broken at spaces into lines of at most `width` pixels; a longer word keeps a line of its own.
pub(super) fn wrapped(text: &str, size: f64, bold: bool, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(&format!("{line} {word}"), size, bold) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// `text`, cut with an ellipsis where it is wider than `width` pixels.
pub(super) fn shortened(text: &str, size: f64, bold: bool, width: f64) -> String {
    if text_width(text, size, bold) <= width {
        return text.to_owned();
    }
    let letters: Vec<char> = text.chars().collect();
    (0..letters.len())
        .rev()
        .map(|n| letters[..n].iter().chain(&['…']).collect::<String>())
        .find(|cut| text_width(cut, size, bold) <= width)
        .unwrap_or_default()
}

fn paint<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, marks: &[Mark], scale: f64, rules: &TextRules) {
    let pixel = |(x, y): Place| ((x * scale).round() as i32, (y * scale).round() as i32);
    for mark in marks {
        match mark {
            Mark::Area { points, colour: [r, g, b], alpha } => {
                let fill = ShapeStyle::from(RGBAColor(*r, *g, *b, *alpha)).filled();
                let points: Vec<_> = points.iter().copied().map(pixel).collect();
                area.draw(&Polygon::new(points, fill)).expect(CANNOT_FAIL);
            }
            Mark::Line { points, width, colour, dash } if rules.pixels => {
                let pieces = dashes(points, dash.pattern());
                let areas = pieces.iter().flat_map(|piece| stroke(piece, *width));
                let areas: Vec<Mark> = areas.map(|points| Mark::Area { points, colour: *colour, alpha: 1.0 }).collect();
                paint(area, &areas, scale, rules);
            }
            Mark::Line { points, width, colour: [r, g, b], .. } => {
                let style = ShapeStyle::from(RGBAColor(*r, *g, *b, 1.0)).stroke_width((width * scale).round() as u32);
                let points: Vec<_> = points.iter().copied().map(pixel).collect();
                area.draw(&PathElement::new(points, style)).expect(CANNOT_FAIL);
            }
            Mark::Text(text) => paint_text(area, text, scale, rules),
        }
    }
}

fn paint_text<DB: DrawingBackend>(area: &DrawingArea<DB, Shift>, text: &Text, scale: f64, rules: &TextRules) {
    let h_pos = match text.align {
        Align::Left => HPos::Left,
        Align::Centre => HPos::Center,
        Align::Right => HPos::Right,
    };
    let offset = rules.baseline * text.size;
    let (x, y, turn) = match (text.turned, text.at) {
        (true, (x, y)) => (x - offset, y, FontTransform::Rotate270),
        (false, (x, y)) => (x, y - offset, FontTransform::None),
    };
    let [r, g, b] = text.colour;
    let colour = RGBAColor(r, g, b, 1.0);
    let style = TextStyle::from(font(text.size * rules.size_per_em * scale, text.bold).transform(turn))
        .color(&colour)
        .pos(Pos::new(h_pos, VPos::Top));
    let at = ((x * scale).round() as i32, (y * scale).round() as i32);
    let letters = if rules.pixels { in_font(&text.text) } else { text.text.clone() };
    area.draw_text(&letters, &style, at).expect(CANNOT_FAIL);
}

/// The dashes of a line: `pattern` is dash, gap, dash, gap … in pixels; an empty pattern leaves the line whole.
fn dashes(points: &[Place], pattern: &[f64]) -> Vec<Vec<Place>> {
    let Some((&first, rest)) = points.split_first() else { return Vec::new() };
    if pattern.is_empty() {
        return vec![points.to_vec()];
    }
    let (mut pieces, mut piece) = (Vec::new(), vec![first]);
    let (mut turn, mut left, mut from) = (0, pattern[0], first);
    for &to in rest {
        loop {
            let length = distance(from, to);
            if length <= left {
                left -= length;
                from = to;
                piece.push(to);
                break;
            }
            let part = left / length;
            from = (from.0 + part * (to.0 - from.0), from.1 + part * (to.1 - from.1));
            piece.push(from);
            if turn % 2 == 0 {
                pieces.push(std::mem::take(&mut piece));
            }
            piece = vec![from];
            turn += 1;
            left = pattern[turn % pattern.len()];
        }
    }
    if turn % 2 == 0 && piece.len() > 1 {
        pieces.push(piece);
    }
    pieces
}

/// A line of some width as areas: one quadrilateral a segment and a disk at each inner joint.
fn stroke(points: &[Place], width: f64) -> impl Iterator<Item = Vec<Place>> {
    let half = width / 2.0;
    let sides = points.windows(2).filter_map(move |ends| {
        let (from, to) = (ends[0], ends[1]);
        let length = distance(from, to);
        (length > 0.0).then(|| {
            let (nx, ny) = (-(to.1 - from.1) / length * half, (to.0 - from.0) / length * half);
            vec![(from.0 + nx, from.1 + ny), (to.0 + nx, to.1 + ny), (to.0 - nx, to.1 - ny), (from.0 - nx, from.1 - ny)]
        })
    });
    let inner = points.get(1..points.len().saturating_sub(1)).unwrap_or_default();
    sides.chain(inner.iter().map(move |&joint| regular(joint, half, 12, 0.0)))
}

/// A regular polygon about `centre`, its first corner `turn` of a full turn clockwise from the top.
pub(super) fn regular(centre: Place, radius: f64, corners: u32, turn: f64) -> Vec<Place> {
    let corner = |i| {
        let angle = std::f64::consts::TAU * (f64::from(i) / f64::from(corners) + turn);
        (centre.0 + radius * libm::sin(angle), centre.1 - radius * libm::cos(angle))
    };
    (0..corners).map(corner).collect()
}

fn distance(a: Place, b: Place) -> f64 {
    ((b.0 - a.0) * (b.0 - a.0) + (b.1 - a.1) * (b.1 - a.1)).sqrt()
}

/// What plotters leaves out of an SVG: a size in pixels apart from its units, a title, fallback fonts, dashes, and text
/// widths, so that a wider fallback font still fits the room that was measured for it.
fn finished_svg(drawing: &Drawing, body: &str, title: &str) -> String {
    let (width, height) = (drawing.width, drawing.height);
    let family = format!("font-family=\"{FAMILY}\" ");
    let body = body.replace(&family, "").replace("dy=\"0.76em\" ", "").replace(" opacity=\"1\"", "");
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" \
         role=\"img\" font-family=\"{FALLBACKS}\" stroke-linejoin=\"round\">\n<title>{}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#FFFFFF\"/>\n",
        width * SVG_UNITS,
        height * SVG_UNITS,
        escaped(title),
    );
    let texts = drawing.marks.iter().filter(|mark| matches!(mark, Mark::Text(_)));
    let lines = drawing.marks.iter().filter(|mark| matches!(mark, Mark::Line { .. }));
    let mut attributes = [
        ("<text ", texts.map(extra_attribute).collect::<Vec<_>>().into_iter()),
        ("<polyline ", lines.map(extra_attribute).collect::<Vec<_>>().into_iter()),
    ];
    // The first line is plotters' own <svg>. It writes one tag a line and escapes the angle brackets of texts, so a line
    // that starts with a tag is one, and the n-th such tag belongs to the n-th such mark.
    for line in body.lines().skip(1) {
        let tagged =
            attributes.iter_mut().find_map(|(tag, extra)| Some((*tag, line.strip_prefix(*tag)?, extra.next()?)));
        match tagged {
            Some((tag, rest, extra)) => svg.extend([tag, &extra, rest, "\n"]),
            None => svg.extend([line, "\n"]),
        }
    }
    svg
}

/// The attribute that plotters does not write for this mark, with a space after it; may be empty.
fn extra_attribute(mark: &Mark) -> String {
    match mark {
        Mark::Text(text) => {
            let length = (text_width(&text.text, text.size, text.bold) * SVG_UNITS).round();
            format!("textLength=\"{length}\" lengthAdjust=\"spacingAndGlyphs\" ")
        }
        Mark::Line { dash, .. } if *dash != Dash::Solid => {
            let lengths: Vec<String> = dash.pattern().iter().map(|l| (l * SVG_UNITS).round().to_string()).collect();
            format!("stroke-dasharray=\"{}\" ", lengths.join(" "))
        }
        _ => String::new(),
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
impl Drawing {
    /// Fails where a text overlaps another or leaves the page, or a mark is off the page or not finite.
    pub fn assert_legible(&self) {
        let page = Bounds { left: -0.5, top: -0.5, right: self.width + 0.5, bottom: self.height + 0.5 };
        let mut texts: Vec<(&str, Bounds)> = Vec::new();
        for mark in &self.marks {
            match mark {
                Mark::Text(text) => {
                    let bounds = text.bounds();
                    assert!(bounds.inside(&page), "{:?} leaves the page: {bounds:?}", text.text);
                    let other = texts.iter().find(|(_, other)| other.overlaps(&bounds));
                    assert!(other.is_none(), "{:?} {bounds:?} overlaps {other:?}", text.text);
                    texts.push((&text.text, bounds));
                }
                Mark::Line { points, .. } | Mark::Area { points, .. } => {
                    let on_page = |&(x, y): &Place| (0.0..=self.width).contains(&x) && (0.0..=self.height).contains(&y);
                    assert!(points.iter().all(on_page), "{points:?} leaves the page");
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_width_of_a_letter_is_the_font_tables() {
        // Noto Sans Regular, hmtx: H is 1518 of 2048 units wide; the bold one 1567.
        assert!((text_width("H", 2048.0, false) - 1518.0).abs() <= 3.0, "{}", text_width("H", 2048.0, false));
        assert!((text_width("HHHH", 12.0, false) - 48.0 * 1518.0 / 2048.0).abs() < 0.05);
    }

    #[test]
    fn wrapping_keeps_every_word_and_fits() {
        let text = "mean square error against samples per pixel in three scenes";
        let lines = wrapped(text, 12.0, false, 120.0);
        assert_eq!(lines.join(" "), text);
        assert!(lines.len() > 2 && lines.iter().all(|line| text_width(line, 12.0, false) <= 120.0));
        assert!(wrapped("", 12.0, false, 100.0).is_empty());
    }

    #[test]
    fn shortening_leaves_a_fitting_text_alone_and_cuts_a_long_one() {
        assert_eq!(shortened("ld", 12.0, false, 50.0), "ld");
        let cut = shortened("halton:joint:digits@each", 12.0, false, 80.0);
        assert!(cut.ends_with('…') && text_width(&cut, 12.0, false) <= 80.0, "{cut}");
        assert_eq!(shortened("halton", 12.0, false, 0.0), "");
    }

    #[test]
    fn dashes_cover_the_pattern_s_share_of_a_line_around_corners() {
        let points = [(0.0, 0.0), (50.0, 0.0), (50.0, 45.0)];
        let pieces = dashes(&points, &[6.0, 3.5]);
        let length = |piece: &Vec<Place>| piece.windows(2).map(|ends| distance(ends[0], ends[1])).sum::<f64>();
        let covered: f64 = pieces.iter().map(length).sum();
        assert_eq!(pieces.len(), 10);
        assert!((covered - 60.0).abs() < 1e-9, "{covered}");
        assert_eq!(dashes(&points, &[]), vec![points.to_vec()]);
        assert!(dashes(&[], &[1.0, 1.0]).is_empty());
    }

    #[test]
    fn the_svg_names_fallback_fonts_and_escapes_its_texts() {
        let mut drawing = Drawing::new(100.0, 50.0);
        drawing.text((5.0, 20.0), "a < b & \"c\"", 12.0, [0; 3], Align::Left);
        drawing.line(&[(0.0, 0.0), (10.0, 10.0)], 1.5, [0, 114, 178], Dash::Solid);
        let svg = drawing.finish("title < & >").svg;
        assert!(svg.contains("font-family=\"Noto Sans, DejaVu Sans, Arial, sans-serif\""), "{svg}");
        assert!(svg.contains("<title>title &lt; &amp; &gt;</title>"), "{svg}");
        assert!(svg.contains("a &lt; b &amp; &quot;c&quot;"), "{svg}");
        assert!(svg.contains("textLength=") && !svg.contains("dy="), "{svg}");
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"), "{svg}");
        assert_eq!(svg.matches("<svg").count(), 1);
    }

    #[test]
    fn a_filled_square_has_its_colour_in_the_raster_and_nothing_spills() {
        let mut drawing = Drawing::new(40.0, 30.0);
        drawing.rectangle(Bounds { left: 10.0, top: 10.0, right: 20.0, bottom: 20.0 }, [213, 94, 0], 1.0);
        let raster = drawing.finish("").raster;
        assert_eq!((raster.width, raster.height), (60, 45));
        assert_eq!(raster.pixel(22, 22), [213, 94, 0]);
        assert_eq!(raster.pixel(12, 22), [255; 3]);
        assert_eq!(raster.pixel(33, 22), [255; 3]);
    }

    #[test]
    fn dashes_and_widths_are_told_to_the_mark_they_belong_to() {
        let mut drawing = Drawing::new(100.0, 50.0);
        let line = [(0.0, 0.0), (90.0, 10.0)];
        drawing.line(&line, 1.0, [1, 1, 1], Dash::Solid);
        drawing.text((5.0, 20.0), "<polyline points", 12.0, [0; 3], Align::Left);
        drawing.line(&line, 1.0, [2, 2, 2], Dash::Dotted);
        let svg = drawing.finish("").svg;
        let dashed: Vec<&str> = svg.lines().filter(|line| line.contains("dasharray")).collect();
        assert_eq!(dashed.len(), 1, "{svg}");
        assert!(dashed[0].contains("#020202") && dashed[0].contains("\"18 26\""), "{svg}");
    }

    #[test]
    fn annotating_a_raster_keeps_the_pixels_beside_the_letters() {
        let mut raster = Rgb8::filled(60, 40, [10, 20, 30]);
        raster.set(3, 4, [200, 0, 7]);
        let mut drawing = Drawing::new(0.0, 0.0);
        drawing.text((10.0, 30.0), "ld", 12.0, [255; 3], Align::Left);
        let before = raster.clone();
        raster.annotate(&drawing.marks, 1.0);
        assert_ne!(raster, before);
        assert_eq!(raster.bytes[..3 * 60 * 15], before.bytes[..3 * 60 * 15]);
    }

    #[test]
    fn letters_stand_inside_their_bounds_upright_and_turned() {
        for turned in [false, true] {
            let mut drawing = Drawing::new(120.0, 120.0);
            let text = Text {
                at: (60.0, 60.0),
                text: "Happy gl|".to_owned(),
                size: 14.0,
                bold: false,
                colour: [0; 3],
                align: Align::Centre,
                turned,
            };
            let bounds = text.bounds();
            drawing.add_text(text);
            let raster = drawing.finish("").raster;
            let (mut inked, mut outside) = (0, 0);
            for (x, y) in (0..raster.width).flat_map(|x| (0..raster.height).map(move |y| (x, y))) {
                let (px, py) = (f64::from(x) / 1.5, f64::from(y) / 1.5);
                let near = px > bounds.left - 1.5
                    && px < bounds.right + 1.0
                    && py > bounds.top - 1.5
                    && py < bounds.bottom + 1.0;
                if raster.pixel(x, y) != [255; 3] {
                    inked += 1;
                    outside += u32::from(!near);
                }
            }
            assert!(inked > 120 && outside == 0, "turned {turned}: {inked} inked, {outside} outside {bounds:?}");
        }
    }
}
