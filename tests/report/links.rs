//! Every link, figure and number resolves.

use super::*;

/// The anchor of a heading as GitHub makes it, written anew from its rule: lower case; letters, digits, `_`, `-` and
/// spaces stay, spaces become hyphens.
fn github_anchor(heading: &str) -> String {
    let lower = heading.to_lowercase();
    lower
        .chars()
        .filter(|c| c.is_alphabetic() || c.is_ascii_digit() || ['_', '-', ' '].contains(c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

/// All targets of `](…)` in a page, code blocks left out.
fn link_targets(page: &str) -> Vec<&str> {
    let prose = page.split("```").step_by(2);
    prose.flat_map(|part| part.split("](").skip(1)).filter_map(|rest| rest.split(')').next()).collect()
}

/// Checks a written report: every link has its heading, figure, table or file, and figures and tables count from 1.
pub fn check_links(report: &Path) {
    let page = std::fs::read_to_string(report).unwrap();
    let mut anchors: Vec<String> = Vec::new();
    let mut times: std::collections::HashMap<String, usize> = std::collections::HashMap::new();
    for line in page.lines() {
        if line.starts_with('#') {
            let plain = github_anchor(line.trim_start_matches('#').trim());
            let before = times.entry(plain.clone()).or_default();
            anchors.push(if *before == 0 { plain } else { format!("{plain}-{before}") });
            *before += 1;
        }
        anchors.extend(line.split("<a id=\"").skip(1).filter_map(|rest| rest.split('"').next()).map(str::to_owned));
    }
    let unique: std::collections::HashSet<&String> = anchors.iter().collect();
    assert_eq!(unique.len(), anchors.len(), "{anchors:?}");
    let mut count = 0;
    for target in link_targets(&page) {
        count += 1;
        match target.strip_prefix('#') {
            Some(anchor) => assert!(anchors.iter().any(|known| known == anchor), "no place for #{anchor}"),
            None if target.contains("://") => {}
            None => assert!(report.parent().unwrap().join(target).is_file(), "no file {target}"),
        }
    }
    assert!(count > 30, "{count}");
    for sort in ["figure", "table"] {
        let has_number = |a: &&String| a.strip_prefix(&format!("{sort}-")).is_some_and(|n| n.parse::<usize>().is_ok());
        let found: Vec<&String> = anchors.iter().filter(has_number).collect();
        let wanted: Vec<String> = (1..=found.len()).map(|n| format!("{sort}-{n}")).collect();
        assert!(!wanted.is_empty() && found.into_iter().eq(&wanted), "{anchors:?}");
    }
    assert!(!page.contains(['\u{E000}', '\u{E001}']), "a reference was left open");
}

#[test]
fn every_link_image_and_number_of_a_report_resolves() {
    let folder = folder();
    check_links(&write(folder.path()).unwrap().report);
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("reports")).unwrap() {
        check_links(&entry.unwrap().path().join("report.md"));
    }
}

#[test]
fn every_heading_of_a_report_is_in_its_table_of_contents() {
    let page = text(&summary(&rows()), &Figures::default());
    let heading = |line: &&str| line.starts_with("## ") || line.starts_with("### ");
    let headings: Vec<&str> = page.lines().filter(heading).map(|line| line.trim_start_matches(['#', ' '])).collect();
    let (_, after) = page.split_once("**Contents**\n\n").unwrap();
    let (list, _) = after.split_once("\n\n").unwrap();
    let listed = list.lines().filter_map(|line| line.trim_start().strip_prefix("- [")?.split("](#").next());
    assert!(listed.eq(headings), "{list}");
}
