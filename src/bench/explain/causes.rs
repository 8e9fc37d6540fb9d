//! Suspected causes of cost in a scene, and the scene without each.

use super::mend::{self, Corners, cut, length, slimness, triangles};
use super::{Case, Cause, Suspect};
use crate::accel::AccelKind;
use crate::math::DVec3;
use crate::render::Settings;
use crate::scene::features::{Feature, Features};
use crate::scene::{AlphaMode, Scene};

/// Least length of a huge triangle, relative to the scene's extent.
const HUGE: f64 = 0.25;
/// Length that huge triangles are cut to, relative to the scene's extent.
const PIECE: f64 = 1.0 / 16.0;
/// A sliver's height is less than this part of its length.
const SLIM: f64 = 0.05;
/// Least length of a sliver, relative to the scene's extent: shorter ones hardly make boxes overlap.
const SHORTEST_SLIVER: f64 = 1.0 / 32.0;
/// Maximum number of pieces that triangles are cut into.
const MOST_PIECES: usize = 1 << 18;
/// Bounce limit in the case without deep mirrors and glass.
const SHALLOW: u32 = 2;
/// Cells per axis of the grid in which clusters are searched.
const CELLS: usize = 32;
/// Triangles form a cluster when half of them lie in this many times fewer cells than if scattered evenly.
const CROWDED: usize = 8;

/// All suspected causes of a case, in the order of [`Cause::ALL`].
pub(super) fn suspects(case: &Case) -> Vec<Suspect> {
    let size = Size::of(&case.scene);
    let found = [
        huge_triangles(case, &size),
        structure(case, &size),
        shells(case),
        slivers(case, &size),
        alpha_cards(case),
        depth(case),
        lights(case),
    ];
    found.into_iter().flatten().collect()
}

/// Bounding box and number of the triangles of a scene.
struct Size {
    lo: DVec3,
    hi: DVec3,
    count: usize,
}

impl Size {
    fn of(scene: &Scene) -> Self {
        let none = Self { lo: DVec3::INFINITY, hi: DVec3::NEG_INFINITY, count: 0 };
        triangles(scene).fold(none, |size, corners| {
            let (lo, hi) = corners.into_iter().fold((size.lo, size.hi), |(lo, hi), p| (lo.min(p), hi.max(p)));
            Self { lo, hi, count: size.count + 1 }
        })
    }

    fn extent(&self) -> f64 {
        (self.hi - self.lo).max_element()
    }
}

fn with_scene(case: &Case, scene: Scene) -> Case {
    Case { scene, ..case.clone() }
}

fn huge_triangles(case: &Case, size: &Size) -> Option<Suspect> {
    let is_huge = |corners: &Corners| length(corners) > HUGE * size.extent() && slimness(corners) >= SLIM;
    let count = triangles(&case.scene).filter(is_huge).count();
    (count > 0 && count * 4 < size.count).then(|| {
        let limit = PIECE * size.extent();
        Suspect {
            cause: Cause::HugeTriangles,
            evidence: format!(
                "{count} of {} triangles are longer than a quarter of the scene, and at least {:.0} % as high as long",
                size.count,
                100.0 * SLIM
            ),
            remedy: format!("cut them into triangles with edges below {limit:.3} units"),
            without: with_scene(case, cut(&case.scene, |c| is_huge(c).then_some(limit), MOST_PIECES)),
        }
    })
}

fn slivers(case: &Case, size: &Size) -> Option<Suspect> {
    let is_sliver = |corners: &Corners| slimness(corners) < SLIM && length(corners) > size.extent() * SHORTEST_SLIVER;
    let count = triangles(&case.scene).filter(is_sliver).count();
    (count > 0).then(|| {
        let limit = |corners: &Corners| {
            let height = slimness(corners) * length(corners);
            is_sliver(corners).then_some((8.0 * height).max(size.extent() / 64.0))
        };
        Suspect {
            cause: Cause::Slivers,
            evidence: format!(
                "{count} of {} triangles are longer than {:.0} % of the scene and less than {:.0} % as high as long",
                size.count,
                100.0 * SHORTEST_SLIVER,
                100.0 * SLIM
            ),
            remedy: "remesh them, or cut them across into pieces about as long as high".into(),
            without: with_scene(case, cut(&case.scene, limit, MOST_PIECES)),
        }
    })
}

fn shells(case: &Case) -> Option<Suspect> {
    let (scene, copies) = mend::without_copies(&case.scene);
    (copies > 0).then(|| Suspect {
        cause: Cause::Shells,
        evidence: format!("{copies} triangles stand on the same corners as others"),
        remedy: "remove duplicate faces (merge vertices by distance first)".into(),
        without: with_scene(case, scene),
    })
}

/// Suspects the structure itself; [`Cause::DenseCluster`] if it divides space and a small part of it holds most triangles.
fn structure(case: &Case, size: &Size) -> Option<Suspect> {
    use AccelKind::{FastBvh, FastOctree, Grid, GridBvh, GridOctree, Octree};
    // Both fast structures have tight boxes; choosing between them is up to `auto`.
    if matches!(case.accel, FastBvh | FastOctree) || size.count == 0 {
        return None;
    }
    let (needed, all) = cells_of_half(&case.scene, size);
    // Half of the triangles, scattered evenly, occupy one cell each, or half of all cells.
    let even = (size.count / 2).min(all / 2);
    let divides = matches!(case.accel, Grid | GridOctree | GridBvh | Octree);
    let (cause, evidence) = if divides && needed * CROWDED < even {
        let part = 100.0 * needed as f64 / all as f64;
        let held = format!("half of the triangles lie in {part:.2} % of the scene's box, which {} divides", case.accel);
        (Cause::DenseCluster, held)
    } else {
        (Cause::Structure, format!("{} is asked of every ray", case.accel))
    };
    let without = Case { accel: FastBvh, ..case.clone() };
    Some(Suspect { cause, evidence, remedy: "--accel fast-bvh".into(), without })
}

/// Least number of grid cells that hold the centroids of half of the triangles, and the number of all cells.
fn cells_of_half(scene: &Scene, size: &Size) -> (usize, usize) {
    let mut cells = vec![0usize; CELLS * CELLS * CELLS];
    let scale = (size.hi - size.lo).max(DVec3::splat(size.extent() * 1e-9)).recip() * CELLS as f64;
    for corners in triangles(scene) {
        let place = ((corners.iter().sum::<DVec3>() / 3.0 - size.lo) * scale).to_array();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates, NaN is 0")]
        let [x, y, z] = place.map(|p| (p as usize).min(CELLS - 1));
        cells[(z * CELLS + y) * CELLS + x] += 1;
    }
    cells.sort_unstable();
    let mut held = 0;
    let needed = cells.iter().rev().take_while(|&&n| {
        let before = held;
        held += n;
        before * 2 < size.count
    });
    (needed.count(), cells.len())
}

fn alpha_cards(case: &Case) -> Option<Suspect> {
    let features = Features::of(&case.scene);
    (features.has(Feature::Mask) || features.has(Feature::Blend)).then(|| {
        let mut scene = case.scene.clone();
        let seen_through = scene.materials.iter_mut().enumerate().filter(|(_, m)| m.alpha_mode != AlphaMode::Opaque);
        let mut names = Vec::new();
        for (i, material) in seen_through {
            material.alpha_mode = AlphaMode::Opaque;
            names.push(if material.name.is_empty() { format!("material {i}") } else { material.name.clone() });
        }
        Suspect {
            cause: Cause::AlphaCards,
            evidence: match names.len() {
                1 => "rays go on behind one material with alpha mask or blending".into(),
                n => format!("rays go on behind {n} materials with alpha mask or blending"),
            },
            remedy: format!("make what needs no alpha opaque, or cut cards to what is seen: {}", names.join(", ")),
            without: with_scene(case, scene),
        }
    })
}

fn depth(case: &Case) -> Option<Suspect> {
    let features = Features::of(&case.scene);
    let is_clear = features.has(Feature::Refraction) || features.has(Feature::ThinTransmission);
    let how = match (features.has(Feature::Mirrors), features.has(Feature::Refraction)) {
        (true, true) => "mirrored and bent",
        (true, false) if is_clear => "mirrored and let through",
        (true, false) => "mirrored",
        (false, true) => "bent",
        (false, false) => "let through",
    };
    let goes_on = is_clear || features.has(Feature::Mirrors);
    (goes_on && case.settings.depth.is_none_or(|depth| depth > SHALLOW)).then(|| Suspect {
        cause: Cause::Depth,
        evidence: format!("rays are {how} again and again"),
        remedy: format!("--depth {SHALLOW}"),
        without: Case { settings: Settings { depth: Some(SHALLOW), ..case.settings.clone() }, ..case.clone() },
    })
}

fn lights(case: &Case) -> Option<Suspect> {
    let lights = &case.scene.lights;
    let strongest = lights.iter().enumerate().filter(|(_, light)| light.shadows);
    let count = strongest.clone().count();
    let by_intensity = |(_, light): &(usize, &crate::scene::Light)| light.intensity.max_element();
    let (kept, _) = strongest.max_by(|a, b| by_intensity(a).total_cmp(&by_intensity(b)))?;
    (count > 1).then(|| {
        let mut scene = case.scene.clone();
        scene.lights.iter_mut().enumerate().filter(|(i, _)| *i != kept).for_each(|(_, light)| light.shadows = false);
        Suspect {
            cause: Cause::Lights,
            evidence: format!("{count} lights each ask a shadow ray of every point"),
            remedy: format!("remove lights, or the shadows of all but one of the {count}"),
            without: with_scene(case, scene),
        }
    })
}
