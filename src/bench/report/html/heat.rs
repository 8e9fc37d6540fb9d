//! Heat maps: the tests in each pixel, by one scale for all structures.

use super::super::number::grouped;
use super::super::{Model, Report};
use super::name;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};
use std::fmt::Write;

/// Dark blue to yellow, its lightness even: J. Nuñez, C. Anderton, R. Renslow, "Optimizing colormaps with consideration
/// for color vision deficiency" (cividis, 2018), at six places.
const COLORS: [[u8; 3]; 6] =
    [[0, 32, 77], [49, 68, 107], [102, 105, 112], [149, 143, 120], [203, 186, 105], [255, 234, 70]];

/// One map for each structure that got all rays; nothing where there is none.
pub(super) fn figure(report: &Report, model: &Model) -> String {
    let rows: Vec<_> = model.rows.iter().filter(|r| !r.tests_by_pixel.is_empty()).collect();
    let highest = rows.iter().flat_map(|r| &r.tests_by_pixel).copied().max().unwrap_or(0);
    let max = report.heatmap_max.unwrap_or(highest).max(1);
    let mut maps = String::new();
    for row in &rows {
        let Ok(png) = picture(&row.tests_by_pixel, model.width, model.height, max) else { continue };
        let most = row.tests_by_pixel.iter().max().copied().unwrap_or(0);
        let mean = row.tests_by_pixel.iter().map(|&n| f64::from(n)).sum::<f64>() / row.tests_by_pixel.len() as f64;
        let _ = writeln!(
            maps,
            "<li><img alt=\"tests in each pixel, {0}\" width=\"{1}\" height=\"{2}\" \
             src=\"data:image/png;base64,{3}\"><b>{0}</b>: {mean:.1} on average, {4} at most</li>",
            name(row),
            model.width,
            model.height,
            STANDARD.encode(png),
            grouped(u64::from(most)),
        );
    }
    if maps.is_empty() {
        return String::new();
    }
    format!(
        "<figure class=\"maps\"><h3>Tests in each pixel</h3><figcaption>Ray/prim tests of all rays behind a pixel (eye, \
         shadow, reflected, refracted), one logarithmic scale for all.</figcaption>{}<ul>{maps}</ul></figure>\n",
        scale(max)
    )
}

/// The place of a count on the scale, 0 to 255.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
fn place(tests: u32, max: u32) -> u8 {
    let part = f64::from(tests).ln_1p() / f64::from(max).ln_1p();
    (part * 255.0).round().clamp(0.0, 255.0) as u8
}

fn picture(tests: &[u32], width: u32, height: u32, max: u32) -> Result<Vec<u8>, EncodingError> {
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width, height);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Balanced);
    encoder.set_palette((0..=255).flat_map(color).collect::<Vec<u8>>());
    let pixels: Vec<u8> = tests.iter().map(|&n| place(n, max)).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(file)
}

/// Between the two nearest of [`COLORS`].
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two bytes")]
fn color(place: u8) -> [u8; 3] {
    let along = f64::from(place) / 255.0 * (COLORS.len() - 1) as f64;
    let first = (along as usize).min(COLORS.len() - 2);
    let part = along - first as f64;
    let [a, b] = [COLORS[first], COLORS[first + 1]];
    [0, 1, 2].map(|k| (f64::from(a[k]) * (1.0 - part) + f64::from(b[k]) * part).round() as u8)
}

/// The colours with their numbers.
fn scale(max: u32) -> String {
    let mut svg = String::from(
        "<svg class=\"scale\" viewBox=\"0 0 440 36\" role=\"img\" aria-label=\"scale of the maps\"><defs><linearGradient id=\"heat\">",
    );
    for (i, [r, g, b]) in COLORS.iter().enumerate() {
        let _ = write!(svg, "<stop offset=\"{}%\" stop-color=\"rgb({r},{g},{b})\"/>", 100 * i / (COLORS.len() - 1));
    }
    svg += "</linearGradient></defs><rect x=\"12\" y=\"2\" width=\"400\" height=\"14\" fill=\"url(#heat)\"/>";
    let mut ticks = vec![0];
    ticks.extend((0..9).map(|decade| 10u32.pow(decade)).take_while(|&n| f64::from(n) < 0.6 * f64::from(max)));
    ticks.push(max);
    for tick in ticks {
        let x = 12.0 + 400.0 * f64::from(place(tick, max)) / 255.0;
        let _ = write!(svg, "<text x=\"{x:.0}\" y=\"31\" text-anchor=\"middle\">{}</text>", grouped(u64::from(tick)));
    }
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_runs_from_nothing_to_the_most_and_gets_lighter_all_the_way() {
        assert_eq!([place(0, 100), place(100, 100), place(5000, 100)], [0, 255, 255]);
        assert!(place(1, 100) > 20);
        assert_eq!([color(0), color(255)], [COLORS[0], COLORS[5]]);
        let light = |p: u8| color(p).iter().map(|&c| u32::from(c)).sum::<u32>();
        assert!((0..255).step_by(5).all(|p| light(p) < light(p + 5)));
    }
}
