//! What is left to do and what it takes; parts of a run, and the words on them.

use super::*;

#[test]
fn a_survey_counts_what_is_left_and_changes_nothing() {
    let toy = Toy::new();
    let plan = small(&toy);
    let folder = tempfile::tempdir().unwrap();
    let survey = |out: &Path| Survey::new(&plan, &Standing::read(&plan, out).unwrap(), out, 2);
    let before = survey(folder.path());
    // Statistics: 3 + 1 replicates take what is asked, strata 2 for 1; ramp 5×4, exact 4×4. Reference 2 × 64 on ramp.
    let statistics = (20 + 16) * (4 * (1 + 4) + 3 * (2 + 4)) + 20 * 2 * 64;
    let pictures = 32 * (2 * 16 + 3 * 2 + 1 + 3 * 3);
    assert_eq!(before.samples, statistics + pictures);
    assert_eq!(before.samples_left, before.samples);
    assert!(!before.is_rate_measured && before.seconds_left > 0.0);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let options = Options { at_most: Some(30), ..options() };
    execute(&plan, &toy, folder.path(), &Silent, &options).unwrap();
    let during = survey(folder.path());
    assert!(during.is_rate_measured && during.samples_left < before.samples_left);
    let half = plan.items.iter().find(|item| item.kind() == Kind::ReferenceHalf).unwrap();
    std::fs::remove_file(results::image_path(folder.path(), &half.id)).unwrap();
    assert_eq!(survey(folder.path()).samples_left, during.samples_left + half.samples(), "needed by items left");
    run(&plan, &toy, folder.path()).check().unwrap();
    let after = survey(folder.path());
    assert_eq!((after.samples_left, after.seconds_left), (0, 0.0));
    assert!(after.to_string().contains("stage                4 items, 0 to do"), "{after}");
}

#[test]
fn more_memory_or_disk_than_allowed_is_refused_before_work_starts() {
    let toy = Toy::new();
    let plan = small(&toy);
    let folder = tempfile::tempdir().unwrap();
    let survey = Survey::new(&plan, &Standing::read(&plan, folder.path()).unwrap(), folder.path(), 1);
    let enough = Limits { memory_bytes: survey.memory_bytes, disk_bytes: survey.disk_bytes };
    for (limits, what) in [
        (Limits { memory_bytes: enough.memory_bytes - 1, ..enough }, "of memory"),
        (Limits { disk_bytes: enough.disk_bytes - 1, ..enough }, "of disk"),
    ] {
        let error = execute(&plan, &toy, folder.path(), &Silent, &Options { limits, ..options() }).unwrap_err();
        assert!(error.exit_code() == 2 && error.what.contains(what), "{error}");
    }
    assert_eq!(toy.renders(), 0);
    execute(&plan, &toy, folder.path(), &Silent, &Options { limits: enough, ..options() }).unwrap();
    let on_disk: usize = bytes(folder.path()).values().map(Vec::len).sum();
    assert!((on_disk as u64) < survey.disk_bytes, "{on_disk} bytes, {} foreseen", survey.disk_bytes);
}

#[test]
fn a_picture_stands_with_what_is_shown() {
    let plan = small(&Toy::new());
    let (folder, _) = undisturbed();
    let standing = Standing::read(&plan, folder.path()).unwrap();
    assert!(standing.states.iter().all(|&state| state == State::Done));
    let shown: Vec<Kind> = plan.items.iter().filter(|item| item.is_shown).map(|item| item.kind()).collect();
    assert_eq!(shown.len(), 2 + 1 + 3 + 4);
    let stages = plan.items.iter().filter_map(|item| match &item.work {
        Work::Image(work) if work.kind == Kind::Stage => Some((work.stage, work.spp.asked)),
        _ => None,
    });
    let expected = [(Stage::Start, 1), (Stage::Aa, 3), (Stage::Dof, 3), (Stage::Final, 3)];
    assert!(stages.eq(expected));
}

#[test]
fn shards_are_contiguous_cover_the_plan_and_keep_together_what_belongs_together() {
    let plan = small(&Toy::new());
    for count in 1..=plan.items.len() as u32 + 3 {
        let blocks = blocks(&plan, count);
        assert_eq!(blocks.len(), count as usize);
        let mut next = 0;
        for (block, index) in blocks.iter().zip(1..) {
            assert_eq!(*block, Shard { index, count }.positions(&plan));
            assert_eq!(block.start, next, "{count}");
            next = block.end;
            for position in block.clone() {
                let own_images: Vec<&str> = match &plan.items[position].work {
                    Work::Ensemble(work) => work.members.iter().map(String::as_str).collect(),
                    Work::Reference(_) => plan.reference_images(&plan.items[position].id).to_vec(),
                    _ => Vec::new(),
                };
                assert!(own_images.iter().all(|id| block.contains(&plan.position(id).unwrap())), "{count}");
            }
        }
        assert_eq!(next, plan.items.len());
    }
    // 64 spp of reference halves are nearly all of the work: no cut can be even, but none goes through them.
    let samples =
        |block: &std::ops::Range<usize>| plan.items[block.clone()].iter().map(|item| item.samples()).sum::<u64>();
    let total = samples(&(0..plan.items.len()));
    assert!(blocks(&plan, 2).iter().all(|block| samples(block) < total));
}

/// Rows of shards by chance in 1 to 7 parts, joined in a random order, some twice; a part that is not there is named.
#[test]
fn any_shards_in_any_order_merge_to_the_same_bytes_and_a_lacking_one_is_named() {
    let (_keep, expected) = undisturbed();
    let toy = Toy::new();
    let plan = small(&toy);
    for count in [1, 2, 5, 7] {
        let folder = tempfile::tempdir().unwrap();
        let mut parts: Vec<std::path::PathBuf> = Vec::new();
        for index in 1..=count {
            let out = folder.path().join(format!("{index}"));
            let options = Options { shard: Some(Shard { index, count }), ..options() };
            execute(&plan, &toy, &out, &Silent, &options).unwrap().check().unwrap();
            parts.push(out);
        }
        let key = |part: &Path| mix(part.file_name().unwrap().to_str().unwrap().parse::<u64>().unwrap());
        parts.sort_by_key(|part| key(part));
        parts.push(parts[0].clone());
        let out = folder.path().join("all");
        if count > 1 {
            let lacking: u32 = parts[1].file_name().unwrap().to_str().unwrap().parse().unwrap();
            let some: Vec<_> = parts.iter().filter(|part| **part != parts[1]).cloned().collect();
            let merged = Sources::open(&some, &out).unwrap().merge(&plan).unwrap();
            let missing = Shard { index: lacking, count };
            let owns = !missing.positions(&plan).is_empty();
            assert_eq!(merged.status.missing_shards, if owns { vec![missing] } else { Vec::new() });
            assert_eq!(merged.status.check("x").is_err(), owns);
            assert!(merged.status.missing.iter().all(|missing| missing.reason == Reason::Never));
        }
        let merged = Sources::open(&parts, &out).unwrap().merge(&plan).unwrap();
        assert_eq!((merged.status.check("x"), merged.status.missing.len()), (Ok(()), 0));
        drop(merged);
        let found = bytes(&out);
        // Images of replicates stay where they were made: nothing shows them.
        assert!(found.iter().all(|(name, bytes)| expected.get(name) == Some(bytes)), "{count}");
        let shown = plan.items.iter().filter(|item| item.is_shown && item.kept_image().is_some()).count();
        assert_eq!(
            found.keys().filter(|name| name.ends_with(".exr") && !name.starts_with("reference-")).count(),
            shown
        );
        assert_eq!(run(&plan, &toy, &out).done, 0);
    }
}

#[test]
fn status_tells_a_changed_scene_from_a_raised_number_and_rows_come_back_with_it() {
    let (folder, before) = undisturbed();
    let base = Toy::new();
    let reasons = |toy: &Toy| -> Vec<String> {
        let status = Status::read(&small(toy), folder.path()).unwrap();
        status.missing.iter().map(|missing| format!("{}: {}", missing.reason.name(), missing.reason)).collect()
    };
    assert_eq!(reasons(&base), Vec::<String>::new());
    let with = |numbers| Toy { numbers, ..Toy::new() };
    let numbers = base.numbers;
    for (toy, expected) in [
        (Toy { content: "edited", ..Toy::new() }, "scene changed: the scene ramp changed, ramp → rampedited"),
        (
            with(Algorithms { renderer: 2, ..numbers }),
            "algorithm changed: the algorithm number of the renderer changed, 1 → 2",
        ),
        (
            with(Algorithms { sampler: 3, ..numbers }),
            "algorithm changed: the algorithm number of the sampler changed, 1 → 3",
        ),
        (
            with(Algorithms { exact: 2, ..numbers }),
            "algorithm changed: the algorithm number of the closed form changed, 1 → 2",
        ),
        (
            with(Algorithms { metrics: 2, ..numbers }),
            "algorithm changed: the algorithm number of the metrics changed, 1 → 2",
        ),
    ] {
        assert!(reasons(&toy).contains(&expected.to_owned()), "{expected}: {:?}", reasons(&toy));
        run(&small(&toy), &toy, folder.path()).check().unwrap();
        assert_eq!(reasons(&toy), Vec::<String>::new());
        assert!(reasons(&base).iter().any(|reason| reason.starts_with("put aside: ")), "{expected}");
        let again = Toy::new();
        run(&small(&again), &again, folder.path()).check().unwrap();
        assert_eq!(again.renders(), 0, "{expected}");
        let after = bytes(folder.path());
        assert!(before.iter().all(|(name, bytes)| after.get(name) == Some(bytes)), "{expected}");
    }
    // Rows of a version that did not say what they were made with.
    let text = std::fs::read_to_string(results::results_path(folder.path())).unwrap();
    let silent: String =
        text.lines().map(|line| format!("{}\n", without_made_with(line).replace("\"id\":\"", "\"id\":\"0"))).collect();
    std::fs::write(results::results_path(folder.path()), silent).unwrap();
    std::fs::remove_file(folder.path().join("superseded.jsonl")).unwrap();
    assert_eq!(reasons(&base), ["stale: made by an earlier version, which did not say with what"]);
    // Those that fit are as good as ever, and say it from the next run on.
    let silent: String = text.lines().map(|line| without_made_with(line) + "\n").collect();
    std::fs::write(results::results_path(folder.path()), silent).unwrap();
    let toy = Toy::new();
    run(&small(&toy), &toy, folder.path()).check().unwrap();
    assert_eq!((toy.renders(), std::fs::read_to_string(results::results_path(folder.path())).unwrap()), (0, text));

    fn without_made_with(line: &str) -> String {
        let start = line.find(",\"made_with\":{").unwrap();
        let end = start + line[start..].find('}').unwrap() + 1;
        format!("{}{}", &line[..start], &line[end..])
    }
}
