//! The command line: each command a few lines onto the library.

// A stderr that cannot be written to is no reason to panic: `cli::say`.
#![deny(clippy::print_stderr, clippy::print_stdout)]

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match cli::Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            cli::say(format_args!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}
