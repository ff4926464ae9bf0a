//! `report.html`: the report as one file that opens from disk, with no network: text, figures and the flip viewer.
//!
//! The text is rendered from the same Markdown as `report.md`, so nothing is said twice. The page's own code
//! is plain CSS and JavaScript in this folder. It shows and computes nothing of the lab: errors, intervals, FLIP and the screen's
//! curve come with the pictures ([`viewer`]). The page may load nothing and run no script but its own: its policy says so
//! to the browser, by the digest of that script.

mod html;
pub mod packed;
pub mod viewer;

use std::path::Path;

use sha2::{Digest, Sha256};

use crate::error::Result;
use crate::film::write_whole;

use super::provenance;
use super::summarise::Summary;
use html::{body, escaped};
use packed::base64;

/// The page's look.
const STYLE: &str = concat!(include_str!("report.css"), include_str!("viewer.css"));
/// The page's code.
const SCRIPT: &str =
    concat!(include_str!("packed.js"), include_str!("screen.js"), include_str!("viewer.js"), include_str!("report.js"));

/// Writes `report.html` beside the `report.md` whose text is `markdown`.
///
/// The same text, figures and images give the same bytes. Where the images of a scene are not there, an earlier page's viewer of
/// the same pictures is kept; where that is not there either, the page says how to get them.
///
/// # Errors
/// Kind `Write` where the file cannot be written.
pub fn write(dir: &Path, summary: &Summary, markdown: &str) -> Result<()> {
    let path = dir.join("report.html");
    let earlier = std::fs::read_to_string(&path).unwrap_or_default();
    let image = |name: &str| data_uri(dir, name);
    let viewers = summary.pictured.iter().filter(|set| !set.shots.is_empty()).count();
    let below = |heading: &str| {
        let of_scene = |name: &str| heading == format!("Pictures of {name}");
        let set = summary.pictured.iter().find(|set| of_scene(&summary.scenes[set.scene].name))?;
        (!set.shots.is_empty()).then(|| {
            let key = viewer::key(summary, set);
            match viewer::html(dir, summary, set, viewer::MOST_LETTERS / viewers)
                .ok()
                .or_else(|| viewer::kept(&earlier, &key))
            {
                Some(viewer) => format!("<!-- viewer {key} -->\n{viewer}<!-- end of viewer -->\n"),
                None => absent(summary),
            }
        })
    };
    let (body, title) = body(markdown, image, below);
    write_whole(&path, whole(&title, &body, &provenance::line(&summary.about)).as_bytes())
}

/// In the place of a viewer whose pictures are not there.
fn absent(summary: &Summary) -> String {
    format!(
        "<p class=\"note\"><strong>The flip viewer has no pictures here.</strong> They are images of the run, which a repository does not hold; \
         <code>{} --fresh</code> makes them again and writes this page with them. The figures below show what there is.</p>\n",
        escaped(&summary.about.command)
    )
}

/// A figure's file as a data URI.
fn data_uri(dir: &Path, name: &str) -> Option<String> {
    let kind = match name.rsplit_once('.')?.1 {
        "svg" => "image/svg+xml",
        "png" => "image/png",
        _ => return None,
    };
    // A report names files of its own folder alone.
    let name = name.strip_prefix("figures/").filter(|name| !name.contains(['/', '\\']))?;
    let bytes = std::fs::read(dir.join("figures").join(name)).ok()?;
    Some(format!("data:{kind};base64,{}", base64(&bytes)))
}

/// The file: head, the page's bar, the report, its code.
fn whole(title: &str, body: &str, made_by: &str) -> String {
    let digest = base64(&Sha256::digest(SCRIPT.as_bytes()));
    let (title, made_by) = (escaped(title), escaped(made_by));
    let first = "<!-- viewer ";
    let to_viewer = if body.contains(first) { "<a href=\"#flip\">Flip viewer</a>\n" } else { "" };
    let body = body.replacen(first, &format!("<a id=\"flip\"></a>\n{first}"), 1);
    format!(
        "<!doctype html>
<html lang=\"en\">
<head>
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'\">
<meta name=\"referrer\" content=\"no-referrer\">
<meta name=\"description\" content=\"{made_by}\">
<link rel=\"icon\" href=\"data:,\">
<title>{title}</title>
<style>
{STYLE}</style>
</head>
<body>
<a class=\"skip\" href=\"#report\">To the report</a>
<header class=\"bar\">
<nav aria-label=\"Page\">
<a href=\"#report\">Answers</a>
<a href=\"#contents\">Contents</a>
{to_viewer}</nav>
<div id=\"theme\"></div>
</header>
<main id=\"report\" tabindex=\"-1\">
{body}</main>
<script>{SCRIPT}</script>
</body>
</html>
"
    )
}
