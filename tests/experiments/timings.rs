//! Rounds of timings, and other programs' points.

use super::*;

/// Rounds of an image of [`SMALL`] with `timing`, by its words.
fn rounds_of(plan: &Plan, out: &Path) -> BTreeMap<String, usize> {
    let timings = results::read_timings(&results::timings_path(out)).unwrap();
    let again = timings.iter().filter_map(|timing| Some((&timing.id, timing.again.as_ref()?.seconds.len())));
    again.map(|(id, rounds)| (plan.items[plan.position(id).unwrap()].label(), rounds)).collect()
}

#[test]
fn images_are_timed_again_in_rounds_that_leave_no_trace_in_the_results() {
    let (_keep, mut expected) = undisturbed();
    let folder = tempfile::tempdir().unwrap();
    let timed = edited("\"seed\": 11,", "\"seed\": 11, \"timing\": {\"rounds\": 3, \"spp\": [4]},");
    let toy = Toy::new();
    let plan = plan(&timed, &toy).unwrap();
    let survey = Survey::new(&plan, &Standing::nothing(&plan), folder.path(), 2);
    run(&plan, &toy, folder.path()).check().unwrap();
    // Two scenes, three samplers, one count: the first replicate of each, 4 spp of 20 and of 16 pixels.
    let rounds = rounds_of(&plan, folder.path());
    assert_eq!((rounds.len(), rounds.values().copied().collect::<HashSet<_>>()), (6, HashSet::from([3])));
    assert!(rounds.keys().all(|label| label.ends_with("replicate 0") && label.contains(" 4 spp ")), "{rounds:?}");
    assert_eq!(survey.samples_timing, 3 * 3 * 4 * (20 + 16));
    let others = plan.items.iter().filter(|item| item.kept_image().is_some()).count();
    assert_eq!(toy.renders(), others + 3 * 6);
    // The toy draws no numbers apart from its images, so there is no share of them.
    let timings = results::read_timings(&results::timings_path(folder.path())).unwrap();
    assert!(
        timings.iter().filter_map(|t| t.again.as_ref()).all(|again| again.numbers.is_empty() && again.threads == 2)
    );
    let mut found = bytes(folder.path());
    found.remove("experiment.json");
    expected.remove("experiment.json");
    assert_same(&found, &expected, "rounds");
    let toy = Toy::new();
    run(&plan, &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0, "all rounds are done");
}

#[test]
fn rounds_are_gone_on_with_begun_anew_on_other_threads_and_catch_code_that_drifts() {
    let folder = tempfile::tempdir().unwrap();
    let timed = edited("\"seed\": 11,", "\"seed\": 11, \"timing\": {\"rounds\": 3},");
    let plan = plan(&timed, &Toy::new()).unwrap();
    run(&plan, &Toy::new(), folder.path()).check().unwrap();
    let path = results::timings_path(folder.path());
    // As a kill in the second round leaves it: the first three images have two rounds, the others one.
    let mut left = 3;
    let lines: Vec<String> = results::read_timings(&path)
        .unwrap()
        .into_iter()
        .map(|mut timing| {
            if let Some(again) = &mut timing.again {
                again.seconds.truncate(if left > 0 { 2 } else { 1 });
                left -= i32::from(left > 0);
            }
            serde_json::to_string(&timing).unwrap() + "\n"
        })
        .collect();
    std::fs::write(&path, lines.concat()).unwrap();
    let toy = Toy::new();
    run(&plan, &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 3 + 9 * 2);
    assert!(rounds_of(&plan, folder.path()).values().all(|&rounds| rounds == 3));
    let toy = Toy::new();
    let options = Options { threads: 1, ..options() };
    execute(&plan, &toy, folder.path(), &Silent, &options).unwrap().check().unwrap();
    assert_eq!(toy.renders(), 12 * 3, "another number of threads is another time");
    let timings = results::read_timings(&path).unwrap();
    assert!(
        timings.iter().filter_map(|t| t.again.as_ref()).all(|again| again.threads == 1 && again.seconds.len() == 3)
    );
    // Another making of an image with other pixels is a failure that says so, and no time.
    let drifting = Toy::new();
    drifting.drift.set(0.25);
    let outcome = run(&plan, &drifting, folder.path());
    let failure = &outcome.failures[0];
    assert!(failure.error.to_string().contains("one image, two makings"), "{failure:?}");
    assert_eq!((outcome.failures.len(), outcome.check().unwrap_err().exit_code()), (12, 4));
}

#[test]
fn a_file_of_other_programs_points_is_read_from_beside_the_experiment_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.json");
    std::fs::write(&path, SMALL.replacen('{', "{\"peers\": \"peers.json\",", 1)).unwrap();
    let error = Experiment::read(&path).unwrap_err();
    assert!(error.exit_code() == 2 && error.place.ends_with("peers.json"), "{error}");
    let point = r#"{"name": "M", "scene": "ramp", "size": "5x4", "spp": 4, "seconds": 1, "rmse": 0.5, "machine": "m", "date": "2026-11-25"}"#;
    std::fs::write(folder.path().join("peers.json"), format!("{{\"points\": [{point}]}}")).unwrap();
    let experiment = Experiment::read(&path).unwrap();
    let recorded = serde_json::to_string(&experiment).unwrap();
    assert_eq!(experiment.peers.as_ref().map(|peers| peers.points.len()), Some(1));
    assert!(recorded.contains("\"rmse\":0.5"), "{recorded}");
    assert_eq!(identities(&plan(&experiment, &Toy::new()).unwrap()), identities(&small(&Toy::new())));
}
