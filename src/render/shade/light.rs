//! Lights as seen from the points they illuminate: direction, strength, and the extent of a shadow ray.
//!
//! Balls and discs in the sky are sampled by the solid angle they subtend, rectangles by area (P. Shirley, C. Wang, K. Zimmerman,
//! "Monte Carlo Techniques for Direct Lighting Calculations", 1996).
//!
//! Two units meet here. The founding texts give a light a factor I, the value that a white diffuse surface facing it shows; glTF
//! gives candela and lux, of which such a surface shows the π-th part. Both become a *strength* in the first unit, so that a
//! Phong and a metallic-roughness surface of one colour look alike under any light.

use crate::math::formula::sin_cos_of_turns;
use crate::math::{DVec3, Vec3};
use crate::scene::{Falloff, Light, LightKind};
use std::f32::consts::PI;

/// A light in the centred frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalLight {
    intensity: Vec3,
    pub shadows: bool,
    /// Radius, or half the angle of a disc in the sky, as in [`Light`]; and sine and cosine of it as an angle.
    size: f32,
    disc: (f32, f32),
    shape: Shape,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    /// Unit vector towards the light.
    Directional(Vec3),
    Point {
        position: Vec3,
        falloff: Falloff,
        cone: Option<Cone>,
    },
    Rectangle {
        position: Vec3,
        sides: [Vec3; 2],
        /// Unit vector to the side it emits to.
        normal: Vec3,
        falloff: Falloff,
    },
}

/// Cone of a spot light, as a linear fade in the cosine from its axis (KHR_lights_punctual).
#[derive(Clone, Copy, Debug)]
struct Cone {
    axis: Vec3,
    scale: f32,
    offset: f32,
}

/// Light that arrives at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Incident {
    /// Unit vector towards the light.
    pub to_light: Vec3,
    /// End of a shadow ray (centred frame); `None`: at infinity.
    pub position: Option<Vec3>,
    strength: Vec3,
}

/// End of a shadow ray to a point, as a fraction of its length: the gap is more than the rounding of its start.
const BEFORE_LIGHT: f32 = 1.0 - 4.0 * f32::EPSILON;

impl Incident {
    /// Direction and end of a shadow ray from `origin`.
    #[inline(always)]
    pub(crate) fn shadow_segment(&self, origin: Vec3) -> (Vec3, f32) {
        shadow_segment(origin, self.to_light, self.position)
    }

    /// Radiance of a white diffuse surface that faces the light: the founding texts' I.
    #[inline(always)]
    pub(crate) fn strength(&self) -> Vec3 {
        self.strength
    }

    /// Irradiance on a surface that faces the light, lux: π times the strength.
    #[inline(always)]
    pub(crate) fn irradiance(&self) -> Vec3 {
        self.strength * PI
    }
}

/// Direction and end of a shadow ray from `origin` to a light in this direction, at `position` if it is not at infinity.
#[inline(always)]
pub(crate) fn shadow_segment(origin: Vec3, to_light: Vec3, position: Option<Vec3>) -> (Vec3, f32) {
    match position {
        Some(position) => (position - origin, BEFORE_LIGHT),
        None => (to_light, f32::INFINITY),
    }
}

impl LocalLight {
    pub(crate) fn new(light: &Light, center: DVec3) -> Self {
        let point =
            |position: DVec3, falloff, cone| Shape::Point { position: (position - center).as_vec3(), falloff, cone };
        let shape = match light.kind {
            LightKind::Directional { direction } => Shape::Directional(unit(-direction)),
            LightKind::Point { position, falloff } => point(position, falloff, None),
            LightKind::Spot { position, direction, inner, outer, falloff } => {
                point(position, falloff, Some(Cone::new(unit(direction), inner, outer)))
            }
            LightKind::Rectangle { position, sides: [a, b], falloff } => Shape::Rectangle {
                position: (position - center).as_vec3(),
                sides: [a.as_vec3(), b.as_vec3()],
                normal: unit(a.cross(b)),
                falloff,
            },
        };
        #[expect(clippy::cast_possible_truncation, reason = "a length like any other")]
        let size = light.size as f32;
        let disc = libm::sincosf(size.min(PI / 2.0));
        Self { intensity: light.intensity, shadows: light.shadows, size, disc, shape }
    }

    /// Whether it is an area light, which is sampled.
    pub(crate) fn is_area(&self) -> bool {
        self.size > 0.0 || matches!(self.shape, Shape::Rectangle { .. })
    }

    /// Light from one point of this area light, drawn with two numbers from 0 … 1, with the strength of the whole; the mean of
    /// many samples is the light of the whole. `None` where no light arrives.
    pub(crate) fn incident_from(&self, position: Vec3, at: [f32; 2]) -> Option<Incident> {
        debug_assert!(self.is_area());
        let (incident, arrives) = self.arriving_from(position, at);
        arrives.then_some(incident)
    }

    /// Light that arrives from the sampled point, and whether any does.
    #[inline(always)]
    fn arriving_from(&self, position: Vec3, at: [f32; 2]) -> (Incident, bool) {
        let (to_light, share, end) = match self.shape {
            Shape::Directional(to_light) => (in_cone(to_light, self.disc, at), 1.0 / PI, None),
            Shape::Point { position: light, falloff, cone } => {
                let way = light - position;
                let distance = way.length();
                let sin = self.size / distance;
                let cos = (1.0 - sin * sin).max(0.0).sqrt();
                let to_light = in_cone(way / distance, (sin, cos), at);
                let along = way.dot(to_light);
                let beside = (way - to_light * along).length();
                let near = along - (self.size * self.size - beside * beside).max(0.0).sqrt();
                // A ball subtends more solid angle than its centre's distance suggests.
                let fuller = if matches!(falloff, Falloff::None) { 1.0 } else { 2.0 / (1.0 + cos) };
                let share = weaken(falloff, distance) * fuller * cone.map_or(1.0, |c| c.share(-to_light));
                // A ball is invisible from inside.
                (to_light, if sin < 1.0 { share } else { 0.0 }, Some(position + to_light * near))
            }
            Shape::Rectangle { position: middle, sides: [a, b], normal, falloff } => {
                let point = middle + a * (at[0] - 0.5) + b * (at[1] - 0.5);
                let way = point - position;
                let to_light = way.try_normalize().unwrap_or(Vec3::ZERO);
                (to_light, weaken(falloff, way.length()) * (-normal.dot(to_light)).max(0.0), Some(point))
            }
        };
        let strength = (self.intensity * share).min(Vec3::splat(f32::MAX));
        let arrives = (strength.max_element() > 0.0) & (to_light != Vec3::ZERO);
        (Incident { to_light, position: end, strength }, arrives)
    }

    /// Light that arrives at `position` if it is unoccluded; `None` where none does.
    pub(crate) fn incident(&self, position: Vec3) -> Option<Incident> {
        let (incident, arrives) = self.arriving(position);
        arrives.then_some(incident)
    }

    /// Passes to `take` the light that arrives at each of the first `points` positions, and whether any does; for area lights
    /// from the place drawn with `at`.
    #[inline(always)]
    pub(crate) fn arriving_at(
        &self,
        points: usize,
        position: impl Fn(usize) -> Vec3,
        at: impl Fn(usize) -> Option<[f32; 2]>,
        mut take: impl FnMut(usize, (Incident, bool)),
    ) {
        // The shape is matched outside the loop, which is then branch-free.
        match self.shape {
            Shape::Directional(to_light) => {
                let light = Self { shape: Shape::Directional(to_light), ..*self };
                (0..points).for_each(|i| take(i, light.arriving_by(position(i), at(i))));
            }
            Shape::Point { position: from, falloff, cone } => {
                let light = Self { shape: Shape::Point { position: from, falloff, cone }, ..*self };
                (0..points).for_each(|i| take(i, light.arriving_by(position(i), at(i))));
            }
            Shape::Rectangle { position: middle, sides, normal, falloff } => {
                let light = Self { shape: Shape::Rectangle { position: middle, sides, normal, falloff }, ..*self };
                (0..points).for_each(|i| take(i, light.arriving_by(position(i), at(i))));
            }
        }
    }

    #[inline(always)]
    fn arriving_by(&self, position: Vec3, at: Option<[f32; 2]>) -> (Incident, bool) {
        match at {
            Some(at) => self.arriving_from(position, at),
            None => self.arriving(position),
        }
    }

    /// Position of the light; `None`: at infinity.
    pub(crate) fn position(&self) -> Option<Vec3> {
        match self.shape {
            Shape::Directional(_) => None,
            Shape::Point { position, .. } | Shape::Rectangle { position, .. } => Some(position),
        }
    }

    /// Light that arrives at `position`, and whether any does.
    #[inline(always)]
    fn arriving(&self, position: Vec3) -> (Incident, bool) {
        let (to_light, share, end) = match self.shape {
            Shape::Directional(to_light) => (to_light, 1.0 / PI, None),
            // As if seen from far away.
            Shape::Rectangle { position: light, normal, falloff, .. } => {
                let way = light - position;
                let to_light = way.try_normalize().unwrap_or(Vec3::ZERO);
                let share = weaken(falloff, way.length()) * (-normal.dot(to_light)).max(0.0);
                (to_light, share, Some(light))
            }
            Shape::Point { position: light, falloff, cone } => {
                let way = light - position;
                let to_light = way.try_normalize().unwrap_or(Vec3::ZERO);
                let share = weaken(falloff, way.length()) * cone.map_or(1.0, |c| c.share(-to_light));
                (to_light, share, Some(light))
            }
        };
        let strength = (self.intensity * share).min(Vec3::splat(f32::MAX));
        let arrives = (strength.max_element() > 0.0) & (to_light != Vec3::ZERO);
        (Incident { to_light, position: end, strength }, arrives)
    }
}

/// Factor from a light's intensity to its strength at `distance`: candela to lux over π; 1 without falloff.
#[expect(clippy::cast_possible_truncation, reason = "ranges are lengths like any other")]
#[inline(always)]
fn weaken(falloff: Falloff, distance: f32) -> f32 {
    let Falloff::InverseSquare { range } = falloff else { return 1.0 };
    let squared = (distance * distance).max(f32::MIN_POSITIVE);
    let part = distance / range as f32;
    let window = if part > 0.0 { (1.0 - part * part * part * part).clamp(0.0, 1.0) } else { 1.0 };
    window / squared / PI
}

impl Cone {
    /// `inner` and `outer` are half angles in radians.
    #[expect(clippy::cast_possible_truncation, reason = "cosines")]
    fn new(axis: Vec3, inner: f64, outer: f64) -> Self {
        let (inner, outer) = (libm::cos(inner) as f32, libm::cos(outer) as f32);
        let scale = 1.0 / (inner - outer).max(1e-3);
        Self { axis, scale, offset: -outer * scale }
    }

    /// Share of the light emitted along the unit vector `dir`: the square of the fade over the angle's cosine.
    #[inline(always)]
    fn share(&self, dir: Vec3) -> f32 {
        let fade = (self.axis.dot(dir) * self.scale + self.offset).clamp(0.0, 1.0);
        fade * fade
    }
}

/// Direction in the cone around `axis` whose half angle has this sine and cosine, uniform in solid angle.
#[inline(always)]
fn in_cone(axis: Vec3, (sin, cos): (f32, f32), at: [f32; 2]) -> Vec3 {
    // 1 − cos as sin² / (1 + cos), which keeps its digits in narrow cones.
    let down = at[0] * (sin * sin / (1.0 + cos));
    let ring = (down * (2.0 - down)).max(0.0).sqrt();
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    let (sin, cos) = sin_cos_of_turns(at[1]);
    (axis * (1.0 - down) + (tangent * cos + bitangent * sin) * ring).normalize()
}

fn unit(v: DVec3) -> Vec3 {
    v.try_normalize().unwrap_or(DVec3::Z).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(kind: LightKind) -> LocalLight {
        LocalLight::new(
            &Light { name: String::new(), intensity: Vec3::splat(8.0), kind, shadows: true, size: 0.0 },
            DVec3::new(1e7, 0.0, 0.0),
        )
    }

    fn at_height(height: f64) -> DVec3 {
        DVec3::new(1e7, 0.0, height)
    }

    #[test]
    fn a_point_light_weakens_with_the_square_of_the_distance_unless_told_otherwise() {
        let square = Falloff::InverseSquare { range: f64::INFINITY };
        let near = light(LightKind::Point { position: at_height(2.0), falloff: square });
        let incident = near.incident(Vec3::ZERO).expect("light arrives");
        assert!((incident.irradiance() - Vec3::splat(2.0)).length() < 1e-6);
        assert_eq!(incident.to_light, Vec3::Z);
        let constant = light(LightKind::Point { position: at_height(2.0), falloff: Falloff::None });
        let incident = constant.incident(Vec3::ZERO).expect("light arrives");
        assert_eq!(incident.strength(), Vec3::splat(8.0));
    }

    #[test]
    fn a_range_ends_the_light_smoothly() {
        let falloff = Falloff::InverseSquare { range: 4.0 };
        let lamp = light(LightKind::Point { position: at_height(2.0), falloff });
        let incident = lamp.incident(Vec3::ZERO).expect("light arrives");
        assert!((incident.irradiance() - Vec3::splat(2.0 * (1.0 - 1.0 / 16.0))).length() < 1e-6);
        assert!(lamp.incident(Vec3::NEG_Z * 2.0).is_none());
    }

    #[test]
    fn a_spot_fades_between_its_two_angles() {
        let kind = LightKind::Spot {
            position: at_height(1.0),
            direction: DVec3::NEG_Z,
            inner: 0.0,
            outer: std::f64::consts::FRAC_PI_3,
            falloff: Falloff::None,
        };
        let spot = light(kind);
        let along = |tan: f32| spot.incident(Vec3::new(tan, 0.0, 0.0)).map(|i| i.strength().x);
        assert_eq!(along(0.0), Some(8.0));
        // 45° from the axis: the fade is (cos 45° − cos 60°) / (1 − cos 60°).
        let fade = (0.5f32.sqrt() - 0.5) / 0.5;
        assert!((along(1.0).expect("inside the cone") - 8.0 * fade * fade).abs() < 1e-5);
        assert_eq!(along(2.0), None);
    }

    #[test]
    fn a_light_at_the_point_itself_gives_nothing() {
        let kind = LightKind::Point { position: at_height(0.0), falloff: Falloff::None };
        assert!(light(kind).incident(Vec3::ZERO).is_none());
    }
}
