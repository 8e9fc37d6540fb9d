//! Neutral File Format (E. Haines, *A Proposal for Standard Graphics Environments*, 1987) -> scene.
//!
//! | statement | meaning |
//! |---|---|
//! | `v from x y z at x y z up x y z angle a hither h resolution w h` | the camera; `a` is the whole angle of view, degrees |
//! | `b r g b` | background |
//! | `l x y z [r g b]` | a point light that does not fade |
//! | `f r g b Kd Ks shine T ior` | material of the following shapes |
//! | `p n`, then n times `x y z` | polygon |
//! | `pp n`, then n times `x y z nx ny nz` | polygon with a normal for each corner |
//! | `s x y z r` | sphere |
//! | `c x y z r x y z r` | cone or cylinder, open at both ends |
//!
//! What the format leaves open is decided so: colours are linear; diffuse and ambient colour are the colour times Kd,
//! highlight Ks, mirror the colour times Ks, transmission the colour times T, but no more than the mirror leaves; every
//! surface is seen from both sides, so the sign of a radius means nothing; n lights and the ambient light are each as
//! strong as √n / 2n, as the format's text suggests; rays that leave see the background. Polygons of one material become one
//! mesh.

mod faces;
mod words;

use super::limits::Budget;
use super::paths::Resolver;
use super::place::{LeftOut, is_usable};
use super::{Diagnostic, Facts, LoadError, LoadOptions, Loaded, Source, Warnings};
use crate::math::{DVec3, Vec3};
use crate::scene::{
    Background, Camera, Cone, Environment, Falloff, Light, LightKind, Material, Phong, Projection, Reflection,
    RenderHints, Scene, Sphere, UpAxis,
};
use faces::Faces;
use std::collections::HashMap;
use std::mem::size_of;
use std::path::Path;
use words::Words;

/// Loads an NFF file; its memory is taken from `budget`.
///
/// # Errors
/// At the first invalid statement, with its line, or when memory would exceed the budget. A file without shapes
/// is an empty scene.
pub fn load(source: &Source, options: &LoadOptions, budget: &mut Budget) -> Result<Loaded, LoadError> {
    if std::str::from_utf8(&source.bytes).is_err() {
        // Each invalid byte is replaced by a character of three bytes.
        budget.take(source.bytes.len() as u64, 3).map_err(|over| Diagnostic::over_budget(&source.path, over))?;
    }
    let text = String::from_utf8_lossy(&source.bytes);
    let mut reader = Reader {
        words: Words::new(&source.path, text.trim_start_matches('\u{feff}')),
        file: &source.path,
        budget,
        scene: Scene::default(),
        material: None,
        fills: HashMap::new(),
        faces: Faces::new(options.polygons),
        flat: 0,
        far: 0,
    };
    reader.statements()?;

    let Reader { mut scene, faces, flat, far, .. } = reader;
    let (flat, far) = (flat + faces.flat, far + faces.far);
    let drawn = faces.finish(&mut scene);
    let mut warnings = Warnings::default();
    let mut dropped = Vec::new();
    if flat > 0 {
        let text = format!("{flat} shapes without extent are left out");
        warnings.push(Diagnostic::new("nff-no-extent", &source.path, "", text));
        dropped.push(("without extent".into(), flat));
    }
    for (why, count) in [(&LeftOut::TOO_FAR, far), (&LeftOut::COLLAPSED, drawn.collapsed)] {
        why.tell(count, &source.path, String::new(), &mut dropped, &mut warnings);
    }
    finish(&mut scene, options);
    let (files, hash, _) = Resolver::new(source, options).finish();
    let (format, faces, max_rounding) = ("NFF".into(), drawn.count, drawn.max_rounding);
    let facts = Facts { format, faces, dropped, max_rounding, files, hash, ..Facts::default() };
    Ok(Loaded { scene, warnings: warnings.into_vec(), facts })
}

/// Sets what depends on the whole file: the strength of lights, the environment, and the up axis.
fn finish(scene: &mut Scene, options: &LoadOptions) {
    let lights = scene.lights.len() as f32;
    if lights > 0.0 {
        let strength = lights.sqrt() / (2.0 * lights);
        scene.lights.iter_mut().for_each(|light| light.intensity *= strength);
        scene.ambient = Vec3::splat(strength);
    }
    if let Some(Background::Color(color)) = scene.background {
        scene.environment = Environment::Constant(color);
    }
    scene.up = options.up.unwrap_or(scene.up);
    // The depth of the format's text, which counts the eye ray: 5.
    scene.hints.depth = Some(4);
    scene.hints.tone_map = Some("none".into());
}

struct Reader<'a> {
    words: Words<'a>,
    file: &'a Path,
    budget: &'a mut Budget,
    scene: Scene,
    /// Material of the following shapes.
    material: Option<u32>,
    /// Materials by the bits of their fill's numbers.
    fills: HashMap<[u64; 8], u32>,
    faces: Faces,
    /// Spheres and cones without extent.
    flat: u64,
    /// Spheres and cones too far away or too large.
    far: u64,
}

/// Bytes that a material takes, with its name and its table entry, in lists that have grown by doubling.
const FILL: u64 = 2 * (size_of::<Material>() + 2 * size_of::<[u64; 8]>() + 128) as u64;

impl Reader<'_> {
    fn statements(&mut self) -> Result<(), Diagnostic> {
        while let Some(word) = self.words.next() {
            match word {
                "v" => self.view()?,
                "b" => self.scene.background = Some(Background::Color(self.words.point("b")?.as_vec3())),
                "l" => self.light()?,
                "f" => self.fill()?,
                "p" => self.polygon("p", false)?,
                "pp" => self.polygon("pp", true)?,
                "s" => self.sphere()?,
                "c" => self.cone()?,
                _ => {
                    let text = format!("`{word}` is no statement");
                    return Err(self.words.fault(text, "NFF has v, b, l, f, p, pp, s and c"));
                }
            }
        }
        Ok(())
    }

    fn view(&mut self) -> Result<(), Diagnostic> {
        let (mut eye, mut at, mut up, mut angle, mut size) = (DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 45.0, None);
        let (mut line_of_angle, mut line_of_place) = (self.words.line, self.words.line);
        while let Some(key @ ("from" | "at" | "up" | "angle" | "hither" | "resolution")) = self.words.peek() {
            self.words.next();
            match key {
                "from" => (eye, line_of_place) = (self.words.point(key)?, self.words.line),
                "at" => (at, line_of_place) = (self.words.point(key)?, self.words.line),
                "up" => up = self.words.point(key)?,
                "angle" => (angle, line_of_angle) = (self.words.number(key)?, self.words.line),
                // A near distance, for renderers that need one; not used.
                "hither" => _ = self.words.number(key)?,
                _ => size = Some((self.words.whole(key, 1)?, self.words.whole(key, 1)?)),
            }
        }
        if !(angle > 0.0 && angle < 180.0) {
            let remedy = "give it more than 0 and less than 180 degrees";
            return Err(self.words.fault_at(line_of_angle, format!("`angle` is {angle}"), remedy));
        }
        if eye == at {
            let text = "`from` and `at` are the same point";
            return Err(self.words.fault_at(line_of_place, text, "move one of them"));
        }
        self.scene.cameras = vec![Camera {
            name: String::new(),
            projection: Projection::Perspective { y_fov: angle.to_radians(), aspect: None },
            world_from_camera: Camera::look_at(eye, at, up),
        }];
        self.scene.hints = RenderHints { size, camera: Some(0), ..RenderHints::default() };
        self.scene.up = if up.z.abs() > up.y.abs() { UpAxis::Z } else { UpAxis::Y };
        Ok(())
    }

    fn light(&mut self) -> Result<(), Diagnostic> {
        let position = self.words.point("l")?;
        let colored = self.words.peek().is_some_and(|word| word.parse::<f64>().is_ok());
        let intensity = if colored { self.words.point("l")?.as_vec3() } else { Vec3::ONE };
        let kind = LightKind::Point { position, falloff: Falloff::None };
        self.take(2 * size_of::<Light>() as u64)?;
        self.scene.lights.push(Light { name: String::new(), intensity, kind, shadows: true, size: 0.0 });
        Ok(())
    }

    fn fill(&mut self) -> Result<(), Diagnostic> {
        let numbers = self.words.numbers::<8>("f")?;
        let key = numbers.map(f64::to_bits);
        if !self.fills.contains_key(&key) {
            self.take(FILL)?;
        }
        let id = *self.fills.entry(key).or_insert_with(|| {
            let [r, g, b, kd, ks, shine, t, ior] = numbers;
            let name = numbers.map(|x| x.to_string()).join(" ");
            let color = DVec3::new(r, g, b);
            let [diffuse, mirror, transmission] =
                [color * kd, color * ks, color * t].map(|c| c.max(DVec3::ZERO).as_vec3());
            #[expect(clippy::cast_possible_truncation, reason = "materials are f32")]
            let phong = Phong {
                ambient: diffuse,
                specular: Vec3::splat(ks.max(0.0) as f32),
                shininess: shine.max(0.0) as f32,
                mirror,
                transmission,
                // The index of opaque materials means nothing, and is often 0.
                ior: if t > 0.0 && ior >= 1.0 { ior as f32 } else { 1.0 },
                ..Phong::default()
            };
            self.scene.materials.push(Material {
                name,
                base_color: diffuse,
                reflection: Reflection::Phong(phong),
                ..Material::plain()
            });
            index(self.scene.materials.len() - 1)
        });
        self.material = Some(id);
        Ok(())
    }

    /// Material of the following shapes; a plain one where the file has set none yet.
    fn material(&mut self) -> u32 {
        if self.material.is_none() {
            self.scene.materials.push(Material::plain());
        }
        *self.material.get_or_insert(index(self.scene.materials.len() - 1))
    }

    /// Takes `bytes` bytes of the budget, or refuses the file.
    fn take(&mut self, bytes: u64) -> Result<(), Diagnostic> {
        self.budget.take(bytes, 1).map_err(|over| Diagnostic::over_budget(self.file, over))
    }

    fn polygon(&mut self, of: &str, smooth: bool) -> Result<(), Diagnostic> {
        let corners = self.words.whole(of, 3)?;
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        for _ in 0..corners {
            points.push(self.words.point(of)?);
            if smooth {
                normals.push(self.words.point(of)?);
            }
        }
        let material = self.material();
        let added = self.faces.add(material, &points, &normals, self.budget);
        added.map_err(|over| Diagnostic::over_budget(self.file, over))
    }

    fn sphere(&mut self) -> Result<(), Diagnostic> {
        let (center, radius) = (self.words.point("s")?, self.words.number("s")?.abs());
        let material = self.material();
        if !(is_usable(center) && is_usable(DVec3::splat(radius))) {
            self.far += 1;
        } else if radius > 0.0 {
            self.take(2 * size_of::<Sphere>() as u64)?;
            self.scene.spheres.push(Sphere { name: String::new(), center, radius, material });
        } else {
            self.flat += 1;
        }
        Ok(())
    }

    fn cone(&mut self) -> Result<(), Diagnostic> {
        let (base, base_radius) = (self.words.point("c")?, self.words.number("c")?.abs());
        let (apex, apex_radius) = (self.words.point("c")?, self.words.number("c")?.abs());
        let material = self.material();
        let radii = DVec3::new(base_radius, apex_radius, 0.0);
        if ![base, apex, radii].into_iter().all(is_usable) {
            self.far += 1;
        } else if base != apex && base_radius.max(apex_radius) > 0.0 {
            self.take(2 * size_of::<Cone>() as u64)?;
            self.scene.cones.push(Cone { name: String::new(), base, base_radius, apex, apex_radius, material });
        } else {
            self.flat += 1;
        }
        Ok(())
    }
}

#[expect(clippy::cast_possible_truncation, reason = "memory for 2^32 of anything was not granted")]
fn index(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
mod tests;
