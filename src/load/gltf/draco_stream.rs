//! The start of a Draco stream: its encoding method and its counts.
//!
//! After the Draco bitstream specification, version 2.2. Decoders allocate memory by these counts, so they are checked before.

/// Counts that a stream declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Counts {
    /// Triangles.
    pub(super) faces: u64,
    /// Vertices; a vertex that a seam crosses becomes several.
    pub(super) vertices: u64,
    /// Whether seams cannot add to `vertices`.
    final_vertices: bool,
}

impl Counts {
    /// Upper bound of the values of an attribute whose accessor declares `declared`: several encoders declare slightly too many
    /// or too few.
    pub(super) fn most_values(&self, declared: u64) -> u64 {
        if self.final_vertices {
            return self.vertices;
        }
        let known = self.vertices.max(declared);
        let most = known.saturating_add(known / 4 + 64);
        // At most one for each corner.
        most.min(self.faces.saturating_mul(3)).max(self.vertices)
    }

    /// Temporary memory, in bytes, for decoding so many vertices with so many attributes each.
    ///
    /// Per triangle: the opposite and the vertex of each corner, its seams, symbol and point; per value: its correction, its
    /// integer and float form, and its index.
    pub(super) fn cost(&self, vertices: u64, attributes: u64) -> u64 {
        const TRIANGLE: u64 = 128;
        const VALUE: u64 = 64;
        let values = vertices.saturating_mul(attributes).saturating_mul(VALUE);
        self.faces.saturating_mul(TRIANGLE).saturating_add(values)
    }
}

/// Read position in a stream.
pub(super) struct Cursor<'a>(pub(super) &'a [u8]);

impl<'a> Cursor<'a> {
    pub(super) fn take(&mut self, count: u64) -> Result<&'a [u8], String> {
        let (taken, rest) = usize::try_from(count).ok().and_then(|n| self.0.split_at_checked(n)).ok_or_else(cut)?;
        self.0 = rest;
        Ok(taken)
    }

    pub(super) fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// Reads a variable-length integer: groups of seven bits, the lowest first.
    pub(super) fn number(&mut self) -> Result<u64, String> {
        let mut number = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err("a number in the stream is too large: it is damaged".into())
    }

    /// Skips the header and the metadata; returns the code of the encoding method.
    pub(super) fn header(&mut self) -> Result<u8, String> {
        if self.take(5)? != b"DRACO" {
            return Err("its bytes are no Draco stream".into());
        }
        let (major, minor) = (self.byte()?, self.byte()?);
        let (geometry, method) = (self.byte()?, self.byte()?);
        match (geometry, major, minor) {
            (0, ..) => return Err("the stream holds a point cloud, where triangles should be".into()),
            (1, 2, 2) => {}
            (1, ..) => return Err(format!("the stream has version {major}.{minor}, and only 2.2 can be decoded")),
            _ => return Err("the stream holds an unknown kind of geometry".into()),
        }
        let flags = u16::from_le_bytes([self.byte()?, self.byte()?]);
        if flags & 0x8000 != 0 {
            self.metadata()?;
        }
        Ok(method)
    }

    /// Skips the metadata of the mesh and its attributes, which rendering does not use.
    fn metadata(&mut self) -> Result<(), String> {
        for _ in 0..self.number()? {
            self.number()?;
            self.entries(0)?;
        }
        self.entries(0)
    }

    fn entries(&mut self, depth: u32) -> Result<(), String> {
        /// Deepest nesting that is read; no encoder comes near it.
        const DEEPEST: u32 = 64;
        if depth > DEEPEST {
            return Err(format!("its metadata is nested more than {DEEPEST} deep"));
        }
        for _ in 0..self.number()? {
            self.name()?;
            let length = self.number()?;
            self.take(length)?;
        }
        for _ in 0..self.number()? {
            self.name()?;
            self.entries(depth + 1)?;
        }
        Ok(())
    }

    fn name(&mut self) -> Result<(), String> {
        let length = self.byte()?;
        self.take(length.into()).map(drop)
    }
}

fn cut() -> String {
    "the stream ends too early".into()
}

/// Encoding of the faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    /// A list of indices.
    Sequential,
    /// An edgebreaker traversal, with the type of its symbol encoding and the number of its seam sets.
    Edgebreaker { traversal: u8, seams: u8 },
}

/// Reads the declared counts of a stream; the returned cursor stands at the encoded faces.
///
/// # Errors
/// The reason why the stream cannot be decoded.
pub(super) fn start(stream: &[u8]) -> Result<(Counts, Method, Cursor<'_>), String> {
    let mut cursor = Cursor(stream);
    let (counts, method) = match cursor.header()? {
        0 => {
            let (faces, vertices) = (cursor.number()?, cursor.number()?);
            (Counts { faces, vertices, final_vertices: true }, Method::Sequential)
        }
        1 => edgebreaker(&mut cursor)?,
        method => return Err(format!("the stream is encoded by an unknown method, {method}")),
    };
    // Corner indices have 32 bits.
    if counts.faces > u64::from(u32::MAX / 4) || counts.vertices > u64::from(u32::MAX) {
        let Counts { faces, vertices, .. } = counts;
        return Err(format!("{faces} triangles and {vertices} vertices are more than can be decoded"));
    }
    Ok((counts, method, cursor))
}

fn edgebreaker(cursor: &mut Cursor) -> Result<(Counts, Method), String> {
    let traversal = cursor.byte()?;
    let (vertices, faces) = (cursor.number()?, cursor.number()?);
    let seams = cursor.byte()?;
    let (symbols, split_symbols, splits) = (cursor.number()?, cursor.number()?, cursor.number()?);
    // Each split takes at least two bytes.
    if symbols > faces || split_symbols > symbols || splits > cursor.0.len() as u64 / 2 {
        return Err(format!("{symbols} symbols, {split_symbols} of them splits, for {faces} triangles: it is damaged"));
    }
    for _ in 0..splits {
        cursor.number()?;
        cursor.number()?;
    }
    cursor.take(splits.div_ceil(8))?;
    Ok((Counts { faces, vertices, final_vertices: false }, Method::Edgebreaker { traversal, seams }))
}
