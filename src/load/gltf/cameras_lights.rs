//! Cameras and lights that nodes place in the world.

use super::codes::Code;
use super::report::Report;
use crate::math::{DAffine3, DVec3, Vec3};
use crate::scene::{Camera, Falloff, Light, LightKind, Projection};
use gltf::json::extensions::scene::khr_lights_punctual as punctual;
use gltf::json::validation::Checked;
use gltf::json::{Root, scene::Node};

/// Camera of a node; `None`, with a warning where the schema check gave none, if the camera is unusable.
pub(super) fn camera(root: &Root, node: &Node, world: DAffine3, report: &mut Report) -> Option<Camera> {
    let index = node.camera?.value();
    let source = root.cameras.get(index)?;
    let projection = match (source.type_, &source.perspective, &source.orthographic) {
        (Checked::Valid(gltf::json::camera::Type::Perspective), Some(p), _) => {
            let (y_fov, aspect) = (f64::from(p.yfov), p.aspect_ratio.map(f64::from));
            let usable = y_fov > 0.0 && y_fov < std::f64::consts::PI;
            let aspect = aspect.filter(|a| *a > 0.0 && a.is_finite());
            usable.then_some(Projection::Perspective { y_fov, aspect })
        }
        (Checked::Valid(gltf::json::camera::Type::Orthographic), _, Some(o)) => {
            let (x_mag, y_mag) = (f64::from(o.xmag).abs(), f64::from(o.ymag).abs());
            let usable = x_mag > 0.0 && y_mag > 0.0 && x_mag.is_finite() && y_mag.is_finite();
            usable.then_some(Projection::Orthographic { x_mag, y_mag })
        }
        // Reported by the schema check.
        _ => return None,
    };
    let placed = projection.zip(Camera::rigid(world));
    if placed.is_none() {
        let text = "the camera cannot show anything";
        report.warn_with(Code::ValueNotInRange, format!("cameras[{index}]"), text, "it is left out");
    }
    let (projection, world_from_camera) = placed?;
    Some(Camera { name: name(&source.name, node), projection, world_from_camera })
}

/// Light of a node; `None` if there is none or it is unusable.
pub(super) fn light(root: &Root, node: &Node, world: DAffine3, report: &mut Report) -> Option<Light> {
    let index = node.extensions.as_ref()?.khr_lights_punctual.as_ref()?.light.value();
    let source = root.extensions.as_ref()?.khr_lights_punctual.as_ref()?.lights.get(index)?;
    let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
    let intensity = if source.intensity.is_finite() { source.intensity.max(0.0) } else { 1.0 };
    let color = Vec3::from(source.color.map(|c| if c.is_finite() { c.max(0.0) } else { 1.0 }));
    let position = world.translation;
    let direction = (-world.matrix3.z_axis).try_normalize().unwrap_or(DVec3::NEG_Z);
    let range = source.range.map(f64::from).filter(|r| *r > 0.0).unwrap_or(f64::INFINITY);
    let falloff = Falloff::InverseSquare { range };
    if !position.is_finite() || !direction.is_finite() {
        report.warn(Code::AccessorInvalidFloat, place, "the light stands nowhere and is left out");
        return None;
    }
    let kind = match (&source.type_, &source.spot) {
        (Checked::Valid(punctual::Type::Directional), _) => LightKind::Directional { direction },
        (Checked::Valid(punctual::Type::Point), _) => LightKind::Point { position, falloff },
        (Checked::Valid(punctual::Type::Spot), spot) => {
            let (inner, outer) = spot.as_ref().map_or((0.0, WIDE), cone);
            LightKind::Spot { position, direction, inner, outer, falloff }
        }
        // Reported by the schema check.
        _ => return None,
    };
    Some(Light { name: name(&source.name, node), intensity: color * intensity, kind, shadows: true, size: 0.0 })
}

/// Default outer angle of a spot light's cone.
const WIDE: f64 = std::f64::consts::FRAC_PI_4;

/// Inner and outer angle of a cone, 0 ≤ inner ≤ outer ≤ π/2.
fn cone(spot: &punctual::Spot) -> (f64, f64) {
    let angle = |value: f32, otherwise: f64| {
        let value = f64::from(value);
        if value.is_nan() { otherwise } else { value.clamp(0.0, std::f64::consts::FRAC_PI_2) }
    };
    let outer = angle(spot.outer_cone_angle, WIDE);
    (angle(spot.inner_cone_angle, 0.0).min(outer), outer)
}

/// Name of an object, or else of the node that holds it.
fn name(own: &Option<String>, node: &Node) -> String {
    own.as_ref().filter(|n| !n.is_empty()).or(node.name.as_ref()).cloned().unwrap_or_default()
}
