//! Pictures that show nothing, or next to nothing: they are written as they are, but not without a word.

use super::camera::{self, Choice};
use crate::load::Diagnostic;
use crate::render::{Coverage, Job, coverage};
use crate::scene::Scene;
use std::path::Path;

/// Of a picture that is framed on the model one ray in so many hits it, or its parts are too small to be seen.
const FEW: usize = 1000;

/// What is to be said of a picture by such a choice of the eye; nothing of those that show something.
pub(super) fn warning(job: &Job, choice: &Choice, file: &Path) -> Option<Diagnostic> {
    said(coverage(job), choice, job.scene, file)
}

fn said(Coverage { rays, hits }: Coverage, choice: &Choice, scene: &Scene, file: &Path) -> Option<Diagnostic> {
    let framed = camera::is_framed(choice, scene);
    let (code, text) = match hits {
        0 => ("nothing-seen", format!("none of {rays} rays spread over the picture hits anything")),
        n if framed && n * FEW < rays => {
            ("little-seen", format!("only {n} of {rays} rays spread over the picture hit anything"))
        }
        _ => return None,
    };
    let remedy = match choice {
        _ if framed => {
            "parts of the model are far from each other, or very thin: --eye and --at show some of it, --line-width widens \
             points and lines"
        }
        Choice::Free { .. } => "aim the eye with --at, or leave out --eye: the model is then framed",
        _ => "this camera of the file looks past what is there; --view front frames the model",
    };
    Some(Diagnostic::new(code, file, "", text).remedy(remedy))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::framing::NamedView;

    fn code(hits: usize, choice: &Choice) -> Option<&'static str> {
        said(Coverage { rays: 4096, hits }, choice, &Scene::default(), Path::new("a.glb")).map(|warning| warning.code)
    }

    #[test]
    fn a_framed_picture_must_show_a_thousandth_and_any_other_something() {
        let free = Choice::Free { eye: DVec3::Z, at: None, up: None };
        for choice in [&Choice::Default, &Choice::Named(NamedView::Front)] {
            assert_eq!([0, 4, 5].map(|n| code(n, choice)), [Some("nothing-seen"), Some("little-seen"), None]);
        }
        for choice in [&free, &Choice::Camera("0".into())] {
            assert_eq!([0, 1].map(|n| code(n, choice)), [Some("nothing-seen"), None]);
        }
    }
}
