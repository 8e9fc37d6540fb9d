//! Environment and default lights of a scene, as the command line wants them.

use super::job::Look;
use super::parse::Env;
use super::picture;
use super::read;
use crate::load::panorama::{self, LoadedPanorama};
use crate::load::paths::FileRead;
use crate::load::{Limits, LoadError, Loaded};
use crate::scene::default_light::{self, DefaultLight};
use crate::scene::{Camera, Environment, LightKind, Scene};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use xxhash_rust::xxh3::xxh3_128;

/// Sets the environment of `--env`.
///
/// # Errors
/// If it names a picture that cannot be used.
pub(super) fn place(look: &Look, limits: &Limits, loaded: &mut Loaded) -> Result<(), LoadError> {
    match &look.env {
        None => {}
        Some(Env::BuiltIn(environment)) => loaded.scene.environment = *environment,
        Some(Env::File(file)) => {
            let left = read::remaining_limits(limits, loaded);
            let LoadedPanorama { mut panorama, warnings, hash } = look.env_read.panorama(file, &left)?;
            #[expect(clippy::cast_possible_truncation, reason = "an angle")]
            let rotation = (look.env_rotate % 360.0).to_radians() as f32;
            panorama.rotation = rotation;
            loaded.scene.environment = Environment::Panorama;
            loaded.scene.panorama = Some(panorama);
            loaded.warnings.extend(warnings);
            loaded.facts.files.push(FileRead { path: file.clone(), hash });
            let hashes = [loaded.facts.hash, hash].map(u128::to_le_bytes);
            loaded.facts.hash = xxh3_128(hashes.as_flattened());
        }
    }
    Ok(())
}

/// Panorama of `--env`, read once for all models of a command.
#[derive(Clone, Default)]
pub(super) struct EnvRead(Arc<Mutex<Option<(PathBuf, LoadedPanorama)>>>);

/// Independent of what was read: [`up_to_date`](super::up_to_date) compares requests by their debug text.
impl fmt::Debug for EnvRead {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("EnvRead").finish_non_exhaustive()
    }
}

impl EnvRead {
    /// Reads the panorama, unless it was already read for another model and fits into the memory left.
    fn panorama(&self, file: &Path, limits: &Limits) -> Result<LoadedPanorama, LoadError> {
        // Other threads that need it wait: reading it twice would take longer, and twice the memory. The waiting threads render
        // inputs in parallel, and do not take part in each other's work.
        let mut read = self.read();
        if let Some((_, read)) = read.as_ref().filter(|(of, read)| of == file && read.fits(limits)) {
            return Ok(read.clone());
        }
        let loaded = panorama::load(file, limits)?;
        Ok(read.insert((file.to_owned(), loaded)).1.clone())
    }

    /// Memory that the panorama occupies, in bytes.
    pub(super) fn kept(&self) -> u64 {
        self.read().as_ref().map_or(0, |(_, read)| read.bytes())
    }

    /// Frees that memory; the panorama is read again when needed.
    pub(super) fn forget(&self) {
        *self.read() = None;
    }

    fn read(&self) -> MutexGuard<'_, Option<(PathBuf, LoadedPanorama)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Calls `work` with the scene as lit for `camera`: with default lamps if it has none, suns of the requested size, and the
/// background. Afterwards the scene is restored for the next view.
pub(super) fn lit<T>(
    look: &Look,
    loaded: &mut Loaded,
    camera: &Camera,
    work: impl FnOnce(&Loaded, DefaultLight) -> T,
) -> T {
    let (lights, environment) = (loaded.scene.lights.clone(), loaded.scene.environment);
    let background = loaded.scene.background;
    let light = light(look, &mut loaded.scene, camera);
    loaded.scene.background = Some(picture::background(look.background, &loaded.scene));
    let done = work(loaded, light);
    let scene = &mut loaded.scene;
    (scene.lights, scene.environment, scene.background) = (lights, environment, background);
    done
}

/// Lights the scene for `camera`: adds default lamps if it has none, unless darkness was requested, and sets the size of suns.
fn light(look: &Look, scene: &mut Scene, camera: &Camera) -> DefaultLight {
    // A scene without an environment is black by default; if typed, black is intended.
    let light = match look.env {
        Some(Env::BuiltIn(Environment::Black)) => DefaultLight::NotWanted,
        _ => default_light::add_if_missing(scene, camera),
    };
    if let Some(degrees) = look.sun_size {
        let suns = scene.lights.iter_mut().filter(|l| matches!(l.kind, LightKind::Directional { .. }) && l.size == 0.0);
        suns.for_each(|light| light.size = 0.5 * degrees.to_radians());
    }
    // Default lamps bring the studio along; a requested environment takes precedence.
    if let Some(Env::BuiltIn(environment)) = look.env {
        scene.environment = environment;
    }
    light
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panorama_is_read_once_for_all_models_that_leave_room_for_it() {
        let folder = tempfile::tempdir().unwrap();
        let (file, read) = (folder.path().join("sky.png"), EnvRead::default());
        ::image::RgbImage::from_pixel(64, 32, ::image::Rgb([188, 90, 10])).save(&file).unwrap();
        let limits = Limits::default();
        let first = read.panorama(&file, &limits).unwrap();
        std::fs::remove_file(&file).unwrap();
        assert_eq!(format!("{read:?}"), format!("{:?}", EnvRead::default()), "what is asked for stays the same");
        let second = read.clone().panorama(&file, &limits).unwrap();
        assert!(Arc::ptr_eq(&first.panorama.texels, &second.panorama.texels) && first.hash == second.hash);
        assert_eq!(read.kept(), 64 * 32 * panorama::PER_PIXEL);
        let other = folder.path().join("other.png");
        ::image::RgbImage::from_pixel(4, 2, ::image::Rgb([1, 2, 3])).save(&other).unwrap();
        let third = read.panorama(&other, &limits).unwrap();
        assert_eq!((third.panorama.width, read.kept()), (4, 8 * panorama::PER_PIXEL), "another file");
        let narrow = Limits { memory: 8 * panorama::PER_PIXEL - 1, ..limits };
        let told = read.panorama(&other, &narrow).unwrap_err().to_string();
        assert!(told.contains("raise --max-memory"), "what does not fit is read again, and refused: {told}");
        read.forget();
        assert_eq!(read.kept(), 0);
    }
}
