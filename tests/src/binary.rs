//! The real `gs-server`, beside the test's own executable.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::SystemTime;

/// Crates whose source goes into the binary.
const ROOMS: [&str; 9] =
    ["protocol", "tle", "radio", "mission", "satellite", "rehearsal", "api", "migrations", "gs-server"];

/// The root of the workspace.
///
/// # Panics
/// Never: this crate has a parent folder.
#[must_use]
pub fn workspace() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace")
}

/// `gs-server`. Built by cargo when it is missing or older than its source: `cargo nextest run -p end-to-end` alone
/// builds no binary of another package. `GS_SERVER` in the environment names another binary, such as an installed one.
///
/// # Panics
/// When it cannot be built.
#[must_use]
pub fn gs_server() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        if let Some(named) = std::env::var_os("GS_SERVER").filter(|path| !path.is_empty()) {
            return named.into();
        }
        let path = profile_folder().join("gs-server");
        if is_old(&path) {
            build(&path);
        }
        path
    })
}

/// `target/debug`, whatever the target folder is called: the test itself is `target/debug/deps/NAME`.
fn profile_folder() -> PathBuf {
    let test = std::env::current_exe().expect("a test knows where it is");
    test.ancestors().nth(2).expect("a test lies in deps/").to_path_buf()
}

fn is_old(binary: &Path) -> bool {
    let Some(built) = modified(binary) else { return true };
    ROOMS.iter().any(|room| newest(&workspace().join(room)).is_some_and(|source| source > built))
}

fn modified(path: &Path) -> Option<SystemTime> {
    path.metadata().ok()?.modified().ok()
}

/// The newest source file of a crate: its manifest, and everything under `src`, `sqlite` and `postgres`.
fn newest(room: &Path) -> Option<SystemTime> {
    fn walk(path: &Path) -> Option<SystemTime> {
        if !path.is_dir() {
            return modified(path);
        }
        path.read_dir().ok()?.flatten().filter_map(|entry| walk(&entry.path())).max()
    }
    ["Cargo.toml", "src", "sqlite", "postgres"].iter().filter_map(|part| walk(&room.join(part))).max()
}

fn build(path: &Path) {
    let profile = path.parent().expect("it lies in a folder");
    let target = profile.parent().expect("target/debug has a parent");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["build", "--quiet", "--locked", "-p", "gs-server", "--target-dir"]).arg(target);
    if profile.file_name().is_some_and(|name| name == "release") {
        cargo.arg("--release");
    }
    eprintln!("{} is missing or old: cargo builds it", path.display());
    let status = cargo.current_dir(workspace()).status().expect("cargo starts");
    assert!(status.success(), "gs-server cannot be built: {status}");
}
