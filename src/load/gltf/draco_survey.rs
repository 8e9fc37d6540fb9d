//! A pass over a Draco stream that decodes no values but checks every count by which the decoder allocates memory.
//!
//! The decoder trusts the numbers of attributes, symbols and orientations that a stream declares, and a damaged stream may
//! declare any. After the Draco bitstream specification, version 2.2.

use super::draco_codec::{SPARE, WantedAttribute};
use super::draco_points::NONE;
use super::draco_stream::{Cursor, Method, start};
use draco_oxide_core::bit_coder::Reader;
use draco_oxide_core::codec::header::EncoderMethod;
use draco_oxide_decoder::connectivity::{Connectivity, EdgebreakerConnectivity, decode_connectivity};
use draco_oxide_decoder::entropy::start_symbol_decoder;

/// Largest alphabet: the widest directly coded symbols have 18 bits.
const ALPHABET: u64 = 1 << 18;

/// Contexts of the traversal that predicts symbols by the valence of vertices.
const VALENCES: usize = 6;

/// Properties of a stream that the decoder does not return.
pub(super) struct Survey {
    /// Connectivity of the triangles, for edgebreaker streams.
    pub(super) connectivity: Option<Connectivity>,
    /// Id of the seams that divide each attribute.
    pub(super) seams: Vec<Option<u8>>,
}

/// Checks a stream whose counts fit `wanted`; like the decoder, it may panic on damaged streams.
///
/// # Errors
/// What is wrong with the stream.
pub(super) fn check(stream: &[u8], wanted: &[WantedAttribute]) -> Result<Survey, String> {
    let (counts, method, cursor) = start(stream)?;
    let most = wanted.iter().map(|w| w.most).max().unwrap_or(0);
    let mut walk = Walk { cursor, most };
    let (sizes, connectivity) = match method {
        Method::Sequential => {
            walk.indices(counts.faces, counts.vertices)?;
            (Sizes::Same(counts.vertices), None)
        }
        Method::Edgebreaker { traversal, seams } => {
            walk.traversal(traversal, seams, counts.faces)?;
            let (sizes, connectivity) = Sizes::by_seams(stream)?;
            (sizes, Some(connectivity))
        }
    };
    let decoders = walk.descriptions(matches!(method, Method::Edgebreaker { .. }))?;
    let attributes: usize = decoders.iter().map(Vec::len).sum();
    if attributes > wanted.len() + SPARE {
        return Err(format!("the stream has {attributes} attributes, the primitive {}", wanted.len()));
    }
    for decoder in &decoders {
        decoder.iter().try_for_each(|attribute| walk.values(attribute, sizes.of(attribute)?))?;
        decoder.iter().try_for_each(|attribute| walk.transform(attribute))?;
    }
    let seams = decoders.iter().flatten().map(|attribute| attribute.seams).collect();
    Ok(Survey { connectivity, seams })
}

/// Number of values per attribute.
enum Sizes {
    /// One value per vertex.
    Same(u64),
    /// One value per vertex, and more where seams of the attribute divide it.
    Seams { vertices: u64, divided: Vec<u64> },
}

impl Sizes {
    fn by_seams(stream: &[u8]) -> Result<(Self, Connectivity), String> {
        let mut reader = Reader::new(faces_of(stream)?);
        let connectivity = decode_connectivity(&mut reader, EncoderMethod::Edgebreaker).map_err(broken)?;
        let walked = connectivity.edgebreaker().ok_or_else(|| broken("no faces"))?;
        let vertices = referenced(walked);
        let divided = walked.seam_stats.iter().map(|stats| {
            let more = stats.starts.saturating_sub(stats.fans_with_starts) as u64;
            if stats.has_interior { vertices + more } else { vertices }
        });
        let sizes = Self::Seams { vertices, divided: divided.collect() };
        Ok((sizes, connectivity))
    }

    fn of(&self, attribute: &Attribute) -> Result<u64, String> {
        match (self, attribute.seams) {
            (Self::Same(count), _) => Ok(*count),
            (Self::Seams { vertices, .. }, None) => Ok(*vertices),
            (Self::Seams { divided, .. }, Some(i)) => divided
                .get(usize::from(i))
                .copied()
                .ok_or_else(|| format!("the stream names seams {i}, and has {} sets of them", divided.len())),
        }
    }
}

/// Part of a stream from its faces on, after header and metadata.
fn faces_of(stream: &[u8]) -> Result<&[u8], String> {
    let mut cursor = Cursor(stream);
    cursor.header()?;
    Ok(cursor.0)
}

/// Number of vertices that have a corner.
fn referenced(walked: &EdgebreakerConnectivity) -> u64 {
    let corners = walked.vertex_corners.iter().take(walked.num_vertices);
    corners.filter(|&&corner| usize::from(corner) != NONE).count() as u64
}

/// Description of an attribute in a stream.
struct Attribute {
    /// Id of the seams that divide the attribute.
    seams: Option<u8>,
    component: u8,
    width: u8,
    /// Encoding of its values: 0 generic, 1 integers, 2 quantised, 3 octahedral.
    form: u8,
}

struct Walk<'a> {
    cursor: Cursor<'a>,
    /// Largest number of values that an attribute may have.
    most: u64,
}

impl Walk<'_> {
    /// Passes a list of indices.
    fn indices(&mut self, faces: u64, vertices: u64) -> Result<(), String> {
        if faces > self.cursor.0.len() as u64 / 3 {
            return Err(many("triangles", faces, self.cursor.0.len() as u64 / 3));
        }
        let corners = faces * 3;
        match (self.cursor.byte()?, vertices) {
            (0, _) => self.symbols(corners, 1),
            (_, ..256) => self.cursor.take(corners).map(drop),
            (_, ..0x1_0000) => self.cursor.take(corners * 2).map(drop),
            (_, ..0x20_0000) => (0..corners).try_for_each(|_| self.cursor.number().map(drop)),
            _ => self.cursor.take(corners * 4).map(drop),
        }
    }

    /// Passes the symbols of an edgebreaker traversal.
    fn traversal(&mut self, traversal: u8, seams: u8, faces: u64) -> Result<(), String> {
        if traversal == 0 {
            self.block()?;
        }
        (0..=seams).try_for_each(|_| self.bits())?;
        if traversal != 0 {
            for _ in 0..VALENCES {
                let count = self.cursor.number()?;
                if count > faces {
                    return Err(many("symbols", count, faces));
                }
                if count > 0 {
                    self.symbols(count, 1)?;
                }
            }
        }
        Ok(())
    }

    /// Reads the descriptions of the attributes, grouped by attribute decoder.
    fn descriptions(&mut self, walked: bool) -> Result<Vec<Vec<Attribute>>, String> {
        let mut decoders = Vec::new();
        for _ in 0..self.cursor.byte()? {
            let mut seams = None;
            if walked {
                let head = self.cursor.take(3)?;
                seams = Some(head[0]).filter(|&i| i != 0xff && head[1] == 1);
            }
            decoders.push((seams, Vec::new()));
        }
        for (seams, attributes) in &mut decoders {
            let count = self.cursor.number()?;
            if count > self.cursor.0.len() as u64 / 5 {
                return Err(many("attributes", count, self.cursor.0.len() as u64 / 5));
            }
            for _ in 0..count {
                let head = self.cursor.take(4)?;
                attributes.push(Attribute { seams: *seams, component: head[1], width: head[2], form: 0 });
                self.cursor.number()?;
            }
            for attribute in attributes.iter_mut() {
                attribute.form = self.cursor.byte()?;
            }
        }
        Ok(decoders.into_iter().map(|(_, attributes)| attributes).collect())
    }

    /// Passes the encoded values of an attribute.
    fn values(&mut self, attribute: &Attribute, count: u64) -> Result<(), String> {
        if count > self.most {
            return Err(many("values of an attribute", count, self.most));
        }
        let width = if attribute.form == 3 { 2 } else { u64::from(attribute.width) };
        if attribute.form == 0 {
            let size = match attribute.component {
                1 | 2 => 1,
                3 | 4 => 2,
                _ => 4,
            };
            return self.cursor.take(count * width * size).map(drop);
        }
        let scheme = self.cursor.byte()?;
        let transform = if scheme == 0xfe { None } else { Some(self.cursor.byte()?) };
        match self.cursor.byte()? {
            0 => self.cursor.take(count * width * 4).map(drop)?,
            _ => self.symbols(count * width, width)?,
        }
        match scheme {
            4 => (1..=4).try_for_each(|context| {
                let bits = self.cursor.number()?;
                if bits > count * context { Err(many("creases", bits, count * context)) } else { self.bits_of(bits) }
            })?,
            5 => {
                let head = self.cursor.take(4)?;
                let orientations = u64::from(u32::from_le_bytes([head[0], head[1], head[2], head[3]]));
                if orientations > count {
                    return Err(many("orientations", orientations, count));
                }
                self.bits()?;
            }
            _ => {}
        }
        // Two numbers: the range of wrapped values, or the quantisation of octahedral ones.
        if let Some(1 | 3) = transform {
            self.cursor.take(8)?;
        }
        if scheme == 6 { self.bits() } else { Ok(()) }
    }

    /// Passes the parameters that turn the values of an attribute into floats.
    fn transform(&mut self, attribute: &Attribute) -> Result<(), String> {
        let length = match attribute.form {
            2 => 4 * u64::from(attribute.width) + 5,
            3 => 1,
            _ => 0,
        };
        self.cursor.take(length).map(drop)
    }

    /// Passes a block of bytes that its length precedes.
    fn block(&mut self) -> Result<(), String> {
        let length = self.cursor.number()?;
        self.cursor.take(length).map(drop)
    }

    /// Passes entropy-coded bits, which the probability of a zero precedes.
    fn bits(&mut self) -> Result<(), String> {
        self.cursor.byte()?;
        self.block()
    }

    fn bits_of(&mut self, count: u64) -> Result<(), String> {
        if count > 0 { self.bits() } else { Ok(()) }
    }

    /// Passes entropy-coded symbols, `width` per value.
    fn symbols(&mut self, count: u64, width: u64) -> Result<(), String> {
        let whole = self.cursor.0;
        let direct = self.cursor.byte()? != 0;
        if direct {
            self.cursor.byte()?;
        }
        self.alphabet()?;
        self.block()?;
        if !direct {
            // The extent of the raw values that follow is known only once their bit lengths are decoded.
            let count = usize::try_from(count).map_err(|e| e.to_string())?;
            let mut reader = Reader::new(whole);
            start_symbol_decoder(&mut reader, count, width as usize).map_err(broken)?;
            let rest = whole.len().saturating_sub(reader.remaining());
            self.cursor.0 = whole.get(rest..).unwrap_or_default();
        }
        Ok(())
    }

    /// Passes the frequencies of the symbols.
    fn alphabet(&mut self) -> Result<(), String> {
        let count = self.cursor.number()?;
        if count > ALPHABET {
            return Err(many("symbols", count, ALPHABET));
        }
        let mut known = 0;
        while known < count {
            let token = self.cursor.byte()?;
            match token & 3 {
                3 => known += u64::from(token >> 2),
                more => self.cursor.take(more.into()).map(drop)?,
            }
            known += 1;
        }
        Ok(())
    }
}

fn broken(why: impl std::fmt::Display) -> String {
    format!("the stream cannot be decoded: {why}")
}

fn many(what: &str, count: u64, most: u64) -> String {
    format!("the stream declares {count} {what} where {most} are possible: it is damaged")
}
