//! What a scene file says of the live view: which samplers are seen beside each other, on what budget, and how. A picture does not depend on it.

use super::{Item, Result, Section, Value, keep_rest, object};

/// Shortest and longest budget, seconds.
const SECONDS: (f64, f64) = (0.1, 3600.0);

/// How the live view shows the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewConfig {
    /// The samplers of a second picture, as whoever shows it reads them; absent for none.
    pub second: Option<String>,
    /// Seconds of rendering of each picture, 0.1 to 3600; absent: the document's samples a pixel.
    pub seconds: Option<f64>,
    /// How two pictures are shown.
    pub show: Show,
    /// What is shown of a picture.
    pub look: Look,
    /// Whether the reference is refined meanwhile.
    pub refine: bool,
    /// Speed of the camera, scene units a second, above 0; absent: as the scene's size suggests.
    pub speed: Option<f32>,
}

/// How two pictures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Show {
    /// Beside each other.
    #[default]
    Side,
    /// One at a time in the same place.
    Flip,
}

/// What is shown of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Look {
    /// The picture.
    #[default]
    Image,
    /// The reference.
    Reference,
    /// Picture minus reference, in luminance.
    Error,
    /// The variance of each pixel's mean, as if its samples were independent.
    Variance,
}

const SHOWS: [(&str, Show); 2] = [("side", Show::Side), ("flip", Show::Flip)];
const LOOKS: [(&str, Look); 4] =
    [("image", Look::Image), ("reference", Look::Reference), ("error", Look::Error), ("variance", Look::Variance)];

impl Show {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Side => "side",
            Self::Flip => "flip",
        }
    }
}

impl Look {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Image => "image",
            Self::Reference => "reference",
            Self::Error => "error",
            Self::Variance => "variance",
        }
    }
}

impl Default for ViewConfig {
    fn default() -> Self {
        Self { second: None, seconds: None, show: Show::Side, look: Look::Image, refine: true, speed: None }
    }
}

impl ViewConfig {
    /// Reads the object `view`; all keys are optional, and null leaves open what may be open.
    pub(super) fn read(item: Item) -> Result<Self> {
        let default = Self::default();
        let mut fields = item.fields()?;
        let (low, high) = SECONDS;
        let seconds = |i: Item| i.f64("seconds, 0.1 to 3600, or null", |s| (low..=high).contains(&s));
        let speed = |i: Item| i.f32("a speed above 0, or null", |s| s > 0.0);
        let view = Self {
            second: fields.or("second", None, |i| {
                unless_null(i, |i| i.text("a sampler, one for each decision, or null").map(str::to_owned))
            })?,
            seconds: fields.or("seconds", None, |i| unless_null(i, seconds))?,
            show: fields.or("show", default.show, |i| i.choice(&SHOWS))?,
            look: fields.or("look", default.look, |i| i.choice(&LOOKS))?,
            refine: fields.or("refine", default.refine, |i| i.bool())?,
            speed: fields.or("speed", None, |i| unless_null(i, speed))?,
        };
        keep_rest(&mut fields, Section::View, &mut Vec::new())?;
        Ok(view)
    }

    /// What a picture leaves aside that somebody might expect in it.
    pub fn note(&self) -> Option<String> {
        let kept: Vec<&str> = [self.second.as_ref().map(|_| "view.second"), self.seconds.map(|_| "view.seconds")]
            .into_iter()
            .flatten()
            .collect();
        let keys = kept.join(" and ");
        (!kept.is_empty())
            .then(|| format!("{keys}: for `sampler-lab view`; this picture has sampler and framebuffer.sppx"))
    }

    /// The object with every key.
    pub(super) fn to_value(&self) -> Value {
        let pairs = object([
            ("second", self.second.as_ref().map_or(Value::Null, Value::text)),
            ("seconds", self.seconds.map_or(Value::Null, Value::float)),
            ("show", Value::text(self.show.name())),
            ("look", Value::text(self.look.name())),
            ("refine", Value::Bool(self.refine)),
            ("speed", self.speed.map_or(Value::Null, Value::from_f32)),
        ]);
        Value::Object(pairs.collect())
    }
}

fn unless_null<'a, T>(item: Item<'a>, read: impl FnOnce(Item<'a>) -> Result<T>) -> Result<Option<T>> {
    if *item.value == Value::Null { Ok(None) } else { read(item).map(Some) }
}

#[cfg(test)]
mod tests {
    use super::super::SceneConfig;
    use super::*;

    #[test]
    fn a_view_is_read_strictly_and_back() {
        let read = |text: &str| SceneConfig::parse(text.as_bytes(), "a.json", &[]);
        assert_eq!(read("{}").unwrap().view, None);
        assert_eq!(read(r#"{"view": {}}"#).unwrap().view, Some(ViewConfig::default()));
        let text = r#"{"view": {"second": "ld", "seconds": 2.5, "show": "flip", "look": "error", "refine": false, "speed": 3}}"#;
        let config = read(text).unwrap();
        let expected = ViewConfig {
            second: Some("ld".to_owned()),
            seconds: Some(2.5),
            show: Show::Flip,
            look: Look::Error,
            refine: false,
            speed: Some(3.0),
        };
        assert_eq!(config.view.as_ref(), Some(&expected));
        assert_eq!(read(&config.to_json()).unwrap(), config);
        let note = config.view.unwrap().note().unwrap();
        assert!(note.starts_with("view.second and view.seconds: for `sampler-lab view`"), "{note}");
        assert_eq!(ViewConfig { look: Look::Error, ..ViewConfig::default() }.note(), None);
        let error = |view: &str| read(&format!("{{\"view\": {view}}}")).unwrap_err().to_string();
        for (bad, needle) in [
            ("3", "view: expected an object"),
            (r#"{"secod": "ld"}"#, "did you mean \"second\""),
            (r#"{"fov": 40}"#, "it belongs in camera"),
            (r#"{"seconds": 0}"#, "view.seconds: expected seconds, 0.1 to 3600"),
            (r#"{"seconds": 1e9}"#, "view.seconds: expected seconds"),
            (r#"{"speed": 0}"#, "view.speed: expected a speed above 0"),
            (r#"{"look": "everything"}"#, "view.look: expected"),
            (r#"{"show": null}"#, "view.show: expected"),
            (r#"{"second": 7}"#, "view.second: expected a sampler"),
        ] {
            assert!(error(bad).contains(needle), "{bad}: {}", error(bad));
        }
        let error = read(r#"{"look": "error"}"#).unwrap_err().to_string();
        assert!(error.contains("it belongs in view"), "{error}");
    }
}
