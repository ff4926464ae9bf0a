//! What the system may tell a process: to end, and that a file must not grow.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use sampler_lab::error::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Makes the limit on the size of files an error of the write that meets it, with a message: by default the system ends
/// the process without a word.
pub fn survive_file_limit() -> Result<()> {
    #[cfg(unix)]
    flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false))).map_err(|e| refused(&e))?;
    Ok(())
}

/// A flag that an interrupt (Ctrl-C) or a request to end sets; a second one ends the process at once.
pub fn stop_flag() -> Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal finds the flag unset and sets it, the second finds it set.
        flag::register_conditional_shutdown(signal, 130, stop.clone()).map_err(|e| refused(&e))?;
        flag::register(signal, stop.clone()).map_err(|e| refused(&e))?;
    }
    Ok(stop)
}

fn refused(e: &std::io::Error) -> Error {
    Error::input("signals", format!("expected the system to let signals be handled, found: {e}"))
}
