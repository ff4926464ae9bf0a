//! Strict JSON for everything a person writes: duplicate keys, trailing text and wrong types are errors with a place.
//!
//! [`Value`] keeps the order of keys and tells integers from fractions. [`Item`] and [`Fields`] read it with the place
//! at hand, so that every message reads `configs/pots.json: camera.focal_depth: expected a length above 0, found -2`.

use std::fmt;
use std::ops::RangeInclusive;
use std::path::Path;

use glam::Vec3;
use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};

use crate::error::{Error, Result, did_you_mean};

/// A JSON number: integers of 64 bits stay exact (seeds use all of them), everything else is a finite `f64`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// Written without fraction and exponent, within −2^63 … 2^64 − 1.
    Integer(i128),
    /// Anything else; always finite.
    Float(f64),
}

impl Number {
    /// The nearest `f64`.
    pub fn as_f64(self) -> f64 {
        match self {
            Self::Integer(i) => i as f64,
            Self::Float(x) => x,
        }
    }

    /// The whole number meant, where there is one: `26` and `26.0`, not `26.5`.
    ///
    /// A fraction-free float counts below 2^53 only: above, neighbouring integers share one `f64`.
    pub fn as_integer(self) -> Option<i128> {
        match self {
            Self::Integer(i) => Some(i),
            Self::Float(x) if x.fract() == 0.0 && x.abs() < 9_007_199_254_740_992.0 => Some(x as i128),
            Self::Float(_) => None,
        }
    }
}

/// A JSON value. Keys keep their order and occur once.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// `null`
    Null,
    /// `true` or `false`
    Bool(bool),
    /// A number.
    Number(Number),
    /// A string.
    Text(String),
    /// `[…]`
    Array(Vec<Value>),
    /// `{…}`, in the order of the file.
    Object(Vec<(String, Value)>),
}

impl Value {
    /// A number from an `f64`.
    ///
    /// # Panics
    /// Where `x` is not finite: JSON has no such number, so the program is wrong to write one.
    pub fn float(x: f64) -> Self {
        assert!(x.is_finite(), "JSON has no number for {x}");
        Self::Number(Number::Float(x))
    }

    /// A number that reads like the `f32` it came from (`0.3`, not `0.30000001192092896`) and reads back as the same `f32`.
    ///
    /// # Panics
    /// Where `x` is not finite.
    pub fn from_f32(x: f32) -> Self {
        // Reading goes decimal → f64 → f32; the rare decimal for which the two roundings disagree is written in full.
        let short: f64 = x.to_string().parse().unwrap_or(f64::from(x));
        Self::float(if short as f32 == x { short } else { f64::from(x) })
    }

    /// A whole number.
    pub fn integer(i: impl Into<i128>) -> Self {
        Self::Number(Number::Integer(i.into()))
    }

    /// A string.
    pub fn text(s: impl Into<String>) -> Self {
        Self::Text(s.into())
    }

    /// Three numbers.
    pub fn vec3(v: Vec3) -> Self {
        Self::Array(v.to_array().map(Self::from_f32).to_vec())
    }

    /// The value under `key`, where this is an object that has it.
    pub fn get(&self, key: &str) -> Option<&Value> {
        match self {
            Self::Object(pairs) => pairs.iter().find(|(k, _)| k == key).map(|(_, v)| v),
            _ => None,
        }
    }

    /// Indented JSON that ends with a newline; an array of plain values keeps to one line.
    pub fn to_pretty(&self) -> String {
        let mut out = String::new();
        self.write_pretty(&mut out, 0);
        out.push('\n');
        out
    }

    fn write_pretty(&self, out: &mut String, depth: usize) {
        let is_flat = |v: &Value| !matches!(v, Value::Array(_) | Value::Object(_));
        match self {
            Self::Array(items) if !items.iter().all(is_flat) => {
                write_block(out, depth, ['[', ']'], items, |out, item| item.write_pretty(out, depth + 1));
            }
            Self::Object(pairs) if !pairs.is_empty() => {
                write_block(out, depth, ['{', '}'], pairs, |out, (key, value)| {
                    out.push_str(&format!("{}: ", quoted(key)));
                    value.write_pretty(out, depth + 1);
                })
            }
            _ => out.push_str(&self.to_string()),
        }
    }
}

/// An indented block between two brackets: one item a line, commas between them.
fn write_block<T>(
    out: &mut String,
    depth: usize,
    [open, close]: [char; 2],
    items: &[T],
    write: impl Fn(&mut String, &T),
) {
    out.push(open);
    for (i, item) in items.iter().enumerate() {
        out.push_str(if i == 0 { "\n" } else { ",\n" });
        out.push_str(&"  ".repeat(depth + 1));
        write(out, item);
    }
    out.push('\n');
    out.push_str(&"  ".repeat(depth));
    out.push(close);
}

/// `s` as a JSON string.
fn quoted(s: &str) -> String {
    serde_json::Value::from(s).to_string()
}

/// One line of JSON.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Null => f.write_str("null"),
            Self::Bool(b) => write!(f, "{b}"),
            Self::Number(Number::Integer(i)) => write!(f, "{i}"),
            Self::Number(Number::Float(x)) => write!(f, "{}", serde_json::Value::from(*x)),
            Self::Text(s) => f.write_str(&quoted(s)),
            Self::Array(items) => {
                f.write_str("[")?;
                for (i, item) in items.iter().enumerate() {
                    write!(f, "{}{item}", if i == 0 { "" } else { ", " })?;
                }
                f.write_str("]")
            }
            Self::Object(pairs) => {
                f.write_str("{")?;
                for (i, (key, value)) in pairs.iter().enumerate() {
                    write!(f, "{}{}: {value}", if i == 0 { "" } else { ", " }, quoted(key))?;
                }
                f.write_str("}")
            }
        }
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(ValueVisitor)
    }
}

struct ValueVisitor;

impl<'de> Visitor<'de> for ValueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> std::result::Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, b: bool) -> std::result::Result<Value, E> {
        Ok(Value::Bool(b))
    }

    fn visit_i64<E>(self, i: i64) -> std::result::Result<Value, E> {
        Ok(Value::integer(i))
    }

    fn visit_u64<E>(self, i: u64) -> std::result::Result<Value, E> {
        Ok(Value::integer(i))
    }

    fn visit_f64<E: de::Error>(self, x: f64) -> std::result::Result<Value, E> {
        if x.is_finite() { Ok(Value::float(x)) } else { Err(E::custom("number out of range")) }
    }

    fn visit_str<E>(self, s: &str) -> std::result::Result<Value, E> {
        Ok(Value::text(s))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> std::result::Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element()? {
            items.push(item);
        }
        Ok(Value::Array(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> std::result::Result<Value, A::Error> {
        let mut pairs: Vec<(String, Value)> = Vec::new();
        let mut seen = std::collections::HashSet::new();
        while let Some(key) = map.next_key::<String>()? {
            if !seen.insert(key.clone()) {
                return Err(de::Error::custom(format!("the key {} twice", quoted(&key))));
            }
            let value = map.next_value()?;
            pairs.push((key, value));
        }
        Ok(Value::Object(pairs))
    }
}

/// Parses one JSON document; `file` names it in errors. A byte order mark at the front is skipped.
///
/// # Errors
/// Kind `Input` with line and column: syntax, a duplicate key, a number outside `f64`, text after the end,
/// bytes that are not UTF-8, more than 128 levels.
pub fn parse(bytes: &[u8], file: &str) -> Result<Value> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    serde_json::from_slice(bytes).map_err(|e| {
        let message = e.to_string();
        let message = message.split(" at line ").next().unwrap_or(&message);
        let place = format!("{file}: line {}, column {}", e.line(), e.column());
        Error::input(place, format!("expected one JSON document, each key once; found: {message}"))
    })
}

/// Reads and parses one JSON file.
///
/// # Errors
/// Those of [`parse`], and kind `Input` where the file cannot be read.
pub fn read_file(path: &Path) -> Result<Value> {
    let bytes = std::fs::read(path)
        .map_err(|e| Error::input(path.display(), format!("expected a readable JSON file, found: {e}")))?;
    parse(&bytes, &path.display().to_string())
}

/// Where a value stands: the file, and the dotted path inside it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    file: String,
    path: String,
}

impl Place {
    /// The top of a file.
    pub fn top(file: impl Into<String>) -> Self {
        Self { file: file.into(), path: String::new() }
    }

    /// `key` inside the object at this place.
    pub fn key(&self, key: &str) -> Self {
        let path = if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) };
        Self { file: self.file.clone(), path }
    }

    /// Element `index`, from 0, of the array at this place.
    pub fn index(&self, index: usize) -> Self {
        Self { file: self.file.clone(), path: format!("{}[{index}]", self.path) }
    }

    /// The dotted path inside the file, such as `scene.materials[2].name`; empty at the top.
    pub fn path(&self) -> &str {
        &self.path
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.path.is_empty() { f.write_str(&self.file) } else { write!(f, "{}: {}", self.file, self.path) }
    }
}

/// A value and its place. The readers give the value in the type that is wanted, or an error of kind `Input` that says
/// what was expected and what was found.
#[derive(Debug, Clone)]
pub struct Item<'a> {
    /// The value.
    pub value: &'a Value,
    /// Where it stands.
    pub place: Place,
}

impl<'a> Item<'a> {
    /// A document from its top.
    pub fn top(value: &'a Value, file: &str) -> Self {
        Self { value, place: Place::top(file) }
    }

    /// The error `place: expected …, found …` about this value, which is quoted and cut to a readable length.
    pub fn unexpected(&self, expected: impl fmt::Display) -> Error {
        let found = self.value.to_string();
        let cut: String = found.chars().take(60).collect();
        let dots = if cut.len() < found.len() { "…" } else { "" };
        Error::input(&self.place, format!("expected {expected}, found {cut}{dots}"))
    }

    /// A number that passes `check`; `expected` says which, as in "a length above 0".
    ///
    /// # Errors
    /// No number, or `check` says no.
    pub fn f64(&self, expected: &str, check: impl Fn(f64) -> bool) -> Result<f64> {
        match self.value {
            Value::Number(n) if check(n.as_f64()) => Ok(n.as_f64()),
            _ => Err(self.unexpected(expected)),
        }
    }

    /// A number that is finite as `f32` and passes `check` there.
    ///
    /// # Errors
    /// No number, too large for `f32` (above 3.4e38), or `check` says no.
    pub fn f32(&self, expected: &str, check: impl Fn(f32) -> bool) -> Result<f32> {
        match self.value {
            Value::Number(n) if !(n.as_f64() as f32).is_finite() => {
                Err(self.unexpected(format!("{expected}, of size below 3.4e38")))
            }
            Value::Number(n) if check(n.as_f64() as f32) => Ok(n.as_f64() as f32),
            _ => Err(self.unexpected(expected)),
        }
    }

    /// Three numbers that are finite as `f32` and pass `check` together.
    ///
    /// # Errors
    /// No array of three numbers, one too large for `f32`, or `check` says no.
    pub fn vec3(&self, expected: &str, check: impl Fn(Vec3) -> bool) -> Result<Vec3> {
        let Value::Array(items) = self.value else { return Err(self.unexpected(expected)) };
        let [_, _, _] = items.as_slice() else { return Err(self.unexpected(expected)) };
        let mut v = [0.0; 3];
        for (i, (slot, value)) in v.iter_mut().zip(items).enumerate() {
            *slot = Item { value, place: self.place.index(i) }.f32("a number", |_| true)?;
        }
        let v = Vec3::from_array(v);
        if check(v) { Ok(v) } else { Err(self.unexpected(expected)) }
    }

    /// A whole number within `range`.
    ///
    /// # Errors
    /// No whole number, or outside.
    pub fn integer(&self, range: RangeInclusive<u64>) -> Result<u64> {
        let whole = match self.value {
            Value::Number(n) => n.as_integer().and_then(|i| u64::try_from(i).ok()),
            _ => None,
        };
        whole
            .filter(|i| range.contains(i))
            .ok_or_else(|| self.unexpected(format!("a whole number from {} to {}", range.start(), range.end())))
    }

    /// `true` or `false`.
    ///
    /// # Errors
    /// Anything else.
    pub fn bool(&self) -> Result<bool> {
        match self.value {
            Value::Bool(b) => Ok(*b),
            _ => Err(self.unexpected("true or false")),
        }
    }

    /// A string.
    ///
    /// # Errors
    /// Anything else.
    pub fn text(&self, expected: &str) -> Result<&'a str> {
        match self.value {
            Value::Text(s) => Ok(s),
            _ => Err(self.unexpected(expected)),
        }
    }

    /// One of the named choices.
    ///
    /// # Errors
    /// Anything else, with the nearest name.
    pub fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Result<T> {
        let found = match self.value {
            Value::Text(s) => s.as_str(),
            _ => "",
        };
        if let Some((_, choice)) = choices.iter().find(|(name, _)| *name == found) {
            return Ok(*choice);
        }
        let names: Vec<String> = choices.iter().map(|(name, _)| quoted(name)).collect();
        let mut error = self.unexpected(names.join(" or "));
        error.what.push_str(&suggestion(found, choices.iter().map(|(name, _)| *name)));
        Err(error)
    }

    /// The elements of an array.
    ///
    /// # Errors
    /// Anything else; `expected` says what the array holds.
    pub fn items(&self, expected: &str) -> Result<Vec<Item<'a>>> {
        match self.value {
            Value::Array(items) => {
                let at = |(i, value)| Item { value, place: self.place.index(i) };
                Ok(items.iter().enumerate().map(at).collect())
            }
            _ => Err(self.unexpected(expected)),
        }
    }

    /// The fields of an object.
    ///
    /// # Errors
    /// Anything else.
    pub fn fields(&self) -> Result<Fields<'a>> {
        Fields::new(self.value, self.place.clone())
    }
}

/// `"; did you mean "camera"?"` where a candidate is near enough, else nothing.
pub fn suggestion<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    did_you_mean(found, candidates).map(|near| format!("; did you mean {}?", quoted(near))).unwrap_or_default()
}

/// Reads an object key by key; what is left over at the end is unknown.
#[derive(Debug)]
pub struct Fields<'a> {
    place: Place,
    left: Vec<(&'a str, &'a Value)>,
    known: Vec<&'static str>,
}

impl<'a> Fields<'a> {
    /// The fields of the object `value` at `place`.
    ///
    /// # Errors
    /// Kind `Input` where `value` is no object.
    pub fn new(value: &'a Value, place: Place) -> Result<Self> {
        match value {
            Value::Object(pairs) => {
                let left = pairs.iter().map(|(k, v)| (k.as_str(), v)).collect();
                Ok(Self { place, left, known: Vec::new() })
            }
            _ => Err(Item { value, place }.unexpected("an object {…}")),
        }
    }

    /// Where the object stands.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// The field `key`, read by `read`; `None` where it is absent.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn opt<T>(&mut self, key: &'static str, read: impl FnOnce(Item<'a>) -> Result<T>) -> Result<Option<T>> {
        self.known.push(key);
        match self.left.iter().position(|(k, _)| *k == key) {
            Some(i) => {
                let (_, value) = self.left.remove(i);
                read(Item { value, place: self.place.key(key) }).map(Some)
            }
            None => Ok(None),
        }
    }

    /// The field `key`, read by `read`; `default` where it is absent.
    ///
    /// # Errors
    /// Those of `read`.
    pub fn or<T>(&mut self, key: &'static str, default: T, read: impl FnOnce(Item<'a>) -> Result<T>) -> Result<T> {
        Ok(self.opt(key, read)?.unwrap_or(default))
    }

    /// The field `key`, read by `read`.
    ///
    /// # Errors
    /// Those of `read`, and kind `Input` where the field is absent.
    pub fn need<T>(&mut self, key: &'static str, read: impl FnOnce(Item<'a>) -> Result<T>) -> Result<T> {
        let near = suggestion(key, self.left.iter().map(|(k, _)| *k));
        let missing = Error::input(&self.place, format!("expected the key {}, found none{near}", quoted(key)));
        self.opt(key, read)?.ok_or(missing)
    }

    /// The fields not read so far, in order.
    pub fn take_rest(&mut self) -> Vec<(&'a str, &'a Value)> {
        std::mem::take(&mut self.left)
    }

    /// Every field has been read.
    ///
    /// # Errors
    /// Kind `Input` at the first unknown key, with the nearest known one.
    pub fn finish(self) -> Result<()> {
        match self.left.first() {
            None => Ok(()),
            Some((key, _)) => Err(unknown_key(&self.place, key, &self.known)),
        }
    }
}

/// The error about `key`, which is none of the `known` keys of the object at `place`.
pub fn unknown_key(place: &Place, key: &str, known: &[&str]) -> Error {
    let near = suggestion(key, known.iter().copied());
    Error::input(place.key(key), format!("expected one of the keys {}, found an unknown key{near}", known.join(" ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn error_of(text: &str) -> String {
        parse(text.as_bytes(), "a.json").unwrap_err().to_string()
    }

    #[test]
    fn syntax_errors_carry_line_and_column() {
        assert_eq!(
            error_of("{\"a\": 1,\n \"b\": }"),
            "a.json: line 2, column 7: expected one JSON document, each key once; found: expected value"
        );
        assert!(error_of("{} x").contains("line 1, column 4: ") && error_of("{} x").contains("trailing characters"));
        assert!(error_of("").contains("EOF"));
        assert!(error_of("[NaN]").contains("line 1"));
        assert!(error_of("1e999").contains("out of range"));
        assert!(error_of(&"[".repeat(200_000)).contains("recursion"));
    }

    #[test]
    fn a_key_given_twice_is_an_error_at_any_depth() {
        assert!(error_of("{\n\"a\": {\"b\": 1,\n \"b\": 1}}").starts_with("a.json: line 3, column 4: "));
        assert!(error_of(r#"{"a": 1, "\u0061": 2}"#).contains(r#"found: the key "a" twice"#));
    }

    #[test]
    fn integers_keep_all_64_bits_and_whole_floats_count_as_integers() {
        let at = |text: &str| parse(text.as_bytes(), "a").unwrap();
        assert_eq!(at("18446744073709551615"), Value::integer(u64::MAX));
        assert_eq!(at("-9223372036854775808"), Value::integer(i64::MIN));
        assert_eq!(Item::top(&at("26.0"), "a").integer(1..=99).unwrap(), 26);
        assert_eq!(Item::top(&at("2.6e1"), "a").integer(1..=99).unwrap(), 26);
        for bad in ["26.5", "-1", "100", "1e300", "\"26\"", "null", "9007199254740993.0"] {
            let error = Item::top(&at(bad), "a").integer(1..=99).unwrap_err().to_string();
            assert!(error.starts_with("a: expected a whole number from 1 to 99, found "), "{error}");
        }
    }

    #[test]
    fn errors_name_place_expected_and_found() {
        let value = parse(br#"{"camera": {"focal_depth": -2, "lens_radus": 1}}"#, "configs/pots.json").unwrap();
        let mut top = Item::top(&value, "configs/pots.json").fields().unwrap();
        let (depth, unknown) = top
            .need("camera", |item| {
                let mut camera = item.fields()?;
                let depth = camera.opt("focal_depth", |i| i.f32("a length above 0", |x| x > 0.0)).unwrap_err();
                camera.opt("lens_radius", |i| i.f32("a length", |_| true))?;
                Ok((depth, camera.finish().unwrap_err()))
            })
            .unwrap();
        assert_eq!(depth.to_string(), "configs/pots.json: camera.focal_depth: expected a length above 0, found -2");
        assert_eq!(
            unknown.to_string(),
            "configs/pots.json: camera.lens_radus: expected one of the keys focal_depth lens_radius, \
             found an unknown key; did you mean \"lens_radius\"?"
        );
        assert!(top.need("scene", |i| i.bool()).unwrap_err().to_string().contains("expected the key \"scene\""));
    }

    #[test]
    fn numbers_that_overflow_f32_are_errors() {
        let value = parse(b"[1e39, 0, 0]", "a").unwrap();
        let error = Item::top(&value, "a").vec3("a vector", |_| true).unwrap_err().to_string();
        assert_eq!(error, "a: [0]: expected a number, of size below 3.4e38, found 1e+39");
    }

    /// Trouble on purpose: zeros of both signs, denormals, the largest float, neighbours of powers of two.
    fn any_value() -> impl Strategy<Value = Value> {
        let leaf = prop_oneof![
            Just(Value::Null),
            any::<bool>().prop_map(Value::Bool),
            prop_oneof![any::<i64>(), Just(0), Just(i64::MIN)].prop_map(Value::integer),
            Just(Value::integer(u64::MAX)),
            any::<f64>().prop_filter("finite", |x| x.is_finite()).prop_map(Value::float),
            prop_oneof![Just(-0.0), Just(f64::MAX), Just(5e-324), Just(0.1), Just(1.0 - f64::EPSILON / 2.0)]
                .prop_map(Value::float),
            ".{0,8}".prop_map(Value::Text),
        ];
        leaf.prop_recursive(4, 40, 5, |inner| {
            prop_oneof![
                prop::collection::vec(inner.clone(), 0..5).prop_map(Value::Array),
                prop::collection::btree_map(".{0,5}", inner, 0..5).prop_map(|m| Value::Object(m.into_iter().collect())),
            ]
        })
    }

    #[test]
    fn what_is_written_reads_back_equal_and_any_f32_survives() {
        let config = ProptestConfig { cases: 400, failure_persistence: None, ..Default::default() };
        let rng = proptest::test_runner::TestRng::from_seed(proptest::test_runner::RngAlgorithm::ChaCha, &[7; 32]);
        let mut runner = proptest::test_runner::TestRunner::new_with_rng(config, rng);
        runner
            .run(&(any_value(), any::<f32>()), |(value, x)| {
                prop_assert_eq!(&parse(value.to_string().as_bytes(), "a").unwrap(), &value);
                prop_assert_eq!(&parse(value.to_pretty().as_bytes(), "a").unwrap(), &value);
                if x.is_finite() {
                    let read = parse(Value::from_f32(x).to_string().as_bytes(), "a").unwrap();
                    prop_assert_eq!(Item::top(&read, "a").f32("", |_| true).unwrap().to_bits(), x.to_bits());
                }
                Ok(())
            })
            .unwrap();
    }
}
