//! Turns the user's choice of camera into a camera in the scene.

use super::args::EyeArgs;
use super::job::{UsageError, usage_error};
use super::parse::Ortho;
use crate::load::Diagnostic;
use crate::load::choice::{Kind, choose};
use crate::math::DVec3;
use crate::scene::framing::{self, Bounds, DEFAULT_FOV, Direction, FrameLens, NamedView, frame};
use crate::scene::{Camera, Projection, Scene, UpAxis};
use std::path::Path;

/// Chosen viewpoint of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Choice {
    /// The first camera of a scene file, or else a suitable side of the model.
    Default,
    /// A side of the model.
    Named(NamedView),
    /// A camera of the file, by name or number from 0.
    Camera(String),
    /// A camera position given by the user.
    Free {
        /// Camera position.
        eye: DVec3,
        /// Point to look at; `None`: the middle of the model.
        at: Option<DVec3>,
        /// Up direction in the picture; `None`: the scene's up axis.
        up: Option<DVec3>,
    },
}

impl Choice {
    /// Viewpoint typed for a single picture; `up` applies to a camera position.
    pub(super) fn of(args: &EyeArgs, up: Option<[f64; 3]>) -> Result<Self, UsageError> {
        if let Some(eye) = args.eye {
            check_eye(args.eye, args.at)?;
            return Ok(Self::Free { eye: eye.into(), at: args.at.map(Into::into), up: up.map(Into::into) });
        }
        let camera = args.camera.clone().map(Self::Camera);
        Ok(args.view.map(Self::Named).or(camera).unwrap_or(Self::Default))
    }

    /// Name of the choice in file names and messages.
    pub(super) fn name(&self) -> String {
        match self {
            Self::Default => "default".into(),
            Self::Named(view) => view.name().into(),
            Self::Camera(name) => name.clone(),
            Self::Free { .. } => "eye".into(),
        }
    }
}

/// Lens chosen by `--fov` or `--ortho`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LensChoice {
    /// Perspective with a vertical field of view, in radians.
    Fov(f64),
    /// Orthographic over a height in world units; `None`: as high as the model needs.
    Ortho(Option<f64>),
}

impl LensChoice {
    /// Lens from the typed degrees or height.
    pub(super) fn new(fov: Option<f64>, ortho: Option<Ortho>) -> Option<Self> {
        match ortho {
            Some(Ortho::Auto) => Some(Self::Ortho(None)),
            Some(Ortho::Height(height)) => Some(Self::Ortho(Some(height))),
            None => fov.map(|degrees| Self::Fov(degrees.to_radians())),
        }
    }

    fn framing(self) -> FrameLens {
        match self {
            Self::Fov(y_fov) => FrameLens::Perspective { y_fov },
            Self::Ortho(_) => FrameLens::Orthographic,
        }
    }

    /// Projection of the lens. `radius` is that of a bounding sphere of the model, which an orthographic lens without a height
    /// shows in full.
    fn projection(self, aspect: f64, radius: f64) -> Projection {
        match self {
            Self::Fov(y_fov) => Projection::Perspective { y_fov, aspect: None },
            Self::Ortho(height) => {
                let y_mag = height.map_or(radius / aspect.min(1.0), |height| height * 0.5);
                Projection::Orthographic { x_mag: y_mag * aspect, y_mag }
            }
        }
    }
}

/// Camera of a choice, and a phrase that describes it. `aspect` is width / height of the picture.
pub(super) fn camera(
    choice: &Choice,
    lens: Option<LensChoice>,
    scene: &Scene,
    bounds: &Bounds,
    aspect: f64,
    file: &Path,
) -> Result<(Camera, String), Diagnostic> {
    let framed = framing(choice, lens, scene, bounds);
    let framed = framed.map(|(direction, lens)| frame(scene, bounds, direction, lens, aspect));
    Shown { choice, lens, aspect, file }.camera(scene, bounds, framed)
}

/// Direction and lens to frame the model with; `None` if the choice itself fixes the camera position.
pub(super) fn framing(
    choice: &Choice,
    lens: Option<LensChoice>,
    scene: &Scene,
    bounds: &Bounds,
) -> Option<(Direction, FrameLens)> {
    let direction = match choice {
        Choice::Named(view) => framing::named_direction(scene, *view),
        _ if is_framed(choice, scene) => framing::default_direction(scene, bounds),
        _ => return None,
    };
    Some((direction, framing_lens(lens)))
}

/// Whether the camera is placed so that the picture shows the whole model.
pub(super) fn is_framed(choice: &Choice, scene: &Scene) -> bool {
    match choice {
        Choice::Default => scene.hints.camera.is_none(),
        Choice::Named(_) => true,
        Choice::Camera(_) | Choice::Free { .. } => false,
    }
}

/// Camera settings of a picture that are known without the scene.
pub(super) struct Shown<'a> {
    pub choice: &'a Choice,
    pub lens: Option<LensChoice>,
    /// Width / height of the picture.
    pub aspect: f64,
    pub file: &'a Path,
}

impl Shown<'_> {
    /// Camera, and a phrase that describes it. `framed` is the framed camera if the choice has a [`framing`].
    pub(super) fn camera(
        &self,
        scene: &Scene,
        bounds: &Bounds,
        framed: Option<Camera>,
    ) -> Result<(Camera, String), Diagnostic> {
        let Self { choice, lens, aspect, file } = *self;
        let radius = bounds.radius();
        let is_framed = framed.is_some();
        let (mut camera, phrase) = match (choice, framed) {
            (Choice::Named(view), Some(framed)) => (framed, format!("{view} view")),
            (_, Some(framed)) => (framed, default_phrase(scene)),
            (Choice::Default | Choice::Named(_), None) => {
                let camera = framing::default_camera(scene, bounds, aspect);
                let phrase = format!("the file's camera {}", quoted(&camera.name)).trim_end().to_owned();
                (camera, phrase)
            }
            (Choice::Camera(name), None) => (find(name, scene, file)?.clone(), format!("camera {}", quoted(name))),
            (Choice::Free { eye, at, up }, None) => {
                let upright = if scene.up == UpAxis::Z { DVec3::Z } else { DVec3::Y };
                let at = at.unwrap_or(bounds.center());
                if (at - *eye).try_normalize().is_none() {
                    let text = "the eye is in the middle of the model, at which it would look";
                    return Err(
                        Diagnostic::new("camera-nowhere", file, "", text).remedy("say where it looks with --at")
                    );
                }
                let world_from_camera = Camera::look_at(*eye, at, up.unwrap_or(upright));
                let lens = lens.unwrap_or(LensChoice::Fov(DEFAULT_FOV));
                let projection = lens.projection(aspect, radius);
                (Camera { name: String::new(), projection, world_from_camera }, "given eye".to_owned())
            }
        };
        // Framed cameras already have the chosen lens, except for a height given by the user.
        match lens {
            Some(LensChoice::Ortho(None)) | Some(LensChoice::Fov(_)) if is_framed => {}
            Some(lens) => camera.projection = lens.projection(aspect, radius),
            None => {}
        }
        Ok((camera, phrase))
    }
}

/// Refuses a camera position that equals the point it looks at.
pub(super) fn check_eye(eye: Option<[f64; 3]>, at: Option<[f64; 3]>) -> Result<(), UsageError> {
    if eye.is_some() && eye == at {
        return usage_error("--eye and --at are one point, so the camera looks nowhere; move one");
    }
    Ok(())
}

/// Phrase for the default view, which mentions the file's cameras since the picture does not show them.
fn default_phrase(scene: &Scene) -> String {
    match scene.cameras.as_slice() {
        [] => "default view".into(),
        [one] => format!("default view (--camera {} is the file's own)", shell_word(&one.name)),
        more => format!("default view (the file has {} cameras; --camera 0 is the first)", more.len()),
    }
}

fn shell_word(name: &str) -> String {
    if name.is_empty() { "0".into() } else { format!("'{name}'") }
}

fn framing_lens(lens: Option<LensChoice>) -> FrameLens {
    lens.map_or(FrameLens::Perspective { y_fov: DEFAULT_FOV }, LensChoice::framing)
}

fn quoted(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!("'{name}'") }
}

/// Cameras chosen by name or number.
const CAMERA: Kind = Kind {
    word: "camera",
    list: "",
    code: "camera-unknown",
    ambiguous: "camera-ambiguous",
    empty: "the scene that is shown has no camera in it; use --view or --eye",
};

fn find<'s>(name: &str, scene: &'s Scene, file: &Path) -> Result<&'s Camera, Diagnostic> {
    let names: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    Ok(&scene.cameras[choose(&CAMERA, &names, name, file)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine3;
    use crate::scene::RenderHints;
    use crate::scene::framing::robust_bounds;

    fn scene() -> Scene {
        let camera = |name: &str| Camera {
            name: name.into(),
            projection: Projection::Perspective { y_fov: 1.0, aspect: None },
            world_from_camera: DAffine3::IDENTITY,
        };
        let hints = RenderHints { camera: Some(0), ..RenderHints::default() };
        Scene { cameras: vec![camera("Front"), camera("")], hints, ..Scene::default() }
    }

    fn pick(choice: Choice, lens: Option<LensChoice>) -> Result<(Camera, String), Diagnostic> {
        let scene = scene();
        camera(&choice, lens, &scene, &robust_bounds(&scene), 2.0, Path::new("a.glb"))
    }

    #[test]
    fn a_camera_is_found_by_name_or_number() {
        assert_eq!(pick(Choice::Camera("Front".into()), None).unwrap().1, "camera 'Front'");
        assert!(pick(Choice::Camera("1".into()), None).is_ok());
        let error = pick(Choice::Camera("Frnt".into()), None).unwrap_err().to_string();
        assert_eq!(error, "a.glb: there is no camera 'Frnt'; did you mean 'Front'? it has 0 'Front', number 1");
        assert!(pick(Choice::Camera(String::new()), None).is_err(), "one without a name has a number");
    }

    #[test]
    fn a_name_that_two_cameras_have_is_refused() {
        let mut scene = scene();
        scene.cameras[1].name = "Front".into();
        let pick = |name: &str| {
            let choice = Choice::Camera(name.into());
            camera(&choice, None, &scene, &robust_bounds(&scene), 2.0, Path::new("a.glb"))
        };
        let error = pick("Front").unwrap_err().to_string();
        assert_eq!(error, "a.glb: 2 cameras are called 'Front'; name one by its number: 0, 1");
        assert!(pick("1").is_ok());
    }

    #[test]
    fn an_eye_in_the_middle_of_the_model_must_be_told_where_to_look() {
        let free = |at| Choice::Free { eye: robust_bounds(&scene()).center(), at, up: None };
        assert!(pick(free(None), None).unwrap_err().to_string().ends_with("say where it looks with --at"));
        assert!(pick(free(Some(DVec3::splat(7.0))), None).is_ok());
    }

    #[test]
    fn parallel_rays_see_the_whole_model_in_an_upright_picture_too() {
        let [wide, upright] = [2.0, 0.5].map(|aspect| LensChoice::Ortho(None).projection(aspect, 3.0));
        assert_eq!(wide, Projection::Orthographic { x_mag: 6.0, y_mag: 3.0 });
        assert_eq!(upright, Projection::Orthographic { x_mag: 3.0, y_mag: 6.0 });
    }

    #[test]
    fn cameras_of_a_model_wait_until_they_are_named() {
        let scene = Scene { hints: RenderHints::default(), ..scene() };
        let (_, phrase) =
            camera(&Choice::Default, None, &scene, &robust_bounds(&scene), 1.0, Path::new("a.glb")).unwrap();
        assert_eq!(phrase, "default view (the file has 2 cameras; --camera 0 is the first)");
    }

    #[test]
    fn the_chosen_lens_replaces_the_files() {
        let (camera, _) = pick(Choice::Default, Some(LensChoice::Fov(0.5))).unwrap();
        assert_eq!(camera.projection, Projection::Perspective { y_fov: 0.5, aspect: None });
        let (camera, _) = pick(Choice::Named(NamedView::Top), Some(LensChoice::Ortho(Some(3.0)))).unwrap();
        assert_eq!(camera.projection, Projection::Orthographic { x_mag: 3.0, y_mag: 1.5 });
    }
}
