//! Accessors and buffer views with two different uses: a sign of a wrong index in the file.

use super::codes::Code;
use super::report::Report;
use super::schema::{list, position};
use super::tree::{Map, Value};

/// Use of data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    Vertices,
    Indices,
    Matrices,
    Times,
    Poses,
    Image,
}

impl Use {
    fn name(self) -> &'static str {
        match self {
            Self::Vertices => "vertices",
            Self::Indices => "indices",
            Self::Matrices => "inverse bind matrices",
            Self::Times => "times of an animation",
            Self::Poses => "poses of an animation",
            Self::Image => "an image",
        }
    }

    /// Returns whether two uses should not share a view. Matrices and animations often share views with other data, and do so
    /// without harm.
    fn clashes(self, other: Self) -> bool {
        let pair = [self, other];
        self != other
            && (pair.contains(&Self::Image) || pair.contains(&Self::Vertices) && pair.contains(&Self::Indices))
    }
}

/// Checks the whole document.
pub(super) fn check(root: &Value, report: &mut Report) {
    let accessors = vec![None; list(root, "accessors").len()];
    let views = vec![None; list(root, "bufferViews").len()];
    let mut check = Check { root, accessors, views, report };
    for (i, mesh) in list(root, "meshes").iter().enumerate() {
        for (k, primitive) in list(mesh, "primitives").iter().enumerate() {
            check.primitive(primitive, &format!("meshes[{i}].primitives[{k}]"));
        }
    }
    for (i, skin) in list(root, "skins").iter().enumerate() {
        check.accessor(skin.get("inverseBindMatrices"), Use::Matrices, || format!("skins[{i}].inverseBindMatrices"));
    }
    for (i, animation) in list(root, "animations").iter().enumerate() {
        for (k, sampler) in list(animation, "samplers").iter().enumerate() {
            let place = |part: &str| format!("animations[{i}].samplers[{k}].{part}");
            check.accessor(sampler.get("input"), Use::Times, || place("input"));
            check.accessor(sampler.get("output"), Use::Poses, || place("output"));
        }
    }
    for (i, image) in list(root, "images").iter().enumerate() {
        check.view(image.get("bufferView"), Use::Image, || format!("images[{i}].bufferView"));
    }
}

struct Check<'a> {
    root: &'a Value<'a>,
    /// First use of each accessor and view.
    accessors: Vec<Option<Use>>,
    views: Vec<Option<Use>>,
    report: &'a mut Report,
}

impl<'a> Check<'a> {
    fn primitive(&mut self, primitive: &'a Value<'a>, place: &str) {
        let attributes = primitive.get("attributes").and_then(Value::as_object);
        for (name, index) in attributes.into_iter().flat_map(Map::iter) {
            let at = || format!("{place}.attributes.{}", crate::load::paths::shorten(name));
            self.accessor(Some(index), Use::Vertices, at);
        }
        self.accessor(primitive.get("indices"), Use::Indices, || format!("{place}.indices"));
        for (k, target) in list(primitive, "targets").iter().enumerate() {
            for (name, index) in target.as_object().into_iter().flat_map(Map::iter) {
                let at = || format!("{place}.targets[{k}].{}", crate::load::paths::shorten(name));
                self.accessor(Some(index), Use::Vertices, at);
            }
        }
    }

    /// Records a use of an accessor and of its view; if both have two uses, only the accessor is reported.
    fn accessor(&mut self, index: Option<&Value>, here: Use, place: impl Fn() -> String) {
        let Some(index) = index.and_then(position) else { return };
        let Some(accessor) = list(self.root, "accessors").get(index) else { return };
        let Some(slot) = self.accessors.get_mut(index) else { return };
        match *slot.get_or_insert(here) {
            other if other == here => self.view(accessor.get("bufferView"), here, place),
            other => {
                let text = format!("accessor {index} holds {} here and {} elsewhere", here.name(), other.name());
                self.report.add(Code::AccessorUsageOverride, place(), text);
            }
        }
    }

    fn view(&mut self, index: Option<&Value>, here: Use, place: impl Fn() -> String) {
        let Some(index) = index.and_then(position) else { return };
        let Some(slot) = self.views.get_mut(index) else { return };
        let other = *slot.get_or_insert(here);
        if here.clashes(other) {
            let text = format!("buffer view {index} holds {} here and {} elsewhere", here.name(), other.name());
            self.report.add(Code::BufferViewTargetOverride, place(), text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::path::Path;

    /// Warnings about a file with three accessors, of which 1 and 2 share a view.
    fn told(parts: serde_json::Value) -> Vec<String> {
        let mut root = json!({
            "accessors": [{"bufferView": 0}, {"bufferView": 1}, {"bufferView": 1}], "bufferViews": [{}, {}, {}]});
        parts.as_object().unwrap().iter().for_each(|(name, part)| root[name] = part.clone());
        let mut report = Report::new(Path::new("a.gltf"));
        check(&root.into(), &mut report);
        report.warnings.into_vec().iter().map(|w| format!("{} {} {}", w.code, w.place, w.text)).collect()
    }

    fn mesh(attribute: u32, indices: u32) -> serde_json::Value {
        json!([{"primitives": [{"attributes": {"POSITION": attribute}, "indices": indices}]}])
    }

    #[test]
    fn each_use_of_its_own_data_is_right() {
        let animations = json!([{"samplers": [{"input": 1, "output": 2}]}]);
        let skins = json!([{"inverseBindMatrices": 1}]);
        let nothing: [String; 0] = [];
        assert_eq!(told(json!({"meshes": mesh(0, 1), "images": [{"bufferView": 2}, {"bufferView": 2}]})), nothing);
        assert_eq!(told(json!({"meshes": mesh(0, 1), "skins": [{"inverseBindMatrices": 2}]})), nothing);
        assert_eq!(told(json!({"animations": animations})), nothing);
        assert_eq!(told(json!({"skins": skins})), nothing);
    }

    #[test]
    fn an_accessor_for_two_things_is_told() {
        let twice = "gltf-accessor-usage-override";
        assert_eq!(
            told(json!({ "meshes": mesh(0, 0) })),
            [format!("{twice} meshes[0].primitives[0].indices accessor 0 holds indices here and vertices elsewhere")]
        );
        let targets = json!([{"primitives": [{"attributes": {}, "indices": 0, "targets": [{}, {"NORMAL": 0}]}]}]);
        let text = "accessor 0 holds vertices here and indices elsewhere";
        assert_eq!(
            told(json!({ "meshes": targets })),
            [format!("{twice} meshes[0].primitives[0].targets[1].NORMAL {text}")]
        );
        let text = "accessor 0 holds inverse bind matrices here and vertices elsewhere";
        let skins = json!([{"inverseBindMatrices": 0}]);
        assert_eq!(
            told(json!({"meshes": mesh(0, 1), "skins": skins})),
            [format!("{twice} skins[0].inverseBindMatrices {text}")]
        );
        let text = "accessor 1 holds poses of an animation here and times of an animation elsewhere";
        let animations = json!([{"samplers": [{"input": 1, "output": 1}]}]);
        assert_eq!(
            told(json!({ "animations": animations })),
            [format!("{twice} animations[0].samplers[0].output {text}")]
        );
    }

    #[test]
    fn a_view_for_vertices_and_indices_or_for_an_image_and_anything_is_told() {
        let shared = "gltf-buffer-view-target-override";
        let text = "buffer view 1 holds indices here and vertices elsewhere";
        assert_eq!(told(json!({ "meshes": mesh(1, 2) })), [format!("{shared} meshes[0].primitives[0].indices {text}")]);
        let text = "buffer view 1 holds an image here and inverse bind matrices elsewhere";
        let both = json!({"skins": [{"inverseBindMatrices": 2}], "images": [{"bufferView": 1}]});
        assert_eq!(told(both), [format!("{shared} images[0].bufferView {text}")]);
    }
}
