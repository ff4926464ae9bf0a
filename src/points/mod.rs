//! Point sets as files and as numbers: what `points` writes and `measure` reads and tells.

mod csv;
mod measure;

pub use csv::{read_csv, read_csv_file, to_csv};
pub use measure::{
    L2Values, Measurement, Options, Root, SPECTRUM_LIMIT, SamplerSource, SpectrumSummary, StarValue, measure,
    spectrum_csv, spectrum_reach,
};
