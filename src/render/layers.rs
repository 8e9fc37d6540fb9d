//! Layers of a picture besides colour: albedo, normal, position, depth and ids of the first surface seen.

use crate::accel::NO_PRIM;
use crate::image::Layers;
use crate::math::{DVec3, Vec3};

/// The first surface of one sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstSurface {
    albedo: Vec3,
    normal: Vec3,
    /// In world space.
    position: DVec3,
    prim: u32,
    instance: u32,
}

impl FirstSurface {
    /// Marks "nothing was hit".
    pub(crate) const NONE: Self =
        Self { albedo: Vec3::ZERO, normal: Vec3::ZERO, position: DVec3::ZERO, prim: NO_PRIM, instance: NO_PRIM };

    /// First surface on a prim of an instance; position and normal are in a frame with this `center`.
    pub(crate) fn new(
        (prim, instance): (u32, u32),
        (position, normal): (Vec3, Vec3),
        albedo: Vec3,
        center: DVec3,
    ) -> Self {
        Self { albedo, normal, position: center + position.as_dvec3(), prim, instance }
    }

    pub(crate) fn is_some(&self) -> bool {
        self.prim != NO_PRIM
    }
}

/// The layers of one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerPixel {
    albedo: Vec3,
    normal: Vec3,
    position: Vec3,
    depth: f32,
    prim: u32,
    instance: u32,
}

/// Sum over the first surfaces of the samples of a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerSum {
    albedo: Vec3,
    normal: Vec3,
    first: FirstSurface,
    samples: u32,
}

impl Default for LayerSum {
    fn default() -> Self {
        Self { albedo: Vec3::ZERO, normal: Vec3::ZERO, first: FirstSurface::NONE, samples: 0 }
    }
}

impl LayerSum {
    pub(crate) fn add(&mut self, first: &FirstSurface) {
        self.albedo += first.albedo;
        self.normal += first.normal;
        self.samples += 1;
        if !self.first.is_some() {
            self.first = *first;
        }
    }

    /// Returns the layers of the pixel; depth is measured from `eye` along the unit vector `forward`.
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, reason = "layers are f32")]
    pub(crate) fn pixel(&self, eye: DVec3, forward: DVec3) -> LayerPixel {
        let share = 1.0 / self.samples.max(1) as f32;
        let first = Some(&self.first).filter(|f| f.is_some());
        LayerPixel {
            albedo: self.albedo * share,
            normal: self.normal * share,
            position: first.map_or(Vec3::ZERO, |f| f.position.as_vec3()),
            depth: first.map_or(f32::INFINITY, |f| (f.position - eye).dot(forward) as f32),
            prim: first.map_or(NO_PRIM, |f| f.prim),
            instance: first.map_or(NO_PRIM, |f| f.instance),
        }
    }
}

impl LayerPixel {
    /// Layers of a pixel from its samples; depth is measured from `eye` along the unit vector `forward`.
    pub(crate) fn new(samples: &[FirstSurface], eye: DVec3, forward: DVec3) -> Self {
        let mut sum = LayerSum::default();
        samples.iter().for_each(|first| sum.add(first));
        sum.pixel(eye, forward)
    }

    /// Stores the pixel at index `i` of `layers`, whose arrays are all long enough.
    pub(crate) fn store(&self, layers: &mut Layers, i: usize) {
        layers.albedo[i] = self.albedo.to_array();
        layers.normal[i] = self.normal.to_array();
        layers.position[i] = self.position.to_array();
        layers.depth[i] = self.depth;
        layers.prim[i] = self.prim;
        layers.instance[i] = self.instance;
    }
}

/// Layers of `pixels` pixels in which nothing was hit.
pub(crate) fn empty(pixels: usize) -> Layers {
    Layers {
        albedo: vec![[0.0; 3]; pixels],
        normal: vec![[0.0; 3]; pixels],
        position: vec![[0.0; 3]; pixels],
        depth: vec![f32::INFINITY; pixels],
        prim: vec![NO_PRIM; pixels],
        instance: vec![NO_PRIM; pixels],
        channels: Vec::new(),
    }
}
