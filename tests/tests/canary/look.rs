//! Everything that a server leaves and says: its files, its answers, its page.

use std::path::{Path, PathBuf};

use end_to_end::process::{gs_server, run};
use end_to_end::{Client, Folder};

use super::search::{Spellings, find};

pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let kind = entry.file_type().expect("its kind");
        if kind.is_dir() {
            found.extend(files(&entry.path()));
        } else if kind.is_file() {
            found.push(entry.path());
        }
    }
    found
}

/// Every path that is read, as the server's own table has them; numbers are those of the first row.
pub(crate) fn paths(index: &str) -> Vec<String> {
    const TABLE: &str = include_str!("../../../gs-server/src/http/routes.rs");
    let table = TABLE.split("fn table()").nth(1).expect("the table of all paths");
    let rows = table.lines().filter_map(|line| line.trim().strip_prefix("read(\"")?.split('"').next());
    let mut paths = Vec::new();
    for row in rows {
        if row.contains("{file}") {
            let names = index
                .split("/page/")
                .skip(1)
                .filter_map(|rest| rest.split(['"', '\'', '`', ' ', ')']).next());
            paths.extend(names.map(|name| row.replace("{file}", name)));
        } else {
            let path = row.replace("{id}", "1").replace("{month}", "2026-11");
            if path.contains("/reports/passes/") || path.contains("/reports/months/") {
                paths.extend([format!("{path}.html"), format!("{path}.md")]);
            }
            paths.push(path);
        }
    }
    paths
}

/// A backup of the server that runs, beside its data folder.
pub(crate) fn backup(folder: &Folder) {
    let mut command = gs_server(["backup", "--config"]);
    command.arg(folder.file("station.toml")).arg(folder.file("backup.tar"));
    let (code, out, error) = run(command);
    assert_eq!(code, 0, "{out}{error}");
}

/// Every answer to a question, the page and all that it loads. In an archive that `has_all` everything answers; else there may
/// be no first of something, no place and no elements.
pub(crate) fn walk(client: &Client, spellings: &Spellings, has_all: bool) {
    let pages = ["/", "/plan", "/login", "/api/docs"].map(|page| client.get(page).expect("the page").text());
    let paths = paths(&pages.concat());
    assert!(paths.len() > 60, "{paths:?}");
    for path in paths {
        let lists = ["frames", "commands", "downloads", "images", "events"];
        let whole = lists.iter().any(|list| path == format!("/api/v1/{list}"));
        let asked = match path.as_str() {
            _ if whole => format!("{path}?limit=1000"),
            "/api/v1/telemetry" => format!("{path}?parameter=heartbeat.temp"),
            _ => path,
        };
        let bearer = format!("Bearer {}", client.token);
        let answer = client.ask("GET", &asked, &[("authorization", &bearer)], b"");
        let answer = answer.unwrap_or_else(|error| panic!("{asked}: {error}"));
        let no_sky = answer.status == 409 && answer.text().contains(":no-place");
        let nothing = answer.status == 404 && (asked.contains("/1") || asked.contains("/telemetry?"));
        assert!(
            answer.status < 400 || !has_all && (no_sky || nothing),
            "{asked}: {} {}",
            answer.status,
            answer.text()
        );
        let headers = format!("{:?}", answer.headers);
        assert_eq!(
            find(&answer.body, spellings).or_else(|| find(headers.as_bytes(), spellings)),
            None,
            "{asked}"
        );
    }
}

/// Looks through every file of the folder but the secrets' own; those that it looked through.
pub(crate) fn scan(folder: &Folder, own: &[&str], spellings: &Spellings) -> Vec<PathBuf> {
    let own: Vec<PathBuf> = own.iter().map(|name| folder.file(name)).collect();
    for path in &own {
        let found = find(&std::fs::read(path).expect("a file with a secret"), spellings);
        assert!(found.is_some(), "the look is blind to {}", path.display());
    }
    look_through(folder.path(), &own, spellings)
}

/// Looks through every file below, but these.
pub(crate) fn look_through(folder: &Path, own: &[PathBuf], spellings: &Spellings) -> Vec<PathBuf> {
    let all: Vec<PathBuf> = files(folder).into_iter().filter(|path| !own.contains(path)).collect();
    for path in &all {
        match std::fs::read(path) {
            Ok(bytes) => assert_eq!(find(&bytes, spellings), None, "{}", path.display()),
            // A database server tidies up while it is looked at.
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => panic!("{}: {error}", path.display()),
        }
    }
    all
}
