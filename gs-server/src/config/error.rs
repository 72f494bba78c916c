//! What is wrong with a configuration, and what to do about it.

use std::path::{Path, PathBuf};

/// A configuration that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("configuration {}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is not TOML, a key is unknown, missing, or of the wrong type. The message shows line and column.
    #[error("configuration{}: {message}", file.as_ref().map(|f| format!(" {}", f.display())).unwrap_or_default())]
    Syntax {
        /// The file, when there is one.
        file: Option<PathBuf>,
        /// Line and column, the line itself, and what is wrong with it.
        message: String,
    },
    /// A value that cannot be.
    #[error("configuration, key {key}: {problem}. {remedy}")]
    Value {
        /// The key, e.g. `links[0].baud`.
        key: String,
        /// What was found.
        problem: String,
        /// What to do.
        remedy: String,
    },
}

impl ConfigError {
    pub(crate) fn syntax(error: &toml::de::Error) -> Self {
        Self::Syntax { file: None, message: error.to_string().trim_end().to_owned() }
    }

    pub(crate) fn in_file(self, path: &Path) -> Self {
        match self {
            Self::Syntax { message, .. } => Self::Syntax { file: Some(path.to_owned()), message },
            other => other,
        }
    }

    pub(crate) fn value(
        key: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Value { key: key.into(), problem: problem.into(), remedy: remedy.into() }
    }
}
