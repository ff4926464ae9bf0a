//! Gates: `METRIC (<|<=|>|>=) NUMBER`, joined by `and`.
//!
//! `METRIC.low` and `METRIC.high` are the ends of its 95 % interval, where there is one.

use serde::Serialize;

use super::{Comparison, Errors, Metric};
use crate::error::{Error, Result, did_you_mean};

/// A number of a metric that a gate looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Value,
    Low,
    High,
}

/// How it is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Relation {
    Less,
    AtMost,
    More,
    AtLeast,
}

impl Relation {
    const ALL: [(&'static str, Self); 4] =
        [("<", Self::Less), ("<=", Self::AtMost), (">", Self::More), (">=", Self::AtLeast)];

    /// False for NaN on either side.
    fn holds(self, value: f64, limit: f64) -> bool {
        match self {
            Self::Less => value < limit,
            Self::AtMost => value <= limit,
            Self::More => value > limit,
            Self::AtLeast => value >= limit,
        }
    }
}

/// One demand.
#[derive(Debug, Clone, PartialEq)]
struct Clause {
    metric: Metric,
    part: Part,
    relation: Relation,
    limit: f64,
    /// As it was written, with single spaces.
    text: String,
    /// The metric and part as written.
    name: String,
}

/// Demands that all have to hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Gate {
    clauses: Vec<Clause>,
    text: String,
}

/// What came out of a gate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GateResult {
    /// The gate as written.
    pub expression: String,
    /// Whether every demand holds for everything judged.
    pub passed: bool,
    /// A sentence for each that does not: demand, number found, and where.
    pub failures: Vec<String>,
}

/// Where gates come from, in messages.
const PLACE: &str = "--gate";

impl Gate {
    /// Reads a gate.
    ///
    /// # Errors
    /// Kind `Input` that names the character, what was expected there and what was found.
    pub fn parse(text: &str) -> Result<Self> {
        let mut words = Words { words: words(text), end: text.chars().count() + 1, next: 0 };
        let mut clauses = Vec::new();
        loop {
            clauses.push(words.clause()?);
            match words.take() {
                None => break,
                Some((_, "and")) => {}
                Some((at, other)) => return Err(expected(at, "\"and\" or the end", other)),
            }
        }
        Ok(Self { clauses, text: text.to_owned() })
    }

    /// Refuses demands on numbers that there will be none of.
    ///
    /// # Errors
    /// Kind `Input` where a metric needs a second reference or replicates, or an interval needs replicates.
    pub fn check(&self, has_two_references: bool, has_replicates: bool) -> Result<()> {
        for clause in &self.clauses {
            let refuse = |needs: &str| {
                let what = format!("expected {needs} with {}, found none", clause.name);
                Err(Error::input(PLACE, what))
            };
            if clause.metric.needs_two_references() && !has_two_references {
                return refuse("--reference2");
            }
            if (clause.metric.needs_replicates() || clause.part != Part::Value) && !has_replicates {
                return refuse("--replicates");
            }
        }
        Ok(())
    }

    /// Judges the replicates together where there are any, else each image.
    ///
    /// # Errors
    /// Kind `Input` where a number that is asked for does not exist, such as the root of a negative mean square.
    pub fn judge(&self, comparison: &Comparison) -> Result<GateResult> {
        let mut failures = Vec::new();
        match &comparison.replicates {
            Some(replicates) => {
                self.judge_one(&replicates.errors, &format!("the {} replicates", replicates.count), &mut failures)?;
            }
            None => {
                for image in &comparison.images {
                    self.judge_one(&image.errors, &image.file, &mut failures)?;
                }
            }
        }
        Ok(GateResult { expression: self.text.clone(), passed: failures.is_empty(), failures })
    }

    fn judge_one(&self, errors: &Errors, whose: &str, failures: &mut Vec<String>) -> Result<()> {
        for clause in &self.clauses {
            let found = errors.get(clause.metric).and_then(|estimate| match clause.part {
                Part::Value => Some(estimate.value),
                Part::Low => estimate.ci95.map(|[low, _]| low),
                Part::High => estimate.ci95.map(|[_, high]| high),
            });
            let Some(found) = found else {
                let why = match clause.metric {
                    Metric::RmseUnbiased => "; mse_unbiased is below 0 there, so gate on that",
                    Metric::MseTrimmed | Metric::RelMseTrimmed => "; no pixel is left there",
                    _ => "",
                };
                return Err(Error::input(
                    PLACE,
                    format!("expected a number for {}, found none of {whose}{why}", clause.name),
                ));
            };
            if !clause.relation.holds(found, clause.limit) {
                failures.push(format!("expected {}, found {found:.9e} of {whose}", clause.text));
            }
        }
        Ok(())
    }
}

/// An expression being read.
struct Words<'a> {
    /// Each with the number of its first character, from 1.
    words: Vec<(usize, &'a str)>,
    end: usize,
    next: usize,
}

impl<'a> Words<'a> {
    fn take(&mut self) -> Option<(usize, &'a str)> {
        self.next += 1;
        self.words.get(self.next - 1).copied()
    }

    /// The next word, or an error where the text ends.
    fn wanted(&mut self, what: &str) -> Result<(usize, &'a str)> {
        self.take().ok_or_else(|| expected(self.end, what, "the end"))
    }

    fn clause(&mut self) -> Result<Clause> {
        let (at, name) = self.wanted("a metric")?;
        let (metric, part) = metric(at, name)?;
        let (at, sign) = self.wanted("<, <=, > or >=")?;
        let relation = Relation::ALL.iter().find(|(text, _)| *text == sign);
        let relation = relation.ok_or_else(|| expected(at, "<, <=, > or >=", sign))?.1;
        let (at, number) = self.wanted("a number")?;
        let limit = number.parse::<f64>().ok().filter(|limit| limit.is_finite());
        let limit = limit.ok_or_else(|| expected(at, "a finite number", number))?;
        let text = format!("{name} {sign} {number}");
        Ok(Clause { metric, part, relation, limit, text, name: name.to_owned() })
    }
}

/// A metric's name, with `.low` or `.high` for an end of its interval.
fn metric(at: usize, text: &str) -> Result<(Metric, Part)> {
    let (name, part) = match text.split_once('.') {
        None => (text, Part::Value),
        Some((name, "low")) => (name, Part::Low),
        Some((name, "high")) => (name, Part::High),
        Some((name, end)) => return Err(expected(at + name.chars().count() + 1, "low or high after the point", end)),
    };
    let names = || Metric::ALL.into_iter().map(Metric::name);
    Metric::ALL.into_iter().find(|metric| metric.name() == name).map(|metric| (metric, part)).ok_or_else(|| {
        let all = names().collect::<Vec<_>>().join(", ");
        let mut error = expected(at, &format!("one of {all}"), name);
        if let Some(near) = did_you_mean(name, names()) {
            error.what += &format!("; did you mean \"{near}\"?");
        }
        error
    })
}

/// Words and signs of an expression: runs of `< > = ! & |`, and runs of anything else that is no space.
fn words(text: &str) -> Vec<(usize, &str)> {
    let kind = |c: char| {
        if c.is_whitespace() {
            0
        } else if "<>=!&|".contains(c) {
            1
        } else {
            2
        }
    };
    let mut words: Vec<(usize, &str)> = Vec::new();
    let mut start = None;
    let ends = text.char_indices().map(|(byte, c)| (byte, kind(c))).chain([(text.len(), 0)]);
    for (number, (byte, now)) in ends.enumerate() {
        match start {
            Some((_, _, before)) if before == now => {}
            _ => {
                if let Some((first, from, 1 | 2)) = start {
                    words.push((first, &text[from..byte]));
                }
                start = Some((number + 1, byte, now));
            }
        }
    }
    words
}

/// `at` is the number of the first character, from 1.
fn expected(at: usize, what: &str, found: &str) -> Error {
    let found = if found == "the end" { found.to_owned() } else { format!("\"{found}\"") };
    Error::input(PLACE, format!("at character {at}: expected {what}, found {found}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn refused(text: &str, parts: &[&str]) {
        let what = Gate::parse(text).unwrap_err().to_string();
        assert!(parts.iter().all(|part| what.contains(part)), "{text}: {what}");
    }

    #[test]
    fn a_gate_is_read_with_and_without_spaces() {
        let a = Gate::parse("rmse<0.1 and bias.high  >= -1e-3").unwrap();
        let b = Gate::parse(" rmse < 0.1 and bias.high >= -1e-3 ").unwrap();
        assert_eq!(a.clauses, b.clauses);
        let clause = &a.clauses[1];
        assert_eq!((clause.metric, clause.part, clause.relation), (Metric::Bias, Part::High, Relation::AtLeast));
        assert_eq!((clause.limit, clause.text.as_str()), (-1e-3, "bias.high >= -1e-3"));
        for metric in Metric::ALL {
            assert_eq!(Gate::parse(&format!("{} > 0", metric.name())).unwrap().clauses[0].metric, metric);
        }
    }

    #[test]
    fn a_gate_that_cannot_be_read_is_refused_at_its_place() {
        refused("", &["character 1: ", "a metric", "the end"]);
        refused("rmes < 0.1", &["character 1: ", "found \"rmes\"", "did you mean \"rmse\"?"]);
        refused("rmse = 0.1", &["character 6: ", "<, <=, > or >=", "\"=\""]);
        refused("rmse < ", &["character 8: ", "a number", "the end"]);
        refused("rmse < nan", &["character 8: ", "a finite number"]);
        refused("rmse < 1e999", &["a finite number"]);
        refused("rmse < 0.1 && mse < 1", &["character 12: ", "\"and\"", "\"&&\""]);
        refused("rmse < 0.1 and", &["character 15: ", "a metric"]);
        refused("rmse.mid < 1", &["character 6: ", "low or high"]);
        refused("é < 1", &["character 1: ", "\"é\""]);
        refused("0.1 > rmse", &["character 3: ", "low or high"]);
    }

    #[test]
    fn nothing_passes_with_a_number_that_is_none() {
        for (_, relation) in Relation::ALL {
            assert!(!relation.holds(f64::NAN, 1.0) && !relation.holds(1.0, f64::NAN));
            assert_eq!(relation.holds(1.0, 1.0), matches!(relation, Relation::AtMost | Relation::AtLeast));
        }
    }
}
