//! What the flip viewer of a scene shows, as the page holds it: pictures, FLIP maps, windows, and the words about them.
//!
//! Everything that is a number of the lab is made here, by the library: errors and intervals, FLIP, the curve from radiance to
//! the screen (as its thresholds). The page only shows.

use std::path::Path;

use crate::error::Result;
use crate::film::{Image, screen_light, tone_map};
use crate::stats::flip::{DEFAULT_PPD, Seen};

use super::super::details::{Detail, Truth};
use super::super::numbers::short;
use super::super::pictured::{found_details, load, truth};
use super::super::pictures::error_scale;
use super::super::shots::{PictureSet, Shot, equal_time};
use super::super::summarise::Summary;
use super::super::tiles::{Window, mse, rmse_words};
use super::html::escaped;
use super::packed::{Halves, packed_shares};

/// Most letters that pictures take in a page. Figures and text take 2 to 3 millions more; 12 MB is the most that a page may be.
pub const MOST_LETTERS: usize = 8_000_000;

/// A picture and where it is shown.
struct Entry<'a> {
    shot: &'a Shot,
    /// Words about it in the comparison at equal samples; `None` where it is not of that.
    at_samples: Option<String>,
    /// The same at equal time.
    at_time: Option<String>,
}

/// The pictures of a set in the order of the page: of each sampler that at equal samples, then that at equal time, if it is another.
fn entries<'a>(summary: &Summary, set: &'a PictureSet) -> Vec<Entry<'a>> {
    let spp = |shot: &Shot| format!("{} spp", shot.row.spp.taken);
    let entry = |shot| Entry { shot, at_samples: Some(spp(shot)), at_time: None };
    let mut entries: Vec<Entry> = set.at_equal_spp().into_iter().map(entry).collect();
    for choice in equal_time(summary, set).into_iter().flat_map(|found| found.choices) {
        let words = format!("{} in {} s", spp(choice.shot), short(choice.seconds));
        match entries.iter_mut().find(|entry| entry.shot.row.id == choice.shot.row.id) {
            Some(entry) => entry.at_time = Some(words),
            None => entries.push(Entry { shot: choice.shot, at_samples: None, at_time: Some(words) }),
        }
    }
    // Either comparison lists the samplers in the order of the experiment.
    entries.sort_by_key(|entry| (entry.shot.sampler, entry.at_samples.is_none()));
    entries
}

/// What tells whether an earlier page's viewer shows what this report would: the ids of its pictures and the exposure.
pub fn key(summary: &Summary, set: &PictureSet) -> String {
    let ids: Vec<&str> = entries(summary, set).iter().map(|entry| entry.shot.row.id.as_str()).collect();
    // It stands in a comment, which nothing in it may end.
    format!("{} {}", set.exposure, ids.join(" "))
        .chars()
        .filter(|c| c.is_ascii_alphanumeric() || " .".contains(*c))
        .collect()
}

/// The viewer of one scene as HTML.
///
/// It takes about `share` letters at the most: where it would take more, pictures at equal time are left out, then all are
/// cut to a window around the middle, of at least 8 pixels across; what was left out is said.
///
/// # Errors
/// Kind `Input` where an image cannot be read.
pub fn html(dir: &Path, summary: &Summary, set: &PictureSet, share: usize) -> Result<String> {
    let truth = truth(dir, set)?;
    let entries = entries(summary, set);
    let images = entries.iter().map(|entry| load(dir, &entry.shot.row.id)).collect::<Result<Vec<Image>>>()?;
    let at_samples: Vec<&Image> =
        entries.iter().zip(&images).filter(|(e, _)| e.at_samples.is_some()).map(|(_, image)| image).collect();
    let found = Found {
        details: found_details(dir, set, &truth, &at_samples),
        scale: error_scale(at_samples.iter().copied(), &truth.mean)?,
        truth,
    };
    let all: Vec<(&Entry, &Image)> = entries.iter().zip(&images).collect();
    let some: Vec<(&Entry, &Image)> = all.iter().copied().filter(|(entry, _)| entry.at_samples.is_some()).collect();
    let whole = (0, 0, found.truth.mean.width, found.truth.mean.height);
    let mut left_out = String::new();
    let mut html = found.html(summary, set, &all, whole, &left_out);
    if html.len() > share && some.len() < all.len() {
        left_out = "The pictures at equal time are left out, so that this file stays small.".to_owned();
        html = found.html(summary, set, &some, whole, &left_out);
    }
    let mut window = whole;
    while html.len() > share && window.2.min(window.3) > 8 {
        // Letters go with the area; a twentieth less, as the text around the pictures stays.
        let by = 0.95 * (share as f64 / html.len() as f64).sqrt();
        let (width, height) = ((f64::from(window.2) * by) as u32, (f64::from(window.3) * by) as u32);
        window = ((whole.2 - width) / 2, (whole.3 - height) / 2, width, height);
        let cut = format!("Of {} × {} pixels the middle is here, so that this file stays small.", whole.2, whole.3);
        html = found.html(summary, set, &some, window, &cut);
    }
    Ok(html)
}

/// What is the same for all pictures of a scene.
struct Found {
    truth: Truth,
    details: Vec<Detail>,
    /// The error that an error map shows in full colour.
    scale: f64,
}

impl Found {
    fn html(
        &self,
        summary: &Summary,
        set: &PictureSet,
        pictures: &[(&Entry, &Image)],
        window: Window,
        left_out: &str,
    ) -> String {
        let scene = escaped(&summary.scenes[set.scene].name);
        let (x0, y0, width, height) = window;
        let mut out = format!(
            "<section class=\"viewer\" aria-label=\"Flip through the pictures of {scene}\" data-scene=\"{scene}\" data-width=\"{width}\" \
             data-height=\"{height}\" data-left=\"{x0}\" data-top=\"{y0}\" data-exposure=\"{}\" data-difference=\"{}\" data-unit=\"W/(m² sr)\" \
             data-screen=\"{}\" data-note=\"{left_out}\">\n<noscript><p>The viewer needs JavaScript; the strips below show the same pictures.</p></noscript>\n",
            set.exposure,
            self.scale,
            thresholds()
        );
        let details: Vec<&Detail> = self.details.iter().filter(|d| is_inside(&d.crop_window(), &window)).collect();
        for detail in &details {
            let (x, y, w, h) = detail.crop_window();
            let [r, g, b] = detail.crop.colour;
            out.push_str(&format!(
                "<script type=\"text/plain\" class=\"detail\" data-x=\"{}\" data-y=\"{}\" data-width=\"{w}\" data-height=\"{h}\" data-colour=\"#{r:02x}{g:02x}{b:02x}\" data-name=\"{}\"></script>\n",
                x - x0,
                y - y0,
                escaped(detail.name)
            ));
        }
        let eye = |image: &Image| {
            let light = |at: usize| screen_light(image.pixels[at], set.exposure);
            Seen::new(image.width as usize, image.height as usize, DEFAULT_PPD, light)
        };
        let reference = eye(&self.truth.mean);
        let spp = set.reference.as_ref().map_or(String::new(), |row| match row.halves {
            Some(_) => format!("2 × {} spp", set.pictures.reference_spp),
            None => "closed form".to_owned(),
        });
        out.push_str(&format!(
            "<script type=\"text/plain\" class=\"picture\" data-label=\"reference\" data-samples=\"{spp}\" data-time=\"{spp}\" data-error=\"\" data-details=\"\" {}</script>\n",
            packed(&self.truth.mean, window)
        ));
        for (entry, image) in pictures {
            let flips = reference.differences(&eye(image));
            out.push_str(&self.picture(summary, entry, image, &details, window, &flips));
        }
        out.push_str("</section>\n");
        out
    }

    fn picture(
        &self,
        summary: &Summary,
        entry: &Entry,
        image: &Image,
        details: &[&Detail],
        window: Window,
        flips: &[f64],
    ) -> String {
        let sampler = &summary.samplers[entry.shot.sampler];
        let words = |window: Window| {
            let mut estimate = mse(image, &self.truth, window);
            if sampler.repeats_in_every_pixel() {
                estimate.ci95 = None;
            }
            rmse_words(&estimate)
        };
        let of_details: Vec<String> = details.iter().map(|detail| words(detail.crop_window())).collect();
        let mut attributes = String::new();
        for (name, text) in [
            ("label", sampler.label.as_str()),
            ("id", &entry.shot.row.id),
            ("samples", entry.at_samples.as_deref().unwrap_or("")),
            ("time", entry.at_time.as_deref().unwrap_or("")),
            ("error", &words((0, 0, image.width, image.height))),
            ("flip", &entry.shot.row.errors.as_ref().and_then(|errors| errors.flip).map_or(String::new(), short)),
            ("details", &of_details.join("|")),
            ("same", if sampler.repeats_in_every_pixel() { "yes" } else { "" }),
        ] {
            attributes.push_str(&format!("data-{name}=\"{}\" ", escaped(text)));
        }
        let shares: Vec<f64> = rows(window, image.width).flatten().map(|at| flips[at]).collect();
        format!(
            "<script type=\"text/plain\" class=\"picture\" {attributes}{} {}</script>\n",
            packed(image, window),
            packed_shares(&shares, window.2 as usize)
        )
    }
}

impl Detail {
    fn crop_window(&self) -> Window {
        (self.crop.x, self.crop.y, self.crop.width, self.crop.height)
    }
}

fn is_inside(inner: &Window, outer: &Window) -> bool {
    inner.0 >= outer.0
        && inner.1 >= outer.1
        && inner.0 + inner.2 <= outer.0 + outer.2
        && inner.1 + inner.3 <= outer.1 + outer.3
}

/// The numbers of the pixels of a window in an image of `width` columns, row by row.
fn rows((x0, y0, columns, rows): Window, width: u32) -> impl Iterator<Item = std::ops::Range<usize>> {
    (y0..y0 + rows).map(move |y| {
        let first = (y * width + x0) as usize;
        first..first + columns as usize
    })
}

/// The end of an opening tag and the packed pixels of a window.
fn packed(image: &Image, window: Window) -> String {
    let pixels = rows(window, image.width).flat_map(|row| &image.pixels[row]).copied().collect();
    let halves = Halves::of(&Image { width: window.2, height: window.3, pixels });
    format!("data-scale=\"{}\">{}", halves.scale, halves.packed())
}

/// The least radiance times exposure that a screen shows with the code value 1, 2, … 255: the curve as the page applies it.
fn thresholds() -> String {
    let code = |exposed: f32| (tone_map(exposed, 1.0) * 255.0 + 0.5) as u32;
    let least = |wanted: u32| {
        // Positive floats are in the order of their bits.
        let (mut below, mut reached) = (0_u32, 16.0_f32.to_bits());
        while reached - below > 1 {
            let middle = below + (reached - below) / 2;
            if code(f32::from_bits(middle)) >= wanted { reached = middle } else { below = middle }
        }
        format!("{}", f32::from_bits(reached))
    };
    (1..=255).map(least).collect::<Vec<_>>().join(" ")
}

/// The viewer of a scene in an earlier page, if it shows what `key` says and is built as ours are; its text as it is.
pub fn kept(page: &str, key: &str) -> Option<String> {
    let (_, rest) = page.split_once(&format!("<!-- viewer {key} -->\n"))?;
    let (block, _) = rest.split_once("<!-- end of viewer -->")?;
    block.lines().all(is_ours).then(|| block.to_owned())
}

/// Whether a line is one of those that [`html`] writes: data without any element inside.
fn is_ours(line: &str) -> bool {
    let data = |start: &str, end: &str| {
        let inside = line.strip_prefix(start).and_then(|rest| rest.strip_suffix(end));
        inside.is_some_and(|inside| !inside.contains('<') && inside.matches('>').count() == 1)
    };
    line == "</section>"
        || line.starts_with(
            "<noscript><p>The viewer needs JavaScript; the strips below show the same pictures.</p></noscript>",
        )
        || line
            .strip_prefix("<section class=\"viewer\" aria-label=\"")
            .is_some_and(|rest| !rest.contains('<') && rest.matches('>').count() == 1 && rest.ends_with('>'))
        || ["detail", "picture"]
            .iter()
            .any(|sort| data(&format!("<script type=\"text/plain\" class=\"{sort}\" data-"), "</script>"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::to_screen;

    #[test]
    fn the_thresholds_are_where_the_code_value_changes() {
        let least: Vec<f32> = thresholds().split(' ').map(|text| text.parse().unwrap()).collect();
        assert_eq!(least.len(), 255);
        let code = |exposed: f32| to_screen(&Image { width: 1, height: 1, pixels: vec![[exposed; 3]] }, 1.0)[0];
        for (wanted, &at) in (1..=255_u8).zip(&least) {
            assert_eq!((code(at), code(f32::from_bits(at.to_bits() - 1))), (wanted, wanted - 1));
        }
    }

    #[test]
    fn a_key_in_a_comment_cannot_end_it_and_foreign_blocks_are_not_kept() {
        let block = "<section class=\"viewer\" aria-label=\"a\" data-note=\"\">\n<script type=\"text/plain\" class=\"picture\" data-label=\"a\" data-scale=\"1\">AA BB</script>\n</section>\n";
        let page = |block: &str| format!("x<!-- viewer 3 ab -->\n{block}<!-- end of viewer -->\ny");
        assert_eq!(kept(&page(block), "3 ab").as_deref(), Some(block));
        assert_eq!(kept(&page(block), "3 ac"), None);
        for (ours, theirs) in [
            ("AA BB", "AA <b>BB</b>"),
            ("text/plain", "module"),
            ("</section>", "</section><p>"),
            ("data-note=\"\"", "data-note=\"\"><img src=\"x\""),
            ("class=\"picture\"", "class=\"other\""),
        ] {
            assert_eq!(kept(&page(&block.replace(ours, theirs)), "3 ab"), None, "{theirs}");
        }
    }
}
