//! Pictures against stored ones: 96×72 pixels, one feature each.
//!
//! A picture is compared with `tests/golden/NAME.png`. Pixels are equal on every machine by construction, but the encoder may
//! round the last code differently after a harmless change, so a few steps are tolerated: a pixel is *off* when a channel differs
//! by more than [`STEP`], and at most [`MOST_OFF`] of the pixels may be. A failure leaves `expected | difference × 8 | actual` in
//! `target/tmp/golden/NAME.png`.
//!
//! `MESHRAY_RECORD=1 cargo test --test main golden` stores the pictures as rendered now, and fails: look at them, then run again
//! without it.

mod lobes;
mod pictures;
pub mod sheet;

use crate::common::root;
use meshray::image::diff::{Space, compare, side_by_side};
use meshray::image::{FileKind, Metadata, Output, Picture, ToneMap, decode, encode};
use std::path::{Path, PathBuf};

/// Greatest tolerated difference of a display code (0..=1): two of 255 steps.
const STEP: f64 = 2.5 / 255.0;
/// Fraction of the pixels that may differ by more.
const MOST_OFF: f64 = 0.002;
/// Enough for every picture here.
const MAX_PIXELS: u64 = 1 << 20;

/// Output settings of golden pictures: the values as rendered, transparency kept.
fn plain() -> Output {
    Output { tone_map: ToneMap::None, ..Output::default() }
}

/// Compares a picture with the stored one of that name, or stores it.
#[track_caller]
fn check(name: &str, picture: &Picture) {
    check_all(&[(name, picture, &plain())]);
}

/// Compares pictures with the stored ones of their names, or stores them all.
#[track_caller]
fn check_all(pictures: &[(&str, &Picture, &Output)]) {
    let recording = std::env::var_os("MESHRAY_RECORD").is_some();
    let scratch = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden");
    let mut faults = Vec::new();
    for &(name, picture, output) in pictures {
        let bytes = encode(picture, FileKind::Png, output, &Metadata::default()).unwrap();
        let stored = root().join("tests/golden").join(format!("{name}.png"));
        if recording {
            std::fs::write(&stored, bytes).unwrap();
            faults.push(format!("stored {}: look at it, then run again without MESHRAY_RECORD", stored.display()));
        } else {
            faults.extend(judge(name, std::fs::read(&stored).ok().as_deref(), &bytes, &scratch).err());
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Compares `actual` with the stored file; on failure returns the reason and leaves a comparison picture in `folder`.
fn judge(name: &str, stored: Option<&[u8]>, actual: &[u8], folder: &Path) -> Result<(), String> {
    let actual = decode(actual, MAX_PIXELS).map_err(|e| e.to_string())?;
    let Some(stored) = stored else {
        let seen = leave(name, &actual, folder);
        return Err(format!("{name}: no picture is stored; what was rendered is in {}", seen.display()));
    };
    let expected = decode(stored, MAX_PIXELS).map_err(|e| format!("{name}: {e}"))?;
    let difference = compare(&expected, &actual, Space::Display, STEP);
    let fault = match difference {
        None => format!("{}×{}, stored is {}×{}", actual.width, actual.height, expected.width, expected.height),
        Some(d) if d.over as f64 <= d.pixels as f64 * MOST_OFF => return Ok(()),
        Some(d) => format!("{} of {} pixels are off, by {:.0}/255 at most", d.over, d.pixels, d.max * 255.0),
    };
    let seen = leave(name, &side_by_side(&expected, &actual, 8.0), folder);
    Err(format!("{name}: {fault}; expected, difference, actual: {}", seen.display()))
}

fn leave(name: &str, picture: &Picture, folder: &Path) -> PathBuf {
    std::fs::create_dir_all(folder).unwrap();
    let path = folder.join(format!("{name}.png"));
    std::fs::write(&path, encode(picture, FileKind::Png, &plain(), &Metadata::default()).unwrap()).unwrap();
    path
}

#[test]
fn a_difference_fails_and_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let grey = |width: u32, odd: f32| {
        let mut beauty = vec![[0.5, 0.5, 0.5, 1.0]; width as usize * 10];
        beauty[7][0] = odd;
        let picture = Picture::of(width, 10, beauty);
        encode(&picture, FileKind::Png, &plain(), &Metadata::default()).unwrap()
    };
    let stored = grey(10, 0.5);
    assert_eq!(judge("same", Some(&stored), &stored, folder.path()), Ok(()));
    assert_eq!(judge("near", Some(&stored), &grey(10, 0.504), folder.path()), Ok(()));

    let fault = judge("off", Some(&stored), &grey(10, 0.6), folder.path()).unwrap_err();
    assert!(fault.contains("1 of 100 pixels"), "{fault}");
    let drawn = meshray::image::read_picture(&folder.path().join("off.png")).unwrap();
    assert_eq!((drawn.width, drawn.height), (30, 10));
    // The middle third, the difference, is black but for the pixel that is off.
    assert!(drawn.beauty[17][0] > 0.1 && drawn.beauty[16][..3] == [0.0; 3]);

    assert!(judge("size", Some(&stored), &grey(11, 0.5), folder.path()).unwrap_err().contains("11×10"));
    assert!(judge("new", None, &stored, folder.path()).unwrap_err().contains("no picture is stored"));
    assert!(folder.path().join("new.png").exists());
}

#[test]
fn every_stored_picture_belongs_to_a_test() {
    let sources = [include_str!("lobes.rs"), include_str!("pictures.rs")];
    for entry in std::fs::read_dir(root().join("tests/golden")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let Some(name) = name.strip_suffix(".png") else { continue };
        let quoted = format!("\"{name}\"");
        assert!(sources.iter().any(|source| source.contains(&quoted)), "nothing renders tests/golden/{name}.png");
    }
}
