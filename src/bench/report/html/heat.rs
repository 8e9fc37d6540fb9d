//! Heat maps: tests per pixel, on one scale for all structures.

use super::super::{Model, Report};
use super::tables::name;
use crate::image::draw::heat::{COLORS, Scale, color};
use crate::number::{grouped, short, whole};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};
use std::fmt::Write;

/// Colour scale of counts up to `max`.
fn scale_to(max: u32) -> Scale {
    Scale::new(f64::from(max), 1.0)
}

/// One map for each structure that got all rays; empty without any.
pub(super) fn figure(report: &Report, model: &Model) -> String {
    let rows: Vec<_> = model.rows.iter().filter(|r| !r.tests_by_pixel.is_empty()).collect();
    let highest = rows.iter().flat_map(|r| &r.tests_by_pixel).copied().max().unwrap_or(0);
    let scale = scale_to(report.heatmap_max.unwrap_or(highest));
    let mut maps = String::new();
    for row in &rows {
        let Ok(png) = picture(&row.tests_by_pixel, model.width, model.height, scale) else { continue };
        let most = row.tests_by_pixel.iter().max().copied().unwrap_or(0);
        let mean = row.tests_by_pixel.iter().map(|&n| f64::from(n)).sum::<f64>() / row.tests_by_pixel.len() as f64;
        let _ = writeln!(
            maps,
            "<li><img alt=\"tests in each pixel, {0}\" width=\"{1}\" height=\"{2}\" \
             src=\"data:image/png;base64,{3}\"><b>{0}</b>: {5} on average, {4} at most</li>",
            name(row),
            model.width,
            model.height,
            STANDARD.encode(png),
            grouped(u64::from(most)),
            short(mean),
        );
    }
    if maps.is_empty() {
        return String::new();
    }
    format!(
        "<figure class=\"maps\"><h3>Tests in each pixel</h3><figcaption>Ray/prim tests of all rays behind a pixel (eye, \
         shadow, reflected, refracted), one logarithmic scale for all.</figcaption>{}<ul>{maps}</ul></figure>\n",
        legend(scale)
    )
}

fn picture(tests: &[u32], width: u32, height: u32, scale: Scale) -> Result<Vec<u8>, EncodingError> {
    let pixels: Vec<u8> = tests.iter().map(|&n| scale.place(f64::from(n))).collect();
    indexed(&pixels, width, height, color)
}

/// Encodes palette indices as a PNG.
pub(super) fn indexed(
    pixels: &[u8],
    width: u32,
    height: u32,
    color: fn(u8) -> [u8; 3],
) -> Result<Vec<u8>, EncodingError> {
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width, height);
    encoder.set_color(ColorType::Indexed);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Balanced);
    encoder.set_palette((0..=255).flat_map(color).collect::<Vec<u8>>());
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(file)
}

/// Colour scale with numbers.
fn legend(scale: Scale) -> String {
    let mut svg = String::from(
        "<svg class=\"scale\" viewBox=\"0 0 440 36\" role=\"img\" aria-label=\"scale of the maps\"><defs><linearGradient id=\"heat\">",
    );
    for (i, [r, g, b]) in COLORS.iter().enumerate() {
        let _ = write!(svg, "<stop offset=\"{}%\" stop-color=\"rgb({r},{g},{b})\"/>", 100 * i / (COLORS.len() - 1));
    }
    svg += "</linearGradient></defs><rect x=\"12\" y=\"2\" width=\"400\" height=\"14\" fill=\"url(#heat)\"/>";
    for tick in scale.ticks() {
        let x = 12.0 + 400.0 * f64::from(scale.place(tick)) / 255.0;
        let _ = write!(svg, "<text x=\"{x:.0}\" y=\"31\" text-anchor=\"middle\">{}</text>", whole(tick));
    }
    svg + "</svg>"
}
