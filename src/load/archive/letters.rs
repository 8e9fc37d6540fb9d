//! Decoding of the file names in archives.

/// Characters of the bytes from 128 on in names that are not UTF-8: code page 437, as the format prescribes (PKWARE,
/// "APPNOTE.TXT", appendix D).
const UPPER: [&str; 4] = [
    "ÇüéâäàåçêëèïîìÄÅÉæÆôöòûùÿÖÜ¢£¥₧ƒ",
    "áíóúñÑªº¿⌐¬½¼¡«»░▒▓│┤╡╢╖╕╣║╗╝╜╛┐",
    "└┴┬├─┼╞╟╚╔╩╦╠═╬╧╨╤╥╙╘╒╓╫╪┘┌█▄▌▐▀",
    "αßΓπΣσµτΦΘΩδ∞φε∩≡±≥≤⌠⌡÷≈°∙·√ⁿ²■\u{a0}",
];

/// Decodes a file name: as UTF-8 where it is valid, whatever the archive's UTF-8 flag says, since programs forget to set it.
///
/// Distinct names stay distinct, even those in other code pages, which the archive does not name.
pub(super) fn of(bytes: &[u8]) -> String {
    let letter = |&byte: &u8| match byte.checked_sub(128) {
        None => Some(char::from(byte)),
        Some(upper) => UPPER[usize::from(upper / 32)].chars().nth(usize::from(upper % 32)),
    };
    std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().filter_map(letter).collect(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_utf8_or_of_the_first_pcs() {
        assert_eq!(of("Häuser/Grün.png".as_bytes()), "Häuser/Grün.png");
        assert_eq!(of(b"H\x84user/Gr\x81n.png"), "Häuser/Grün.png");
        assert_eq!(UPPER.map(|letters| letters.chars().count()), [32; 4]);
        let all: std::collections::HashSet<String> = (0..=255).map(|byte| of(&[byte])).collect();
        assert_eq!(all.len(), 256, "each byte is a letter of its own");
        assert_eq!(of(&[0xff]), "\u{a0}");
    }
}
