//! Invariants of every loaded scene, whatever the file.

use crate::load::Loaded;

/// Asserts that every index is in range, every array is empty or full, and every number is finite.
pub(in crate::load) fn assert_sound(loaded: &Loaded) {
    let scene = &loaded.scene;
    assert_eq!(scene.meshes.len(), scene.instances.len());
    let mut drawn = 0u64;
    for mesh in &scene.meshes {
        let n = mesh.positions.len();
        assert!((mesh.material as usize) < scene.materials.len());
        assert!(mesh.triangles.iter().flatten().chain(&mesh.polygon_corners).all(|&i| (i as usize) < n));
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        assert!(mesh.normals.is_empty() || mesh.normals.len() == n);
        assert!(mesh.normals.iter().all(|v| (v.length() - 1.0).abs() < 1e-4), "{:?}", mesh.normals);
        assert!(mesh.uvs.iter().all(|uvs| uvs.len() == n && uvs.iter().all(|uv| uv.is_finite())));
        assert!(mesh.colors.is_empty() || mesh.colors.len() == n);
        assert!(mesh.face_of_triangle.is_empty() || mesh.face_of_triangle.len() == mesh.triangles.len());
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            assert!(a != b && b != c && c != a);
        }
        let mut numbers: Vec<u32> = match mesh.face_of_triangle.is_empty() {
            true => (0..mesh.triangles.len() as u32).collect(),
            false => mesh.face_of_triangle.clone(),
        };
        numbers.dedup();
        drawn += (numbers.len() + mesh.polygons.len()) as u64;
        assert!(mesh.polygons.iter().all(|p| p.len >= 3 && (p.first + p.len) as usize <= mesh.polygon_corners.len()));
    }
    let facts = &loaded.facts;
    let nowhere: u64 = facts.dropped.iter().filter(|d| d.0.contains("point or line")).map(|d| d.1).sum();
    assert_eq!(drawn + nowhere, facts.faces + facts.wires.points + facts.wires.lines);
}
