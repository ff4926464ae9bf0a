//! `compare`: images of any renderer against a reference.

use std::path::{Path, PathBuf};

use clap::Args;
use sampler_lab::compare::{
    Comparison, Gate, ImageErrors, LOOKING, Reference, ReplicatesErrors, Viewing, check_memory, difference,
    mean_picture,
};
use sampler_lab::error::{Error, Result};
use sampler_lab::film::{DEFAULT_EXPOSURE, Picture, read_picture, write_exr, write_pfm};
use sampler_lab::report::pictures::{error_map, error_scale};
use sampler_lab::stats::flip::DEFAULT_PPD;

use super::{print, print_json, say};

/// Arguments of `compare`.
#[derive(Args)]
pub struct Compare {
    /// Images to judge: OpenEXR, PFM or PNG
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
    /// What they are compared with
    #[arg(long, value_name = "FILE")]
    reference: PathBuf,
    /// A second reference, independent of the first and as noisy: errors without the references' noise
    #[arg(long, value_name = "FILE")]
    reference2: Option<PathBuf>,
    /// The images are independent replicates of one estimator: errors of that, with 95 % intervals
    #[arg(long)]
    replicates: bool,
    /// Layer to read (names as in the file: "diffuse" for diffuse.R); a file's only layer without a name is read all the same
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Write image − reference: linear .exr or .pfm, or .png in red (brighter) and blue (darker)
    #[arg(long, value_name = "FILE")]
    diff: Option<PathBuf>,
    /// Demand such as "rmse < 0.1 and bias > -0.01"; METRIC.low and METRIC.high are the interval's ends
    #[arg(long, value_name = "EXPR")]
    gate: Option<String>,
    /// For flip: exposure at which radiance is shown; a PNG is shown as it is
    #[arg(long, value_name = "E", default_value_t = DEFAULT_EXPOSURE)]
    exposure: f32,
    /// For flip: pixels a degree, as seen from 0.7 m on a screen 0.7 m wide with 3840 columns
    #[arg(long, value_name = "N", default_value_t = DEFAULT_PPD)]
    ppd: f64,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Say nothing but errors on stderr
    #[arg(long, short)]
    quiet: bool,
}

impl Compare {
    /// Reads, measures, writes the difference, prints, and judges.
    pub fn run(self) -> Result<()> {
        let gate = self.gate.as_deref().map(Gate::parse).transpose()?;
        if let Some(gate) = &gate {
            gate.check(self.reference2.is_some(), self.replicates)?;
        }
        self.check_arguments()?;
        let viewing = Viewing::new(self.ppd, self.exposure)?;
        let diff = self.diff.as_deref().map(|path| Ok((path, DiffFormat::of(path)?))).transpose()?;
        let reference = self.read_reference()?.viewed(viewing);
        // References with their mean; one image at a time, or all of them with theirs, and a difference; and looking at two.
        let references = if self.reference2.is_some() { 3 } else { 1 };
        let images = if self.replicates { self.images.len() + 1 } else { 1 };
        check_memory(references + images + usize::from(diff.is_some()) + LOOKING, reference.mean())?;

        let names = [Some(&self.reference), self.reference2.as_ref()].map(|path| path.map(|p| p.display().to_string()));
        let [name, name2] = &names;
        let mut found = Comparison::new(&reference, name.as_deref().unwrap_or_default(), name2.as_deref());
        let mut kept = Vec::new();
        for path in &self.images {
            let file = path.display().to_string();
            let image = self.read(path)?;
            let notes = reference.check(&file, &image)?;
            if self.replicates {
                let others = found.images.iter().map(|other| other.file.as_str()).zip(&kept);
                reference.check_replicate(&file, &image, others)?;
            }
            self.note(path, &notes);
            found.images.push(ImageErrors { file, nonfinite: 0, errors: reference.errors(&image) });
            if self.replicates || diff.is_some() {
                kept.push(image);
            }
        }
        if self.replicates {
            let errors: Vec<_> = found.images.iter().map(|image| image.errors.clone()).collect();
            found.replicates = Some(ReplicatesErrors { count: kept.len(), errors: reference.ensemble(&kept, &errors) });
        }
        found.gate = gate.map(|gate| gate.judge(&found)).transpose()?;
        if let Some((path, format)) = diff {
            let image = if kept.len() == 1 { kept.swap_remove(0) } else { mean_picture(&kept) };
            self.write_difference(path, format, &image, reference.mean())?;
        }
        if self.json {
            print_json(&found)?
        } else {
            print(&found.to_string())?
        }
        match found.gate.filter(|gate| !gate.passed) {
            Some(gate) => Err(Error::failed("--gate", gate.failures.join("; "))),
            None => Ok(()),
        }
    }

    /// What can be refused before a file is read.
    fn check_arguments(&self) -> Result<()> {
        if self.replicates && self.images.len() < 2 {
            return Err(Error::input("--replicates", "expected at least 2 images, found 1"));
        }
        let real = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let images: Vec<PathBuf> = self.images.iter().map(|path| real(path)).collect();
        let repeated = (1..images.len()).find(|&i| images[..i].contains(&images[i]));
        if let Some(i) = repeated.filter(|_| self.replicates) {
            let what = format!("expected independent images, found {} twice", self.images[i].display());
            return Err(Error::input("--replicates", what));
        }
        if let Some(diff) = &self.diff {
            if !self.replicates && self.images.len() > 1 {
                let what = format!("expected one image, or --replicates for their mean, found {} images", images.len());
                return Err(Error::input("--diff", what));
            }
            let inputs = [Some(&self.reference), self.reference2.as_ref()].into_iter().flatten();
            if inputs.map(|path| real(path)).chain(images).any(|input| input == real(diff)) {
                let what = format!("expected a file of its own, found {}, which is compared", diff.display());
                return Err(Error::input("--diff", what));
            }
        }
        Ok(())
    }

    fn read_reference(&self) -> Result<Reference> {
        let name = self.reference.display().to_string();
        let first = self.read(&self.reference)?;
        let Some(path) = &self.reference2 else { return Reference::new((&name, first), None) };
        let second = self.read(path)?;
        Reference::new((&name, first), Some((&path.display().to_string(), second)))
    }

    fn read(&self, path: &Path) -> Result<Picture> {
        let picture = read_picture(path, self.layer.as_deref())?;
        self.note(path, &picture.notes);
        Ok(picture)
    }

    fn note(&self, path: &Path, notes: &[String]) {
        if !self.quiet {
            for note in notes {
                say(format_args!("note: {}: {note}", path.display()));
            }
        }
    }

    fn write_difference(&self, path: &Path, format: DiffFormat, image: &Picture, reference: &Picture) -> Result<()> {
        let signed = difference(image, reference).to_image();
        if signed.pixels.as_flattened().iter().any(|c| !c.is_finite()) {
            return Err(Error::input("--diff", "expected differences that 32-bit numbers hold, found larger ones"));
        }
        match format {
            DiffFormat::Pfm => write_pfm(path, &signed),
            DiffFormat::Exr => {
                let text = |name: &str, value: String| (name.to_owned(), value);
                let images: Vec<String> = self.images.iter().map(|image| image.display().to_string()).collect();
                let references = [Some(&self.reference), self.reference2.as_ref()].into_iter().flatten();
                let references: Vec<String> = references.map(|path| path.display().to_string()).collect();
                let provenance = [
                    text("version", env!("CARGO_PKG_VERSION").to_owned()),
                    text("kind", "difference".to_owned()),
                    text("images", images.join(" ")),
                    text("reference", references.join(" ")),
                ];
                write_exr(path, &signed, &provenance)
            }
            DiffFormat::Png => {
                let (image, reference) = (image.to_image(), reference.to_image());
                let scale = error_scale([&image], &reference)?;
                error_map(&image, &reference, scale)?.write(path)?;
                let note =
                    format!("luminance − reference, full red at +{scale} and more, full blue at −{scale} and less");
                self.note(path, &[note]);
                Ok(())
            }
        }
    }
}

/// What a difference is written as, by its name's end.
#[derive(Clone, Copy)]
enum DiffFormat {
    Exr,
    Pfm,
    Png,
}

impl DiffFormat {
    fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("pfm") => Ok(Self::Pfm),
            Some("png") => Ok(Self::Png),
            _ => {
                let what = format!("expected a name that ends in .exr, .pfm or .png, found \"{}\"", path.display());
                Err(Error::input("--diff", what))
            }
        }
    }
}
