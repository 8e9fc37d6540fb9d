//! What only the system itself can be asked, where no safe call does.

#![expect(unsafe_code, reason = "dispositions of signals have no safe call")]

use nix::sys::signal::{SigHandler, Signal, signal};

/// Those signals that end a process of which this one was told to take no notice, as `nohup` does and shells do for what
/// scripts start in the background.
pub(crate) fn ignored_ends() -> Vec<Signal> {
    [Signal::SIGHUP, Signal::SIGINT, Signal::SIGTERM].into_iter().filter(|end| is_ignored(*end)).collect()
}

/// Takes no notice of a signal from now on.
pub(crate) fn ignore(end: Signal) {
    // SAFETY: what is installed runs no code, so none that a handler must not.
    let _ = unsafe { signal(end, SigHandler::SigIgn) };
}

fn is_ignored(end: Signal) -> bool {
    // SAFETY: what is installed runs no code.
    match unsafe { signal(end, SigHandler::SigIgn) } {
        Ok(SigHandler::SigIgn) => true,
        Ok(before) => {
            // SAFETY: as it was.
            let _ = unsafe { signal(end, before) };
            false
        }
        Err(_) => false,
    }
}
