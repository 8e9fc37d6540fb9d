//! What lies behind the points of a batch that are not there as a whole: backs of one-sided faces, absent texels, what
//! is blended.

use super::columns::{POINTS, ShadingBatch, get, put};
use super::cones::ONES;
use super::constants::MaterialConstants;

/// What a ray that goes on behind a point has passed there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Passed {
    /// The back of a face that is seen from its front alone.
    Back,
    /// A surface of which so much is seen, less than 1.
    Covered(f32),
}

impl ShadingBatch {
    /// Leaves out the points of which nothing is seen, and weakens the rays of those of which a part is. Tells of both what their
    /// rays pass, these by their places in what was traced; `reads` says that maps or vertices were read.
    pub(crate) fn thin_out(
        &mut self,
        (common, reads): (&MaterialConstants, bool),
        mut tell: impl FnMut(usize, Passed),
    ) {
        let Self { count, rays, weights, found, painted, .. } = self;
        let (count, covered) = ((*count).min(POINTS), &painted.covered);
        // Mostly there is nothing to do.
        let fronts = !common.one_sided || found.front[..count].iter().fold(1, |all, front| all & front) == 1;
        let whole = if reads { covered[..count].iter().all(|&covered| covered >= 1.0) } else { common.covered >= 1.0 };
        if fronts && whole {
            return;
        }
        for i in 0..count {
            if found.certain[i] != 1 {
                continue;
            }
            let passed = if common.one_sided && found.front[i] == 0 {
                Passed::Back
            } else {
                Passed::Covered(if reads { covered[i] } else { common.covered })
            };
            match passed {
                Passed::Covered(1.0..) => continue,
                Passed::Covered(part) if part > 0.0 => {
                    let weights = weights.get_or_insert(ONES);
                    put(weights, i, get(weights, i) * part);
                }
                Passed::Covered(_) | Passed::Back => found.certain[i] = 0,
            }
            tell(rays[i] as usize, passed);
        }
    }

    /// Whether no point is left that is shaded here.
    pub(crate) fn is_empty(&self) -> bool {
        self.certain().next().is_none()
    }
}
