//! Estimate of the memory of a parsed TOML text, by its characters alone.

/// Upper bound of the bytes that parsing a text and keeping its values takes, from the measured memory of the tokens, values
/// and tables that each character stands for, with a small margin.
pub(super) fn weight(text: &str) -> u64 {
    /// An entry: its key, the growth of its table, its value.
    const ENTRY: u64 = 450;
    /// A table of its own, which each part of a dotted key makes.
    const TABLE: u64 = 650;
    /// A value in a list, with its tokens.
    const ITEM: u64 = 220;
    const OPEN: u64 = 200;
    const CLOSE: u64 = 100;
    const LINE: u64 = 80;
    /// A byte of the text itself, its names and strings.
    const BYTE: u64 = 4;
    // Dots since the last character that can precede a key: they belong to numbers, unless the key ends here.
    let (mut bytes, mut dots) = (0u64, 0u64);
    for sign in text.bytes() {
        let (own, ends_key) = match sign {
            b'.' => {
                dots += 1;
                continue;
            }
            b'=' => (ENTRY, true),
            b']' => (CLOSE, true),
            b',' => (ITEM, false),
            b'[' | b'{' => (OPEN, false),
            b'}' => (CLOSE, false),
            b'\n' => (LINE, false),
            _ => continue,
        };
        let tables = if ends_key { dots * TABLE } else { 0 };
        bytes = bytes.saturating_add(own + tables);
        dots = 0;
    }
    bytes.saturating_add(BYTE * text.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_tables_and_items_weigh_and_the_dots_of_numbers_do_not() {
        let same = |a: &str, b: &str| assert_eq!(weight(a), weight(b), "{a} {b}");
        same("a=[1.5,2.5,3]\n", "a=[125,225,3]\n");
        assert!(weight("a.b.c=1\n") > weight("a_b_c=1\n") + 1000);
        assert!(weight("[a.b]\n") > weight("[a_b]\n") + 500);
        assert!(weight(&"1,".repeat(1000)) > 200_000 && weight(&"a=1\n".repeat(1000)) > 400_000);
        assert!(weight(&"a comment without signs ".repeat(1000)) < 100_000);
    }
}
