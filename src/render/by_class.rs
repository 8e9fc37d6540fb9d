//! Values of the classes of rays.

use super::wave::RayClass;

/// One value for each class of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ByClass<T> {
    /// From the eye.
    pub primary: T,
    /// To the lights.
    pub shadow: T,
    /// Reflected.
    pub reflected: T,
    /// Refracted or passed through.
    pub refracted: T,
}

impl<T> ByClass<T> {
    /// The values of all classes, in the order of the fields.
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
