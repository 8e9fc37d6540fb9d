//! Where rays meet triangles that they hit: [`meet`](super::triangle::meet) and
//! [`barycentrics_at`](super::triangle::barycentrics_at) in lanes, operation by operation; of rays that each have a triangle
//! of their own ([`meet`]), or that share one ([`Plane`]).

use super::bounds::{PLANE_TERMS_F64, POSITION_T};
use super::simd::{LANES, Lanewise, ROUNDED, Row, Simd};
use super::triangle::{flat_axes, magnitude_cross};
use super::triangles::Corners8;
use super::{DVec3, Vec3};

/// Rays and triangles, by axis and lane.
#[derive(Clone, Copy, Debug)]
pub struct Pairs {
    /// Where the rays start.
    pub origin: [Row; 3],
    /// Their directions.
    pub dir: [Row; 3],
    /// The triangle that each of them hits.
    pub corners: Corners8,
}

/// Where they meet.
#[derive(Clone, Copy, Debug)]
pub struct Meetings<L> {
    /// Exact t, rounded once.
    pub t: L,
    /// Weights of the second and third corner.
    pub weights: [L; 2],
    /// The lanes in which that is certain; for the others the scalar form must be asked.
    pub sure: u32,
}

impl Pairs {
    /// No rays.
    pub const EMPTY: Self =
        Self { origin: [[0.0; LANES]; 3], dir: [[0.0; LANES]; 3], corners: super::triangles::NO_CORNERS };

    /// Where each ray meets its triangle.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, s: S) -> Meetings<Row> {
        let [a, b, c] = &self.corners;
        let corners = [loaded(s, a), loaded(s, b), loaded(s, c)];
        let Meetings { t, weights: [u, v], sure } = meet(s, loaded(s, &self.origin), loaded(s, &self.dir), corners);
        Meetings { t: s.store(t), weights: [s.store(u), s.store(v)], sure }
    }
}

/// Three rows from memory.
#[inline(always)]
fn loaded<S: Lanewise<N>, const N: usize>(s: S, [x, y, z]: &[[f32; N]; 3]) -> [S::Lanes; 3] {
    [s.load(x), s.load(y), s.load(z)]
}

/// Where rays meet their triangles; origins, directions and corners by axis.
#[inline(always)]
pub fn meet<S: Lanewise<N>, const N: usize>(
    s: S,
    origin: [S::Lanes; 3],
    dir: [S::Lanes; 3],
    corners: [[S::Lanes; 3]; 3],
) -> Meetings<S::Lanes> {
    let [n_bound, d_bound] = term_bounds(s, origin, dir, corners);
    let [a, b, c] = corners;
    let (a, b, c) = (Vectors::<S, N>::of(s, a), Vectors::<S, N>::of(s, b), Vectors::<S, N>::of(s, c));
    let (o, d) = (Vectors::<S, N>::of(s, origin), Vectors::<S, N>::of(s, dir));
    let (e1, e2) = (b.minus(s, &a), c.minus(s, &a));
    let normal = e1.cross(s, &e2);
    let (numerator, denominator) = (normal.dot(s, &a.minus(s, &o)), normal.dot(s, &d));
    let (n_bound, d_bound) = (s.widen(n_bound), s.widen(d_bound));
    let Quotients { rounded, value, sure } = quotient(s, [numerator, n_bound], [denominator, d_bound]);
    Meetings { t: rounded, weights: weights(s, [&o, &d, &a], [&e1, &e2], &normal, value), sure }
}

/// What numerators and denominators must be larger than: [`SURE`] of the sums of the sizes of their terms.
#[inline(always)]
fn term_bounds<S: Lanewise<N>, const N: usize>(
    s: S,
    origin: [S::Lanes; 3],
    dir: [S::Lanes; 3],
    [a, b, c]: [[S::Lanes; 3]; 3],
) -> [S::Lanes; 2] {
    let (p, q, from) = (apart(s, b, a), apart(s, c, a), apart(s, a, origin));
    let sizes = [
        s.mul_add(p[1], q[2], s.mul(p[2], q[1])),
        s.mul_add(p[2], q[0], s.mul(p[0], q[2])),
        s.mul_add(p[0], q[1], s.mul(p[1], q[0])),
    ];
    let along = [s.abs(dir[0]), s.abs(dir[1]), s.abs(dir[2])];
    let (sure, least) = (s.splat(SURE), s.splat(f32::MIN_POSITIVE));
    [s.mul_add(sum(s, sizes, from), sure, least), s.mul_add(sum(s, sizes, along), sure, least)]
}

/// How far places are apart, by axis.
#[inline(always)]
fn apart<S: Lanewise<N>, const N: usize>(s: S, p: [S::Lanes; 3], q: [S::Lanes; 3]) -> [S::Lanes; 3] {
    [s.abs(s.sub(p[0], q[0])), s.abs(s.sub(p[1], q[1])), s.abs(s.sub(p[2], q[2]))]
}

/// p · q.
#[inline(always)]
fn sum<S: Lanewise<N>, const N: usize>(s: S, p: [S::Lanes; 3], q: [S::Lanes; 3]) -> S::Lanes {
    s.mul_add(p[0], q[0], s.mul_add(p[1], q[1], s.mul(p[2], q[2])))
}

/// What bounds the rays of a row.
#[derive(Clone, Copy, Debug)]
pub struct RowBounds {
    /// All origins lie between these.
    pub low: DVec3,
    /// The same.
    pub high: DVec3,
    /// The origin, where all rays have the same.
    pub from: Option<DVec3>,
    /// No component of a direction is larger in size.
    pub dir: f64,
}

/// What the rays of a row share when they meet a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    corners: [DVec3; 3],
    normal: DVec3,
    sizes: DVec3,
}

impl Plane {
    /// The plane of a triangle.
    #[inline(always)]
    pub fn of(triangle: &[Vec3; 3]) -> Self {
        let corners = [triangle[0].as_dvec3(), triangle[1].as_dvec3(), triangle[2].as_dvec3()];
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        Self { corners, normal: e1.cross(e2), sizes: magnitude_cross(e1.abs(), e2.abs()) }
    }

    /// Where rays (by axis and lane) meet it.
    #[inline(always)]
    pub fn meet<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        origin: &[[f32; N]; 3],
        dir: &[[f32; N]; 3],
        bounds: &RowBounds,
    ) -> Meetings<S::Lanes> {
        let a = self.corners[0];
        let (low, high) = ((a - bounds.low).abs(), (a - bounds.high).abs());
        let numerator = match bounds.from {
            Some(from) => s.splat_f64(self.normal.dot(a - from)),
            None => {
                let o = [s.load(&origin[0]), s.load(&origin[1]), s.load(&origin[2])];
                let x = s.sub_f64(s.splat_f64(a.x), s.widen(o[0]));
                let y = s.sub_f64(s.splat_f64(a.y), s.widen(o[1]));
                let z = s.sub_f64(s.splat_f64(a.z), s.widen(o[2]));
                self.dot(s, [x, y, z])
            }
        };
        let d = [s.widen(s.load(&dir[0])), s.widen(s.load(&dir[1])), s.widen(s.load(&dir[2]))];
        let denominator = self.dot(s, d);
        // Those of the farthest and of the steepest ray there could be.
        let n_bound = s.splat_f64(self.sizes.dot(low.max(high)) * f64::from(SURE));
        let d_bound = s.splat_f64(self.sizes.element_sum() * bounds.dir * f64::from(SURE));
        let Quotients { rounded, value, sure } = quotient(s, [numerator, n_bound], [denominator, d_bound]);
        Meetings { t: rounded, weights: self.barycentrics(s, origin, dir, value), sure }
    }

    /// n·v.
    #[inline(always)]
    fn dot<S: Lanewise<N>, const N: usize>(&self, s: S, [x, y, z]: [S::Doubles; 3]) -> S::Doubles {
        let n = self.normal;
        s.add_f64(
            s.add_f64(s.mul_f64(s.splat_f64(n.x), x), s.mul_f64(s.splat_f64(n.y), y)),
            s.mul_f64(s.splat_f64(n.z), z),
        )
    }

    /// Weights of the second and third corner: [`barycentrics_at`](super::triangle::barycentrics_at) in lanes.
    #[inline(always)]
    fn barycentrics<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        origin: &[[f32; N]; 3],
        dir: &[[f32; N]; 3],
        t: S::Doubles,
    ) -> [S::Lanes; 2] {
        let [i, j] = flat_axes(self.normal);
        let [a, b, c] = [self.corners[0].to_array(), self.corners[1].to_array(), self.corners[2].to_array()];
        let px = self.along(s, origin, dir, t, i);
        let py = self.along(s, origin, dir, t, j);
        let ((bx, by), (cx, cy)) = ((b[i] - a[i], b[j] - a[j]), (c[i] - a[i], c[j] - a[j]));
        let scale = s.splat_f64(1.0 / (bx * cy - by * cx));
        let u = s.sub_f64(s.mul_f64(px, s.splat_f64(cy)), s.mul_f64(py, s.splat_f64(cx)));
        let v = s.sub_f64(s.mul_f64(s.splat_f64(bx), py), s.mul_f64(s.splat_f64(by), px));
        clamped(s, s.mul_f64(u, scale), s.mul_f64(v, scale))
    }

    /// Coordinate `k` of the places at `t`, relative to the first corner.
    #[inline(always)]
    fn along<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        origin: &[[f32; N]; 3],
        dir: &[[f32; N]; 3],
        t: S::Doubles,
        k: usize,
    ) -> S::Doubles {
        let (o, d) = (s.widen(s.load(&origin[k % 3])), s.widen(s.load(&dir[k % 3])));
        s.sub_f64(s.add_f64(o, s.mul_f64(d, t)), s.splat_f64(self.corners[0][k % 3]))
    }
}

/// A term is certain enough when it is larger than this part of the sum of the sizes of what it is made of.
///
/// [`Bounded::over`](super::quotient::Bounded) finds a quotient to an error of 3/2 of those of its terms and 4 u, relative;
/// half of [`POSITION_T`], but for a thousandth, is left for each term, which errs by [`PLANE_TERMS_F64`] of that sum. The sum
/// may be computed in `f32`: fewer than 16 roundings.
const SURE: f32 = {
    assert!(ROUNDED == POSITION_T);
    (PLANE_TERMS_F64 * (1.5 * 1.001 * 2.0 / POSITION_T)) as f32 * (1.0 + 16.0 * f32::EPSILON)
};

/// Quotients of bounded terms.
struct Quotients<L, D> {
    /// Rounded once.
    rounded: L,
    /// To a relative error of [`POSITION_T`].
    value: D,
    /// The lanes in which both are certain.
    sure: u32,
}

/// n / d, where both are larger than what is asked of them: [`Bounded::over`](super::quotient::Bounded) in lanes. What is
/// certain here is certain there, and never the other way round.
#[inline(always)]
fn quotient<S: Lanewise<N>, const N: usize>(
    s: S,
    [numerator, n_bound]: [S::Doubles; 2],
    [denominator, d_bound]: [S::Doubles; 2],
) -> Quotients<S::Lanes, S::Doubles> {
    let value = s.mul_f64(numerator, s.div_f64(s.splat_f64(1.0), denominator));
    let rounded = s.narrow(value);
    let certain = s.less_f64(n_bound, s.abs_f64(numerator)) & s.less_f64(d_bound, s.abs_f64(denominator));
    // Below the normal numbers zero gets a sign, which is left to the scalar form.
    let sure = certain & s.rounds_surely(value) & s.less(s.splat(f32::MIN_POSITIVE), s.abs(rounded));
    Quotients { rounded, value, sure }
}

/// Weights of the second and third corner: areas seen along the axis from which they are largest. Each is a component of a
/// cross product over that of the normal.
#[inline(always)]
fn weights<S: Lanewise<N>, const N: usize>(
    s: S,
    [o, d, a]: [&Vectors<S, N>; 3],
    [e1, e2]: [&Vectors<S, N>; 2],
    normal: &Vectors<S, N>,
    t: S::Doubles,
) -> [S::Lanes; 2] {
    let [x, y, z] = normal.abs(s).0;
    let along_x = !s.less_f64(x, y) & !s.less_f64(x, z);
    let along = [along_x, !s.less_f64(y, z) & !along_x];
    let scale = s.div_f64(s.splat_f64(1.0), normal.turned(s, along)[2]);
    let ([ox, oy, _], [dx, dy, _], [ax, ay, _]) = (o.turned(s, along), d.turned(s, along), a.turned(s, along));
    let px = s.sub_f64(s.add_f64(ox, s.mul_f64(dx, t)), ax);
    let py = s.sub_f64(s.add_f64(oy, s.mul_f64(dy, t)), ay);
    let ([bx, by, _], [cx, cy, _]) = (e1.turned(s, along), e2.turned(s, along));
    let u = s.sub_f64(s.mul_f64(px, cy), s.mul_f64(cx, py));
    let v = s.sub_f64(s.mul_f64(bx, py), s.mul_f64(px, by));
    clamped(s, s.mul_f64(u, scale), s.mul_f64(v, scale))
}

/// Weights within 0 to 1, and their sum, too; rounded, 0 for a NaN.
#[inline(always)]
fn clamped<S: Lanewise<N>, const N: usize>(s: S, u: S::Doubles, v: S::Doubles) -> [S::Lanes; 2] {
    // Rounding keeps the order, and neither bound is rounded.
    let (zero, one) = (s.splat(0.0), s.splat(1.0));
    let u = s.smaller(s.greater(s.narrow(u), zero), one);
    let v = s.smaller(s.greater(s.narrow(v), zero), one);
    [u, s.choose(s.less(one, s.add(u, v)), s.sub(one, u), v)]
}

/// A vector in each lane.
struct Vectors<S: Lanewise<N>, const N: usize>([S::Doubles; 3]);

impl<S: Lanewise<N>, const N: usize> Vectors<S, N> {
    #[inline(always)]
    fn of(s: S, [x, y, z]: [S::Lanes; 3]) -> Self {
        Self([s.widen(x), s.widen(y), s.widen(z)])
    }

    #[inline(always)]
    fn minus(&self, s: S, Self([x, y, z]): &Self) -> Self {
        let [a, b, c] = self.0;
        Self([s.sub_f64(a, *x), s.sub_f64(b, *y), s.sub_f64(c, *z)])
    }

    #[inline(always)]
    fn abs(&self, s: S) -> Self {
        let [x, y, z] = self.0;
        Self([s.abs_f64(x), s.abs_f64(y), s.abs_f64(z)])
    }

    #[inline(always)]
    fn dot(&self, s: S, Self([x, y, z]): &Self) -> S::Doubles {
        let [a, b, c] = self.0;
        s.add_f64(s.add_f64(s.mul_f64(a, *x), s.mul_f64(b, *y)), s.mul_f64(c, *z))
    }

    #[inline(always)]
    fn cross(&self, s: S, Self([x, y, z]): &Self) -> Self {
        let [a, b, c] = self.0;
        Self([
            s.sub_f64(s.mul_f64(b, *z), s.mul_f64(*y, c)),
            s.sub_f64(s.mul_f64(c, *x), s.mul_f64(*z, a)),
            s.sub_f64(s.mul_f64(a, *y), s.mul_f64(*x, b)),
        ])
    }

    /// Turned so that an axis comes last: the first in the lanes of the first mask, the second in those of the other.
    #[inline(always)]
    fn turned(&self, s: S, [along_x, along_y]: [u32; 2]) -> [S::Doubles; 3] {
        let [x, y, z] = self.0;
        let last = s.choose_f64(along_x, x, s.choose_f64(along_y, y, z));
        let first = s.choose_f64(along_x, y, s.choose_f64(along_y, z, x));
        let second = s.choose_f64(along_x, z, s.choose_f64(along_y, x, y));
        [first, second, last]
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::super::shear::RaySpace;
    use super::super::sight::{RowSight, Rows};
    use super::super::simd::WIDE;
    use super::super::simd::{Kernel, Level};
    use super::super::triangle::{self, Triangle};
    use super::super::triangles::{NO_CORNERS, Verdicts, set_corners};
    use super::*;

    /// Eight rays against a triangle: the verdicts, and where they meet its plane.
    struct Row8<'a>(&'a [RaySpace; LANES], &'a Triangle, Option<Vec3>);

    impl Kernel for Row8<'_> {
        type Output = (Verdicts, Meetings<Row>);

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let Self(rays, triangle, from) = self;
            let (mut origin, mut dir) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
            for (lane, ray) in rays.iter().enumerate() {
                for k in 0..3 {
                    (origin[k][lane], dir[k][lane]) = (ray.origin[k], ray.dir[k]);
                }
            }
            let mut corners = NO_CORNERS;
            set_corners(&mut corners, 3, triangle);
            let per_length = s.store(s.div(s.splat(1.0), s.load(&dir[rays[0].z])));
            let sight = RowSight::<S, LANES>::new(s, &origin, &dir, rays[0].z, &per_length);
            let (verdicts, _) = sight.look(s, &sight.ready(s, &corners), 3);
            let plane = Plane::of(triangle);
            let (least, most) = (
                |f: fn(&RaySpace) -> DVec3| rays.iter().map(f).reduce(DVec3::min).unwrap(),
                |f: fn(&RaySpace) -> DVec3| rays.iter().map(f).reduce(DVec3::max).unwrap(),
            );
            let bounds = RowBounds {
                low: least(|r| r.origin.as_dvec3()),
                high: most(|r| r.origin.as_dvec3()),
                from: from.map(Vec3::as_dvec3),
                dir: most(|r| r.dir.as_dvec3().abs()).max_element(),
            };
            let Meetings { t, weights: [u, v], sure } = plane.meet(s, &origin, &dir, &bounds);
            (verdicts, Meetings { t: s.store(t), weights: [s.store(u), s.store(v)], sure })
        }
    }

    #[test]
    fn eight_rays_side_by_side_meet_a_triangle_as_each_does_alone() {
        let mut random = Random::new(21);
        let (mut hits, mut sure) = (0, 0);
        for _ in 0..3000 {
            let triangle = [random.cube(), random.cube(), random.cube()];
            let origin = random.cube() * 4.0;
            let aim = |_| triangle::within(&triangle, random.unit() * 1.2, random.unit());
            let rays: Vec<RaySpace> = (0..LANES).map(aim).filter_map(|p| RaySpace::new(origin, p - origin)).collect();
            let Ok(rays) = <[RaySpace; LANES]>::try_from(rays) else { continue };
            if rays.iter().any(|r| r.z != rays[0].z) {
                continue;
            }
            // All start there, whether the row knows it or not.
            for (level, from) in Level::all().into_iter().flat_map(|l| [(l, None), (l, Some(origin))]) {
                let (verdicts, met) = level.run(Row8(&rays, &triangle, from));
                let [u, v] = met.weights;
                for (lane, ray) in rays.iter().enumerate() {
                    let (bit, hit) = (1 << lane, triangle::is_hit(ray, &triangle));
                    assert!(verdicts.unsure & bit != 0 || (verdicts.hit & bit != 0) == hit, "{}", level.name());
                    if !hit || met.sure & bit == 0 {
                        continue;
                    }
                    let alone = triangle::meet(ray, &triangle);
                    assert_eq!(met.t[lane].to_bits(), alone.t.to_bits());
                    assert_eq!((u[lane], v[lane]), triangle::barycentrics(ray, &triangle));
                    sure += 1;
                }
                hits += rays.iter().filter(|r| triangle::is_hit(r, &triangle)).count();
            }
        }
        assert!(sure > 10_000 && sure > hits * 9 / 10, "{sure} of {hits}");
    }

    struct Meet<'a>(&'a Pairs);

    impl Kernel for Meet<'_> {
        type Output = Meetings<Row>;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Meetings<Row> {
            self.0.meet(s)
        }
    }

    fn set(pairs: &mut Pairs, lane: usize, ray: &RaySpace, triangle: &Triangle) {
        for k in 0..3 {
            (pairs.origin[k][lane], pairs.dir[k][lane]) = (ray.origin[k], ray.dir[k]);
        }
        set_corners(&mut pairs.corners, lane, triangle);
    }

    /// What a ray and a triangle are like.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Kind {
        Ordinary,
        /// The ray runs nearly in the triangle's plane.
        Grazing,
        /// It starts many sizes away.
        Far,
        Tiny,
        /// It starts next to the triangle, or on it.
        Near,
        /// It meets the triangle at a corner, or at an edge.
        Edge,
    }

    const KINDS: [Kind; 6] = [Kind::Ordinary, Kind::Grazing, Kind::Far, Kind::Tiny, Kind::Near, Kind::Edge];

    fn pair(random: &mut Random, kind: Kind) -> (Vec3, Vec3, Triangle) {
        let (place, e1, e2) = (random.cube(), random.cube(), random.cube());
        let size = if kind == Kind::Tiny { 2.0f32.powi(-20) } else { 1.0 };
        let triangle = [place, place + e1 * size, place + e2 * size];
        let (r, s) = (random.unit(), random.unit());
        let target = match kind {
            Kind::Edge if r < 0.5 => triangle[1],
            Kind::Edge => triangle::within(&triangle, s, 0.0),
            _ => triangle::within(&triangle, r, s),
        };
        let away = match kind {
            Kind::Grazing => e1 * random.unit() - e2 * random.unit() + random.cube() * 1e-2,
            Kind::Far => random.direction() * 1e5,
            Kind::Near => random.cube() * 1e-2,
            _ => random.cube() * 4.0,
        };
        (target - away, away * (0.1 + random.unit()), triangle)
    }

    /// A ray of this kind that hits its triangle.
    fn hit(random: &mut Random, kind: Kind) -> (RaySpace, Triangle) {
        loop {
            let (origin, dir, triangle) = pair(random, kind);
            if let Some(ray) = RaySpace::new(origin, dir).filter(|ray| triangle::is_hit(ray, &triangle)) {
                return (ray, triangle);
            }
        }
    }

    fn assert_met_as_alone(met: &Meetings<Row>, lane: usize, (ray, triangle): &(RaySpace, Triangle), context: &str) {
        let alone = triangle::meet(ray, triangle);
        assert_eq!(met.t[lane].to_bits(), alone.t.to_bits(), "{context}: {} for {}", met.t[lane], alone.t);
        let (u, v) = triangle::barycentrics_at(ray, triangle, alone.t_f64, alone.normal);
        assert_eq!(met.weights.map(|w| w[lane].to_bits()), [u, v].map(f32::to_bits), "{context}: {u}, {v}");
    }

    #[test]
    fn eight_rays_meet_eight_triangles_as_each_does_alone() {
        let mut random = Random::new(41);
        for kind in KINDS {
            let (mut sure, mut lanes) = (0, 0);
            for _ in 0..250 {
                let hits: [_; LANES] = std::array::from_fn(|_| hit(&mut random, kind));
                let mut pairs = Pairs::EMPTY;
                (0..LANES).for_each(|lane| set(&mut pairs, lane, &hits[lane].0, &hits[lane].1));
                for level in Level::all() {
                    let met = level.run(Meet(&pairs));
                    (sure, lanes) = (sure + met.sure.count_ones(), lanes + LANES as u32);
                    for lane in (0..LANES).filter(|lane| met.sure >> lane & 1 == 1) {
                        assert_met_as_alone(&met, lane, &hits[lane], &format!("{kind:?} on {}", level.name()));
                    }
                }
            }
            let enough = if kind == Kind::Ordinary { lanes * 9 / 10 } else { lanes / 20 };
            assert!(sure > enough, "{kind:?}: {sure} of {lanes}");
        }
    }

    /// Sixteen rays, those of two eights.
    struct MeetWide<'a>([&'a Pairs; 2]);

    impl Kernel for MeetWide<'_> {
        type Output = ([[f32; WIDE]; 3], u32);

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let [low, high] = self.0;
            let wide = s.wide();
            let join = |row: fn(&Pairs, usize) -> &Row, k: usize| {
                std::array::from_fn(|lane| row(if lane < LANES { low } else { high }, k)[lane % LANES])
            };
            let rows = |row| loaded(wide, &[join(row, 0), join(row, 1), join(row, 2)]);
            let corners = [rows(|p, k| &p.corners[0][k]), rows(|p, k| &p.corners[1][k]), rows(|p, k| &p.corners[2][k])];
            let met = meet(wide, rows(|p, k| &p.origin[k]), rows(|p, k| &p.dir[k]), corners);
            ([wide.store(met.t), wide.store(met.weights[0]), wide.store(met.weights[1])], met.sure)
        }
    }

    #[test]
    fn sixteen_rays_meet_their_triangles_as_two_times_eight_do() {
        let mut random = Random::new(44);
        for _ in 0..100 {
            let pairs = [(); 2].map(|()| {
                let mut pairs = Pairs::EMPTY;
                for lane in 0..LANES {
                    let (ray, triangle) = hit(&mut random, KINDS[lane % KINDS.len()]);
                    set(&mut pairs, lane, &ray, &triangle);
                }
                pairs
            });
            for level in Level::all() {
                let (numbers, sure) = level.run(MeetWide([&pairs[0], &pairs[1]]));
                let [low, high] = pairs.each_ref().map(|pairs| level.run(Meet(pairs)));
                assert_eq!(sure, low.sure | high.sure << LANES, "{}", level.name());
                for (lane, eight) in (0..WIDE).map(|lane| (lane, if lane < LANES { &low } else { &high })) {
                    let numbers = numbers.map(|row| row[lane].to_bits());
                    let expected = [eight.t, eight.weights[0], eight.weights[1]].map(|row| row[lane % LANES].to_bits());
                    assert_eq!(numbers, expected, "lane {lane} on {}", level.name());
                }
            }
        }
    }

    #[test]
    fn weights_are_seen_along_every_axis() {
        let (mut random, mut sure) = (Random::new(42), 0);
        for axis in 0..3 {
            let mut squash = Vec3::ONE;
            squash[axis] = 0.0;
            // Also where two components of the normal are equally large.
            for slope in [0.0, 0.5, 1.0, -1.0] {
                let mut slanted = |scale: f32| {
                    let mut p = random.cube() * squash * scale;
                    p[axis] = p[(axis + 1) % 3] * slope;
                    p
                };
                let triangle = [slanted(1.0), slanted(1.0), slanted(1.0)];
                let target = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
                let dir = random.cube() + (Vec3::ONE - squash) * 3.0;
                let Some(ray) = RaySpace::new(target - dir, dir).filter(|r| triangle::is_hit(r, &triangle)) else {
                    continue;
                };
                let mut pairs = Pairs::EMPTY;
                set(&mut pairs, 5, &ray, &triangle);
                for level in Level::all() {
                    let met = level.run(Meet(&pairs));
                    if met.sure >> 5 & 1 == 1 {
                        assert_met_as_alone(&met, 5, &(ray, triangle), level.name());
                        sure += 1;
                    }
                }
            }
        }
        assert!(sure > 6, "{sure}");
    }

    #[test]
    fn lanes_without_a_triangle_are_not_sure() {
        let (ray, triangle) = hit(&mut Random::new(43), Kind::Ordinary);
        let mut pairs = Pairs::EMPTY;
        (0..LANES).for_each(|lane| set(&mut pairs, lane, &ray, &triangle));
        for lane in 0..LANES - 1 {
            let mut broken = triangle;
            broken[lane % 3][lane / 3] = f32::NAN;
            set_corners(&mut pairs.corners, lane, &broken);
        }
        for level in Level::all() {
            assert_eq!(level.run(Meet(&Pairs::EMPTY)).sure, 0, "{}", level.name());
            assert_eq!(level.run(Meet(&pairs)).sure, 1 << (LANES - 1), "{}", level.name());
        }
    }
}
