//! A glTF file as JSON text and one binary chunk: either a `.gltf`, or a GLB container split into its chunks.

use super::codes::Code;
use super::report::Report;
use crate::load::text::without_mark;
use std::cmp::Ordering;

const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");
const HEADER: usize = 12;

/// The parts of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Container<'a> {
    /// JSON text, without a byte-order mark.
    pub(super) json: &'a [u8],
    /// Contents of the first buffer, if the file is a GLB with a binary chunk.
    pub(super) bin: Option<&'a [u8]>,
    /// Whether the file is a GLB.
    pub(super) binary: bool,
}

/// Splits a file into its parts; `None` if that is impossible, with the reason in `report`.
pub(super) fn split<'a>(bytes: &'a [u8], report: &mut Report) -> Option<Container<'a>> {
    let (json, bin, binary) = if bytes.starts_with(b"glTF") {
        let (json, bin) = split_glb(bytes, report)?;
        (json, bin, true)
    } else if report_foreign(bytes, report) {
        return None;
    } else {
        (bytes, None, false)
    };
    Some(Container { json: skip_mark(json, report), bin, binary })
}

/// Reports a file that is neither JSON nor GLB: an empty `.glb`, or another format under this name; returns whether it is.
fn report_foreign(bytes: &[u8], report: &mut Report) -> bool {
    if bytes.len() < 4 && b"glTF".starts_with(bytes) {
        report.add(Code::GlbUnexpectedEndOfHeader, "", format!("a file of {} bytes holds no scene", bytes.len()));
        return true;
    }
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        report.refuse_with(Code::InvalidJson, "", "the JSON is UTF-16 where UTF-8 should be", "save it as UTF-8");
        return true;
    }
    let text = without_mark(bytes).trim_ascii_start();
    // A list or a scalar is JSON at least; the parser reports more precisely.
    if !text.first().is_some_and(|first| b"{[\"-0123456789tfn".contains(first)) {
        let text = "it begins neither with `glTF` nor with `{`, so it is no glTF";
        report.refuse_with(Code::InvalidJson, "", text, "give it the extension of what it is, or export it again");
        return true;
    }
    false
}

fn skip_mark<'a>(json: &'a [u8], report: &mut Report) -> &'a [u8] {
    let Some(rest) = json.strip_prefix(b"\xef\xbb\xbf") else { return json };
    report.warn(Code::InvalidJson, "", "the JSON starts with a byte-order mark, which is skipped");
    rest
}

fn split_glb<'a>(bytes: &'a [u8], report: &mut Report) -> Option<(&'a [u8], Option<&'a [u8]>)> {
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        report.add(Code::GlbUnexpectedEndOfHeader, "", format!("the header of 12 bytes ends after {}", bytes.len()));
        return None;
    };
    if version != 2 {
        let kind = if version == 1 { ": this is glTF 1.0" } else { "" };
        report.add(Code::GlbInvalidVersion, "", format!("GLB version {version} where 2 is understood{kind}"));
        return None;
    }
    let length = length as usize;
    if length <= HEADER {
        report.add(Code::GlbLengthTooSmall, "", format!("a declared length of {length} bytes holds no chunk"));
        return None;
    }
    let text = format!("the header declares {length} bytes, the file has {}", bytes.len());
    match length.cmp(&bytes.len()) {
        Ordering::Greater => report.add(Code::GlbLengthMismatch, "", text),
        Ordering::Less => report.add(Code::GlbExtraData, "", text),
        Ordering::Equal => {}
    }
    chunks(bytes.get(HEADER..).unwrap_or_default(), length - HEADER, report)
}

/// Walks the chunks that begin within the length declared in the header; the last may end beyond it.
fn chunks<'a>(bytes: &'a [u8], declared: usize, report: &mut Report) -> Option<(&'a [u8], Option<&'a [u8]>)> {
    let (mut json, mut bin) = (None, None);
    let mut rest = bytes;
    for number in 0.. {
        let at = bytes.len() - rest.len();
        if rest.is_empty() || at >= declared {
            break;
        }
        let place = format!("chunk {number}");
        let (Some(length), Some(kind)) = (word(rest, 0), word(rest, 4)) else {
            // Zeros after the last chunk are padding of the file, not another chunk.
            if number > 0 && rest.iter().all(|&b| b == 0 || b == b' ') {
                break;
            }
            report.add(
                Code::GlbUnexpectedEndOfChunkHeader,
                place,
                format!("its header of 8 bytes ends after {}", rest.len()),
            );
            return None;
        };
        let length = length as usize;
        if number == 0 && kind != JSON {
            report.add(Code::GlbUnexpectedFirstChunk, place, format!("its type is {}, not JSON", name_of(kind)));
            return None;
        }
        let (there, room) = (rest.len() - 8, declared.saturating_sub(at + 8));
        if length > there.min(room) {
            let (code, text) = if length <= room {
                let text = format!("it should have {length} bytes, only {there} are there");
                (Code::GlbUnexpectedEndOfChunkData, text)
            } else {
                let text = format!("it should have {length} bytes, the header leaves room for {room}");
                (Code::GlbChunkTooBig, text)
            };
            // Missing binary data is reported where it is needed.
            if number == 0 {
                report.add(code, place, text);
                return None;
            }
            report.warn(code, &place, text);
        }
        let (data, behind) = rest[8..].split_at(length.min(there));
        rest = behind;
        check_chunk(kind, length, number, &place, report);
        let slot = match kind {
            JSON => &mut json,
            BIN => &mut bin,
            _ => continue,
        };
        match slot {
            Some(_) => report.add(Code::GlbDuplicateChunk, place, "a second chunk of its type is skipped"),
            None => *slot = Some(data),
        }
    }
    json.map(|json| (json, bin))
}

/// Type of a chunk as its four characters, or as a number if they are not printable.
fn name_of(kind: u32) -> String {
    let bytes = kind.to_le_bytes();
    match std::str::from_utf8(&bytes).map(|text| text.trim_end_matches(['\0', ' '])) {
        Ok(name) if !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic()) => format!("'{name}'"),
        _ => format!("{kind:#010x}"),
    }
}

fn check_chunk(kind: u32, length: usize, number: usize, place: &str, report: &mut Report) {
    if !length.is_multiple_of(4) {
        report.add(Code::GlbChunkLengthUnaligned, place, format!("its length {length} is no multiple of 4"));
    }
    if length == 0 && kind != BIN {
        report.add(Code::GlbEmptyChunk, place, "it is empty");
    }
    if kind == BIN && number != 1 {
        report.add(Code::GlbUnexpectedBinChunk, place, "the binary chunk is not the second one");
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes(four.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let body: Vec<u8> = chunks
            .iter()
            .flat_map(|(kind, data)| {
                (data.len() as u32).to_le_bytes().into_iter().chain(**kind).chain(data.iter().copied())
            })
            .collect();
        let head = b"glTF".iter().copied().chain(2u32.to_le_bytes()).chain((body.len() as u32 + 12).to_le_bytes());
        head.chain(body).collect()
    }

    type Parts = (String, Option<Vec<u8>>);

    /// Splits a file; returns the JSON and binary parts, and the codes of all diagnostics.
    fn split_all(bytes: &[u8]) -> (Option<Parts>, Vec<&'static str>) {
        let mut report = Report::new(Path::new("a.glb"));
        let parts = split(bytes, &mut report)
            .map(|c| (String::from_utf8_lossy(c.json).into_owned(), c.bin.map(<[u8]>::to_vec)));
        let mut names: Vec<_> = report.warnings.clone().into_vec().iter().map(|w| w.code).collect();
        if let Err(crate::load::LoadError::Input(faults)) = report.check() {
            names.extend(faults.iter().map(|f| f.code));
        }
        (parts, names)
    }

    #[test]
    fn a_glb_splits_into_json_and_binary_and_skips_unknown_chunks() {
        let (parts, names) = split_all(&glb(&[(b"JSON", b"{}  "), (b"XTRA", b"...."), (b"BIN\0", b"1234")]));
        assert_eq!(parts, Some(("{}  ".into(), Some(b"1234".to_vec()))));
        assert_eq!(names, ["gltf-glb-unexpected-bin-chunk"]);
    }

    #[test]
    fn every_way_to_cut_a_glb_short_is_a_message() {
        let whole = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"1234")]);
        for length in 0..whole.len() {
            let (parts, names) = split_all(&whole[..length]);
            // Cut between the chunks, or in the data of the second, the JSON is still whole.
            assert_eq!(parts.is_some(), length == 24 || length >= 32, "{length}");
            assert!(!names.is_empty(), "{length}");
        }
    }

    #[test]
    fn a_chunk_that_is_cut_off_is_told_from_one_that_its_header_has_no_room_for() {
        let whole = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"1234")]);
        let cut = ["gltf-glb-length-mismatch", "gltf-glb-unexpected-end-of-chunk-data"];
        assert_eq!(split_all(&whole[..whole.len() - 1]).1, cut);
        let mut large = whole;
        large[24] += 4;
        assert_eq!(split_all(&large).1, ["gltf-glb-chunk-too-big"]);
    }

    #[test]
    fn a_byte_order_mark_and_odd_lengths_are_warned_about() {
        assert_eq!(split_all(b"\xef\xbb\xbf{}").0, Some(("{}".into(), None)));
        let mut odd = glb(&[(b"JSON", b"{} ")]);
        assert_eq!(split_all(&odd).1, ["gltf-glb-chunk-length-unaligned"]);
        odd[8] += 1;
        assert!(split_all(&odd).1.contains(&"gltf-glb-length-mismatch"));
        odd[8] -= 2;
        assert!(split_all(&odd).1.contains(&"gltf-glb-extra-data"));
        odd[8] += 1;
        odd[4] = 1;
        assert_eq!(split_all(&odd), (None, vec!["gltf-glb-invalid-version"]));
    }
}
