//! What rays that meet nothing see of the studio, side by side: one number of all rays, then the next.

use super::{Sky, WIDE};
use crate::math::Vec3;
use crate::math::simd::{Kernel, Level, Simd};
use crate::render::studio;
use crate::scene::UpAxis;

/// Rays that look at it together.
const RAYS: usize = 32;

/// Directions of rays, of any length, and what is seen along them.
struct Looks {
    count: usize,
    /// What each is known by.
    rays: [u32; RAYS],
    dir: [[f32; RAYS]; 3],
    /// Red, green and blue alike: the room is grey.
    radiance: [f32; RAYS],
}

impl Sky {
    /// Tells what is seen along each of these directions by rays whose cones are so many radians across, as [`Self::radiance`]
    /// does; a ray is known by its number. Not in their order.
    pub(crate) fn each_radiance(&self, rays: impl Iterator<Item = (u32, Vec3, f32)>, mut tell: impl FnMut(u32, Vec3)) {
        let (mut looks, studio) = (Looks::NONE, self.studio());
        for (ray, dir, angle) in rays {
            match studio {
                Some(up) if angle <= WIDE => {
                    looks.add(ray, dir);
                    if looks.count == RAYS {
                        looks.tell(up, &mut tell);
                    }
                }
                _ => tell(ray, self.radiance(dir.try_normalize().unwrap_or(Vec3::Z), angle)),
            }
        }
        if let Some(up) = studio {
            looks.tell(up, &mut tell);
        }
    }

    /// The same for some of many rays, by their numbers in order; directions by axis, and how wide each cone is.
    pub(crate) fn each_radiance_of(
        &self,
        rays: &[u32],
        (dirs, angles): ([&[f32]; 3], &[f32]),
        mut tell: impl FnMut(u32, Vec3),
    ) {
        let dir = |i: usize| Vec3::new(dirs[0][i], dirs[1][i], dirs[2][i]);
        let mut looks = Looks::NONE;
        for some in rays.chunks(RAYS) {
            // Where nothing is near, their numbers follow each other.
            let run = match (self.studio(), some) {
                (Some(up), [first, .., last]) if last.wrapping_sub(*first) == RAYS as u32 - 1 && some.len() == RAYS => {
                    let sharp = angles[*first as usize..=*last as usize].iter().all(|&angle| angle <= WIDE);
                    sharp.then(|| looks.take(*first, dirs)).flatten().map(|()| up)
                }
                _ => None,
            };
            match run {
                Some(up) => looks.tell(up, &mut tell),
                None => self.each_radiance(some.iter().map(|&i| (i, dir(i as usize), angles[i as usize])), &mut tell),
            }
        }
    }
}

impl Looks {
    /// Nothing.
    const NONE: Self = Self { count: 0, rays: [0; RAYS], dir: [[0.0; RAYS]; 3], radiance: [0.0; RAYS] };

    /// Takes rays that follow each other from `first` on, if so many are there, instead of all others.
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

    fn tell(&mut self, up: UpAxis, tell: &mut impl FnMut(u32, Vec3)) {
        Level::best().run(Look { looks: self, up });
        for i in 0..self.count.min(RAYS) {
            tell(self.rays[i], Vec3::splat(self.radiance[i]));
        }
        self.count = 0;
    }
}

struct Look<'a> {
    looks: &'a mut Looks,
    up: UpAxis,
}

impl Kernel for Look<'_> {
    type Output = ();

    // The up axis is asked outside the loop, which then is a formula.
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        match self.up {
            UpAxis::Y => look(self.looks, UpAxis::Y),
            UpAxis::Z => look(self.looks, UpAxis::Z),
        }
    }
}

#[inline(always)]
fn look(looks: &mut Looks, up: UpAxis) {
    for i in 0..RAYS {
        let dir = Vec3::new(looks.dir[0][i], looks.dir[1][i], looks.dir[2][i]);
        let dir = dir.try_normalize().unwrap_or(Vec3::Z);
        looks.radiance[i] = studio::radiance(studio::from_world(up, dir)).x;
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
                // Some so wide that they are blurred, and one without a direction.
                let mut rays: Vec<_> = (0..101).map(|i| (i, random.cube() * 3.0, i as f32 * 0.002)).collect();
                rays[40].1 = Vec3::ZERO;
                let mut seen = vec![None; rays.len()];
                sky.each_radiance(rays.iter().copied(), |ray, radiance| seen[ray as usize] = Some(radiance));
                let columns = [0, 1, 2].map(|k| rays.iter().map(|ray| ray.1[k]).collect::<Vec<_>>());
                let angles: Vec<_> = rays.iter().map(|ray| ray.2).collect();
                for numbers in [(0..101).collect(), (0..101).filter(|i| i % 50 != 7).collect::<Vec<u32>>()] {
                    let mut in_columns = vec![None; rays.len()];
                    let columns = columns.each_ref().map(|column| &column[..]);
                    sky.each_radiance_of(&numbers, (columns, &angles), |ray, radiance| {
                        in_columns[ray as usize] = Some(radiance);
                    });
                    let expected = seen.iter().enumerate();
                    let expected = expected.map(|(i, seen)| seen.filter(|_| numbers.contains(&(i as u32))));
                    assert_eq!(in_columns, expected.collect::<Vec<_>>());
                }
                for ((_, dir, angle), seen) in rays.into_iter().zip(seen) {
                    let alone = sky.radiance(dir.try_normalize().unwrap_or(Vec3::Z), angle);
                    assert_eq!(seen.map(|v| v.to_array().map(f32::to_bits)), Some(alone.to_array().map(f32::to_bits)));
                }
            }
        }
    }
}
