//! Optics of a smooth boundary: reflection, refraction, the share of each, and the index as a function of the wavelength.
//!
//! Pure functions of directions and indices of refraction; they know nothing of surfaces. Indices by name are in
//! [`crate::scene::ior`]. Directions are unit vectors along the ray; `normal` is a unit vector turned against the incident
//! direction.

use crate::math::{DVec3, Vec3};

/// Mirror direction R = I − 2 (I·N) N; the side of the normal does not matter.
#[inline(always)]
pub fn reflect(incident: Vec3, normal: Vec3) -> Vec3 {
    incident - 2.0 * incident.dot(normal) * normal
}

/// Refracted direction T = η I + (η cos θi − cos θt) N with η = ηi/ηt; `None` under total internal reflection.
///
/// One of the founding texts writes the inverse ratio; Snell's law sin θi / sin θt = ηt / ηi fixes it. The sine comes
/// from |I × N| and everything is `f64`, because 1 − cos² loses half the digits near the critical angle.
pub fn refract(incident: Vec3, normal: Vec3, n_i: f64, n_t: f64) -> Option<Vec3> {
    let (i, n) = (unit(incident)?, unit(normal)?);
    let eta = n_i / n_t;
    let sin_t = eta * i.cross(n).length();
    // At equality the refracted ray would run in the surface and carry no energy: total reflection as well.
    if sin_t >= 1.0 {
        return None;
    }
    let cos_t = ((1.0 - sin_t) * (1.0 + sin_t)).sqrt();
    let cos_i = -i.dot(n);
    Some(unit_f32(eta * i + (eta * cos_i - cos_t) * n))
}

/// Share of unpolarised light that a smooth dielectric boundary reflects (Fresnel); 1 under total internal reflection.
///
/// `cos_i` is the cosine on the incident side, 0 … 1.
pub fn fresnel_dielectric(cos_i: f64, n_i: f64, n_t: f64) -> f64 {
    let cos_i = cos_i.clamp(0.0, 1.0);
    let sin_t = n_i / n_t * ((1.0 - cos_i) * (1.0 + cos_i)).sqrt();
    if sin_t >= 1.0 {
        return 1.0;
    }
    let cos_t = ((1.0 - sin_t) * (1.0 + sin_t)).sqrt();
    let across = (n_i * cos_i - n_t * cos_t) / (n_i * cos_i + n_t * cos_t);
    let along = (n_t * cos_i - n_i * cos_t) / (n_t * cos_i + n_i * cos_t);
    0.5 * (across * across + along * along)
}

/// Schlick's approximation of the Fresnel reflectance, "An Inexpensive BRDF Model for Physically-based Rendering" (1994), with a
/// given value at grazing angles.
#[inline(always)]
pub fn fresnel_schlick(f0: Vec3, f90: f32, cosine: f32) -> Vec3 {
    let m = (1.0 - cosine).clamp(0.0, 1.0);
    let m2 = m * m;
    f0 + (Vec3::splat(f90) - f0) * (m2 * m2 * m)
}

/// Share of light left after `length` in a medium with this absorption coefficient, 1 / unit of length: Beer's law.
#[inline(always)]
pub fn transmittance(absorption: Vec3, length: f32) -> Vec3 {
    let left = |coefficient: f32| libm::expf(-coefficient * length.max(0.0));
    Vec3::new(left(absorption.x), left(absorption.y), left(absorption.z))
}

/// Smallest angle of incidence, radians, with total reflection; `None` unless the second medium is the optically thinner one.
pub fn critical_angle(n_i: f64, n_t: f64) -> Option<f64> {
    (n_t < n_i).then(|| libm::asin(n_t / n_i))
}

/// Refractive index at a wavelength in nanometres: Cauchy's equation through `n_d` with the Abbe number 20 / `dispersion`, with
/// the constants of KHR_materials_dispersion; at least 1.
pub fn dispersed_index(n_d: f64, dispersion: f64, wavelength: f64) -> f64 {
    (n_d + (n_d - 1.0) * dispersion / 20.0 * (523_655.0 / (wavelength * wavelength) - 1.5168)).max(1.0)
}

fn unit(v: Vec3) -> Option<DVec3> {
    v.as_dvec3().try_normalize()
}

fn unit_f32(v: DVec3) -> Vec3 {
    v.normalize_or_zero().as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ior::by_name;

    /// Returns a ray that comes down at `degrees` from the normal +z.
    fn incoming(degrees: f64) -> Vec3 {
        let a = degrees.to_radians();
        DVec3::new(libm::sin(a), 0.0, -libm::cos(a)).as_vec3()
    }

    fn degrees_from(axis: Vec3, v: Vec3) -> f64 {
        let (a, v) = (axis.as_dvec3(), v.as_dvec3().normalize());
        libm::atan2(a.cross(v).length(), a.dot(v)).to_degrees()
    }

    #[test]
    fn critical_angles_come_out_to_the_minute() {
        let expected = [
            ("water", "air", 48, 46),
            ("crown glass", "air", 41, 9),
            ("crown glass", "water", 61, 3),
            ("diamond", "air", 24, 27),
            ("sapphire", "air", 34, 25),
        ];
        for (from, to, degrees, minutes) in expected {
            let (n_i, n_t) = (by_name(from).expect(from), by_name(to).expect(to));
            let angle = critical_angle(n_i, n_t).expect("denser to thinner").to_degrees();
            assert_eq!((angle * 60.0).round(), f64::from(degrees * 60 + minutes), "{from} to {to}: {angle}");
        }
        assert_eq!(critical_angle(1.0, 1.5), None);
    }

    #[test]
    fn a_mirror_turns_the_normal_part_only() {
        assert_eq!(reflect(Vec3::new(0.6, 0.0, -0.8), Vec3::Z), Vec3::new(0.6, 0.0, 0.8));
        assert_eq!(reflect(Vec3::new(0.6, 0.0, -0.8), Vec3::NEG_Z), Vec3::new(0.6, 0.0, 0.8));
    }

    #[test]
    fn light_entering_glass_bends_towards_the_normal() {
        let t = refract(incoming(45.0), Vec3::Z, 1.0, 1.5).expect("no total reflection from thin to dense");
        assert!((degrees_from(Vec3::NEG_Z, t) - 28.1255).abs() < 1e-4);
        assert!((t.length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn equal_indices_leave_the_direction() {
        let i = incoming(70.0);
        assert!((refract(i, Vec3::Z, 1.3, 1.3).expect("same medium") - i).length() < 1e-6);
    }

    #[test]
    fn total_reflection_begins_at_the_critical_angle() {
        for (n_i, n_t) in [(1.33, 1.00029), (2.417, 1.00029), (1.52, 1.33)] {
            let critical = critical_angle(n_i, n_t).expect("denser to thinner").to_degrees();
            assert!(refract(incoming(critical - 1e-4), Vec3::Z, n_i, n_t).is_some());
            assert!(refract(incoming(critical + 1e-4), Vec3::Z, n_i, n_t).is_none());
            assert_eq!(fresnel_dielectric(libm::cos((critical + 1e-4).to_radians()), n_i, n_t), 1.0);
        }
    }

    #[test]
    fn fresnel_has_its_textbook_values() {
        assert!((fresnel_dielectric(1.0, 1.0, 1.5) - 0.04).abs() < 1e-15);
        assert!((fresnel_dielectric(0.0, 1.0, 1.5) - 1.0).abs() < 1e-15);
        // At Brewster's angle only the polarisation across the plane of incidence is reflected: half of its reflectance remains.
        let brewster = libm::atan(1.5);
        let across = (1.0f64 - 2.25) / (1.0 + 2.25);
        assert!((fresnel_dielectric(libm::cos(brewster), 1.0, 1.5) - 0.5 * across * across).abs() < 1e-14);
    }

    #[test]
    fn fresnel_is_the_same_in_both_directions() {
        let cos_i = 0.6f64;
        let sin_t = 0.8 / 1.5f64;
        let cos_t = (1.0 - sin_t * sin_t).sqrt();
        let there = fresnel_dielectric(cos_i, 1.0, 1.5);
        assert!((there - fresnel_dielectric(cos_t, 1.5, 1.0)).abs() < 1e-14);
    }

    #[test]
    fn schlick_meets_both_ends() {
        let f0 = Vec3::new(0.04, 0.5, 1.0);
        assert_eq!(fresnel_schlick(f0, 0.9, 1.0), f0);
        assert_eq!(fresnel_schlick(f0, 0.9, 0.0), Vec3::splat(0.9));
    }

    #[test]
    fn blue_bends_more_than_red() {
        // Crown glass, Abbe number 64.2: n_F − n_C = (n_d − 1) / V.
        let at = |nm| dispersed_index(1.5168, 20.0 / 64.2, nm);
        assert!((at(587.56) - 1.5168).abs() < 1e-5);
        assert!((at(486.13) - at(656.27) - 0.5168 / 64.2).abs() < 1e-5);
        assert_eq!(dispersed_index(1.5, 0.0, 400.0), 1.5);
    }

    /// Angle in degrees from the antisolar point at which light leaves a drop that it entered at `impact` radii from the middle:
    /// refracted, reflected inside, refracted.
    fn rainbow_angle(impact: f32, n_air: f64, n_drop: f64) -> Option<f64> {
        let sunlight = Vec3::NEG_Z;
        let entry = Vec3::new(impact, 0.0, (1.0 - impact * impact).sqrt());
        let inside = refract(sunlight, entry, n_air, n_drop)?;
        // A chord of the unit sphere is as long as twice the cosine at its ends.
        let across = |from: Vec3, dir: Vec3| (from - 2.0 * from.dot(dir) * dir).normalize();
        let back = across(entry, inside);
        let reflected = reflect(inside, back);
        let exit = across(back, reflected);
        let out = refract(reflected, -exit, n_drop, n_air)?;
        Some(degrees_from(-sunlight, out))
    }

    #[test]
    fn a_drop_makes_a_rainbow_with_red_outside() {
        let (air, water) = (by_name("air").expect("air"), by_name("water").expect("water"));
        let brightest = |n: f64| {
            let angles = (1..2000).filter_map(|i| rainbow_angle(i as f32 / 2000.0, air, n));
            angles.fold(0.0, f64::max)
        };
        // R. Descartes, 1637: light concentrates where the angle 4 θt − 2 θi is stationary, at cos² θi = (n² − 1) / 3.
        let stationary = |n: f64| {
            let ratio = n / air;
            let theta_i = libm::acos(((ratio * ratio - 1.0) / 3.0).sqrt());
            (4.0 * libm::asin(libm::sin(theta_i) / ratio) - 2.0 * theta_i).to_degrees()
        };
        let (red, violet) = (dispersed_index(water, 20.0 / 55.8, 656.3), dispersed_index(water, 20.0 / 55.8, 404.7));
        for n in [red, water, violet] {
            assert!((brightest(n) - stationary(n)).abs() < 1e-3, "{n}: {} for {}", brightest(n), stationary(n));
        }
        assert!((42.0..43.0).contains(&brightest(red)), "{}", brightest(red));
        assert!((1.0..2.5).contains(&(brightest(red) - brightest(violet))), "{}", brightest(violet));
    }

    /// S11 (drop): a million parallel rays, spread evenly over the drop, for each of two wavelengths.
    #[test]
    fn the_light_of_a_drop_gathers_at_the_angles_of_the_primary_bow() {
        const RAYS: u32 = 1_000_000;
        const STEPS_PER_DEGREE: f64 = 10.0;
        for (n, angle) in [(1.331, 42.4), (1.344, 40.5)] {
            let mut found = [0u32; 900];
            for i in 0..RAYS {
                // Equal areas of the disc get equally many rays.
                let impact = ((f64::from(i) + 0.5) / f64::from(RAYS)).sqrt() as f32;
                let degrees = rainbow_angle(impact, 1.0, n).expect("light enters water and leaves it again");
                found[(degrees * STEPS_PER_DEGREE) as usize] += 1;
            }
            let peak = (0..found.len()).max_by_key(|&i| found[i]).expect("steps") as f64;
            assert!((peak + 0.5 - angle * STEPS_PER_DEGREE).abs() <= 1.0, "{n}: {} degrees", peak / STEPS_PER_DEGREE);
            let beyond = found[(angle * STEPS_PER_DEGREE) as usize + 2..].iter().sum::<u32>();
            assert_eq!(beyond, 0, "no light is sent beyond the bow: Alexander's band is dark");
        }
    }

    /// S8 (critical angle): whether η |I × N| / (|I| |N|) ≥ 1, in rational numbers, and the distance of its square from 1.
    fn exact_total_reflection(i: Vec3, n: Vec3, n_i: f64, n_t: f64) -> (bool, f64) {
        use crate::math::rational::{cross, dot, point};
        use dashu::rational::RBig;
        let (i, n) = (point(i), point(n));
        let ratio = RBig::try_from(n_i).expect("finite") / RBig::try_from(n_t).expect("finite");
        let c = cross(&i, &n);
        let square = &ratio * &ratio * dot(&c, &c) / (dot(&i, &i) * dot(&n, &n));
        let off = &square - RBig::ONE;
        (square >= RBig::ONE, off.to_f64().value().abs())
    }

    #[test]
    fn total_reflection_is_decided_as_exact_arithmetic_does_but_within_four_ulp_of_the_critical_angle() {
        let mut random = crate::math::random::Random::new(3);
        let (mut near, mut total) = (0, 0);
        for (n_i, n_t) in [(1.33, 1.00029), (2.417, 1.00029), (1.52, 1.33), (1.5, 1.0)] {
            let critical = critical_angle(n_i, n_t).expect("denser to thinner");
            for k in 3..=12 {
                for _ in 0..40 {
                    let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
                    let angle = critical * (1.0 + side * libm::pow(10.0, -f64::from(k)));
                    let turn = f64::from(random.unit()) * std::f64::consts::TAU;
                    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                    let normal = random.direction();
                    let (n, across) = (normal.as_dvec3(), normal.any_orthonormal_vector().as_dvec3());
                    let along = across * libm::cos(turn) + n.cross(across) * libm::sin(turn);
                    let incident = (along * sin - n * cos).as_vec3();
                    let (expected, off) = exact_total_reflection(incident, normal, n_i, n_t);
                    // The square of a sine that is 4 ulp off.
                    if off > 8.0 * f64::EPSILON {
                        assert_eq!(refract(incident, normal, n_i, n_t).is_none(), expected, "{n_i} {n_t} {off:e}");
                        near += usize::from(off < 1e-7);
                        total += usize::from(expected);
                    }
                }
            }
        }
        assert!(near > 300 && total > 300, "{near} near the angle, {total} reflected");
    }

    #[test]
    fn what_is_not_reflected_is_transmitted_and_more_is_reflected_at_a_flatter_angle() {
        for (n_i, n_t) in [(1.0, 1.5), (1.5, 1.0), (1.00029, 2.417), (1.33, 1.52)] {
            let mut last = 0.0;
            for step in 0..=1000 {
                let cos_i = 1.0 - f64::from(step) / 1000.0;
                let reflected = fresnel_dielectric(cos_i, n_i, n_t);
                let sin_t = n_i / n_t * ((1.0 - cos_i) * (1.0 + cos_i)).sqrt();
                if sin_t < 1.0 && cos_i > 0.0 {
                    // A. Fresnel's amplitudes of the transmitted wave, 1823.
                    let cos_t = ((1.0 - sin_t) * (1.0 + sin_t)).sqrt();
                    let across = 2.0 * n_i * cos_i / (n_i * cos_i + n_t * cos_t);
                    let along = 2.0 * n_i * cos_i / (n_t * cos_i + n_i * cos_t);
                    let transmitted = n_t * cos_t / (n_i * cos_i) * 0.5 * (across * across + along * along);
                    assert!((reflected + transmitted - 1.0).abs() <= 4.0 * f64::EPSILON, "{n_i} {n_t} {cos_i}");
                }
                // Up to rounding, where the curve is flat.
                if n_i < n_t {
                    let brewster = libm::cos(libm::atan(n_t / n_i));
                    assert!(cos_i > brewster || reflected >= last, "{n_i} {n_t} {cos_i}");
                }
                assert!((0.0..=1.0).contains(&reflected));
                last = reflected;
            }
            assert_eq!(last, 1.0);
        }
    }

    /// S11 (prism): the deviation by two refractions at the angle of least deviation is 2 asin(n sin A/2) − A.
    #[test]
    fn a_prism_of_bk7_spreads_the_spectrum_as_sellmeiers_equation_says() {
        // W. Sellmeier's equation (1871) with the constants that SCHOTT publishes for N-BK7; wavelength in micrometres.
        let index = |nm: f64| {
            let l2 = nm * nm * 1e-6;
            let terms =
                [(1.039_612_12, 0.006_000_698_67), (0.231_792_344, 0.020_017_914_4), (1.010_469_45, 103.560_653)];
            (1.0 + terms.iter().map(|(b, c)| b * l2 / (l2 - c)).sum::<f64>()).sqrt()
        };
        let (f, d, c) = (index(486.13), index(587.56), index(656.27));
        assert!((f - 1.52238).abs() < 1e-5 && (d - 1.5168).abs() < 1e-5 && (c - 1.51432).abs() < 1e-5, "{f} {d} {c}");
        let apex = 60f64.to_radians();
        let through = |n: f64| {
            let half = apex / 2.0;
            let theta = libm::asin(n * libm::sin(half));
            // Faces tilted to either side of the vertical by half the apex angle.
            let face = |side: f64| DVec3::new(side * libm::cos(half), libm::sin(half), 0.0).as_vec3();
            let (entry, exit) = (face(-1.0), face(1.0));
            let rise = theta - half;
            let incident = DVec3::new(libm::cos(rise), libm::sin(rise), 0.0).as_vec3();
            let inside = refract(incident, entry, 1.0, n).expect("into the denser medium");
            let out = refract(inside, -exit, n, 1.0).expect("below the critical angle");
            (degrees_from(incident, out).to_radians(), 2.0 * theta - apex)
        };
        for n in [f, d, c] {
            let (found, expected) = through(n);
            assert!((found - expected).abs() < 1e-6, "{n}: {found} for {expected}");
        }
        let spread = (through(f).0 - through(c).0, through(f).1 - through(c).1);
        assert!((spread.0 - spread.1).abs() < 1e-6, "{spread:?}");
        // Cauchy's equation from the Abbe number, which pictures use, stays close to it over the visible spectrum.
        let abbe = (d - 1.0) / (f - c);
        let off = |nm: f64| (dispersed_index(d, 20.0 / abbe, nm) - index(nm)).abs();
        let worst = (40..=70).map(|x| off(f64::from(x) * 10.0)).fold(0.0, f64::max);
        assert!(worst < 1e-3, "{worst}");
    }
}
