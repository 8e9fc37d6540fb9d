//! Files built byte by byte, and damaged ones.

use super::*;
use crate::load::limits::{Budget, Limits};
use crate::load::texture::{Encoded, decode_all};
use crate::load::{Diagnostic, Warnings};
use crate::scene::Pixels;
use base64::Engine as _;
use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;
use std::borrow::Cow;
use std::path::Path;

/// Builds a KTX2 file of one level. `model` is the colour model of its data format descriptor.
pub(crate) fn file(format: u32, (width, height): (u32, u32), scheme: u32, model: u8, level: &[u8]) -> Vec<u8> {
    file_with(format, (width, height), scheme, model, level, level.len() as u64)
}

/// Like [`file`], with an explicit uncompressed length of the level.
fn file_with(format: u32, (width, height): (u32, u32), scheme: u32, model: u8, level: &[u8], unpacked: u64) -> Vec<u8> {
    // A descriptor of one sample: 4 bytes of total size, 24 of block header, 16 of the sample.
    let block = if model == 166 { 3 } else { 0 };
    let mut description = 44u32.to_le_bytes().to_vec();
    description.extend([0, 0, 0, 0, 2, 0, 40, 0, model, 1, 1, 0, block, block, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0]);
    description.extend([0, 0, 127, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255]);

    let (head, start) = (80 + 24, 80 + 24 + 44u64);
    let mut out = START.to_vec();
    for word in [format, 1, width, height, 0, 0, 1, 1, scheme, head, 44, 0, 0] {
        out.extend(word.to_le_bytes());
    }
    out.extend([0; 16]);
    for word in [start, level.len() as u64, unpacked] {
        out.extend(word.to_le_bytes());
    }
    out.extend(description);
    out.extend(level);
    out
}

/// A Zstandard frame of one raw block.
fn zstd(bytes: &[u8]) -> Vec<u8> {
    let length = bytes.len() as u32;
    let mut out = vec![0x28, 0xb5, 0x2f, 0xfd, 0xa0];
    out.extend(length.to_le_bytes());
    // Header of the last block, of the raw type.
    out.extend(&(length << 3 | 1).to_le_bytes()[..3]);
    out.extend(bytes);
    out
}

fn decoded(bytes: &[u8], limits: &Limits) -> Result<Bitmap, String> {
    let image = Encoded { name: "a.ktx2".into(), place: String::new(), bytes: Cow::Borrowed(bytes) };
    let (mut warnings, mut budget) = (Warnings::default(), Budget::new(limits));
    let bitmap = decode_all(&[image], Path::new("m"), limits, &mut budget, &mut warnings).0.remove(0);
    bitmap.ok_or_else(|| warnings.into_vec().iter().map(|w: &Diagnostic| w.text.clone()).collect())
}

fn pixels(bytes: &[u8]) -> Pixels {
    decoded(bytes, &Limits::default()).unwrap().pixels
}

const RGB: u32 = 23;
const RGBA: u32 = 43;

#[test]
fn plain_bytes_are_taken_as_they_are_packed_or_not() {
    let texels: Vec<u8> = (0..24).collect();
    let packed = zstd(&texels);
    for bytes in [file(RGBA, (3, 2), 0, 1, &texels), file_with(RGBA, (3, 2), 2, 1, &packed, texels.len() as u64)] {
        let bitmap = decoded(&bytes, &Limits::default()).unwrap();
        assert_eq!((bitmap.width, bitmap.height), (3, 2));
        assert!(matches!(&bitmap.pixels, Pixels::Rgba8(p) if p[..] == *texels.as_chunks::<4>().0));
    }
    assert!(matches!(pixels(&file(RGB, (4, 2), 0, 1, &texels)), Pixels::Rgb8(p) if p[..] == texels));
}

#[test]
fn blocks_are_laid_out_row_by_row_and_cut_at_the_edges() {
    // BC1, one colour per block: red, green, blue, white in RGB565; 5×5 pixels take four blocks.
    let block = |color: u16| [color.to_le_bytes(), color.to_le_bytes(), [0, 0], [0, 0]].concat();
    let level: Vec<u8> = [0xf800, 0x07e0, 0x001f, 0xffff].into_iter().flat_map(block).collect();
    let Pixels::Rgb8(texels) = pixels(&file(131, (5, 5), 0, 128, &level)) else { panic!() };
    let at = |x: usize, y: usize| &texels[(y * 5 + x) * 3..][..3];
    assert_eq!([at(0, 0), at(3, 3)], [[255, 0, 0]; 2]);
    assert_eq!((at(4, 0), at(0, 4), at(4, 4)), (&[0, 255, 0][..], &[0, 0, 255][..], &[255; 3][..]));
    // BC3: opacity 128 throughout, then the colours of BC1.
    let level = [vec![128, 128, 0, 0, 0, 0, 0, 0], block(0xf800)].concat();
    assert!(matches!(pixels(&file(137, (2, 2), 0, 130, &level)), Pixels::Rgba8(p) if p[..] == [[255, 0, 0, 128]; 4]));
    // BC7 of mode 5, all bits zero: black and transparent.
    let mut level = [0; 16];
    level[0] = 1 << 5;
    assert!(matches!(pixels(&file(145, (4, 4), 0, 134, &level)), Pixels::Rgba8(p) if p[..] == [[0; 4]; 16]));
}

/// A UASTC block of mode 8, one solid colour: 5 bits of mode, then four channels of 8 bits.
fn uastc([r, g, b, a]: [u8; 4]) -> [u8; 16] {
    let bits = 0b10111 | u128::from(r) << 5 | u128::from(g) << 13 | u128::from(b) << 21 | u128::from(a) << 29;
    bits.to_le_bytes()
}

#[test]
fn basis_blocks_become_pixels_packed_or_not() {
    let level: Vec<u8> = [[10, 20, 30, 255], [200, 100, 50, 255]].into_iter().flat_map(uastc).collect();
    let packed = zstd(&level);
    for bytes in [file(0, (6, 3), 0, 166, &level), file_with(0, (6, 3), 2, 166, &packed, level.len() as u64)] {
        let Pixels::Rgb8(texels) = pixels(&bytes) else { panic!() };
        assert_eq!((&texels[..3], &texels[5 * 3..6 * 3], texels.len()), (&[10, 20, 30][..], &[200, 100, 50][..], 54));
    }
}

/// A picture of 14×6 pixels in four colours, the first 8 columns wide and 4 rows high, as written by the Basis Universal
/// encoder: as ETC1S, the same with the lower part 64/255 opaque, and that as UASTC packed with Zstandard.
const ETC1S: &str = "\
    q0tUWCAyMLsNChoKAAAAAAEAAAAOAAAABgAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAACwAAACUAAAAJAAAALgAAAAAAAAAlAAAAAAAAABMAQ\
    AAAAAAAAQAAAAAAAAAAAAAAAAAAAAsAAAAAAAAAAIAKACjAQEAAwMAAAgAAAAAAAAAAAA/AAAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFz\
    aXMgVW5pdmVyc2FsIDIuNTAAAAQAAwAyAAAADQAAAC0AAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAAAAAAfQNwAAQAAAMgXMggFMCdAAAAAAIQV8B\
    AGAsQNEAAAAIAsii8MABMAAgAAAABIyTzCDgQAAABQVVVV/f///wc0wEQAAAAAAAASRQCYAAAAAAAAQCgB4gYMAAAAwUJHoxMIACYAAAAAAAAQ\
    QACAXn0D";
const ETC1S_ALPHA: &str = "\
    q0tUWCAyMLsNChoKAAAAAAEAAAAOAAAABgAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAADwAAACkAAAAJAAAAMgAAAAAAAAAoAAAAAAAAABoAQ\
    AAAAAAAAYAAAAAAAAAAAAAAAAAAAA8AAAAAAAAAAIAOACjAQEAAwMAAAgIAAAAAAAAAAA/AAAAAAAAAAAA/////0AAPw8AAAAAAAAAAP////8f\
    AAAAS1RYd3JpdGVyAEJhc2lzIFVuaXZlcnNhbCAyLjUwAAAGAAQAOQAAABEAAAAuAAAAAAAAAAAAAAAAAAAAAwAAAAMAAAADAAAAH8DcAAEAAE\
    AY9oU4hFIAcwIEAAAAQFgBD2EgwNyAAQAAQQA2aAK9ggNgCoAAAAAACJJGZInv68wBVFVVVf3///+vqqqqAgAAAAA0wEQAAAAAAADiSQEwAUAA\
    AAAAArkUAW8CBgAAgAyvUwSaEAAmAAQAAAAAEIEAU8McP9gY";
const UASTC_ALPHA: &str = "\
    q0tUWCAyMLsNChoKAAAAAAEAAAAOAAAABgAAAAAAAAAAAAAAAQAAAAEAAAACAAAAaAAAACwAAACUAAAAJAAAAAAAAAAAAAAAAAAAAAAAAAC4AA\
    AAAAAAADQAAAAAAAAAgAAAAAAAAAAsAAAAAAAAAAIAKACmAQEAAwMAABAAAAAAAAAAAAB/AwAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFz\
    aXMgVW5pdmVyc2FsIDIuNTAAACi1L/0ggF0BAOgXHALgP+ADAAQC/j8egQMcGADIcgwABBgeqByWAwUAADRgMWCxmRO8gAs=";
#[test]
fn files_of_the_encoder_come_back() {
    for (text, loss, has_alpha) in [(ETC1S, 3, false), (ETC1S_ALPHA, 3, true), (UASTC_ALPHA, 1, true)] {
        let bytes = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
        let bitmap = decoded(&bytes, &Limits::default()).unwrap();
        assert_eq!((bitmap.width, bitmap.height), (14, 6));
        let texel = |i: usize| match &bitmap.pixels {
            Pixels::Rgb8(p) => [p[3 * i], p[3 * i + 1], p[3 * i + 2], 255],
            Pixels::Rgba8(p) => p[i],
            Pixels::Rgba16(_) => panic!("8 bits become 16"),
        };
        assert_eq!(matches!(bitmap.pixels, Pixels::Rgba8(_)), has_alpha);
        for (y, x) in (0..6).flat_map(|y| (0..14).map(move |x| (y, x))) {
            let (right, low) = (x >= 8, y >= 4);
            let alpha = if has_alpha && low { 64 } else { 255 };
            let expected =
                [if right { 32 } else { 224 }, if low { 192 } else { 16 }, if right { 240 } else { 0 }, alpha];
            let found = texel(y * 14 + x);
            let off = found.iter().zip(expected).map(|(&f, e)| (i32::from(f) - e).abs()).max();
            assert!(off <= Some(loss), "{found:?} for {expected:?} at ({x}, {y})");
        }
    }
}

#[test]
fn lengths_that_do_not_fit_are_told_before_anything_is_unpacked() {
    let why = |bytes: &[u8], limits: &Limits| decoded(bytes, limits).unwrap_err();
    let usual = Limits::default();
    let short = why(&file(RGBA, (3, 2), 0, 1, &[0; 23]), &usual);
    assert!(short.contains("it has 23 bytes of pixels where 3×2 take 24"), "{short}");
    let bomb = why(&file_with(RGBA, (2, 2), 2, 1, &zstd(&[0; 16]), 1 << 40), &usual);
    assert!(bomb.contains("it has 1099511627776 bytes of pixels where 2×2 take 16"), "{bomb}");
    let more = why(&file_with(RGBA, (2, 2), 2, 1, &zstd(&[0; 99]), 16), &usual);
    assert!(more.contains("gives not the 16 bytes"), "{more}");
    let large = why(&file(0, (1 << 20, 1 << 20), 1, 163, &[0; 64]), &usual);
    assert!(large.contains("1048576×1048576 pixels where"), "{large}");
    let small = Limits { memory: 40, ..usual };
    assert!(why(&file(RGBA, (3, 2), 0, 1, &[0; 24]), &small).contains("64 bytes are needed where 40 of 40"));
}

#[test]
fn what_is_not_supported_is_named() {
    let why = |bytes: &[u8]| decoded(bytes, &Limits::default()).unwrap_err();
    assert!(why(&file(97, (1, 1), 0, 1, &[0; 8])).contains("of the format R16G16B16A16_SFLOAT"));
    assert!(why(&file(RGBA, (1, 1), 3, 1, &[0; 4])).contains("packed by ZLIB"));
    assert!(why(&file(0, (4, 4), 0, 162, &[0; 16])).contains("of the colour model ASTC"));
    let mut cube = file(RGBA, (1, 1), 0, 1, &[0; 24]);
    cube[36] = 6;
    assert!(why(&cube).contains("no flat picture"));
    assert!(why(START).contains("its KTX2 header is damaged"));
    // No codebooks.
    assert!(why(&file_with(0, (4, 4), 1, 163, &[0; 64], 0)).contains("Basis data"));
}

proptest! {
    // Cases that failed once run first.
    #![proptest_config(ProptestConfig {
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct("tests/ktx-damage.txt"))),
        ..ProptestConfig::default()
    })]

    #[test]
    fn damaged_files_end_in_a_picture_or_a_warning(
        kind in 0usize..6,
        wrong in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let blocks: Vec<u8> = (0..4).flat_map(|i| uastc([i, 2 * i, 3 * i, 255])).collect();
        let mut bytes = match kind {
            0 => file(0, (8, 8), 0, 166, &blocks),
            1 => file_with(0, (8, 8), 2, 166, &zstd(&blocks), blocks.len() as u64),
            2 => file(145, (8, 8), 0, 134, &blocks),
            3 => file_with(0, (8, 8), 1, 163, &[0x5a; 300], 0),
            4 => base64::engine::general_purpose::STANDARD.decode(ETC1S).unwrap(),
            _ => base64::engine::general_purpose::STANDARD.decode(ETC1S_ALPHA).unwrap(),
        };
        for (at, byte) in wrong {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let limits = Limits { memory: 1 << 24, image_pixels: 1 << 16, ..Limits::default() };
        if let Ok(bitmap) = decoded(&bytes, &limits) {
            let pixels = u64::from(bitmap.width) * u64::from(bitmap.height);
            let held = match &bitmap.pixels {
                Pixels::Rgb8(p) => p.len() as u64 / 3,
                Pixels::Rgba8(p) => p.len() as u64,
                Pixels::Rgba16(p) => p.len() as u64,
            };
            prop_assert_eq!(held, pixels);
        }
    }
}
