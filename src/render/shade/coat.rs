//! Clear coat: a clear dielectric layer over any surface (KHR_materials_clearcoat).
//!
//! The light that the layer reflects, by the same microfacet model as the surface under it, is subtracted from that below; light
//! passes through without refraction. The subtracted share is that of the view direction alone, as the extension says.

use super::facets::albedo;
use super::highlight::{highlight, is_narrow, least_square, squared_width};
use super::metal_rough::{above, open, traced};
use super::{Reader, ShadingFrame, Sky};
use crate::math::Vec3;
use crate::render::optics::{fresnel_schlick, reflect};
use crate::scene::Coat;

/// Reflectance at normal incidence of a boundary to index 1.5.
const F0: f32 = 0.04;

/// Clear coat at one point.
#[derive(Clone, Debug)]
pub(crate) struct CoatLobe {
    /// Share of the surface that it covers.
    pub strength: f32,
    pub roughness: f32,
    /// Shading normal of the coat, on the viewer's side.
    pub normal: Vec3,
    /// Cosine between the view and `normal`.
    pub n_v: f32,
    /// Share of the light from below that it removes.
    pub taken: f32,
    /// Share of the environment that is unoccluded.
    pub occlusion: f32,
    /// Lower bound of α² in highlights.
    pub least_square: f32,
}

impl CoatLobe {
    /// A coat that covers nothing.
    pub(crate) const NONE: Self = Self {
        strength: 0.0,
        roughness: 0.0,
        normal: Vec3::Z,
        n_v: 0.0,
        taken: 0.0,
        occlusion: 1.0,
        least_square: 0.0,
    };

    /// `None` where it covers nothing; `normal` is that of the coat.
    pub(super) fn new(coat: &Coat, normal: Vec3, view: Vec3, occlusion: f32, reader: &Reader) -> Option<Self> {
        let strength = (coat.strength * reader.linear(coat.strength_map.as_ref()).x).clamp(0.0, 1.0);
        let roughness = (coat.roughness * reader.linear(coat.roughness_map.as_ref()).y).clamp(0.0, 1.0);
        let n_v = normal.dot(view).clamp(0.0, 1.0);
        let taken = strength * fresnel(n_v);
        (strength > 0.0).then_some(Self { strength, roughness, normal, n_v, taken, occlusion, least_square: 0.0 })
    }

    /// Share of the light from below that passes through.
    #[inline(always)]
    pub(crate) fn clear(&self) -> f32 {
        1.0 - self.taken
    }

    /// Whether its highlights are narrow.
    pub(crate) fn has_narrow_highlight(&self) -> bool {
        is_narrow(self.roughness)
    }

    /// Widens the highlights of lights to this α².
    pub(crate) fn widen_highlight(&mut self, to: f32) {
        self.least_square = least_square(self.roughness, to);
    }

    /// BRDF × N·L of a light; unit vectors, away from the surface.
    #[inline(always)]
    pub(crate) fn lit(&self, view: Vec3, to_light: Vec3) -> f32 {
        self.shown(view, to_light, squared_width(self.roughness).max(self.least_square))
    }

    /// BRDF × N·L of a light, for facets with a squared width of α².
    #[inline(always)]
    fn shown(&self, view: Vec3, to_light: Vec3, a2: f32) -> f32 {
        let (n_l, n_v) = (self.normal.dot(to_light), self.normal.dot(view));
        if self.strength <= 0.0 || n_l <= 0.0 || n_v <= 0.0 {
            return 0.0;
        }
        let between = view + to_light;
        self.strength * fresnel(0.5 * between.length()) * highlight(self.normal, between, [n_l, n_v], a2) * n_l
    }

    /// BRDF × N·L of the part that [`Self::ambient`] looks up.
    pub(super) fn lit_around(&self, view: Vec3, to: Vec3) -> f32 {
        self.shown(view, to, squared_width(self.roughness)) * (1.0 - traced(self.roughness))
    }

    /// Light of the environment that it reflects without a ray.
    pub(super) fn ambient(&self, seen: &ShadingFrame, sky: &Sky, ambient: Vec3) -> Vec3 {
        if self.looked_up() <= 0.0 {
            return Vec3::ZERO;
        }
        let share = self.share_looked_up(albedo(self.roughness, self.n_v));
        (sky.blurred(self.mirrored_from(seen), self.roughness) + ambient) * share
    }

    /// Share of the mirrored light that is looked up.
    #[inline(always)]
    pub(crate) fn looked_up(&self) -> f32 {
        1.0 - traced(self.roughness)
    }

    /// Direction of that lookup.
    #[inline(always)]
    pub(crate) fn mirrored_from(&self, seen: &ShadingFrame) -> Vec3 {
        above(reflect(-seen.view, self.normal), seen.geometric)
    }

    /// Share of that light that is seen; `scale` and `bias` are the shares of f0 and f90 in the lobe's albedo.
    #[inline(always)]
    pub(crate) fn share_looked_up(&self, (scale, bias): (f32, f32)) -> f32 {
        let share = self.strength * (F0 * scale + bias) * open(self.n_v, self.occlusion, self.roughness);
        share * self.looked_up()
    }

    /// Weight of the mirror ray off the coat.
    pub(super) fn mirrored(&self) -> f32 {
        self.taken * traced(self.roughness)
    }
}

/// Fresnel reflectance at this cosine.
#[inline(always)]
fn fresnel(cosine: f32) -> f32 {
    fresnel_schlick(Vec3::splat(F0), 1.0, cosine).x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::texture::TextureStore;
    use crate::scene::Scene;

    fn coat(strength: f32, roughness: f32, view: Vec3) -> Option<CoatLobe> {
        let coat =
            Coat { strength, strength_map: None, roughness, roughness_map: None, normal_map: None, normal_scale: 1.0 };
        let scene = Scene::default();
        let store = TextureStore::new(&scene);
        let reader = Reader { store: &store, patch: None, known: &[] };
        CoatLobe::new(&coat, Vec3::Z, view, 1.0, &reader)
    }

    fn at(degrees: f32) -> Vec3 {
        let (sin, cos) = libm::sincosf(degrees.to_radians());
        Vec3::new(sin, 0.0, cos)
    }

    #[test]
    fn coat_takes_off_what_it_mirrors() {
        for degrees in [0.0, 30.0, 60.0, 85.0] {
            let smooth = coat(1.0, 0.0, at(degrees)).unwrap();
            assert!((smooth.mirrored() + smooth.clear() - 1.0).abs() < 1e-6);
        }
        let face_on = coat(1.0, 0.0, Vec3::Z).unwrap();
        assert!((face_on.mirrored() - 0.04).abs() < 1e-7);
        assert!((coat(0.5, 0.0, Vec3::Z).unwrap().mirrored() - 0.02).abs() < 1e-7);
        assert!(coat(0.0, 0.0, Vec3::Z).is_none(), "there is none");
    }

    #[test]
    fn rough_coat_sends_no_ray_and_shows_a_wide_highlight() {
        let (smooth, rough) = (coat(1.0, 0.1, Vec3::Z).unwrap(), coat(1.0, 0.6, Vec3::Z).unwrap());
        assert_eq!(rough.mirrored(), 0.0);
        assert!(smooth.lit(Vec3::Z, Vec3::Z) > 100.0 * rough.lit(Vec3::Z, Vec3::Z));
        assert!(smooth.lit(Vec3::Z, at(40.0)) < rough.lit(Vec3::Z, at(40.0)));
        assert_eq!(rough.lit(Vec3::Z, at(120.0)), 0.0, "behind the surface");
    }

    #[test]
    fn a_white_sky_gives_back_no_more_than_the_share_of_the_coat() {
        let sky = Sky::new(&Scene { environment: crate::scene::Environment::Constant(Vec3::ONE), ..Scene::default() });
        for roughness in [0.15, 0.3, 0.7, 1.0] {
            for degrees in [0.0, 45.0, 75.0] {
                let view = at(degrees);
                let coat = coat(1.0, roughness, view).unwrap();
                let seen = ShadingFrame { normal: Vec3::Z, geometric: Vec3::Z, view, outside: true };
                let white = coat.ambient(&seen, &sky, Vec3::ZERO).x + coat.mirrored();
                assert!(white > 0.01 && white <= coat.taken + 0.02, "{roughness} at {degrees}: {white}");
            }
        }
    }
}
