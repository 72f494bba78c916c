//! Checks of the house that no compiler makes, run by `scripts/test` and by hand with `cargo run -p check`.
//!
//! - `arrows`: a crate knows only the crates that the table in `house` allows, and every crate is in the table;
//! - `manifests`: a dependency's version is written once, in the workspace manifest;
//! - `sources`: SQL stays in its rooms, `no_std` rooms say so, `mission` takes only airtime from `radio`;
//! - `length`: a file that nobody can read at a sitting is reported, and refused when it is far too long.
//!
//! What it does not do: it does not look at third-party crates (cargo-deny does) and it does not parse Rust beyond
//! telling code, comments and string literals apart (`source`).

mod arrows;
mod house;
mod length;
mod manifests;
mod metadata;
mod source;
mod sources;

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context as _;

/// Something that breaks a rule of the house: where, and a sentence that names the rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Finding {
    /// Crate name or file path, with a line number where there is one.
    pub(crate) place: String,
    /// What is wrong and what to do instead.
    pub(crate) sentence: String,
}

impl Finding {
    pub(crate) fn new(place: impl Into<String>, sentence: impl Into<String>) -> Self {
        Self { place: place.into(), sentence: sentence.into() }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.sentence)
    }
}

/// A text file of the workspace, with its path from the workspace root.
#[derive(Debug, Clone)]
pub(crate) struct TextFile {
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

fn main() -> anyhow::Result<ExitCode> {
    let workspace = metadata::read()?;
    let root = &workspace.workspace_root;
    let mut files = Vec::new();
    collect(root, root, &workspace.target_directory, &mut files)?;
    files.sort_by(|a, b| a.path.cmp(&b.path));

    let mut findings = arrows::check(&workspace.packages);
    findings.extend(manifests::check(root, &workspace.packages)?);
    findings.extend(sources::check(&files));
    let (notes, too_long) = length::check(&files);
    findings.extend(too_long);

    for note in &notes {
        eprintln!("note: {note}");
    }
    for finding in &findings {
        eprintln!("error: {finding}");
    }
    if findings.is_empty() {
        eprintln!(
            "house in order: {} crates, {} files, {} notes",
            workspace.packages.len(),
            files.len(),
            notes.len()
        );
        Ok(ExitCode::SUCCESS)
    } else {
        eprintln!(
            "{} findings; the rules are in docs/architecture.md, the table in scripts/check/src/house.rs",
            findings.len()
        );
        Ok(ExitCode::FAILURE)
    }
}

/// Folders that hold nothing a person of this project wrote.
const SKIPPED_FOLDERS: [&str; 4] = ["target", "node_modules", "dist", "demo-data"];
const SOURCE_ENDINGS: [&str; 5] = ["rs", "py", "ts", "svelte", "css"];

fn collect(root: &Path, folder: &Path, target: &Path, files: &mut Vec<TextFile>) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("cannot list {}", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if name.starts_with('.') || path.is_symlink() {
            continue;
        }
        if path.is_dir() {
            if path != target && !SKIPPED_FOLDERS.contains(&name) {
                collect(root, &path, target, files)?;
            }
        } else if path.extension().and_then(|e| e.to_str()).is_some_and(|e| SOURCE_ENDINGS.contains(&e)) {
            let text =
                std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
            files.push(TextFile { path: path.strip_prefix(root).unwrap_or(&path).to_path_buf(), text });
        }
    }
    Ok(())
}
