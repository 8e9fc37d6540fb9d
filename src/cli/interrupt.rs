//! Ctrl-C and termination signals: the command ends within a second and leaves no half file behind.
//!
//! While nothing has to be saved, the process ends at once. While a file is being written, or when `--keep-partial`
//! wants the tiles that are done, the first signal only raises a flag that the worker looks at; a second one ends the
//! process whatever it does.

use super::exit::Exit;
use super::message::{self, Format};
use crate::image;
#[cfg(unix)]
use crate::sys;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

static RAISED: AtomicBool = AtomicBool::new(false);
/// How many things have to be saved.
static GUARDS: Mutex<usize> = Mutex::new(0);
/// How the end is told.
static FORMAT: OnceLock<Format> = OnceLock::new();

fn guards() -> MutexGuard<'static, usize> {
    GUARDS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Installs the handler, which tells the end in this form. Where the system refuses one, signals keep their usual effect.
pub(super) fn install(format: Format) {
    FORMAT.get_or_init(|| format);
    #[cfg(unix)]
    let ignored = sys::ignored_ends();
    let _ = ctrlc::set_handler(|| {
        // Held until the process has ended, so that nothing begins that would have to be saved.
        let guards = guards();
        let second = RAISED.swap(true, Ordering::SeqCst);
        if second || *guards == 0 {
            end();
        }
    });
    // The handler takes all signals that end a process; whoever started this one may have wanted it to go on.
    #[cfg(unix)]
    ignored.into_iter().for_each(sys::ignore);
}

fn end() -> ! {
    message::tell_all_apart();
    let mut stderr = io::stderr();
    // The progress bar may have left the cursor in mid-line.
    let line = if stderr.is_terminal() { "\n" } else { "" };
    let format = FORMAT.get().copied().unwrap_or_default();
    let _ = writeln!(stderr, "{line}{}", message::of_signal(format));
    std::process::exit(i32::from(Exit::Interrupted.code()));
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
        *guards() += 1;
        Self(())
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        *guards() -= 1;
    }
}

/// Writes a file whole or not at all (see [`image::write_atomic`]); a signal that comes meanwhile ends the process when that is
/// done, unless something else is to be saved.
pub(super) fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let guard = Guard::new();
    let written = image::write_atomic(path, bytes);
    drop(guard);
    let guards = guards();
    if raised() && *guards == 0 {
        end();
    }
    written
}
