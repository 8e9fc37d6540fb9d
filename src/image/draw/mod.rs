//! Drawings with letters and lines: heat maps with their scale, and pictures of structures.

mod glyphs;
pub mod heat;

use super::develop::{Raster, raster};
use super::{FileKind, ImageError, Metadata, Output, Picture, png};
use crate::math::DVec2;

/// An sRGB colour.
pub type Color = [u8; 3];

/// Opaque coloured pixels to draw on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width: u32,
    height: u32,
    /// Pixels, rows from the top.
    pixels: Vec<Color>,
}

impl Canvas {
    /// Canvas of one colour.
    pub fn filled(width: u32, height: u32, color: Color) -> Self {
        Self { width, height, pixels: vec![color; width as usize * height as usize] }
    }

    /// Number of columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Number of rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Colour of a pixel; `None` beyond the edge.
    pub fn pixel(&self, x: u32, y: u32) -> Option<Color> {
        (x < self.width).then(|| self.pixels.get(y as usize * self.width as usize + x as usize).copied()).flatten()
    }

    /// Sets a pixel; does nothing beyond the edge.
    pub fn set(&mut self, x: u32, y: u32, color: Color) {
        if x < self.width
            && let Some(pixel) = self.pixels.get_mut(y as usize * self.width as usize + x as usize)
        {
            *pixel = color;
        }
    }

    /// Fills a rectangle, as far as it lies on the canvas.
    pub fn fill(&mut self, x: u32, y: u32, width: u32, height: u32, color: Color) {
        for y in y..y.saturating_add(height).min(self.height) {
            for x in x..x.saturating_add(width).min(self.width) {
                self.set(x, y, color);
            }
        }
    }

    /// Writes a line of text, its top left corner at (x, y), each dot of a letter `scale` pixels wide.
    pub fn write(&mut self, x: u32, y: u32, text: &str, scale: u32, color: Color) {
        let mut left = x;
        for letter in text.chars() {
            for (row, bits) in (0..).zip(glyphs::rows(letter)) {
                for column in (0..glyphs::WIDTH).filter(|c| bits >> (glyphs::WIDTH - 1 - c) & 1 == 1) {
                    self.fill(left + column * scale, y + row * scale, scale, scale, color);
                }
            }
            left += text_width("x", scale) + scale;
        }
    }

    /// Canvas of a picture as it is displayed; transparent parts show `behind`, linear.
    pub fn of(picture: &Picture, behind: [f32; 3]) -> Self {
        let output = Output { background: Some(behind), ..Output::default() };
        let raster: Raster<u8> = raster(picture, &output);
        let pixels = raster.samples.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        Self { width: picture.width, height: picture.height, pixels }
    }

    /// Blends every pixel with a colour of opacity `part` (0 to 1).
    pub fn wash(&mut self, color: Color, part: f32) {
        self.pixels.iter_mut().for_each(|pixel| *pixel = mix(*pixel, color, part));
    }

    /// Copies another canvas to (x, y), as far as it fits.
    pub fn paste(&mut self, other: &Self, x: u32, y: u32) {
        for (row, pixels) in (y..).zip(other.pixels.chunks(other.width.max(1) as usize)) {
            (x..).zip(pixels).for_each(|(column, &color)| self.set(column, row, color));
        }
    }

    /// Draws a straight line between two points (pixel centres are at halves), `width` pixels wide, its sides antialiased, with
    /// opacity `part`. Points may lie anywhere.
    pub fn line(&mut self, from: DVec2, to: DVec2, width: f64, color: Color, part: f32) {
        let Some((from, to)) = self.clipped(from, to, width) else { return };
        let way = to - from;
        let length = way.length();
        let steep = way.y.abs() > way.x.abs();
        let turned = |p: DVec2| if steep { DVec2::new(p.y, p.x) } else { p };
        let (mut a, mut b) = (turned(from), turned(to));
        if a.x > b.x {
            std::mem::swap(&mut a, &mut b);
        }
        let slope = if b.x > a.x { (b.y - a.y) / (b.x - a.x) } else { 0.0 };
        // Distance of the sides from the middle along the minor axis.
        let cosine = if length > 0.0 { ((b.x - a.x) / length).max(0.5) } else { 1.0 };
        let reach = (width / 2.0 + 0.5) / cosine;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clipped to the canvas")]
        for major in (a.x - width / 2.0).max(0.0) as u32..=(b.x + width / 2.0).max(0.0) as u32 {
            let along = (f64::from(major) + 0.5).clamp(a.x, b.x);
            let middle = a.y + (along - a.x) * slope;
            for minor in (middle - reach).max(0.0) as u32..=(middle + reach).max(0.0) as u32 {
                let off = (f64::from(minor) + 0.5 - middle).abs() * cosine;
                let covered = (width / 2.0 + 0.5 - off).clamp(0.0, 1.0) as f32 * part;
                let (x, y) = if steep { (minor, major) } else { (major, minor) };
                self.blend(x, y, color, covered);
            }
        }
    }

    /// Fills a disc.
    pub fn disc(&mut self, center: DVec2, radius: f64, color: Color) {
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        let (lo, hi) = ((center - radius - 1.0).max(DVec2::ZERO), (center + radius + 1.0).min(size));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clipped to the canvas")]
        for y in lo.y as u32..hi.y.max(0.0) as u32 {
            for x in lo.x as u32..hi.x.max(0.0) as u32 {
                let off = (DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) - center).length();
                self.blend(x, y, color, (radius + 0.5 - off).clamp(0.0, 1.0) as f32);
            }
        }
    }

    fn blend(&mut self, x: u32, y: u32, color: Color, part: f32) {
        if let Some(old) = self.pixel(x, y) {
            self.set(x, y, mix(old, color, part));
        }
    }

    /// Visible part of a line (W. Cyrus, J. Beck, 1978, for a rectangle).
    fn clipped(&self, from: DVec2, to: DVec2, width: f64) -> Option<(DVec2, DVec2)> {
        let way = to - from;
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        let (mut near, mut far) = (0.0f64, 1.0f64);
        for k in 0..2 {
            let (lo, hi) = (-width - from[k], size[k] + width - from[k]);
            if way[k] == 0.0 {
                if lo > 0.0 || hi < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (lo / way[k], hi / way[k]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far && from.is_finite() && to.is_finite()).then(|| (from + way * near, from + way * far))
    }

    /// Encodes the canvas as a PNG file.
    pub fn png(&self, metadata: &Metadata) -> Result<Vec<u8>, ImageError> {
        let samples = self.pixels.as_flattened().to_vec();
        let raster = Raster { width: self.width, height: self.height, channels: 3, samples };
        png::write_bytes(&raster, metadata).map_err(|e| ImageError::encode(FileKind::Png, e))
    }
}

/// Interpolates between two colours, the second of weight `part`.
fn mix(a: Color, b: Color, part: f32) -> Color {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two bytes")]
    [0, 1, 2].map(|k| (f32::from(a[k]) * (1.0 - part) + f32::from(b[k]) * part).round() as u8)
}

/// Width of a line of text, in pixels.
pub fn text_width(text: &str, scale: u32) -> u32 {
    let letters = u32::try_from(text.chars().count()).unwrap_or(u32::MAX / 64);
    (letters * (glyphs::WIDTH + 1)).saturating_sub(1) * scale
}

/// Height of a line of text, in pixels.
pub const fn text_height(scale: u32) -> u32 {
    glyphs::HEIGHT * scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_covers_what_it_should_and_may_run_over_every_edge() {
        let mut canvas = Canvas::filled(6, 5, [0; 3]);
        canvas.line(DVec2::new(-40.0, 2.5), DVec2::new(4.0, 2.5), 1.0, [255; 3], 1.0);
        let light =
            |canvas: &Canvas, y: u32| (0..6).map(|x| canvas.pixel(x, y).map_or(0, |c| c[0])).collect::<Vec<_>>();
        assert_eq!([light(&canvas, 1), light(&canvas, 2)], [[0; 6], [255, 255, 255, 255, 255, 0]]);
        canvas.line(DVec2::new(5.5, -1e9), DVec2::new(5.5, 1e9), 1.0, [90; 3], 1.0);
        assert_eq!([light(&canvas, 0)[5], light(&canvas, 4)[5]], [90, 90]);
        let before = canvas.clone();
        canvas.line(DVec2::new(-9.0, -9.0), DVec2::new(90.0, -9.0), 3.0, [9; 3], 1.0);
        canvas.line(DVec2::new(f64::NAN, 0.0), DVec2::new(3.0, 2.0), 3.0, [9; 3], 1.0);
        assert!(canvas == before);
    }

    #[test]
    fn letters_are_written_where_they_should_be_and_may_run_over_the_edge() {
        let mut canvas = Canvas::filled(14, 9, [255; 3]);
        canvas.write(0, 0, "1l", 1, [0; 3]);
        let row =
            |y: u32| (0..14).map(|x| if canvas.pixel(x, y) == Some([0; 3]) { '#' } else { '.' }).collect::<String>();
        assert_eq!(
            [row(0), row(1), row(6), row(8)],
            ["..#....##.....", ".##.....#.....", ".###...###....", ".............."]
        );
        let before = canvas.clone();
        canvas.write(14, 3, "out", 2, [0; 3]);
        canvas.write(3, 9, "out", 2, [0; 3]);
        assert!(canvas == before, "nothing comes in at the other side");
        assert_eq!([text_width("", 3), text_width("1l", 1), text_width("1l", 2)], [0, 11, 22]);
    }
}
