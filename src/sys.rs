//! System calls that have no safe wrapper.

#![expect(unsafe_code, reason = "dispositions of signals have no safe call")]

use nix::sys::signal::{SigHandler, Signal, signal};

/// Signals that would end this process but that it was started to ignore, as `nohup` does and shells do for background jobs
/// of scripts.
pub(crate) fn ignored_ends() -> Vec<Signal> {
    [Signal::SIGHUP, Signal::SIGINT, Signal::SIGTERM].into_iter().filter(|end| is_ignored(*end)).collect()
}

/// Ignores a signal from now on.
pub(crate) fn ignore(end: Signal) {
    // SAFETY: `SigIgn` runs no code, so none that is forbidden in a signal handler.
    let _ = unsafe { signal(end, SigHandler::SigIgn) };
}

fn is_ignored(end: Signal) -> bool {
    // SAFETY: `SigIgn` runs no code.
    match unsafe { signal(end, SigHandler::SigIgn) } {
        Ok(SigHandler::SigIgn) => true,
        Ok(before) => {
            // SAFETY: restores the disposition that was installed before.
            let _ = unsafe { signal(end, before) };
            false
        }
        Err(_) => false,
    }
}
