//! Eight rays, each with the triangle that it hits: [`meet`](super::triangle::meet) and
//! [`barycentrics_at`](super::triangle::barycentrics_at) in lanes, operation by operation.

use super::bounds::{PLANE_TERMS_F64, POSITION_T};
use super::simd::{LANES, Row, Simd};
use super::triangles::Corners8;

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
pub struct Places {
    /// Exact t, rounded once.
    pub t: Row,
    /// Weights of the second and third corner.
    pub weights: [Row; 2],
    /// The lanes in which that is certain; for the others the scalar form must be asked.
    pub sure: u32,
}

/// Eight vectors.
struct Vectors<S: Simd>([S::Doubles; 3]);

impl<S: Simd> Vectors<S> {
    #[inline(always)]
    fn of(s: S, rows: &[Row; 3]) -> Self {
        Self([s.widen(s.load(&rows[0])), s.widen(s.load(&rows[1])), s.widen(s.load(&rows[2]))])
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

    /// With sums for differences.
    #[inline(always)]
    fn magnitude_cross(&self, s: S, Self([x, y, z]): &Self) -> Self {
        let [a, b, c] = self.0;
        Self([
            s.add_f64(s.mul_f64(b, *z), s.mul_f64(c, *y)),
            s.add_f64(s.mul_f64(c, *x), s.mul_f64(a, *z)),
            s.add_f64(s.mul_f64(a, *y), s.mul_f64(b, *x)),
        ])
    }
}

impl Pairs {
    /// No rays.
    pub const EMPTY: Self =
        Self { origin: [[0.0; LANES]; 3], dir: [[0.0; LANES]; 3], corners: super::triangles::NO_CORNERS };

    /// Where each ray meets its triangle.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, s: S) -> Places {
        let [a, b, c] = &self.corners;
        let (a, b, c) = (Vectors::of(s, a), Vectors::of(s, b), Vectors::of(s, c));
        let (o, d) = (Vectors::of(s, &self.origin), Vectors::of(s, &self.dir));
        let (e1, e2) = (b.minus(s, &a), c.minus(s, &a));
        let normal = e1.cross(s, &e2);
        let sizes = e1.abs(s).magnitude_cross(s, &e2.abs(s));
        let from = a.minus(s, &o);
        let terms = s.splat_f64(PLANE_TERMS_F64);
        let (numerator, n_error) = (normal.dot(s, &from), s.mul_f64(sizes.dot(s, &from.abs(s)), terms));
        let (denominator, d_error) = (normal.dot(s, &d), s.mul_f64(sizes.dot(s, &d.abs(s)), terms));

        // As in `quotient::Bounded`.
        let quarter = s.splat_f64(0.25);
        let signs = s.less_f64(d_error, s.mul_f64(quarter, s.abs_f64(denominator)))
            & s.less_f64(n_error, s.mul_f64(quarter, s.abs_f64(numerator)));
        let reciprocal = s.div_f64(s.splat_f64(1.0), denominator);
        let t = s.mul_f64(numerator, reciprocal);
        let size = s.abs_f64(t);
        let error = s.add_f64(
            s.mul_f64(s.add_f64(n_error, s.mul_f64(d_error, size)), s.mul_f64(s.splat_f64(1.5), s.abs_f64(reciprocal))),
            s.mul_f64(size, s.splat_f64(2.0 * f64::EPSILON)),
        );
        let spread = s.mul_f64(error, s.splat_f64(1.001));
        let (low, high) = (s.narrow(s.sub_f64(t, spread)), s.narrow(s.add_f64(t, spread)));
        let rounded = s.at_most(low, high) & s.at_most(high, low);
        // Below the normal numbers zero gets a sign, which is left to the scalar form.
        let normal_t = s.less_f64(s.splat_f64(f64::from(f32::MIN_POSITIVE)), size);
        let sure = signs & s.less_f64(error, s.mul_f64(size, s.splat_f64(POSITION_T))) & rounded & normal_t;

        Places { t: s.store(low), weights: weights(s, [&o, &d, &a], [&e1, &e2], &normal, t), sure }
    }
}

/// Weights of the second and third corner: areas seen along the axis from which they are largest. Each is a component of a
/// cross product over that of the normal.
#[inline(always)]
fn weights<S: Simd>(
    s: S,
    [o, d, a]: [&Vectors<S>; 3],
    [e1, e2]: [&Vectors<S>; 2],
    normal: &Vectors<S>,
    t: S::Doubles,
) -> [Row; 2] {
    let Vectors([dx, dy, dz]) = *d;
    let moved = Vectors::<S>([s.mul_f64(dx, t), s.mul_f64(dy, t), s.mul_f64(dz, t)]);
    let p = Vectors::<S>([s.add_f64(o.0[0], moved.0[0]), s.add_f64(o.0[1], moved.0[1]), s.add_f64(o.0[2], moved.0[2])])
        .minus(s, a);
    let [x, y, z] = normal.abs(s).0;
    let along_x = !s.less_f64(x, y) & !s.less_f64(x, z);
    let along_y = !s.less_f64(y, z) & !along_x;
    let scale = s.div_f64(s.splat_f64(1.0), seen(s, normal, along_x, along_y));
    let u = s.mul_f64(seen(s, &p.cross(s, e2), along_x, along_y), scale);
    let v = s.mul_f64(seen(s, &e1.cross(s, &p), along_x, along_y), scale);
    let (zero, one) = (s.splat_f64(0.0), s.splat_f64(1.0));
    // 0 for a NaN.
    let u = s.store(s.narrow(s.smaller_f64(s.greater_f64(u, zero), one)));
    let mut v = s.store(s.narrow(s.smaller_f64(s.greater_f64(v, zero), one)));
    for lane in 0..LANES {
        v[lane] = if u[lane] + v[lane] > 1.0 { 1.0 - u[lane] } else { v[lane] };
    }
    [u, v]
}

/// The component along an axis, the third where it is neither of both.
#[inline(always)]
fn seen<S: Simd>(s: S, Vectors([x, y, z]): &Vectors<S>, along_x: u32, along_y: u32) -> S::Doubles {
    let mut row = s.store_f64(*z);
    s.put_f64(along_y, *y, &mut row);
    s.put_f64(along_x, *x, &mut row);
    s.load_f64(&row)
}

#[cfg(test)]
mod tests {
    use super::super::Vec3;
    use super::super::random::Random;
    use super::super::shear::RaySpace;
    use super::super::simd::{Kernel, Level};
    use super::super::triangle::{self, Triangle};
    use super::super::triangles::set_corners;
    use super::*;

    struct Meet<'a>(&'a Pairs);

    impl Kernel for Meet<'_> {
        type Output = Places;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Places {
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

    fn assert_met_as_alone(met: &Places, lane: usize, (ray, triangle): &(RaySpace, Triangle), context: &str) {
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
