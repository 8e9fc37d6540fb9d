//! Parts of a model, visited one by one: faces, spheres and cones in world space.

use super::bounds::Bounds;
use super::crowd::Crowd;
use crate::math::{DAffine3, DMat3, DVec3, Vec3};
use crate::scene::mesh::normal_from_object;
use crate::scene::{Mesh, Scene};
use rayon::prelude::*;

/// Facing along an axis below which a model faces away; negative, as closed bodies, whose normals cancel, face in no direction.
pub(super) const AWAY: f64 = -0.1;

/// Number of triangles in a scene, polygons counted as their fans.
pub(super) fn faces(scene: &Scene) -> u64 {
    scene.instances.iter().filter_map(|instance| scene.meshes.get(instance.mesh as usize)).map(faces_of).sum()
}

/// Number of triangles in a mesh, likewise.
pub(super) fn faces_of(mesh: &Mesh) -> u64 {
    let fans = mesh.polygons.iter().map(|polygon| u64::from(polygon.len.saturating_sub(2)));
    mesh.triangles.len() as u64 + fans.sum::<u64>()
}

/// Mean normal of all faces, weighted by area: length 1 for a card, 0 for a closed body.
pub(super) fn facing(scene: &Scene) -> DVec3 {
    let mut own: Vec<Option<Facing>> = vec![None; scene.meshes.len()];
    let mut all = Facing::default();
    for instance in &scene.instances {
        let Some(mesh) = scene.meshes.get(instance.mesh as usize) else { continue };
        let m = &instance.world_from_object.matrix3;
        let faces = match area_scale(m) {
            Some(scale) => {
                let own = own[instance.mesh as usize].get_or_insert_with(|| Facing::of(mesh, &DAffine3::IDENTITY));
                Facing { normal: normal_from_object(m) * own.normal, area: scale * own.area }
            }
            None if m.determinant() < 0.0 => Facing::of(mesh, &instance.world_from_object).turned_round(),
            None => Facing::of(mesh, &instance.world_from_object),
        };
        all.join(faces);
    }
    if all.area > 0.0 { all.normal / all.area } else { DVec3::ZERO }
}

/// Area-weighted sum of face normals.
#[derive(Clone, Copy, Default)]
pub(super) struct Facing {
    /// Sum of the normals, each as long as the area of its face.
    normal: DVec3,
    pub area: f64,
}

impl Facing {
    /// Sums over the faces of a placed mesh.
    pub(super) fn of(mesh: &Mesh, world_from_object: &DAffine3) -> Self {
        let mut all = Self::default();
        let add = |all: &mut Self, part: &Part| all.join(Self { normal: part.normal, area: part.area });
        gather_faces(mesh, world_from_object, &mut all, &Self::default, &add, &Self::join);
        all
    }

    fn turned_round(self) -> Self {
        Self { normal: -self.normal, ..self }
    }

    fn join(&mut self, other: Self) {
        self.normal += other.normal;
        self.area += other.area;
    }
}

/// Factor by which a matrix scales areas if it scales all of them alike; `None` otherwise.
pub(super) fn area_scale(m: &DMat3) -> Option<f64> {
    let squares = DVec3::from(m.to_cols_array_2d().map(|axis| DVec3::from(axis).length_squared()));
    let across = DVec3::new(m.x_axis.dot(m.y_axis), m.y_axis.dot(m.z_axis), m.z_axis.dot(m.x_axis));
    let scale = squares.element_sum() / 3.0;
    let off = (squares - scale).abs().max(across.abs()).max_element();
    (off <= 1e-6 * scale).then_some(scale)
}

/// A face, sphere or cone, or all faces of a small instance.
pub(super) struct Part {
    pub lo: DVec3,
    pub hi: DVec3,
    pub center: DVec3,
    /// Normal, as long as the area.
    pub normal: DVec3,
    pub area: f64,
    /// Number of faces, spheres or cones in the part.
    pub faces: u64,
}

/// Granularity of the parts that are visited.
#[derive(Clone, Copy)]
pub(super) enum Granularity<'a> {
    /// Each face.
    Faces,
    /// Each face, but instances that are small in these bounds as one part.
    Crowd(&'a Crowd, &'a Bounds),
}

/// Box of the parts that `keep` selects; `None` if there are none.
pub(super) fn hull(
    scene: &Scene,
    granularity: Granularity,
    keep: impl Fn(&Part) -> bool + Sync,
) -> Option<(DVec3, DVec3)> {
    let nothing = || (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let join = |all: &mut (DVec3, DVec3), more: (DVec3, DVec3)| *all = (all.0.min(more.0), all.1.max(more.1));
    let add = |all: &mut (DVec3, DVec3), part: &Part| {
        if keep(part) {
            join(all, (part.lo, part.hi));
        }
    };
    let (lo, hi) = gather(scene, granularity, nothing, add, join);
    lo.cmple(hi).all().then_some((lo, hi))
}

/// Faces per parallel task: independent of the number of threads, so that sums are, too.
pub(super) const CHUNK: usize = 1 << 15;

/// Sums over every face, sphere and cone with finite corners, starting from `nothing`; `join` combines partial sums.
pub(super) fn gather<T: Send>(
    scene: &Scene,
    granularity: Granularity,
    nothing: impl Fn() -> T + Sync,
    add: impl Fn(&mut T, &Part) + Sync,
    join: impl Fn(&mut T, T),
) -> T {
    let mut all = nothing();
    for instance in &scene.instances {
        let Some(mesh) = scene.meshes.get(instance.mesh as usize) else { continue };
        if let Granularity::Crowd(crowd, bounds) = granularity
            && let Some(part) = crowd.part(instance, bounds)
        {
            add(&mut all, &part);
            continue;
        }
        gather_faces(mesh, &instance.world_from_object, &mut all, &nothing, &add, &join);
    }
    solids(scene).for_each(|part| add(&mut all, &part));
    all
}

/// Adds the faces of a placed mesh to `all` in the same way.
fn gather_faces<T: Send>(
    mesh: &Mesh,
    world_from_object: &DAffine3,
    all: &mut T,
    nothing: &(impl Fn() -> T + Sync),
    add: &(impl Fn(&mut T, &Part) + Sync),
    join: &impl Fn(&mut T, T),
) {
    let origin = world_from_object.translation;
    if *world_from_object == DAffine3::IDENTITY {
        let place = |i: u32| mesh.positions.get(i as usize).map_or(origin, |p| p.as_dvec3());
        return Faces { mesh, place }.gather(all, nothing, add, join);
    }
    // Corners are shared between faces, so each is placed once.
    let world = |p: &Vec3| world_from_object.transform_point3(p.as_dvec3());
    let places: Vec<DVec3> = mesh.positions.par_iter().with_min_len(CHUNK).map(world).collect();
    let place = |i: u32| places.get(i as usize).copied().unwrap_or(origin);
    Faces { mesh, place }.gather(all, nothing, add, join);
}

/// Faces of an instance.
struct Faces<'a, P> {
    mesh: &'a Mesh,
    /// Position of a vertex, world space; that of the instance if there is no such vertex.
    place: P,
}

impl<P: Fn(u32) -> DVec3 + Sync> Faces<'_, P> {
    fn gather<T: Send>(
        &self,
        all: &mut T,
        nothing: &(impl Fn() -> T + Sync),
        add: &(impl Fn(&mut T, &Part) + Sync),
        join: &impl Fn(&mut T, T),
    ) {
        let of = |triangles: &[[u32; 3]]| {
            let mut sum = nothing();
            self.visit(triangles, |part| add(&mut sum, part));
            sum
        };
        match self.mesh.triangles.len() {
            ..=CHUNK => self.visit(&self.mesh.triangles, |part| add(all, part)),
            _ => {
                let sums: Vec<T> = self.mesh.triangles.par_chunks(CHUNK).map(of).collect();
                sums.into_iter().for_each(|sum| join(all, sum));
            }
        }
        self.visit_polygons(|part| add(all, part));
    }

    fn visit(&self, triangles: &[[u32; 3]], mut f: impl FnMut(&Part)) {
        for triangle in triangles {
            Part::face(triangle.map(&self.place)).iter().for_each(&mut f);
        }
    }

    /// Visits polygons as fans of triangles around their first corners.
    fn visit_polygons(&self, mut f: impl FnMut(&Part)) {
        for polygon in &self.mesh.polygons {
            let first = polygon.first as usize;
            let corners = self.mesh.polygon_corners.get(first..first + polygon.len as usize).unwrap_or_default();
            for pair in corners.windows(2).skip(1) {
                Part::face([corners[0], pair[0], pair[1]].map(&self.place)).iter().for_each(&mut f);
            }
        }
    }
}

impl Part {
    /// Part of a triangle; `None` if a corner is not finite. Inlined, so that unused results are not computed.
    #[inline(always)]
    fn face([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let (lo, hi) = (a.min(b).min(c), a.max(b).max(c));
        let normal = (b - a).cross(c - a) * 0.5;
        // The mean of three equal numbers may differ from them by rounding.
        let center = ((a + b + c) / 3.0).clamp(lo, hi);
        let face = Self { lo, hi, center, normal, area: normal.length(), faces: 1 };
        (lo.is_finite() && hi.is_finite()).then_some(face)
    }
}

/// All spheres and cones.
pub(super) fn solids(scene: &Scene) -> impl Iterator<Item = Part> {
    let spheres = scene.spheres.iter().map(|sphere| {
        let (lo, hi) = (sphere.center - sphere.radius, sphere.center + sphere.radius);
        let area = 4.0 * std::f64::consts::PI * sphere.radius * sphere.radius;
        Part { lo, hi, center: sphere.center, normal: DVec3::ZERO, area, faces: 1 }
    });
    let cones = scene.cones.iter().map(|cone| {
        let ((lo, hi), length, dr) =
            (cone.bounds(), cone.base.distance(cone.apex), cone.base_radius - cone.apex_radius);
        let slant = (length * length + dr * dr).sqrt();
        let area = std::f64::consts::PI * (cone.base_radius + cone.apex_radius) * slant;
        Part { lo, hi, center: (lo + hi) * 0.5, normal: DVec3::ZERO, area, faces: 1 }
    });
    spheres.chain(cones)
}
