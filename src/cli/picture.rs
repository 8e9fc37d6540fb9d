//! One picture: its settings, combined from command line, scene file and defaults, and its encoding and writing.

use super::interrupt;
use super::job::{Look, Shot};
use super::outputs::{self, Target};
use crate::image::{ExrSamples, FileKind, Metadata, Output, Picture, PngDepth, ToneMap, encode};
use crate::load::Diagnostic;
use crate::render::{Adaptive, Sampling, Settings, adaptive_pixels_at_a_time as pixels_at_a_time};
use crate::scene::features::is_unlit;
use crate::scene::{Background, Environment, Scene};
use std::io::{self, Write};

/// Effective settings of one picture.
#[derive(Clone, Debug)]
pub(super) struct Effective {
    /// Settings for the renderer.
    pub settings: Settings,
    /// Settings for the encoder; the background is filled in on writing.
    pub output: Output,
    /// Whether no exposure was given: scenes with photometric lamps are then metered.
    pub metered: bool,
}

impl Effective {
    /// Combines settings: the command line takes precedence over the scene file, and that over the defaults.
    pub(super) fn new(look: &Look, scene: &Scene) -> Result<Self, String> {
        let (usual, hints) = (Settings::default(), &scene.hints);
        let (width, height) = look.size.or(hints.size).unwrap_or((usual.width, usual.height));
        let (samples, sampling) = look.sampling.sampling(hints);
        Ok(Self {
            settings: Settings {
                width,
                height,
                sampling,
                lens: None,
                samples,
                depth: look.depth.or(hints.depth),
                cutoff: look.cutoff.or(hints.cutoff).unwrap_or(usual.cutoff),
                seed: look.seed,
                env_rays: look.env_rays,
                gloss_rays: look.gloss_rays,
                light_rays: look.light_rays.unwrap_or(usual.light_rays),
                walls: usual.walls,
                layers: look.layers,
                one_by_one: false,
                no_prune: false,
            },
            output: Output {
                tone_map: tone_map(look.tone_map, scene)?,
                exposure: look.exposure.or(hints.exposure).unwrap_or(0.0),
                png_depth: look.png,
                exr_samples: look.exr,
                ..Output::default()
            },
            metered: look.exposure.or(hints.exposure).is_none(),
        })
    }
}

/// Requested tone curve, or that of the scene file. The default is none if all is unlit: curves make room for highlights, which
/// unlit colours lack, and those are meant as they are.
pub(super) fn tone_map(typed: Option<ToneMap>, scene: &Scene) -> Result<ToneMap, String> {
    let hinted = scene.hints.tone_map.as_deref().map(str::parse::<ToneMap>).transpose().map_err(|e| e.to_string())?;
    let usual = || if is_unlit(scene) { ToneMap::None } else { ToneMap::default() };
    Ok(typed.or(hinted).unwrap_or_else(usual))
}

/// Width in pixels of points or lines of width `narrowest` in a picture of a model of about this `size`, both in world units.
pub(super) fn wide_in_pixels(narrowest: f64, size: f64, settings: &Settings) -> f64 {
    narrowest / size * f64::from(settings.height.min(settings.width))
}

impl Effective {
    /// Adapts the settings to the file type of a picture: errors are measured in the values that it holds. Photometric lamps need
    /// exposures of many stops; the studio's walls, which are no real place, are scaled so that these do not turn them black or
    /// white.
    pub(super) fn written_as(&mut self, look: &Look, scene: &Scene, kind: FileKind) {
        if scene.photometric && kind != FileKind::Exr {
            self.settings.walls = libm::exp2f(-self.output.exposure);
        }
        self.settings.sampling = look.sampling.written(self.settings.sampling, kind, &self.output);
    }

    /// Adapts the sampling to points or lines of width `narrowest` in a model of about this `size`, both in world units.
    pub(super) fn of_wires(&mut self, look: &Look, narrowest: f64, size: f64) {
        let pixels = wide_in_pixels(narrowest, size, &self.settings);
        self.settings.sampling = look.sampling.of_wires(self.settings.sampling, pixels);
    }

    /// Aspect ratio, width / height.
    pub(super) fn aspect(&self) -> f64 {
        f64::from(self.settings.width) / f64::from(self.settings.height)
    }

    /// Sets whether to run code paths that the scene does not need.
    pub(super) fn without_pruning(mut self, no_prune: bool) -> Self {
        self.settings.no_prune = no_prune;
        self
    }
}

/// Default background of a scene without environment: about as dark as the studio's backdrop, so that neither black nor white
/// things vanish before it.
const BACKDROP: crate::math::Vec3 = crate::math::Vec3::splat(0.07);

/// Background of a picture: as typed, or from the file, or the environment; dark grey if the environment is black.
pub(super) fn background(typed: Option<Background>, scene: &Scene) -> Background {
    typed.or(scene.background).unwrap_or(match scene.environment {
        Environment::Black => Background::Color(BACKDROP),
        Environment::Constant(_) | Environment::Studio | Environment::Panorama => Background::Environment,
    })
}

/// Output settings with that background, if it is a colour.
pub(super) fn before(background: Option<Background>, mut output: Output) -> Output {
    if let Some(Background::Color(color)) = background {
        output.background = Some(color.to_array());
    }
    output
}

/// Additional data gathered for a picture.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PictureData {
    /// Number of costs per pixel.
    pub costs: usize,
    /// Whether the picture is rendered once more, to count.
    pub counted: bool,
}

/// Maximum number of bytes that each ray of adaptive sampling keeps until the picture is done: its results, measured on three
/// models, and its data for layers, in growing lists.
fn bytes_of_ray(settings: &Settings) -> u64 {
    224 + if settings.layers { 2 * 56 } else { 0 }
}

/// Minimum number of rays per pixel of adaptive sampling: a corner and a centre.
const FEWEST_RAYS: u64 = 2;

/// Minimum number of rays that adaptive sampling keeps at a time: those of all pixels, and for the pixels sampled together (a
/// band) also those of the parts into which each is always split. With several bands, the memory of one is not fully reusable for
/// the next (measured: half as much again is taken).
fn kept_rays(how: &Adaptive, (width, height): (u32, u32)) -> u64 {
    let (pixels, together) = (u64::from(width) * u64::from(height), pixels_at_a_time(width));
    let together = if together < pixels { together + together / 2 } else { pixels };
    let of_parts = (FEWEST_RAYS << (2 * how.min_levels.min(how.levels).min(20))) - FEWEST_RAYS;
    pixels * FEWEST_RAYS + together.saturating_mul(of_parts)
}

/// Bytes that `rays` rays of a picture take beyond those included in [`bytes`].
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "far less than 2^64 rays, and not negative"
)]
pub(super) fn bytes_of_rays(settings: &Settings, rays: f64) -> u64 {
    let Sampling::Adaptive(how) = &settings.sampling else { return 0 };
    let known = kept_rays(how, (settings.width, settings.height));
    (rays as u64).saturating_sub(known) * bytes_of_ray(settings)
}

/// Peak memory in bytes of a picture until it is in its file: all data of its pixels, twice while it is counted or another is
/// rendered beside it; then the samples as stored, and the encoded file, which may be hardly smaller.
pub(super) fn bytes(effective: &Effective, kind: FileKind, behind: PictureData) -> u64 {
    /// Bytes per cost of a pixel: those of its tile, five channels, copies and sums.
    const COST: u64 = 128;
    let Effective { settings, output, .. } = effective;
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    // Number of samples per pixel, and its uncertainty.
    let (sampled, rays) = match &settings.sampling {
        Sampling::Uniform => (0, 0),
        Sampling::Adaptive(how) => (4, kept_rays(how, (settings.width, settings.height))),
        Sampling::Stochastic(_) => (8, 0),
    };
    let in_layers = |bytes: u64| if settings.layers { bytes } else { 0 };
    /// Light through glass, stored before the background is known.
    const VEIL: u64 = 16;
    let known = 16 + VEIL + sampled + in_layers(48 + sampled);
    let stored = match kind {
        FileKind::Exr => {
            let color = if output.exr_samples == ExrSamples::Float { 4 } else { 2 };
            2 * (4 * color + in_layers(6 * color + 24 + sampled))
        }
        // The encoder first copies the samples into the byte order of the file.
        FileKind::Png if output.png_depth == PngDepth::Sixteen => 3 * 8,
        FileKind::Png | FileKind::Jpeg | FileKind::Webp => 2 * 4,
    };
    // With a target error, two pictures are rendered in parallel.
    let is_aimed = matches!(&settings.sampling, Sampling::Stochastic(how) if how.target.is_some());
    let again = if behind.counted || is_aimed { known } else { 0 };
    let of_pixels = pixels * (known + stored.max(again) + COST * behind.costs as u64);
    of_pixels.saturating_add(rays.saturating_mul(bytes_of_ray(settings)))
}

/// Returns a fault if the picture alone needs more memory than allowed.
pub(super) fn too_large(effective: &Effective, kind: FileKind, behind: PictureData, limit: u64) -> Option<Diagnostic> {
    let settings = &effective.settings;
    beyond((settings.width, settings.height), bytes(effective, kind, behind), limit)
}

/// Returns a fault if judging a picture, of which only the costs per pixel are kept, needs more memory than allowed.
pub(super) fn too_large_to_judge((width, height): (u32, u32), limit: u64) -> Option<Diagnostic> {
    /// Light, counts, and both again for the picture it is compared with.
    const OF_PIXEL: u64 = 64;
    beyond((width, height), u64::from(width) * u64::from(height) * OF_PIXEL, limit)
}

fn beyond((width, height): (u32, u32), need: u64, limit: u64) -> Option<Diagnostic> {
    let (why, remedy) = if need > limit {
        (format!("where {limit} are allowed"), "choose a smaller --size or raise --max-memory")
    } else if !is_given(need) {
        ("which this machine does not have".to_owned(), "choose a smaller --size")
    } else {
        return None;
    };
    let text = format!("a {width}×{height} picture needs {need} bytes {why}");
    Some(Diagnostic::new("picture-too-large", "", "", text).remedy(remedy))
}

/// Whether the system grants this much memory at once; none of it is touched. Otherwise the process might be killed in the middle
/// of its work.
fn is_given(need: u64) -> bool {
    /// Granted by every system.
    const LITTLE: u64 = 1 << 30;
    let is_reserved = |need: usize| {
        let mut room = Vec::<u8>::new();
        let reserved = room.try_reserve_exact(need).is_ok();
        // Keeps the compiler from removing the allocation.
        std::hint::black_box(room);
        reserved
    };
    need <= LITTLE || usize::try_from(need).is_ok_and(is_reserved)
}

/// Reason why a picture was not written.
pub(super) enum WriteError {
    /// The reader closed standard output, which is no fault.
    BrokenPipe,
    /// Any other reason.
    Fault(Diagnostic),
}

impl WriteError {
    fn new(shot: &Shot, text: String) -> Self {
        let name = shot.target.path().unwrap_or(std::path::Path::new("-"));
        Self::Fault(Diagnostic::new("output-unwritable", name, "", text))
    }
}

/// Encodes the picture as the bytes of its file.
pub(super) fn encoded(
    shot: &Shot,
    picture: &Picture,
    effective: &Effective,
    background: Option<Background>,
    metadata: &Metadata,
) -> Result<Vec<u8>, WriteError> {
    let output = before(background, effective.output.clone());
    encode(picture, shot.kind, &output, metadata).map_err(|e| WriteError::new(shot, e.to_string()))
}

/// Writes the bytes to the picture's target.
pub(super) fn write(shot: &Shot, bytes: &[u8]) -> Result<(), WriteError> {
    match &shot.target {
        Target::Stdout => {
            let _guard = interrupt::Guard::new();
            let mut out = io::stdout().lock();
            out.write_all(bytes).and_then(|()| out.flush()).map_err(|e| match e.kind() {
                io::ErrorKind::BrokenPipe => WriteError::BrokenPipe,
                _ => WriteError::new(shot, e.to_string()),
            })
        }
        Target::Named(path) | Target::Default(path) => {
            outputs::make_folder(shot).map_err(WriteError::Fault)?;
            interrupt::write_atomic(path, bytes).map_err(|e| WriteError::new(shot, e.to_string()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::{Material, Phong, Reflection, RenderHints, Sphere};

    #[test]
    fn pictures_that_no_machine_has_room_for_are_refused_before_they_are_begun() {
        assert!(is_given(1 << 20) && !is_given(1 << 60));
        let limit = u64::MAX;
        assert!(beyond((1024, 768), 1 << 26, limit).is_none());
        let fault = beyond((65_535, 65_535), 1 << 60, limit).unwrap();
        assert!(fault.text.ends_with("bytes which this machine does not have"), "{}", fault.text);
        assert_eq!(fault.remedy, "choose a smaller --size");
    }

    #[test]
    fn the_command_line_overrides_the_scene_file_which_overrides_the_defaults() {
        let hints =
            RenderHints { depth: Some(5), samples: Some(9), tone_map: Some("aces".into()), ..Default::default() };
        let scene = Scene { hints, ..Scene::default() };
        let effective = Effective::new(&Look { depth: Some(1), ..Look::default() }, &scene).unwrap();
        assert_eq!((effective.settings.depth, effective.settings.samples), (Some(1), 9));
        assert_eq!((effective.settings.width, effective.output.tone_map), (1024, ToneMap::Aces));
    }

    #[test]
    fn colours_that_no_light_changes_are_shown_as_they_are_unless_somebody_wants_a_curve() {
        let ball = Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.0, material: 0 };
        let with = |reflection| Scene {
            materials: vec![Material { reflection, ..Material::default() }, Material::plain()],
            spheres: vec![ball.clone()],
            ..Scene::default()
        };
        let (unlit, lit) = (with(Reflection::Unlit), with(Reflection::Phong(Phong::default())));
        assert_eq!(tone_map(None, &unlit), Ok(ToneMap::None));
        assert_eq!(tone_map(None, &lit), Ok(ToneMap::Neutral));
        assert_eq!(tone_map(Some(ToneMap::Aces), &unlit), Ok(ToneMap::Aces));
        let hints = RenderHints { tone_map: Some("reinhard".into()), ..RenderHints::default() };
        assert_eq!(tone_map(None, &Scene { hints, ..unlit }), Ok(ToneMap::Reinhard));
    }

    #[test]
    fn a_picture_beyond_the_memory_allowed_is_refused() {
        let big = Effective::new(&Look { size: Some((65_535, 65_535)), ..Look::default() }, &Scene::default()).unwrap();
        assert!(too_large(&big, FileKind::Png, PictureData::default(), 8 << 30).is_some());
        let usual = Effective::new(&Look::default(), &Scene::default()).unwrap();
        assert!(too_large(&usual, FileKind::Exr, PictureData { costs: 4, counted: true }, 8 << 30).is_none());
    }

    #[test]
    fn rays_of_parts_into_which_every_pixel_is_halved_count_for_as_many_pixels_as_are_sampled_together() {
        let of = |size, min_levels| {
            let mut effective =
                Effective::new(&Look { size: Some(size), ..Look::default() }, &Scene::default()).unwrap();
            effective.settings.sampling = Sampling::Adaptive(Adaptive { min_levels, ..Adaptive::default() });
            bytes(&effective, FileKind::Png, PictureData::default())
        };
        // Measured: 6.5 GB, and 2.6 GB with four bands.
        assert!((6_000_000_000..9_000_000_000).contains(&of((256, 256), 4)), "{}", of((256, 256), 4));
        assert!((2_600_000_000..4_500_000_000).contains(&of((512, 512), 3)), "{}", of((512, 512), 3));
        assert!(of((3000, 3000), 1) < 6_000_000_000, "{}", of((3000, 3000), 1));
        assert!(of((8, 8), 6) > 50 * of((8, 8), 1));
        let with = |layers| {
            let sampling = Sampling::Adaptive(Adaptive { min_levels: 4, ..Adaptive::default() });
            let settings = Settings { layers, sampling, width: 256, height: 256, ..Settings::default() };
            let known = bytes_of_rays(&settings, 0.0);
            assert_eq!((known, bytes_of_rays(&settings, 65_536.0 * 512.0)), (0, 0), "they are known");
            bytes_of_rays(&settings, 65_536.0 * 512.0 + 10.0)
        };
        assert_eq!((with(false), with(true)), (2240, 3360));
    }
}
