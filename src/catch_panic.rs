//! Runs third-party code that may panic on damaged input, without the panic being printed as a fault of ours.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// Whether a panic of this thread is expected and will be reported as a fault of the file.
    static EXPECTED: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work`; `None` when it panics. State that `work` has changed by then must not be used.
///
/// The panic hook is process-wide: it is wrapped once, and looks up per thread whether to stay silent.
pub(crate) fn attempt<T>(work: impl FnOnce() -> T) -> Option<T> {
    static WRAPPED: Once = Once::new();
    WRAPPED.call_once(|| {
        let hook = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !EXPECTED.get() {
                hook(info);
            }
        }));
    });
    EXPECTED.set(true);
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    EXPECTED.set(false);
    result.ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_answer() {
        assert_eq!(attempt(|| 3), Some(3));
        assert_eq!(attempt(|| -> u32 { panic!("expected in this test") }), None);
        assert!(!EXPECTED.get());
    }
}
