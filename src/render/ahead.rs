//! First samples of every pixel of a small picture, traced by the search for fireflies and kept, so that the picture need not
//! trace them again.

use super::Settings;
use super::layers::FirstSurface;
use super::whitted::{Sample, Tracer};
use crate::accel::Accel;
use std::ops::Range;

/// The first samples of every pixel, equally many of each.
#[derive(Debug)]
pub(super) struct Ahead {
    columns: usize,
    /// Samples of each pixel, a power of two.
    samples: u32,
    /// All samples, pixel by pixel, row by row.
    each: Vec<Sample>,
    /// Whether the rays of each sample were spread by random choices.
    by_chance: Vec<bool>,
    /// First surface of each sample, for the picture's layers; empty unless layers are wanted.
    firsts: Vec<FirstSurface>,
}

/// A range of samples of one pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfPixel<'a> {
    pub samples: &'a [Sample],
    pub by_chance: &'a [bool],
    pub firsts: &'a [FirstSurface],
}

impl Ahead {
    /// Makes room for `samples` samples of each pixel.
    pub(super) fn new(settings: &Settings, samples: u32) -> Self {
        let (columns, rows) = (settings.width as usize, settings.height as usize);
        let count = columns * rows * samples as usize;
        let firsts = vec![FirstSurface::NONE; if settings.layers { count } else { 0 }];
        Self { columns, samples, each: vec![Sample::default(); count], by_chance: vec![false; count], firsts }
    }

    /// Keeps the samples of these pixels that `tracer` has just traced as their `index`th.
    pub(super) fn keep<A: Accel, P>(&mut self, index: u32, (columns, rows): (&[u32], &[u32]), tracer: &Tracer<A, P>) {
        for (i, (&x, &y)) in columns.iter().zip(rows).enumerate() {
            let at = self.place((x, y)) + index as usize;
            (self.each[at], self.by_chance[at]) = (tracer.samples[i], tracer.by_chance[i]);
            if let (Some(to), Some(first)) = (self.firsts.get_mut(at), tracer.firsts.get(i)) {
                *to = *first;
            }
        }
    }

    /// Returns the samples of one pixel whose indices are in `numbers`; indices past the last kept sample are left out.
    pub(super) fn of(&self, pixel: (u32, u32), numbers: Range<u32>) -> OfPixel<'_> {
        let start = self.place(pixel);
        let range = start + numbers.start as usize..start + numbers.end.min(self.samples) as usize;
        OfPixel {
            samples: &self.each[range.clone()],
            by_chance: &self.by_chance[range.clone()],
            firsts: self.firsts.get(range).unwrap_or_default(),
        }
    }

    fn place(&self, (x, y): (u32, u32)) -> usize {
        (y as usize * self.columns + x as usize) * self.samples as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{AccelKind, AccelParams, AnyAccel, RayCounts};
    use crate::math::DVec3;
    use crate::render::context::Context;
    use crate::render::fireflies::{self, Closely};
    use crate::render::sampling::{Sampling, Stochastic};
    use crate::render::texture::TextureStore;
    use crate::render::tile::{RenderedTiles, render_tiles};
    use crate::render::view::{Lens, View};
    use crate::render::{Job, World};
    use crate::scene::{Environment, Material, MetalRough, Reflection, Scene, Sphere};

    /// Returns a scene of one ball of frosted glass.
    fn frosted() -> Scene {
        let glass = MetalRough { transmission: 1.0, roughness: 0.4, metallic: 0.0, ..MetalRough::default() };
        let material = Material { reflection: Reflection::MetalRough(glass), ..Material::plain() };
        let sphere = Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.0, material: 0 };
        Scene { materials: vec![material], spheres: vec![sphere], environment: Environment::Studio, ..Scene::default() }
    }

    #[test]
    fn a_picture_is_the_same_whether_its_first_samples_are_kept_or_traced_again() {
        let scene = frosted();
        let world = World::new(&scene);
        let accel = AnyAccel::build(AccelKind::None, &world.shapes, &AccelParams::DEFAULT);
        let textures = TextureStore::new(&scene);
        let view = View::look_at(DVec3::new(0.3, 0.2, 4.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.7));
        // Sixteen samples a pixel are kept, four, one, and then more and fewer than pixels start with by default.
        for (width, height, min_samples, max_samples) in
            [(40, 34, 1, 64), (110, 100, 1, 16), (230, 210, 1, 4), (40, 34, 32, 64), (40, 34, 1, 8)]
        {
            let how = Stochastic { error: 0.02, min_samples, max_samples, ..Stochastic::default() };
            let settings = Settings {
                width,
                height,
                layers: width == 110,
                sampling: Sampling::Stochastic(how),
                ..Settings::default()
            };
            let job = Job {
                scene: &scene,
                world: &world,
                accel: &accel,
                textures: &textures,
                view: &view,
                settings: &settings,
            };
            let mut context = Context::new(&scene, &world, &textures, &settings);
            let (rays, looked) = fireflies::look::<RayCounts>(&job, &mut context, Closely::All, &());
            let kept = context.ahead.as_ref().map_or(0, |ahead| ahead.samples);
            assert_eq!(kept, context.first_samples);
            assert_eq!(rays.all - rays.beside, u64::from(kept * width * height), "all of them are the picture's");
            let primary = |counts: &[crate::render::by_class::ByClass<RayCounts>]| -> u64 {
                counts.iter().map(|counts| counts.primary.queries).sum()
            };
            let render = |context: &Context| {
                let RenderedTiles { picture, sampled, counts, .. } =
                    render_tiles::<_, RayCounts>(context, &accel, &view, &settings, &());
                (picture, sampled, primary(&counts))
            };
            let (picture, sampled, traced) = render(&context);
            let again = Context { ahead: None, ..context.clone() };
            let (expected, told, traced_again) = render(&again);
            assert!(picture.beauty == expected.beauty, "{width}×{height}");
            assert!(sampled.counts == told.counts && sampled.errors == told.errors);
            let normals = |picture: &crate::image::Picture| picture.layers.as_ref().map(|layers| layers.normal.clone());
            assert!(normals(&picture) == normals(&expected));
            assert!(traced + u64::from(kept * width * height) <= traced_again, "{traced} and {traced_again}");
            assert_eq!(primary(&looked) + traced, sampled.rays + rays.beside, "every ray counts once");
        }
    }

    #[test]
    fn no_more_is_told_of_a_pixel_than_there_is() {
        let ahead = Ahead::new(&Settings { width: 3, height: 2, ..Settings::default() }, 4);
        assert_eq!([0..4, 1..3, 2..16].map(|numbers| ahead.of((2, 1), numbers).samples.len()), [4, 2, 2]);
    }
}
