//! `run` and `report`: experiments.

use clap::Args;
use sampler_lab::error::Result;
/// Arguments of `run`.
#[derive(Args)]
pub struct Run {}
impl Run {
    /// tmp
    pub fn run(self) -> Result<()> {
        Ok(())
    }
}
/// Arguments of `report`.
#[derive(Args)]
pub struct Report {}
impl Report {
    /// tmp
    pub fn run(self) -> Result<()> {
        Ok(())
    }
}
