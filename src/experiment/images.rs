//! The images of a run: in memory while a later item needs them, as EXR beside the rows for the next run.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::backend::Size;
use super::identity::pixel_hash;
use super::results::{image_path, read_image};
use crate::error::Result;
use crate::film::{Image, write_exr, write_exr_plain};

/// Images by the id of their item.
pub struct Images {
    out: PathBuf,
    memory: HashMap<String, Arc<Image>>,
}

impl Images {
    /// The images of an output folder.
    pub fn new(out: &Path) -> Self {
        Self { out: out.to_owned(), memory: HashMap::new() }
    }

    /// An image in memory.
    pub fn held(&self, id: &str) -> Option<Arc<Image>> {
        self.memory.get(id).cloned()
    }

    /// An image from disk, now held; `None` where it is missing, torn, of another size or not what was written.
    pub fn load(&mut self, id: &str, size: Size, pixels: Option<&str>) -> Option<Arc<Image>> {
        let image = Arc::new(stored(&self.out, id, size, pixels)?);
        self.memory.insert(id.to_owned(), image.clone());
        Some(image)
    }

    /// Writes an image, compressed where it is one to look at, and holds it.
    ///
    /// # Errors
    /// Kind `Write`.
    pub fn save(
        &mut self,
        id: &str,
        image: Image,
        provenance: &[(String, String)],
        is_shown: bool,
    ) -> Result<Arc<Image>> {
        let mut provenance = provenance.to_vec();
        provenance.push(("id".to_owned(), id.to_owned()));
        provenance.push(("pixels".to_owned(), pixel_hash(&image.pixels)));
        let write = if is_shown { write_exr } else { write_exr_plain };
        write(&image_path(&self.out, id), &image, &provenance)?;
        let image = Arc::new(image);
        self.memory.insert(id.to_owned(), image.clone());
        Ok(image)
    }

    /// Lets go of images that nothing needs any more.
    pub fn release(&mut self, ids: &[String]) {
        for id in ids {
            self.memory.remove(id);
        }
    }
}

/// An image of the right size from disk that proves to be the one that was written ([`read_image`]).
pub fn stored(out: &Path, id: &str, size: Size, pixels: Option<&str>) -> Option<Image> {
    let image = read_image(out, id, pixels).ok()?;
    ((image.width, image.height) == (size.width, size.height)).then_some(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_taken_from_disk_only_if_it_is_the_one_written() {
        let folder = tempfile::tempdir().unwrap();
        let (size, other) = (Size { width: 3, height: 2 }, Size { width: 2, height: 3 });
        let mut images = Images::new(folder.path());
        let image = Image { width: 3, height: 2, pixels: vec![[0.5, -0.0, 7.0]; 6] };
        images.save("a", image.clone(), &[("seed".to_owned(), "1".to_owned())], false).unwrap();
        let hash = pixel_hash(&image.pixels);
        assert_eq!(stored(folder.path(), "a", size, None), Some(image.clone()));
        assert_eq!(stored(folder.path(), "a", size, Some(&hash)), Some(image.clone()));
        assert_eq!(stored(folder.path(), "a", size, Some("another")), None);
        assert_eq!(stored(folder.path(), "a", other, None), None);
        assert_eq!(stored(folder.path(), "b", size, None), None);
        std::fs::copy(image_path(folder.path(), "a"), image_path(folder.path(), "b")).unwrap();
        assert_eq!(stored(folder.path(), "b", size, None), None, "another item's image");
        assert!(images.held("a").is_some());
        images.release(&["a".to_owned()]);
        assert!(images.held("a").is_none());
        assert_eq!(images.load("a", size, None).as_deref(), Some(&image));
    }

    #[test]
    fn every_torn_or_flipped_image_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let size = Size { width: 4, height: 4 };
        let pixels: Vec<[f32; 3]> = (0..16).map(|i| [i as f32, 0.1 * i as f32, 1.0 / (1.0 + i as f32)]).collect();
        for is_shown in [true, false] {
            let image = Image { width: 4, height: 4, pixels: pixels.clone() };
            Images::new(folder.path()).save("a", image, &[], is_shown).unwrap();
            let path = image_path(folder.path(), "a");
            let good = std::fs::read(&path).unwrap();
            let image = stored(folder.path(), "a", size, None).unwrap();
            for at in 0..good.len() {
                std::fs::write(&path, &good[..at]).unwrap();
                assert_eq!(stored(folder.path(), "a", size, None), None, "cut at {at}");
                let mut flipped = good.clone();
                flipped[at] ^= 0x10;
                std::fs::write(&path, &flipped).unwrap();
                // A flip in what no reader looks at leaves the pixels as they were; no flip may change them unnoticed.
                let read = stored(folder.path(), "a", size, None);
                assert!(read.is_none_or(|read| read == image), "flipped at {at}");
            }
        }
    }
}
