//! A study as text, JSON, CSV and as a page for a browser.

pub mod csv;
pub mod html;
pub mod json;
pub mod text;

use super::Study;
use std::path::Path;

/// What kind of file a report is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// For programs (schema `meshray-study/1`).
    Json,
    /// A line for each setting.
    Csv,
    /// For a browser.
    Html,
}

impl Format {
    /// By the ending of a name; the error says which endings there are.
    pub fn from_path(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("json") => Ok(Self::Json),
            Some("csv") => Ok(Self::Csv),
            Some("html" | "htm") => Ok(Self::Html),
            _ => Err(format!("{}: a study is written as .json, .csv or .html", path.display())),
        }
    }

    /// The report.
    pub fn write(self, study: &Study) -> String {
        match self {
            Self::Json => json::write(study),
            Self::Csv => csv::write(study),
            Self::Html => html::write(study),
        }
    }
}
