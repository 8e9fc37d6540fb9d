//! The built-in studio: the radiance of rays that leave the scene when there is no other environment.
//!
//! A neutral room as photographers light small objects: a light dome that falls off to a darker floor and a dark backdrop, a
//! large soft box overhead in front, a strip to the left, a panel to the right and a rim light behind. Seen from the front, a
//! model stands before the backdrop, against which both dark and white objects are distinct. Everything is a closed form of
//! constant time, smooth, and known at every blur, so that rough metals see the same room as mirrors:
//!
//! - [`radiance`]: the room itself, for mirrors.
//! - [`backdrop`]: its walls without its lights, for the background: from whichever side a model is seen, it stands before
//!   the wall that is behind it from the front.
//! - [`blurred`]: the mean over the lobe of a roughness around a mirror direction.
//! - [`diffuse`]: the cosine-weighted mean over a hemisphere, from spherical harmonics up to band 4
//!   (Ramamoorthi, Hanrahan, *An Efficient Representation for Irradiance Environment Maps*, 2001).
//!
//! The room stands in a frame whose +Y is up and whose +Z is in front, where glTF models look; [`from_world`] turns
//! directions of scenes with another up axis into it. It does not follow the camera: the default lights do.

use crate::math::Vec3;
use crate::scene::UpAxis;

/// Turns a world direction of a scene with up axis `up` into the studio's frame.
#[inline(always)]
pub fn from_world(up: UpAxis, dir: Vec3) -> Vec3 {
    match up {
        UpAxis::Y => dir,
        UpAxis::Z => Vec3::new(dir.x, dir.z, -dir.y),
    }
}

/// The inverse of [`from_world`].
#[inline]
pub fn to_world(up: UpAxis, dir: Vec3) -> Vec3 {
    match up {
        UpAxis::Y => dir,
        UpAxis::Z => Vec3::new(dir.x, -dir.z, dir.y),
    }
}

/// Linear radiance seen along the unit vector `dir` of the studio's frame.
#[inline(always)]
pub fn radiance(dir: Vec3) -> Vec3 {
    Vec3::splat(room(dir, 0.0))
}

/// Linear radiance of the background behind a model, seen along the unit vector `dir`.
#[inline(always)]
pub fn backdrop(dir: Vec3) -> Vec3 {
    let dome = (HORIZON + (ZENITH - HORIZON) * dir.y) * (1.0 - BACKDROP);
    let Fraction { over, under } = step(dir.y, FLOOR_EDGE * FLOOR_EDGE);
    Vec3::splat(NADIR + (dome - NADIR) * (over / under))
}

/// Mean radiance around the unit mirror direction `dir` for a perceptual roughness of 0 (just [`radiance`]) … 1.
#[inline(always)]
pub fn blurred(dir: Vec3, roughness: f32) -> Vec3 {
    let alpha = roughness.clamp(0.0, 1.0) * roughness.clamp(0.0, 1.0);
    let sharp = room(dir, alpha);
    // The widest lobes reach over a hemisphere, which the boxes' flat coordinates cannot follow.
    Vec3::splat(sharp + (mean_over_hemisphere(dir) - sharp) * (alpha * WIDEST_IS_DIFFUSE))
}

/// Cosine-weighted mean radiance over the hemisphere around the unit vector `normal`: irradiance / π.
#[inline(always)]
pub fn diffuse(normal: Vec3) -> Vec3 {
    Vec3::splat(mean_over_hemisphere(normal))
}

/// Share of the diffuse mean in the lobe of roughness 1.
const WIDEST_IS_DIFFUSE: f32 = 0.75;

/// Spread (in direction cosines) that a lobe of width `alpha` adds to every edge of the room.
const SPREAD_PER_ALPHA: f32 = 0.9;

/// Radiance of the dome overhead, at the horizon, and of the floor below.
const ZENITH: f32 = 0.32;
const HORIZON: f32 = 0.29;
const NADIR: f32 = 0.10;

/// Share of the dome's light that the backdrop behind the model absorbs, the position of its edge along −z, and the softness of
/// that edge (both in direction cosines).
const BACKDROP: f32 = 0.6;
const BACKDROP_FROM: f32 = 0.2;
const BACKDROP_EDGE: f32 = 0.45;

/// Softness (in direction cosines) of the line between wall and floor.
const FLOOR_EDGE: f32 = 0.22;

/// One number for each rectangular light.
type Four = [f32; 4];

/// The rectangular lights: key overhead in front, left strip, right panel, rim behind.
///
/// Their flat coordinates are direction cosines along `right` and `up`, which with `toward` are perpendicular unit vectors. They
/// are stored as rows of plain numbers so that the formulas vectorise: over the four lights of one point, or over many points.
struct SoftBoxes {
    toward: [Four; 3],
    right: [Four; 3],
    up: [Four; 3],
    /// Half the side lengths.
    half: [Four; 2],
    /// Squared softness of the edges.
    edge_squared: Four,
    /// Radiance added in the middle of each light.
    radiance: Four,
}

const BOXES: SoftBoxes = SoftBoxes {
    toward: [
        [-0.339_151_1, -0.943_698_3, 0.895_972_1, 0.370_053_23],
        [0.775_202_5, 0.218_540_65, 0.289_023_25, 0.666_095_85],
        [0.532_951_7, 0.248_341_65, 0.337_193_8, -0.647_593_2],
    ],
    right: [
        [0.843_661_5, 0.254_493_3, 0.352_226_05, -0.868_243_16],
        [0.0; 4],
        [0.536_875_5, 0.967_074_5, -0.935_914_93, -0.496_138_93],
    ],
    up: [
        [0.416_187_23, 0.211_345_09, -0.270_501_17, -0.330_476_08],
        [0.631_712_8, 0.975_827_9, 0.957_322_06, 0.745_866_2],
        [-0.654_008_5, -0.055_617_13, -0.101_801_515, 0.578_333_14],
    ],
    half: [[0.36, 0.11, 0.24, 0.38], [0.26, 0.42, 0.34, 0.18]],
    edge_squared: [0.05 * 0.05, 0.05 * 0.05, 0.06 * 0.06, 0.06 * 0.06],
    radiance: [2.1, 1.3, 0.9, 1.5],
};

impl SoftBoxes {
    /// Light of the boxes along `dir`, with every edge softened by a further `blur`.
    #[inline(always)]
    fn along(&self, dir: Vec3, blur: f32) -> Fraction {
        let mut lights = [Fraction { over: 0.0, under: 1.0 }; 4];
        for (k, light) in lights.iter_mut().enumerate() {
            let cosine = |axis: &[Four; 3]| dir.x * axis[0][k] + dir.y * axis[1][k] + dir.z * axis[2][k];
            let edge_squared = self.edge_squared[k] + blur * blur;
            // The flat coordinates also show the back of the room, mirrored: fade it out at 90° from the light.
            let front = step(cosine(&self.toward), edge_squared.max(0.01));
            let across = slab(cosine(&self.right), self.half[0][k], edge_squared);
            let along = slab(cosine(&self.up), self.half[1][k], edge_squared);
            let Fraction { over, under } = front.times(across).times(along);
            *light = Fraction { over: self.radiance[k] * over, under };
        }
        let [key, strip, panel, rim] = lights;
        key.plus(strip).plus(panel.plus(rim))
    }
}

/// Radiance of the room along `dir`, blurred by a lobe of width `alpha`.
#[inline(always)]
fn room(dir: Vec3, alpha: f32) -> f32 {
    let blur = SPREAD_PER_ALPHA * alpha;
    // Walls brighten slowly towards the ceiling; the floor and the wall behind are darker.
    let soft = |edge: f32| edge * edge + blur * blur;
    let behind = step(-dir.z - BACKDROP_FROM, soft(BACKDROP_EDGE));
    let left = behind.under - BACKDROP * behind.over;
    let dome = (HORIZON + (ZENITH - HORIZON) * dir.y) * left;
    let brighter = Fraction { over: dome - NADIR * behind.under, under: behind.under };
    let above = step(dir.y, soft(FLOOR_EDGE));
    let Fraction { over, under } = brighter.times(above).plus(BOXES.along(dir, blur));
    NADIR + over / under
}

/// An undivided quotient: the room is a sum of products of them, and one division serves all. The denominator lies between 10⁻²⁶
/// and 10⁵ for unit vectors and widths up to one.
#[derive(Clone, Copy)]
struct Fraction {
    over: f32,
    under: f32,
}

impl Fraction {
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self { over: self.over * other.over, under: self.under * other.under }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self { over: self.over * other.under + other.over * self.under, under: self.under * other.under }
    }
}

/// Smooth step from 0 to 1 at `x` = 0: ½ + ½ x/√(w²+x²) for the width w; its slow tails are like those of a rough lobe.
#[inline(always)]
fn step(x: f32, width_squared: f32) -> Fraction {
    let root = (width_squared + x * x).sqrt();
    Fraction { over: 0.5 * (root + x), under: root }
}

/// 1 for |x| < `half`, with smooth edges: the difference of two steps; its integral over x is 2·`half` for every width.
#[inline(always)]
fn slab(x: f32, half: f32, width_squared: f32) -> Fraction {
    let (left, right) = (x + half, x - half);
    let (left_root, right_root) = ((width_squared + left * left).sqrt(), (width_squared + right * right).sqrt());
    Fraction { over: 0.5 * (left * right_root - right * left_root), under: left_root * right_root }
}

/// Number of harmonics: bands 0, 1, 2 and 4 (the cosine has no band 3).
const HARMONICS: usize = 18;

/// Projection of the room on the harmonics, times the cosine lobe's factor for each band over π.
#[rustfmt::skip]
const COEFFICIENTS: [f32; HARMONICS] = [
    1.093_023_9, -0.025_455_615, 0.459_331_72, 0.170_484_75, -0.019_574_279, 0.068_199_165,
    -0.048_870_8, -0.037_492_935, -0.013_074_075, -0.006_327_793, -0.001_348_326_4, -0.000_690_833_1,
    0.008_232_776, 0.009_047_925, -0.003_520_728, 0.012_737_049, -0.018_062_811, 0.000_272_510_52,
];

#[inline(always)]
fn mean_over_hemisphere(normal: Vec3) -> f32 {
    // Three sums that do not depend on each other.
    let harmonics = harmonics(normal);
    let every_third = |first: usize| (first..HARMONICS).step_by(3).map(|i| harmonics[i] * COEFFICIENTS[i]).sum::<f32>();
    (every_third(0) + every_third(1) + every_third(2)).max(0.0)
}

/// Real spherical harmonics of bands 0, 1, 2 and 4 at a unit vector.
#[inline(always)]
#[expect(clippy::excessive_precision, reason = "square roots of rationals over π, as tables give them")]
fn harmonics(d: Vec3) -> [f32; HARMONICS] {
    let Vec3 { x, y, z } = d;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        0.282_094_79,
        0.488_602_51 * x,
        0.488_602_51 * y,
        0.488_602_51 * z,
        1.092_548_43 * x * y,
        1.092_548_43 * y * z,
        1.092_548_43 * x * z,
        0.315_391_57 * (3.0 * zz - 1.0),
        0.546_274_22 * (xx - yy),
        2.503_342_94 * x * y * (xx - yy),
        1.770_130_77 * y * z * (3.0 * xx - yy),
        0.946_174_70 * x * y * (7.0 * zz - 1.0),
        0.669_046_54 * y * z * (7.0 * zz - 3.0),
        0.105_785_55 * (35.0 * zz * zz - 30.0 * zz + 3.0),
        0.669_046_54 * x * z * (7.0 * zz - 3.0),
        0.473_087_35 * (xx - yy) * (7.0 * zz - 1.0),
        1.770_130_77 * x * z * (xx - 3.0 * yy),
        0.625_835_74 * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cuts the sphere into `rows × 2·rows` cells: the middle of each and its solid angle.
    fn directions(rows: u32) -> impl Iterator<Item = (Vec3, f64)> {
        use std::f64::consts::PI;
        let step = PI / f64::from(rows);
        (0..rows).flat_map(move |i| {
            // The exact area of a ring, at the direction in its middle.
            let (top, polar) = (step * f64::from(i), step * (f64::from(i) + 0.5));
            let ring = libm::cos(top) - libm::cos(top + step);
            (0..2 * rows).map(move |j| {
                let azimuth = step * (f64::from(j) + 0.5);
                let (sin, cos) = (libm::sin(polar), libm::cos(polar));
                let dir = Vec3::new(narrow(sin * libm::cos(azimuth)), narrow(cos), narrow(sin * libm::sin(azimuth)));
                (dir, ring * step)
            })
        })
    }

    #[expect(clippy::cast_possible_truncation, reason = "pixels are f32")]
    fn narrow(x: f64) -> f32 {
        x as f32
    }

    /// Factors of the cosine lobe over π for bands 0, 1, 2, 4, by harmonic.
    fn lobe_factor(i: usize) -> f64 {
        let band = [1, 4, 9].iter().filter(|&&first| i >= first).count();
        [1.0, 2.0 / 3.0, 0.25, -1.0 / 24.0][band]
    }

    #[test]
    fn the_tabulated_room_is_the_projection_of_the_room() {
        let mut sums = [0.0f64; HARMONICS];
        for (dir, solid_angle) in directions(96) {
            let light = f64::from(room(dir, 0.0)) * solid_angle;
            for (sum, harmonic) in sums.iter_mut().zip(harmonics(dir)) {
                *sum += f64::from(harmonic) * light;
            }
        }
        for (i, (sum, tabulated)) in sums.iter().zip(COEFFICIENTS).enumerate() {
            assert!((sum * lobe_factor(i) - f64::from(tabulated)).abs() < 1e-6, "{i}: {sum} {tabulated}");
        }
    }

    #[test]
    fn every_soft_box_hangs_straight_and_faces_the_middle() {
        let places = [(-0.35, 0.80, 0.55), (-0.95, 0.22, 0.25), (0.93, 0.30, 0.35), (0.40, 0.72, -0.70)];
        let axis = |rows: &[Four; 3], lane: usize| Vec3::from_array(rows.map(|row| row[lane]));
        for (lane, place) in places.into_iter().enumerate() {
            let toward = Vec3::from(place).normalize();
            let right = Vec3::Y.cross(toward).normalize();
            let expected = [toward, right, toward.cross(right)];
            for (rows, expected) in [BOXES.toward, BOXES.right, BOXES.up].iter().zip(expected) {
                assert!((axis(rows, lane) - expected).length() < 1e-6, "{lane}: {expected}");
            }
        }
    }

    /// A few dozen directions spread over the sphere.
    fn probes() -> impl Iterator<Item = Vec3> {
        directions(6).map(|(dir, _)| dir)
    }

    /// Mean of the room, weighted by a function of the direction.
    fn mean(rows: u32, weight: impl Fn(Vec3) -> f64) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for (dir, solid_angle) in directions(rows) {
            let w = weight(dir) * solid_angle;
            sum += w * f64::from(radiance(dir).x);
            total += w;
        }
        sum / total
    }

    #[test]
    fn the_harmonics_are_orthonormal() {
        let mut products = [[0.0f64; HARMONICS]; HARMONICS];
        for (dir, solid_angle) in directions(64) {
            let h = harmonics(dir);
            for i in 0..HARMONICS {
                for j in 0..HARMONICS {
                    products[i][j] += f64::from(h[i]) * f64::from(h[j]) * solid_angle;
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-2, "{i} {j}: {product}");
            }
        }
    }

    #[test]
    fn diffuse_is_the_cosine_weighted_mean_of_the_room() {
        let mut sum = 0.0;
        for normal in probes() {
            let integral = mean(128, |dir| f64::from(dir.dot(normal)).max(0.0));
            let formula = f64::from(diffuse(normal).x);
            let error = (formula / integral - 1.0).abs();
            assert!(error < 0.03, "{normal}: {formula} for {integral}");
            sum += error / 72.0;
        }
        assert!(sum < 0.01, "off by {sum} on average");
    }

    /// The lobe that image-based lighting filters with: GGX seen along its own normal, weighted by the cosine.
    fn lobe(mirror: Vec3, roughness: f32) -> impl Fn(Vec3) -> f64 {
        let alpha2 = f64::from(roughness).powi(4);
        move |dir| {
            let cos = f64::from(dir.dot(mirror)).max(0.0);
            let cos2_half = 0.5 * (1.0 + cos);
            let d = cos2_half * (alpha2 - 1.0) + 1.0;
            alpha2 / (d * d) * cos
        }
    }

    #[test]
    fn a_blurred_room_is_near_the_mean_over_a_rough_lobe() {
        for roughness in [0.3, 0.5, 0.7, 1.0] {
            let (mut worst, mut sum) = (0.0f64, 0.0);
            for mirror in probes() {
                let integral = mean(96, lobe(mirror, roughness));
                let error = (f64::from(blurred(mirror, roughness).x) / integral - 1.0).abs();
                worst = worst.max(error);
                sum += error / 72.0;
            }
            assert!(worst < 0.35 && sum < 0.10, "roughness {roughness}: off by {sum} on average, {worst} at worst");
        }
    }

    #[test]
    fn no_roughness_is_no_blur() {
        for dir in probes() {
            assert_eq!(blurred(dir, 0.0), radiance(dir));
        }
    }

    #[test]
    fn blurring_keeps_the_room_as_bright_as_it_is() {
        let whole = mean(64, |_| 1.0);
        for roughness in [0.2, 0.4, 0.6, 0.8, 1.0] {
            let blurred: f64 = directions(64).map(|(d, a)| f64::from(blurred(d, roughness).x) * a).sum();
            let ratio = blurred / (4.0 * std::f64::consts::PI) / whole;
            assert!((ratio - 1.0).abs() < 0.08, "roughness {roughness}: {ratio}");
        }
    }

    #[test]
    fn the_room_is_never_black_and_a_mirror_sees_contrast_in_it() {
        let (mut lo, mut hi) = (f32::INFINITY, 0.0f32);
        for (dir, _) in directions(48) {
            let value = radiance(dir).x;
            (lo, hi) = (lo.min(value), hi.max(value));
        }
        assert!(lo > 0.05 && hi / lo > 10.0 && hi < 4.0, "{lo} … {hi}");
    }

    #[test]
    fn a_model_stands_before_the_same_wall_from_all_sides_without_lights_in_it() {
        for dir in probes() {
            let (turned, behind) = (Vec3::new(dir.z, dir.y, -dir.x), backdrop(dir).x);
            assert_eq!(backdrop(turned).x.to_bits(), behind.to_bits());
            assert!((NADIR..0.14).contains(&behind), "{dir}: {behind}");
        }
        // The wall behind the model from the front, below the lights.
        for down in [-0.3f32, -0.1, 0.0] {
            let dir = Vec3::new(0.0, down, -1.0).normalize();
            assert!((backdrop(dir).x / radiance(dir).x - 1.0).abs() < 0.2, "{down}");
        }
    }

    #[test]
    fn the_backdrop_is_darker_than_what_lights_the_front() {
        for tilt in [-0.3f32, 0.0, 0.3] {
            let backdrop = radiance(Vec3::new(0.0, tilt, -1.0).normalize()).x;
            assert!(diffuse(Vec3::Z).x > 2.0 * backdrop, "{tilt}: {backdrop}");
        }
    }

    #[test]
    fn white_paint_stays_below_white_in_the_room_alone() {
        for normal in probes() {
            let value = diffuse(normal).x;
            assert!((0.1..0.65).contains(&value), "{normal}: {value}");
        }
    }

    #[test]
    fn up_is_bright_whichever_axis_is_up() {
        assert_eq!(from_world(UpAxis::Z, Vec3::Z), Vec3::Y);
        let dir = Vec3::new(1.0, 2.0, 3.0);
        assert_eq!(to_world(UpAxis::Z, from_world(UpAxis::Z, dir)), dir);
        // A Z-up model looks along −y; the studio's front is +z.
        assert_eq!(from_world(UpAxis::Z, Vec3::NEG_Y), Vec3::Z);
        assert!(diffuse(Vec3::Y).x > 2.0 * diffuse(Vec3::NEG_Y).x);
    }
}
