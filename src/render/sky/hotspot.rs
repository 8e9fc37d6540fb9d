//! The hotspot: the small and bright part of a panorama, usually a sun, which few of the rays that rough surfaces spread would
//! hit.
//!
//! Light above a cap that only a small part of the panorama exceeds is importance-sampled; the rest is calm, and seen by rays in
//! any direction.

use super::Sky;
use super::distribution::{COLUMNS, EnvironmentDistribution};
use super::panorama::Pyramid;
use crate::math::Vec3;
use std::f64::consts::PI;

/// Largest solid angle above the cap, sr: a sun with its halo, 9° across.
const MOST: f32 = 0.02;

/// Smallest share of all light at which a hotspot is worth rays of its own.
const LEAST: f64 = 0.01;

#[derive(Clone, Debug)]
pub(super) struct Hotspot {
    /// The panorama clamped to the cap.
    without: Pyramid,
    /// Distribution of the light above the cap.
    distribution: EnvironmentDistribution,
    /// Effective solid angle, sr: that of a uniform light with the same power and mean square.
    area: f32,
    /// Mean over the sphere of the greatest channel of the calm rest.
    mean_without: f32,
}

impl Hotspot {
    /// Finds the hotspot of a panorama, if it has one.
    pub(super) fn of(pyramid: &Pyramid) -> Option<Self> {
        let level = pyramid.at_most(COLUMNS);
        let mut each: Vec<(Vec3, f32)> = level.each().collect();
        each.sort_unstable_by(|(a, _), (b, _)| b.max_element().total_cmp(&a.max_element()));
        let (mut area, mut cap) = (0.0, 0.0);
        for (light, more) in each {
            cap = light.max_element();
            if area + more > MOST {
                break;
            }
            area += more;
        }
        let capped = |light: Vec3| if light.max_element() > cap { light * (cap / light.max_element()) } else { light };
        let beyond = |light: Vec3| light - capped(light);
        // Squares of very bright or dim values overflow or underflow single precision.
        let sum = |light: Vec3| f64::from(light.element_sum());
        let sum_of = |part: &dyn Fn(Vec3) -> f64| -> f64 {
            level.each().map(|(light, area)| part(light) * f64::from(area)).sum()
        };
        let (hotspot, all) = (sum_of(&|light| sum(beyond(light))), sum_of(&sum));
        let squares = sum_of(&|light| sum(beyond(light)).powi(2));
        #[expect(clippy::cast_possible_truncation, reason = "an area and a mean")]
        let (area, mean_without) = (
            (hotspot * hotspot / squares) as f32,
            (sum_of(&|light| f64::from(capped(light).max_element())) / (4.0 * PI)) as f32,
        );
        (hotspot > LEAST * all && all.is_finite() && squares.is_finite()).then(|| Self {
            without: Pyramid::sharp(level.with(capped)),
            distribution: EnvironmentDistribution::new(level.with(beyond), 0.0),
            area,
            mean_without,
        })
    }
}

impl Sky {
    /// Finds the hotspot of a panorama, for surfaces that spread rays.
    pub(crate) fn find_hotspot(&mut self) {
        if let Some(map) = &mut self.map {
            map.seeks_hotspot = true;
            map.hotspot();
        }
    }

    /// Effective solid angle of the hotspot, sr; `None`: there is none.
    pub(crate) fn hotspot(&self) -> Option<f32> {
        self.map.as_ref().and_then(|map| map.hotspot()).map(|hotspot| hotspot.area)
    }

    /// Whether a ray to the hotspot is worth it for its contribution `light`, compared with the calm rest, given the weight
    /// `cutoff` below which rays are dropped.
    pub(crate) fn is_worth_a_ray(&self, light: Vec3, cutoff: f32) -> bool {
        /// Much less than 1, as suns are bright.
        const PART: f32 = 1.0 / 16.0;
        let calm = self.map.as_ref().and_then(|map| map.hotspot()).map_or(0.0, |hotspot| hotspot.mean_without);
        light.max_element() > PART * cutoff * calm
    }

    /// Direction to the hotspot, drawn with two numbers from 0 … 1, and its radiance over the density of drawing it.
    pub(crate) fn to_hotspot(&self, at: [f32; 2]) -> Option<(Vec3, Vec3)> {
        let map = self.map.as_ref()?;
        let distribution = &map.hotspot()?.distribution;
        let dir = distribution.draw(at);
        let (radiance, density) = distribution.look(dir);
        (density > 0.0).then(|| (self.to_world(map, dir), radiance / density))
    }

    /// Radiance along a unit direction without the hotspot, averaged over a cone this many radians across.
    pub(crate) fn without_hotspot(&self, dir: Vec3, angle: f32) -> Vec3 {
        match self.map.as_ref().and_then(|map| map.hotspot().map(|hotspot| (map, hotspot))) {
            Some((map, hotspot)) => hotspot.without.radiance(self.to_map(map, dir), angle),
            None => self.radiance(dir, angle),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::panorama::Level;
    use super::*;
    use crate::scene::{Environment, Panorama, Scene};
    use std::sync::Arc;

    /// A sky that is darker below, with a sun so many degrees across.
    fn sky(degrees: f32, strength: f32) -> Sky {
        let (width, height) = (512, 256);
        let sun = Vec3::new(0.55, 0.62, 0.45).normalize();
        let texel = |dir: Vec3| {
            let sunny = sun.angle_between(dir).to_degrees() < 0.5 * degrees;
            Vec3::new(0.3, 0.4, 0.5 + 0.2 * dir.y)
                + if sunny { Vec3::new(1.0, 0.9, 0.8) * strength } else { Vec3::ZERO }
        };
        let grid = Level::without_texels((width, height));
        let texels = Arc::new(grid.middles().map(|(_, dir)| texel(dir).to_array()).collect());
        let panorama = Panorama { name: String::new(), width, height, texels, rotation: 0.7, ..Panorama::default() };
        let mut sky =
            Sky::new(&Scene { environment: Environment::Panorama, panorama: Some(panorama), ..Scene::default() });
        sky.find_hotspot();
        sky
    }

    #[test]
    fn a_sun_is_a_hotspot_and_a_wide_or_a_weak_light_is_not() {
        let area = sky(3.0, 1000.0).hotspot().expect("a sun");
        let sun = 2.0 * std::f32::consts::PI * (1.0 - libm::cosf(1.5_f32.to_radians()));
        assert!((area / sun - 1.0).abs() < 0.15, "{area} of {sun}");
        assert_eq!((sky(40.0, 1000.0).hotspot(), sky(3.0, 1.0).hotspot(), sky(3.0, 0.0).hotspot()), (None, None, None));
    }

    #[test]
    fn what_is_drawn_and_what_is_calm_are_together_all_the_light_of_a_picture() {
        let sky = sky(3.0, 1000.0);
        let count = 20_000_u16;
        let at = |k: u16| [(f32::from(k) + 0.5) / f32::from(count), (f32::from(k) * 0.618_034).fract()];
        let drawn = (0..count).filter_map(|k| sky.to_hotspot(at(k))).map(|(_, light)| light).sum::<Vec3>();
        let drawn = drawn / f32::from(count);
        let over = |seen: &dyn Fn(Vec3) -> Vec3| -> Vec3 {
            let grid = Level::without_texels((1024, 512));
            grid.middles().map(|(row, dir)| seen(dir) * grid.area(row)).sum()
        };
        let (calm, all) = (over(&|dir| sky.without_hotspot(dir, 0.0)), over(&|dir| sky.radiance(dir, 0.0)));
        assert!((drawn + calm - all).abs().max_element() < 0.01 * all.min_element(), "{drawn} + {calm} is not {all}");
        assert!(drawn.min_element() > 1.0 && calm.max_element() < 10.0, "{drawn}, {calm}");
        let off = (0..count)
            .filter_map(|k| sky.to_hotspot(at(k)))
            .map(|(dir, _)| sky.without_hotspot(dir, 0.0).max_element());
        assert!(off.fold(0.0, f32::max) < 1.0, "nothing of the sun is calm");
    }
}
