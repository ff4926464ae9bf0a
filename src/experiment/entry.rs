//! One entry of an experiment's list of samplers: a text, or a name and a sampler for each decision.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::sampling::Decision;
use crate::scene::json::{Item, Value};

/// The decisions as keys of experiment files, in the order of [`Decision::ALL`].
const KEYS: [&str; 4] = ["pixel", "lens", "light_pick", "light"];

/// A sampler of an experiment, as written.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub enum SamplerEntry {
    /// A text; reports call it by that text.
    Text(String),
    /// A name, and the text of a sampler for each decision in the order of [`Decision::ALL`].
    Set {
        /// What reports call it.
        name: String,
        /// Pixel, lens, light pick, light point.
        by_decision: [String; 4],
    },
}

/// The same as JSON.
#[derive(Clone, Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Text(String),
    Set { name: String, pixel: String, lens: String, light_pick: String, light: String },
}

impl From<Written> for SamplerEntry {
    fn from(written: Written) -> Self {
        match written {
            Written::Text(text) => Self::Text(text),
            Written::Set { name, pixel, lens, light_pick, light } => {
                Self::Set { name, by_decision: [pixel, lens, light_pick, light] }
            }
        }
    }
}

impl From<SamplerEntry> for Written {
    fn from(entry: SamplerEntry) -> Self {
        match entry {
            SamplerEntry::Text(text) => Self::Text(text),
            SamplerEntry::Set { name, by_decision: [pixel, lens, light_pick, light] } => {
                Self::Set { name, pixel, lens, light_pick, light }
            }
        }
    }
}

impl SamplerEntry {
    /// What reports call it.
    pub fn name(&self) -> &str {
        match self {
            Self::Text(text) => text,
            Self::Set { name, .. } => name,
        }
    }

    /// The whole of it as one text: a sampler's, or `pixel=A lens=B light-pick=C light=D`.
    pub fn text(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Set { by_decision, .. } => set_text(by_decision),
        }
    }

    /// Its samplers' texts, each with the key that it stands under; no key where it is one text.
    pub fn parts(&self) -> Vec<(Option<&'static str>, &str)> {
        match self {
            Self::Text(text) => vec![(None, text)],
            Self::Set { by_decision, .. } => {
                KEYS.into_iter().map(Some).zip(by_decision.iter().map(String::as_str)).collect()
            }
        }
    }

    /// Reads a text, `{"points", "order", "random", "scope"}`, or `{"name", "sampler", "pixel", "lens", "light_pick",
    /// "light"}`, where `sampler` is what the decisions not named read; without it all four have to be there.
    pub(super) fn read(item: &Item) -> Result<Self> {
        let is_set = |key: &str| ["name", "sampler"].contains(&key) || KEYS.contains(&key);
        match item.value {
            Value::Object(pairs) if pairs.iter().any(|(key, _)| is_set(key)) => named(item),
            _ => sampler(item).map(Self::Text),
        }
    }
}

/// `pixel=A lens=B light-pick=C light=D`.
fn set_text(by_decision: &[String; 4]) -> String {
    let part = |d: Decision| format!("{}={}", d.key(), by_decision[d as usize]);
    Decision::ALL.map(part).join(" ")
}

/// A name and a sampler for each decision.
fn named(item: &Item) -> Result<SamplerEntry> {
    let mut fields = item.fields()?;
    let name = fields.need("name", name)?;
    let all = fields.opt("sampler", |item| sampler(&item))?;
    let mut own = [const { None }; 4];
    for (own, key) in own.iter_mut().zip(KEYS) {
        *own = fields.opt(key, |item| sampler(&item))?;
    }
    fields.finish()?;
    let missing: Vec<&str> = KEYS.into_iter().zip(&own).filter(|(_, own)| own.is_none()).map(|(key, _)| key).collect();
    let complete = own.map(|own| own.or_else(|| all.clone()));
    match complete {
        [Some(pixel), Some(lens), Some(pick), Some(light)] => {
            Ok(SamplerEntry::Set { name, by_decision: [pixel, lens, pick, light] })
        }
        _ => {
            let keys: Vec<String> = KEYS.iter().map(|key| format!("{key:?}")).collect();
            let what = format!("\"sampler\" or each of {}, with no {} of its own", keys.join(" "), missing.join(" "));
            Err(item.unexpected(what))
        }
    }
}

/// What a report can show in a table, a legend and the name of a file.
fn name(item: Item) -> Result<String> {
    let expected = "a name of 1 to 40 letters, digits, spaces and , . - _ + : ( ) that begins with a letter or digit";
    let name = item.text(expected)?;
    let plain = name.bytes().all(|b| b.is_ascii_alphanumeric() || b" ,.-_+:()".contains(&b));
    let begins = name.starts_with(|c: char| c.is_ascii_alphanumeric()) && !name.ends_with(' ');
    if plain && begins && name.len() <= 40 { Ok(name.to_owned()) } else { Err(item.unexpected(expected)) }
}

/// A sampler as text, or as `{"points", "order", "random", "scope"}`, of which later ones may be left out.
pub(super) fn sampler(item: &Item) -> Result<String> {
    if !matches!(item.value, Value::Object(_)) {
        return match item.text("a sampler: a text, or an object with points, order, random and scope")? {
            "" => Err(item.unexpected("a text that is not empty")),
            text => Ok(text.to_owned()),
        };
    }
    let mut fields = item.fields()?;
    let word = |item: Item| item.text("a word").map(str::to_owned);
    let mut text = fields.need("points", word)?;
    let [order, random, scope] = ["order", "random", "scope"].map(|key| fields.opt(key, word));
    let (order, random, scope) = (order?, random?, scope?);
    fields.finish()?;
    let missing = |key: &str| item.unexpected(format!("\"{key}\" where a later part is given"));
    match (&order, &random, &scope) {
        (None, Some(_), _) | (None, _, Some(_)) => return Err(missing("order")),
        (_, None, Some(_)) => return Err(missing("random")),
        _ => {}
    }
    for (sign, part) in [(':', order), (':', random), ('@', scope)] {
        if let Some(part) = part {
            text.push(sign);
            text.push_str(&part);
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::json;

    fn read(text: &str) -> Result<SamplerEntry> {
        let value = json::parse(text.as_bytes(), "e.json")?;
        SamplerEntry::read(&Item::top(&value, "e.json"))
    }

    #[test]
    fn decisions_not_named_read_the_sampler_of_all() {
        let entry =
            read(r#"{"name": "lens apart", "sampler": "ld:sheet", "lens": {"points": "ld", "order": "shuffle"}}"#);
        let entry = entry.unwrap();
        assert_eq!(entry.name(), "lens apart");
        assert_eq!(entry.text(), "pixel=ld:sheet lens=ld:shuffle light-pick=ld:sheet light=ld:sheet");
        let all = read(r#"{"light": "d", "name": "x", "pixel": "a", "light_pick": "c", "lens": "b"}"#).unwrap();
        assert_eq!(all.text(), "pixel=a lens=b light-pick=c light=d");
        assert_eq!(all.parts()[2], (Some("light_pick"), "c"));
        assert_eq!(
            read(r#"{"name": "an alias", "sampler": "ld"}"#).unwrap().text(),
            "pixel=ld lens=ld light-pick=ld light=ld"
        );
    }

    #[test]
    fn what_is_recorded_reads_back_and_a_text_is_recorded_as_a_text() {
        for text in [r#""ld:sheet""#, r#"{"name":"x","pixel":"a","lens":"b","light_pick":"c","light":"d"}"#] {
            let entry: SamplerEntry = serde_json::from_str(text).unwrap();
            assert_eq!(serde_json::to_string(&entry).unwrap(), text);
            assert_eq!(read(text).unwrap(), entry);
        }
    }

    #[test]
    fn a_bad_entry_is_an_error_that_names_its_place() {
        for (text, expected) in [
            (r#"{"sampler": "ld"}"#, "expected the key \"name\""),
            (r#"{"name": "x", "pixel": "ld", "light": "ld"}"#, "no lens light_pick of its own"),
            (r#"{"name": "x"}"#, "expected \"sampler\" or each of \"pixel\" \"lens\" \"light_pick\" \"light\""),
            (r#"{"name": "x", "sampler": "ld", "light_point": "ld"}"#, "did you mean \"light_pick\"?"),
            (r#"{"name": "x", "sampler": "ld", "points": "ld"}"#, "expected one of the keys name sampler pixel lens"),
            (r#"{"name": "x", "sampler": "ld", "lens": 3}"#, "lens: expected a sampler"),
            (r#"{"name": "x", "sampler": ""}"#, "sampler: expected a text that is not empty"),
            (r#"{"name": "", "sampler": "ld"}"#, "name: expected a name of 1 to 40"),
            (r#"{"name": "a`b", "sampler": "ld"}"#, "name: expected a name of 1 to 40"),
            (r#"{"name": "a/b", "sampler": "ld"}"#, "name: expected a name of 1 to 40"),
            (r#"{"pionts": "ld"}"#, "expected the key \"points\""),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(expected), "{text}: {error}");
        }
    }
}
