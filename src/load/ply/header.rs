//! The header of a PLY file: lines of words up to `end_header`.

use crate::load::Diagnostic;
use crate::load::diagnostic::CUT_OFF;
use crate::load::finder::unquote;
use crate::load::paths::shorten;
use crate::load::text::encoding::decode_name;
use crate::load::text::without_mark;
use std::path::Path;

/// Encoding of the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// Number type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    /// Whether the type is an integer.
    pub(super) fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Size in a binary file, in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Decodes the value at the beginning of `bytes`, exactly; `None` where there are too few.
    #[inline]
    pub(super) fn value(self, bytes: &[u8], big: bool) -> Option<f64> {
        #[inline]
        fn first<const N: usize>(bytes: &[u8], big: bool) -> Option<[u8; N]> {
            let mut bytes = *bytes.first_chunk::<N>()?;
            if big {
                bytes.reverse();
            }
            Some(bytes)
        }
        Some(match self {
            Self::I8 => f64::from(i8::from_le_bytes(first(bytes, big)?)),
            Self::U8 => f64::from(u8::from_le_bytes(first(bytes, big)?)),
            Self::I16 => f64::from(i16::from_le_bytes(first(bytes, big)?)),
            Self::U16 => f64::from(u16::from_le_bytes(first(bytes, big)?)),
            Self::I32 => f64::from(i32::from_le_bytes(first(bytes, big)?)),
            Self::U32 => f64::from(u32::from_le_bytes(first(bytes, big)?)),
            Self::F32 => f64::from(f32::from_le_bytes(first(bytes, big)?)),
            Self::F64 => f64::from_le_bytes(first(bytes, big)?),
        })
    }

    /// Type of a name; both families of names are in use.
    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

/// A named value of an element, or a list of values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
    /// Type of a list's length; `None`: a single value.
    pub length: Option<Kind>,
}

/// A declared element: rows of properties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    /// Number of rows as claimed, not verified.
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// Smallest size of a row in the file, in bytes.
    pub(super) fn least(&self, encoding: Encoding) -> u64 {
        let size = |property: &Property| match encoding {
            // A digit; the end of the file may follow it.
            Encoding::Text => 1,
            _ => property.length.unwrap_or(property.kind).size() as u64,
        };
        self.properties.iter().map(size).sum()
    }
}

/// The parsed header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Comments and object information, without their keywords.
    pub comments: Vec<String>,
    /// Pictures named by comments in MeshLab's style (`comment TextureFile`), with their lines.
    pub pictures: Vec<(u32, String)>,
    /// Length of the header, in bytes.
    pub length: usize,
    /// Number of lines of the header.
    pub lines: u32,
}

impl Header {
    /// Parses the header.
    ///
    /// # Errors
    /// At the first line that is not valid.
    pub(super) fn read(bytes: &[u8], file: &Path) -> Result<Self, Diagnostic> {
        let mut lines = Lines::new(bytes);
        let mut parts = Parts {
            file,
            line: 1,
            encoding: None,
            elements: Vec::new(),
            parts: 0,
            comments: Vec::new(),
            pictures: Vec::new(),
        };
        if lines.next().is_none_or(|line| line.trim_ascii() != b"ply") {
            return Err(parts.fault("the file does not begin with a line `ply`", "name a PLY file"));
        }
        while let Some(line) = lines.next() {
            parts.line = lines.count;
            if parts.take(&decode_name(line))? {
                let Some(encoding) = parts.encoding else {
                    return Err(parts.fault("the header has no line `format`", "export it again"));
                };
                let Parts { elements, comments, pictures, .. } = parts;
                return Ok(Self { encoding, elements, comments, pictures, length: lines.at, lines: lines.count });
            }
        }
        Err(parts.fault("the file ends inside the header, before `end_header`", CUT_OFF))
    }

    /// First element of that name.
    pub(super) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

/// Splits lines at LF, optionally preceded by CR, or at CR where the first line ends so: in a binary file, the bytes behind
/// the last line may look like half a line end.
struct Lines<'a> {
    bytes: &'a [u8],
    end: u8,
    at: usize,
    count: u32,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let first = bytes.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(bytes.len());
        let at = bytes.len() - without_mark(bytes).len();
        let end = match &bytes[first..] {
            [b'\r', b'\n', ..] => b'\n',
            [b'\r', ..] => b'\r',
            _ => b'\n',
        };
        Self { bytes, end, at, count: 0 }
    }

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&b| b == self.end)?;
        self.at += length + 1;
        self.count = self.count.saturating_add(1);
        let line = &rest[..length];
        Some(if self.end == b'\n' { line.strip_suffix(b"\r").unwrap_or(line) } else { line })
    }
}

/// Header under construction.
struct Parts<'a> {
    file: &'a Path,
    line: u32,
    encoding: Option<Encoding>,
    elements: Vec<Element>,
    /// Number of elements, properties and pictures so far.
    parts: usize,
    comments: Vec<String>,
    pictures: Vec<(u32, String)>,
}

/// Largest number of elements, properties and pictures of a header, far more than programs write.
const MOST: usize = 4096;

/// Longest name of a picture, in bytes: no system has longer ones.
const LONGEST_NAME: usize = 4096;

/// Number of comments that are kept: programs write theirs first.
const COMMENTS: usize = 64;

impl Parts<'_> {
    fn fault(&self, text: impl Into<String>, remedy: &str) -> Diagnostic {
        Diagnostic::new("ply-header", self.file, self.line.to_string(), text).remedy(remedy)
    }

    /// Parses one line; returns whether it was the last.
    fn take(&mut self, line: &str) -> Result<bool, Diagnostic> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            [] => {}
            ["end_header", ..] => return Ok(true),
            ["comment" | "obj_info", ..] => {
                if let Some((_, said)) = line.trim().split_once(char::is_whitespace) {
                    self.comment(said.trim())?;
                }
            }
            ["format", name, _version] => self.encoding = Some(self.encoding(name)?),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| {
                    let text = format!("`{}` is no number of elements `{}`", shorten(count), shorten(name));
                    self.fault(text, "export it again")
                })?;
                self.count()?;
                self.elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", "list", length, kind, name] => {
                let (length, kind) = (self.kind(length)?, self.kind(kind)?);
                if matches!(length, Kind::F32 | Kind::F64) {
                    return Err(self.fault("the length of a list is no whole number", "export it again"));
                }
                self.property(Property { name: name.into(), kind, length: Some(length) })?;
            }
            ["property", kind, name] => {
                let kind = self.kind(kind)?;
                self.property(Property { name: name.into(), kind, length: None })?;
            }
            _ => {
                let text = format!("`{}` is no line of a PLY header", shorten(line.trim()));
                return Err(self.fault(text, "export it again"));
            }
        }
        Ok(false)
    }

    fn comment(&mut self, said: &str) -> Result<(), Diagnostic> {
        let picture = said
            .split_once(char::is_whitespace)
            .filter(|(word, name)| word.eq_ignore_ascii_case("TextureFile") && name.len() <= LONGEST_NAME);
        if let Some((_, name)) = picture {
            self.count()?;
            self.pictures.push((self.line, unquote(name.trim()).into()));
        } else if self.comments.len() < COMMENTS {
            self.comments.push(said.into());
        }
        Ok(())
    }

    fn encoding(&self, name: &str) -> Result<Encoding, Diagnostic> {
        Ok(match name {
            "ascii" => Encoding::Text,
            "binary_little_endian" => Encoding::LittleEndian,
            "binary_big_endian" => Encoding::BigEndian,
            _ => {
                let known = "PLY has ascii, binary_little_endian and binary_big_endian";
                return Err(self.fault(format!("`{}` is no format of PLY", shorten(name)), known));
            }
        })
    }

    fn kind(&self, word: &str) -> Result<Kind, Diagnostic> {
        let known = "PLY has char, uchar, short, ushort, int, uint, float and double";
        Kind::of(word).ok_or_else(|| self.fault(format!("`{}` is no type of PLY", shorten(word)), known))
    }

    /// Counts an element, a property or a picture, and refuses too many.
    fn count(&mut self) -> Result<(), Diagnostic> {
        self.parts += 1;
        if self.parts > MOST {
            return Err(self.fault(format!("more than {MOST} elements, properties and pictures"), "export it again"));
        }
        Ok(())
    }

    fn property(&mut self, property: Property) -> Result<(), Diagnostic> {
        self.count()?;
        let Some(element) = self.elements.last_mut() else {
            return Err(self.fault("a property before the first element", "export it again"));
        };
        element.properties.push(property);
        Ok(())
    }
}
