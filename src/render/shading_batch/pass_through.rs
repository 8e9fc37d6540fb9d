//! Rays that pass the points of a batch: backs of one-sided faces, gaps of masked materials, blended surfaces.

use super::columns::{POINTS, ShadingBatch, get, put};
use super::cones::ONES;
use super::constants::MaterialConstants;

/// What a ray has passed at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PassThrough {
    /// The back of a face that is visible from its front only.
    Back,
    /// A surface with this coverage, less than 1.
    Covered(f32),
}

impl ShadingBatch {
    /// Drops invisible points, and reduces the weights of the rays of partly covered ones. Passes to `tell` what rays pass at
    /// both, by the index of the traced ray; `reads` tells whether maps or vertices were read.
    pub(crate) fn thin_out(
        &mut self,
        constants: &MaterialConstants,
        reads: bool,
        mut tell: impl FnMut(usize, PassThrough),
    ) {
        let Self { count, rays, weights, found, painted, .. } = self;
        let (count, coverage) = ((*count).min(POINTS), &painted.coverage);
        // Mostly there is nothing to do.
        let fronts = !constants.one_sided || found.front[..count].iter().fold(1, |all, front| all & front) == 1;
        let opaque =
            if reads { coverage[..count].iter().all(|&coverage| coverage >= 1.0) } else { constants.coverage >= 1.0 };
        if fronts && opaque {
            return;
        }
        for i in 0..count {
            if found.certain[i] != 1 {
                continue;
            }
            let passed = if constants.one_sided && found.front[i] == 0 {
                PassThrough::Back
            } else {
                PassThrough::Covered(if reads { coverage[i] } else { constants.coverage })
            };
            match passed {
                PassThrough::Covered(1.0..) => continue,
                PassThrough::Covered(part) if part > 0.0 => {
                    let weights = weights.get_or_insert(ONES);
                    put(weights, i, get(weights, i) * part);
                }
                PassThrough::Covered(_) | PassThrough::Back => found.certain[i] = 0,
            }
            tell(rays[i] as usize, passed);
        }
    }

    /// Whether no point is left to be shaded here.
    pub(crate) fn is_empty(&self) -> bool {
        self.certain().next().is_none()
    }
}
