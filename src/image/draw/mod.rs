//! Drawings with letters and lines: heat maps with their scale, and pictures of structures.

mod glyphs;
pub mod heat;

use super::develop::Raster;
use super::{FileKind, ImageError, Metadata, png};

/// An sRGB colour.
pub type Color = [u8; 3];

/// Opaque coloured pixels to draw on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width: u32,
    height: u32,
    /// Rows from the top.
    pixels: Vec<Color>,
}

impl Canvas {
    /// Pixels of one colour.
    pub fn filled(width: u32, height: u32, color: Color) -> Self {
        Self { width, height, pixels: vec![color; width as usize * height as usize] }
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// A pixel; `None` beyond the edge.
    pub fn pixel(&self, x: u32, y: u32) -> Option<Color> {
        (x < self.width).then(|| self.pixels.get(y as usize * self.width as usize + x as usize).copied()).flatten()
    }

    /// Colours a pixel; nothing happens beyond the edge.
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

    /// The bytes of a PNG file.
    pub fn png(&self, metadata: &Metadata) -> Result<Vec<u8>, ImageError> {
        let samples = self.pixels.as_flattened().to_vec();
        let raster = Raster { width: self.width, height: self.height, channels: 3, samples };
        png::write_bytes(&raster, metadata).map_err(|e| ImageError::encode(FileKind::Png, e))
    }
}

/// Columns that a line of text takes.
pub fn text_width(text: &str, scale: u32) -> u32 {
    let letters = u32::try_from(text.chars().count()).unwrap_or(u32::MAX / 64);
    (letters * (glyphs::WIDTH + 1)).saturating_sub(1) * scale
}

/// Rows that a line of text takes.
pub const fn text_height(scale: u32) -> u32 {
    glyphs::HEIGHT * scale
}

#[cfg(test)]
mod tests {
    use super::*;

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
