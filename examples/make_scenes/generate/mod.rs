//! The scenes: what stands in them, and how they become OBJ, MTL and PNG files.

pub mod bokeh;
pub mod checkerpots;
pub mod cornell;
pub mod horizon;
pub mod many_lights;
pub mod marble;
pub mod obj;
pub mod penumbra;
pub mod solids;
pub mod teapot;

use std::path::Path;

use sampler_lab::error::Result;

/// Writes all scenes below `folder`, one folder a scene; files of the same name are replaced.
///
/// # Errors
/// Kind `Write` where a file cannot be written.
pub fn write_all(folder: &Path) -> Result<()> {
    checkerpots::write(&folder.join("checkerpots"))?;
    cornell::write(&folder.join("cornell"))?;
    penumbra::write(&folder.join("penumbra"))?;
    bokeh::write(&folder.join("bokeh"))?;
    many_lights::write(&folder.join("many-lights"))?;
    horizon::write(&folder.join("horizon"))
}
