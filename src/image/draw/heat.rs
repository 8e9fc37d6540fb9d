//! Heat maps: a quantity per pixel, as a colour.

use super::{Canvas, Color, text_height, text_width};

/// Colour map from dark blue to yellow of even lightness: J. Nuñez, C. Anderton, R. Renslow, "Optimizing colormaps with
/// consideration for color vision deficiency" (cividis, 2018), at six places.
pub const COLORS: [Color; 6] =
    [[0, 32, 77], [49, 68, 107], [102, 105, 112], [149, 143, 120], [203, 186, 105], [255, 234, 70]];

/// A logarithmic scale that begins at 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    max: f64,
    unit: f64,
}

impl Scale {
    /// Scale up to `max`; values from about `unit` on are told apart from 0.
    pub fn new(max: f64, unit: f64) -> Self {
        Self { max: max.max(unit), unit }
    }

    /// Upper end of the scale.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// Position of a value on the scale, 0 to 255.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    pub fn place(&self, value: f64) -> u8 {
        let part = libm::log1p(value / self.unit) / libm::log1p(self.max / self.unit);
        (part * 255.0).round().clamp(0.0, 255.0) as u8
    }

    /// Colour of a value.
    pub fn color(&self, value: f64) -> Color {
        color(self.place(value))
    }

    /// Values to label beside the scale: 0, powers of ten well apart from the end, and the end.
    pub fn ticks(&self) -> Vec<f64> {
        let decades = (0..18).map(|decade| self.unit * 10f64.powi(decade)).take_while(|&tick| tick < 0.4 * self.max);
        std::iter::once(0.0).chain(decades).chain([self.max]).collect()
    }
}

/// Colour of a position on the scale, interpolated between the two nearest of [`COLORS`].
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two bytes")]
pub fn color(place: u8) -> Color {
    let along = f64::from(place) / 255.0 * (COLORS.len() - 1) as f64;
    let first = (along as usize).min(COLORS.len() - 2);
    let part = along - first as f64;
    let [a, b] = [COLORS[first], COLORS[first + 1]];
    [0, 1, 2].map(|k| (f64::from(a[k]) * (1.0 - part) + f64::from(b[k]) * part).round() as u8)
}

/// Description of a heat map.
#[derive(Clone, Copy, Debug)]
pub struct Map<'a> {
    /// Columns of the picture.
    pub width: u32,
    /// Values, row by row.
    pub values: &'a [f64],
    /// Scale that colours the values.
    pub scale: Scale,
    /// Text above the scale.
    pub title: &'a str,
    /// Formats a value beside the scale.
    pub label: fn(f64) -> String,
}

const PAPER: Color = [255; 3];
const INK: Color = [34; 3];

impl Map<'_> {
    /// Draws the map, and below it its title and its scale.
    pub fn draw(&self) -> Canvas {
        let height = u32::try_from(self.values.len() / self.width.max(1) as usize).unwrap_or(0);
        let dot = (self.width / 480).clamp(1, 6);
        let margin = 4 * dot;
        let width = self.width.max(text_width(self.title, dot) + 2 * margin);
        let (line, bar) = (text_height(dot) + 2 * dot, 9 * dot);
        let mut canvas = Canvas::filled(width, height + line * 2 + bar + margin * 2, PAPER);
        let places = (0..height).flat_map(|y| (0..self.width).map(move |x| (x, y)));
        places.zip(self.values).for_each(|((x, y), &value)| canvas.set(x, y, self.scale.color(value)));
        canvas.write(margin, height + margin, self.title, dot, INK);
        self.draw_scale(&mut canvas, height + margin + line, bar, dot, margin);
        canvas
    }

    fn draw_scale(&self, canvas: &mut Canvas, top: u32, bar: u32, dot: u32, margin: u32) {
        let last = canvas.width() - 2 * margin - 1;
        for x in 0..=last {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "x is at most the last")]
            let place = (f64::from(x) / f64::from(last.max(1)) * 255.0).round() as u8;
            canvas.fill(margin + x, top, 1, bar, color(place));
        }
        let most = self.values.iter().copied().fold(0.0, f64::max);
        let mut free = 0;
        let ticks = self.scale.ticks();
        let end = format!("{}{}", (self.label)(self.scale.max()), if most > self.scale.max() { "+" } else { "" });
        let last_left = canvas.width() - margin - text_width(&end, dot).min(canvas.width() - margin);
        for &tick in &ticks[..ticks.len() - 1] {
            let x = margin + u32::from(self.scale.place(tick)) * last / 255;
            let text = (self.label)(tick);
            let left = (x.saturating_sub(text_width(&text, dot) / 2)).max(margin);
            let right = left + text_width(&text, dot) + 4 * dot;
            if left >= free && right <= last_left {
                canvas.fill(x, top + bar, dot, dot, INK);
                canvas.write(left, top + bar + 2 * dot, &text, dot, INK);
                free = right;
            }
        }
        canvas.write(last_left, top + bar + 2 * dot, &end, dot, INK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_runs_from_nothing_to_the_most_and_gets_lighter_all_the_way() {
        let scale = Scale::new(100.0, 1.0);
        assert_eq!([scale.place(0.0), scale.place(100.0), scale.place(5000.0)], [0, 255, 255]);
        assert!(scale.place(1.0) > 20);
        assert_eq!([color(0), color(255)], [COLORS[0], COLORS[5]]);
        let light = |p: u8| color(p).iter().map(|&c| u32::from(c)).sum::<u32>();
        assert!((0..255).step_by(5).all(|p| light(p) < light(p + 5)));
        assert_eq!(scale.ticks(), [0.0, 1.0, 10.0, 100.0]);
        assert_eq!(Scale::new(0.0, 1.0).ticks(), [0.0, 1.0], "a scene without tests has a scale, too");
    }

    #[test]
    fn a_map_has_each_value_in_its_colour_and_the_scale_below() {
        let values: Vec<f64> = (0..600).map(f64::from).collect();
        let scale = Scale::new(300.0, 1.0);
        let map = Map { width: 60, values: &values, scale, title: "tests", label: |v| format!("{v:.0}") };
        let canvas = map.draw();
        assert_eq!((canvas.width(), canvas.height() > 30), (60, true));
        assert_eq!(canvas.pixel(0, 0), Some(COLORS[0]));
        assert_eq!(canvas.pixel(59, 9), Some(COLORS[5]), "599 is beyond the scale");
        assert_eq!(canvas.pixel(17, 1), Some(scale.color(77.0)));
        let bar = 10 + 4 + 11 + 3;
        assert_eq!([canvas.pixel(4, bar), canvas.pixel(55, bar)], [Some(COLORS[0]), Some(COLORS[5])]);
        let titled = Map { title: "a title that is longer than the map is wide", ..map }.draw();
        assert!(titled.width() > 250 && titled.pixel(60, 0) == Some(PAPER));
    }
}
