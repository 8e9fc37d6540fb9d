//! Wavefront OBJ: positions and triangles, an object for each instance. Materials, which would need a second file, and shapes
//! other than triangles are left out.

use std::io::{self, Write};

use crate::scene::{Scene, UpAxis};

/// Writes the triangles of a scene, instances flattened into geometry; coordinates as the shortest decimals that round-trip
/// to the same `f32`.
///
/// # Errors
/// I/O errors of `out`.
pub fn write(scene: &Scene, out: &mut impl Write) -> io::Result<()> {
    let turn = scene.up.turned_to(UpAxis::Y);
    let mut before = 1;
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh as usize];
        writeln!(out, "o {}", name(&instance.name))?;
        let world = turn * instance.world_from_object;
        for p in &mesh.positions {
            let p = world.transform_point3(p.as_dvec3()).as_vec3();
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        // A mirroring transform flips the faces, so their winding is reversed.
        let is_mirrored = world.matrix3.determinant() < 0.0;
        for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|i| i as usize + before)) {
            let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
            writeln!(out, "f {a} {b} {c}")?;
        }
        before += mesh.positions.len();
    }
    Ok(())
}

/// Name without control characters, on one line.
fn name(name: &str) -> String {
    if name.is_empty() { "object".into() } else { name.replace(char::is_control, " ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::{Family, triangles};
    use crate::load::{LoadOptions, load_bytes};
    use crate::render::World;

    #[test]
    fn faces_of_mirrored_instances_still_look_outwards() {
        let mut scene = Family::Tetra.scene(4);
        let volume = |scene: &Scene| {
            let shapes = World::new(scene).shapes;
            let sum = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| shapes.vertices[i as usize]);
                a.dot(b.cross(c))
            };
            shapes.triangles.iter().map(sum).sum::<f32>()
        };
        let read = |scene: &Scene| {
            let mut bytes = Vec::new();
            write(scene, &mut bytes).unwrap();
            load_bytes("a.obj".as_ref(), bytes, &LoadOptions::default()).unwrap().scene
        };
        let plain = volume(&read(&scene));
        for instance in &mut scene.instances {
            instance.world_from_object.matrix3.x_axis *= -1.0;
        }
        assert!(plain > 0.0 && (volume(&read(&scene)) / plain - 1.0).abs() < 1e-3, "{plain}");
    }

    #[test]
    fn every_triangle_is_read_back_where_it_was() {
        for family in [Family::Instances, Family::Mountain] {
            let scene = family.scene(800);
            let mut bytes = Vec::new();
            write(&scene, &mut bytes).unwrap();
            let read = load_bytes("a.obj".as_ref(), bytes, &LoadOptions::default()).unwrap().scene;
            assert_eq!(triangles(&read), triangles(&scene));
            let size = |scene: &crate::scene::Scene| {
                let shapes = World::new(scene).shapes;
                shapes.vertices.iter().fold(glam::Vec3::ZERO, |m, p| m.max(p.abs()))
            };
            let (was, is) = (size(&scene), size(&read));
            // +Z up became +Y up.
            assert!((was.x - is.x).abs() + (was.y - is.z).abs() + (was.z - is.y).abs() < 1e-4, "{was} {is}");
        }
    }
}
