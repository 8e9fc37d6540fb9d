//! Ray against triangle in rational numbers, without any rounding: the reference of every other test.
//!
//! Shares only the definition of a hit with the tests it judges: the line meets the closed triangle in one point; lines in
//! its plane and triangles without area are not hits.

use dashu::base::Sign;
use dashu::rational::RBig;

use super::Vec3;
use super::triangle::Triangle;

/// A point or direction, exactly.
pub type Exact3 = [RBig; 3];

/// A finite number, exactly.
pub fn exact(x: f32) -> RBig {
    RBig::try_from(x).unwrap_or_default()
}

/// A finite vector, exactly.
pub fn point(p: Vec3) -> Exact3 {
    p.to_array().map(exact)
}

/// a − b.
pub fn minus(a: &Exact3, b: &Exact3) -> Exact3 {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

/// a × b.
pub fn cross(a: &Exact3, b: &Exact3) -> Exact3 {
    [0, 1, 2].map(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        &a[i] * &b[j] - &a[j] * &b[i]
    })
}

/// a · b.
pub fn dot(a: &Exact3, b: &Exact3) -> RBig {
    (0..3).fold(RBig::ZERO, |s, k| s + &a[k] * &b[k])
}

/// o + t d.
pub fn along(origin: &Exact3, dir: &Exact3, t: &RBig) -> Exact3 {
    [0, 1, 2].map(|k| &origin[k] + &dir[k] * t)
}

/// Point of a triangle's plane nearest to `p`; `None` if the triangle has no area.
pub fn foot(p: &Exact3, triangle: &Triangle) -> Option<Exact3> {
    let [a, b, c] = triangle.map(point);
    let normal = cross(&minus(&b, &a), &minus(&c, &a));
    let square = dot(&normal, &normal);
    (!square.is_zero()).then(|| along(p, &normal, &(dot(&normal, &minus(&a, p)) / square)))
}

/// Sign: −1, 0 or 1.
pub fn sign(x: &RBig) -> i32 {
    match (x.is_zero(), x.sign()) {
        (true, _) => 0,
        (_, Sign::Positive) => 1,
        (_, Sign::Negative) => -1,
    }
}

/// Distance at which the line hits the triangle, boundary included; `None` also for lines in its plane.
pub fn hit(o: &Exact3, d: &Exact3, triangle: &Triangle) -> Option<RBig> {
    let [a, b, c] = triangle.map(|p| minus(&point(p), o));
    let signs = [(&b, &c), (&c, &a), (&a, &b)].map(|(p, q)| sign(&dot(d, &cross(p, q))));
    let normal = cross(&minus(&b, &a), &minus(&c, &a));
    let slope = dot(&normal, d);
    let inside = signs.iter().all(|&s| s >= 0) || signs.iter().all(|&s| s <= 0);
    (inside && !slope.is_zero()).then(|| dot(&normal, &a) / slope)
}
