//! Messages: one line each to stderr, as text or as JSON objects.
//!
//! The JSON form is one object a line: `{"severity","code","file","place","text","remedy","count"}`; `severity` is
//! `error`, `warning` or `info`, codes are stable. stdout holds only what was asked for, never a message.

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

/// How messages look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Format {
    /// For people.
    #[default]
    Text,
    /// For programs.
    Json,
}

impl Format {
    /// What `--messages` says among words that may not be understood.
    pub(super) fn asked_for(words: &[OsString]) -> Self {
        let apart = |pair: &[OsString]| pair[0] == "--messages" && pair[1] == "json";
        let is_json = words.iter().any(|word| word == "--messages=json") || words.windows(2).any(apart);
        if is_json { Self::Json } else { Self::Text }
    }
}

/// What the parser of the command line says, as one message: its first paragraph, and its tips as the remedy.
pub(super) fn of_parser(said: &str) -> Diagnostic {
    let line = |paragraph: &str| paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut paragraphs = said.split("\n\n").map(line).filter(|p| !p.is_empty());
    let first = paragraphs.next().unwrap_or_default();
    let tips: Vec<String> = paragraphs.filter_map(|p| Some(p.strip_prefix("tip: ")?.to_owned())).collect();
    let text = first.strip_prefix("error: ").unwrap_or(&first);
    Diagnostic::new("usage", "", "", text).remedy(tips.join("; "))
}

/// The last line of a process that a signal ends.
pub(super) fn of_signal(format: Format) -> String {
    match format {
        Format::Text => "meshray: interrupted".into(),
        Format::Json => {
            line(format, Severity::Error, &Diagnostic::new("interrupted", "", "", "interrupted by a signal"))
        }
    }
}

/// How bad a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Severity {
    /// What was asked for did not happen.
    Error,
    /// It happened, but not quite as the input says.
    Warning,
    /// A fact worth knowing; `--quiet` drops it.
    Info,
}

impl Severity {
    /// The word in messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Info => "info",
        }
    }
}

/// Lines that wait.
type Kept = Arc<Mutex<Vec<String>>>;

/// All that wait, in the order in which they began to.
static APART: Mutex<Vec<Weak<Mutex<Vec<String>>>>> = Mutex::new(Vec::new());

/// Writes what still waits, before the process ends.
pub(super) fn tell_all_apart() {
    let all = APART.lock().unwrap_or_else(PoisonError::into_inner);
    for apart in all.iter().filter_map(Weak::upgrade) {
        // Whoever holds it writes.
        if let Ok(mut lines) = apart.try_lock() {
            drop(std::io::stderr().write_all(std::mem::take(&mut *lines).concat().as_bytes()));
        }
    }
}

/// Where messages go, and how many of them were warnings.
#[derive(Debug, Default)]
pub(super) struct Messages {
    format: Format,
    quiet: bool,
    warnings: AtomicU32,
    /// Lines that wait until it is their turn; `None`: none does.
    kept: Option<Kept>,
    /// Bars on the same terminal; they step aside while a line is written.
    pub(super) bars: MultiProgress,
}

impl Messages {
    /// Messages in a format; `quiet` drops facts, never errors and warnings.
    pub(super) fn new(format: Format, quiet: bool) -> Self {
        Self { format, quiet, ..Self::default() }
    }

    /// Such messages that are kept until [`Self::tell`] writes them.
    pub(super) fn apart(&self) -> Self {
        let kept = Kept::default();
        let mut all = APART.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|apart| apart.strong_count() > 0);
        all.push(Arc::downgrade(&kept));
        Self { kept: Some(kept), ..Self::new(self.format, self.quiet) }
    }

    /// Whether they are kept.
    pub(super) fn are_kept(&self) -> bool {
        self.kept.is_some()
    }

    /// Writes the messages that were kept apart.
    pub(super) fn tell(&self, apart: &Self) {
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
        // Nobody left to read stderr is no reason to stop.
        self.bars.suspend(|| drop(writeln!(std::io::stderr(), "{line}")));
    }

    /// Writes an error that is no file's fault.
    pub(super) fn error(&self, code: &'static str, text: impl Into<String>, remedy: impl Into<String>) {
        self.say(Severity::Error, &Diagnostic::new(code, "", "", text).remedy(remedy));
    }

    /// Writes a fact.
    pub(super) fn info(&self, code: &'static str, text: impl Into<String>) {
        self.say(Severity::Info, &Diagnostic::new(code, "", "", text));
    }

    /// Writes why something could not be done, and gives how that ends.
    pub(super) fn fail(&self, fault: &Diagnostic, exit: Exit) -> Exit {
        self.say(Severity::Error, fault);
        exit
    }

    /// Writes why a file could not be written.
    pub(super) fn unwritable(&self, file: &Path, why: &impl ToString) -> Exit {
        self.fail(&Diagnostic::new("output-unwritable", file, "", why.to_string()), Exit::Failed)
    }

    /// Writes what is wrong with the command line.
    pub(super) fn wrong(&self, UsageError(text): UsageError) -> Exit {
        self.error("usage", text, "");
        Exit::Usage
    }

    /// Prints to stdout; whatever keeps it from that is said.
    pub(super) fn print(&self, text: &str) -> Result<(), Exit> {
        super::print(text).map_err(|why| self.unprintable(&why))
    }

    /// Writes why something could not be printed.
    pub(super) fn unprintable(&self, why: &io::Error) -> Exit {
        self.error("output-unwritable", format!("standard output: {why}"), "");
        Exit::Failed
    }

    /// Writes every fault that kept a file from being loaded.
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

    /// Warnings so far, each counted as often as it was met.
    pub(super) fn warnings(&self) -> u32 {
        self.warnings.load(Ordering::Relaxed)
    }
}

/// What helps against a file that is not there: what else its folder has that is called almost so.
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
