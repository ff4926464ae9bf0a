//! Which decisions each scene makes, and so what it can show.

use crate::sampling::Decision;

use super::super::markdown::Page;
use super::super::summarise::{SceneSummary, Summary};
use super::tabulate;

/// The numbers that a decision reads in a scene of this layout (`0–1`); `None` where it is not made.
fn dimensions(layout: &str, decision: Decision) -> Option<&str> {
    // "pixel 0–1, lens 2–3, 4 dimensions in all"
    layout.split(", ").find_map(|part| part.strip_prefix(decision.name())?.strip_prefix(' '))
}

/// The table of scenes against decisions.
pub fn matrix(summary: &Summary, page: &mut Page) {
    let rows: Vec<Vec<String>> = summary
        .scenes
        .iter()
        .map(|scene| {
            let cells = Decision::ALL.map(|d| dimensions(&scene.layout, d).unwrap_or("–").to_owned());
            let mut row = vec![format!("`{}`", scene.name)];
            row.extend(cells);
            row.push(lights(scene));
            row.push(shows(scene));
            row
        })
        .collect();
    let head = ["scene", "pixel", "lens", "light pick", "light point", "lights", "so it can show"];
    let caption = "Decisions of each scene: the dimensions of a joint sequence that each reads, and – for what the scene does not decide; nothing is \
                   measured or charted for that. The last column follows from the decisions.";
    tabulate(page, "decisions", caption, &head, &rows);
}

/// How many lights there are.
fn lights(scene: &SceneSummary) -> String {
    match (scene.lights, dimensions(&scene.layout, Decision::LightPoint)) {
        (Some(count), _) => count.to_string(),
        (None, None) => "–".to_owned(),
        // Rows from before lights were counted: one where none is picked.
        (None, Some(_)) if dimensions(&scene.layout, Decision::LightPick).is_none() => "1".to_owned(),
        (None, Some(_)) => "several".to_owned(),
    }
}

/// What a scene can show, from what it decides alone.
fn shows(scene: &SceneSummary) -> String {
    let parts: Vec<&str> = scene
        .decisions
        .iter()
        .map(|decision| match decision {
            Decision::Pixel => "anti-aliasing",
            Decision::Lens => "defocus",
            Decision::LightPick => "the choice of a light",
            Decision::LightPoint => "soft shadows",
        })
        .collect();
    match parts.as_slice() {
        [] => "nothing random".to_owned(),
        [one] => format!("{one} alone"),
        parts => parts.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(layout: &str, lights: Option<u32>) -> SceneSummary {
        SceneSummary {
            name: "s".into(),
            layout: layout.into(),
            decisions: Decision::named_in(layout),
            lens: layout.contains("lens"),
            lights,
            has_closed_form: false,
            size: "1x1".into(),
            pixels: 1,
            reference: None,
        }
    }

    #[test]
    fn a_layout_s_words_say_which_decision_reads_what() {
        let layout = "pixel 0–1, light pick 2, light point 3–4, 5 dimensions in all";
        let found = Decision::ALL.map(|d| dimensions(layout, d));
        assert_eq!(found, [Some("0–1"), None, Some("2"), Some("3–4")]);
        assert_eq!(Decision::ALL.map(|d| dimensions("no random decision (0 dimensions)", d)), [None; 4]);
    }

    #[test]
    fn what_a_scene_shows_follows_from_what_it_decides() {
        let all = "pixel 0–1, lens 2–3, light pick 4, light point 5–6, 7 dimensions in all";
        assert_eq!(shows(&scene(all, Some(5))), "anti-aliasing, defocus, the choice of a light, soft shadows");
        assert_eq!(shows(&scene("pixel 0–1, 2 dimensions in all", None)), "anti-aliasing alone");
        assert_eq!(shows(&scene("no random decision (0 dimensions)", None)), "nothing random");
    }

    #[test]
    fn lights_are_counted_where_there_are_any() {
        let one = "pixel 0–1, light point 2–3, 4 dimensions in all";
        let many = "pixel 0–1, light pick 2, light point 3–4, 5 dimensions in all";
        assert_eq!(lights(&scene(many, Some(72))), "72");
        assert_eq!(lights(&scene("pixel 0–1, 2 dimensions in all", None)), "–");
        assert_eq!((lights(&scene(one, None)), lights(&scene(many, None))), ("1".into(), "several".into()));
    }
}
