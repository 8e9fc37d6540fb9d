//! Ctrl-C and termination signals: the command ends within a second and leaves no half file behind.
//!
//! While nothing has to be saved, the process ends at once. While a picture is being written, or when `--keep-partial`
//! wants the tiles that are done, the first signal only raises a flag that the worker looks at; a second one ends the
//! process whatever it does.

use super::exit::Exit;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

static RAISED: AtomicBool = AtomicBool::new(false);
static SOMETHING_TO_SAVE: AtomicBool = AtomicBool::new(false);

/// Installs the handler. Where the system refuses one, signals keep their usual effect.
pub(super) fn install() {
    let _ = ctrlc::set_handler(|| {
        let second = RAISED.swap(true, Ordering::SeqCst);
        if second || !SOMETHING_TO_SAVE.load(Ordering::SeqCst) {
            // The progress bar may have left the cursor in mid-line.
            let _ = writeln!(std::io::stderr(), "\nmeshray: interrupted");
            std::process::exit(i32::from(Exit::Interrupted.code()));
        }
    });
}

/// Whether a signal came.
pub(super) fn raised() -> bool {
    RAISED.load(Ordering::SeqCst)
}

/// While the value lives, the first signal only raises the flag.
#[must_use]
pub(super) struct Guard(());

impl Guard {
    /// Starts to guard.
    pub(super) fn new() -> Self {
        SOMETHING_TO_SAVE.store(true, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        SOMETHING_TO_SAVE.store(false, Ordering::SeqCst);
    }
}
