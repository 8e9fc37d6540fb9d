//! One map statement of an MTL file: its options and its file name.

use crate::load::number;
use crate::load::text::encoding::decode_name;
use crate::math::DVec2;

/// Channel of a picture that a scalar map reads (`-imfchan`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    Red,
    Green,
    Blue,
    Alpha,
    Luminance,
}

/// A map statement.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub line: u32,
    /// File name as written.
    pub file: String,
    /// `-imfchan`.
    pub channel: Option<Channel>,
    /// `-s`: multiplies u and v (v pointing up).
    pub scale: DVec2,
    /// `-o`: added after scaling.
    pub offset: DVec2,
    /// `-clamp on`.
    pub clamp: bool,
    /// `-bm`, if given.
    pub bump: Option<f64>,
    /// `-mm`: base and gain, if they change anything.
    pub base_gain: Option<(f64, f64)>,
    /// Options that should change the rendering but are not supported.
    pub ignored: Vec<String>,
}

/// Option names, each with the largest count of numbers or words that follow; `-o`, `-s`, `-t` take one to three numbers.
const OPTIONS: [(&[u8], usize); 13] = [
    (b"-blendu", 1),
    (b"-blendv", 1),
    (b"-bm", 1),
    (b"-boost", 1),
    (b"-cc", 1),
    (b"-clamp", 1),
    (b"-imfchan", 1),
    (b"-mm", 2),
    (b"-o", 3),
    (b"-s", 3),
    (b"-t", 3),
    (b"-texres", 1),
    (b"-type", 1),
];

/// Parses the rest of a map statement; `None` when it names no file.
pub(super) fn parse(rest: &[u8], line: u32) -> Option<Map> {
    let mut map = Map {
        line,
        file: String::new(),
        channel: None,
        scale: DVec2::ONE,
        offset: DVec2::ZERO,
        clamp: false,
        bump: None,
        base_gain: None,
        ignored: Vec::new(),
    };
    let name = take_options(&mut map, rest, true);
    // Some programs write options after the name.
    let (name, late) = name.split_at(late_options(name));
    take_options(&mut map, late.trim_ascii(), false);
    let name = name.trim_ascii();
    let unquoted = name.strip_prefix(b"\"").and_then(|n| n.strip_suffix(b"\"")).unwrap_or(name);
    map.file = decode_name(unquoted);
    (!map.file.is_empty()).then_some(map)
}

/// Parses leading options into `map` and returns the rest: the file name, which may hold spaces, if `name_follows`.
fn take_options<'a>(map: &mut Map, mut rest: &'a [u8], name_follows: bool) -> &'a [u8] {
    while let Some(&(option, most)) = OPTIONS.iter().find(|(o, _)| first_word(rest).eq_ignore_ascii_case(o)) {
        rest = rest[option.len()..].trim_ascii_start();
        let numeric = matches!(option, b"-o" | b"-s" | b"-t" | b"-mm" | b"-bm" | b"-boost" | b"-texres");
        let mut values = Vec::new();
        while values.len() < most {
            let word = first_word(rest);
            let is_value = !word.is_empty() && (!numeric || is_number(word));
            // The last word is the file name, even if it reads 1.5.
            if !is_value || (name_follows && !values.is_empty() && word.len() == rest.len()) {
                break;
            }
            values.push(word);
            rest = rest[word.len()..].trim_ascii_start();
        }
        apply(map, option, &values);
    }
    rest
}

fn apply(map: &mut Map, option: &[u8], values: &[&[u8]]) {
    let text = values.first().map(|v| v.to_ascii_lowercase()).unwrap_or_default();
    let numbers: Vec<f64> = values.iter().filter_map(|v| number::check(v).word.parse().ok()).collect();
    let or = |i: usize, other: f64| numbers.get(i).copied().filter(|n| n.is_finite()).unwrap_or(other);
    match option {
        b"-s" => map.scale = DVec2::new(or(0, 1.0), or(1, 1.0)),
        b"-o" => map.offset += DVec2::new(or(0, 0.0), or(1, 0.0)),
        // Turbulence displaces texture coordinates; it is not supported.
        b"-t" if numbers.iter().any(|&n| n != 0.0) => map.ignored.push("-t".into()),
        b"-bm" => map.bump = Some(or(0, 1.0)),
        b"-mm" if (or(0, 0.0), or(1, 1.0)) != (0.0, 1.0) => map.base_gain = Some((or(0, 0.0), or(1, 1.0))),
        b"-clamp" => map.clamp = text == b"on",
        b"-cc" if text == b"on" => map.ignored.push("-cc on".into()),
        b"-imfchan" => {
            map.channel = match text.as_slice() {
                b"r" => Some(Channel::Red),
                b"g" => Some(Channel::Green),
                b"b" => Some(Channel::Blue),
                b"m" => Some(Channel::Alpha),
                b"l" => Some(Channel::Luminance),
                _ => None,
            }
        }
        // Blending, sharpening and resolution hints are up to the renderer; types belong to reflection maps.
        _ => {}
    }
}

/// Offset at which options begin after the file name, or the length of `name` if there are none.
fn late_options(name: &[u8]) -> usize {
    let starts = |at: &usize| {
        let after_space = *at > 0 && name[*at - 1].is_ascii_whitespace();
        let word = first_word(&name[*at..]);
        after_space && word.len() < name.len() - at && OPTIONS.iter().any(|(o, _)| word.eq_ignore_ascii_case(o))
    };
    (0..name.len()).find(starts).unwrap_or(name.len())
}

fn first_word(text: &[u8]) -> &[u8] {
    let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
    &text[..end]
}

fn is_number(word: &[u8]) -> bool {
    let number = number::check(word);
    !number.odd && number.places.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Map {
        parse(text.as_bytes(), 1).unwrap()
    }

    #[test]
    fn names_keep_their_spaces_and_backslashes_and_lose_their_quotes() {
        assert_eq!(of("my wood 2.png").file, "my wood 2.png");
        assert_eq!(of("..\\maps\\a.png").file, "..\\maps\\a.png");
        assert_eq!(of("\"a b.png\"").file, "a b.png");
        assert!(parse(b"", 1).is_none() && parse(b"-clamp on", 1).is_none());
    }

    #[test]
    fn options_before_and_after_the_name_are_read() {
        let map = of("-s 2 3 1 -o 0.5 -clamp on -imfchan g -bm 0.3 a b.png");
        assert_eq!((map.file.as_str(), map.scale, map.offset), ("a b.png", DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0)));
        assert_eq!((map.clamp, map.channel, map.bump), (true, Some(Channel::Green), Some(0.3)));
        let late = of("c.png -s 4 5 -o 0.25 0.5");
        assert_eq!((late.scale, late.offset), (DVec2::new(4.0, 5.0), DVec2::new(0.25, 0.5)));
        assert_eq!(of("c.png -mm 0.1 0.9").base_gain, Some((0.1, 0.9)));
        let late = of("-imfchan r bump2.jpg -bm 1.5");
        assert_eq!((late.file.as_str(), late.bump, late.channel), ("bump2.jpg", Some(1.5), Some(Channel::Red)));
    }

    #[test]
    fn fewer_numbers_than_three_leave_the_others_at_their_defaults() {
        let map = of("-s 4 a.png");
        assert_eq!((map.file.as_str(), map.scale), ("a.png", DVec2::new(4.0, 1.0)));
        assert_eq!(of("-o 0.25 2 1.5").file, "1.5", "the last word is the file");
        assert_eq!(of("-mm 0.1 0.3 a.png").base_gain, Some((0.1, 0.3)));
        assert_eq!(of("-mm 0 1 a.png").base_gain, None);
    }

    #[test]
    fn options_that_cannot_be_drawn_are_remembered() {
        assert_eq!(of("-type sphere -cc on -blendu off -texres 512 a.png").ignored, ["-cc on"]);
        assert_eq!(of("-t 0.1 0.2 0.3 a.png").ignored, ["-t"]);
        assert!(of("-t 0 0 0 a.png").ignored.is_empty());
    }
}
