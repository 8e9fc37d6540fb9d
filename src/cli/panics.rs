//! Internal faults: a panic becomes one line and exit code 1, and a batch goes on after it.

use super::exit::Exit;
use super::message::Messages;
use crate::load::Diagnostic;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Mutex;

/// Place and reason of the first panic not yet reported.
static LAST: Mutex<Option<String>> = Mutex::new(None);

/// Keeps panics from printing; [`guard`] reports them.
pub(super) fn install() {
    panic::set_hook(Box::new(|info| {
        let place = info.location().map(|l| format!("{}:{}", l.file(), l.line())).unwrap_or_default();
        let payload = info.payload();
        let text = payload.downcast_ref::<String>().map(String::as_str);
        let why = text.or(payload.downcast_ref::<&str>().copied()).unwrap_or("no reason given").replace('\n', " ");
        if let Ok(mut last) = LAST.lock() {
            // The first panic is the cause; later ones are its consequences.
            last.get_or_insert(format!("{place}: {why}"));
        }
    }));
}

/// Runs `work` on `what`; a panic ends it with [`Exit::Failed`].
pub(super) fn guard(what: &str, messages: &Messages, work: impl FnOnce() -> Exit) -> Exit {
    // Any state that `work` leaves half changed belongs to this batch alone and is dropped with it.
    panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let why = LAST.lock().ok().and_then(|mut last| last.take()).unwrap_or_default();
        let fault = Diagnostic::new("internal", what, "", format!("an error in meshray itself, at {why}"));
        messages.fail(&fault.remedy("please report it with the file"), Exit::Failed)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::message::Format;

    #[test]
    fn a_panic_ends_as_a_failure_and_not_as_the_end_of_the_batch() {
        let messages = Messages::new(Format::Text, true);
        assert_eq!(guard("a.obj", &messages, || panic!("expected in this test")), Exit::Failed);
        assert_eq!(guard("b.obj", &messages, || Exit::Done), Exit::Done);
    }
}
