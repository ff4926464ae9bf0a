//! What items find, as rows.

use std::sync::Arc;

use super::Run;
use crate::error::Result;
use crate::experiment::identity::pixel_hash;
use crate::experiment::measure;
use crate::experiment::pixels;
use crate::experiment::plan::{EnsembleWork, ImageWork, PointsWork, ReferenceSource, ReferenceWork, WorkItem};
use crate::experiment::results::{EnsembleRow, ImageErrors, ImageRow, Kind, PointsRow, ReferenceRow, Row, SCHEMA};
use crate::film::Image;
use crate::stats::t_interval;

impl Run<'_> {
    pub(super) fn image_row(&mut self, item: &WorkItem, work: &ImageWork) -> Result<ImageRow> {
        let image = self.image(&item.id)?;
        let errors: Option<ImageErrors> = match &work.reference_id {
            None => None,
            Some(id) => {
                let (reference, exposure) = (self.reference(id)?, self.plan.exposure(&work.scene));
                Some(measure::errors(&image, &reference, id, item.metrics_algorithm, exposure))
            }
        };
        let twin = match &work.twin {
            None => None,
            Some(id) => Some(measure::difference(&image, &*self.image(id)?, id)),
        };
        Ok(ImageRow {
            schema: SCHEMA,
            id: item.id.clone(),
            kind: work.kind,
            scene: work.scene.clone(),
            sampler: work.sampler.clone(),
            names: self.names(&work.sampler),
            spp: work.spp,
            replicate: work.replicate,
            batch: work.batch.as_ref().map_or(0, |batch| batch.number),
            seed: work.seed,
            estimator: work.estimator,
            stage: work.stage,
            variant: work.variant,
            size: work.size,
            mean: measure::mean_value(&image.pixels),
            pixels: pixel_hash(&image.pixels),
            twin,
            made_with: None,
            errors,
        })
    }

    pub(super) fn reference_row(&mut self, item: &WorkItem, work: &ReferenceWork) -> Result<ReferenceRow> {
        let (reference, noise_mse, growth) = match self.plan.growth(&item.id) {
            Some(_) => {
                let grown = self.grown(&item.id)?;
                (grown.images, grown.noise_mse, Some(grown.growth))
            }
            None => {
                let reference = self.reference(&item.id)?;
                (reference.clone(), reference.noise_mse(), None)
            }
        };
        let (sampler, spp, halves) = match &work.source {
            ReferenceSource::Exact => ("exact".to_owned(), None, None),
            ReferenceSource::Halves { ids, sampler, spp, .. } => (sampler.clone(), Some(*spp), Some(ids.clone())),
        };
        Ok(ReferenceRow {
            schema: SCHEMA,
            id: item.id.clone(),
            kind: Kind::Reference,
            scene: work.scene.clone(),
            sampler,
            spp,
            size: work.size,
            focal_depth: self.backend.focal_depth(&work.scene, work.size),
            halves,
            growth,
            metrics_algorithm: item.metrics_algorithm,
            noise_mse,
            mean: reference.mean_value(),
            pixels: reference.pixels(),
            made_with: None,
        })
    }

    pub(super) fn ensemble_row(&mut self, item: &WorkItem, work: &EnsembleWork) -> Result<EnsembleRow> {
        let members: Vec<Arc<Image>> = work.members.iter().map(|id| self.image(id)).collect::<Result<_>>()?;
        let reference = self.reference(&work.reference_id)?;
        let spectrum = || work.variant.is_plain().then(|| Box::new(pixels::spectrum(&members, &reference)));
        let ((e, error_autocorrelation), error_spectrum) =
            rayon::join(|| measure::ensemble(&members, &reference), spectrum);
        let exposure = self.plan.exposure(&work.scene);
        // What a member's row says of the same comparison need not be looked at twice.
        let known = |id: &String| match self.rows.get(id) {
            Some(Row::Image(row)) => {
                row.errors
                    .as_ref()
                    .filter(|e| e.reference_id == work.reference_id && e.metrics_algorithm == item.metrics_algorithm)?
                    .flip
            }
            _ => None,
        };
        let flip =
            |(id, image): (&String, &Arc<Image>)| known(id).unwrap_or_else(|| reference.flip(image, exposure).mean);
        let flips: Vec<f64> = work.members.iter().zip(&members).map(flip).collect();
        Ok(EnsembleRow {
            schema: SCHEMA,
            id: item.id.clone(),
            kind: Kind::Ensemble,
            scene: work.scene.clone(),
            sampler: work.sampler.clone(),
            names: self.names(&work.sampler),
            spp: work.spp,
            estimator: work.estimator,
            variant: work.variant,
            size: work.size,
            reference_id: work.reference_id.clone(),
            metrics_algorithm: item.metrics_algorithm,
            replicates: members.len() as u32,
            mse: e.mse,
            rmse: e.rmse,
            rel_mse: e.rel_mse,
            bias2: e.bias2,
            variance: e.variance,
            bias: e.bias,
            error_autocorrelation,
            flip: Some(t_interval(&flips, 0.95).with_rounded_interval()),
            error_spectrum,
            members: work.members.clone(),
            made_with: None,
        })
    }

    pub(super) fn points_row(&mut self, item: &WorkItem, work: &PointsWork) -> Result<PointsRow> {
        let metrics = self.backend.point_metrics(&work.sampler, work.n.asked, work.seed, &work.metrics)?;
        Ok(PointsRow {
            schema: SCHEMA,
            id: item.id.clone(),
            kind: Kind::Points,
            sampler: work.sampler.clone(),
            names: self.names(&work.sampler),
            n: work.n,
            replicate: work.replicate,
            seed: work.seed,
            metrics_algorithm: item.metrics_algorithm,
            metrics,
            made_with: None,
        })
    }
}
