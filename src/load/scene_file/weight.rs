//! What a TOML text takes in memory once it is parsed, by its signs alone.

/// Bytes that parsing a text, and keeping what it says, takes at most: by what the tokens, values and tables that a sign
/// stands for were measured to take, a little more than that.
pub(super) fn weight(text: &str) -> u64 {
    /// An entry: its key, the table that is grown by it, its value.
    const ENTRY: u64 = 450;
    /// A table of its own, which each part of a dotted key makes.
    const TABLE: u64 = 650;
    /// A value in a list, with its tokens.
    const ITEM: u64 = 220;
    const OPEN: u64 = 200;
    const CLOSE: u64 = 100;
    const LINE: u64 = 80;
    /// The text itself, its names and strings.
    const BYTE: u64 = 4;
    // Dots since the last sign that can stand before a key: of a number, unless the key ends.
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
