//! Placement of an EXR's stored pixels (data window) in the picture that it shows (display window).

use ::exr::meta::attribute::IntegerBounds;
use ::exr::prelude::Vec2;

/// Placement of the stored pixels in the picture.
pub(super) struct Window {
    /// Columns and rows of the picture.
    pub size: Vec2<usize>,
    /// Columns and rows of the stored pixels.
    stored: Vec2<usize>,
    /// First stored column and row, relative to the first of the picture.
    first: Vec2<i64>,
}

impl Window {
    pub(super) fn of(stored: Vec2<usize>, at: Vec2<i32>, display: IntegerBounds) -> Self {
        let apart = |at: i32, display: i32| i64::from(at) - i64::from(display);
        let first = Vec2(apart(at.0, display.position.0), apart(at.1, display.position.1));
        Self { size: display.size, stored, first }
    }

    /// Whether some stored pixels lie outside of the picture.
    pub(super) fn is_cropped(&self) -> bool {
        let is_within = |first: i64, stored: usize, size: usize| first >= 0 && stored as i64 <= size as i64 - first;
        let Self { size, stored, first } = self;
        !(is_within(first.0, stored.0, size.0) && is_within(first.1, stored.1, size.1))
    }

    /// Places stored values in the picture, with `outside` where none are stored.
    pub(super) fn shown<T: Copy>(&self, values: Vec<T>, outside: T) -> Vec<T> {
        if (self.size, self.first) == (self.stored, Vec2(0, 0)) {
            return values;
        }
        let mut shown = vec![outside; self.size.area()];
        let place = |i: i64, first: i64, stored: usize| usize::try_from(i - first).ok().filter(|&i| i < stored);
        for (y, row) in (0..).zip(shown.chunks_mut(self.size.0.max(1))) {
            let Some(stored) = place(y, self.first.1, self.stored.1) else { continue };
            let stored = &values[stored * self.stored.0..][..self.stored.0];
            for (x, to) in (0..).zip(row) {
                *to = place(x, self.first.0, self.stored.0).map_or(outside, |x| stored[x]);
            }
        }
        shown
    }
}
