//! Messages: one line each to stderr, as text or as JSON objects.
//!
//! JSON messages are one object per line: `{"severity","code","file","place","text","remedy","count"}`; `severity` is `error`,
//! `warning` or `info`, codes are stable. stdout carries only the requested output, never a message.

use super::exit::Exit;
use super::job::UsageError;
use crate::load::suggest::nearest;
use crate::load::{Diagnostic, LoadError};
use indicatif::MultiProgress;
use std::ffi::OsString;
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Format of messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Format {
    /// Plain text.
    #[default]
    Text,
    /// JSON.
    Json,
}

impl Format {
    /// Value of `--messages` in a command line that may fail to parse.
    pub(super) fn asked_for(words: &[OsString]) -> Self {
        let apart = |pair: &[OsString]| pair[0] == "--messages" && pair[1] == "json";
        let is_json = words.iter().any(|word| word == "--messages=json") || words.windows(2).any(apart);
        if is_json { Self::Json } else { Self::Text }
    }
}

/// Turns an error of the command-line parser into one message: its first paragraph, with its tips as the remedy.
pub(super) fn of_parser(said: &str) -> Diagnostic {
    let line = |paragraph: &str| paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut paragraphs = said.split("\n\n").map(line).filter(|p| !p.is_empty());
    let first = paragraphs.next().unwrap_or_default();
    let tips: Vec<String> = paragraphs.filter_map(|p| Some(p.strip_prefix("tip: ")?.to_owned())).collect();
    let text = first.strip_prefix("error: ").unwrap_or(&first);
    Diagnostic::new("usage", "", "", text).remedy(tips.join("; "))
}

/// Last line of a process that is ended by a signal.
pub(super) fn of_signal(format: Format) -> String {
    match format {
        Format::Text => "meshray: interrupted".into(),
        Format::Json => {
            line(format, Severity::Error, &Diagnostic::new("interrupted", "", "", "interrupted by a signal"))
        }
    }
}

/// Severity of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Severity {
    /// The requested action failed.
    Error,
    /// The action succeeded, but deviates from what the input says.
    Warning,
    /// Useful fact; dropped by `--quiet`.
    Info,
}

impl Severity {
    /// Name in messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Info => "info",
        }
    }
}

/// Lines held back until they may be written.
type Kept = Arc<Mutex<Vec<String>>>;

/// All live buffers of held-back lines, in the order of their creation.
static APART: Mutex<Vec<Weak<Mutex<Vec<String>>>>> = Mutex::new(Vec::new());

/// Writes all lines still held back, before the process ends.
pub(super) fn tell_all_apart() {
    let all = APART.lock().unwrap_or_else(PoisonError::into_inner);
    for apart in all.iter().filter_map(Weak::upgrade) {
        // If the buffer is locked, its owner is writing it.
        if let Ok(mut lines) = apart.try_lock() {
            drop(std::io::stderr().write_all(std::mem::take(&mut *lines).concat().as_bytes()));
        }
    }
}

/// Sink of messages, with a count of the warnings.
#[derive(Debug, Default)]
pub(super) struct Messages {
    format: Format,
    quiet: bool,
    warnings: AtomicU32,
    /// Buffer of lines that are held back; `None` if lines are written at once.
    kept: Option<Kept>,
    /// Progress bars on the same terminal; they are suspended while a line is written.
    pub(super) bars: MultiProgress,
}

impl Messages {
    /// Messages in a format; `quiet` drops facts, never errors or warnings.
    pub(super) fn new(format: Format, quiet: bool) -> Self {
        Self { format, quiet, ..Self::default() }
    }

    /// Sink of the same kind whose messages are held back until [`Self::write_held`] writes them.
    pub(super) fn held_back(&self) -> Self {
        let kept = Kept::default();
        let mut all = APART.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|apart| apart.strong_count() > 0);
        all.push(Arc::downgrade(&kept));
        Self { kept: Some(kept), ..Self::new(self.format, self.quiet) }
    }

    /// Whether messages are held back.
    pub(super) fn are_kept(&self) -> bool {
        self.kept.is_some()
    }

    /// Writes the messages that `apart` holds back.
    pub(super) fn write_held(&self, apart: &Self) {
        self.warnings.fetch_add(apart.warnings(), Ordering::Relaxed);
        if let Some(Ok(mut lines)) = apart.kept.as_ref().map(|kept| kept.lock())
            && !lines.is_empty()
        {
            let lines = std::mem::take(&mut *lines).concat();
            self.bars.suspend(|| drop(std::io::stderr().write_all(lines.as_bytes())));
        }
    }

    /// Writes one message.
    pub(super) fn say(&self, severity: Severity, message: &Diagnostic) {
        if severity == Severity::Warning {
            self.warnings.fetch_add(message.count.max(1), Ordering::Relaxed);
        }
        if severity == Severity::Info && self.quiet {
            return;
        }
        let line = line(self.format, severity, message);
        if let Some(Ok(mut lines)) = self.kept.as_ref().map(|kept| kept.lock()) {
            lines.push(line + "\n");
            return;
        }
        // A closed stderr is no reason to stop.
        self.bars.suspend(|| drop(writeln!(std::io::stderr(), "{line}")));
    }

    /// Writes an error that does not concern a file.
    pub(super) fn error(&self, code: &'static str, text: impl Into<String>, remedy: impl Into<String>) {
        self.say(Severity::Error, &Diagnostic::new(code, "", "", text).remedy(remedy));
    }

    /// Writes a fact.
    pub(super) fn info(&self, code: &'static str, text: impl Into<String>) {
        self.say(Severity::Info, &Diagnostic::new(code, "", "", text));
    }

    /// Writes a fault, and returns `exit`.
    pub(super) fn fail(&self, fault: &Diagnostic, exit: Exit) -> Exit {
        self.say(Severity::Error, fault);
        exit
    }

    /// Reports that a file could not be written.
    pub(super) fn unwritable(&self, file: &Path, why: &impl ToString) -> Exit {
        self.fail(&Diagnostic::new("output-unwritable", file, "", why.to_string()), Exit::Failed)
    }

    /// Reports a fault of the command line.
    pub(super) fn wrong(&self, UsageError(text): UsageError) -> Exit {
        self.error("usage", text, "");
        Exit::Usage
    }

    /// Prints to stdout; failures are reported.
    pub(super) fn print(&self, text: &str) -> Result<(), Exit> {
        super::print(text).map_err(|why| self.unprintable(&why))
    }

    /// Reports that something could not be printed.
    pub(super) fn unprintable(&self, why: &io::Error) -> Exit {
        self.error("output-unwritable", format!("standard output: {why}"), "");
        Exit::Failed
    }

    /// Reports all faults that prevented a file from being loaded.
    pub(super) fn load_error(&self, error: &LoadError) -> Exit {
        match error {
            LoadError::Read { what, source } => {
                let text = if what.text.is_empty() { source.to_string() } else { format!("{}: {source}", what.text) };
                let remedy =
                    if source.kind() == io::ErrorKind::NotFound { other_name(&what.file) } else { String::new() };
                self.say(Severity::Error, &Diagnostic { text, remedy, ..(**what).clone() });
            }
            LoadError::Input(faults) => faults.iter().for_each(|fault| self.say(Severity::Error, fault)),
        }
        error.into()
    }

    /// Number of warnings so far, including repetitions.
    pub(super) fn warnings(&self) -> u32 {
        self.warnings.load(Ordering::Relaxed)
    }
}

/// Remedy for a missing file: a similar name in its folder, if there is one.
fn other_name(file: &Path) -> String {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Ok(entries) = std::fs::read_dir(folder) else {
        return format!("the folder '{}' is not there", folder.display());
    };
    let names: Vec<String> = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    let typed = file.file_name().unwrap_or_default().to_string_lossy();
    match nearest(&typed, names.iter().map(String::as_str)) {
        Some(near) => format!("did you mean '{near}'?"),
        None => "check its name".into(),
    }
}

fn line(format: Format, severity: Severity, message: &Diagnostic) -> String {
    match format {
        Format::Text if severity == Severity::Info => message.to_string(),
        Format::Text => format!("{}: {message}", severity.name()),
        Format::Json => serde_json::json!({
            "severity": severity.name(),
            "code": message.code,
            "file": message.file.to_string_lossy(),
            "place": message.place,
            "text": message.text,
            "remedy": message.remedy,
            "count": message.count,
        })
        .to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault() -> Diagnostic {
        Diagnostic::new("obj-index", "a \"b\"\n.obj", "118", "index 91, but only 88 exist").remedy("export it again")
    }

    #[test]
    fn a_file_that_is_not_there_may_be_another_in_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("Duck.glb"), []).unwrap();
        assert_eq!(other_name(&folder.path().join("duk.glb")), "did you mean 'Duck.glb'?");
        assert_eq!(other_name(&folder.path().join("helmet.obj")), "check its name");
        assert!(other_name(&folder.path().join("no/Duck.glb")).contains("is not there"));
    }

    #[test]
    fn a_message_is_one_line_whatever_the_file_is_called() {
        let text = line(Format::Text, Severity::Error, &fault());
        assert_eq!(text, "error: a \"b\"\u{fffd}.obj:118: index 91, but only 88 exist; export it again");
    }

    #[test]
    fn a_json_message_is_one_object_on_one_line() {
        let text = line(Format::Json, Severity::Warning, &fault());
        assert!(!text.contains('\n'));
        let back: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            (&back["code"], &back["place"], &back["file"]),
            (&"obj-index".into(), &"118".into(), &"a \"b\"\n.obj".into())
        );
        assert_eq!(back["remedy"], "export it again");
    }

    #[test]
    fn warnings_are_counted_as_often_as_they_were_met() {
        let messages = Messages::new(Format::Text, true);
        messages.say(Severity::Warning, &Diagnostic { count: 3, ..fault() });
        messages.say(Severity::Error, &fault());
        assert_eq!(messages.warnings(), 3);
    }
}
