//! Bytes of a text file -> bytes in a superset of ASCII, without a byte-order mark.
//!
//! OBJ and MTL are ASCII with names in the encoding of the writer's system. UTF-16 is converted; other encodings
//! are left unchanged, and names are decoded when they are used ([`decode_name`]).

use std::borrow::Cow;

/// Strips a UTF-8 byte-order mark and converts UTF-16, with a mark or without.
pub(in crate::load) fn to_ascii_superset(bytes: &[u8]) -> Cow<'_, [u8]> {
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => rest.into(),
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes).into(),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes).into(),
        [1..=255, 0, 1..=255, 0, ..] => utf16(bytes, u16::from_le_bytes).into(),
        [0, 1..=255, 0, 1..=255, ..] => utf16(bytes, u16::from_be_bytes).into(),
        _ => bytes.into(),
    }
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Vec<u8> {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect::<String>().into_bytes()
}

/// Decodes a name or path: UTF-8, or else Latin-1, which maps every byte to some character and different bytes to
/// different characters, so that names in another encoding still match each other.
pub(in crate::load) fn decode_name(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_stripped_and_utf_16_is_converted() {
        let text = "o Bär\n";
        let units = |to: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(to).collect::<Vec<u8>>();
        let (le, be) = (units(u16::to_le_bytes), units(u16::to_be_bytes));
        assert_eq!(*to_ascii_superset(&[b"\xef\xbb\xbf", text.as_bytes()].concat()), *text.as_bytes());
        assert_eq!(*to_ascii_superset(&[b"\xff\xfe".as_slice(), &le].concat()), *text.as_bytes());
        assert_eq!(*to_ascii_superset(&[b"\xfe\xff".as_slice(), &be].concat()), *text.as_bytes());
        assert_eq!(*to_ascii_superset(&le), *text.as_bytes());
        assert_eq!(*to_ascii_superset(&be), *text.as_bytes());
        assert_eq!(*to_ascii_superset(b"v"), *b"v");
    }

    #[test]
    fn names_in_any_encoding_become_text() {
        assert_eq!(decode_name("Bär".as_bytes()), "Bär");
        assert_eq!(decode_name(b"B\xe4r"), "Bär");
    }
}
