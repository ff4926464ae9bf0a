//! Strips, equal time, and the page that flips through them.

use super::links::check_links;
use super::*;

#[test]
fn pictures_without_images_are_said_to_be_missing_and_an_earlier_figure_is_kept() {
    let folder = folder();
    let about = folder.path().join("experiment.json");
    let json = std::fs::read_to_string(&about).unwrap();
    let pictures = r#""pictures": {"scene": "a01", "size": "16x9", "spp": 4, "reference_spp": 8}"#;
    let edited = json.replace("\"pictures\": null", pictures);
    assert_ne!(json, edited);
    std::fs::write(&about, edited).unwrap();
    // A picture's row whose image is not in the folder.
    let path = folder.path().join("results.jsonl");
    let rows = std::fs::read_to_string(&path).unwrap();
    let line = rows.lines().find(|line| line.contains("\"kind\":\"render\"")).unwrap();
    let line = line.replace("\"kind\":\"render\"", "\"kind\":\"picture\"");
    std::fs::write(&path, format!("{rows}{line}\n")).unwrap();
    let report = |folder: &tempfile::TempDir| std::fs::read_to_string(write(folder.path()).unwrap().report).unwrap();
    let text = report(&folder);
    assert!(text.contains("Missing: 4 of 5 pictures; 4 of 4 stages of Figure 1"), "{text}");
    assert!(text.contains("*Not shown: errors-a01."));
    std::fs::write(folder.path().join("figures/errors-a01.png"), b"an earlier figure").unwrap();
    assert!(
        report(&folder).contains("](figures/errors-a01.png)"),
        "the earlier figure is shown, and the text is that of its run"
    );
    assert_eq!(std::fs::read(folder.path().join("figures/errors-a01.png")).unwrap(), b"an earlier figure");
}

/// Two picture scenes with a ladder of counts, none with a lens; images large enough for details.
const PICTURED: &str = r#"{
    "name": "pictured", "seed": 5, "scenes": ["cornell", "penumbra"], "size": "4x4",
    "samplers": ["uniform", "ld:best"], "spp": [1, 4], "replicates": 2,
    "reference": {"sampler": "sobol", "spp": 4},
    "pictures": [
        {"scene": "cornell", "size": "88x30", "spp": [1, 2, 4], "reference_spp": 8},
        {"scene": "penumbra", "size": "88x30", "spp": [1, 2, 4]}
    ]
}"#;

/// Runs it and sets the seconds of each image so that a picture costs its samples per pixel, ld:best twice as fast.
fn pictured() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/experiments/pictured.json");
    let value = sampler_lab::scene::json::parse(PICTURED.as_bytes(), "pictured.json").unwrap();
    let experiment = Experiment::from_value(&value, "pictured.json").unwrap();
    let lab = Lab::new(&place, Default::default());
    let plan = plan(&experiment, &lab).unwrap();
    let outcome =
        execute(&plan, &lab, folder.path(), &Silent, &Options::new(2, "sampler-lab run pictured.json")).unwrap();
    assert_eq!(outcome.failures, []);
    let rows = read(&folder.path().join("results.jsonl")).unwrap();
    let timings: Vec<String> = read_timings(&timings_path(folder.path()))
        .unwrap()
        .into_iter()
        .map(|mut timing| {
            if let Some(Row::Image(row)) = rows.iter().find(|row| row.id() == timing.id) {
                let speed = if row.sampler.starts_with("ld") { 2.0 } else { 1.0 };
                // A picture's own timing, doubled by other work, is not what its cost is judged by.
                let (pixels, of_picture) = (row.size.pixels() as f64, f64::from(88 * 30));
                let slowed = if row.kind == Kind::Picture && row.sampler.starts_with("ld") { 2.0 } else { 1.0 };
                timing.seconds = f64::from(row.spp.taken) / speed * slowed * pixels / of_picture;
            }
            serde_json::to_string(&timing).unwrap() + "\n"
        })
        .collect();
    std::fs::write(timings_path(folder.path()), timings.concat()).unwrap();
    folder
}

#[test]
fn every_picture_scene_has_its_strips_and_equal_time_takes_the_count_that_costs_as_much() {
    let folder = pictured();
    let written = write(folder.path()).unwrap();
    assert!(written.check().is_ok(), "{:?}", written.summary.missing);
    check_links(&written.report);
    let page = std::fs::read_to_string(&written.report).unwrap();
    for scene in ["cornell", "penumbra"] {
        assert!(page.contains(&format!("### Pictures of {scene}\n")));
        for sort in ["reference", "details", "equal-time", "errors"] {
            let file = format!("figures/{sort}-{scene}.png");
            assert!(page.contains(&format!("]({file})")) && folder.path().join(&file).is_file(), "{file}");
        }
        assert!(folder.path().join(format!("images/flip/{scene}/02-ld-best.png")).is_file());
    }
    let words = |scene: &str| -> Vec<String> {
        written.figures.details[scene].iter().map(|name| name.split(' ').next().unwrap().to_owned()).collect()
    };
    assert_eq!(words("cornell"), ["edges", "shadow"], "no lens, so no defocus");
    assert_eq!(words("penumbra"), ["shadow"], "one plane of one colour: no edges either");
    assert!(page.contains("is what `uniform:best` takes at 2 spp, 2.00 s"), "{page}");
    let (_, table) = page.split_once("The pictures of `cornell` at equal time").unwrap();
    let lines: Vec<&str> = table.lines().filter(|line| line.starts_with("| `")).take(2).collect();
    assert!(lines[0].starts_with("| `uniform:best` | 2 | 2.00 | 1.00 |"), "{lines:?}");
    assert!(lines[1].starts_with("| `ld:best` | 4 | 2.00 | 1.00 |"), "{lines:?}");
    assert!(page.contains("`cornell` in three stages"), "a scene without a lens has no stage for it");
    let html = std::fs::read(folder.path().join("report.html")).unwrap();
    // Without the images the figures stay, and so do the words and the pictures of the page.
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    write(folder.path()).unwrap();
    assert_eq!(std::fs::read_to_string(&written.report).unwrap(), page);
    assert!(std::fs::read(folder.path().join("report.html")).unwrap() == html, "the viewer's pictures are kept");
}

#[test]
fn the_page_has_the_text_the_figures_and_a_viewer_of_each_picture_scene_and_nothing_from_outside() {
    let folder = pictured();
    write(folder.path()).unwrap();
    let path = folder.path().join("report.html");
    let page = std::fs::read_to_string(&path).unwrap();
    assert_eq!(page.matches("<section class=\"viewer\"").count(), 2);
    // A reference, two samplers at equal samples, and ld:best's other count at equal time, in each.
    assert_eq!(page.matches("class=\"picture\" data-label=").count(), 2 * 4);
    let markdown = std::fs::read_to_string(folder.path().join("report.md")).unwrap();
    assert_eq!(page.matches("<img class=").count(), markdown.matches("![Figure ").count());
    assert_eq!(page.matches("<table>").count(), markdown.lines().filter(|line| line.starts_with("| ---")).count());
    // Whatever an attribute names is in the page or in its address.
    for attribute in ["src=\"", "href=\""] {
        for piece in page.split(attribute).skip(1) {
            assert!(piece.starts_with("data:") || piece.starts_with('#'), "{attribute}{}", &piece[..40]);
        }
    }
    assert!(!page.contains("http://") && !page.contains("https://"), "an address of the network");
    // A viewer that may take fewer letters leaves out the pictures at equal time, then all but the middle of each.
    let summary = write(folder.path()).unwrap().summary;
    let viewer = |letters| viewer::html(folder.path(), &summary, &summary.pictured[0], letters).unwrap();
    let count = |html: &str| html.matches("class=\"picture\"").count();
    let whole = viewer(viewer::MOST_LETTERS);
    let some = viewer(whole.len() - 1);
    let middle = viewer(some.len() * 2 / 3);
    assert_eq!([count(&whole), count(&some), count(&middle)], [4, 3, 3]);
    assert!(whole.contains("data-note=\"\"") && some.contains("data-note=\"The pictures at equal time are left out"));
    assert!(middle.contains("data-note=\"Of 88 × 30 pixels the middle is here") && middle.len() <= some.len() * 2 / 3);
    // Another folder of the same rows and images has the same bytes; one without images or an earlier page says so.
    write(folder.path()).unwrap();
    assert!(std::fs::read_to_string(&path).unwrap() == page);
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    let hostile = page.replace("data-label=\"reference\"", "data-label=\"<b>reference</b>\"");
    for earlier in [None, Some(hostile), Some(page.replace("<!-- viewer ", "<!-- viewer 0"))] {
        match &earlier {
            None => std::fs::remove_file(&path).unwrap(),
            Some(earlier) => std::fs::write(&path, earlier).unwrap(),
        }
        write(folder.path()).unwrap();
        let page = std::fs::read_to_string(&path).unwrap();
        assert_eq!(page.matches("The flip viewer has no pictures here.").count(), 2);
        assert!(!page.contains("<b>reference"));
    }
}

#[test]
fn a_picture_is_shown_at_its_scene_s_own_exposure() {
    let folder = pictured();
    let sets = write(folder.path()).unwrap().summary.pictured;
    assert_eq!((sets[0].exposure, sets[1].exposure), (1.0, 3.0), "what cornell.json and penumbra.json ask for");
    let figure = |name: &str| std::fs::read(folder.path().join("figures").join(name)).unwrap();
    let (cornell, errors) = (figure("reference-cornell.png"), figure("errors-cornell.png"));
    let about = folder.path().join("experiment.json");
    let text = std::fs::read_to_string(&about).unwrap();
    let edited = text.replacen("\"exposure\": 1.0", "\"exposure\": 1.5", 1);
    assert_ne!(text, edited);
    std::fs::write(&about, edited).unwrap();
    let page = std::fs::read_to_string(write(folder.path()).unwrap().report).unwrap();
    assert!(page.contains("88x30 pixels, exposure 1.5"), "{page}");
    assert!(figure("reference-cornell.png") != cornell);
    assert!(figure("errors-cornell.png") == errors, "an error map has no exposure");
}
