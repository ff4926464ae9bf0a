//! What a run leaves: rows in order, the same bytes after any interruption, failures that stay alone.

use super::*;

#[test]
fn rows_are_in_plan_order_and_complete() {
    let (folder, _) = undisturbed();
    let plan = small(&Toy::new());
    let rows = rows(folder.path());
    assert!(rows.iter().map(Row::id).eq(plan.items.iter().map(|item| item.id.as_str())));
    assert!(rows.iter().map(Row::kind).eq(plan.items.iter().map(|item| item.kind())));
    for row in &rows {
        match row {
            Row::Ensemble(row) => {
                let is_random = row.sampler != "grid:none";
                assert_eq!(row.replicates, if is_random { 3 } else { 1 });
                assert_eq!(row.variance.is_some(), is_random, "nothing random has no variance");
            }
            Row::Reference(row) => {
                assert_eq!(row.noise_mse == 0.0, row.scene == "exact");
                assert_eq!(row.focal_depth, (row.scene == "ramp").then_some(4.5), "what auto focus found is recorded");
            }
            Row::Image(row) if row.sampler == "fresh:step" => assert_eq!(row.names, ["fresh:sheet", "fresh:best"]),
            Row::Image(_) | Row::Points(_) | Row::Prediction(_) => {}
        }
    }
    let about = results::read_about(&results::about_path(folder.path())).unwrap();
    assert_eq!((about.experiment.name.as_str(), about.scenes.len()), ("small", 2));
    assert_eq!(about.command, "sampler-lab run small.json");
}

/// The toy's noise is uniform on an interval of width 1/√n: its variance is 1/(12n) for n samples taken.
///
/// 60 or 48 channels × 3 replicates give a relative standard error of the variance near √(0.8/120) = 8 %, that of 300 degrees
/// of freedom: above a bar of 60 % with probability e^(−150 (0.6 − ln 1.6)) = 3e-9 (Chernoff), 3e-8 for 8 ensembles.
/// A channel left out or counted twice is beyond it. False alarms: 3e-8.
#[test]
fn errors_are_those_of_the_images() {
    let (folder, _) = undisturbed();
    for row in rows(folder.path()) {
        let Row::Ensemble(row) = row else { continue };
        let Some(variance) = row.variance else { continue };
        let exact = 1.0 / (12.0 * f64::from(row.spp.taken));
        assert!((variance.value / exact - 1.0).abs() < 0.6, "{} {}: {variance:?}", row.sampler, row.spp.asked);
        assert!((row.mse.value - row.bias2.value - variance.value * 2.0 / 3.0).abs() < 0.5 * exact, "{row:?}");
    }
}

#[test]
fn a_second_run_does_nothing_and_changes_nothing() {
    let (folder, before) = undisturbed();
    let toy = Toy::new();
    let timings = std::fs::read(results::timings_path(folder.path())).unwrap();
    let outcome = run(&small(&toy), &toy, folder.path());
    assert_eq!((outcome.done, outcome.found, toy.renders()), (0, outcome.items, 0));
    assert_same(&bytes(folder.path()), &before, "");
    assert_eq!(std::fs::read(results::timings_path(folder.path())).unwrap(), timings);
}

#[test]
fn a_run_killed_after_any_number_of_items_goes_on_to_the_same_bytes() {
    let (_keep, expected) = undisturbed();
    let items = small(&Toy::new()).items.len();
    for step in [1, 7, items - 1] {
        let folder = tempfile::tempdir().unwrap();
        let toy = Toy::new();
        let plan = small(&toy);
        let mut runs = 0;
        loop {
            runs += 1;
            let options = Options { at_most: Some(step), ..options() };
            let outcome = execute(&plan, &toy, folder.path(), &Silent, &options).unwrap();
            assert_eq!(outcome.check().is_err(), outcome.interrupted);
            if !outcome.interrupted {
                break;
            }
        }
        assert_eq!(runs, items.div_ceil(step), "{step}");
        assert_same(&bytes(folder.path()), &expected, format!("{step} items at a time"));
        let distinct: HashSet<_> = toy.rendered.borrow().iter().cloned().collect();
        assert_eq!(distinct.len(), toy.renders(), "an image was rendered twice");
    }
}

#[test]
fn rows_cut_at_any_byte_are_done_again_to_the_same_bytes() {
    let (folder, expected) = undisturbed();
    let path = results::results_path(folder.path());
    let whole = std::fs::read(&path).unwrap();
    let toy = Toy::new();
    let plan = small(&toy);
    // 60 places spread over the file, the ends among them, and each side of one line's end.
    let line_end = whole.iter().position(|&byte| byte == b'\n').unwrap();
    let places = (0..60u64).map(|i| (mix(i) % whole.len() as u64) as usize);
    for end in places.chain([0, 1, line_end, line_end + 1, line_end + 2, whole.len() - 1]) {
        std::fs::write(&path, &whole[..end]).unwrap();
        run(&plan, &toy, folder.path()).check().unwrap();
        assert_same(&bytes(folder.path()), &expected, format!("cut at {end}"));
    }
    assert_eq!(toy.renders(), 0, "the images were there");
}

#[test]
fn timings_cut_at_any_byte_are_taken_again() {
    let (folder, expected) = undisturbed();
    let path = results::timings_path(folder.path());
    let whole = std::fs::read(&path).unwrap();
    let plan = small(&Toy::new());
    for end in [0, 10, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..end]).unwrap();
        std::fs::write(results::results_path(folder.path()), "").unwrap();
        run(&plan, &Toy::new(), folder.path()).check().unwrap();
        assert_same(&bytes(folder.path()), &expected, format!("cut at {end}"));
        let images = plan.items.iter().filter(|item| item.kept_image().is_some()).count();
        assert_eq!(results::read_timings(&path).unwrap().len(), images, "every image has its seconds");
    }
}

#[test]
fn a_broken_line_inside_the_rows_is_an_error_with_its_number() {
    let (folder, _) = undisturbed();
    let path = results::results_path(folder.path());
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replacen("\"schema\":1", "\"schema\":", 2)).unwrap();
    let toy = Toy::new();
    let error = execute(&small(&toy), &toy, folder.path(), &Silent, &options()).unwrap_err();
    assert!(error.exit_code() == 2 && error.place.ends_with("results.jsonl:1"), "{error}");
}

#[test]
fn the_thread_count_is_nowhere_in_the_results() {
    let (_keep, expected) = undisturbed();
    for threads in [1, 7] {
        let folder = tempfile::tempdir().unwrap();
        let toy = Toy::new();
        let options = Options { threads, ..options() };
        execute(&small(&toy), &toy, folder.path(), &Silent, &options).unwrap().check().unwrap();
        assert_same(&bytes(folder.path()), &expected, format!("{threads} threads"));
        let timings = results::read_timings(&results::timings_path(folder.path())).unwrap();
        assert!(timings.iter().all(|timing| timing.threads == threads));
    }
}

#[test]
fn an_experiment_that_grows_keeps_what_it_has_and_shrinks_back_to_the_same_bytes() {
    let (folder, expected) = undisturbed();
    let toy = Toy::new();
    let more = edited("\"samplers\": [", "\"samplers\": [\"net\", ");
    run(&plan(&more, &toy).unwrap(), &toy, folder.path()).check().unwrap();
    assert!(toy.rendered.borrow().iter().all(|(_, sampler, ..)| sampler == "net:owen"), "only the new sampler ran");
    let toy = Toy::new();
    run(&small(&toy), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0);
    let after = bytes(folder.path());
    assert!(expected.iter().all(|(name, bytes)| after.get(name) == Some(bytes)));
}

#[test]
fn an_alias_that_goes_leaves_the_names_of_the_rows() {
    let (folder, _) = undisturbed();
    let toy = Toy::new();
    let fewer = edited(", \"fresh:best\"]", "]");
    run(&plan(&fewer, &toy).unwrap(), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0);
    let named =
        |row: &Row| matches!(row, Row::Points(row) if row.sampler == "fresh:step" && row.names == ["fresh:sheet"]);
    assert!(rows(folder.path()).iter().any(named));
}

#[test]
fn a_fresh_run_does_everything_again_and_leaves_other_files_alone() {
    let (folder, mut expected) = undisturbed();
    std::fs::write(folder.path().join("notes.txt"), "mine").unwrap();
    expected.insert("notes.txt".to_owned(), b"mine".to_vec());
    let toy = Toy::new();
    let plan = small(&toy);
    let options = Options { fresh: true, ..options() };
    let outcome = execute(&plan, &toy, folder.path(), &Silent, &options).unwrap();
    assert_eq!((outcome.found, outcome.done), (0, plan.items.len()));
    assert_same(&bytes(folder.path()), &expected, "");
}

#[test]
fn an_item_that_fails_fails_alone_and_is_tried_again() {
    let folder = tempfile::tempdir().unwrap();
    let toy = Toy { broken: Some(("strata:jitter", 4)), ..Toy::new() };
    let plan = small(&toy);
    let outcome = run(&plan, &toy, folder.path());
    // Two scenes × (3 replicates + their ensemble).
    assert_eq!((outcome.failures.len(), outcome.done), (8, plan.items.len() - 8));
    let error = outcome.check().unwrap_err();
    assert!(error.exit_code() == 4 && error.what.contains("pixel (1, 2), sample 3"), "{error}");
    assert_eq!(rows(folder.path()).len(), plan.items.len() - 8);
    let broken =
        toy.rendered.borrow().iter().filter(|(_, sampler, spp, _)| sampler == "strata:jitter" && *spp == 4).count();
    assert_eq!(broken, 6, "what failed is not tried again for its ensemble");
    let mended = Toy::new();
    run(&plan, &mended, folder.path()).check().unwrap();
    assert_eq!(mended.renders(), 6);
    assert_same(&bytes(folder.path()), &undisturbed().1, "");
}

#[test]
fn a_reference_that_fails_takes_down_what_is_compared_with_it_and_no_more() {
    let folder = tempfile::tempdir().unwrap();
    let toy = Toy { broken: Some(("truth:owen", 64)), ..Toy::new() };
    let outcome = run(&small(&toy), &toy, folder.path());
    let (mut scenes, mut kinds) = (HashSet::new(), HashSet::new());
    for row in rows(folder.path()) {
        kinds.insert(row.kind());
        if let Row::Ensemble(row) = row {
            scenes.insert(row.scene);
        }
    }
    assert_eq!(scenes, HashSet::from(["exact".to_owned()]));
    assert!(kinds.contains(&Kind::Picture) && kinds.contains(&Kind::Points));
    assert_eq!(outcome.check().unwrap_err().exit_code(), 4);
}

#[test]
fn a_stop_from_elsewhere_ends_after_the_item_at_hand() {
    let folder = tempfile::tempdir().unwrap();
    let toy = Toy::new();
    let stop = AtomicBool::new(false);

    /// Stops at the third item.
    struct StopAt<'a>(&'a AtomicBool, Cell<usize>);
    impl Progress for StopAt<'_> {
        fn item_started(&self, _: &str, _: &Tick) {
            self.1.set(self.1.get() + 1);
            self.0.store(self.1.get() == 3, Ordering::Relaxed);
        }
        fn item_ended(&self, _: &Tick) {}
        fn warn(&self, message: &str) {
            panic!("{message}");
        }
    }

    let options = Options { stop: Some(&stop), ..options() };
    let progress = StopAt(&stop, Cell::new(0));
    let outcome = execute(&small(&toy), &toy, folder.path(), &progress, &options).unwrap();
    assert!(outcome.interrupted);
    assert_eq!((outcome.done, rows(folder.path()).len()), (3, 3));
}

#[test]
fn a_folder_that_cannot_be_written_is_a_writing_error_and_nothing_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a-file");
    std::fs::write(&file, "mine").unwrap();
    let toy = Toy::new();
    for out in [file.clone(), file.join("below")] {
        let error = execute(&small(&toy), &toy, &out, &Silent, &options()).unwrap_err();
        assert_eq!(error.exit_code(), 3, "{error}");
    }
    assert_eq!((toy.renders(), std::fs::read(&file).unwrap()), (0, b"mine".to_vec()));
}

#[test]
fn two_runs_in_one_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();

    /// Starts another run from within a run.
    struct Again<'a>(&'a Path, Cell<usize>);
    impl Progress for Again<'_> {
        fn item_started(&self, _: &str, _: &Tick) {
            let toy = Toy::new();
            let error = execute(&small(&toy), &toy, self.0, &Silent, &options()).unwrap_err();
            assert!(error.what.contains("found one at work"), "{error}");
            self.1.set(self.1.get() + 1);
        }
        fn item_ended(&self, _: &Tick) {}
        fn warn(&self, _: &str) {}
    }

    let toy = Toy::new();
    let progress = Again(folder.path(), Cell::new(0));
    let options = Options { at_most: Some(2), ..options() };
    execute(&small(&toy), &toy, folder.path(), &progress, &options).unwrap();
    assert_eq!(progress.1.get(), 2);
}
