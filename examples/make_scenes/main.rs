//! Writes every scene under `data/`: `cargo run --release --example make_scenes [FOLDER]`.
//!
//! The same program writes the same bytes on every machine: transcendental functions come from `libm`, noise from an
//! integer hash, and nothing reads a clock. `tests/scene_data.rs` holds the committed files to that.

mod generate;

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let folder = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/data")), PathBuf::from);
    match generate::write_all(&folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            ExitCode::from(e.exit_code())
        }
    }
}
