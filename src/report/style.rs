//! One look for every sampler in every figure: colour and shape by family, dash and filling by preset.
//!
//! Colours are Okabe and Ito's, told apart by the colour-blind (<https://jfly.uni-koeln.de/color/>); a shape beside
//! each makes a figure readable in grey.

use crate::sampling::{Decision, Order, Points, SamplerSet};

use super::figure::{Colour, Dash, Drawing, Place, regular};

/// Ink of text and axes.
pub(super) const INK: Colour = [34, 34, 34];
/// Ink of what is said second: subtitles, tick labels, guides.
pub(super) const GREY: Colour = [102, 102, 102];
/// Ink of thin helpers: axes' ticks and leader lines.
pub(super) const PALE: Colour = [170, 170, 170];
/// Ink of grid lines.
pub(super) const GRID: Colour = [230, 230, 230];
const WHITE: Colour = [255; 3];

/// The shape that stands for a sampler's family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// Disk.
    Circle,
    /// Square on its side.
    Square,
    /// Triangle that points up.
    TriangleUp,
    /// Triangle that points down.
    TriangleDown,
    /// Square on its corner.
    Diamond,
    /// Regular pentagon.
    Pentagon,
    /// Five-pointed star.
    Star,
    /// Plus sign.
    Plus,
}

/// How a series looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    /// Colour of line, band and marker.
    pub colour: Colour,
    /// Shape of the marker.
    pub marker: Marker,
    /// Whether the marker is filled.
    pub filled: bool,
    /// How the line is broken.
    pub dash: Dash,
}

/// The look of the sampler `name`, the same in every figure: colour and shape belong to the points before the first
/// colon; `:best` (and a bare name) is solid and filled, `:sheet` dashed and hollow, `:plain` dotted and hollow, any
/// other description dash-dotted and filled. Names of no known point set share purple and a shape that hashes the name.
pub fn style_of(name: &str) -> Style {
    let (family, preset) = name.split_once(':').unwrap_or((name, ""));
    let (colour, marker) = match family {
        "uniform" => ([0, 0, 0], Marker::Circle),
        "stratified" => ([230, 159, 0], Marker::Square),
        "halton" => ([86, 180, 233], Marker::TriangleUp),
        "hammersley" => ([0, 158, 115], Marker::TriangleDown),
        "ld" => ([213, 94, 0], Marker::Diamond),
        "sobol" => ([0, 114, 178], Marker::Pentagon),
        "center" => ([120, 120, 120], Marker::Plus),
        _ => ([204, 121, 167], other_marker(family)),
    };
    let (dash, filled) = match preset {
        "best" | "" => (Dash::Solid, true),
        "sheet" => (Dash::Dashed, false),
        "plain" => (Dash::Dotted, false),
        _ => (Dash::DashDot, true),
    };
    // A description in full is a variant beside the presets: the same shape, the colour mixed with black.
    let colour = if dash == Dash::DashDot { colour.map(|c: u8| (f64::from(c) * 0.55) as u8) } else { colour };
    Style { colour, marker, filled, dash }
}

/// The colour of a decision, wherever one is singled out: Tol's muted scheme (<https://sronpersonalpages.nl/~pault/>), also
/// told apart by the colour-blind, and none of the families' colours.
pub fn decision_colour(decision: Decision) -> Colour {
    match decision {
        Decision::Pixel => [51, 34, 136],
        Decision::Lens => [68, 170, 153],
        Decision::LightPick => [153, 153, 51],
        Decision::LightPoint => [136, 34, 85],
    }
}

/// The look of a set of different samplers: the shape is that of the sampler which most decisions read, hollow where that
/// one walks in step; the colour is that of the one decision which reads another, purple where several do.
pub fn style_of_set(set: &SamplerSet) -> Style {
    let (most, odd) = set.majority();
    let Style { marker, .. } = style_of(most.points.word());
    let colour = if let [one] = odd[..] { decision_colour(one) } else { [204, 121, 167] };
    Style { colour, marker, filled: most.points == Points::Uniform || most.order != Order::Step, dash: Dash::DashDot }
}

/// FNV-1a of the name picks a shape: stable from run to run, which a counter of names seen would not be.
fn other_marker(name: &str) -> Marker {
    let hash = name.bytes().fold(0x811c_9dc5_u32, |h, byte| (h ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    [Marker::Star, Marker::Plus, Marker::Circle, Marker::Square][hash as usize % 4]
}

/// `colour` moved towards white; `share` 0 leaves it, 1 is white.
pub(super) fn lightened(colour: Colour, share: f64) -> Colour {
    colour.map(|c| (f64::from(c) + share * (255.0 - f64::from(c))).round() as u8)
}

/// Draws the style's marker; `radius` is that of the disk, other shapes are scaled to look as large.
pub(super) fn draw_marker(drawing: &mut Drawing, at: Place, radius: f64, style: &Style) {
    // A white rim sets a marker off from the lines below it.
    drawing.area(&outline(at, radius + 1.9, style.marker), WHITE, 1.0);
    drawing.area(&outline(at, radius + 0.7, style.marker), style.colour, 1.0);
    if !style.filled {
        drawing.area(&outline(at, radius - 0.9, style.marker), WHITE, 1.0);
    }
}

fn outline(at: Place, radius: f64, marker: Marker) -> Vec<Place> {
    match marker {
        Marker::Circle => regular(at, radius, 16, 0.0),
        Marker::Square => regular(at, 1.25 * radius, 4, 0.125),
        Marker::TriangleUp => regular((at.0, at.1 + 0.2 * radius), 1.35 * radius, 3, 0.0),
        Marker::TriangleDown => regular((at.0, at.1 - 0.2 * radius), 1.35 * radius, 3, 0.5),
        Marker::Diamond => regular(at, 1.3 * radius, 4, 0.0),
        Marker::Pentagon => regular(at, 1.15 * radius, 5, 0.0),
        Marker::Star => {
            let (points, notches) = (regular(at, 1.45 * radius, 5, 0.0), regular(at, 0.65 * radius, 5, 0.1));
            points.into_iter().zip(notches).flat_map(|(point, notch)| [point, notch]).collect()
        }
        Marker::Plus => {
            let (long, short) = (1.25 * radius, 0.42 * radius);
            let quarter = [(short, -long), (short, -short), (long, -short)];
            let turned = |(x, y): Place, turns: usize| (0..turns).fold((x, y), |(x, y), _| (-y, x));
            (0..4).flat_map(|turns| quarter.map(|p| turned(p, turns))).map(|(x, y)| (at.0 + x, at.1 + y)).collect()
        }
    }
}

/// A piece of the series' line with its marker, `width` pixels from `left`: what a legend shows before a name.
pub(super) fn draw_key(drawing: &mut Drawing, left: f64, y: f64, width: f64, style: &Style) {
    drawing.line(&[(left, y), (left + width, y)], 1.8, style.colour, style.dash);
    draw_marker(drawing, (left + width / 2.0, y), 3.4, style);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sheets_samplers_differ_in_colour_and_in_shape() {
        let names = ["uniform", "stratified", "halton", "hammersley", "ld", "sobol", "center"];
        for (i, a) in names.iter().enumerate() {
            for b in &names[i + 1..] {
                assert_ne!(style_of(a).colour, style_of(b).colour, "{a} {b}");
                assert_ne!(style_of(a).marker, style_of(b).marker, "{a} {b}");
            }
        }
    }

    #[test]
    fn presets_share_the_family_s_colour_and_differ_in_dash_and_a_description_in_full_is_darker() {
        let [sheet, best, plain, long] =
            ["halton:sheet", "halton:best", "halton:plain", "halton:joint:digits@each"].map(style_of);
        assert!([best, plain].iter().all(|s| s.colour == sheet.colour && s.marker == sheet.marker));
        assert_eq!(long.marker, sheet.marker);
        assert!((0..3).all(|c| long.colour[c] < sheet.colour[c]));
        assert_eq!((sheet.dash, sheet.filled), (Dash::Dashed, false));
        assert_eq!((best.dash, best.filled), (Dash::Solid, true));
        assert_eq!((plain.dash, long.dash), (Dash::Dotted, Dash::DashDot));
        assert_eq!(style_of("my points"), style_of("my points"));
    }

    #[test]
    fn a_set_looks_like_what_most_decisions_read_in_the_colour_of_the_odd_one() {
        let set = |text: &str| SamplerSet::parse(text, crate::sampling::Preset::Best).unwrap();
        let lens = style_of_set(&set("pixel=ld:sheet lens=ld light-pick=ld:sheet light=ld:sheet"));
        assert_eq!((lens.marker, lens.filled, lens.colour), (Marker::Diamond, false, decision_colour(Decision::Lens)));
        let light = style_of_set(&set("pixel=uniform lens=uniform light-pick=uniform light=ld"));
        assert_eq!((light.marker, light.filled), (Marker::Circle, true));
        let two = style_of_set(&set("pixel=uniform lens=uniform light-pick=ld light=ld"));
        assert!(Decision::ALL.iter().all(|&d| decision_colour(d) != two.colour && decision_colour(d) != [0; 3]));
        assert_eq!(Decision::ALL.map(decision_colour).iter().collect::<std::collections::BTreeSet<_>>().len(), 4);
    }

    #[test]
    fn every_outline_has_an_area_about_its_place() {
        use Marker::*;
        for marker in [Circle, Square, TriangleUp, TriangleDown, Diamond, Pentagon, Star, Plus] {
            let points = outline((10.0, 20.0), 4.0, marker);
            let next = points.iter().cycle().skip(1);
            let doubled: f64 = points.iter().zip(next).map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum();
            assert!((30.0..75.0).contains(&(doubled / 2.0).abs()), "{marker:?}: {}", doubled / 2.0);
            assert!(points.iter().all(|p| (p.0 - 10.0).abs() < 6.0 && (p.1 - 20.0).abs() < 7.0));
        }
    }
}
