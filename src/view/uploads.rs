//! Files that are dropped on the page: into a private folder of the session, bounded, under new names only, gone with the tab.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::House;
use super::message::{Ask, Upload};
use crate::error::{Error, Result};

/// Most bytes of one file, 64 MiB.
pub const MAX_UPLOAD_BYTES: usize = 64 << 20;

/// Most bytes of all files of a tab, 256 MiB.
pub const MAX_UPLOAD_TOTAL: usize = 256 << 20;

/// Most files of a tab.
pub const MAX_UPLOAD_FILES: usize = 64;

/// The server's folder of uploads, made at the first one.
#[derive(Default)]
pub struct Root {
    folder: Mutex<Option<PathBuf>>,
}

impl Root {
    /// The folder, made for this user alone.
    fn folder(&self) -> Result<PathBuf> {
        let mut folder = self.folder.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(folder) = folder.as_ref() {
            return Ok(folder.clone());
        }
        let path = std::env::temp_dir().join(format!("sampler-lab-view-{}", super::token()?));
        make_private(&path)?;
        *folder = Some(path.clone());
        Ok(path)
    }

    /// Removes it with everything in it.
    pub fn remove(&self) {
        if let Some(folder) = self.folder.lock().unwrap_or_else(PoisonError::into_inner).take() {
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

impl Drop for Root {
    fn drop(&mut self) {
        self.remove();
    }
}

/// Makes a folder that must not be there yet.
fn make_private(path: &Path) -> Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path).map_err(|e| Error::write(path, format!("cannot make a private folder: {e}")))
}

/// The uploads of one tab.
pub struct Uploads {
    house: Arc<House>,
    session: usize,
    folder: Option<PathBuf>,
    /// The drop whose files are coming: its number on the page, its folder, their names.
    open: Option<(u64, PathBuf, Vec<String>)>,
    drops: usize,
    files: usize,
    bytes: usize,
}

impl Uploads {
    /// None so far.
    pub fn new(house: &Arc<House>, session: usize) -> Self {
        Self { house: house.clone(), session, folder: None, open: None, drops: 0, files: 0, bytes: 0 }
    }

    /// Stores one file; with the last of a drop, what to do with them.
    ///
    /// # Errors
    /// Kind `Input` for a name with a way out of the folder or a second time, and above the bounds; kind `Write`. The drop is forgotten.
    pub fn take(&mut self, upload: &Upload) -> Result<Option<Ask>> {
        let stored = self.store(upload);
        if stored.is_err() {
            self.open = None;
        }
        stored?;
        if !upload.is_last {
            return Ok(None);
        }
        let (_, folder, names) = self.open.take().expect("a file of it was just stored");
        Ok(Some(Ask::Dropped { folder, names }))
    }

    fn store(&mut self, upload: &Upload) -> Result<()> {
        let name = checked_name(&upload.name)?;
        let place = format!("upload {name:?}");
        let (files, bytes) = (self.files + 1, self.bytes + upload.bytes.len());
        if files > MAX_UPLOAD_FILES {
            let what =
                format!("expected at most {MAX_UPLOAD_FILES} files of a tab, found another (reload to begin anew)");
            return Err(Error::input(place, what));
        }
        if upload.bytes.len() > MAX_UPLOAD_BYTES || bytes > MAX_UPLOAD_TOTAL {
            let what =
                format!("expected {MAX_UPLOAD_BYTES} bytes at most, and {MAX_UPLOAD_TOTAL} of all files of a tab");
            return Err(Error::input(place, format!("{what}, found {} more", upload.bytes.len())));
        }
        if self.open.as_ref().is_none_or(|(number, ..)| *number != upload.drop) {
            self.open = Some((upload.drop, self.new_folder()?, Vec::new()));
        }
        let (_, folder, names) = self.open.as_mut().expect("opened above");
        if names.contains(&name) {
            return Err(Error::input(place, "expected each name once in a drop, found it again"));
        }
        let path = folder.join(&name);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|e| Error::write(&path, e))?;
        }
        write_new(&path, upload.bytes)?;
        names.push(name);
        (self.files, self.bytes) = (files, bytes);
        Ok(())
    }

    fn new_folder(&mut self) -> Result<PathBuf> {
        let session = match &self.folder {
            Some(folder) => folder.clone(),
            None => {
                let folder = self.house.uploads.folder()?.join(self.session.to_string());
                make_private(&folder)?;
                self.folder.insert(folder).clone()
            }
        };
        self.drops += 1;
        let folder = session.join(self.drops.to_string());
        make_private(&folder)?;
        Ok(folder)
    }

    /// Removes the tab's files.
    pub fn remove(&mut self) {
        if let Some(folder) = self.folder.take() {
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}

/// Writes a file that must not be there yet.
fn write_new(path: &Path, bytes: &[u8]) -> Result<()> {
    use std::io::Write;
    let written = std::fs::File::options().write(true).create_new(true).open(path).and_then(|mut f| f.write_all(bytes));
    written.map_err(|e| Error::write(path, format!("cannot write: {e}")))
}

/// A name of plain parts: `bunny.obj`, `textures/fur.png`.
///
/// # Errors
/// Kind `Input` for absolute names, `..`, hidden files, control characters, devices' colons, and names above 200 bytes or 4 folders.
fn checked_name(name: &str) -> Result<String> {
    let plain = |part: &str| {
        !part.is_empty()
            && !part.starts_with('.')
            && !part.contains(['\\', ':', '\0'])
            && !part.chars().any(char::is_control)
    };
    let parts: Vec<&str> = name.split('/').collect();
    if name.len() <= 200 && parts.len() <= 5 && parts.iter().all(|part| plain(part)) {
        return Ok(name.to_owned());
    }
    let shown: String = name.chars().take(60).collect();
    Err(Error::input("upload", format!("expected a plain file name such as bunny.obj, found {shown:?}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_out_of_the_folder_are_refused() {
        for good in ["a.obj", "textures/fur.png", "a b (1).mtl", "köln.json"] {
            assert_eq!(checked_name(good).unwrap(), good);
        }
        let long = "a".repeat(201);
        for bad in [
            "",
            "..",
            "../a",
            "a/../b",
            "/etc/passwd",
            "a//b",
            ".hidden",
            "a/.b",
            "C:a",
            "a\\b",
            "a\0b",
            "a\nb",
            "a/",
            &long,
        ] {
            assert!(checked_name(bad).is_err(), "{bad:?}");
        }
    }
}
