//! Pictures in pixels: point sets as the sheet draws them, strips of images with zoomed crops, signed error maps.

use crate::error::{Error, Result};
use crate::film::Image;

use super::axis::number_label;
use super::figure::{Align, Colour, Drawing, Mark, PAGE_WIDTH, Rgb8, Text, shortened, wrapped};
use super::frame::SMALL;
use super::style::{GREY, INK, lightened};

/// Edge of the sheet's Figure 2, in pixels.
pub const SHEET_PANEL: u32 = 512;
/// Edge of a dot in the sheet's Figure 2, in pixels.
pub const SHEET_DOT: u32 = 5;

const WHITE: Colour = [255; 3];

/// The sheet's Figure 2: `points` of the unit square as square dots on black, `size` pixels wide and high, origin at
/// the bottom left, dots `dot` pixels wide (odd) and clipped at the border.
///
/// Point i of n has the colour (t, 1 − t, 1 − t), t = i/(n − 1) (0 where n = 1): cyan first, red last; later dots cover
/// earlier ones. A dot's middle is the pixel (⌊size·x⌋, size − 1 − ⌊size·y⌋). Points that are not finite are left out.
pub fn point_set_panel(points: &[(f64, f64)], size: u32, dot: u32) -> Rgb8 {
    let mut panel = Rgb8::filled(size, size, [0; 3]);
    let reach = i64::from(dot / 2);
    for (i, &(x, y)) in points.iter().enumerate().filter(|(_, (x, y))| x.is_finite() && y.is_finite()) {
        let t = i as f64 / (points.len().max(2) - 1) as f64;
        let [up, down] = [t, 1.0 - t].map(|share| (255.0 * share).round() as u8);
        // Far outside points saturate here and are clipped below.
        let cell = |u: f64| (u * f64::from(size)).floor().clamp(-1e9, 1e9) as i64;
        let (column, row) = (cell(x), i64::from(size) - 1 - cell(y));
        for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
            panel.set(column + dx, row + dy, [up, down, down]);
        }
    }
    panel
}

/// A point set and the name to print above it.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedPoints {
    /// Printed above the panel.
    pub name: String,
    /// Points in the unit square, in their order.
    pub points: Vec<(f64, f64)>,
}

/// Point sets side by side, `columns` in a row, each under its name; 1720 pixels wide, for a page of 860.
pub fn point_set_contact_sheet(sets: &[NamedPoints], columns: usize) -> Rgb8 {
    let columns = columns.clamp(1, sets.len().max(1));
    let panel = ((PAGE_WIDTH - GAP * (columns - 1) as f64) * 2.0 / columns as f64) as u32;
    // Dots keep the share of the panel that the sheet gives them, to the nearest odd number of pixels.
    let dot = (2 * (panel * SHEET_DOT / SHEET_PANEL / 2) + 1).clamp(3, SHEET_DOT);
    let panels: Vec<Rgb8> = sets.iter().map(|set| point_set_panel(&set.points, panel, dot)).collect();
    let cells: Vec<StripCell> = sets.iter().zip(&panels).map(|(set, image)| StripCell::new(image, &set.name)).collect();
    Grid::new(&cells, &StripLayout { columns, whole: Some(1), crops: Vec::new(), scale_bar: None }).drawn(&cells)
}

/// One image of a strip and what stands around it.
#[derive(Debug, Clone, PartialEq)]
pub struct StripCell<'a> {
    /// The image itself.
    pub image: &'a Rgb8,
    /// Above it, bold: the sampler.
    pub title: String,
    /// Below it, a line each: `RMSE 0.0123 ± 0.0004`.
    pub captions: Vec<String>,
    /// Below each of its enlargements, a few letters: `0.0123`.
    pub crop_captions: Vec<String>,
}

impl<'a> StripCell<'a> {
    /// An image with its title alone.
    pub fn new(image: &'a Rgb8, title: &str) -> Self {
        Self { image, title: title.to_owned(), captions: Vec::new(), crop_captions: Vec::new() }
    }
}

/// A rectangle of the image shown enlarged below it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crop {
    /// First column.
    pub x: u32,
    /// First row, from the top.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels of the strip for one of the image, across and down.
    pub zoom: u32,
    /// Outline, around the rectangle in the image and around its enlargement.
    pub colour: Colour,
}

/// How a strip is laid out.
#[derive(Debug, Clone, PartialEq)]
pub struct StripLayout {
    /// Images in a row.
    pub columns: usize,
    /// Pixels of the strip for one of the image; `None`: only the crops are shown.
    pub whole: Option<u32>,
    /// Enlargements, left to right below each image.
    pub crops: Vec<Crop>,
    /// For strips of error maps: what their colours mean.
    pub scale_bar: Option<ScaleBar>,
}

/// The colour scale of an error map, printed below a strip.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaleBar {
    /// Error at the ends of the scale.
    pub scale: f64,
    /// Quantity and unit: `luminance − reference`.
    pub label: String,
}

/// Page pixels between neighbours.
const GAP: f64 = 10.0;
const TITLE_STEP: f64 = 20.0;
const CAPTION_STEP: f64 = 16.0;

/// Images side by side with titles, captions and enlarged crops (nearest neighbour: every pixel stays a square).
/// Letters are sized to read well when the strip is shown 860 pixels wide.
///
/// # Errors
/// Kind `Input` where a crop is empty, has zoom 0 or reaches out of an image, or where the strip would be wider or higher
/// than 16384 pixels.
pub fn strip(cells: &[StripCell], layout: &StripLayout) -> Result<Rgb8> {
    for (cell, crop) in cells.iter().flat_map(|cell| layout.crops.iter().map(move |crop| (cell, crop))) {
        let (width, height) = (cell.image.width, cell.image.height);
        let fits =
            |from: u32, length: u32, edge: u32| length > 0 && from.checked_add(length).is_some_and(|end| end <= edge);
        if !fits(crop.x, crop.width, width) || !fits(crop.y, crop.height, height) || crop.zoom == 0 {
            let Crop { x, y, width: w, height: h, zoom, .. } = crop;
            let what =
                format!("expected a crop inside {width}×{height} pixels, found {w}×{h} at ({x}, {y}), zoom {zoom}");
            return Err(Error::input(format!("strip, image {}", cell.title), what));
        }
    }
    check_size(cells, layout)?;
    Ok(Grid::new(cells, layout).drawn(cells))
}

/// White around a strip, in pixels of the page.
const MARGIN: f64 = 10.0;

/// Longest edge of a strip, in pixels: 3.2 GB at worst while letters are painted, and far more than any page shows.
const LONGEST: u64 = 16_384;

/// Whether the zoomed images and crops of all cells stay below the longest edge, counted generously.
fn check_size(cells: &[StripCell], layout: &StripLayout) -> Result<()> {
    let zoom = u64::from(layout.whole.unwrap_or(0));
    let edges = |cell: &StripCell| u64::from(cell.image.width.max(cell.image.height)).saturating_mul(zoom);
    let whole = cells.iter().map(edges).max().unwrap_or(0);
    let edge = |crop: &Crop| u64::from(crop.width.max(crop.height)).saturating_mul(crop.zoom.into()).saturating_add(4);
    let crops = layout.crops.iter().map(edge).fold(0, u64::saturating_add);
    let across = layout.columns.clamp(1, cells.len().max(1));
    let cells = across.max(cells.len().div_ceil(across)) as u64;
    let longest = whole.saturating_add(crops).saturating_mul(cells);
    if longest > LONGEST {
        let what =
            format!("expected images and crops of at most {LONGEST} pixels in all, found {longest}; lower the zoom");
        return Err(Error::input("strip", what));
    }
    Ok(())
}

/// Sizes of a strip in pixels: every cell is as large as the largest.
struct Grid<'a> {
    layout: &'a StripLayout,
    columns: u32,
    whole: (u32, u32),
    crops: (u32, u32),
    /// Strip pixels for one pixel of the page.
    scale: f64,
    captions: Vec<Vec<String>>,
    /// Whether a line below the enlargements says something of each.
    has_crop_captions: bool,
}

impl<'a> Grid<'a> {
    fn new(cells: &[StripCell], layout: &'a StripLayout) -> Self {
        let columns = layout.columns.clamp(1, cells.len().max(1)) as u32;
        let zoom = layout.whole.unwrap_or(0);
        let largest = |size: fn(&Rgb8) -> u32| zoom * cells.iter().map(|cell| size(cell.image)).max().unwrap_or(0);
        let whole = (largest(|image| image.width), largest(|image| image.height));
        let gaps = 4 * layout.crops.len().saturating_sub(1) as u32;
        let crops = (
            layout.crops.iter().map(|crop| crop.width * crop.zoom).sum::<u32>() + gaps,
            layout.crops.iter().map(|crop| crop.height * crop.zoom).max().unwrap_or(0),
        );
        let width = whole.0.max(crops.0).max(1);
        let scale = (f64::from(columns * width) / (PAGE_WIDTH - GAP * f64::from(columns - 1))).max(1.0);
        let captions = cells
            .iter()
            .map(|cell| {
                cell.captions.iter().flat_map(|line| wrapped(line, SMALL, false, f64::from(width) / scale)).collect()
            })
            .collect();
        let has_crop_captions = cells.iter().any(|cell| !cell.crop_captions.is_empty());
        Self { layout, columns, whole, crops, scale, captions, has_crop_captions }
    }

    /// Page pixels → strip pixels.
    fn pixels(&self, page: f64) -> u32 {
        (page * self.scale).round() as u32
    }

    fn cell_width(&self) -> u32 {
        self.whole.0.max(self.crops.0).max(1)
    }

    /// Rows between image and crops, where there are both.
    fn crop_gap(&self) -> u32 {
        if self.whole.1 > 0 && self.crops.1 > 0 { self.pixels(6.0) } else { 0 }
    }

    fn image_height(&self) -> u32 {
        self.whole.1 + self.crop_gap() + self.crops.1 + self.pixels(self.crop_caption_height())
    }

    /// Height of the line below the enlargements, in page pixels.
    fn crop_caption_height(&self) -> f64 {
        if self.has_crop_captions { CAPTION_STEP } else { 0.0 }
    }

    fn cell_height(&self) -> u32 {
        let lines = self.captions.iter().map(Vec::len).max().unwrap_or(0) as f64;
        self.pixels(TITLE_STEP) + self.image_height() + self.pixels(lines * CAPTION_STEP + 12.0)
    }

    fn drawn(&self, cells: &[StripCell]) -> Rgb8 {
        let rows = (cells.len() as u32).div_ceil(self.columns);
        let (gap, margin) = (self.pixels(GAP), self.pixels(MARGIN));
        let foot = if self.layout.scale_bar.is_some() { self.pixels(46.0) } else { 0 };
        let width = self.columns * self.cell_width() + (self.columns - 1) * gap + 2 * margin;
        let mut raster = Rgb8::filled(width, rows * self.cell_height() + foot + 2 * margin, WHITE);
        let mut texts = Drawing::new(0.0, 0.0);
        for (i, cell) in cells.iter().enumerate() {
            let left = margin + i as u32 % self.columns * (self.cell_width() + gap);
            let top = margin + i as u32 / self.columns * self.cell_height();
            self.draw_images(&mut raster, cell, left, top + self.pixels(TITLE_STEP));
            self.write_texts(&mut texts, cell, &self.captions[i], (left, top));
        }
        if let Some(bar) = &self.layout.scale_bar {
            self.draw_bar(&mut raster, &mut texts, bar, margin + rows * self.cell_height());
        }
        raster.annotate(&texts.marks, self.scale);
        raster
    }

    fn draw_images(&self, raster: &mut Rgb8, cell: &StripCell, left: u32, top: u32) {
        let line = self.pixels(1.5).max(1);
        if let Some(zoom) = self.layout.whole.filter(|&zoom| zoom > 0) {
            let all = (0, 0, cell.image.width, cell.image.height);
            blit(raster, cell.image, all, zoom, (left, top));
            for crop in &self.layout.crops {
                let corner = (left + crop.x * zoom, top + crop.y * zoom);
                outline(raster, corner, (crop.width * zoom, crop.height * zoom), line, crop.colour);
            }
        }
        let (mut x, y) = (left, top + self.whole.1 + self.crop_gap());
        for crop in &self.layout.crops {
            blit(raster, cell.image, (crop.x, crop.y, crop.width, crop.height), crop.zoom, (x, y));
            let size = (crop.width * crop.zoom, crop.height * crop.zoom);
            // Inside its own edge, so that neighbours do not touch.
            let inner = (size.0.saturating_sub(2 * line), size.1.saturating_sub(2 * line));
            outline(raster, (x + line, y + line), inner, line, crop.colour);
            x += size.0 + 4;
        }
    }

    fn write_texts(&self, texts: &mut Drawing, cell: &StripCell, captions: &[String], (left, top): (u32, u32)) {
        let (x, y) = (f64::from(left) / self.scale, f64::from(top) / self.scale);
        let width = f64::from(self.cell_width()) / self.scale;
        texts.add_text(Text {
            at: (x, y + 14.0),
            text: shortened(&cell.title, 12.5, true, width),
            size: 12.5,
            bold: true,
            colour: INK,
            align: Align::Left,
            turned: false,
        });
        let mut across = 0.0;
        let under = y + TITLE_STEP + f64::from(self.image_height()) / self.scale - self.crop_caption_height() + 13.0;
        for (crop, text) in self.layout.crops.iter().zip(&cell.crop_captions) {
            let width = f64::from(crop.width * crop.zoom) / self.scale;
            let text = shortened(text, SMALL, false, width);
            texts.text((x + across + width / 2.0, under), &text, SMALL, GREY, Align::Centre);
            across += width + 4.0 / self.scale;
        }
        let below = y + TITLE_STEP + f64::from(self.image_height()) / self.scale + 15.0;
        for (i, caption) in captions.iter().enumerate() {
            texts.text((x, below + i as f64 * CAPTION_STEP), caption, SMALL, INK, Align::Left);
        }
    }

    /// The diverging scale in the middle of the foot, its ends and middle labelled.
    fn draw_bar(&self, raster: &mut Rgb8, texts: &mut Drawing, bar: &ScaleBar, top: u32) {
        let page = f64::from(raster.width) / self.scale;
        let width = page.min(320.0) - 60.0;
        let left = (page - width) / 2.0;
        let (from, to) = (self.pixels(left), self.pixels(left + width));
        for x in from..to {
            let share = f64::from(x - from) / f64::from((to - from).max(2) - 1);
            for y in top + self.pixels(2.0)..top + self.pixels(14.0) {
                raster.set(x.into(), y.into(), diverging(2.0 * share - 1.0));
            }
        }
        let y = f64::from(top) / self.scale;
        let end = number_label(bar.scale);
        for (share, label) in [(0.0, format!("−{end}")), (0.5, "0".to_owned()), (1.0, format!("+{end}"))] {
            texts.text((left + share * width, y + 27.0), &label, 11.0, GREY, Align::Centre);
        }
        let label = shortened(&bar.label, SMALL, false, page);
        texts.marks.push(Mark::Text(Text {
            at: (page / 2.0, y + 42.0),
            text: label,
            size: SMALL,
            bold: false,
            colour: INK,
            align: Align::Centre,
            turned: false,
        }));
    }
}

/// Copies the rectangle (first column, first row, columns, rows) of `image`, each pixel as a square of `zoom`².
fn blit(raster: &mut Rgb8, image: &Rgb8, (x0, y0, width, height): (u32, u32, u32, u32), zoom: u32, at: (u32, u32)) {
    for y in 0..height * zoom {
        for x in 0..width * zoom {
            let colour = image.pixel(x0 + x / zoom, y0 + y / zoom);
            raster.set((at.0 + x).into(), (at.1 + y).into(), colour);
        }
    }
}

/// A frame of `line` pixels just outside the rectangle.
fn outline(raster: &mut Rgb8, corner: (u32, u32), size: (u32, u32), line: u32, colour: Colour) {
    let (left, top, line) = (i64::from(corner.0), i64::from(corner.1), i64::from(line));
    let (right, bottom) = (left + i64::from(size.0), top + i64::from(size.1));
    for y in top - line..bottom + line {
        for x in left - line..right + line {
            if !((left..right).contains(&x) && (top..bottom).contains(&y)) {
                raster.set(x, y, colour);
            }
        }
    }
}

/// Rec. 709 luminance of a linear colour, in f64.
fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

/// Luminance of `test` − `reference` at every pixel.
fn signed_errors(test: &Image, reference: &Image) -> Result<Vec<f64>> {
    if (test.width, test.height) != (reference.width, reference.height) {
        let (w, h) = (reference.width, reference.height);
        let what = format!("expected the reference's {w}×{h} pixels, found {}×{}", test.width, test.height);
        return Err(Error::input("error map", what));
    }
    let errors: Vec<f64> =
        test.pixels.iter().zip(&reference.pixels).map(|(&t, &r)| luminance(t) - luminance(r)).collect();
    match errors.iter().position(|error| !error.is_finite()) {
        Some(at) => {
            let (x, y) = (at % test.width as usize, at / test.width as usize);
            Err(Error::input("error map", format!("expected finite radiance, found none at pixel ({x}, {y})")))
        }
        None => Ok(errors),
    }
}

/// Signed error in luminance (Rec. 709, linear): white where `test` equals `reference`, red where it is brighter, blue
/// where darker, full colour at ±`scale` (above 0) and beyond.
///
/// # Errors
/// Kind `Input` where the sizes differ, a pixel is not finite, or `scale` is not above 0.
pub fn error_map(test: &Image, reference: &Image, scale: f64) -> Result<Rgb8> {
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(Error::input("error map", format!("expected a scale above 0, found {scale}")));
    }
    let bytes = signed_errors(test, reference)?.into_iter().flat_map(|error| diverging(error / scale)).collect();
    Ok(Rgb8 { width: test.width, height: test.height, bytes })
}

/// A scale for error maps that are shown together: the least of 1, 2 or 5 times a power of ten that holds 99 % of all
/// absolute errors in luminance, so that a few fireflies do not turn the maps white; 1 where all errors are 0.
///
/// # Errors
/// Kind `Input` where sizes differ or a pixel is not finite.
pub fn error_scale<'a>(tests: impl IntoIterator<Item = &'a Image>, reference: &Image) -> Result<f64> {
    let mut errors = Vec::new();
    for test in tests {
        errors.extend(signed_errors(test, reference)?.into_iter().map(f64::abs));
    }
    errors.sort_by(f64::total_cmp);
    let rank = (errors.len() * 99).div_ceil(100).max(1) - 1;
    match errors.get(rank) {
        Some(&held) if held > 0.0 => Ok(rounded_up(held)),
        _ => Ok(1.0),
    }
}

/// The least of 1, 2, 5 times a power of ten that is at least `value`, which is above 0.
fn rounded_up(value: f64) -> f64 {
    let exponent = libm::floor(libm::log10(value)) as i32;
    let decimal = |mantissa: u32, e: i32| {
        let power = libm::pow(10.0, f64::from(e.abs()));
        if e < 0 { f64::from(mantissa) / power } else { f64::from(mantissa) * power }
    };
    let steps = [decimal(1, exponent), decimal(2, exponent), decimal(5, exponent), decimal(1, exponent + 1)];
    steps.into_iter().find(|&step| step >= value).unwrap_or(value)
}

/// Blue at −1, white at 0, red at 1 and linear between in sRGB; ends of ColorBrewer's RdBu, safe for the colour-blind.
pub(super) fn diverging(t: f64) -> Colour {
    let end = if t < 0.0 { [33, 102, 172] } else { [178, 24, 43] };
    lightened(end, 1.0 - t.abs().min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_point_is_cyan_the_last_red_and_the_origin_is_at_the_bottom_left() {
        let panel = point_set_panel(&[(0.0, 0.0), (0.5, 0.25), (0.999_999, 0.999_999)], SHEET_PANEL, SHEET_DOT);
        assert_eq!((panel.width, panel.height), (512, 512));
        assert_eq!(panel.pixel(0, 511), [0, 255, 255]);
        assert_eq!(panel.pixel(256, 511 - 128), [128, 128, 128]);
        assert_eq!(panel.pixel(511, 0), [255, 0, 0]);
        let coloured = panel.bytes.chunks(3).filter(|c| *c != [0; 3]).count();
        assert_eq!(coloured, 25 + 2 * 9, "a whole dot inside, two clipped ones in the corners");
    }

    #[test]
    fn a_lone_point_is_cyan_and_strange_points_harm_nothing() {
        assert_eq!(point_set_panel(&[(0.5, 0.5)], 512, 5).pixel(256, 255), [0, 255, 255]);
        let strange = [(f64::NAN, 0.5), (1e300, 0.0), (-7.0, f64::INFINITY), (1.0, 1.0)];
        let panel = point_set_panel(&strange, 64, 5);
        let coloured = panel.bytes.chunks(3).filter(|c| *c != [0; 3]).count();
        assert_eq!(coloured, 4, "of the dot at (1, 1) a corner of 2×2 pixels is inside");
        assert!(point_set_panel(&[], 8, 5).bytes.iter().all(|&byte| byte == 0));
    }

    #[test]
    fn crops_are_copied_pixel_by_pixel_and_outlined() {
        let mut image = Rgb8::filled(8, 6, [10, 20, 30]);
        image.set(3, 2, [200, 100, 50]);
        let crop = Crop { x: 2, y: 1, width: 4, height: 4, zoom: 10, colour: [255, 0, 0] };
        let layout = StripLayout { columns: 1, whole: Some(4), crops: vec![crop], scale_bar: None };
        let cell = StripCell {
            image: &image,
            title: "ld:best".into(),
            captions: vec!["RMSE 0.01".into()],
            ..StripCell::new(&image, "")
        };
        let strip = strip(&[cell], &layout).unwrap();
        let (left, top) = (MARGIN as u32, (MARGIN + TITLE_STEP) as u32);
        assert_eq!(strip.width, 40 + 2 * left);
        assert_eq!(strip.pixel(left, top), [10, 20, 30]);
        assert_eq!(strip.pixel(left + 13, top + 9), [200, 100, 50]);
        assert_eq!(strip.pixel(left + 8, top + 3), [255, 0, 0], "outline above the crop");
        let below = top + 24 + 6;
        assert_eq!(strip.pixel(left + 15, below + 15), [200, 100, 50]);
        assert_eq!(strip.pixel(left, below), [255, 0, 0]);
    }

    #[test]
    fn a_crop_outside_its_image_or_too_large_is_an_input_error() {
        let image = Rgb8::filled(8, 6, WHITE);
        let cell = StripCell::new(&image, "ld");
        for (x, width, zoom) in [(6, 4, 2), (u32::MAX, 2, 2), (0, 0, 2), (0, 2, 0), (0, 2, u32::MAX)] {
            let crop = Crop { x, y: 0, width, height: 2, zoom, colour: [0; 3] };
            let layout = StripLayout { columns: 1, whole: None, crops: vec![crop], scale_bar: None };
            assert_eq!(strip(std::slice::from_ref(&cell), &layout).unwrap_err().exit_code(), 2);
        }
    }

    #[test]
    fn the_error_map_is_white_at_zero_and_saturates_symmetrically() {
        let reference = Image { width: 5, height: 1, pixels: vec![[1.0; 3]; 5] };
        let levels = [1.0, 2.0, 0.0, 9.0, 1.5];
        let test = Image { width: 5, height: 1, pixels: levels.map(|v| [v; 3]).to_vec() };
        let map = error_map(&test, &reference, 1.0).unwrap();
        let colours: Vec<Colour> = (0..5).map(|x| map.pixel(x, 0)).collect();
        assert_eq!(colours, [WHITE, [178, 24, 43], [33, 102, 172], [178, 24, 43], [217, 140, 149]]);
    }

    #[test]
    fn error_maps_refuse_unequal_sizes_and_what_is_not_finite() {
        let black = Image::black(2, 2);
        let mut broken = black.clone();
        broken.pixels[3][1] = f32::NAN;
        assert!(error_map(&Image::black(2, 3), &black, 1.0).is_err());
        assert!(error_map(&broken, &black, 1.0).unwrap_err().what.contains("(1, 1)"));
        assert!(error_map(&black, &black, 0.0).is_err());
        assert_eq!(error_scale([&black], &black), Ok(1.0));
    }

    #[test]
    fn the_error_scale_holds_99_of_100_errors() {
        let reference = Image::black(10, 10);
        let mut test = reference.clone();
        test.pixels.iter_mut().for_each(|p| *p = [0.013; 3]);
        test.pixels[7] = [1000.0; 3];
        assert_eq!(error_scale([&test], &reference), Ok(0.02));
        assert_eq!([0.01, 0.011, 3.0, 5.1, 100.0].map(rounded_up), [0.01, 0.02, 5.0, 10.0, 100.0]);
    }

    #[test]
    fn a_contact_sheet_is_as_wide_as_two_pages_and_an_empty_one_is_no_panic() {
        let set = |name: &str| NamedPoints { name: name.into(), points: vec![(0.5, 0.5)] };
        let sheet = point_set_contact_sheet(&["uniform", "halton", "ld"].map(set), 3);
        assert!((1700..=1760).contains(&sheet.width), "{}", sheet.width);
        assert!(point_set_contact_sheet(&[], 5).height >= 1);
        assert_eq!(sheet, point_set_contact_sheet(&["uniform", "halton", "ld"].map(set), 3));
    }
}
