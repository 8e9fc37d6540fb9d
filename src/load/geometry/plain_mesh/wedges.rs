//! Attributes of faces and corners -> vertices: one for each colour that meets at a position, and one number
//! for equal texture coordinates there.

use super::{PlainMesh, UNSAID};
use crate::load::geometry::NONE;
use crate::load::geometry::pairs::Pairs;
use crate::load::limits::{Budget, OverBudget};
use crate::math::DVec2;
use crate::scene::Material;
use crate::scene::color::to_srgb;
use rayon::prelude::*;

impl PlainMesh {
    /// Moves the colours of faces and edges, which are settled, to their corners. A vertex where several colours meet is split.
    ///
    /// # Errors
    /// When memory for the new vertices would exceed the budget.
    pub(super) fn color_vertices(&mut self, budget: &mut Budget) -> Result<(), OverBudget> {
        if self.face_colors.is_empty() && self.edge_colors.is_empty() {
            return Ok(());
        }
        self.face_colors.resize(self.arities.len(), UNSAID);
        self.edge_colors.resize(self.edges.len(), UNSAID);
        let corners = self.corners.len() + 2 * self.edges.len();
        budget.take(corners as u64, PAIR)?;
        let [r, g, b] = Material::plain().base_color.to_array().map(to_srgb);
        let said = |color: &[f32; 4]| if color[3] == UNSAID[3] { [r, g, b, 1.0] } else { *color };
        let mut pairs = Pairs::new(self.positions.len());
        let mut number =
            |vertex: &mut u32, color: &[f32; 4]| *vertex = pairs.number(*vertex, said(color).map(f32::to_bits));
        let mut rest = self.corners.as_mut_slice();
        for (&arity, color) in self.arities.iter().zip(&self.face_colors) {
            let (corners, after) = rest.split_at_mut(arity as usize);
            corners.iter_mut().for_each(|corner| number(corner, color));
            rest = after;
        }
        for (edge, color) in self.edges.iter_mut().zip(&self.edge_colors) {
            edge.iter_mut().for_each(|end| number(end, color));
        }

        Self::charge_vertices(budget, pairs.len().saturating_sub(self.positions.len()) as u64)?;
        self.colors = pairs.iter().map(|(_, color)| color.map(f32::from_bits)).collect();
        let vertices = || pairs.iter().map(|(vertex, _)| vertex as usize);
        self.positions = vertices().map(|vertex| self.positions[vertex]).collect();
        self.normals = vertices().filter_map(|vertex| self.normals.get(vertex).copied()).collect();
        self.uvs = vertices().filter_map(|vertex| self.uvs.get(vertex).copied()).collect();
        Ok(())
    }

    /// Numbers the texture coordinates of corners, which replace those of vertices: equal ones of a vertex share a number.
    /// Returns the number of each corner; [`NONE`] where it has no finite coordinates.
    pub(super) fn number_uvs(&mut self) -> Vec<u32> {
        if self.corner_uvs.is_empty() {
            let number = |&vertex: &u32| match self.uvs.get(vertex as usize) {
                Some(uv) if uv.is_finite() => vertex,
                _ => NONE,
            };
            return self.corners.par_iter().with_min_len(super::MANY).map(number).collect();
        }
        self.corner_uvs.resize(self.corners.len(), [f64::NAN; 2]);
        let mut pairs = Pairs::new(self.positions.len());
        let corners = self.corners.iter().zip(&self.corner_uvs);
        let number = |(&vertex, &uv): (&u32, &[f64; 2])| match DVec2::from(uv).is_finite() {
            // Adding 0 maps −0 to +0.
            true => pairs.number(vertex, uv.map(|c| (c + 0.0).to_bits())),
            false => NONE,
        };
        let numbers = corners.map(number).collect();
        self.uvs = pairs.iter().map(|(_, uv)| uv.map(f64::from_bits).into()).collect();
        numbers
    }
}

/// Bytes that a corner takes while its vertex is looked up: its entry, and its share of a table.
const PAIR: u64 = 48;
