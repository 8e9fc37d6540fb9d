//! Every model somebody else made, in one process: loads, renders small, and stays sane.
//!
//! Runs only when `MESHRAY_SHARED` names the folder that holds `models/`; it says how many files it saw.

use meshray::accel::{AccelKind, AnyAccel};
use meshray::image::Picture;
use meshray::load::{LoadError, LoadOptions, Loaded, load};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};

const SIZE: u32 = 64;
const TIME_LIMIT: Duration = Duration::from_secs(20);
/// Part of the pixels a picture of a framed model covers at least.
const MIN_COVERAGE: f64 = 0.05;

fn shared_models() -> Option<PathBuf> {
    let folder = std::env::var_os("MESHRAY_SHARED").map(|s| PathBuf::from(s).join("models"));
    if folder.is_none() {
        println!("MESHRAY_SHARED is not set: 0 shared models");
    }
    folder
}

/// What became of one file.
#[derive(Debug)]
enum Outcome {
    /// A picture, with its coverage (0 … 1) and the number of warnings.
    Drawn { coverage: f64, warnings: usize },
    /// Loaded, but there is nothing to draw.
    Empty,
    /// Refused with this message.
    Refused(String),
    /// A panic, a NaN, or no answer in time: always a fault of ours.
    Broken(String),
}

/// Loads and renders one file on a thread of its own, so that a hang is an answer too.
fn try_file(path: &Path) -> Outcome {
    let (sender, receiver) = mpsc::channel();
    let file = path.to_owned();
    std::thread::spawn(move || {
        let outcome = catch_unwind(AssertUnwindSafe(|| draw(&file)));
        // The receiver is gone when the time limit has passed.
        let _ = sender.send(outcome.unwrap_or_else(|cause| Outcome::Broken(format!("panic: {}", panic_text(&*cause)))));
    });
    receiver.recv_timeout(TIME_LIMIT).unwrap_or_else(|_| Outcome::Broken(format!("no answer in {TIME_LIMIT:?}")))
}

fn panic_text(cause: &(dyn std::any::Any + Send)) -> String {
    let text = cause.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| cause.downcast_ref::<String>().cloned()).unwrap_or_default()
}

fn draw(path: &Path) -> Outcome {
    let Loaded { scene, warnings, .. } = match load(path, &LoadOptions::default()) {
        Ok(loaded) => loaded,
        Err(LoadError::Read { what, source }) => return Outcome::Refused(format!("{what}: {source}")),
        Err(LoadError::Input(faults)) => return Outcome::Refused(faults[0].to_string()),
    };
    let Some(picture) = crate::common::still(scene, AccelKind::GridOctree, SIZE, SIZE) else {
        return Outcome::Empty;
    };
    if picture.beauty.iter().flatten().any(|v| !v.is_finite()) {
        return Outcome::Broken("a pixel is not a number".into());
    }
    Outcome::Drawn { coverage: coverage(&picture), warnings: warnings.len() }
}

fn coverage(picture: &Picture) -> f64 {
    let covered = picture.beauty.iter().filter(|p| p[3] > 0.5).count();
    covered as f64 / picture.beauty.len() as f64
}
