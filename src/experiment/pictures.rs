//! `pictures` of an experiment: larger images to look at, of one scene or of several.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::backend::Size;
use super::spec::{MOST_SPP, count, counts, known_scene, size};
use crate::error::{Error, Result};
use crate::scene::json::{Item, Value};

/// Larger images of one scene, one of each sampler and count.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pictures {
    /// Scene, one of the experiment's.
    pub scene: String,
    /// Image size.
    pub size: Size,
    /// Samples per pixel; a ladder of several counts is what pictures at equal seconds are chosen from.
    #[serde(with = "one_or_more")]
    pub spp: Vec<u32>,
    /// Samples per pixel of each half of the pictures' own reference.
    pub reference_spp: u32,
}

impl Pictures {
    /// The count at which samplers are shown at equal samples: of the counts in ascending order the middle one, of an even
    /// number the lower of the two.
    pub fn equal_spp(&self) -> u32 {
        let mut spp = self.spp.clone();
        spp.sort_unstable();
        spp.get(spp.len().saturating_sub(1) / 2).copied().unwrap_or(1)
    }
}

/// `pictures`: one object, or a list of them of different scenes.
pub(super) fn pictures(item: &Item, scenes: &[String], reference_spp: u32) -> Result<Vec<Pictures>> {
    let Value::Array(_) = item.value else { return Ok(vec![one(item, scenes, reference_spp)?]) };
    let expected = "an object, or a list of at least one, each of another scene";
    let items = item.items(expected)?;
    if items.is_empty() {
        return Err(item.unexpected(expected));
    }
    let mut all: Vec<Pictures> = Vec::new();
    for item in &items {
        let next = one(item, scenes, reference_spp)?;
        if all.iter().any(|known| known.scene == next.scene) {
            // Seeds are those of scene, sampler and count: two sizes of one scene would share their randomness.
            let what = format!("expected pictures of each scene once, found {:?} again", next.scene);
            return Err(Error::input(item.place.key("scene"), what));
        }
        all.push(next);
    }
    Ok(all)
}

/// The pictures of one scene.
fn one(item: &Item, scenes: &[String], reference_spp: u32) -> Result<Pictures> {
    let mut fields = item.fields()?;
    let scene = fields.need("scene", |item| {
        let scene = item.text("a scene of the experiment")?;
        known_scene(scene, scenes, &item)?;
        Ok(scene.to_owned())
    })?;
    let size = fields.need("size", |item| size(&item))?;
    let spp = fields.need("spp", |item| match item.value {
        Value::Array(_) => counts(&item, MOST_SPP),
        _ => count(&item, MOST_SPP).map(|n| vec![n]),
    })?;
    let reference_spp = fields.or("reference_spp", reference_spp, |item| count(&item, MOST_SPP))?;
    fields.finish()?;
    Ok(Pictures { scene, size, spp, reference_spp })
}

/// A list that is written as its entry where there is one, as null where there is none, and read from any of these.
pub(super) mod one_or_more {
    use super::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Written<T> {
        Many(Vec<T>),
        One(T),
    }

    pub fn serialize<T: Serialize, S: Serializer>(list: &[T], serializer: S) -> Result<S::Ok, S::Error> {
        match list {
            [] => serializer.serialize_none(),
            [one] => one.serialize(serializer),
            many => many.serialize(serializer),
        }
    }

    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
        Ok(match Option::<Written<T>>::deserialize(deserializer)? {
            None => Vec::new(),
            Some(Written::One(one)) => vec![one],
            Some(Written::Many(many)) => many,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::json;

    fn read(text: &str) -> Result<Vec<Pictures>> {
        let value = json::parse(text.as_bytes(), "a.json")?;
        pictures(&Item::top(&value, "a.json"), &["pots".to_owned(), "box".to_owned()], 64)
    }

    #[test]
    fn pictures_are_one_object_or_a_list_and_a_ladder_is_a_list_of_counts() {
        let one = read(r#"{"scene": "pots", "size": "8x4", "spp": 2}"#).unwrap();
        assert_eq!((one.len(), one[0].spp.as_slice(), one[0].reference_spp), (1, &[2][..], 64));
        let many = read(
            r#"[{"scene": "pots", "size": "8x4", "spp": [32, 8, 16]}, {"scene": "box", "size": "4x4", "spp": 4, "reference_spp": 9}]"#,
        );
        let many = many.unwrap();
        assert_eq!(many.iter().map(Pictures::equal_spp).collect::<Vec<_>>(), [16, 4]);
        assert_eq!(many[1].reference_spp, 9);
        let even = Pictures { spp: vec![4, 1, 2, 8], ..many[0].clone() };
        assert_eq!(even.equal_spp(), 2, "the lower of the two in the middle");
    }

    #[test]
    fn bad_pictures_are_refused_with_their_place() {
        for (text, what) in [
            ("[]", "expected an object, or a list of at least one"),
            ("7", "expected an object"),
            (
                r#"[{"scene": "pots", "size": "8x4", "spp": 2}, {"scene": "pots", "size": "4x4", "spp": 2}]"#,
                "[1].scene: expected pictures of each scene once, found \"pots\" again",
            ),
            (r#"[{"scene": "pot", "size": "8x4", "spp": 2}]"#, "[0].scene: expected one of the scenes pots box"),
            (r#"{"scene": "pots", "size": "8x4", "spp": []}"#, "spp: expected a list of whole numbers"),
            (r#"{"scene": "pots", "size": "8x4", "spp": [2, 2]}"#, "spp[1]: expected each entry once"),
            (r#"{"scene": "pots", "size": "8x4", "spp": [0]}"#, "spp[0]: expected a whole number"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(what), "{text}: {error}");
        }
    }

    #[test]
    fn a_single_picture_is_recorded_as_before_and_all_forms_read_back() {
        #[derive(Debug, PartialEq, Serialize, Deserialize)]
        struct Record {
            #[serde(with = "one_or_more")]
            pictures: Vec<Pictures>,
        }
        let one = read(r#"{"scene": "pots", "size": "8x4", "spp": 2}"#).unwrap();
        let ladder =
            read(r#"[{"scene": "pots", "size": "8x4", "spp": [2, 4]}, {"scene": "box", "size": "8x4", "spp": 1}]"#);
        for (pictures, start) in [
            (Vec::new(), r#"{"pictures":null}"#),
            (one, r#"{"pictures":{"scene":"pots","size":"8x4","spp":2,"reference_spp":64}}"#),
            (ladder.unwrap(), r#"{"pictures":[{"scene":"pots","size":"8x4","spp":[2,4],"#),
        ] {
            let record = Record { pictures };
            let text = serde_json::to_string(&record).unwrap();
            assert!(text.starts_with(start), "{text}");
            assert_eq!(serde_json::from_str::<Record>(&text).unwrap(), record);
        }
    }
}
