//! Findings of `meshray inspect`, gathered once and shown as text or as JSON.

use super::topology::Topology;
use crate::accel::{AccelChoice, AccelParams};
use crate::load::paths::FileFault;
use crate::load::{AnimationFacts, ExtensionFacts, Loaded, WireFacts};
use crate::math::{DVec3, Vec3};
use crate::number::{bytes, grouped, hash, so_many};
use crate::render::World;
use crate::scene::default_light::{self, DefaultLight};
use crate::scene::features::Features;
use crate::scene::framing::{Bounds, robust_bounds_within};
use crate::scene::{Bitmap, LightKind, Mesh, Projection, Scene, UpAxis};
use serde_json::{Value, json};
use std::path::Path;

/// All findings about a file.
pub(super) struct Report<'a> {
    file: &'a Path,
    loaded: &'a Loaded,
    world: World,
    bounds: Bounds,
    topology: Topology,
    features: Features,
    scene_bytes: u64,
    structure_bytes: u64,
    /// Maximum rounding error of a corner, by loading and by placing.
    rounding: f64,
}

/// Maximum length of a list of names that the text shows in full.
const SHOWN: usize = 8;

impl<'a> Report<'a> {
    /// Gathers the findings on a scene that is placed as for rendering; builds the structure that rendering would use, to learn
    /// its size. Instances are temporarily stored separately if that takes no more than `limit` bytes.
    pub(super) fn new(file: &'a Path, loaded: &'a Loaded, world: World, limit: u64) -> Self {
        let scene = &loaded.scene;
        let topology = match World::flattened_bytes(scene) <= limit {
            true if world.instanced.is_empty() => Topology::of(scene, &world),
            true => Topology::of(scene, &World::new(scene)),
            false => Topology::by_object(scene, &world),
        };
        let structure = world.structure(AccelChoice::Auto, &AccelParams::DEFAULT).0.summary();
        Self {
            file,
            loaded,
            bounds: robust_bounds_within(scene, world.bounds),
            topology,
            features: Features::of(scene),
            scene_bytes: scene_bytes(scene, &world),
            structure_bytes: structure.bytes,
            rounding: loaded.facts.max_rounding + world.rounding(scene),
            world,
        }
    }

    /// Aligned lines of label and value.
    pub(super) fn text(&self) -> String {
        let mut lines = Lines::default();
        self.identity(&mut lines);
        self.contents(&mut lines);
        self.place(&mut lines);
        self.faults(&mut lines);
        self.names(&mut lines);
        self.costs(&mut lines);
        lines.text
    }

    fn identity(&self, lines: &mut Lines) {
        let facts = &self.loaded.facts;
        lines.add("file", self.file.display().to_string());
        lines.add("format", facts.format.clone());
        lines.add("generator", facts.generator.clone());
        if facts.scenes.len() > 1 {
            let marked = facts.scenes.iter().enumerate().map(|(i, name)| {
                let mark = if i == facts.scene_index { " (this one)" } else { "" };
                format!("{i} '{name}'{mark}")
            });
            lines.add("scenes", shorten(marked));
        }
        let marked = facts.variants.iter().enumerate().map(|(i, name)| {
            let mark = if facts.variant == Some(i) { " (this one)" } else { "" };
            format!("{i} '{name}'{mark}")
        });
        lines.add("variants", shorten(marked));
    }

    fn contents(&self, lines: &mut Lines) {
        let (scene, shapes, facts) = (&self.loaded.scene, &self.world.shapes, &self.loaded.facts);
        lines.add("faces", grouped(facts.faces));
        lines.add("triangles", grouped(u64::from(self.world.triangles())));
        lines.count("polygons", shapes.polygons.len() as u64, "kept whole");
        lines.count("spheres", shapes.spheres.len() as u64, "");
        lines.count("cones", shapes.cones.len() as u64, "or cylinders");
        lines.count("planes", shapes.planes.len() as u64, "");
        let solids = (scene.spheres.len() + scene.cones.len() + scene.planes.len()) as u64;
        let meshes = (scene.meshes.len() as u64, scene.instances.len() as u64);
        let placed = match meshes {
            (0, _) => String::new(),
            (meshes, instances) => {
                let plural = if meshes == 1 { "mesh" } else { "meshes" };
                format!(": {} {plural} in {}", grouped(meshes), so_many(instances, "place"))
            }
        };
        lines.add("objects", format!("{}{placed}", grouped(meshes.1 + solids)));
        lines.add("materials", shorten(scene.materials.iter().map(|m| label(&m.name))));
        let wires = &facts.wires;
        lines.count("points", wires.points, &format!("drawn {:.4} wide", wires.point_width));
        lines.count("lines", wires.lines, &format!("drawn {:.4} wide", wires.line_width));
    }

    fn place(&self, lines: &mut Lines) {
        let (lo, hi) = self.world.bounds;
        if lo.cmple(hi).all() {
            let drawn =
                if self.loaded.facts.wires.narrowest().is_some() { ", with the width of points and lines" } else { "" };
            lines.add("bounds", format!("{} to {}{drawn}", vector(lo), vector(hi)));
            lines.add("size", format!("{} {}", vector(hi - lo), self.units()));
        }
        if self.bounds.strays > 0 {
            let framed = format!("{} to {}", vector(self.bounds.lo), vector(self.bounds.hi));
            lines.add("framed", format!("{framed}, without {} far-off faces", grouped(self.bounds.strays)));
        }
        let reason = self.loaded.facts.up_reason.as_ref().map(|r| format!(" ({r})")).unwrap_or_default();
        lines.add("up", format!("{}{reason}", self.up()));
        if self.loaded.scene.faces_back {
            lines.add("front", "on the other side, as that of avatars of VRM 0.x: views turn with it");
        }
        lines.add("rounding", format!("at most {:.3e} to single precision", self.rounding));
    }

    fn faults(&self, lines: &mut Lines) {
        let topology = &self.topology;
        let edges = [(topology.open, "open"), (topology.non_manifold, "non-manifold")];
        let found: Vec<String> =
            edges.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{} {what}", grouped(*n))).collect();
        let state = if topology.edges == 0 { String::new() } else { format!(", {}", or_closed(&found)) };
        let by_object = if topology.by_object { ", each instance by itself" } else { "" };
        lines.add("edges", format!("{}{state}{by_object}", grouped(topology.edges)));
        lines.count("duplicates", topology.duplicates, "faces with the corners of another");
        lines.count("degenerate", topology.degenerate, "faces with two corners in one place");
        for (reason, count) in &self.loaded.facts.dropped {
            lines.count("dropped", *count, reason);
        }
        lines.add("missing", shorten(self.missing().into_iter()));
    }

    fn names(&self, lines: &mut Lines) {
        let scene = &self.loaded.scene;
        let extension = |ExtensionFacts { name, required, supported }: &ExtensionFacts| {
            let required = if *required { ", required" } else { "" };
            format!("{name} ({}{required})", if *supported { "supported" } else { "not supported" })
        };
        lines.add("extensions", shorten(self.loaded.facts.extensions.iter().map(extension)));
        let animation = |animation: &AnimationFacts| {
            let channels = if animation.channels == 1 { "channel" } else { "channels" };
            let (seconds, count) = (animation.seconds, animation.channels);
            format!("{} ({seconds:.3} s, {count} {channels})", label(&animation.name))
        };
        lines.add("animations", shorten(self.loaded.facts.animations.iter().map(animation)));
        lines.add("cameras", shorten(scene.cameras.iter().map(|c| format!("{} ({})", label(&c.name), lens(c)))));
        lines.add("lights", shorten(scene.lights.iter().map(|l| format!("{} ({})", label(&l.name), kind(l)))));
        if default_light::judged(scene) == DefaultLight::Added {
            lines.add("lights", "none: pictures bring lamps and a studio, beside what is needed here");
        }
        if scene.ambient != Vec3::ZERO {
            lines.add("ambient", format!("light of {}, {}, {}", scene.ambient.x, scene.ambient.y, scene.ambient.z));
        }
        let bitmaps = scene.bitmaps.iter().map(|b| format!("{} {}×{}", label(&b.name), b.width, b.height));
        lines.add("images", shorten(bitmaps));
        lines.add("needs", self.features.present().map(|f| f.name()).collect::<Vec<_>>().join(", "));
        lines.add("left out", self.features.absent().map(|f| f.name()).collect::<Vec<_>>().join(", "));
    }

    fn costs(&self, lines: &mut Lines) {
        let memory = format!("{} scene, {} structure", bytes(self.scene_bytes), bytes(self.structure_bytes));
        lines.add("memory", format!("about {memory}"));
        let facts = &self.loaded.facts;
        lines.add("files", shorten(facts.files.iter().map(|f| f.path.display().to_string())));
        lines.add("hash", hash(facts.hash));
        lines.count("warnings", self.loaded.warnings.iter().map(|w| u64::from(w.count)).sum(), "");
    }

    fn wires(&self) -> Value {
        let WireFacts { points, lines, point_width, line_width } = self.loaded.facts.wires;
        json!({ "points": points, "point_width": point_width, "lines": lines, "line_width": line_width })
    }

    /// One JSON object (schema in the module's documentation).
    pub(super) fn json(&self) -> String {
        let (scene, shapes, facts) = (&self.loaded.scene, &self.world.shapes, &self.loaded.facts);
        let named = |name: &str, kind: &str| json!({ "name": name, "kind": kind });
        let hull = |lo: DVec3, hi: DVec3| match lo.cmple(hi).all() {
            true => json!({ "lo": lo.to_array(), "hi": hi.to_array() }),
            false => Value::Null,
        };
        let bounds = hull(self.world.bounds.0, self.world.bounds.1);
        // Without bounds there is nothing framed.
        let framed = if bounds.is_null() { Value::Null } else { hull(self.bounds.lo, self.bounds.hi) };
        let topology = &self.topology;
        let mut value = json!({
            "schema": "meshray-inspect/1",
            "file": self.file.to_string_lossy(), "format": facts.format, "generator": facts.generator,
            "hash": hash(facts.hash),
            "files": facts.files.iter().map(|f| f.path.to_string_lossy()).collect::<Vec<_>>(),
            "triangles": self.world.triangles(), "polygons": shapes.polygons.len(), "faces": facts.faces,
            "spheres": shapes.spheres.len(), "cones": shapes.cones.len(), "planes": shapes.planes.len(),
            "meshes": scene.meshes.len(), "instances": scene.instances.len(),
            "materials": scene.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(),
            "bounds": bounds, "framed": framed, "strays": self.bounds.strays,
            "units": self.units(), "up": self.up(), "up_reason": facts.up_reason,
            "topology": {
                "corners": topology.corners, "edges": topology.edges, "open": topology.open,
                "non_manifold": topology.non_manifold, "duplicates": topology.duplicates,
                "degenerate": topology.degenerate, "by_object": topology.by_object,
            },
            "dropped": facts.dropped.iter().map(|(why, n)| json!({ "reason": why, "count": n })).collect::<Vec<_>>(),
            "points_and_lines": facts.wires.points + facts.wires.lines,
            "wires": self.wires(),
            "textures": scene.bitmaps.iter()
                .map(|b| json!({ "name": b.name, "width": b.width, "height": b.height })).collect::<Vec<_>>(),
            "missing": self.missing(),
            "extensions": facts.extensions.iter()
                .map(|e| json!({ "name": e.name, "required": e.required, "supported": e.supported })).collect::<Vec<_>>(),
            "scenes": facts.scenes, "scene": facts.scene_index,
            "animations": facts.animations.iter()
                .map(|a| json!({ "name": a.name, "seconds": a.seconds, "channels": a.channels })).collect::<Vec<_>>(),
            "variants": facts.variants, "variant": facts.variant,
            "cameras": scene.cameras.iter().map(|c| named(&c.name, lens(c))).collect::<Vec<_>>(),
            "lights": scene.lights.iter().map(|l| named(&l.name, kind(l))).collect::<Vec<_>>(),
            "ambient": scene.ambient.to_array(),
            "features": self.features.present().map(|f| f.name()).collect::<Vec<_>>(),
            "left_out": self.features.absent().map(|f| f.name()).collect::<Vec<_>>(),
            "memory": { "scene": self.scene_bytes, "structure": self.structure_bytes },
            "max_rounding": self.rounding,
            "warnings": self.loaded.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        });
        // One more key would exceed the macro's recursion limit.
        value["faces_back"] = scene.faces_back.into();
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }

    fn units(&self) -> &'static str {
        if self.loaded.facts.format.starts_with("glTF") { "metres (as glTF says)" } else { "units (taken as metres)" }
    }

    fn up(&self) -> &'static str {
        match self.loaded.scene.up {
            UpAxis::Y => "+Y",
            UpAxis::Z => "+Z",
        }
    }

    /// Files that are named but missing.
    fn missing(&self) -> Vec<String> {
        let missing = self.loaded.warnings.iter().filter(|w| w.code == FileFault::MISSING);
        missing.map(|w| w.text.clone()).collect()
    }
}

/// Lines with aligned labels; empty values leave no line.
#[derive(Default)]
struct Lines {
    text: String,
}

impl Lines {
    fn add(&mut self, label: &str, value: impl AsRef<str>) {
        let value: String = value.as_ref().chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
        if !value.is_empty() {
            self.text.push_str(&format!("{label:<14} {value}\n"));
        }
    }

    fn count(&mut self, label: &str, n: u64, what: &str) {
        if n > 0 {
            self.add(label, format!("{} {what}", grouped(n)).trim_end());
        }
    }
}

fn label(name: &str) -> String {
    if name.is_empty() { "(no name)".into() } else { format!("'{name}'") }
}

fn or_closed(found: &[String]) -> String {
    if found.is_empty() { "closed".into() } else { found.join(", ") }
}

fn shorten(names: impl ExactSizeIterator<Item = String>) -> String {
    let count = names.len();
    let shown = names.take(SHOWN).collect::<Vec<_>>().join(", ");
    if count > SHOWN { format!("{shown}, … ({count} in all)") } else { shown }
}

fn lens(camera: &crate::scene::Camera) -> &'static str {
    match camera.projection {
        Projection::Perspective { .. } => "perspective",
        Projection::Orthographic { .. } => "orthographic",
    }
}

fn kind(light: &crate::scene::Light) -> &'static str {
    match light.kind {
        LightKind::Point { .. } => "point",
        LightKind::Directional { .. } => "directional",
        LightKind::Spot { .. } => "spot",
        LightKind::Rectangle { .. } => "rectangle",
    }
}

fn vector(v: DVec3) -> String {
    let part =
        |x: f64| if x == 0.0 || (1e-3..1e12).contains(&x.abs()) { format!("{x:.4}") } else { format!("{x:.4e}") };
    format!("({}, {}, {})", part(v.x), part(v.y), part(v.z))
}

/// Size in bytes of the large arrays of the scene and of its shapes.
fn scene_bytes(scene: &Scene, world: &World) -> u64 {
    let meshes: u64 = scene.meshes.iter().map(Mesh::bytes).sum();
    let bitmaps: u64 = scene.bitmaps.iter().map(Bitmap::bytes).sum();
    meshes + bitmaps + world.bytes() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::{LoadOptions, load_bytes};
    use crate::math::DAffine3;
    use crate::render::Instancing;
    use crate::scene::Instance;

    fn report(loaded: &Loaded, limit: u64) -> Report<'_> {
        Report::new(Path::new("a.toml"), loaded, World::placing(&loaded.scene, Instancing::Auto), limit)
    }

    fn report_of(text: &str) -> Value {
        let loaded = load_bytes(Path::new("a.toml"), text.into(), &LoadOptions::default()).unwrap();
        serde_json::from_str(&report(&loaded, u64::MAX).json()).unwrap()
    }

    #[test]
    fn what_stands_in_many_places_is_counted_there_and_looked_at_once_where_memory_is_short() {
        let text = "[[spheres]]\ncenter=[0,0,0]\nradius=1";
        let mut loaded = load_bytes(Path::new("a.toml"), text.into(), &LoadOptions::default()).unwrap();
        let star = crate::accel::tests::scenes::star(120, 60);
        let mesh = Mesh { positions: star.vertices.to_vec(), triangles: star.triangles.to_vec(), ..Mesh::default() };
        let triangles = mesh.triangles.len();
        loaded.scene.meshes.push(mesh);
        let places = (0..40).map(|i| DAffine3::from_translation(DVec3::X * f64::from(i) * 10.0));
        let placed = |world_from_object| Instance { name: String::new(), mesh: 0, world_from_object };
        loaded.scene.instances = places.map(placed).collect();
        // A line, which has no faces in the file, behind them.
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        loaded.scene.meshes.push(Mesh { positions, triangles: vec![[0, 1, 2]], is_wire: true, ..Mesh::default() });
        let world_from_object = DAffine3::from_translation(DVec3::Y * 50.0);
        loaded.scene.instances.push(Instance { name: String::new(), mesh: 1, world_from_object });
        let [whole, by_object] = [u64::MAX, 1 << 20].map(|limit| report(&loaded, limit));
        assert!(!whole.world.instanced.is_empty(), "kept once");
        assert_eq!(whole.world.triangles() as usize, 40 * triangles + 1);
        assert_eq!(by_object.topology, Topology { by_object: true, ..whole.topology });
        assert!(whole.topology.edges > 0 && by_object.text().contains("each instance by itself"));
    }

    #[test]
    fn a_square_and_a_sphere_are_counted() {
        let report = report_of(
            "[[meshes]]\npositions=[[0,0,0],[2,0,0],[2,1,0],[0,1,0]]\nfaces=[[0,1,2,3]]\n\
             [[spheres]]\ncenter=[0,0,5]\nradius=1\n[[lights]]\nname='lamp'\nkind='point'\nposition=[0,9,0]",
        );
        assert_eq!((&report["faces"], &report["triangles"], &report["spheres"]), (&1.into(), &2.into(), &1.into()));
        assert_eq!((&report["topology"]["edges"], &report["topology"]["open"]), (&5.into(), &4.into()));
        assert_eq!(report["bounds"]["hi"], serde_json::json!([2.0, 1.0, 6.0]));
        assert_eq!(report["lights"][0], serde_json::json!({ "name": "lamp", "kind": "point" }));
    }

    #[test]
    fn points_and_lines_have_no_faces_of_the_file() {
        let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nv 6 5 5\nf 1 2 3\np 4\nl 4 5\n";
        let loaded = load_bytes(Path::new("a.obj"), obj.into(), &LoadOptions::default()).unwrap();
        for limit in [u64::MAX, 1] {
            let report = report(&loaded, limit);
            assert_eq!((report.topology.edges, report.topology.open, report.topology.non_manifold), (3, 3, 0));
            assert!(report.text().contains("with the width of points and lines"), "{}", report.text());
        }
    }

    #[test]
    fn an_empty_scene_has_no_bounds() {
        let report = report_of("up = 'z'");
        assert_eq!([&report["bounds"], &report["framed"]], [&Value::Null; 2]);
        assert_eq!(report["up"], "+Z");
    }

    #[test]
    fn the_text_has_its_values_in_one_column() {
        let text =
            "[[spheres]]\ncenter=[0,0,5]\nradius=1\nmaterial='a\tb'\n[materials.\"a\\tb\"]\n".replace('\t', "\\t");
        let text = text.replace("material='a\\tb'", "material=\"a\\tb\"");
        let loaded = load_bytes(Path::new("a.toml"), text.into(), &LoadOptions::default()).unwrap();
        let shown = report(&loaded, u64::MAX).text();
        assert!(shown.lines().all(|l| l.as_bytes()[14] == b' ' && !l.contains('\t')), "{shown}");
        assert!(shown.contains("spheres        1\n"), "{shown}");
    }
}
