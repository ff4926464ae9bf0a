//! Images that are there, torn, missing or wrong.

use super::*;

#[test]
fn a_new_reference_is_compared_with_the_images_that_are_there() {
    let (folder, _) = undisturbed();
    let toy = Toy::new();
    let better = edited("\"spp\": 64", "\"spp\": 256");
    run(&plan(&better, &toy).unwrap(), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 2, "the two halves of the one reference that is rendered");
    let fresh = tempfile::tempdir().unwrap();
    run(&plan(&better, &toy).unwrap(), &toy, fresh.path()).check().unwrap();
    assert_eq!(
        std::fs::read(results::results_path(folder.path())).unwrap(),
        std::fs::read(results::results_path(fresh.path())).unwrap()
    );
}

#[test]
fn raised_metrics_measure_again_without_rendering() {
    let (folder, _) = undisturbed();
    let base = Toy::new();
    let toy = Toy { numbers: Algorithms { metrics: 2, ..base.numbers }, ..Toy::new() };
    run(&small(&toy), &toy, folder.path()).check().unwrap();
    assert_eq!(toy.renders(), 0);
    let number = |row: &Row| match row {
        Row::Image(row) => row.errors.as_ref().map(|errors| errors.metrics_algorithm),
        Row::Reference(row) => Some(row.metrics_algorithm),
        Row::Ensemble(row) => Some(row.metrics_algorithm),
        Row::Points(row) => Some(row.metrics_algorithm),
        Row::Prediction(_) => None,
    };
    assert!(rows(folder.path()).iter().filter_map(number).all(|number| number == 2));
}

/// Takes the images of some kinds away, or spoils them.
fn spoil(out: &Path, plan: &Plan, kinds: &[Kind], spoil: impl Fn(&Path)) {
    for item in plan.items.iter().filter(|item| kinds.contains(&item.kind()) && item.kept_image().is_some()) {
        spoil(&results::image_path(out, &item.id));
    }
}

#[test]
fn a_torn_or_missing_image_is_made_again_when_a_row_needs_it() {
    let (folder, expected) = undisturbed();
    let plan = small(&Toy::new());
    let all = [Kind::Render, Kind::ReferenceHalf, Kind::Reference, Kind::Picture, Kind::Stage];
    let remove: fn(&Path) = |path| std::fs::remove_file(path).unwrap();
    let tear: fn(&Path) = |path| {
        let bytes = std::fs::read(path).unwrap();
        std::fs::write(path, &bytes[..bytes.len() - 9]).unwrap();
    };
    for damage in [remove, tear] {
        spoil(folder.path(), &plan, &all, damage);
        // Without rows everything is needed; with all but the last rows little is.
        std::fs::write(results::results_path(folder.path()), "").unwrap();
        run(&plan, &Toy::new(), folder.path()).check().unwrap();
        assert_same(&bytes(folder.path()), &expected, "");
    }
}

#[test]
fn what_a_report_shows_is_made_again_where_only_rows_were_kept() {
    let (folder, expected) = undisturbed();
    let toy = Toy::new();
    let plan = small(&toy);
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    run(&plan, &toy, folder.path()).check().unwrap();
    // Three pictures, four stages and the two halves of the pictures' reference; no replicate.
    assert_eq!(toy.renders(), 3 + 4 + 2);
    let after = bytes(folder.path());
    assert_eq!(after["results.jsonl"], expected["results.jsonl"]);
    assert!(after.iter().all(|(name, bytes)| expected.get(name) == Some(bytes)));
}

#[test]
fn code_that_changed_its_bits_under_an_old_number_is_caught() {
    let (folder, _) = undisturbed();
    let toy = Toy::new();
    toy.drift.set(1e-3);
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    let outcome = run(&small(&toy), &toy, folder.path());
    let error = outcome.check().unwrap_err();
    assert!(error.exit_code() == 4 && error.what.contains("kept its algorithm number"), "{error}");
    let fresh = Options { fresh: true, ..options() };
    execute(&small(&toy), &toy, folder.path(), &Silent, &fresh).unwrap().check().unwrap();
}
