//! Metadata in EXIF, for JPEG and WebP: a little TIFF directory with `ImageDescription` (all entries as one JSON
//! object) and `Software`.
//!
//! Reading understands the output of [`write`] and similar TIFF directories; anything else counts as no metadata.

use super::Metadata;
use super::metadata::MAX_TEXT;
use std::io::{Read, Seek, SeekFrom};

const IMAGE_DESCRIPTION: u16 = 0x010e;
const SOFTWARE: u16 = 0x0131;
const ASCII: u16 = 2;
/// `II`: little endian, then TIFF's magic number, then the offset of the directory.
const HEADER: [u8; 8] = [b'I', b'I', 42, 0, 8, 0, 0, 0];
/// Bytes of a directory entry: tag, type, count, value or offset.
const ENTRY: usize = 12;

/// TIFF bytes of an EXIF block; empty for empty metadata.
pub(super) fn write(metadata: &Metadata) -> Vec<u8> {
    if metadata.is_empty() {
        return Vec::new();
    }
    let texts = [(IMAGE_DESCRIPTION, ascii_json(&metadata.to_json())), (SOFTWARE, metadata.software())];
    let mut tiff = HEADER.to_vec();
    tiff.extend([texts.len() as u8, 0]);
    // Texts follow the directory and the (absent) offset of a next one.
    let mut offset = HEADER.len() + 2 + texts.len() * ENTRY + 4;
    for (tag, text) in &texts {
        tiff.extend(tag.to_le_bytes());
        tiff.extend(ASCII.to_le_bytes());
        tiff.extend(size(text.len() + 1));
        tiff.extend(size(offset));
        offset += text.len() + 1;
    }
    tiff.extend([0; 4]);
    for (_, text) in &texts {
        tiff.extend(text.as_bytes());
        tiff.push(0);
    }
    tiff
}

fn size(bytes: usize) -> [u8; 4] {
    u32::try_from(bytes).unwrap_or(u32::MAX).to_le_bytes()
}

/// Escapes everything beyond ASCII in JSON, as EXIF texts are ASCII.
fn ascii_json(json: &str) -> String {
    let mut ascii = String::with_capacity(json.len());
    for c in json.chars() {
        if c.is_ascii() {
            ascii.push(c);
        } else {
            c.encode_utf16(&mut [0; 2]).iter().for_each(|unit| ascii.push_str(&format!("\\u{unit:04x}")));
        }
    }
    ascii
}

/// Entries of meshray in a TIFF directory; `None` where there are none.
pub(super) fn read(tiff: &[u8]) -> Option<Metadata> {
    let u16_at = |at: usize| Some(u16::from_le_bytes(tiff.get(at..at.checked_add(2)?)?.try_into().ok()?));
    let usize_at = |at: usize| {
        let bytes = tiff.get(at..at.checked_add(4)?)?.try_into().ok()?;
        usize::try_from(u32::from_le_bytes(bytes)).ok()
    };
    if tiff.get(..4)? != &HEADER[..4] {
        return None;
    }
    let directory = usize_at(4)?;
    let entries = usize::from(u16_at(directory)?);
    let at = (0..entries)
        .map_while(|i| directory.checked_add(2 + i * ENTRY))
        .find(|&at| u16_at(at) == Some(IMAGE_DESCRIPTION) && u16_at(at + 2) == Some(ASCII))?;
    let (count, offset) = (usize_at(at + 4)?, usize_at(at + 8)?);
    let text = tiff.get(offset..offset.checked_add(count)?)?;
    let text = std::str::from_utf8(text.strip_suffix(&[0]).unwrap_or(text)).ok()?;
    Metadata::from_json(text)
}

/// Finds the EXIF block of a JPEG file: walks its segments up to the pixels.
pub(super) fn find_in_jpeg(mut file: impl Read + Seek) -> Option<Vec<u8>> {
    file.seek(SeekFrom::Start(2)).ok()?;
    loop {
        let mut head = [0; 4];
        file.read_exact(&mut head).ok()?;
        let [0xff, marker, hi, lo] = head else { return None };
        // Start of scan: the pixels follow. Markers below 0xc0 have no length, and do not come this early.
        if marker == 0xda || marker < 0xc0 {
            return None;
        }
        let length = usize::from(u16::from_be_bytes([hi, lo])).checked_sub(2)?;
        let mut segment = vec![0; length];
        file.read_exact(&mut segment).ok()?;
        if let (0xe1, Some(tiff)) = (marker, segment.strip_prefix(b"Exif\0\0")) {
            return Some(tiff.to_vec());
        }
    }
}

/// Finds the EXIF block of a WebP file: walks its chunks without reading the pixels.
pub(super) fn find_in_webp(mut file: impl Read + Seek) -> Option<Vec<u8>> {
    file.seek(SeekFrom::Start(12)).ok()?;
    loop {
        let mut head = [0; 8];
        file.read_exact(&mut head).ok()?;
        let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
        if head.starts_with(b"EXIF") {
            let limit = u64::try_from(MAX_TEXT * 2).ok()?;
            let mut tiff = Vec::new();
            file.take(u64::from(length).min(limit)).read_to_end(&mut tiff).ok()?;
            let tiff = tiff.strip_prefix(b"Exif\0\0").unwrap_or(&tiff);
            return Some(tiff.to_vec());
        }
        // Chunks are padded to even lengths.
        file.seek(SeekFrom::Current(i64::from(length) + i64::from(length % 2))).ok()?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_survive_and_the_block_is_ascii() {
        let metadata = Metadata::new().with(Metadata::INPUT, r#"["Öl \"𝄞\" \\ \n"]"#);
        let tiff = write(&metadata);
        let texts = HEADER.len() + 2 + 2 * ENTRY + 4;
        assert!(tiff[texts..].iter().all(u8::is_ascii));
        assert_eq!(read(&tiff), Some(metadata));
    }

    #[test]
    fn a_spoiled_directory_is_no_metadata() {
        let tiff = write(&Metadata::new());
        for cut in 0..tiff.len() - 20 {
            assert_eq!(read(&tiff[..cut]), None, "{cut}");
        }
        for at in 0..tiff.len() {
            let mut copy = tiff.clone();
            copy[at] = 0xff;
            let _ = read(&copy);
        }
    }

    #[test]
    fn a_webp_chunk_longer_than_the_file_ends_the_walk() {
        let mut file = b"RIFF\0\0\0\0WEBPVP8L\xff\xff\xff\xff".to_vec();
        file.extend([0; 100]);
        assert_eq!(find_in_webp(std::io::Cursor::new(file)), None);
    }
}
