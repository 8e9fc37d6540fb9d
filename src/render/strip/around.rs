//! What the points of a strip show of their surroundings, and what they shine with themselves.

use super::columns::{Column, Columns, Found, POINTS, Strip, get, padded, put};
use crate::math::Vec3;
use crate::math::simd::{Kernel, Simd};
use crate::render::shade::{Around, Matter, MetalRoughMatter, Model};
use crate::render::sky::Sky;
use crate::render::studio;
use crate::scene::UpAxis;

/// The surroundings as each point sees them.
pub(super) struct Surroundings {
    /// Cosine of the view, and the shares of f0 and f90 there.
    n_v: Column,
    shares: [Column; 2],
    mirrored_dir: Columns,
    diffuse: Columns,
    mirrored: Columns,
    pub(super) radiance: Columns,
}

impl Default for Surroundings {
    fn default() -> Self {
        let (one, three) = ([0.0; POINTS], [[0.0; POINTS]; 3]);
        Self { n_v: one, shares: [one; 2], mirrored_dir: three, diffuse: three, mirrored: three, radiance: three }
    }
}

impl Strip {
    /// Finds what each point of a surface of `matter` shows of `sky` and of light from everywhere.
    pub(crate) fn look_around(&mut self, matter: &Matter, sky: &Sky, ambient: Vec3) {
        let (found, to, points) = (&self.found, &mut self.surroundings, padded(self.count));
        self.level.run(Look { found, to, points, matter, sky, ambient });
    }

    /// The rays of the points, and what they show.
    pub(crate) fn shown(&self) -> impl Iterator<Item = (u32, Vec3)> {
        let (found, surroundings) = (&self.found, &self.surroundings);
        let certain = (0..self.count.min(POINTS)).filter(|&i| found.certain[i] == 1);
        certain.map(|i| (self.rays[i], get(&surroundings.radiance, i)))
    }
}

struct Look<'a> {
    found: &'a Found,
    to: &'a mut Surroundings,
    points: usize,
    matter: &'a Matter,
    sky: &'a Sky,
    ambient: Vec3,
}

impl Kernel for Look<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { found, to, points, matter, sky, ambient } = self;
        let (points, emission) = (points.min(POINTS), matter.emission);
        match &matter.model {
            Model::Unlit(color) => (0..points).for_each(|i| put(&mut to.radiance, i, emission + *color)),
            Model::Phong(m) => {
                spread(sky, &found.normal, points, &mut to.diffuse);
                for i in 0..points {
                    let radiance = emission + (m.ambient * ambient + m.diffuse * get(&to.diffuse, i));
                    put(&mut to.radiance, i, radiance);
                }
            }
            Model::MetalRough(m) => look(&m.in_the_open(), found, to, points, sky, ambient, emission),
        }
    }
}

#[inline(always)]
fn look(
    m: &MetalRoughMatter,
    found: &Found,
    to: &mut Surroundings,
    points: usize,
    sky: &Sky,
    ambient: Vec3,
    emission: Vec3,
) {
    let (row, rebound) = m.shares();
    for i in 0..points.min(POINTS) {
        let seen = found.seen(i);
        to.n_v[i] = seen.normal.dot(seen.view).clamp(0.0, 1.0);
        put(&mut to.mirrored_dir, i, seen.mirrored());
    }
    for i in 0..points.min(POINTS) {
        (to.shares[0][i], to.shares[1][i]) = row.at(to.n_v[i]);
    }
    spread(sky, &found.normal, points, &mut to.diffuse);
    blur(sky, m.roughness(), &to.mirrored_dir, points, &mut to.mirrored);
    for i in 0..points.min(POINTS) {
        let around = Around {
            n_v: to.n_v[i],
            shares: (to.shares[0][i], to.shares[1][i]),
            diffuse: get(&to.diffuse, i) + ambient,
            mirrored: get(&to.mirrored, i) + ambient,
            open: 1.0,
            // Nothing that light can enter is shaded here.
            outside: true,
        };
        put(&mut to.radiance, i, emission + m.around(&around, rebound).0);
    }
}

/// Mean light over the hemispheres around these normals.
#[inline(always)]
fn spread(sky: &Sky, normals: &Columns, points: usize, to: &mut Columns) {
    match sky.studio() {
        Some(UpAxis::Y) => {
            for i in 0..points.min(POINTS) {
                put(to, i, studio::diffuse(studio::from_world(UpAxis::Y, get(normals, i))));
            }
        }
        Some(UpAxis::Z) => {
            for i in 0..points.min(POINTS) {
                put(to, i, studio::diffuse(studio::from_world(UpAxis::Z, get(normals, i))));
            }
        }
        None => (0..points.min(POINTS)).for_each(|i| put(to, i, sky.diffuse(Vec3::Z))),
    }
}

/// Mean light around these mirrored directions.
#[inline(always)]
fn blur(sky: &Sky, roughness: f32, dirs: &Columns, points: usize, to: &mut Columns) {
    match sky.studio() {
        Some(UpAxis::Y) => {
            for i in 0..points.min(POINTS) {
                put(to, i, studio::blurred(studio::from_world(UpAxis::Y, get(dirs, i)), roughness));
            }
        }
        Some(UpAxis::Z) => {
            for i in 0..points.min(POINTS) {
                put(to, i, studio::blurred(studio::from_world(UpAxis::Z, get(dirs, i)), roughness));
            }
        }
        None => (0..points.min(POINTS)).for_each(|i| put(to, i, sky.blurred(Vec3::Z, roughness))),
    }
}
