//! What all rays of a picture share: the scene, its lights and sky in the centred frame, and the limits of the ray trees.

use super::Settings;
use super::ahead::Ahead;
use super::alpha_voids::{AlphaFilter, AlphaVoids, Cones};
use super::certainty;
use super::fireflies::Fireflies;
use super::frame::sample_width;
use super::glint;
use super::media::absorption::Absorption;
use super::observer::Observer;
use super::sampling::Sampling;
use super::shade::{Band, LocalLight, bands};
use super::shading_batch::MaterialConstants;
use super::sky::Sky;
use super::texture::TextureStore;
use super::wave::RayClass;
use super::world::World;
use crate::accel::Ray;
use crate::accel::shapes::Prim;
use crate::math::Vec3;
use crate::math::simd::LANES;
use crate::scene::features::{Feature, Features};
use crate::scene::{Background, Material, Scene};
use std::sync::Arc;

/// Default number of rays from each point to a panorama.
const ENV_RAYS: u32 = 16;

/// Shadow rays that may be queued before they are traced.
pub(super) const SHADOW_LIMIT: usize = 1 << 14;
/// Environment rays that may be queued before they are traced.
pub(super) const ENVIRONMENT_RAYS_LIMIT: usize = 1 << 15;
/// Secondary rays of primary rays that may be queued before they are traced.
pub(super) const FOLLOWERS: usize = 1 << 17;

/// Number of samples of a pixel that share the rays which a single sample would send from each point. In stochastic sampling it
/// is the number that every uneven pixel takes, because more samples, and so more rays, follow where needed.
fn samples_together(settings: &Settings) -> u32 {
    match settings.sampling {
        Sampling::Stochastic(how) => {
            let (fewest, most) = how.powers();
            fewest.max(certainty::SURE).min(most)
        }
        Sampling::Uniform | Sampling::Adaptive(_) => 1,
    }
}

/// Data shared by all workers, computed once per picture. Expensive parts are behind `Arc`, so that clones share them.
#[derive(Clone)]
pub(crate) struct Context<'a> {
    pub scene: &'a Scene,
    pub world: &'a World,
    pub textures: &'a TextureStore<'a>,
    pub sky: Arc<Sky>,
    pub lights: Vec<LocalLight>,
    /// Shading constants of each material that hold at all its points; `None` where they vary, or where each point must be
    /// evaluated.
    pub material_constants: Arc<[Option<MaterialConstants>]>,
    /// Bands of the spectrum; empty unless a material disperses light.
    pub bands: Vec<Band>,
    /// Regions that rays certainly cross without a hit.
    pub alpha_voids: Option<Arc<AlphaVoids<'a>>>,
    /// Whether anything but opaque surfaces can stand between a point and a light.
    pub has_filters: bool,
    /// Absorption of light inside the materials.
    pub absorption: Absorption,
    /// Whether the environment is the background of the scene.
    pub shows_environment: bool,
    /// Rays from each point to its surroundings.
    pub env_rays: u32,
    /// Shadow rays to each area light; at least 1.
    pub light_rays: u32,
    /// Number of rays that rough surfaces spread.
    pub gloss: Gloss,
    /// Whether random choices may spread rays.
    pub meets_by_chance: bool,
    /// Rare and far brighter features that spread rays were found to hit; `None` if they were not looked for.
    pub fireflies: Option<Arc<Fireflies>>,
    /// Samples of every pixel that are traced before the picture, which starts with them; 0 for none.
    pub first_samples: u32,
    /// The first samples of all pixels, where they were traced ahead.
    pub ahead: Option<Arc<Ahead>>,
    /// Spread of highlights, in widths of a ray's cone.
    pub highlight_reach: f32,
    /// Seed of all random choices.
    pub seed: u64,
    /// Whether only lights and emissive surfaces are visible.
    pub is_dark: bool,
    /// Points that are shaded before their queued rays may be traced; a multiple of [`LANES`].
    pub points_at_a_time: usize,
    /// Whether the background may be visible through glass.
    pub lets_background_through: bool,
    /// Bounces after the eye ray.
    pub depth: u32,
    /// Branches end whose largest weight is below this value.
    pub cutoff: f32,
    /// Whether work that the scene does not need is done all the same.
    pub no_prune: bool,
}

/// Which rough surfaces spread rays, and how many.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gloss {
    pub rays: u32,
    /// Width of the part of a lobe that one ray stands for, relative to its width if only the rays of its own sample covered the
    /// lobe.
    pub width: f32,
    /// Whether all rough surfaces spread rays, or only those that transmit light.
    all: bool,
}

impl Gloss {
    /// Gloss for the number of rays asked for; `None` for the default.
    pub(crate) fn new(asked: Option<u32>) -> Self {
        /// Default number of rays through frosted glass.
        const GLASS: u32 = 4;
        Self { rays: asked.unwrap_or(GLASS), width: 1.0, all: asked.is_some_and(|rays| rays > 0) }
    }

    /// Narrows the lobe part of each ray to the sampling of pixels: rays of all samples that a pixel may have cover the lobe
    /// together.
    fn of_samples(self, settings: &Settings) -> Self {
        Self { width: sample_width(settings), ..self }
    }

    /// Divides the rays among `samples` samples.
    fn shared_by(self, samples: u32) -> Self {
        Self { rays: self.rays.div_ceil(samples), ..self }
    }

    /// Whether rough surfaces of a material spread rays.
    pub(crate) fn spreads(self, material: &Material) -> bool {
        self.all || self.rays > 0 && material.reflection.transmits()
    }

    /// Whether a material spreads rays and is rough anywhere.
    fn spreads_far(self, material: &Material) -> bool {
        self.spreads(material) && material.metal_rough().is_some_and(|m| m.roughness > 0.0 || m.anisotropy.is_some())
    }
}

impl<'a> Context<'a> {
    pub(crate) fn new(scene: &'a Scene, world: &'a World, textures: &'a TextureStore<'a>, settings: &Settings) -> Self {
        let no_prune = settings.no_prune;
        let features = Features::of(scene);
        let together = samples_together(settings);
        let gloss = Gloss::new(settings.gloss_rays).shared_by(together).of_samples(settings);
        let depth = settings.depth.unwrap_or_else(|| auto_depth(&features, gloss.all, settings.cutoff));
        let spreads = depth > 0 && scene.materials.iter().any(|material| gloss.spreads_far(material));
        let mut sky = Sky::new(scene).before_walls(settings.walls);
        if spreads {
            sky.find_hotspot();
        }
        let env_rays = settings.env_rays.unwrap_or(if sky.is_map() { ENV_RAYS } else { 0 });
        let samplers = environment_samplers(
            sky.is_map(),
            features.has(Feature::DiffuseTransmission),
            features.has(Feature::MetalRough),
        );
        let env_rays = shared_env_rays(env_rays, together, samplers);
        let lights: Vec<LocalLight> = scene.lights.iter().map(|l| LocalLight::new(l, world.center)).collect();
        let light_rays = settings.light_rays.max(1).div_ceil(together);
        let alone = no_prune || settings.one_by_one;
        let constants = |(id, m): (u32, &Material)| {
            if alone { None } else { MaterialConstants::of(id, m, textures, depth > 0, gloss) }
        };
        let needs = |any: &[Feature]| no_prune || any.iter().any(|&f| features.has(f));
        Self {
            scene,
            world,
            textures,
            is_dark: sky.is_dark() && scene.ambient == Vec3::ZERO,
            sky: Arc::new(sky),
            env_rays,
            light_rays,
            gloss,
            meets_by_chance: settings.lens.is_some() || spreads,
            fireflies: None,
            first_samples: 0,
            ahead: None,
            highlight_reach: glint::reach(settings),
            seed: settings.seed,
            points_at_a_time: points_at_a_time(&lights, light_rays, env_rays, gloss),
            lights,
            material_constants: (0..).zip(&scene.materials).map(constants).collect(),
            bands: if needs(&[Feature::Dispersion]) { bands() } else { Vec::new() },
            alpha_voids: (!no_prune).then(|| AlphaVoids::of(scene, world, textures)).flatten().map(Arc::new),
            has_filters: no_prune || !world.is_opaque(),
            absorption: Absorption::of(&scene.materials, no_prune),
            shows_environment: scene.background == Some(Background::Environment),
            lets_background_through: features.has(Feature::ThinTransmission) || features.has(Feature::Refraction),
            depth,
            cutoff: settings.cutoff,
            no_prune,
        }
    }

    /// Returns the alpha filter of the rays of a class with these cones; `None` in counted runs, and where skipping gaps could
    /// change the order of sums.
    ///
    /// Contributions to a sample are summed in the order of its rays, which must not depend on which gaps rays skip, and so on
    /// how many rays are queued. Rays may skip gaps where each sample has only one ray, or where the whole queue is traced at
    /// once.
    pub(super) fn alpha_filter<'r, P: Observer>(
        &'r self,
        class: RayClass,
        samples: usize,
        rays: &'r [Ray],
        cones: Cones<'r>,
    ) -> Option<AlphaFilter<'r, 'a>> {
        let each = 2 * self.gloss.rays as usize + self.bands.len() + 2;
        let in_order = self.depth == 0 || class == RayClass::Primary && samples.saturating_mul(each) < FOLLOWERS;
        let alpha_voids = self.alpha_voids.as_ref().filter(|_| P::FILTERS_ALPHA && in_order)?;
        Some(alpha_voids.filter(rays, cones))
    }

    /// Whether shadow rays query which surfaces on their way transmit light, and how much.
    pub(super) fn asks_filters(&self) -> bool {
        self.has_filters && !self.no_prune
    }

    /// Returns this context for other random choices and other samples.
    pub(super) fn resampled(&self, settings: &Settings) -> Self {
        let (highlight_reach, gloss) = (glint::reach(settings), self.gloss.of_samples(settings));
        Self { seed: settings.seed, highlight_reach, gloss, ahead: None, ..self.clone() }
    }

    /// Whether rays to the hotspot end at this material: transmitted rays may change direction or branch, and lose light
    /// depending on their angle of incidence.
    pub(super) fn turns(&self, material: &Material) -> bool {
        material.reflection.transmits()
    }

    /// A prim and the index of its material.
    pub(super) fn face(&self, prim: u32) -> (Prim<'_>, u32) {
        (self.world.prim(prim), self.world.material(self.scene, prim))
    }

    /// Shadow rays to each area light after `depth` bounces: reflections need no more than a hint of soft edges.
    pub(crate) fn light_rays_at(&self, depth: u32) -> u32 {
        if depth == 0 { self.light_rays } else { self.light_rays.div_ceil(4) }
    }

    /// Whether the light that many points receive from their surroundings has no closed form.
    pub(crate) fn environment_needs_points(&self) -> bool {
        self.sky.is_map() || self.env_rays > 0
    }

    /// Whether a branch of this weight, which stands for a fraction `part` of the spread rays, is worth tracing.
    pub(crate) fn is_alive(&self, weight: Vec3, part: f32) -> bool {
        weight.max_element() >= self.cutoff_of(part)
    }

    /// Weight below which every branch ends, whatever its part.
    pub(crate) fn least_cutoff(&self) -> f32 {
        self.cutoff_of(1.0 / self.gloss.rays.max(1) as f32)
    }

    pub(super) fn cutoff_of(&self, part: f32) -> f32 {
        (self.cutoff * part).max(f32::MIN_POSITIVE)
    }
}

/// Number of strategies that sample directions to the surroundings, by whether these are a panorama, whether some surfaces are
/// translucent, and whether some are glossy.
fn environment_samplers(to_panorama: bool, translucent: bool, glossy: bool) -> u32 {
    // One for each side. A lobe is sampled only within itself, and so is the sun of a panorama by its own light.
    1 + u32::from(translucent) + if to_panorama { 2 } else { u32::from(glossy) }
}

/// Rays to the surroundings from each of `together` samples, where a sample alone would send `rays`: at least one for each
/// strategy in each half, because a ray of another strategy hits the strategy's target rarely and with far too much weight.
fn shared_env_rays(rays: u32, together: u32, samplers: u32) -> u32 {
    if rays == 0 { 0 } else { rays.div_ceil(together).max(2 * samplers) }
}

/// Number of points whose rays together hardly exceed the limits of the queues.
fn points_at_a_time(lights: &[LocalLight], light_rays: u32, env_rays: u32, gloss: Gloss) -> usize {
    let rays = |light: &LocalLight| if light.is_area() { light_rays as usize } else { 1 };
    let to_lights: usize = lights.iter().filter(|light| light.shadows).map(rays).sum();
    let points = (SHADOW_LIMIT / to_lights.max(1)).min(ENVIRONMENT_RAYS_LIMIT / (env_rays as usize).max(1));
    let points = points.min(FOLLOWERS / (gloss.rays as usize).max(1));
    points.max(1).next_multiple_of(LANES)
}

/// Number of bounces that a scene needs: none without mirrors or glass, a few between mirrors, more where objects are entered and
/// left.
fn auto_depth(features: &Features, rough_ones_mirror: bool, cutoff: f32) -> u32 {
    /// Total internal reflection loses no light: paths in a thin wall are long, but few.
    const GLASS: u32 = 256;
    /// All branches of a path together weigh no more than the path, so at most 1 ÷ cutoff of them go on; below this cutoff, that
    /// no longer limits their number, which may double with each bounce.
    const BRANCHES_END: f32 = 1e-6;
    const BRANCHING_GLASS: u32 = 12;
    const MIRRORS: u32 = 5;
    if features.has(Feature::Refraction) || features.has(Feature::ThinTransmission) {
        if cutoff < BRANCHES_END { BRANCHING_GLASS } else { GLASS }
    } else if features.has(Feature::Mirrors) || rough_ones_mirror && features.has(Feature::MetalRough) {
        MIRRORS
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::{MetalRough, Phong, Reflection, Sphere};

    fn scene_of(reflection: Reflection) -> Scene {
        let sphere = Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.0, material: 0 };
        Scene {
            materials: vec![Material { reflection, ..Material::plain() }],
            spheres: vec![sphere],
            ..Scene::default()
        }
    }

    #[test]
    fn the_depth_follows_from_the_materials() {
        let matt = Phong::default();
        let mirror = Phong { mirror: Vec3::splat(0.5), ..Phong::default() };
        let metal = MetalRough { transmission: 0.5, roughness: 0.5, ..MetalRough::default() };
        let glass = MetalRough { metallic: 0.0, ..metal.clone() };
        assert_eq!(
            auto_depth(&Features::of(&scene_of(Reflection::MetalRough(metal))), false, 0.002),
            0,
            "lets nothing through"
        );
        assert_eq!(auto_depth(&Features::of(&scene_of(Reflection::Phong(matt))), false, 0.002), 0);
        assert_eq!(auto_depth(&Features::of(&scene_of(Reflection::Phong(mirror))), false, 0.002), 5);
        let glass = Features::of(&scene_of(Reflection::MetalRough(glass)));
        assert_eq!(auto_depth(&glass, false, 0.002), 256);
        assert_eq!(auto_depth(&Features::default(), false, 0.002), 0);
        assert_eq!(auto_depth(&glass, false, 0.0), 12, "paths that nothing ends double with each bounce");
    }

    #[test]
    fn samples_share_rays_to_the_surroundings_but_each_way_keeps_its_own() {
        let shared = |rays, together| {
            [
                (false, false, false),
                (false, false, true),
                (true, false, false),
                (false, true, false),
                (true, true, true),
            ]
            .map(|(map, thin, glossy)| shared_env_rays(rays, together, environment_samplers(map, thin, glossy)))
        };
        assert_eq!(shared(0, 4), [0; 5]);
        assert_eq!(shared(1, 1), [2, 4, 6, 4, 8]);
        assert_eq!(shared(16, 1), [16; 5]);
        assert_eq!(shared(16, 4), [4, 4, 6, 4, 8]);
        assert_eq!(shared(4, 4), [2, 4, 6, 4, 8]);
        assert_eq!(shared(100, 4), [25; 5]);
    }
}
