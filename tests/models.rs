//! Our own models, through the library: each one draws, sanely, and the same with every structure.

use crate::common::{bits, models, still};
use meshray::accel::AccelKind;
use meshray::load::{LoadOptions, load};

#[test]
fn every_model_is_drawn_the_same_with_every_structure() {
    for path in models() {
        let name = path.display();
        let loaded = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let draw =
            |kind| still(loaded.scene.clone(), kind, 48, 36).unwrap_or_else(|| panic!("{name}: nothing to draw"));
        let truth = draw(AccelKind::None);
        assert!(truth.beauty.iter().flatten().all(|c| c.is_finite()), "{name}: a pixel is not a number");
        let covered = truth.beauty.iter().filter(|p| p[3] > 0.5).count();
        assert!(covered * 20 >= truth.beauty.len(), "{name}: covers {covered} of {} pixels", truth.beauty.len());
        for kind in AccelKind::ALL {
            assert!(bits(&draw(kind)) == bits(&truth), "{name}: {kind:?} differs from none");
        }
    }
}
