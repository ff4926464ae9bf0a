//! What is planned: files, items, ids, seeds.

use super::*;

#[test]
fn the_experiments_that_come_with_the_lab_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/experiments");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let experiment = Experiment::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(path.file_stem().unwrap().to_str(), Some(experiment.name.as_str()));
    }
}

/// Whatever one slip of the hand makes of a file, the answer is an experiment or a message, never a panic.
#[test]
fn no_byte_left_out_or_put_in_upsets_the_reader() {
    let mut refused = 0;
    for at in 0..SMALL.len() {
        for slip in [&b""[..], b"\"", b"-", b"9", b"{", b"\xff"] {
            let mut text = SMALL.as_bytes().to_vec();
            text.splice(at..=at, slip.iter().copied());
            let read = json::parse(&text, "small.json").and_then(|value| Experiment::from_value(&value, "small.json"));
            if let Err(error) = read {
                assert!(error.exit_code() == 2 && error.place.starts_with("small.json"), "{error}");
                refused += 1;
            }
        }
    }
    assert!(refused > SMALL.len(), "{refused}");
}

#[test]
fn a_plan_lists_every_item_once_and_deterministic_samplers_have_one_replicate() {
    let plan = small(&Toy::new());
    let count = |kind: Kind| plan.items.iter().filter(|item| item.kind() == kind).count();
    // Samplers: fresh (two names), grid (nothing random), strata. Replicates of a scene and spp: 3 + 1 + 3.
    assert_eq!(plan.samplers.len(), 3);
    assert_eq!(count(Kind::Points), 3 * (2 + 1 + 2));
    assert_eq!(count(Kind::Render), 2 * 2 * (3 + 1 + 3));
    assert_eq!(count(Kind::Ensemble), 2 * 2 * 3);
    assert_eq!(count(Kind::ReferenceHalf), 2 + 2, "ramp and the pictures; exact has a closed form");
    assert_eq!(count(Kind::Reference), 3);
    assert_eq!(count(Kind::Picture), 3);
    assert_eq!(count(Kind::Stage), 4);
    let ids: HashSet<&str> = plan.items.iter().map(|item| item.id.as_str()).collect();
    assert_eq!(ids.len(), plan.items.len());
    let seeds: HashSet<u64> = plan.items.iter().filter_map(|item| item.seed()).collect();
    assert_eq!(seeds.len(), plan.items.iter().filter(|item| item.seed().is_some()).count());
}

#[test]
fn two_names_of_one_sampler_are_done_once_and_said() {
    let plan = small(&Toy::new());
    assert_eq!(plan.names("fresh:step"), ["fresh:sheet", "fresh:best"]);
    assert!(
        plan.notes.iter().any(|note| note.contains("fresh:sheet and fresh:best are one sampler")),
        "{:?}",
        plan.notes
    );
    assert!(plan.notes.iter().any(|note| note.contains("ramp, grid: nothing random")), "{:?}", plan.notes);
    assert!(plan.notes.iter().any(|note| note == "ramp, strata: 1 spp asked, 2 taken"), "{:?}", plan.notes);
}

#[test]
fn adding_a_sampler_a_scene_an_spp_or_replicates_changes_no_id_and_no_seed() {
    let toy = Toy::new();
    let before = identities(&small(&toy));
    let edits = [
        ("\"samplers\": [", "\"samplers\": [\"net\", "),
        ("\"scenes\": [", "\"scenes\": [\"other\", "),
        ("\"spp\": [1", "\"spp\": [16, 1"),
        ("\"n\": [1", "\"n\": [8, 1"),
        ("\"name\": \"small\"", "\"name\": \"renamed\""),
    ];
    for (from, to) in edits {
        let after = identities(&plan(&edited(from, to), &toy).unwrap());
        for (label, identity) in &before {
            assert_eq!(after.get(label), Some(identity), "{to}: {label}");
        }
    }
    // More replicates are more members: the ensembles are others, the images are not.
    let after = identities(&plan(&edited("\"replicates\": 3", "\"replicates\": 5"), &toy).unwrap());
    for (label, identity) in before.iter().filter(|(label, _)| !label.ends_with("ensemble") || label.contains("grid")) {
        assert_eq!(after.get(label), Some(identity), "{label}");
    }
}

#[test]
fn another_reference_keeps_the_images_but_not_what_was_found_against_it() {
    let toy = Toy::new();
    let before = identities(&small(&toy));
    let after = identities(&plan(&edited("\"spp\": 64", "\"spp\": 128"), &toy).unwrap());
    for (label, identity) in &before {
        let depends = label.starts_with("ramp") && (label.ends_with("ensemble") || label == "ramp 5x4 reference");
        if let Some(other) = after.get(label) {
            assert_eq!(other == identity, !depends, "{label}");
        }
    }
}

#[test]
fn an_id_changes_with_content_and_algorithm_numbers_and_with_nothing_else() {
    let base = Toy::new();
    let before = small(&base);
    let changed = |toy: &Toy| -> HashSet<Kind> {
        let after = small(toy);
        let pairs = before.items.iter().zip(&after.items);
        pairs.filter(|(a, b)| a.id != b.id).map(|(a, _)| a.kind()).collect()
    };
    let numbers = base.numbers;
    let with = |numbers| Toy { numbers, ..Toy::new() };
    use Kind::*;
    let images = HashSet::from([ReferenceHalf, Render, Picture, Stage, Reference, Ensemble]);
    assert_eq!(changed(&base), HashSet::new());
    assert_eq!(changed(&Toy { content: "edited", ..Toy::new() }), images);
    assert_eq!(changed(&with(Algorithms { renderer: 2, ..numbers })), images);
    assert_eq!(changed(&with(Algorithms { estimator: 2, ..numbers })), images);
    let all: HashSet<Kind> = images.iter().copied().chain([Points]).collect();
    assert_eq!(changed(&with(Algorithms { sampler: 2, ..numbers })), all);
    assert_eq!(changed(&with(Algorithms { metrics: 2, ..numbers })), HashSet::from([Points, Ensemble]));
    assert_eq!(changed(&with(Algorithms { exact: 2, ..numbers })), HashSet::from([Reference, Ensemble]));
}

/// Ids and seeds are what makes last year's rows this year's: should this test fail, all stored results are void.
/// Both values were computed apart from this code, with Python's hashlib over the fields and their lengths.
#[test]
fn ids_and_seeds_are_the_ones_of_the_first_release() {
    let plan = small(&Toy::new());
    let render = plan.items.iter().find(|item| item.kind() == Kind::Render).unwrap();
    assert_eq!(render.label(), "ramp fresh:step 1 spp 5x4 replicate 0");
    assert_eq!((render.id.as_str(), render.seed()), ("755f99b895f282c6", Some(10_628_564_637_087_314_005)));
}

#[test]
fn equal_seeds_are_refused_with_both_items_named() {
    let mut plan = small(&Toy::new());
    assert_eq!(refuse_equal_seeds(&plan.items, "small.json"), Ok(()));
    let half = plan.items.iter().find(|item| item.kind() == Kind::ReferenceHalf).unwrap().seed().unwrap();
    let render = plan.items.iter_mut().find(|item| item.kind() == Kind::Render).unwrap();
    let Work::Image(work) = &mut render.work else { panic!("a render is an image") };
    work.seed = half;
    let error = refuse_equal_seeds(&plan.items, "small.json").unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.what.contains("reference half 0") && error.what.contains("replicate 0"), "{error}");
}

#[test]
fn what_cannot_be_planned_is_refused_with_its_place() {
    let cases = [
        (
            "\"sampler\": \"truth\"",
            "\"sampler\": \"fresh\"",
            "small.json: reference.sampler: expected a sampler that is not compared",
        ),
        ("\"grid\", ", "", "ok"),
        ("\"grid\"", "\"gird\"", "small.json: samplers[1]: gird: expected one of the samplers"),
        ("\"sampler\": \"truth\"", "\"sampler\": \"none\"", "small.json: reference.sampler: none: expected"),
        (
            "\"star\"",
            "\"sta\"",
            "small.json: points.metrics[0]: expected one of the metrics star t_value, found \"sta\"; did you mean \"star\"?",
        ),
        ("\"ramp\", \"exact\"", "\"ramp\", \"exact\", \"nowhere\"", "nowhere: expected a scene file"),
        (
            "\"ramp\", \"exact\"",
            "\"ramp\", \"exact\", \"sub/ramp.json\"",
            "small.json: scenes[2]: expected scenes of different names",
        ),
    ];
    for (from, to, expected) in cases {
        match plan(&edited(from, to), &Toy::new()) {
            Ok(_) => assert_eq!(expected, "ok", "{to}"),
            Err(error) => assert!(error.exit_code() == 2 && error.to_string().contains(expected), "{error}"),
        }
    }
    let text = SMALL.replace("\"grid\", ", "").replace("\"sampler\": \"truth\"", "\"sampler\": \"grid\"");
    let error = plan(&experiment(&text), &Toy::new()).unwrap_err();
    assert!(error.what.contains("both halves of ramp would be one image"), "{error}");
}
