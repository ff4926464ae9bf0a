//! All cases by name.

use std::rc::Rc;

use super::lab::Lab;
use super::timing::Case;
use super::{growth, memory, rays, renders, samplers, work};
use crate::error::{Error, Result, did_you_mean};

/// One group: its name, its share of the budget, what it measures, its cases.
pub struct Group {
    /// First part of its cases' names.
    pub name: &'static str,
    /// Seconds of a budget of about 90.
    pub share: f64,
    /// What it measures.
    pub about: &'static str,
    /// Its cases.
    pub cases: fn(&Rc<Lab>) -> Vec<Case>,
}

/// All groups, in the order in which they run: memory first, while nothing else has taken any.
pub const GROUPS: [Group; 8] = [
    Group { name: "memory", share: 8.0, about: "bytes stated and taken by the large scene", cases: memory::cases },
    Group { name: "sampler", share: 12.0, about: "ns a sample, in spans of 16 and one by one", cases: samplers::cases },
    Group { name: "rays", share: 16.0, about: "rays a second by kind, kernel and scene", cases: rays::cases },
    Group { name: "render", share: 18.0, about: "samples a second, and the error they leave", cases: renders::cases },
    Group { name: "build", share: 10.0, about: "seconds that trees over triangles take", cases: work::build_cases },
    Group { name: "load", share: 6.0, about: "seconds to read a scene, beside tobj's alone", cases: work::load_cases },
    Group { name: "metric", share: 8.0, about: "seconds that discrepancies take", cases: work::metric_cases },
    Group {
        name: "growth",
        share: 14.0,
        about: "seconds by size, and the power by which they grow",
        cases: growth::cases,
    },
];

/// Names of all cases, in order.
pub fn names(lab: &Rc<Lab>) -> Vec<String> {
    GROUPS.iter().flat_map(|group| (group.cases)(lab)).map(|case| case.name).collect()
}

/// The cases that have one of `words` in their name, group by group with its share; all of them for no words.
///
/// # Errors
/// Kind `Input` for a word that no name has, with the nearest part of one.
pub fn select(lab: &Rc<Lab>, words: &[String]) -> Result<Vec<(f64, Vec<Case>)>> {
    let names = names(lab);
    for word in words {
        if !names.iter().any(|name| name.contains(word.as_str())) {
            let parts = names.iter().flat_map(|name| name.split('/').chain([name.as_str()]));
            let hint = did_you_mean(word, parts).map_or(String::new(), |near| format!("; did you mean \"{near}\"?"));
            let what = format!("expected (part of) a name that bench --list shows, found \"{word}\"{hint}");
            return Err(Error::input("bench", what));
        }
    }
    let wanted = |case: &Case| words.is_empty() || words.iter().any(|word| case.name.contains(word.as_str()));
    let group = |group: &Group| (group.share, (group.cases)(lab).into_iter().filter(wanted).collect::<Vec<_>>());
    Ok(GROUPS.iter().map(group).filter(|(_, cases)| !cases.is_empty()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_begin_with_their_group() {
        let lab = Rc::new(Lab::default());
        let mut all = names(&lab);
        for group in &GROUPS {
            assert!((group.cases)(&lab).iter().all(|case| case.name.starts_with(&format!("{}/", group.name))));
        }
        let count = all.len();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), count);
    }

    #[test]
    fn parts_of_names_select_and_others_are_refused_with_the_nearest() {
        let lab = Rc::new(Lab::default());
        let chosen = select(&lab, &["rays/landscape-200k".into()]).unwrap();
        assert!(chosen.len() == 1 && chosen[0].1.iter().all(|c| c.name.contains("200k")));
        assert_eq!(select(&lab, &[]).unwrap().len(), GROUPS.len());
        let error = select(&lab, &["samplr".into()]).err().unwrap().to_string();
        assert!(error.ends_with("did you mean \"sampler\"?"), "{error}");
    }
}
