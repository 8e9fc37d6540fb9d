//! Ctrl-C and termination signals: the command ends within a second and leaves no partial file.
//!
//! While nothing has to be saved, the process ends at once. While a file is written, or when `--keep-partial` wants the finished
//! tiles, the first signal only raises a flag that the workers poll; a second one always ends the process.

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
/// Number of guards that require something to be saved.
static GUARDS: Mutex<usize> = Mutex::new(0);
/// Format of the final message.
static FORMAT: OnceLock<Format> = OnceLock::new();

fn guards() -> MutexGuard<'static, usize> {
    GUARDS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Installs the handler, with the format of its message. If the system refuses it, signals keep their usual effect.
pub(super) fn install(format: Format) {
    FORMAT.get_or_init(|| format);
    #[cfg(unix)]
    let ignored = sys::ignored_ends();
    let _ = ctrlc::set_handler(|| {
        // Held until the process has ended, so that no new guard can begin.
        let guards = guards();
        let second = RAISED.swap(true, Ordering::SeqCst);
        if second || *guards == 0 {
            end();
        }
    });
    // The handler takes over all termination signals; those that the parent process had ignored stay ignored.
    #[cfg(unix)]
    ignored.into_iter().for_each(sys::ignore);
}

fn end() -> ! {
    message::tell_all_apart();
    let mut stderr = io::stderr();
    // The progress bar may have left the cursor in the middle of a line.
    let line = if stderr.is_terminal() { "\n" } else { "" };
    let format = FORMAT.get().copied().unwrap_or_default();
    let _ = writeln!(stderr, "{line}{}", message::of_signal(format));
    std::process::exit(i32::from(Exit::Interrupted.code()));
}

/// Whether a signal has arrived.
pub(super) fn raised() -> bool {
    RAISED.load(Ordering::SeqCst)
}

/// While a guard lives, the first signal only raises the flag.
#[must_use]
pub(super) struct Guard(());

impl Guard {
    /// Begins to guard.
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

/// Writes a file completely or not at all (see [`image::write_atomic`]); a signal meanwhile ends the process after the write,
/// unless another guard is alive.
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
