//! Intersections of a line with the mantle: a quadratic whose coefficients and discriminant do not cancel.
//!
//! With the unit axis a, half the length h/2, the mean radius r, the slope κ = (r₁ − r₀)/h and everything relative to the
//! middle of the axis, the mantle is |p × a| = r + κ p·a with |p·a| ≤ h/2. The ray first moves to its point o nearest to the
//! middle (as E. Haines, J. Günther, T. Akenine-Möller do for the sphere: *Precision Improvements for Ray/Sphere
//! Intersection*, Ray Tracing Gems, 2019): from there every number is of the size of the cone. Then, with
//!
//! > u = o × a, v = d × a, e = r + κ o·a, f = κ d·a:  A τ² + 2 B τ + C = 0, A = v² − f², B = u·v − e f, C = u² − e².
//!
//! B² − A C would lose all digits where the line is nearly a tangent. By (o × a) × (d × a) = a (a · (o × d)) and |e v − f u|²
//! = |r v + κ n⊥|², where n = d × o and n⊥ is its part perpendicular to the axis, it is
//!
//! > B² − A C = |r v + κ n⊥|² − g², g = o·v,
//!
//! for a cylinder r² v² − g²: g/|v| is the distance between the line and the axis. This cancels only at a tangent itself.
//! With q = −B ∓ √(B² − A C), signed so that it does not cancel, the roots are q/A and C/q, which also holds for A = 0, a
//! line parallel to the mantle.

use super::Cone;
use crate::math::real::{Double, Real, Real3};
use crate::math::shear::RaySpace;

/// Largest relative error of an accepted distance from `f64`: at most 2 ulp of an `f32`.
const GOOD: f64 = 2.0 * crate::math::bounds::U32 as f64;

/// Relative enlargement of the sphere around the cone outside which a point is certainly not on the cone.
const OUTSIDE: f64 = 1.0 + 1.0 / 1024.0;

/// One of the two roots.
#[derive(Clone, Copy, Debug)]
enum Root {
    /// The root is not on the mantle.
    Absent,
    /// A hit: its distance, and a bound of the error.
    At(f64, f64),
    /// Undecided.
    Unsure,
}

impl Root {
    fn is_good(self) -> bool {
        match self {
            Self::Absent => true,
            Self::At(t, error) => error <= GOOD * t.abs(),
            Self::Unsure => false,
        }
    }

    fn is_behind(self) -> bool {
        matches!(self, Self::At(t, error) if t + error < 0.0)
    }

    /// Final distance: 0 if it cannot be told from 0.
    fn decided(self) -> f64 {
        match self {
            Self::At(t, error) if t.abs() <= error => 0.0,
            Self::At(t, _) => t,
            _ => f64::NAN,
        }
    }
}

/// See [`super::distances`].
pub(super) fn distances(ray: &RaySpace, cone: &Cone, ahead: bool) -> [f64; 2] {
    let first = solve::<f64>(ray, cone, false);
    // Each root is decided separately, so that it does not depend on `ahead`.
    if first.iter().all(|r| r.is_good() || (ahead && r.is_behind())) {
        return first.map(Root::decided);
    }
    let second = exact(ray, cone);
    [0, 1].map(|i| if first[i].is_good() { first[i].decided() } else { second[i].decided() })
}

#[cold]
fn exact(ray: &RaySpace, cone: &Cone) -> [Root; 2] {
    solve::<Double>(ray, cone, true)
}

/// Power of two that brings `x` to 1..2. Exact for every `f32`, and keeps every product in range.
fn scale(x: f64) -> f64 {
    const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
    f64::from_bits((2046 << 52) - (x.to_bits() & EXPONENT))
}

/// The roots with the minus and with the plus sign, with running bounds of their errors.
///
/// A bound counts roundings of [`Real::UNIT`] to first order and rounds the counts up by half or more, which covers the
/// rest and the rounding of the bounds. With `last`, nothing stays unsure: a line that may touch touches.
fn solve<R: Real>(ray: &RaySpace, cone: &Cone, last: bool) -> [Root; 2] {
    let unit = R::UNIT;
    let (r0, r1) = (f64::from(cone.base_radius), f64::from(cone.apex_radius));
    let axis = cone.apex.as_dvec3() - cone.base.as_dvec3();
    let shrink = scale(axis.abs().max_element().max(r0).max(r1));
    let slow = scale(f64::from(ray.dir[ray.z].abs()));

    // The cone: w and its length err by 5 u, the axis by 8 u, the slope by 8 u.
    let w = Real3::<R>::difference(cone.apex, cone.base).times(R::of(shrink));
    let h = w.dot(w).sqrt();
    if h.value() == 0.0 {
        return [Root::Absent; 2];
    }
    let a = w.times(R::of(1.0) / h);
    let (r0, r1) = (R::of(r0 * shrink), R::of(r1 * shrink));
    let slope = (r1 - r0) / h;
    let r = (r0 + r1) * R::of(0.5);

    // The ray, moved next to the middle: `shift` may be inexact, o errs by `off`.
    let d = Real3::<R>::of(ray.dir.as_dvec3() * slow);
    let from = Real3::<R>::difference(ray.origin, cone.base).times(R::of(shrink)).minus(w.times(R::of(0.5)));
    let (direction, start) = (d.value(), from.value());
    let shift = -start.dot(direction) / direction.length_squared();
    let o = from.plus(d.times(R::of(shift)));
    let off = 8.0 * unit * (start.length() + h.value());

    let (speed, reach) = (direction.length(), o.value().length());
    let half = h.value() * 0.5;
    let size = (half * half + r0.value().max(r1.value()).powi(2)).sqrt() * OUTSIDE + 2.0 * off;
    if reach > size {
        return [Root::Absent; 2];
    }

    let (u, v) = (o.cross(a), d.cross(a));
    let (along_o, along_d) = (o.dot(a), d.dot(a));
    let (e, f) = (r + slope * along_o, slope * along_d);
    let g = o.dot(v);
    let across = d.cross(o).plus(a.times(g));
    let span = v.times(r).plus(across.times(slope));
    let (qa, qb, qc) = (v.dot(v) - f * f, u.dot(v) - e * f, u.dot(u) - e * e);
    let discriminant = span.dot(span) - g * g;

    // u errs by off + 12 u |o|, v by 12 u |d|, e by κ off + 24 u E, f by 24 u κ |d|, g by |d| (off + 16 u |o|), n⊥ by
    // 2 |d| off + 36 u |d| |o|.
    let k = slope.value().abs();
    let spread = r.value() + k * reach;
    let error_a = 64.0 * unit * speed * speed * (1.0 + k * k);
    let error_b = speed * ((1.0 + k * k) * off + 64.0 * unit * (reach + k * spread));
    let error_c =
        2.0 * off * (reach + k * spread) + 64.0 * unit * (reach * reach + spread * spread) + off * off * (1.0 + k * k);
    let (span_size, g_size) = (span.value().length(), g.value().abs());
    let error_span = speed * (2.0 * k * off + 64.0 * unit * spread);
    let error_g = speed * (off + 16.0 * unit * reach);
    let error_discriminant = (2.0 * span_size + error_span) * error_span
        + (2.0 * g_size + error_g) * error_g
        + 4.0 * unit * (span_size * span_size + g_size * g_size);

    if discriminant.value() < -error_discriminant {
        return [Root::Absent; 2];
    }
    if discriminant.value() <= 2.0 * error_discriminant && !last {
        return [Root::Unsure; 2];
    }
    let root = if discriminant.value() > 0.0 { discriminant.sqrt() } else { R::of(0.0) };
    let error_root = (error_discriminant / root.value()).min(error_discriminant.sqrt());

    let forwards = qb.value() >= 0.0;
    let q = if forwards { -qb - root } else { -qb + root };
    let error_q = error_b + error_root + 2.0 * unit * q.value().abs();
    let [q, qa, qc] = [(q, error_q), (qa, error_a), (qc, error_c)].map(|(value, error)| Term { value, error });

    let mantle = Mantle {
        shift,
        limit: size / speed,
        half: (half, 5.0 * unit * half),
        along: (along_o, off + 12.0 * unit * reach),
        speed: (along_d, 12.0 * unit * speed),
        back: slow / shrink,
        last,
    };
    let larger = mantle.root(q, qa);
    // A double root, next to o: both are q/A.
    let smaller = if last && !q.is_certain() { larger } else { mantle.root(qc, q) };
    // The order must not depend on the sign of a B that may be 0.
    if forwards { [larger, smaller] } else { [smaller, larger] }
}

/// A number and a bound of its error.
#[derive(Clone, Copy)]
struct Term<R> {
    value: R,
    error: f64,
}

impl<R: Real> Term<R> {
    fn size(&self) -> f64 {
        self.value.value().abs()
    }

    /// Whether the error is below half the size.
    fn is_certain(&self) -> bool {
        self.size() > 2.0 * self.error
    }
}

/// Data that decide whether a root lies on the mantle, and where on the ray.
struct Mantle<R> {
    /// Distance of o from the ray's origin, along the ray.
    shift: f64,
    /// Roots beyond this are outside the sphere around the cone.
    limit: f64,
    /// Half the length of the axis, and its error.
    half: (f64, f64),
    /// Position of o along the axis.
    along: (R, f64),
    /// Growth of that position along the ray.
    speed: (R, f64),
    /// Factor from scaled distances to the ray's own.
    back: f64,
    last: bool,
}

impl<R: Real> Mantle<R> {
    fn root(&self, over: Term<R>, under: Term<R>) -> Root {
        let (unit, unsure) = (R::UNIT, if self.last { Root::Absent } else { Root::Unsure });
        // Far outside, even if the denominator may be 0.
        if over.size() - over.error > (under.size() + under.error) * self.limit {
            return Root::Absent;
        }
        if !under.is_certain() {
            return unsure;
        }
        let tau = over.value / under.value;
        let size = tau.value().abs();
        let error = (over.error + size * under.error) / (under.size() - under.error) + 2.0 * unit * size;

        let place = self.along.0 + self.speed.0 * tau;
        let doubt = self.along.1
            + self.speed.0.value().abs() * error
            + (self.speed.1 + 2.0 * unit) * size
            + 2.0 * unit * place.value().abs()
            + self.half.1;
        let beyond = place.value().abs() - self.half.0;
        if beyond > doubt {
            return Root::Absent;
        }
        if beyond >= -doubt && !self.last {
            return Root::Unsure;
        }
        let t = (tau + R::of(self.shift)).value();
        Root::At(t * self.back, (error + unit * t.abs() + unit * self.shift.abs()) * self.back)
    }
}
