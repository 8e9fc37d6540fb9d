//! Vertices, and the corners of faces that name them.

use crate::math::{DVec2, DVec3, Vec3};
use bytemuck::Zeroable;
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

/// An index that stands for "none".
pub(in crate::load) const NONE: u32 = u32::MAX;

/// A corner of a face: indices into the arrays of [`Soup`]; the last two may be [`NONE`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Zeroable)]
pub(in crate::load) struct Corner {
    pub position: u32,
    pub uv: u32,
    pub normal: u32,
}

/// The vertices of a file in its order, and the corners of all faces one after another.
#[derive(Clone, Debug, Default)]
pub(in crate::load) struct Soup {
    /// Positions; those that no face, line or point uses are not finite.
    pub positions: Vec<DVec3>,
    /// Texture coordinates, v upwards as in the file; finite where corners name them.
    pub uvs: Vec<DVec2>,
    /// Normals, of unit length where corners name them.
    pub normals: Vec<Vec3>,
    /// Colour per position; as written before [`super::color::settle`], 0…1 afterwards. Empty when the file has none.
    pub colors: Vec<[f32; 3]>,
    /// Opacity per position, 0…1; empty when everything is opaque.
    pub alphas: Vec<f32>,
    pub corners: Vec<Corner>,
    /// Corners of all points and lines, one statement after another.
    pub wire_corners: Vec<Corner>,
}

impl Soup {
    /// Removes the positions of vertices that neither corners nor `triangles` use, so that they affect neither the centre
    /// nor the framing.
    pub(in crate::load) fn leave_out_unused(&mut self, triangles: &[[u32; 3]]) {
        /// Number of corners or positions per parallel task.
        const MANY: usize = 1 << 13;
        let used: Vec<AtomicBool> = std::iter::repeat_with(AtomicBool::default).take(self.positions.len()).collect();
        let of_corners = self.corners.par_iter().chain(&self.wire_corners).map(|corner| corner.position);
        of_corners.chain(triangles.as_flattened().par_iter().copied()).with_min_len(MANY).for_each(|position| {
            if let Some(used) = used.get(position as usize) {
                used.store(true, Relaxed);
            }
        });
        let positions = self.positions.par_iter_mut().with_min_len(MANY).zip(used);
        positions.filter(|(_, used)| !used.load(Relaxed)).for_each(|(position, _)| *position = DVec3::NAN);
    }
}
