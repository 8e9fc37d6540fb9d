//! Russian roulette: in pixels that need many samples, branches of little weight and shadow rays of little light go on at random,
//! and the survivors carry the weight of all.

use super::draws::{Draws, Purpose, Stream};
use super::sampling::Stochastic;
use super::sobol::mix;
use super::wave::Path;
use crate::math::Vec3;

/// Roulette for the samples of a round: J. Arvo, D. Kirk, *Particle Transport and Image Synthesis* (1990).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Roulette {
    /// Branches of at least this weight always go on; of half this weight, half of them.
    least: f32,
}

impl Roulette {
    /// Roulette in pixels that are still uncertain after `samples` samples.
    ///
    /// A branch of weight w that goes on with probability w ÷ τ adds up to w τ to the variance of a sample, if its light is 1 at
    /// most. With τ proportional to the samples of the pixel, and to the square of its allowed error, that is the same small part
    /// of the variance allowed for its mean, however many samples that takes.
    pub(super) fn after(samples: u32, how: &Stochastic) -> Self {
        /// Fraction of the squared error, for each sample: the mean squared error of two pictures with glass grew by 1.0 % and
        /// 1.3 %; with a fraction of 2, that of three pictures by 2.6 to 5.8 %.
        const PART: f32 = 0.75;
        /// Upper limit, so that light far above 1 is not carried by a few branches.
        const MOST: f32 = 0.125;
        Self { least: (PART * how.error * how.error * samples as f32).min(MOST) }
    }

    /// Whether a branch goes on; if so, its path gets the weight that it carries. Straight paths always go on: for a sample that
    /// shows no background, it would be unknown whether something solid or glass stood before it.
    #[inline(always)]
    pub(super) fn spin(self, streams: &[Stream], sample: u32, path: &mut Path) -> bool {
        self.least == 0.0 || path.straight || self.decide(streams, sample, path)
    }

    /// Whether any branch may end at random.
    #[inline(always)]
    pub(super) fn is_at_work(self) -> bool {
        self.least > 0.0
    }

    /// Whether a shadow ray is sent; if so, `radiance` becomes what it carries. The ray goes to light `number` from a point of
    /// this branch.
    #[inline(always)]
    pub(super) fn sends(self, streams: &[Stream], sample: u32, path: &Path, number: u32, radiance: &mut Vec3) -> bool {
        let least = self.least * path.part;
        survives(radiance, least, streams.get(sample as usize), mix(path.branch, number), Purpose::ShadowQueue)
    }

    fn decide(self, streams: &[Stream], sample: u32, path: &mut Path) -> bool {
        let least = self.least * path.part;
        survives(&mut path.weight, least, streams.get(sample as usize), path.branch, Purpose::Roulette)
    }
}

/// Whether `value` survives: from `least` on always; below it with probability `value` / `least`, and then scaled up to `least`,
/// largest channels counting. Without a stream it always survives, unchanged.
#[inline(always)]
fn survives(value: &mut Vec3, least: f32, stream: Option<&Stream>, branch: u32, purpose: Purpose) -> bool {
    let most = value.max_element();
    if most >= least {
        return true;
    }
    let Some(&stream) = stream else { return true };
    let [drawn, _] = Draws::of(stream, branch, purpose).spread(1).point(0);
    let chance = most / least;
    *value *= 1.0 / chance;
    drawn < chance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::media::Media;

    fn path(weight: f32, branch: u32) -> Path {
        let weight = Vec3::new(weight, 0.5 * weight, 0.0);
        Path { weight, branch, straight: false, ..Path::from_eye(0.0, 0.0, Media::OUTSIDE) }
    }

    #[test]
    fn branches_carry_on_average_what_they_did() {
        let streams: Vec<Stream> = (0..1024).map(|index| Stream { key: 3, index }).collect();
        let roulette = Roulette { least: 0.125 };
        for (weight, branch) in [(0.1, 0), (0.06, 9), (0.01, 77), (0.004, 8)] {
            let spin = |sample| {
                let mut path = path(weight, branch);
                roulette.spin(&streams, sample, &mut path).then_some(path.weight)
            };
            let weights: Vec<Vec3> = (0..1024).filter_map(spin).collect();
            assert!(weights.iter().all(|w| (*w - Vec3::new(0.125, 0.0625, 0.0)).length() < 1e-6), "{weight}");
            let mean = weights.iter().sum::<Vec3>() / 1024.0;
            assert!((mean.x - weight).abs() < 1e-3 * weight.max(0.13), "{weight}: {mean}");
        }
    }

    #[test]
    fn shadow_rays_carry_on_average_what_all_of_them_would() {
        let streams: Vec<Stream> = (0..1024).map(|index| Stream { key: 3, index }).collect();
        let roulette = Roulette { least: 0.125 };
        for (light, number) in [(0.1, 0), (0.06, 9), (0.01, 7 << 16), (0.2, 1)] {
            let sends = |sample| {
                let mut radiance = Vec3::new(light, 0.5 * light, 0.0);
                roulette.sends(&streams, sample, &path(1.0, 5), number, &mut radiance).then_some(radiance)
            };
            let sent: Vec<Vec3> = (0..1024).filter_map(sends).collect();
            let carried = light.max(0.125);
            assert!(sent.iter().all(|w| (*w - Vec3::new(carried, 0.5 * carried, 0.0)).length() < 1e-6), "{light}");
            let mean = sent.iter().sum::<Vec3>() / 1024.0;
            assert!((mean.x - light).abs() < 1e-3 * carried, "{light}: {mean}");
        }
        // Rays of one spread are judged together, and lights separately.
        let sends = |part, number, sample| {
            let path = Path { part, ..path(1.0, 5) };
            roulette.sends(&streams, sample, &path, number, &mut Vec3::splat(0.05))
        };
        assert!((0..100).all(|sample| sends(0.4, 0, sample)));
        let differ = (0..1024).filter(|&sample| sends(1.0, 0, sample) != sends(1.0, 1, sample)).count();
        assert!(differ > 300, "{differ}");
    }

    #[test]
    fn branches_of_weight_and_samples_without_a_stream_all_go_on() {
        let stream = [Stream { key: 3, index: 5 }];
        let goes_on = |least, part, streams: &[Stream], weight| {
            let path = Path { part, ..path(weight, 1) };
            let mut on = path;
            Roulette { least }.spin(streams, 0, &mut on) && on.weight == path.weight
        };
        assert!((0..100).all(|k| goes_on(0.125, 1.0, &stream, 0.125 + 0.01 * k as f32)));
        assert!((0..100).all(|k| goes_on(0.125, 0.25, &stream, 0.03125 + 0.01 * k as f32)), "a quarter of a spread");
        assert!(goes_on(0.0, 1.0, &stream, 1e-6));
        assert!(goes_on(0.125, 1.0, &[], 1e-6));
        let mut straight = Path { straight: true, ..path(1e-6, 1) };
        assert!(Roulette { least: 0.125 }.spin(&stream, 0, &mut straight) && straight.weight.x == 1e-6);
    }

    #[test]
    fn chance_decides_more_the_more_samples_a_pixel_has_and_the_more_it_may_err() {
        let least = |samples, error| Roulette::after(samples, &Stochastic { error, ..Stochastic::default() }).least;
        assert_eq!(least(0, 0.25), 0.0);
        assert!(least(4, 0.08) < least(8, 0.08) && least(8, 0.04) < least(8, 0.08));
        assert_eq!(least(1 << 20, 0.25), 0.125);
    }
}
