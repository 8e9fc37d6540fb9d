//! What rays see of triangles: exact verdicts where a filter in lanes is certain, and between which distances they are met.
//!
//! As in [`triangles`](super::triangles), but operations are fused where the processor can, and the bounds are those of each
//! triangle's own distance: an interval that holds the exact distance tells most hits from each other.

use super::Vec3;
use super::bounds::{EdgeMargins, HEIGHTS, WEIGHTS};
use super::simd::{Axis, LANES, Lanewise, Simd};
use super::triangles::{Corners8, Verdicts};

/// A ray as blocks see it that are asked about distances, too: its numbers are within
/// [`BOX_RANGE`](super::bounds::BOX_RANGE).
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Sight {
    /// Origin along the axes in sheared order.
    pub origin: [f32; 3],
    /// 1 over the direction's component along the last of these axes.
    pub per_length: f32,
    /// The direction's components along the first two of these axes over that along the last.
    pub shear: [f32; 2],
    /// The axis of the direction's largest component.
    pub main: u32,
}

/// The axes in sheared order, by the ray's main axis.
static AXES: [[Axis; 3]; 3] = {
    let [x, y, z] = [Axis::new(0), Axis::new(1), Axis::new(2)];
    [[y, z, x], [z, x, y], [x, y, z]]
};

/// What a ray sees of eight triangles.
pub struct Look<S: Simd> {
    /// Which of them it hits.
    pub verdicts: Verdicts,
    view: View<S, LANES>,
}

impl Sight {
    /// Tests eight triangles.
    #[inline(always)]
    pub fn look<S: Simd>(&self, s: S, corners: &Corners8) -> Look<S> {
        let [ox, oy, oz] = [s.splat(self.origin[0]), s.splat(self.origin[1]), s.splat(self.origin[2])];
        let [p, q] = [s.splat(self.shear[0]), s.splat(self.shear[1])];
        let [x, y, z] = AXES[self.main as usize % 3];
        let [a, b, c] = corners;
        let (az, bz, cz) = (s.sub(s.along(a, z), oz), s.sub(s.along(b, z), oz), s.sub(s.along(c, z), oz));
        let (ax, ay) = (s.sub_mul(p, az, s.sub(s.along(a, x), ox)), s.sub_mul(q, az, s.sub(s.along(a, y), oy)));
        let (bx, by) = (s.sub_mul(p, bz, s.sub(s.along(b, x), ox)), s.sub_mul(q, bz, s.sub(s.along(b, y), oy)));
        let (cx, cy) = (s.sub_mul(p, cz, s.sub(s.along(c, x), ox)), s.sub_mul(q, cz, s.sub(s.along(c, y), oy)));
        let (verdicts, view) = view(s, [[ax, ay], [bx, by], [cx, cy]], [az, bz, cz]);
        Look { verdicts, view }
    }
}

impl<S: Simd> Look<S> {
    /// Between which distances the exact ones lie, of the triangles that are hit for certain.
    ///
    /// The exact distance is the mean of the corners' heights with the exact edge values for weights, all of one sign, over
    /// the direction's component. Edge values that err by e move the mean by 3 e times the spread of the heights over their
    /// sum S: half of the spread times the sum of the changes of the weights, 6 e/S. The roundings of heights, products,
    /// sums, the reciprocal and the last products are 10 u of the largest height; 16 u is for what they leave out.
    #[inline(always)]
    pub fn distances(&self, s: S, sight: &Sight) -> [S::Lanes; 2] {
        self.view.distances(s, s.splat(sight.per_length))
    }
}

/// Rays side by side, with the same axis first, as triangles see them one after another; their numbers are within
/// [`BOX_RANGE`](super::bounds::BOX_RANGE).
pub struct RowSight<S: Lanewise<N>, const N: usize> {
    /// Axes in sheared order: x, y, z.
    axes: [usize; 3],
    origin: [S::Lanes; 3],
    /// The origin of all rays, where they have one.
    from: Option<Vec3>,
    shear: [S::Lanes; 2],
    /// 1 over the directions' components along the last of the axes.
    per_length: S::Lanes,
}

/// What rays side by side see of a triangle.
pub struct RowLook<S: Lanewise<N>, const N: usize> {
    /// Which of them hit it.
    pub verdicts: Verdicts,
    view: View<S, N>,
}

impl<S: Lanewise<N>, const N: usize> RowSight<S, N> {
    /// Rays by axis and lane, whose largest components are along axis `z`, with the origin of all, if there is one.
    #[inline(always)]
    pub fn new(s: S, origin: &[[f32; N]; 3], from: Option<Vec3>, dir: &[[f32; N]; 3], z: usize) -> Self {
        let axes = [(z + 1) % 3, (z + 2) % 3, z % 3];
        let along = s.load(&dir[axes[2]]);
        Self {
            axes,
            origin: [s.load(&origin[axes[0]]), s.load(&origin[axes[1]]), s.load(&origin[axes[2]])],
            from,
            shear: [s.div(s.load(&dir[axes[0]]), along), s.div(s.load(&dir[axes[1]]), along)],
            per_length: s.div(s.splat(1.0), along),
        }
    }

    /// Tests one triangle: a bit for each ray.
    #[inline(always)]
    pub fn look(&self, s: S, triangle: &[Vec3; 3]) -> RowLook<S, N> {
        let (a, b, c) = (self.relative(s, triangle[0]), self.relative(s, triangle[1]), self.relative(s, triangle[2]));
        let sheared = [self.sheared(s, a), self.sheared(s, b), self.sheared(s, c)];
        let (verdicts, view) = view(s, sheared, [a[2], b[2], c[2]]);
        RowLook { verdicts, view }
    }

    /// As [`Look::distances`].
    #[inline(always)]
    pub fn distances(&self, s: S, look: &RowLook<S, N>) -> [S::Lanes; 2] {
        look.view.distances(s, self.per_length)
    }

    /// A corner relative to the origins.
    #[inline(always)]
    fn relative(&self, s: S, corner: Vec3) -> [S::Lanes; 3] {
        let [x, y, z] = self.axes;
        if let Some(from) = self.from {
            let p = corner - from;
            return [s.splat(p[x]), s.splat(p[y]), s.splat(p[z])];
        }
        [
            s.sub(s.splat(corner[x]), self.origin[0]),
            s.sub(s.splat(corner[y]), self.origin[1]),
            s.sub(s.splat(corner[z]), self.origin[2]),
        ]
    }

    #[inline(always)]
    fn sheared(&self, s: S, [x, y, z]: [S::Lanes; 3]) -> [S::Lanes; 2] {
        [s.sub_mul(self.shear[0], z, x), s.sub_mul(self.shear[1], z, y)]
    }
}

/// What verdicts leave behind: enough to tell about distances.
struct View<S: Lanewise<N>, const N: usize> {
    /// Edge values, and what they may be off.
    edges: [S::Lanes; 3],
    error: S::Lanes,
    /// Corners along the ray's main axis, relative to its origin, and the largest of their sizes.
    heights: [S::Lanes; 3],
    height: S::Lanes,
}

/// Sheared corners and their heights against the rays.
#[inline(always)]
fn view<S: Lanewise<N>, const N: usize>(
    s: S,
    [[ax, ay], [bx, by], [cx, cy]]: [[S::Lanes; 2]; 3],
    heights: [S::Lanes; 3],
) -> (Verdicts, View<S, N>) {
    let u = s.mul_sub(cx, by, s.mul(cy, bx));
    let v = s.mul_sub(ax, cy, s.mul(ay, cx));
    let w = s.mul_sub(bx, ay, s.mul(by, ax));

    let spread = s.larger(s.larger(ax, ay), s.larger(s.larger(bx, by), s.larger(cx, cy)));
    let height = s.larger(heights[0], s.larger(heights[1], heights[2]));
    let error = EdgeMargins::WITH_DISTANCES.error_by_height(s, height, spread);
    // Below zero where all edge values have one sign, as far as the nearest of them is from zero.
    let zero = s.splat(0.0);
    let (low, high) = (s.smaller(u, s.smaller(v, w)), s.greater(u, s.greater(v, w)));
    let apart = s.smaller(s.sub(zero, low), high);
    let (hit, miss) = (s.less(apart, s.sub(zero, error)), s.less(error, apart));
    let verdicts = Verdicts { hit, unsure: !(hit | miss) & ((1 << N) - 1) };
    (verdicts, View { edges: [u, v, w], error, heights, height })
}

impl<S: Lanewise<N>, const N: usize> View<S, N> {
    /// See [`Look::distances`].
    #[inline(always)]
    fn distances(&self, s: S, per_length: S::Lanes) -> [S::Lanes; 2] {
        let ([u, v, w], [a, b, c]) = (self.edges, self.heights);
        let whole = s.mul(s.div(s.splat(1.0), s.add(u, s.add(v, w))), per_length);
        let spread = s.sub(s.greater(a, s.greater(b, c)), s.smaller(a, s.smaller(b, c)));
        let t = s.mul(s.mul_add(u, a, s.mul_add(v, b, s.mul(w, c))), whole);
        let moved = s.mul(s.mul(spread, self.error), s.splat(WEIGHTS));
        // What underflow adds is far below the second.
        let rounded = s.mul_add(self.height, s.splat(HEIGHTS), s.splat(EdgeMargins::WITH_DISTANCES.underflow));
        let error = s.mul_add(moved, s.abs(whole), s.mul(rounded, s.abs(per_length)));
        [s.sub(t, error), s.add(t, error)]
    }
}
