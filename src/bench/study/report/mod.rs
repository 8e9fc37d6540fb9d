//! A study as text, JSON, CSV or HTML.

pub mod csv;
pub mod html;
pub mod json;
pub mod text;

use super::Study;
use std::path::Path;

/// Formats of report files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// JSON of schema `meshray-study/1`.
    Json,
    /// One line per setting.
    Csv,
    /// HTML page.
    Html,
}

impl Format {
    /// Format by the file name's extension; the error lists the known extensions.
    pub fn from_path(path: &Path) -> Result<Self, String> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("json") => Ok(Self::Json),
            Some("csv") => Ok(Self::Csv),
            Some("html" | "htm") => Ok(Self::Html),
            _ => Err(format!("{}: a study is written as .json, .csv or .html", path.display())),
        }
    }

    /// Writes the report in this format.
    pub fn write(self, study: &Study) -> String {
        match self {
            Self::Json => json::write(study),
            Self::Csv => csv::write(study),
            Self::Html => html::write(study),
        }
    }
}
