//! Consistency between parts of the document: accessors fit their views, have readable formats, references agree. The data
//! itself is checked where it is read.

use super::accessor::Format;
use super::codes::Code;
use super::report::Report;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root, buffer};

/// Checks the whole document.
pub(super) fn check(root: &Root, report: &mut Report) {
    views(root, report);
    for (i, accessor) in root.accessors.iter().enumerate() {
        check_accessor(root, i, accessor, report);
    }
    images(root, report);
    cameras(root, report);
    lights(root, report);
    nodes(root, report);
    skins(root, report);
}

fn views(root: &Root, report: &mut Report) {
    for (i, view) in root.buffer_views.iter().enumerate() {
        let place = format!("bufferViews[{i}]");
        let Some(buffer) = root.buffers.get(view.buffer.value()) else { continue };
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        if offset.checked_add(length).is_none_or(|end| end > buffer.byte_length.0) {
            let of = buffer.byte_length.0;
            let text =
                format!("{length} bytes from byte {offset} on, but buffer {} has only {of}", view.buffer.value());
            report.add(Code::BufferViewTooLong, &place, text);
        }
        let Some(stride) = view.byte_stride.map(|stride| stride.0) else { continue };
        if stride % 4 != 0 {
            report.add(Code::ValueMultipleOf, format!("{place}.byteStride"), format!("{stride} is no multiple of 4"));
        }
        if stride as u64 > length {
            let text = format!("a stride of {stride} in {length} bytes");
            report.add(Code::BufferViewTooBigByteStride, format!("{place}.byteStride"), text);
        }
        if matches!(view.target, Some(Checked::Valid(buffer::Target::ElementArrayBuffer))) {
            report.add(
                Code::BufferViewInvalidByteStride,
                format!("{place}.byteStride"),
                "a stride on a view of indices",
            );
        }
    }
}

fn check_accessor(root: &Root, i: usize, accessor: &Accessor, report: &mut Report) {
    let place = format!("accessors[{i}]");
    let Some(format) = Format::of(accessor) else { return };
    if accessor.normalized && matches!(format.component, ComponentType::F32 | ComponentType::U32) {
        let text = "only 8 and 16-bit integers can be normalized";
        report.add(Code::AccessorNormalizedInvalid, format!("{place}.normalized"), text);
    }
    bounds_length(accessor, format, &place, report);
    let offset = accessor.byte_offset.unwrap_or_default().0;
    match accessor.buffer_view.and_then(|view| root.buffer_views.get(view.value())) {
        Some(view) => {
            let stride = stride_of(view, format, &place, report);
            alignment(view, offset, format, &place, report);
            let run = Run { offset, stride, size: format.size() as u64, count: accessor.count.0 };
            fits(view, run, &place, report);
        }
        None if accessor.byte_offset.is_some() => {
            report.add(Code::UnsatisfiedDependency, format!("{place}.byteOffset"), "an offset without a bufferView");
        }
        None => {}
    }
    sparse(root, accessor, format, &place, report);
}

fn bounds_length(accessor: &Accessor, format: Format, place: &str, report: &mut Report) {
    for (name, bound) in [("min", &accessor.min), ("max", &accessor.max)] {
        let Some(length) = bound.as_ref().and_then(|b| b.as_array()).map(Vec::len) else { continue };
        if length != format.width() {
            let text = format!("{length} numbers for elements of {}", format.width());
            let (code, place) = (Code::ArrayLengthNotInList, format!("{place}.{name}"));
            report.warn_with(code, place, text, Code::AccessorMinMismatch.row().why);
        }
    }
}

/// Elements of an accessor in a view.
struct Run {
    offset: u64,
    stride: u64,
    size: u64,
    count: u64,
}

fn stride_of(view: &buffer::View, format: Format, place: &str, report: &mut Report) -> u64 {
    let size = format.size() as u64;
    match view.byte_stride.map_or(0, |stride| stride.0 as u64) {
        0 => size,
        stride => {
            if stride < size {
                let text = format!("a stride of {stride} for elements of {size} bytes");
                report.add(Code::AccessorSmallByteStride, place, text);
            }
            stride
        }
    }
}

fn alignment(view: &buffer::View, offset: u64, format: Format, place: &str, report: &mut Report) {
    let size = format.component_size() as u64;
    let total = offset.wrapping_add(view.byte_offset.unwrap_or_default().0);
    if !offset.is_multiple_of(size) {
        let text = format!("byteOffset {offset} is no multiple of the component's {size} bytes");
        report.add(Code::AccessorOffsetAlignment, format!("{place}.byteOffset"), text);
    } else if !total.is_multiple_of(size) {
        let text = format!("it starts at byte {total}, no multiple of the component's {size} bytes");
        report.add(Code::AccessorTotalOffsetAlignment, place, text);
    }
    if matches!(format.shape, Type::Mat2 | Type::Mat3 | Type::Mat4) && !total.is_multiple_of(4) {
        report.add(Code::AccessorMatrixAlignment, place, format!("matrices start at byte {total}, no multiple of 4"));
    }
}

fn fits(view: &buffer::View, run: Run, place: &str, report: &mut Report) {
    let Run { offset, stride, size, count } = run;
    if count == 0 {
        return;
    }
    let end = stride.checked_mul(count - 1).and_then(|n| n.checked_add(size)).and_then(|n| n.checked_add(offset));
    if end.is_none_or(|end| end > view.byte_length.0) {
        let text = format!(
            "{count} elements of {size} bytes from byte {offset} on do not fit its view of {} bytes",
            view.byte_length.0
        );
        report.add(Code::AccessorTooLong, place, text);
    }
}

fn sparse(root: &Root, accessor: &Accessor, format: Format, place: &str, report: &mut Report) {
    let Some(sparse) = &accessor.sparse else { return };
    if sparse.count.0 > accessor.count.0 {
        let text = format!("{} elements are replaced, only {} exist", sparse.count.0, accessor.count.0);
        report.add(Code::AccessorSparseCountOutOfRange, format!("{place}.sparse.count"), text);
    }
    let index_size = match sparse.indices.component_type {
        Checked::Valid(component) => component.0.size() as u64,
        Checked::Invalid => return,
    };
    let parts = [
        ("indices", sparse.indices.buffer_view, sparse.indices.byte_offset.0, index_size),
        ("values", sparse.values.buffer_view, sparse.values.byte_offset.0, format.size() as u64),
    ];
    for (name, view, offset, size) in parts {
        let place = format!("{place}.sparse.{name}");
        let Some(view) = root.buffer_views.get(view.value()) else { continue };
        if view.byte_stride.is_some() || view.target.is_some() {
            let text = "a stride or target on a view of sparse data";
            let code = if view.byte_stride.is_some() {
                Code::BufferViewInvalidByteStride
            } else {
                Code::BufferViewTargetOverride
            };
            report.add(code, format!("{place}.bufferView"), text);
        }
        let component = if name == "indices" { index_size } else { format.component_size() as u64 };
        if offset % component != 0 {
            report.add(
                Code::AccessorOffsetAlignment,
                format!("{place}.byteOffset"),
                format!("{offset} is no multiple of {component}"),
            );
        }
        fits(view, Run { offset, stride: size, size, count: sparse.count.0 }, &place, report);
    }
}

fn images(root: &Root, report: &mut Report) {
    for (i, image) in root.images.iter().enumerate() {
        let place = format!("images[{i}]");
        if image.uri.is_some() == image.buffer_view.is_some() {
            report.add(Code::OneOfMismatch, &place, "exactly one of uri and bufferView should be there");
        }
        let Some(view) = image.buffer_view else { continue };
        if image.mime_type.is_none() {
            report.add(Code::UnsatisfiedDependency, format!("{place}.bufferView"), "a bufferView without a mimeType");
        }
        if root.buffer_views.get(view.value()).is_some_and(|view| view.byte_stride.is_some()) {
            report.add(
                Code::ImageBufferViewWithByteStride,
                format!("{place}.bufferView"),
                "a stride on a view of an image",
            );
        }
    }
}

fn cameras(root: &Root, report: &mut Report) {
    for (i, camera) in root.cameras.iter().enumerate() {
        let place = format!("cameras[{i}]");
        let Checked::Valid(kind) = camera.type_ else { continue };
        let name = if kind == gltf::json::camera::Type::Perspective { "perspective" } else { "orthographic" };
        let there = if name == "perspective" { camera.perspective.is_some() } else { camera.orthographic.is_some() };
        if !there {
            let text = format!("'{name}' is missing");
            report.warn_with(Code::UndefinedProperty, &place, text, "the camera is left out");
        } else if camera.perspective.is_some() && camera.orthographic.is_some() {
            let text = "both perspective and orthographic are there";
            report.warn_with(Code::OneOfMismatch, &place, text, "its type says which counts");
        }
        let planes = match (&camera.perspective, &camera.orthographic) {
            (Some(p), _) => p.zfar.map(|far| (p.znear, far)),
            (_, Some(o)) => Some((o.znear, o.zfar)),
            _ => None,
        };
        if let Some((near, far)) = planes.filter(|(near, far)| far <= near) {
            report.add(
                Code::CameraZfarLequalZnear,
                format!("{place}.{name}"),
                format!("zfar {far} is not above znear {near}"),
            );
        }
        if camera.orthographic.as_ref().is_some_and(|o| o.xmag == 0.0 || o.ymag == 0.0) {
            report.add(Code::CameraXmagYmagZero, format!("{place}.orthographic"), "xmag and ymag must not be zero");
        }
        if let Some(p) = camera.perspective.as_ref().filter(|p| p.yfov >= std::f32::consts::PI) {
            report.add(
                Code::CameraYfovGequalPi,
                format!("{place}.perspective"),
                format!("yfov {} is not below π", p.yfov),
            );
        }
    }
}

fn lights(root: &Root, report: &mut Report) {
    use gltf::json::extensions::scene::khr_lights_punctual::Type::Spot;
    let lights = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
    for (i, light) in lights.into_iter().flat_map(|l| &l.lights).enumerate() {
        let place = format!("extensions.KHR_lights_punctual.lights[{i}]");
        match (&light.type_, &light.spot) {
            (Checked::Valid(Spot), None) => {
                report.warn_with(Code::UndefinedProperty, place, "'spot' is missing", "its angles are the defaults");
            }
            (Checked::Valid(Spot), Some(spot)) if spot.outer_cone_angle <= spot.inner_cone_angle => {
                let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
                report.add(
                    Code::LightSpotAngles,
                    place,
                    format!("the outer angle {outer} is not above the inner {inner}"),
                );
            }
            _ => {}
        }
    }
}

fn nodes(root: &Root, report: &mut Report) {
    let has_joints = |p: &gltf::json::mesh::Primitive| {
        p.attributes.keys().any(|k| matches!(k, Checked::Valid(gltf::json::mesh::Semantic::Joints(_))))
    };
    let skinned: Vec<bool> = root.meshes.iter().map(|mesh| mesh.primitives.iter().all(has_joints)).collect();
    for (i, node) in root.nodes.iter().enumerate() {
        let place = format!("nodes[{i}]");
        for (name, there) in [("skin", node.skin.is_some()), ("weights", node.weights.is_some())] {
            if there && node.mesh.is_none() {
                report.add(Code::UnsatisfiedDependency, format!("{place}.{name}"), format!("{name} without a mesh"));
            }
        }
        let Some(index) = node.mesh.map(|mesh| mesh.value()) else { continue };
        let Some(mesh) = root.meshes.get(index) else { continue };
        let targets = mesh.primitives.first().and_then(|p| p.targets.as_ref()).map_or(0, Vec::len);
        if let Some(weights) = node.weights.as_ref().filter(|w| w.len() != targets) {
            let text = format!("{} weights for {targets} morph targets", weights.len());
            report.add(Code::NodeWeightsInvalid, format!("{place}.weights"), text);
        }
        if node.skin.is_some() && skinned.get(index) == Some(&false) {
            report.add(Code::NodeSkinWithNonSkinnedMesh, &place, "a skin on a mesh without joints");
        }
    }
}

fn skins(root: &Root, report: &mut Report) {
    for (i, skin) in root.skins.iter().enumerate() {
        let place = format!("skins[{i}].inverseBindMatrices");
        let Some(accessor) = skin.inverse_bind_matrices.and_then(|a| root.accessors.get(a.value())) else { continue };
        let readable = Format::of(accessor).is_some_and(is_bind_matrix);
        if !readable {
            report.add(Code::SkinIbmInvalidFormat, &place, "inverse bind matrices must be MAT4 of floats");
        }
        let joints = skin.joints.len() as u64;
        if accessor.count.0 < joints {
            let text = format!("{} matrices for {joints} joints", accessor.count.0);
            report.add(Code::InvalidIbmAccessorCount, &place, text);
        }
        if has_stride(root, accessor) {
            report.add(Code::SkinIbmAccessorWithByteStride, &place, "a stride on a view of matrices");
        }
    }
}

/// Returns whether inverse bind matrices may have this format.
pub(super) fn is_bind_matrix(format: Format) -> bool {
    format.component == ComponentType::F32 && format.shape == Type::Mat4
}

/// Returns whether an accessor's view has a stride.
pub(super) fn has_stride(root: &Root, accessor: &Accessor) -> bool {
    let view: Option<Index<buffer::View>> = accessor.buffer_view;
    view.and_then(|view| root.buffer_views.get(view.value())).is_some_and(|view| view.byte_stride.is_some())
}
