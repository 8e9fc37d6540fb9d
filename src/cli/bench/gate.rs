//! `--baseline` and `--fail-if`: a gate on counts that grew since an earlier report.

use super::super::exit::Exit;
use super::super::message::Messages;
use crate::bench::baseline::{Limit, failures};
use crate::bench::report::{Report, json};
use crate::load::Diagnostic;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// An earlier report and the changes allowed since.
pub(super) struct Gate {
    path: PathBuf,
    baseline: Value,
    limits: Vec<Limit>,
}

impl Gate {
    /// Reads the baseline, so that a wrong name is reported before any work.
    pub(super) fn read(path: &Path, limits: &[Limit], messages: &Messages) -> Result<Self, Exit> {
        let fail = |exit, text: String| {
            let fault = Diagnostic::new("baseline-unreadable", path, "", text);
            messages.fail(&fault.remedy("write one with --report NAME.json"), exit)
        };
        let text = fs::read_to_string(path).map_err(|e| fail(Exit::Failed, e.to_string()))?;
        let baseline: Value = serde_json::from_str(&text).map_err(|e| fail(Exit::Input, format!("not JSON: {e}")))?;
        if baseline["schema"] != json::SCHEMA {
            return Err(fail(Exit::Input, format!("its schema is {}, not {}", baseline["schema"], json::SCHEMA)));
        }
        Ok(Self { path: path.to_owned(), baseline, limits: limits.to_vec() })
    }

    /// Reports the counts that changed too much.
    pub(super) fn judge(&self, report: &Report, messages: &Messages) -> Exit {
        let now = serde_json::from_str(&json::write(report)).unwrap_or_default();
        match failures(&self.baseline, &now, &self.limits) {
            Ok(lines) => {
                lines.iter().for_each(|line| messages.error("count-changed", line, ""));
                if lines.is_empty() { Exit::Done } else { Exit::Failed }
            }
            Err(why) => {
                let text = format!("{} cannot be compared with this run: {why}", self.path.display());
                messages.error("baseline-other", text, "measure with the same files and flags");
                Exit::Failed
            }
        }
    }
}
