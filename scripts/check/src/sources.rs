//! Rules that live in the source text: SQL in its rooms, `no_std` said aloud, airtime only.

use std::path::Path;

use crate::source::Source;
use crate::{Finding, TextFile, house};

/// Where SQL and the database crate may stand.
const SQL_ROOMS: [&str; 4] =
    ["migrations/", "gs-server/src/storage/", "gs-server/src/storage.rs", "gs-server/tests/storage"];
/// This file quotes SQL in order to find it.
const OWN_ROOM: &str = "scripts/check/";

/// Every finding in the Rust files of the workspace.
pub(crate) fn check(files: &[TextFile]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in files.iter().filter(|file| file.path.extension().is_some_and(|ending| ending == "rs")) {
        let path = slashed(&file.path);
        let source = Source::read(&file.text);
        if !SQL_ROOMS.iter().chain(&[OWN_ROOM]).any(|room| path.starts_with(room)) {
            findings.extend(sql(&path, &source));
        }
        if path.starts_with("mission/src/") {
            findings.extend(more_than_airtime(&path, &source));
        }
        let no_std =
            house::ROOMS.iter().any(|room| room.no_std && path == format!("{}/src/lib.rs", room.name));
        if no_std && !says_no_std(&source) {
            findings.push(Finding::new(
                path,
                "this crate also runs where there is no std: begin with `#![no_std]`",
            ));
        }
    }
    findings
}

fn slashed(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

fn sql(path: &str, source: &Source) -> Vec<Finding> {
    let statements =
        source.literals.iter().filter(|(_, text)| is_sql(text)).map(|(line, _)| (*line, "an SQL statement"));
    let crate_names =
        source.lines().filter(|(_, line)| has_word(line, "sqlx")).map(|(line, _)| (line, "sqlx"));
    statements
        .chain(crate_names)
        .map(|(line, what)| {
            Finding::new(
                format!("{path}:{line}"),
                format!("{what} stands here: SQL lives in migrations and gs-server/src/storage"),
            )
        })
        .collect()
}

/// Whether a literal reads as a statement: its first words decide, so that prose about SQL stays legal.
fn is_sql(literal: &str) -> bool {
    let lower = literal.replace("\\n", " ").to_lowercase();
    let words: Vec<&str> = lower.split_whitespace().collect();
    match words.as_slice() {
        ["select", rest @ ..] => rest.contains(&"from"),
        ["update", _, "set", ..] | ["insert", "into", _, ..] | ["insert", "or", _, "into", ..] => true,
        ["delete", "from", _, ..] | ["alter", "table", ..] => true,
        ["create" | "drop", kind, _, ..] => ["table", "index", "unique", "trigger", "view"].contains(kind),
        ["pragma", _, ..] => true,
        ["begin", "immediate" | "exclusive" | "transaction"] => true,
        _ => false,
    }
}

fn has_word(line: &str, word: &str) -> bool {
    line.match_indices(word).any(|(at, _)| {
        let is_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
        !is_word(line[..at].chars().next_back()) && !is_word(line[at + word.len()..].chars().next())
    })
}

/// `mission` reckons with airtime; how a module is driven is not its business.
fn more_than_airtime(path: &str, source: &Source) -> Vec<Finding> {
    let is_foreign = |line: &str| {
        line.match_indices("radio::").any(|(at, name)| {
            let before = line[..at].chars().next_back();
            let is_our_crate = !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':');
            is_our_crate && !line[at + name.len()..].starts_with("airtime")
        })
    };
    source
        .lines()
        .filter(|(_, line)| is_foreign(line))
        .map(|(line, _)| {
            Finding::new(format!("{path}:{line}"), "mission takes radio::airtime and nothing else from radio")
        })
        .collect()
}

fn says_no_std(source: &Source) -> bool {
    source
        .lines()
        .any(|(_, line)| line.trim() == "#![no_std]" || line.trim() == "#![cfg_attr(not(test), no_std)]")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(path: &str, text: &str) -> Vec<String> {
        check(&[TextFile { path: path.into(), text: text.to_owned() }]).into_iter().map(|f| f.place).collect()
    }

    #[test]
    fn sql_outside_its_rooms_is_found() {
        let text = "// select a from b\nlet q = \"select a,\n b from frames\";\nuse sqlx::Row;\n";
        assert_eq!(
            places("gs-server/src/http/frames.rs", text),
            ["gs-server/src/http/frames.rs:2", "gs-server/src/http/frames.rs:4"]
        );
        assert!(places("gs-server/src/storage/frames.rs", text).is_empty());
        assert!(places("migrations/src/lib.rs", text).is_empty());
    }

    #[test]
    fn statements_are_told_from_prose() {
        for statement in [
            "SELECT 1 FROM x",
            "  insert into frames (a) values ($1)",
            "insert or ignore into x values (1)",
            "delete from x",
            "update frames set a = 1",
            "create table x (a int)",
            "create unique index i on x (a)",
            "pragma journal_mode = wal",
            "begin immediate",
        ] {
            assert!(is_sql(statement), "{statement}");
        }
        for prose in [
            "select an image",
            "update the witness",
            "delete",
            "create key",
            "begin",
            "insert",
            "from",
            "drop",
        ] {
            assert!(!is_sql(prose), "{prose}");
        }
    }

    #[test]
    fn mission_takes_only_airtime_from_radio() {
        let text = "use radio::airtime::LoraPhy;\nuse crate::radio::Anything;\nuse radio::driver::Driver;\nuse radio::{driver};\n";
        assert_eq!(places("mission/src/link.rs", text), ["mission/src/link.rs:3", "mission/src/link.rs:4"]);
        assert!(places("satellite/src/device.rs", text).is_empty());
    }

    #[test]
    fn wire_crate_must_say_no_std() {
        assert_eq!(places("protocol/src/lib.rs", "//! #![no_std]\n"), ["protocol/src/lib.rs"]);
        assert!(places("protocol/src/lib.rs", "//! Frames.\n#![no_std]\n").is_empty());
    }
}
