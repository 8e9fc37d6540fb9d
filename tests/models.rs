//! Our own models, rendered through the library: each one renders, has sane values, and looks the same with every structure.

use crate::common::{bits, models, still};
use meshray::accel::AccelKind;
use meshray::load::{LoadOptions, load};

/// Few pixels, because one of the structures is `none`; even fewer for the other slow structures.
const WIDTH: u32 = 24;
const HEIGHT: u32 = 18;
const FEWER: u32 = 3;

#[test]
fn every_model_is_drawn_the_same_with_every_structure() {
    for path in models() {
        let name = path.display();
        let loaded = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(loaded.scene.check(), Ok(()), "{name}");
        let draw = |kind, fewer| {
            let picture = still(loaded.scene.clone(), kind, WIDTH / fewer, HEIGHT / fewer);
            picture.unwrap_or_else(|| panic!("{name}: nothing to draw"))
        };
        let truth = draw(AccelKind::None, 1);
        assert!(truth.beauty.iter().flatten().all(|c| c.is_finite()), "{name}: a pixel is not a number");
        let covered = truth.beauty.iter().filter(|p| p[3] > 0.5).count();
        assert!(covered * 20 >= truth.beauty.len(), "{name}: covers {covered} of {} pixels", truth.beauty.len());
        let fewer = bits(&draw(AccelKind::DEFAULT, FEWER));
        for kind in AccelKind::ALL {
            let same = match kind.is_slow() {
                true => bits(&draw(kind, FEWER)) == fewer,
                false => bits(&draw(kind, 1)) == bits(&truth),
            };
            assert!(same, "{name}: {kind:?} differs from none");
        }
    }
}
