//! What a tab asks for and what it is told: documents that come back, changes, values, points, errors, files.

use super::*;

#[test]
fn a_tab_s_picture_is_render_s_and_its_document_reads_back_to_the_same_bytes_and_picture() {
    let server = small();
    let mut tab = server.tab();
    tab.finished();
    tab.say(&json!({"ask": "set", "sets": ["sampler=\"halton\"", "seed=18446744073709551615", "camera.fov=50"]}));
    tab.find("a state", |m| m["is"] == "state" && m["seed"] == "18446744073709551615");
    let (_, shown) = tab.finished();
    let document = tab.download("document");
    let exr = tab.download("exr");

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tab.exr");
    std::fs::write(&path, exr).unwrap();
    let (image, provenance) = read_exr(&path).unwrap();
    let scene_file = folder.path().join("tab.json");
    std::fs::write(&scene_file, &document).unwrap();
    let options = OpenOptions { data: vec![config("../data")], sets: Vec::new() };
    let loaded = load::open(&scene_file, &options).unwrap();
    let scene = Scene::new(&loaded.config, loaded.mesh.clone(), (32, 24), Stage::Final).unwrap();
    let set = SamplerSet::parse(loaded.config.sampler.as_deref().unwrap(), Preset::Best).unwrap();
    let sampler = Sampler::new(set, &scene.layout, 4, loaded.config.seed.unwrap()).unwrap();
    assert_eq!(image, render(&scene, &sampler).unwrap().image);
    assert!(provenance.contains(&("seed".to_owned(), u64::MAX.to_string())), "{provenance:?}");

    // In another tab, after another scene.
    let mut other = server.tab();
    other.finished();
    other.say(&json!({"ask": "load", "name": "penumbra.json"}));
    other.find("another scene", |m| m["is"] == "state" && m["name"] == "penumbra.json");
    other.say(&json!({"ask": "document", "name": "tab.json", "text": String::from_utf8(document.clone()).unwrap()}));
    other.find("the document", |m| m["is"] == "state" && m["name"] == "tab.json");
    assert_eq!(other.finished().1, shown);
    assert_eq!(other.download("document"), document);
    // And by a drop.
    other.say(&json!({"ask": "reset"}));
    other.upload(1, "tab.json", true, &document);
    other.find("the drop", |m| m["is"] == "state" && m["name"] == "tab.json");
    assert_eq!(other.finished().1, shown);
    assert_eq!(other.download("document"), document);
}

#[test]
fn no_picture_is_sent_before_the_last_one_was_shown_and_the_last_change_wins() {
    let server = small();
    let mut tab = server.tab();
    tab.acknowledges = false;
    let (first, _) = tab.until("frame");
    for fov in 20..=120 {
        tab.say(&json!({"ask": "set", "sets": [format!("camera.fov={fov}")], "moving": true}));
    }
    tab.say(&json!({"ask": "set", "sets": ["camera.fov=33"]}));
    // Everything is answered, and the first frame stays the only one.
    tab.say(&json!({"ask": "download", "what": "document"}));
    let (_, text) = tab.find("the document", |m| {
        assert_ne!(m["is"], "frame", "a second frame without the first being shown");
        m["is"] == "file"
    });
    let document: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(document["camera"]["fov"], 33.0);
    tab.acknowledges = true;
    tab.say(&json!({"ask": "shown", "frame": first["frame"]}));
    let (last, _) = tab.finished();
    let sent = last["frame"].as_u64().unwrap() - first["frame"].as_u64().unwrap();
    assert!(sent <= 20, "{sent} frames for the one picture that still counts");
}

#[test]
fn saving_takes_a_new_name_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let server = start("cornell.json", &["framebuffer.res_w=16", "framebuffer.res_h=16"], &[folder.path()]);
    let mut tab = server.tab();
    tab.finished();
    for expected in ["mine.json", "mine-2.json", "mine-3.json"] {
        tab.say(&json!({"ask": "save", "name": "mine.json"}));
        assert_eq!(tab.until("saved").0["name"], expected);
        let document = tab.download("document");
        assert_eq!(std::fs::read(folder.path().join(expected)).unwrap(), document);
    }
    for bad in ["../mine", "/tmp/mine", "", ".hidden", "a\u{0}", "a/b", &"x".repeat(300)] {
        assert!(tab.error(&json!({"ask": "save", "name": bad})).contains("expected a name of letters"), "{bad:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3, "nothing else, and nothing partial");
}

#[test]
fn a_tab_answers_with_values_points_distances_errors_and_spectra() {
    let server = start(
        "a01.json",
        &["framebuffer.res_w=64", "framebuffer.res_h=36", "framebuffer.sppx=8", "auto_focus=false"],
        &[],
    );
    let mut tab = server.tab();
    tab.finished();
    tab.say(&json!({"ask": "pick", "x": 32, "y": 30}));
    let (pick, _) = tab.until("pick");
    let depth = pick["depth"].as_f64().unwrap();
    assert!(
        pick["focused"] == true
            && pick["material"].is_string()
            && depth > 0.0
            && depth <= pick["distance"].as_f64().unwrap()
    );
    let (state, _) = tab.find("the new focus", |m| m["is"] == "state");
    assert!((state["focal_depth"].as_f64().unwrap() / depth - 1.0).abs() < 1e-5, "{pick} {state}");
    // Two samplers on the same samples, then on the same seconds.
    tab.set(&["view.second=\"ld:sheet\""]);
    let (frame, bytes) = tab.find("two panels", |m| {
        m["is"] == "frame"
            && m["panels"].as_array().unwrap().len() == 2
            && m["panels"].as_array().unwrap().iter().all(|p| p["samples"] == 8)
    });
    assert_eq!(bytes.len(), 2 * 3 * 64 * 36);
    assert_eq!(frame["panels"][1]["sampler"], "ld:sheet");
    tab.say(&json!({"ask": "points", "x": 3, "y": 4, "decision": "lens"}));
    let (points, _) = tab.until("points");
    let sets = points["sets"].as_array().unwrap();
    assert_eq!((sets.len(), sets[0]["points"].as_array().unwrap().len()), (2, 8));
    assert!(sets.iter().all(|s| s["measured"]["star"]["value"].as_f64().unwrap() > 0.0));
    assert!(
        tab.error(&json!({"ask": "points", "x": 3, "y": 4, "decision": "light-pick"})).contains("that the scene makes")
    );
    let (status, _) = tab.find("errors of both", |m| {
        m["is"] == "status"
            && m["panels"].as_array().unwrap().iter().all(|p| p["errors"]["rmse"]["value"].as_f64() > Some(0.0))
    });
    assert!(status["panels"][0]["errors"]["rmse"]["ci95"].is_array(), "with the interval of the reference's noise");
    for view in ["reference", "error", "variance", "image"] {
        tab.set(&[&format!("view.look={view:?}")]);
        tab.find(view, |m| m["is"] == "frame" && m["panels"][0]["view"] == view);
    }
    tab.say(&json!({"ask": "probe", "x": 5, "y": 6}));
    let (probe, _) = tab.until("probe");
    assert!(probe["panels"][1]["mean"][0].is_number() && probe["reference"][2].is_number());
    // Points and a spectrum at the same time: neither waits for the other.
    tab.say(&json!({"ask": "spectrum"}));
    tab.say(&json!({"ask": "points", "x": 3, "y": 4, "decision": "pixel"}));
    let mut spectrum = Value::Null;
    let mut has_points = false;
    while spectrum.is_null() || !has_points {
        let (answer, _) =
            tab.find("a spectrum and points", |m| ["spectrum", "points", "error"].contains(&m["is"].as_str().unwrap()));
        assert_ne!(answer["is"], "error", "{answer}");
        match answer["is"] == "points" {
            true => has_points = true,
            false => spectrum = answer,
        }
    }
    assert_eq!(spectrum["panels"].as_array().unwrap().len(), 2, "{spectrum}");
    let rings = |i: usize| spectrum["panels"][i]["spectrum"]["power"].as_array().unwrap().len();
    assert!(rings(0) > 10 && rings(0) == rings(1));
    tab.set(&["view.second=\"stratified\"", "view.seconds=0.2"]);
    let (frame, _) = tab.find("both by seconds", |m| {
        m["is"] == "frame"
            && m["panels"].as_array().unwrap().iter().all(|p| p["timing"] == false && p["samples"] == p["of"])
            && m["panels"][1]["sampler"] == "stratified:shuffle:jitter@each"
    });
    assert!(frame["panels"][0]["seconds"].as_f64().unwrap() > 0.0);
    // Stopped, nothing grows; a restart goes on.
    tab.set(&["view.second=null", "view.seconds=null"]);
    tab.set(&["framebuffer.sppx=1000000"]);
    tab.say(&json!({"ask": "stop"}));
    tab.find("a stop", |m| m["is"] == "status" && m["state"] == "stopped");
    tab.say(&json!({"ask": "restart"}));
    tab.find("work", |m| m["is"] == "status" && m["state"] == "rendering");
}

#[test]
fn a_refused_change_and_another_way_of_looking_leave_the_running_picture_alone() {
    let server =
        start("cornell.json", &["framebuffer.res_w=96", "framebuffer.res_h=64", "framebuffer.sppx=1000000"], &[]);
    let mut tab = server.tab();
    // With the tree that it ends with, and in the midst of it.
    let (first, _) = tab.find("a picture under way", |m| {
        m["is"] == "frame"
            && m["panels"][0]["samples"].as_u64() > Some(1)
            && m["panels"][0]["reference"].as_u64() > Some(0)
    });
    let epoch = first["epoch"].clone();
    let mut samples = first["panels"][0]["samples"].as_u64().unwrap();
    let mut goes_on = |tab: &mut Tab, what: &str| {
        let (frame, _) = tab.until("frame");
        assert_eq!(frame["epoch"], epoch, "{what}: begun anew");
        let now = frame["panels"][0]["samples"].as_u64().unwrap();
        assert!(now >= samples, "{what}: {now} samples after {samples}");
        samples = now;
    };
    for refused in [
        "camera.fov=190",
        "framebuffer.sppx=0",
        "framebuffer.res_w=1000000",
        "sampler=\"ld:none\"",
        "view.second=\"nonsense\"",
        "view.seconds=0",
        "scene.mesh_files=[\"absent.obj\"]",
        "camera.pos=[1e30, 0, 0]",
    ] {
        let error = tab.error(&json!({"ask": "set", "sets": [refused]}));
        assert!(error.contains("expected"), "{refused}: {error}");
        goes_on(&mut tab, refused);
    }
    for shown in
        ["framebuffer.exposure=2", "view.look=\"variance\"", "view.show=\"flip\"", "view.speed=3", "view.refine=false"]
    {
        tab.set(&[shown]);
        tab.until("state");
        goes_on(&mut tab, shown);
    }
    // Stopped, it stays what it is and can be saved.
    tab.say(&json!({"ask": "stop"}));
    tab.find("a stop", |m| m["is"] == "status" && m["state"] == "stopped");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stopped.exr");
    std::fs::write(&path, tab.download("exr")).unwrap();
    let (image, provenance) = read_exr(&path).unwrap();
    let kept: u64 = provenance.iter().find(|(key, _)| key == "spp").unwrap().1.parse().unwrap();
    assert!(kept >= samples && image.pixels.iter().any(|p| p[0] > 0.0), "{kept} samples after {samples}");
}

#[test]
fn how_a_tab_compares_and_shows_is_in_the_document_and_comes_back_with_it() {
    let server = small();
    let mut tab = server.tab();
    tab.finished();
    let plain = tab.download("document");
    tab.set(&[
        "view.second=\"ld:sheet\"",
        "view.seconds=0.25",
        "view.show=\"flip\"",
        "view.look=\"error\"",
        "view.refine=false",
        "view.speed=1.5",
    ]);
    let is_set = |m: &Value| {
        m["is"] == "state"
            && m["config"]["view"]
                == json!({"second": "ld:sheet", "seconds": 0.25, "show": "flip", "look": "error", "refine": false, "speed": 1.5})
    };
    tab.find("the view", is_set);
    let document = tab.download("document");
    tab.say(&json!({"ask": "reset"}));
    let (frame, _) = tab.find("one panel", |m| m["is"] == "frame" && m["panels"].as_array().unwrap().len() == 1);
    assert_eq!(frame["panels"][0]["view"], "image");
    assert_eq!(tab.download("document"), plain);
    tab.upload(1, "again.json", true, &document);
    tab.find("the view again", is_set);
    tab.find("two panels by seconds", |m| {
        m["is"] == "frame" && m["panels"].as_array().unwrap().len() == 2 && m["panels"][1]["sampler"] == "ld:sheet"
    });
    assert_eq!(tab.download("document"), document);
    // A scene file that says nothing of it is shown as the one before.
    tab.say(&json!({"ask": "load", "name": "penumbra.json"}));
    tab.find("another scene", |m| m["name"] == "penumbra.json" && is_set(m));
    // For `render` it is the same picture.
    let picture = |bytes: &[u8]| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        std::fs::write(&path, bytes).unwrap();
        load::open(&path, &OpenOptions { data: vec![config("../data")], sets: Vec::new() }).unwrap().content_sha256()
    };
    assert_eq!(picture(&document), picture(&plain));
}
