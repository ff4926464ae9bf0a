//! Checks by name, by group, by row of the failure catalogue.

use crate::error::{Error, Result, did_you_mean};

use super::{Check, all};

/// Rows of the failure catalogue, docs/failures.md.
pub const FAILURES: u8 = 65;

/// The checks that `names` ask for, in the order of the registry, each once; all of them where nothing is asked for.
///
/// A name is a check's, a group's (`failures` means all groups that begin with `failures:`) or the number of a row of the
/// failure catalogue, `12` or `#12`.
///
/// # Errors
/// Kind `Input` for a name that is none of these, with the nearest one, and for a row that no check shows.
pub fn select(names: &[String]) -> Result<Vec<Check>> {
    let checks = all();
    let mut wanted = vec![names.is_empty(); checks.len()];
    for name in names {
        let fits: Vec<bool> = match name.trim_start_matches('#').parse::<u32>() {
            Ok(row) => {
                if !(1..=u32::from(FAILURES)).contains(&row) {
                    return Err(Error::input(
                        name,
                        format!("expected a row of the failure catalogue, 1 to {FAILURES}"),
                    ));
                }
                checks.iter().map(|c| c.failures.iter().any(|&f| u32::from(f) == row)).collect()
            }
            Err(_) => checks.iter().map(|c| c.name == name || is_group(c.group, name)).collect(),
        };
        if !fits.contains(&true) {
            return Err(unknown(name, &checks));
        }
        wanted.iter_mut().zip(fits).for_each(|(wanted, fits)| *wanted |= fits);
    }
    Ok(checks.into_iter().zip(wanted).filter(|(_, wanted)| *wanted).map(|(check, _)| check).collect())
}

/// Does `name` mean this group, by its whole name or by the word before its colon?
fn is_group(group: &str, name: &str) -> bool {
    group == name || group.split_once(':').is_some_and(|(word, _)| word == name)
}

fn unknown(name: &str, checks: &[Check]) -> Error {
    if name.starts_with('#') || name.parse::<u32>().is_ok() {
        return Error::input(name, "expected a row of the failure catalogue that a check shows, found none that does");
    }
    let known = checks.iter().flat_map(|c| [c.name, c.group]);
    let hint = did_you_mean(name, known).map_or(String::new(), |near| format!("; did you mean \"{near}\"?"));
    Error::input(
        "check",
        format!(
            "expected a check, a group, a row of the failure catalogue or a scene file, found \"{name}\"{hint} (check --list names them all)"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(asked: &[&str]) -> Result<Vec<&'static str>> {
        let asked: Vec<String> = asked.iter().map(|&s| s.to_owned()).collect();
        Ok(select(&asked)?.iter().map(|c| c.name).collect())
    }

    #[test]
    fn checks_are_found_by_name_group_and_failure_in_the_registry_s_order() {
        assert_eq!(names(&[]).unwrap().len(), all().len());
        assert_eq!(names(&["quick-nets", "disk-moments", "quick-nets"]).unwrap(), ["disk-moments", "quick-nets"]);
        let quick = names(&["quick"]).unwrap();
        assert!(quick.len() > 5 && quick.iter().all(|n| n.starts_with("quick-")));
        for row in ["54", "#54"] {
            assert!(names(&[row]).unwrap().contains(&"disk-moments"));
        }
        assert!(is_group("failures: lights", "failures") && is_group("failures: lights", "failures: lights"));
        assert!(!is_group("failures: lights", "lights"));
    }

    #[test]
    fn a_strange_name_is_refused_with_the_nearest_one() {
        for (asked, part) in [
            ("quick-net", "did you mean \"quick-nets\"?"),
            ("qick", "did you mean \"quick\"?"),
            ("0", "1 to 65"),
            ("#66", "1 to 65"),
            ("a b c", "check --list"),
        ] {
            let error = names(&[asked]).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(part), "{error}");
        }
    }
}
