//! Warnings about pictures that show nothing, or next to nothing; they are written all the same.

use super::camera::{self, Choice, LensChoice};
use crate::accel::{AccelChoice, AccelKind, AccelParams};
use crate::load::Diagnostic;
use crate::render::{Coverage, Job, coverage};
use crate::scene::Scene;
use std::path::Path;

/// A picture framed on the model counts as nearly empty if fewer than one ray in this many hits.
const FEW: usize = 10_000;

/// Warning about the picture of a camera choice, whose name in messages is `view`; `None` if it shows something.
pub(super) fn warning(
    job: &Job,
    choice: &Choice,
    view: &str,
    lens: Option<LensChoice>,
    file: &Path,
) -> Option<Diagnostic> {
    if job.world.is_empty() {
        return None;
    }
    let warning = explanation(looked_through(job), choice, lens, job.scene, file)?;
    Some(Diagnostic { text: format!("{view}: {}", warning.text), ..warning })
}

/// Whether anything is visible in a picture.
pub(super) fn shows_something(job: &Job) -> bool {
    !job.world.is_empty() && looked_through(job).shown
}

/// Coverage of a picture. Slow structures are replaced by the default one, which finds the same hits.
fn looked_through(job: &Job) -> Coverage {
    if !job.accel.kind().is_slow() {
        return coverage(job);
    }
    let (accel, _) = job.world.structure(AccelChoice::Kind(AccelKind::DEFAULT), &AccelParams::DEFAULT);
    coverage(&Job { accel: &accel, ..*job })
}

/// Warning about a sequence none of whose pictures shows anything.
pub(super) fn sequence(pictures: usize, file: &Path) -> Diagnostic {
    let text = match pictures {
        1 => "the picture of this sequence shows nothing".into(),
        n => format!("none of the {n} pictures of this sequence shows anything"),
    };
    Diagnostic::new("nothing-seen", file, "", text)
        .remedy("aim the eye with --at, or name a --view, which frames the model")
}

fn explanation(
    Coverage { rays, hits, shown }: Coverage,
    choice: &Choice,
    lens: Option<LensChoice>,
    scene: &Scene,
    file: &Path,
) -> Option<Diagnostic> {
    let framed = camera::is_framed(choice, scene);
    let (code, text) = match hits {
        0 => ("nothing-seen", format!("none of {rays} rays spread over the picture hits anything")),
        n if !shown => {
            let text = format!(
                "{n} of {rays} rays spread over the picture hit the model, all of them backs of one-sided faces or what is \
                 wholly transparent"
            );
            let remedy = "another --view may see its fronts; `inspect` lists its materials";
            return Some(Diagnostic::new("nothing-seen", file, "", text).remedy(remedy));
        }
        n if framed && n * FEW < rays => {
            ("little-seen", format!("only {n} of {rays} rays spread over the picture hit anything"))
        }
        _ => return None,
    };
    let remedy = match (choice, lens) {
        (_, Some(LensChoice::Ortho(Some(_)))) => "leave out the height of --ortho: what the model needs is then shown",
        (Choice::Free { .. }, _) => "aim the eye with --at, or leave out --eye: the model is then framed",
        _ if !framed => "this camera of the file shows nothing of what is there; --view front frames the model",
        _ => {
            "parts of the model are far from each other, very thin, or seen edge-on: another --view may show it, --eye and \
             --at a part of it; --line-width widens points and lines"
        }
    };
    Some(Diagnostic::new(code, file, "", text).remedy(remedy))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::framing::NamedView;

    fn code(hits: usize, choice: &Choice) -> Option<&'static str> {
        let coverage = Coverage { rays: 40_960, hits, shown: hits > 0 };
        explanation(coverage, choice, None, &Scene::default(), Path::new("a.glb")).map(|warning| warning.code)
    }

    #[test]
    fn a_framed_picture_must_show_a_ten_thousandth_and_any_other_something() {
        let free = Choice::Free { eye: DVec3::Z, at: None, up: None };
        for choice in [&Choice::Default, &Choice::Named(NamedView::Front)] {
            assert_eq!([0, 4, 5].map(|n| code(n, choice)), [Some("nothing-seen"), Some("little-seen"), None]);
        }
        for choice in [&free, &Choice::Camera("0".into())] {
            assert_eq!([0, 1].map(|n| code(n, choice)), [Some("nothing-seen"), None]);
        }
    }
}
