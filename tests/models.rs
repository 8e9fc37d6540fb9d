//! Our own models, through the library: each one draws, sanely, and the same with every structure.

use crate::common::{bits, models, still};
use meshray::accel::AccelKind;
use meshray::load::{LoadOptions, load};

/// Few pixels, as one of the structures is none.
const WIDTH: u32 = 24;
const HEIGHT: u32 = 18;

#[test]
fn every_model_is_drawn_the_same_with_every_structure() {
    for path in models() {
        let name = path.display();
        let loaded = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let draw = |kind| {
            still(loaded.scene.clone(), kind, WIDTH, HEIGHT).unwrap_or_else(|| panic!("{name}: nothing to draw"))
        };
        let truth = draw(AccelKind::None);
        assert!(truth.beauty.iter().flatten().all(|c| c.is_finite()), "{name}: a pixel is not a number");
        let covered = truth.beauty.iter().filter(|p| p[3] > 0.5).count();
        assert!(covered * 20 >= truth.beauty.len(), "{name}: covers {covered} of {} pixels", truth.beauty.len());
        for kind in AccelKind::ALL.into_iter().filter(|&kind| kind != AccelKind::None) {
            assert!(bits(&draw(kind)) == bits(&truth), "{name}: {kind:?} differs from none");
        }
    }
}
