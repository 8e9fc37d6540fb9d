//! `[[lights]]`, `[[cameras]]` and `[render]`.

use super::reader::{Table, boolean, color, direction, numbers, positive, string, vec, whole, within, word};
use crate::math::{DVec3, Vec3};
use crate::scene::{Camera, Falloff, Light, LightKind, MAX_DEPTH, MAX_STOPS, Projection, RenderHints};

#[derive(Clone, Copy)]
enum Kind {
    Point,
    Directional,
    Spot,
    Rectangle,
    Ambient,
}

/// A light, or a contribution to the ambient light.
pub(super) enum Lit {
    Light(Light),
    Ambient(Vec3),
}

/// Reads one light; `None` after a fault.
#[expect(clippy::cast_possible_truncation, reason = "light is f32")]
pub(super) fn light(table: Table) -> Option<Lit> {
    let kinds = [
        ("point", Kind::Point),
        ("directional", Kind::Directional),
        ("spot", Kind::Spot),
        ("rectangle", Kind::Rectangle),
        ("ambient", Kind::Ambient),
    ];
    let kind = table.need("kind", word(&kinds));
    let factor = table.get("intensity", within(0.0, 1e12)).unwrap_or(1.0) as f32;
    let intensity = table.get("color", color).unwrap_or(Vec3::ONE) * factor;
    let name = table.get("name", string).unwrap_or_default();
    let place = match kind {
        Some(Kind::Ambient) => {
            table.finish();
            return Some(Lit::Ambient(intensity));
        }
        Some(Kind::Point) => {
            table.need("position", vec).map(|position| LightKind::Point { position, falloff: falloff(&table) })
        }
        Some(Kind::Directional) => {
            table.need("direction", direction).map(|direction| LightKind::Directional { direction })
        }
        Some(Kind::Spot) => spot(&table),
        Some(Kind::Rectangle) => rectangle(&table),
        // The valid keys of an unknown kind are not known.
        None => return None,
    };
    let shadows = table.get("shadows", boolean).unwrap_or(true);
    let size = match kind {
        Some(Kind::Directional) => 0.5 * table.get("angle", within(0.0, 180.0)).unwrap_or(0.0).to_radians(),
        Some(Kind::Point | Kind::Spot) => table.get("radius", within(0.0, 1e12)).unwrap_or(0.0),
        _ => 0.0,
    };
    table.finish();
    // Directional lights are kept in lux, of which a white matt surface reflects 1/π; files give the reflected value.
    let lux = if matches!(kind, Some(Kind::Directional)) { std::f32::consts::PI } else { 1.0 };
    place.map(|kind| Lit::Light(Light { name, intensity: intensity * lux, kind, shadows, size }))
}

fn spot(table: &Table) -> Option<LightKind> {
    let position = table.need("position", vec);
    let direction = table.need("direction", direction);
    let inner = table.get("inner", within(0.0, 90.0)).unwrap_or(0.0);
    let outer = table.get("outer", within(0.0, 90.0)).unwrap_or(45.0);
    if inner > outer {
        let remedy = if table.has("outer") { "swap them" } else { "write an `outer` above it: 45 is the default" };
        table.note(&table.place_of("inner"), format!("`inner` {inner} is above `outer` {outer}"), remedy);
    }
    let falloff = falloff(table);
    let (inner, outer) = (inner.to_radians(), outer.to_radians());
    Some(LightKind::Spot { position: position?, direction: direction?, inner, outer, falloff })
}

fn rectangle(table: &Table) -> Option<LightKind> {
    let position = table.need("position", vec);
    let sides = [table.need("side_u", vec), table.need("side_v", vec)];
    let falloff = falloff(table);
    let [u, v] = [sides[0]?, sides[1]?];
    if u.cross(v).length() <= 1e-9 * u.length() * v.length() {
        table.note(&table.place_of("side_v"), "`side_u` and `side_v` run along one line", "turn one of them");
    }
    Some(LightKind::Rectangle { position: position?, sides: [u, v], falloff })
}

fn falloff(table: &Table) -> Falloff {
    let fades = table.get("falloff", word(&[("none", false), ("inverse-square", true)])).unwrap_or(false);
    let range = table.get("range", positive);
    if range.is_some() && !fades {
        table.note(&table.place_of("range"), "`range` needs a light that fades", "add falloff = \"inverse-square\"");
    }
    if fades { Falloff::InverseSquare { range: range.unwrap_or(f64::INFINITY) } } else { Falloff::None }
}

/// Reads one camera; `up` is the scene's.
pub(super) fn camera(table: Table, up: DVec3) -> Option<Camera> {
    let name = table.get("name", string).unwrap_or_default();
    let (eye, at) = (table.need("eye", vec), table.get("at", vec).unwrap_or(DVec3::ZERO));
    let up = table.get("up", direction).unwrap_or(up);
    let fov = table.get("fov", within(0.1, 170.0));
    let ortho = table.get("ortho", positive);
    if fov.is_some() && ortho.is_some() {
        table.note(&table.place_of("ortho"), "a camera has `fov` or `ortho`, not both", "remove one");
    }
    if eye == Some(at) {
        table.note(&table.place_of("eye"), "`eye` and `at` are one point, so the camera looks nowhere", "move one");
    }
    let projection = match ortho {
        // The width follows from the picture's aspect ratio.
        Some(height) => Projection::Orthographic { x_mag: height * 0.5, y_mag: height * 0.5 },
        None => Projection::Perspective { y_fov: fov.unwrap_or(45.0).to_radians(), aspect: None },
    };
    table.finish();
    Some(Camera { name, projection, world_from_camera: Camera::look_at(eye?, at, up) })
}

/// Reads `[render]`.
#[expect(clippy::cast_possible_truncation, reason = "settings are f32")]
pub(super) fn hints(table: Table) -> RenderHints {
    let maps = [("none", "none"), ("reinhard", "reinhard"), ("aces", "aces"), ("neutral", "neutral")];
    let side = |n: f64| (n.fract() == 0.0 && (1.0..=65_535.0).contains(&n)).then_some(n as u32);
    let hints = RenderHints {
        size: table.get("size", |value| {
            let [w, h] = numbers::<2>(value)?;
            side(w).zip(side(h)).ok_or_else(|| "must be two whole numbers from 1 to 65535".into())
        }),
        samples: table.get("samples", whole(1, 65_536)),
        depth: table.get("depth", whole(0, MAX_DEPTH)),
        cutoff: table.get("cutoff", within(0.0, 1.0)).map(|n| n as f32),
        tone_map: table.get("tone_map", word(&maps)).map(str::to_owned),
        exposure: table.get("exposure", within(-f64::from(MAX_STOPS), f64::from(MAX_STOPS))).map(|n| n as f32),
        default_light: table.get("default_light", boolean),
        camera: None,
    };
    table.finish();
    hints
}
