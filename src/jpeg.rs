//! Detects truncated JPEG pictures: the decoder fills missing parts with grey or coarse data and reports nothing.

/// Whether the data of a JPEG picture lacks its end (marker EOI; ITU-T T.81, *Digital Compression and Coding of Continuous-Tone
/// Still Images*, 1992, B.1.1.3).
pub(crate) fn is_cut_off(bytes: &[u8]) -> bool {
    /// Start of a scan: its header is followed by entropy-coded data, which holds no markers except those between its parts.
    const SOS: u8 = 0xda;
    const EOI: [u8; 2] = [0xff, 0xd9];
    // Skip SOI. Segments may hold pictures with EOIs of their own, such as previews.
    let mut rest = bytes.get(2..).unwrap_or_default();
    loop {
        rest = match rest {
            // Any number of fill bytes may stand before a marker.
            [0xff, 0xff, ..] => &rest[1..],
            // Not a marker: left to the decoder.
            [0xff, 0, ..] => return false,
            [0xff, SOS, ..] => return !rest.windows(2).rev().any(|pair| pair == EOI),
            [0xff, _, high, low, ..] => {
                let length = usize::from(u16::from_be_bytes([*high, *low]));
                let Some(behind) = rest.get(2 + length..) else { return true };
                behind
            }
            [] | [0xff, ..] => return true,
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::codecs::jpeg::JpegEncoder;

    fn noise() -> ::image::RgbImage {
        ::image::RgbImage::from_fn(64, 48, |x, y| ::image::Rgb([((x * 37) ^ (y * 91)) as u8, (x * y) as u8, y as u8]))
    }

    fn jpeg() -> Vec<u8> {
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, 90).encode_image(&noise()).unwrap();
        bytes
    }

    #[test]
    fn a_whole_picture_is_not_cut_off_and_every_part_of_it_is() {
        let whole = jpeg();
        assert!(!is_cut_off(&whole));
        assert!(!is_cut_off(&[&whole[..], b"and something behind it"].concat()));
        for length in 2..whole.len() {
            assert!(is_cut_off(&whole[..length]), "{length} of {}", whole.len());
        }
    }

    #[test]
    fn a_preview_in_a_segment_is_not_the_end() {
        let (whole, preview) = (jpeg(), jpeg());
        let length = u16::try_from(preview.len() + 2).unwrap().to_be_bytes();
        let with_preview = [&whole[..2], &[0xff, 0xe1], &length, &preview, &whole[2..]].concat();
        assert!(!is_cut_off(&with_preview));
        assert!(is_cut_off(&with_preview[..with_preview.len() - 100]));
    }
}
