//! The triangle of a mesh around a hit: interpolated attributes, texture coordinates, and normals perturbed by maps.

use super::shadow::curve::Curve;
use super::texture::{ColorSpace, TextureStore};
use super::world::Placement;
use crate::math::{DVec3, Vec2, Vec3, Vec4};
use crate::scene::{Material, Mesh, TexCoords, TextureRef, UvTransform};
use std::cell::Cell;

/// Edge lengths whose fourth powers neither overflow nor underflow.
const ORDINARY: std::ops::RangeInclusive<f32> = 1e-6..=1e6;

/// Gradients of the barycentric weights of a triangle's second and third corner in its plane, per world unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Gradients {
    pub second: Vec3,
    pub third: Vec3,
}

impl Gradients {
    /// Gradients of a triangle; zero if it has no area.
    pub(crate) fn new([a, b, c]: [Vec3; 3]) -> Self {
        let (e1, e2) = (b - a, c - a);
        let longest = e1.abs().max(e2.abs()).max_element();
        if ORDINARY.contains(&longest) {
            return Self::of_edges(e1, e2);
        }
        // Scales the edges to a length of about 1; powers of two are exact.
        let scale = libm::exp2f(-libm::floorf(libm::log2f(longest)).clamp(-126.0, 126.0));
        let Self { second, third } = Self::of_edges(e1 * scale, e2 * scale);
        Self { second: second * scale, third: third * scale }
    }

    #[inline(always)]
    fn of_edges(e1: Vec3, e2: Vec3) -> Self {
        let normal = e1.cross(e2);
        let inverse = 1.0 / normal.length_squared();
        if !inverse.is_finite() {
            return Self { second: Vec3::ZERO, third: Vec3::ZERO };
        }
        Self { second: e2.cross(normal) * inverse, third: normal.cross(e1) * inverse }
    }

    /// Change of texture coordinates along the axes of a footprint, from their differences along the edges.
    #[inline(always)]
    pub(crate) fn of_coordinates(&self, edges: [Vec2; 2], print: &Footprint) -> [Vec2; 2] {
        let change = |v: Vec3| edges[0] * self.second.dot(v) + edges[1] * self.third.dot(v);
        [change(print.along), change(print.across)]
    }

    /// Derivatives of the unit-length mesh normal along two directions in the plane of the triangle, from the corner normals,
    /// which must differ, and their weights.
    #[inline(always)]
    pub(crate) fn of_normal(
        &self,
        placement: &Placement,
        [a, b, c]: [Vec3; 3],
        [wa, wb, wc]: [f32; 3],
        ways: [Vec3; 2],
    ) -> [Vec3; 2] {
        let normal = turned(placement, a * wa + b * wb + c * wc);
        let length = normal.length();
        let (second, third) = (turned(placement, b - a) / length, turned(placement, c - a) / length);
        let normal = normal / length;
        let along = |way: Vec3| {
            let change = second * f64::from(self.second.dot(way)) + third * f64::from(self.third.dot(way));
            let change = (change - normal * normal.dot(change)).as_vec3();
            if change.is_finite() { change } else { Vec3::ZERO }
        };
        [along(ways[0]), along(ways[1])]
    }
}

#[inline(always)]
fn turned(placement: &Placement, normal: Vec3) -> DVec3 {
    placement.normal_from_object * normal.as_dvec3()
}

/// The triangle of a mesh around a hit: three corners and their barycentric weights.
pub(crate) struct Patch<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) placement: &'a Placement,
    pub(super) corners: [u32; 3],
    pub(super) weights: [f32; 3],
    pub(super) vertices: [Vec3; 3],
    /// Footprint over which maps are filtered.
    pub(super) print: Footprint,
    /// Cached coordinates of the last map: the maps of a material mostly share them.
    pub(super) last: Cell<Option<(TextureRef, Coordinates)>>,
    /// Cached last texel: one texture often serves several purposes.
    pub(super) read: Cell<Option<(TextureRef, ColorSpace, Vec4)>>,
}

/// Axes, in world space, of the ellipse in which a ray's cone meets a surface; each spans one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Footprint {
    pub(super) along: Vec3,
    pub(super) across: Vec3,
}

impl Footprint {
    /// Footprint of a ray without width.
    pub(crate) const NONE: Self = Self { along: Vec3::ZERO, across: Vec3::ZERO };

    /// Footprint of a cone of diameter `width` along the unit vector `dir` on a surface with unit normal `normal`.
    ///
    /// After T. Akenine-Möller et al., "Improved Shader and Texture Level of Detail Using Ray Cones" (2021).
    #[inline(always)]
    pub(crate) fn new(dir: Vec3, normal: Vec3, width: f32) -> Self {
        // The footprint of a grazing cone is unbounded; beyond this length the texture is at its coarsest mip level anyway.
        const LONGEST: f32 = 1e4;
        let axis = |v: Vec3| {
            let seen = (v - dir.dot(v) * dir).length();
            v * (width / seen.max(1.0 / LONGEST))
        };
        let slope = dir - normal.dot(dir) * normal;
        let along = slope.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
        Self { along: axis(along), across: axis(normal.cross(along)) }
    }
}

/// Texture coordinates at a point and their change along the two axes of a [`Footprint`].
#[derive(Clone, Copy)]
pub(super) struct Coordinates {
    pub uv: Vec2,
    pub along: Vec2,
    pub across: Vec2,
    /// Change along the edges to the second and the third corner.
    edges: [Vec2; 2],
}

/// Interpolates three corner colours: exact where these agree, so that an alpha that is the same everywhere is not smaller
/// anywhere.
#[inline(always)]
pub(crate) fn mixed_color([a, b, c]: [Vec4; 3], [_, second, third]: [f32; 3]) -> Vec4 {
    a + (b - a) * second + (c - a) * third
}

/// Vertex colour at a point of a triangle with these corners, linear RGBA; white when the mesh has none.
pub(super) fn color_at(mesh: &Mesh, corners: [u32; 3], weights: [f32; 3]) -> Vec4 {
    let [a, b, c] = corners.map(|i| mesh.colors.get(i as usize).copied());
    a.zip(b).zip(c).map_or(Vec4::ONE, |((a, b), c)| mixed_color([a, b, c], weights))
}

/// Texture coordinates of a map at the point, and those of the corners without the offset; `None` when the mesh has none.
pub(super) fn coordinates_at(
    mesh: &Mesh,
    corners: [u32; 3],
    weights: [f32; 3],
    map: &TextureRef,
) -> Option<(Vec2, [Vec2; 3])> {
    let (set, turn) = (mesh.uvs.get(map.uv_set as usize)?, Turn::new(&map.transform));
    let [a, b, c] = corners.map(|i| set.get(i as usize).map_or(Vec2::ZERO, |&uv| turn.apply(uv)));
    Some((a * weights[0] + b * weights[1] + c * weights[2] + map.transform.offset, [a, b, c]))
}

impl Patch<'_> {
    /// Moves the patch to another point of its triangle.
    pub(super) fn move_to(&mut self, weights: [f32; 3], print: Footprint) {
        (self.weights, self.print) = (weights, print);
        self.last.set(None);
        self.read.set(None);
    }

    #[inline]
    fn mix<T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>>(&self, values: &[T]) -> Option<T> {
        let [a, b, c] = self.corners;
        let value = |i: u32| values.get(i as usize).copied();
        let (a, b, c) = (value(a), value(b), value(c));
        Some(a? * self.weights[0] + b? * self.weights[1] + c? * self.weights[2])
    }

    /// Vertex colour, linear RGBA; white when the mesh has none.
    pub(crate) fn color(&self) -> Vec4 {
        color_at(self.mesh, self.corners, self.weights)
    }

    /// Texel at this point, linear RGBA.
    pub(crate) fn texel(&self, map: &TextureRef, space: ColorSpace, store: &TextureStore) -> Vec4 {
        if let Some((last, meaning, texel)) = self.read.get()
            && last == *map
            && meaning == space
        {
            return texel;
        }
        let at = self.coordinates(map);
        let texel = store.sample(map.texture, space, at.uv, at.along, at.across);
        self.read.set(Some((*map, space, texel)));
        texel
    }

    /// Alpha of the texture at this point, which does not depend on the colour space of the other channels.
    pub(crate) fn alpha(&self, map: &TextureRef, store: &TextureStore) -> f32 {
        match self.read.get() {
            Some((last, ColorSpace::Srgb, texel)) if last == *map => texel.w,
            _ => self.texel(map, ColorSpace::Linear, store).w,
        }
    }

    /// One channel of the texture at this point, linear, at the full resolution.
    pub(crate) fn channel<const CHANNEL: usize>(&self, map: &TextureRef, store: &TextureStore) -> f32 {
        store.channel::<CHANNEL>(map.texture, self.coordinates(map).uv)
    }

    pub(super) fn coordinates(&self, map: &TextureRef) -> Coordinates {
        match self.last.get() {
            Some((last, at)) if (last.uv_set, last.transform) == (map.uv_set, map.transform) => at,
            _ => {
                let at = self.find_coordinates(map);
                self.last.set(Some((*map, at)));
                at
            }
        }
    }

    fn find_coordinates(&self, map: &TextureRef) -> Coordinates {
        let Some((uv, [a, b, c])) = coordinates_at(self.mesh, self.corners, self.weights, map) else {
            return Coordinates { uv: Vec2::ZERO, along: Vec2::ZERO, across: Vec2::ZERO, edges: [Vec2::ZERO; 2] };
        };
        let edges = [b - a, c - a];
        let [along, across] = match self.print {
            Footprint::NONE => [Vec2::ZERO; 2],
            print => Gradients::new(self.vertices).of_coordinates(edges, &print),
        };
        Coordinates { uv, along, across, edges }
    }

    /// Interpolated shading normal, world space, on the side of the mesh's own normals.
    #[inline]
    pub(super) fn normal(&self) -> Option<Vec3> {
        smooth_normal(self.placement, self.mix(&self.mesh.normals)?)
    }

    /// Whether the corner normals differ, that is, the triangle stands for a curved surface.
    #[inline]
    pub(super) fn is_curved(&self) -> bool {
        self.corner_normals().is_some_and(differ)
    }

    /// The curved surface that the normals describe, on their own side or, with −1, on the other; `None` if it is flat.
    pub(super) fn curve(&self, side: f32) -> Option<Curve> {
        let normals = self.corner_normals().filter(|&normals| differ(normals))?;
        let [a, b, c] = normals.map(|normal| smooth_normal(self.placement, normal).map(|normal| normal * side));
        Some(Curve::new(self.vertices, [a?, b?, c?]))
    }

    #[inline]
    fn corner_normals(&self) -> Option<[Vec3; 3]> {
        let normal = |i: u32| self.mesh.normals.get(i as usize).copied();
        let [a, b, c] = self.corners.map(normal);
        Some([a?, b?, c?])
    }

    /// Derivatives of the unit-length mesh normal along two directions in the plane of the triangle; zero where it is flat.
    pub(super) fn bends(&self, ways: [Vec3; 2]) -> [Vec3; 2] {
        let Some(normals) = self.corner_normals().filter(|&normals| differ(normals)) else { return [Vec3::ZERO; 2] };
        Gradients::new(self.vertices).of_normal(self.placement, normals, self.weights, ways)
    }

    /// Variation of the mapped normal within `reach` of both axes of a footprint: the squares of the angles, summed.
    pub(super) fn turning_of_map(&self, map: &TextureRef, scale: f32, store: &TextureStore, reach: f32) -> f32 {
        let at = self.coordinates(map);
        turning_of(store.changes(map.texture, at.uv, [at.along, at.across], reach), scale)
    }

    /// Tangent and bitangent, orthonormal to `normal`: those of the mesh, or those of the texture coordinates.
    pub(super) fn tangents(&self, normal: Vec3, map: &TextureRef) -> Option<(Vec3, Vec3)> {
        let given = self.mix(&self.mesh.tangents).and_then(|t| given_tangent(self.placement, t, normal));
        let (tangent, sign) = given.or_else(|| self.tangent_of_coordinates(normal, map))?;
        Some((tangent, normal.cross(tangent) * sign))
    }

    /// The direction in which u grows, and the handedness that turns the bitangent against v, which runs down.
    fn tangent_of_coordinates(&self, normal: Vec3, map: &TextureRef) -> Option<(Vec3, f32)> {
        let [a, b] = self.coordinates(map).edges;
        let (e1, e2) = (self.vertices[1] - self.vertices[0], self.vertices[2] - self.vertices[0]);
        let area = a.x * b.y - b.x * a.y;
        if area == 0.0 {
            return None;
        }
        let along_u = (e1 * b.y - e2 * a.y) * area.signum();
        let along_v = (e2 * a.x - e1 * b.x) * area.signum();
        let tangent = perpendicular(along_u, normal)?;
        let sign = if normal.cross(tangent).dot(along_v) <= 0.0 { 1.0 } else { -1.0 };
        Some((tangent, sign))
    }

    /// As [`Self::tangents`], but along the transformed coordinates of a map: the frame in which its texels are given.
    fn tangents_of_map(&self, normal: Vec3, map: &TextureRef) -> Option<(Vec3, Vec3)> {
        let made_along = self.mesh.tangents_along;
        let made_for_it = made_along.is_none_or(|along| along.set == map.uv_set);
        let given = made_for_it.then(|| self.mix(&self.mesh.tangents)).flatten();
        let given = given.and_then(|t| given_tangent(self.placement, t, normal));
        let turn = FrameTurn::new(made_along, map);
        let along_map =
            given.map(|(tangent, sign)| turn.map_or((tangent, sign), |turn| turn.apply(tangent, sign, normal)));
        let (tangent, sign) = along_map.or_else(|| self.tangent_of_coordinates(normal, map))?;
        Some((tangent, normal.cross(tangent) * sign))
    }

    /// The normal as perturbed by a normal map, with its x and y scaled.
    #[inline]
    pub(crate) fn normal_mapped(
        &self,
        normal: Vec3,
        map: &TextureRef,
        scale: f32,
        store: &TextureStore,
    ) -> Option<Vec3> {
        let texel = self.texel(map, ColorSpace::Linear, store).truncate();
        if let Some(frame) = self.baked_frame(map) {
            return smooth_normal(self.placement, frame.decode(texel, scale));
        }
        let (tangent, bitangent) = self.tangents_of_map(normal, map)?;
        turned_by_texel(normal, [tangent, bitangent], texel, scale)
    }

    /// Frame in which a normal map is decoded; `None` without normals, or tangents along its coordinates, or where these vanish.
    #[inline]
    fn baked_frame(&self, map: &TextureRef) -> Option<BakedFrame> {
        let made_along = self.mesh.tangents_along;
        if made_along.is_some_and(|along| along.set != map.uv_set) {
            return None;
        }
        let (normal, tangent) = (self.mix(&self.mesh.normals)?, self.mix(&self.mesh.tangents)?);
        let turn = FrameTurn::new(made_along, map);
        let frame = BakedFrame::new(normal, tangent);
        let frame = turn.map_or(frame, |turn| turn.apply_to_baked(frame));
        frame.is_valid().then_some(frame)
    }

    /// The normal as perturbed by the material's bump map: by the slope of the heights, from differences one texel wide.
    ///
    /// J. F. Blinn, "Simulation of Wrinkled Surfaces" (1978), with heights in units of the texture's side.
    #[inline]
    pub(crate) fn bumped(&self, normal: Vec3, material: &Material, store: &TextureStore) -> Option<Vec3> {
        let map = material.bump_map.as_ref()?;
        let (tangent, bitangent) = self.tangents_of_map(normal, map)?;
        let at = self.coordinates(map);
        let height = |uv: Vec2| store.sample(map.texture, ColorSpace::Linear, uv, at.along, at.across).x;
        let texel = Vec2::ONE / store.size(map.texture).max(Vec2::ONE);
        let rise = |d: Vec2, width: f32| (height(at.uv + d) - height(at.uv - d)) / width;
        let du = rise(Vec2::new(0.5 * texel.x, 0.0), texel.x) * material.bump_scale;
        let dv = rise(Vec2::new(0.0, 0.5 * texel.y), texel.y) * material.bump_scale;
        // v runs down, against the bitangent.
        (normal - tangent * du + bitangent * dv).try_normalize()
    }
}

/// Tangent frame of a mesh at a point, in its own coordinates: interpolated from the corners, and neither normalized nor made
/// perpendicular.
///
/// Maps are baked so that normals decoded in this frame are those of the finely modelled surface (M. Mikkelsen, *Simulation of
/// Wrinkled Surfaces Revisited*, 2008).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BakedFrame {
    pub normal: Vec3,
    pub tangent: Vec3,
    pub bitangent: Vec3,
}

impl BakedFrame {
    /// Frame of an interpolated normal and tangent, which has the handedness of the bitangent in its last component.
    #[inline(always)]
    pub(crate) fn new(normal: Vec3, tangent: Vec4) -> Self {
        let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
        let tangent = tangent.truncate();
        Self { normal, tangent, bitangent: normal.cross(tangent) * sign }
    }

    /// Whether its vectors span space.
    #[inline(always)]
    pub(crate) fn is_valid(&self) -> bool {
        let length = self.bitangent.length_squared();
        (length > 0.0) & (length < f32::INFINITY)
    }

    /// The normal of a texel of a normal map, whose x and y are scaled; of any length.
    #[inline(always)]
    pub(crate) fn decode(&self, texel: Vec3, scale: f32) -> Vec3 {
        let texel = texel * 2.0 - 1.0;
        self.tangent * (texel.x * scale) + self.bitangent * (texel.y * scale) + self.normal * texel.z
    }
}

/// Whether the corner normals of a triangle differ.
#[inline(always)]
pub(super) fn differ([a, b, c]: [Vec3; 3]) -> bool {
    a != b || a != c
}

/// The tangent given by a file, interpolated between the corners, made perpendicular to `normal` and of unit length, and the sign
/// of its bitangent.
#[inline(always)]
pub(crate) fn given_tangent(placement: &Placement, mixed: Vec4, normal: Vec3) -> Option<(Vec3, f32)> {
    let along = (placement.world_from_object * mixed.truncate().as_dvec3()).as_vec3();
    // A mirrored instance reverses the handedness of the frame.
    let sign = if (mixed.w < 0.0) == placement.mirrored { 1.0 } else { -1.0 };
    Some((perpendicular(along, normal)?, sign))
}

/// Returns the normal perturbed by a texel of a normal map, with its x and y scaled, in the frame of tangent and bitangent.
#[inline(always)]
pub(crate) fn turned_by_texel(normal: Vec3, [tangent, bitangent]: [Vec3; 2], texel: Vec3, scale: f32) -> Option<Vec3> {
    let texel = texel * 2.0 - 1.0;
    (tangent * (texel.x * scale) + bitangent * (texel.y * scale) + normal * texel.z).try_normalize()
}

/// Variation of the mapped normal where its texels change by this much along two directions: the squares of the angles, summed.
#[inline(always)]
pub(crate) fn turning_of([along, across]: [Vec4; 2], scale: f32) -> f32 {
    let scale = Vec3::new(scale, scale, 1.0);
    // Components run from -1 to 1, texels from 0 to 1.
    let turning = |change: Vec4| 4.0 * (change.truncate() * scale).length_squared();
    turning(along) + turning(across)
}

/// The linear part of a texture transform; the offset is added once, after interpolation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    x_axis: Vec2,
    y_axis: Vec2,
}

impl Turn {
    pub(crate) fn new(transform: &UvTransform) -> Self {
        let [x_axis, y_axis] = transform.axes();
        Self { x_axis, y_axis }
    }

    pub(crate) fn apply(&self, uv: Vec2) -> Vec2 {
        self.x_axis * uv.x + self.y_axis * uv.y
    }
}

/// Rotation of tangents to run along the coordinates of a map, where its transform rotates or mirrors the coordinates that the
/// tangents were made for.
///
/// A texture laid out by transformed coordinates is the same as one on coordinates that were transformed beforehand, and has the
/// same frames (Khronos, *KHR_texture_transform*). The tangents in a file run along its untransformed coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameTurn {
    /// Direction in which the map's u grows, in terms of the u and the v of the tangents; of unit length.
    along: Vec2,
    /// Negative where the transform mirrors.
    sign: f32,
}

impl FrameTurn {
    /// `None` where frames stay unchanged.
    pub(crate) fn new(made_along: Option<TexCoords>, map: &TextureRef) -> Option<Self> {
        let (from, to) = (made_along.unwrap_or_default().transform, map.transform);
        if (from.rotation, from.scale) == (to.rotation, to.scale)
            || [from, to].iter().all(UvTransform::keeps_directions)
        {
            return None;
        }
        let (from, to) = (Turn::new(&from), Turn::new(&to));
        let determinants = [from, to].map(|turn| turn.x_axis.perp_dot(turn.y_axis));
        // The inverse of the map's transform takes (1, 0) to this direction.
        let along_map = Vec2::new(to.y_axis.y, -to.x_axis.y) * determinants[1].signum();
        let along = from.apply(along_map).try_normalize()?;
        let determinant = determinants[0] * determinants[1];
        let turns = along != Vec2::X || determinant < 0.0;
        (turns && determinant != 0.0).then_some(Self { along, sign: determinant.signum() })
    }

    /// Rotates a tangent, given with the sign of its bitangent, about a normal. v runs down, against the bitangent.
    #[inline(always)]
    pub(crate) fn apply(&self, tangent: Vec3, sign: f32, normal: Vec3) -> (Vec3, f32) {
        let bitangent = normal.cross(tangent) * sign;
        (tangent * self.along.x - bitangent * self.along.y, sign * self.sign)
    }

    /// [`Self::apply`] for a frame that is not orthonormal.
    #[inline(always)]
    pub(crate) fn apply_to_baked(&self, frame: BakedFrame) -> BakedFrame {
        let BakedFrame { normal, tangent, bitangent } = frame;
        let turned = tangent * self.along.x - bitangent * self.along.y;
        BakedFrame {
            normal,
            tangent: turned,
            bitangent: (bitangent * self.along.x + tangent * self.along.y) * self.sign,
        }
    }
}

/// `v` without its component along `normal`, of unit length.
#[inline(always)]
fn perpendicular(v: Vec3, normal: Vec3) -> Option<Vec3> {
    (v - normal * normal.dot(v)).try_normalize()
}

/// Interpolated normal of a mesh, transformed by its instance, of unit length; `None` if it has no direction.
#[inline(always)]
pub(crate) fn smooth_normal(placement: &Placement, interpolated: Vec3) -> Option<Vec3> {
    let normal = (placement.normal_from_object * interpolated.as_dvec3()).try_normalize()?.as_vec3();
    normal.is_finite().then_some(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_that_is_the_same_at_all_corners_is_the_same_between_them() {
        let mut random = crate::math::random::Random::new(9);
        for _ in 0..10_000 {
            let (color, u, v) = (random.unit(), random.unit(), random.unit());
            let all = Vec4::splat(color);
            assert_eq!(mixed_color([all; 3], [1.0 - u - v, u, v]), all);
        }
        let [a, b, c] = [Vec4::X, Vec4::Y, Vec4::Z];
        assert_eq!(mixed_color([a, b, c], [0.25, 0.5, 0.25]), Vec4::new(0.25, 0.5, 0.25, 0.0));
    }

    #[test]
    fn weights_grow_as_much_faster_as_a_triangle_is_smaller() {
        let triangle = [Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.9, 0.1, 0.4), Vec3::new(0.2, 0.8, 0.7)];
        let one = Gradients::new(triangle);
        assert!(one.second.dot(triangle[1] - triangle[0]) > 0.999 && one.third.dot(triangle[1] - triangle[0]) < 1e-6);
        for power in [-100, -40, -24, -10, 10, 24, 40, 100] {
            let scale = libm::exp2f(power as f32);
            let scaled = Gradients::new(triangle.map(|p| p * scale));
            assert_eq!(Gradients { second: scaled.second * scale, third: scaled.third * scale }, one, "2^{power}");
        }
        assert_eq!(Gradients::new([Vec3::ONE; 3]), Gradients::default());
    }
}
