//! Radiance of the environment for many rays that miss the scene, as columns (structure of arrays).

use super::{Sky, WIDE};
use crate::math::Vec3;
use crate::math::simd::{Kernel, Level, Simd};
use crate::render::studio;
use crate::scene::UpAxis;

/// Number of rays that are looked up together.
const RAYS: usize = 32;

/// Directions of rays, of any length, and the radiance along them.
struct RayBatch {
    count: usize,
    /// Index of each ray.
    rays: [u32; RAYS],
    dir: [[f32; RAYS]; 3],
    /// Radiance, the same in red, green and blue: the room is grey.
    radiance: [f32; RAYS],
}

impl Sky {
    /// Passes the radiance along each direction to `tell`, with the ray's number, as [`Self::radiance`] has it; cones are given
    /// as radians across. The order is not that of the rays.
    pub(crate) fn each_radiance(&self, rays: impl Iterator<Item = (u32, Vec3, f32)>, mut tell: impl FnMut(u32, Vec3)) {
        let (mut looks, studio) = (RayBatch::NONE, self.studio());
        for (ray, dir, angle) in rays {
            match studio {
                Some(up) if angle <= WIDE => {
                    looks.add(ray, dir);
                    if looks.count == RAYS {
                        looks.tell::<false>(up, &mut tell);
                    }
                }
                _ => tell(ray, self.radiance(dir.try_normalize().unwrap_or(Vec3::Z), angle)),
            }
        }
        if let Some(up) = studio {
            looks.tell::<false>(up, &mut tell);
        }
    }

    /// Passes the background behind the eye rays with these numbers to `tell`, in order, as [`Self::behind`] has it; directions
    /// are given by axis, cones as radians across.
    pub(crate) fn each_behind(&self, rays: &[u32], dirs: [&[f32]; 3], angles: &[f32], mut tell: impl FnMut(u32, Vec3)) {
        let dir = |i: u32| Vec3::new(dirs[0][i as usize], dirs[1][i as usize], dirs[2][i as usize]);
        let Some(up) = self.studio() else {
            let behind = |i: u32| self.behind(dir(i).try_normalize().unwrap_or(Vec3::Z), angles[i as usize]);
            return rays.iter().for_each(|&i| tell(i, behind(i)));
        };
        let mut looks = RayBatch::NONE;
        for some in rays.chunks(RAYS) {
            // Where no surface is near, their numbers are consecutive.
            let run = match some {
                [first, .., last] if last.wrapping_sub(*first) == RAYS as u32 - 1 && some.len() == RAYS => {
                    looks.take(*first, dirs)
                }
                _ => None,
            };
            if run.is_none() {
                some.iter().for_each(|&i| looks.add(i, dir(i)));
            }
            looks.tell::<true>(up, &mut |ray, wall| tell(ray, self.toned(wall)));
        }
    }
}

impl RayBatch {
    /// No rays.
    const NONE: Self = Self { count: 0, rays: [0; RAYS], dir: [[0.0; RAYS]; 3], radiance: [0.0; RAYS] };

    /// Replaces all rays by [`RAYS`] consecutive ones from `first` on; `None` if there are fewer.
    fn take(&mut self, first: u32, dirs: [&[f32]; 3]) -> Option<()> {
        let row = |k: usize| dirs[k].get(first as usize..)?.first_chunk();
        self.dir = [*row(0)?, *row(1)?, *row(2)?];
        (first..).zip(&mut self.rays).for_each(|(ray, to)| *to = ray);
        self.count = RAYS;
        Some(())
    }

    fn add(&mut self, ray: u32, dir: Vec3) {
        let i = self.count % RAYS;
        self.rays[i] = ray;
        (self.dir[0][i], self.dir[1][i], self.dir[2][i]) = (dir.x, dir.y, dir.z);
        self.count += 1;
    }

    /// Passes the radiance of each ray to `tell`, and empties the batch: the background (`BEHIND`), or the whole room.
    fn tell<const BEHIND: bool>(&mut self, up: UpAxis, tell: &mut impl FnMut(u32, Vec3)) {
        Level::best().run(LookUpRays::<BEHIND> { looks: self, up });
        for i in 0..self.count.min(RAYS) {
            tell(self.rays[i], Vec3::splat(self.radiance[i]));
        }
        self.count = 0;
    }
}

struct LookUpRays<'a, const BEHIND: bool> {
    looks: &'a mut RayBatch,
    up: UpAxis,
}

impl<const BEHIND: bool> Kernel for LookUpRays<'_, BEHIND> {
    type Output = ();

    // The up axis is matched outside the loop, which is then branch-free.
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        match self.up {
            UpAxis::Y => look::<BEHIND>(self.looks, UpAxis::Y),
            UpAxis::Z => look::<BEHIND>(self.looks, UpAxis::Z),
        }
    }
}

#[inline(always)]
fn look<const BEHIND: bool>(looks: &mut RayBatch, up: UpAxis) {
    for i in 0..RAYS {
        let dir = Vec3::new(looks.dir[0][i], looks.dir[1][i], looks.dir[2][i]);
        let dir = dir.try_normalize().unwrap_or(Vec3::Z);
        let dir = studio::from_world(up, dir);
        looks.radiance[i] = if BEHIND { studio::backdrop(dir).x } else { studio::radiance(dir).x };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::scene::{Environment, Scene};

    #[test]
    fn rays_see_side_by_side_what_each_sees_alone() {
        let mut random = Random::new(6);
        for up in [UpAxis::Y, UpAxis::Z] {
            for environment in [Environment::Studio, Environment::Constant(Vec3::splat(0.3))] {
                let sky = Sky::new(&Scene { environment, up, ..Scene::default() });
                // Some cones so wide that they are blurred, and one ray without a direction.
                let mut rays: Vec<_> = (0..101).map(|i| (i, random.cube() * 3.0, i as f32 * 0.002)).collect();
                rays[40].1 = Vec3::ZERO;
                let mut seen = vec![None; rays.len()];
                sky.each_radiance(rays.iter().copied(), |ray, radiance| seen[ray as usize] = Some(radiance));
                let bits = |seen: Vec3| seen.to_array().map(f32::to_bits);
                let columns = [0, 1, 2].map(|k| rays.iter().map(|ray| ray.1[k]).collect::<Vec<_>>());
                let angles: Vec<_> = rays.iter().map(|ray| ray.2).collect();
                for numbers in [(0..101).collect(), (0..101).filter(|i| i % 50 != 7).collect::<Vec<u32>>()] {
                    let columns = columns.each_ref().map(|column| &column[..]);
                    let mut told = Vec::new();
                    sky.each_behind(&numbers, columns, &angles, |ray, seen| told.push((ray, bits(seen))));
                    let alone = numbers.iter().map(|&i| {
                        let (_, dir, angle) = rays[i as usize];
                        (i, bits(sky.behind(dir.try_normalize().unwrap_or(Vec3::Z), angle)))
                    });
                    assert_eq!(told, alone.collect::<Vec<_>>());
                }
                for ((_, dir, angle), seen) in rays.into_iter().zip(seen) {
                    let alone = sky.radiance(dir.try_normalize().unwrap_or(Vec3::Z), angle);
                    assert_eq!(seen.map(bits), Some(bits(alone)));
                }
            }
        }
    }
}
