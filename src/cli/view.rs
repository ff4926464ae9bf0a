//! `view`: the live view in a browser.

use std::path::PathBuf;

use clap::Args;
use sampler_lab::error::Result;
use sampler_lab::view::{Options, Server};

use super::{SceneArgs, WorkArgs, print, say, signals};

/// Arguments of `view`.
#[derive(Args)]
pub struct View {
    /// Scene file; none begins with an empty scene
    scene: Option<PathBuf>,
    /// Port on 127.0.0.1; 0 takes one that is free
    #[arg(long, value_name = "P", default_value_t = 7575)]
    port: u16,
    /// What is saved from the page goes into the first folder of --data
    #[command(flatten)]
    files: SceneArgs,
    #[command(flatten)]
    work: WorkArgs,
}

impl View {
    /// Serves until Ctrl-C.
    pub fn run(self) -> Result<()> {
        self.work.start_threads()?;
        let options = Options {
            scene: self.scene.clone(),
            data: self.files.data.clone(),
            sets: self.files.set.clone(),
            port: self.port,
        };
        let server = Server::bind(&options)?;
        let stop = signals::stop_flag()?;
        self.work.warn(server.warnings());
        print(&format!("{}\n", server.address()))?;
        if !self.work.quiet {
            say(format_args!("open the address above in a browser on this machine; Ctrl-C ends"));
        }
        server.serve(&stop)
    }
}
