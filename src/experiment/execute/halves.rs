//! References as images of their own, for `compare` and other programs ([`results::reference_path`]).

use std::path::Path;
use std::sync::Arc;

use super::{Run, results, write_exr};
use crate::error::{Error, Result};
use crate::experiment::growth::Sums;
use crate::experiment::identity::pixel_hash;
use crate::experiment::images::stored;
use crate::experiment::plan::{ReferenceSource, ReferenceWork, Work, WorkItem};
use crate::experiment::results::{ReferenceRow, Row};
use crate::film::Image;

impl Run<'_> {
    /// Leaves every reference whose row is there as images of its own, where what it is made of is on disk; images of
    /// another reference, from before something changed, go. Renders nothing.
    ///
    /// # Errors
    /// Kind `Write`.
    pub(super) fn keep_references(&self) -> Result<()> {
        for item in &self.plan.items {
            let (Work::Reference(work), Some(Row::Reference(row))) = (&item.work, self.rows.get(&item.id)) else {
                continue;
            };
            let paths = work.source.parts().iter();
            let paths = paths.map(|part| (*part, results::reference_path(self.out, &work.scene, item.is_shown, part)));
            let is_right = |path: &Path| results::read_image_at(path, &item.id, None).is_ok();
            if paths.clone().all(|(_, path)| is_right(&path)) {
                continue;
            }
            let images = self.stored_halves(item, work, row).into_iter().flatten().map(Some);
            for ((part, path), image) in paths.zip(images.chain(std::iter::repeat(None))) {
                match image {
                    Some(image) => write_exr(&path, &image, &self.reference_provenance(item, work, row, part, &image))?,
                    None if path.exists() => {
                        std::fs::remove_file(&path).map_err(|e| Error::write(&path, format!("cannot remove: {e}")))?;
                    }
                    None => {}
                }
            }
        }
        Ok(())
    }

    /// The images that a reference is to be had as, out of what is on disk; `None` where something is not.
    fn stored_halves(&self, item: &WorkItem, work: &ReferenceWork, row: &ReferenceRow) -> Option<Vec<Arc<Image>>> {
        let image = |id: &str| {
            let pixels = self.rows.get(id).and_then(Row::kept_pixels);
            stored(self.out, id, work.size, pixels).map(Arc::new)
        };
        match &work.source {
            ReferenceSource::Exact => Some(vec![image(&item.id)?]),
            ReferenceSource::Halves { ids, growth: None, .. } => ids.iter().map(|id| image(id)).collect(),
            ReferenceSource::Halves { growth: Some(growth), .. } => {
                let mut sums = Sums::new(work.size.pixels() as usize);
                let [a, b] = &growth.batches;
                for (a, b) in a.iter().zip(b).take(row.growth.as_ref()?.batches as usize) {
                    sums.add([&image(a)?.pixels, &image(b)?.pixels]);
                }
                let image = |pixels| Image { width: work.size.width, height: work.size.height, pixels };
                Some(sums.means().map(image).map(Arc::new).to_vec())
            }
        }
    }

    /// What such an image says of its making.
    fn reference_provenance(
        &self,
        item: &WorkItem,
        work: &ReferenceWork,
        row: &ReferenceRow,
        part: &str,
        image: &Image,
    ) -> Vec<(String, String)> {
        let mut provenance = self.provenance(item);
        let mut add = |name: &str, value: String| provenance.push((name.to_owned(), value));
        add("scene", work.scene.clone());
        if let ReferenceSource::Halves { sampler, spp, .. } = &work.source {
            add("sampler", sampler.clone());
            add("spp", spp.taken.to_string());
            add("batches", row.growth.as_ref().map_or(1, |growth| growth.batches).to_string());
        }
        add("half", part.to_owned());
        add("id", item.id.clone());
        add("pixels", pixel_hash(&image.pixels));
        provenance
    }
}
