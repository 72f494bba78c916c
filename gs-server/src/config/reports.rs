//! `[reports]`: what is written down without being asked.

use std::path::PathBuf;

use serde::Deserialize;

/// `[reports]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReportsSection {
    /// A minute after the LOS of each pass its report is written as a file. Default true.
    pub passes: bool,
    /// Where to. Default: `reports` in the data folder.
    pub folder: Option<PathBuf>,
}

impl Default for ReportsSection {
    fn default() -> Self {
        Self { passes: true, folder: None }
    }
}
