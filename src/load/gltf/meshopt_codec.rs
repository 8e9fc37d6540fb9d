//! meshoptimizer streams -> bytes: checks of their sizes, the decoders, and the filters after them.
//!
//! The formats are those of appendices A and B of KHR_meshopt_compression.

/// Type of the encoded elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Vertex attributes, or other data in whole 32-bit words.
    Attributes,
    /// Indices of a triangle list.
    Triangles,
    /// Any sequence of indices.
    Indices,
}

/// Filter that is applied to decoded elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Filter {
    /// Nothing.
    None,
    /// Unit vectors from octahedral coordinates.
    Octahedral,
    /// Unit quaternions from their three smaller components.
    Quaternion,
    /// Floats from a mantissa of 24 bits and an exponent of 8.
    Exponential,
    /// RGBA from luma, two chromas and alpha.
    Color,
}

impl Mode {
    /// Returns the mode of this name.
    pub(super) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "ATTRIBUTES" => Self::Attributes,
            "TRIANGLES" => Self::Triangles,
            "INDICES" => Self::Indices,
            _ => return None,
        })
    }
}

impl Filter {
    /// Returns the filter of this name; no filter for an empty name.
    pub(super) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "" | "NONE" => Self::None,
            "OCTAHEDRAL" => Self::Octahedral,
            "QUATERNION" => Self::Quaternion,
            "EXPONENTIAL" => Self::Exponential,
            "COLOR" => Self::Color,
            _ => return None,
        })
    }
}

/// Shape of the data in a stream.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) mode: Mode,
    pub(super) filter: Filter,
    /// Bytes per element.
    pub(super) stride: u64,
    /// Number of elements.
    pub(super) count: u64,
}

impl Shape {
    /// Bytes of all elements; `None` on overflow.
    pub(super) fn size(&self) -> Option<u64> {
        self.stride.checked_mul(self.count)
    }

    /// Upper bound of the bytes that a stream of `length` bytes decodes to.
    ///
    /// A block of 256 vertices takes at least two bits for each byte of a vertex, a triangle takes a byte, and so does
    /// an index.
    pub(super) fn largest(&self, length: u64) -> u64 {
        length.saturating_mul(match self.mode {
            Mode::Attributes => 256 * 4,
            Mode::Triangles => 3 * 4,
            Mode::Indices => 4,
        })
    }

    /// Checks the preconditions of the decoders.
    ///
    /// # Errors
    /// The property that is wrong, and how.
    pub(super) fn check(&self) -> Result<(), (&'static str, String)> {
        let Self { mode, filter, stride, count } = *self;
        let right = match mode {
            Mode::Attributes => (4..=256).contains(&stride) && stride % 4 == 0,
            Mode::Triangles | Mode::Indices => stride == 2 || stride == 4,
        };
        if !right {
            let rule = if mode == Mode::Attributes { "a multiple of 4 up to 256" } else { "2 or 4" };
            return Err((".byteStride", format!("{stride} where {rule} is allowed")));
        }
        if mode == Mode::Triangles && count % 3 != 0 {
            return Err((".count", format!("{count} indices do not make whole triangles")));
        }
        let filtered = match filter {
            Filter::None => true,
            _ if mode != Mode::Attributes => false,
            Filter::Octahedral | Filter::Color => stride == 4 || stride == 8,
            Filter::Quaternion => stride == 8,
            Filter::Exponential => true,
        };
        if !filtered {
            return Err((".filter", format!("not possible in this mode for elements of {stride} bytes")));
        }
        Ok(())
    }
}

/// Decodes a stream whose shape has passed [`Shape::check`].
///
/// # Errors
/// What is wrong with the stream.
#[cfg(feature = "meshopt")]
pub(super) fn decode(stream: &[u8], shape: &Shape) -> Result<Vec<u8>, String> {
    let count = usize::try_from(shape.count).map_err(|e| e.to_string())?;
    let mut bytes = match (shape.mode, shape.stride) {
        (Mode::Attributes, stride) => vertices::decode(stream, count, stride)?,
        (Mode::Triangles, 2) => bytes_of(::meshopt::decode_index_buffer(stream, count), u16::to_le_bytes)?,
        (Mode::Triangles, _) => bytes_of(::meshopt::decode_index_buffer(stream, count), u32::to_le_bytes)?,
        (Mode::Indices, 2) => bytes_of(::meshopt::decode_index_sequence(stream, count), u16::to_le_bytes)?,
        (Mode::Indices, _) => bytes_of(::meshopt::decode_index_sequence(stream, count), u32::to_le_bytes)?,
    };
    filters::apply(&mut bytes, shape);
    Ok(bytes)
}

/// Stub without the library, which returns an error.
#[cfg(not(feature = "meshopt"))]
pub(super) fn decode(_: &[u8], _: &Shape) -> Result<Vec<u8>, String> {
    Err("this meshray was built without the feature 'meshopt'".into())
}

#[cfg(feature = "meshopt")]
fn bytes_of<T: Copy, const N: usize>(
    decoded: ::meshopt::Result<Vec<T>>,
    bytes: impl Fn(T) -> [u8; N],
) -> Result<Vec<u8>, String> {
    let decoded = decoded.map_err(|_| "it is damaged".to_owned())?;
    Ok(decoded.into_iter().flat_map(bytes).collect())
}

#[cfg(feature = "meshopt")]
mod vertices {
    //! Decoding of vertices, whose size the library needs as a compile-time constant.

    /// A vertex of `N` words.
    #[derive(Clone, Copy)]
    #[repr(transparent)]
    struct Vertex<const N: usize>([u32; N]);

    impl<const N: usize> Default for Vertex<N> {
        fn default() -> Self {
            Self([0; N])
        }
    }

    fn words<const N: usize>(stream: &[u8], count: usize) -> Result<Vec<u8>, String> {
        let vertices = ::meshopt::decode_vertex_buffer::<Vertex<N>>(stream, count);
        let vertices = vertices.map_err(|_| "it is damaged".to_owned())?;
        // The library wrote bytes into the words, so the native order restores them.
        Ok(vertices.iter().flat_map(|vertex| vertex.0).flat_map(u32::to_ne_bytes).collect())
    }

    /// Calls `words` with the number of words as a constant.
    macro_rules! by_words {
        ($words:expr, $stream:expr, $count:expr; $($n:literal)*) => {
            match $words {
                $($n => words::<$n>($stream, $count),)*
                _ => Err("vertices of that size do not exist".into()),
            }
        };
    }

    /// Decodes vertices of `stride` bytes.
    pub(super) fn decode(stream: &[u8], count: usize, stride: u64) -> Result<Vec<u8>, String> {
        by_words!(stride / 4, stream, count;
            1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32
            33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64)
    }
}

#[cfg(feature = "meshopt")]
mod filters {
    //! Filters of the library, which take typed elements: bytes are copied to these and back.

    use super::{Filter, Shape};

    pub(super) fn apply(bytes: &mut [u8], shape: &Shape) {
        match (shape.filter, shape.stride) {
            (Filter::None, _) => {}
            (Filter::Octahedral, 4) => each(bytes, i8::from_le_bytes, i8::to_le_bytes, ::meshopt::decode_filter_oct),
            (Filter::Octahedral, _) => each(bytes, i16::from_le_bytes, i16::to_le_bytes, ::meshopt::decode_filter_oct),
            (Filter::Quaternion, _) => each(bytes, i16::from_le_bytes, i16::to_le_bytes, ::meshopt::decode_filter_quat),
            (Filter::Exponential, _) => {
                each(bytes, u32::from_le_bytes, u32::to_le_bytes, ::meshopt::decode_filter_exp::<1>)
            }
            (Filter::Color, 4) => each(bytes, u8::from_le_bytes, u8::to_le_bytes, ::meshopt::decode_filter_color),
            (Filter::Color, _) => each(bytes, u16::from_le_bytes, u16::to_le_bytes, ::meshopt::decode_filter_color),
        }
    }

    /// Filters elements of `N` components of `SIZE` bytes.
    fn each<T: Copy, const N: usize, const SIZE: usize>(
        bytes: &mut [u8],
        from: impl Fn([u8; SIZE]) -> T,
        to: impl Fn(T) -> [u8; SIZE],
        filter: impl Fn(&mut [[T; N]]),
    ) {
        let (components, _) = bytes.as_chunks_mut::<SIZE>();
        let (elements, _) = components.as_chunks_mut::<N>();
        let mut typed: Vec<[T; N]> = elements.iter().map(|element| element.map(&from)).collect();
        filter(&mut typed);
        elements.iter_mut().zip(typed).for_each(|(element, new)| *element = new.map(&to));
    }
}
