//! Values kept apart by ray class.

use super::wave::RayClass;

/// One value for each ray class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ByClass<T> {
    /// Eye rays.
    pub primary: T,
    /// Rays to the lights.
    pub shadow: T,
    /// Reflected rays.
    pub reflected: T,
    /// Rays that were refracted or passed through.
    pub refracted: T,
}

impl<T> ByClass<T> {
    /// Returns the values of all classes, in the order of the fields.
    pub(crate) fn each_mut(&mut self) -> [&mut T; 4] {
        [&mut self.primary, &mut self.shadow, &mut self.reflected, &mut self.refracted]
    }

    pub(super) fn of(&mut self, class: RayClass) -> &mut T {
        match class {
            RayClass::Primary => &mut self.primary,
            RayClass::Reflected => &mut self.reflected,
            RayClass::Refracted => &mut self.refracted,
        }
    }
}
