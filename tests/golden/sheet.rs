//! A contact sheet of all third-party models, 16×16 pixels each, in the order of a list of names beside it.

use crate::common::root;
use image::{ImageFormat, Rgb, RgbImage};
use meshray::image::Picture;
use meshray::image::srgb::encode8;
use std::path::PathBuf;

/// Side of a tile in pixels, and number of tiles in a row.
const SIDE: u32 = 16;
const ROW: u32 = 20;

/// Tolerated mean difference of a tile's display codes: edges of models may move by a sample.
const STEP: f64 = 3.0;

/// Background of the models.
const GREY: f32 = 0.2;

/// Tiles, with the names of their models.
#[derive(Default)]
pub struct Sheet {
    tiles: Vec<(String, RgbImage)>,
}

impl Sheet {
    /// Adds a reduced copy of a picture whose sides are multiples of the tile's.
    pub fn add(&mut self, name: &str, picture: &Picture) {
        let (columns, rows) = (picture.width / SIDE, picture.height / SIDE);
        let tile = RgbImage::from_fn(SIDE, SIDE, |x, y| {
            let pixels = (0..rows).flat_map(|j| (0..columns).map(move |i| (x * columns + i, y * rows + j)));
            let mut sum = [0.0; 3];
            for (i, j) in pixels {
                let [r, g, b, alpha] = picture.beauty[(j * picture.width + i) as usize];
                let over = [r, g, b].map(|c| c + (1.0 - alpha) * GREY);
                sum = [0, 1, 2].map(|k| sum[k] + over[k]);
            }
            Rgb(sum.map(|c| encode8(c / (columns * rows) as f32)))
        });
        self.tiles.push((name.to_owned(), tile));
    }

    /// Compares the tiles with the stored ones, and returns the differences by name; with `MESHRAY_RECORD`, stores the sheet
    /// anew.
    pub fn faults(&self) -> Vec<String> {
        let (picture, names) = (stored("png"), stored("txt"));
        if std::env::var_os("MESHRAY_RECORD").is_some() {
            self.whole().save_with_format(&picture, ImageFormat::Png).unwrap();
            let list: String = self.tiles.iter().map(|(name, _)| format!("{name}\n")).collect();
            std::fs::write(names, list).unwrap();
            return vec![format!("stored {}: look at it, then run again without MESHRAY_RECORD", picture.display())];
        }
        let list = std::fs::read_to_string(names).unwrap();
        let whole = image::open(picture).unwrap().into_rgb8();
        let mut faults = Vec::new();
        for (name, tile) in &self.tiles {
            let Some(at) = (0u32..).zip(list.lines()).find(|(_, listed)| listed == name).map(|(at, _)| at) else {
                faults.push(format!("{name}: no small picture of it is stored"));
                continue;
            };
            let pairs = tile.enumerate_pixels().flat_map(|(x, y, own)| {
                let other = whole.get_pixel(at % ROW * SIDE + x, at / ROW * SIDE + y);
                own.0.into_iter().zip(other.0)
            });
            let difference: f64 = pairs.map(|(a, b)| f64::from(a.abs_diff(b))).sum();
            let mean = difference / f64::from(SIDE * SIDE * 3);
            if mean > STEP {
                faults.push(format!("{name}: looks otherwise than stored, by {mean:.1}/255 on average"));
            }
        }
        let gone = list.lines().filter(|listed| !self.tiles.iter().any(|(name, _)| name == listed));
        faults.extend(gone.map(|name| format!("{name}: was drawn and is not any more")));
        faults
    }

    fn whole(&self) -> RgbImage {
        let rows = self.tiles.len().div_ceil(ROW as usize);
        let mut whole = RgbImage::new(ROW * SIDE, rows as u32 * SIDE);
        for (at, (_, tile)) in (0u32..).zip(&self.tiles) {
            let (x, y) = (at % ROW * SIDE, at / ROW * SIDE);
            image::imageops::replace(&mut whole, tile, x.into(), y.into());
        }
        whole
    }
}

fn stored(extension: &str) -> PathBuf {
    root().join("tests/sweep").with_extension(extension)
}
