//! Ray/triangle tests: the exact one, and the others it is compared with.
//!
//! Only the exact test gives the same hits with every structure; the others exist so that their speed and error can be
//! measured on a user's own mesh.

use std::fmt;

use crate::math::moller_trumbore;
use crate::math::shear::RaySpace;
use crate::math::triangle::{self, Triangle};
use crate::math::watertight::{Shear, edges, edges_checked};
use crate::named::names;

/// A ray/triangle test.
pub trait Intersector: Copy + Send + Sync {
    /// Whether verdicts and distances are those of exact arithmetic, so that a filter may decide in place of the test.
    const EXACT: bool = false;

    /// Data shared by all tests of one ray.
    type Prepared: Copy + fmt::Debug;

    /// Computes the shared data of a ray.
    fn prepare(self, ray: &RaySpace) -> Self::Prepared;

    /// Distance at which the line through the ray hits the triangle, if it does.
    fn distance(prepared: &Self::Prepared, ray: &RaySpace, triangle: &Triangle) -> Option<f32>;
}

/// Exact test: exact verdicts, distances rounded once.
#[derive(Clone, Copy, Debug)]
pub struct Exact;

impl Intersector for Exact {
    const EXACT: bool = true;
    type Prepared = ();

    #[inline]
    fn prepare(self, _: &RaySpace) {}

    #[inline]
    fn distance((): &(), ray: &RaySpace, triangle: &Triangle) -> Option<f32> {
        triangle::intersect(ray, triangle)
    }
}

/// Woop, Benthin and Wald's test in `f32`.
#[derive(Clone, Copy, Debug)]
pub struct Watertight;

impl Intersector for Watertight {
    type Prepared = Shear<f32>;

    #[inline]
    fn prepare(self, ray: &RaySpace) -> Shear<f32> {
        Shear::new(ray)
    }

    #[inline]
    fn distance(shear: &Shear<f32>, ray: &RaySpace, triangle: &Triangle) -> Option<f32> {
        shear.intersect(ray, triangle, edges_checked)
    }
}

/// Woop, Benthin and Wald's test in `f64`.
#[derive(Clone, Copy, Debug)]
pub struct WatertightDouble;

impl Intersector for WatertightDouble {
    type Prepared = Shear<f64>;

    #[inline]
    fn prepare(self, ray: &RaySpace) -> Shear<f64> {
        Shear::new(ray)
    }

    #[inline]
    fn distance(shear: &Shear<f64>, ray: &RaySpace, triangle: &Triangle) -> Option<f32> {
        shear.intersect(ray, triangle, edges).map(narrow)
    }
}

/// Möller and Trumbore's test in `f32`.
#[derive(Clone, Copy, Debug)]
pub struct MollerTrumbore;

impl Intersector for MollerTrumbore {
    type Prepared = ();

    #[inline]
    fn prepare(self, _: &RaySpace) {}

    #[inline]
    fn distance((): &(), ray: &RaySpace, triangle: &Triangle) -> Option<f32> {
        moller_trumbore::single(ray.origin, ray.dir, *triangle).map(|(t, ..)| t)
    }
}

/// Möller and Trumbore's test in `f64`.
#[derive(Clone, Copy, Debug)]
pub struct MollerTrumboreDouble;

impl Intersector for MollerTrumboreDouble {
    type Prepared = ();

    #[inline]
    fn prepare(self, _: &RaySpace) {}

    #[inline]
    fn distance((): &(), ray: &RaySpace, triangle: &Triangle) -> Option<f32> {
        moller_trumbore::double(ray.origin, ray.dir, triangle).map(|(t, ..)| narrow(t))
    }
}

/// Any of these tests, dispatched at each call: used where compiling code for each would cost too much.
#[derive(Clone, Copy, Debug)]
pub struct Looked(pub IntersectorKind);

/// Prepared data of [`Looked`].
#[derive(Clone, Copy, Debug)]
pub enum Prepared {
    /// No data, for a test that needs none.
    Plain(IntersectorKind),
    /// Data of [`Watertight`].
    Single(Shear<f32>),
    /// Data of [`WatertightDouble`].
    Double(Shear<f64>),
}

impl Intersector for Looked {
    type Prepared = Prepared;

    #[inline]
    fn prepare(self, ray: &RaySpace) -> Prepared {
        match self.0 {
            IntersectorKind::Watertight => Prepared::Single(Watertight.prepare(ray)),
            IntersectorKind::WatertightDouble => Prepared::Double(WatertightDouble.prepare(ray)),
            kind => Prepared::Plain(kind),
        }
    }

    #[inline]
    fn distance(prepared: &Prepared, ray: &RaySpace, triangle: &Triangle) -> Option<f32> {
        match prepared {
            Prepared::Single(shear) => Watertight::distance(shear, ray, triangle),
            Prepared::Double(shear) => WatertightDouble::distance(shear, ray, triangle),
            Prepared::Plain(IntersectorKind::MollerTrumbore) => MollerTrumbore::distance(&(), ray, triangle),
            Prepared::Plain(IntersectorKind::MollerTrumboreDouble) => {
                MollerTrumboreDouble::distance(&(), ray, triangle)
            }
            Prepared::Plain(_) => Exact::distance(&(), ray, triangle),
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
fn narrow(t: f64) -> f32 {
    t as f32
}

/// Choice of the [`Intersector`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum IntersectorKind {
    /// [`Exact`].
    #[default]
    Exact,
    /// [`Watertight`].
    Watertight,
    /// [`WatertightDouble`].
    WatertightDouble,
    /// [`MollerTrumbore`].
    MollerTrumbore,
    /// [`MollerTrumboreDouble`].
    MollerTrumboreDouble,
}

names!(
    IntersectorKind, "intersector",
    Exact => "exact",
    Watertight => "watertight",
    WatertightDouble => "watertight-double",
    MollerTrumbore => "moller-trumbore",
    MollerTrumboreDouble => "moller-trumbore-double",
);
