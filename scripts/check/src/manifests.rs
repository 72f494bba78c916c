//! Member manifests only inherit: versions, lints and package fields are written once, in the workspace manifest.

use std::path::Path;

use anyhow::Context as _;
use toml::{Table, Value};

use crate::Finding;
use crate::metadata::Package;

const DEPENDENCY_TABLES: [&str; 3] = ["dependencies", "dev-dependencies", "build-dependencies"];
/// What a member's dependency may say beside `workspace = true`.
const MEMBER_KEYS: [&str; 3] = ["workspace", "features", "optional"];
const INHERITED_FIELDS: [&str; 5] = ["version", "edition", "rust-version", "license", "publish"];

/// Reads each member's manifest and reports what is not inherited.
///
/// # Errors
/// A manifest cannot be read or is not TOML.
pub(crate) fn check(root: &Path, packages: &[Package]) -> anyhow::Result<Vec<Finding>> {
    let mut findings = Vec::new();
    for package in packages {
        let path = package.manifest_path.as_path();
        let text =
            std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let manifest: Table = text.parse().with_context(|| format!("{} is not TOML", path.display()))?;
        let place = path.strip_prefix(root).unwrap_or(path).display().to_string();
        findings.extend(not_inherited(&manifest).into_iter().map(|sentence| Finding::new(&place, sentence)));
    }
    Ok(findings)
}

fn not_inherited(manifest: &Table) -> Vec<String> {
    let mut sentences = Vec::new();
    let package = manifest.get("package").and_then(Value::as_table);
    for field in INHERITED_FIELDS {
        if !package.and_then(|table| table.get(field)).is_some_and(is_inherited) {
            sentences.push(format!("write `{field}.workspace = true` under [package]"));
        }
    }
    if !manifest.get("lints").is_some_and(is_inherited) {
        sentences.push("write `[lints] workspace = true`".to_owned());
    }
    let targets = manifest.get("target").and_then(Value::as_table).into_iter().flatten();
    let tables = std::iter::once(manifest).chain(targets.filter_map(|(_, target)| target.as_table()));
    for table in tables {
        for kind in DEPENDENCY_TABLES {
            let dependencies = table.get(kind).and_then(Value::as_table);
            for (name, dependency) in dependencies.into_iter().flatten() {
                sentences.extend(dependency_objection(name, dependency));
            }
        }
    }
    sentences
}

fn is_inherited(value: &Value) -> bool {
    value.get("workspace").and_then(Value::as_bool) == Some(true)
}

fn dependency_objection(name: &str, dependency: &Value) -> Option<String> {
    if !is_inherited(dependency) {
        return Some(format!(
            "`{name}` is not inherited: write its version in the root Cargo.toml, here `{name}.workspace = true`"
        ));
    }
    let keys = dependency.as_table().into_iter().flatten().map(|(key, _)| key.as_str());
    let strange: Vec<&str> = keys.filter(|key| !MEMBER_KEYS.contains(key)).collect();
    (!strange.is_empty())
        .then(|| format!("`{name}` says {} here: that belongs in the root Cargo.toml", strange.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    const INHERITING: &str = r#"
        [package]
        name = "radio"
        version.workspace = true
        edition.workspace = true
        rust-version.workspace = true
        license.workspace = true
        publish.workspace = true
        [lints]
        workspace = true
        [dependencies]
        protocol.workspace = true
        thiserror = { workspace = true, features = ["std"] }
    "#;

    #[test]
    fn inheriting_manifest_is_silent() {
        assert_eq!(not_inherited(&INHERITING.parse().unwrap()), Vec::<String>::new());
    }

    #[test]
    fn version_in_a_member_is_found_in_every_kind_of_table() {
        for table in ["dev-dependencies", "build-dependencies", "target.'cfg(unix)'.dependencies"] {
            for dependency in ["hex = \"0.4\"", "hex = { version = \"0.4\" }", "hex = { path = \"../hex\" }"]
            {
                let text = format!("{INHERITING}\n[{table}]\n{dependency}\n");
                let found = not_inherited(&text.parse().unwrap());
                assert_eq!(found.len(), 1, "{table} {dependency}: {found:?}");
                assert!(found[0].contains("`hex` is not inherited"));
            }
        }
    }

    #[test]
    fn missing_lints_and_own_edition_are_found() {
        let text = INHERITING
            .replace("[lints]\n        workspace = true", "")
            .replace("edition.workspace = true", "edition = \"2021\"");
        assert_eq!(not_inherited(&text.parse().unwrap()).len(), 2);
    }
}
