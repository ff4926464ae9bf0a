//! What several cases share, made when first asked for.

use std::cell::{OnceCell, RefCell};
use std::path::{Path, PathBuf};

use super::scenes::Landscape;
use crate::error::{Error, Result};
use crate::film::write_whole;
use crate::scene::compile::{Scene, Stage};
use crate::scene::load::{OpenOptions, open};

/// Scenes in memory, and a folder for files.
#[derive(Default)]
pub struct Lab {
    scenes: [OnceCell<RefCell<Scene>>; 2],
    folder: OnceCell<Folder>,
}

/// The size at which landscapes are rendered: columns, rows.
pub const SIZE: (u32, u32) = (1280, 720);

/// The Cornell box as it stands in the repository.
const CORNELL: [(&str, &str); 3] = [
    ("cornell.json", include_str!("../../configs/cornell.json")),
    ("cornell/cornell.obj", include_str!("../../data/cornell/cornell.obj")),
    ("cornell/cornell.mtl", include_str!("../../data/cornell/cornell.mtl")),
];

impl Lab {
    /// One of [`Landscape::ALL`], 1280 × 720.
    pub fn landscape(&self, which: usize) -> &RefCell<Scene> {
        self.scenes[which].get_or_init(|| RefCell::new(Landscape::ALL[which].scene(SIZE)))
    }

    /// A folder of this process alone, gone with the lab.
    ///
    /// # Errors
    /// Kind `Write` where it cannot be made.
    pub fn folder(&self) -> Result<&Path> {
        if self.folder.get().is_none() {
            let path = std::env::temp_dir().join(format!("sampler-lab-bench-{}", std::process::id()));
            std::fs::create_dir_all(&path).map_err(|e| Error::write(&path, e))?;
            let _ = self.folder.set(Folder(path));
        }
        Ok(&self.folder.get().expect("made above").0)
    }

    /// The Cornell box, for an image of `size`.
    ///
    /// # Errors
    /// Kind `Write` where its files cannot be written.
    pub fn cornell(&self, size: (u32, u32)) -> Result<Scene> {
        let loaded = open(&write_cornell(self.folder()?)?, &OpenOptions::default())?;
        Scene::new(&loaded.config, loaded.mesh, size, Stage::Final)
    }
}

/// Writes the Cornell box's files into `folder`; the path of the scene file.
///
/// # Errors
/// Kind `Write` where one cannot be written.
pub fn write_cornell(folder: &Path) -> Result<PathBuf> {
    std::fs::create_dir_all(folder.join("cornell")).map_err(|e| Error::write(folder, e))?;
    for (name, text) in CORNELL {
        write_whole(&folder.join(name), text.as_bytes())?;
    }
    Ok(folder.join(CORNELL[0].0))
}

/// A folder that goes with its owner.
struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed from the system's folder for such files is the system's to remove.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
