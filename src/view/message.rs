//! What a tab may ask for: JSON texts `{"ask": …}`, and files as bytes under a JSON header.
//!
//! Changes of the scene are `--set` texts (`camera.fov=40`) on the document of the tab, read by the loader of scene files: there is no
//! second way to say anything that a file says.

use std::path::PathBuf;

use serde::Deserialize;

use crate::error::{Error, Result};

/// A request of a tab.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Ask {
    /// Change keys of the document.
    Set {
        /// `KEY=VALUE` each.
        sets: Vec<String>,
        /// Whether the camera is on its way, so that more changes follow at once.
        #[serde(default)]
        moving: bool,
    },
    /// Take another document.
    Document {
        /// JSON.
        text: String,
        /// What it is called in messages.
        name: String,
    },
    /// Take a scene file of the scene's folder.
    Load {
        /// Its file name.
        name: String,
    },
    /// Write the document into the folder of `--data`, under a name that is not taken.
    Save {
        /// The wished file name.
        name: String,
    },
    /// Send the document or a picture as a file.
    Download {
        /// Which.
        what: Download,
        /// Of which panel a picture is, from 0.
        #[serde(default)]
        panel: usize,
    },
    /// Back to the document that the tab began with.
    Reset {},
    /// Render anew from the first sample.
    Restart {},
    /// Stop rendering; a restart or any change goes on.
    Stop {},
    /// A frame was shown.
    Shown {
        /// Its number.
        frame: u64,
    },
    /// The values of a pixel.
    Probe {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
    /// What is seen in a pixel's middle; the plane of focus goes there where auto focus is off.
    Pick {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
    /// The points that a pixel's decision reads.
    Points {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// `pixel`, `lens`, `light-pick` or `light`.
        decision: String,
    },
    /// The error's power by frequency.
    Spectrum {},
    /// Files were dropped; only the server says so.
    #[serde(skip)]
    Dropped {
        /// Where they are.
        folder: PathBuf,
        /// Their names there.
        names: Vec<String>,
    },
}

/// What can be downloaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Download {
    /// The full JSON.
    Document,
    /// The picture as it is shown.
    Png,
    /// Linear radiance.
    Exr,
}

/// Keys of the document that change what is shown of the samples, and none of these.
const OF_SHOWING: [&str; 5] = ["framebuffer.exposure", "view.show", "view.look", "view.refine", "view.speed"];

/// Whether a set (`KEY=VALUE`) changes nothing but what is shown.
pub fn is_of_showing(set: &str) -> bool {
    set.split_once('=').is_some_and(|(key, _)| OF_SHOWING.contains(&key))
}

impl Ask {
    /// Reads a request.
    ///
    /// # Errors
    /// Kind `Input` for anything else.
    pub fn parse(text: &str) -> Result<Self> {
        serde_json::from_str(text)
            .map_err(|e| Error::input("message", format!("expected a request of the page, found: {e}")))
    }

    /// Whether what is under way is stale with it.
    pub fn is_change(&self) -> bool {
        if let Self::Set { sets, .. } = self {
            return !sets.iter().all(|set| is_of_showing(set));
        }
        !matches!(
            self,
            Self::Save { .. }
                | Self::Download { .. }
                | Self::Shown { .. }
                | Self::Probe { .. }
                | Self::Pick { .. }
                | Self::Points { .. }
                | Self::Spectrum {}
        )
    }
}

/// A file that comes up: its header's length in 4 bytes, low ones first, the header, the file.
#[derive(Debug, PartialEq)]
pub struct Upload<'a> {
    /// Which drop it is of; the page counts them.
    pub drop: u64,
    /// Its name, with folders below the dropped one.
    pub name: String,
    /// Whether it is the drop's last.
    pub is_last: bool,
    /// What is in it.
    pub bytes: &'a [u8],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UploadHeader {
    upload: u64,
    name: String,
    last: bool,
}

impl<'a> Upload<'a> {
    /// Reads a message.
    ///
    /// # Errors
    /// Kind `Input` for anything else.
    pub fn parse(message: &'a [u8]) -> Result<Self> {
        let wrong = |what: String| Error::input("upload", format!("expected a file under its header, found {what}"));
        let (length, rest) = message.split_first_chunk::<4>().ok_or_else(|| wrong("no header".to_owned()))?;
        let length = u32::from_le_bytes(*length) as usize;
        let header = rest.get(..length).ok_or_else(|| wrong(format!("a header of {length} bytes that is cut off")))?;
        let UploadHeader { upload, name, last } =
            serde_json::from_slice(header).map_err(|e| wrong(format!("another header: {e}")))?;
        Ok(Self { drop: upload, name, is_last: last, bytes: &rest[length..] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_strictly() {
        assert_eq!(Ask::parse(r#"{"ask":"shown","frame":7}"#).unwrap(), Ask::Shown { frame: 7 });
        let set = Ask::parse(r#"{"ask":"set","sets":["camera.fov=40"]}"#).unwrap();
        assert_eq!(set, Ask::Set { sets: vec!["camera.fov=40".to_owned()], moving: false });
        for bad in [
            "",
            "[]",
            "{}",
            r#"{"ask":"dropped","folder":"/etc","names":["passwd"]}"#,
            r#"{"ask":"probe","x":-1,"y":0}"#,
            r#"{"ask":"probe","x":1,"y":0,"z":0}"#,
            r#"{"ask":"look","view":"error"}"#,
        ] {
            assert_eq!(Ask::parse(bad).unwrap_err().exit_code(), 2, "{bad}");
        }
    }

    #[test]
    fn what_is_only_shown_makes_no_sample_stale() {
        let set = |sets: &[&str]| Ask::Set { sets: sets.iter().map(|s| (*s).to_owned()).collect(), moving: false };
        assert!(!set(&["view.look=\"error\"", "framebuffer.exposure=2"]).is_change());
        assert!(set(&["view.look=\"error\"", "view.second=\"ld\""]).is_change());
        assert!(set(&["camera.fov=40"]).is_change() && set(&["view"]).is_change());
        assert!(Ask::Reset {}.is_change() && !Ask::Spectrum {}.is_change());
    }

    #[test]
    fn torn_uploads_are_errors() {
        let header = br#"{"upload":1,"name":"a.obj","last":true}"#;
        let mut whole = (header.len() as u32).to_le_bytes().to_vec();
        whole.extend(header);
        whole.extend(b"v 0 0 0");
        let upload = Upload::parse(&whole).unwrap();
        assert_eq!(
            (upload.drop, upload.name.as_str(), upload.is_last, upload.bytes),
            (1, "a.obj", true, &b"v 0 0 0"[..])
        );
        for cut in 0..4 + header.len() {
            assert!(Upload::parse(&whole[..cut]).is_err(), "{cut}");
        }
        assert!(Upload::parse(&[0xff; 64]).is_err());
    }
}
