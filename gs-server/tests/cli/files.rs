//! Verbs that read and write files: keys, configurations, data folders.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use super::{json, run};

fn in_folder(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

#[test]
fn a_key_is_made_listed_and_never_printed() {
    let folder = tempfile::tempdir().unwrap();
    let file = in_folder(folder.path(), "a.key");
    let (code, out, error) = run(["key", "new", &file, "--simulated", "--json"]);
    assert_eq!((code, error.as_str()), (0, ""));
    let made = json(&out);
    assert_eq!(made["simulated"], true);
    let id = made["key"].as_str().unwrap();
    let text = fs::read_to_string(&file).unwrap();
    let secret = text.lines().find(|line| line.len() == 32).unwrap();
    assert!(!out.contains(secret));
    assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o7777, 0o600);

    let (code, out, error) = run(["key", "new", &file]);
    assert_eq!((code, out.as_str()), (3, ""), "never overwritten: {error}");

    let (code, out, _) = run(["key", "new", "--id", &in_folder(folder.path(), "keys")]);
    assert_eq!(code, 0);
    let (second, path) = out.trim().split_once("  ").unwrap();
    assert!(path.ends_with(&format!("keys/{second}.key")), "{path}");

    let (code, out, _) = run(["key", "list", &file, &in_folder(folder.path(), "keys")]);
    assert_eq!(code, 0);
    assert!(out.contains(id) && out.contains(second) && out.contains("simulated"), "{out}");
    assert!(!out.contains(secret));

    fs::set_permissions(&file, Permissions::from_mode(0o644)).unwrap();
    let (code, out, error) = run(["key", "list", &file, "--json"]);
    assert_eq!(code, 3);
    assert!(json(&out)["refused"].as_str().unwrap().contains(&format!("chmod 600 {file}")), "{out}");
    assert!(!error.contains(secret) && !out.contains(secret));
}

#[test]
fn a_configuration_is_checked_with_its_keys_and_shown_without_secrets() {
    let folder = tempfile::tempdir().unwrap();
    let config = in_folder(folder.path(), "station.toml");
    let (code, example, _) = run(["config", "example"]);
    assert_eq!(code, 0);
    fs::write(&config, &example).unwrap();

    let (code, _, error) = run(["config", "check", &config]);
    assert_eq!(code, 3, "its key is missing: {error}");
    assert!(error.contains("gs-server key new"), "{error}");

    let key = in_folder(folder.path(), "pixelsat-1.key");
    assert_eq!(run(["key", "new", &key, "--simulated"]).0, 0);
    let (code, _, error) = run(["config", "check", &config]);
    assert_eq!(code, 3, "a simulated key with real links: {error}");

    fs::remove_file(&key).unwrap();
    assert_eq!(run(["key", "new", &key]).0, 0);
    let (code, out, error) = run(["config", "check", "--config", &config, "--json"]);
    assert_eq!((code, error.as_str()), (0, ""));
    assert_eq!((json(&out)["ok"].clone(), json(&out)["simulated"].clone()), (true.into(), false.into()));

    fs::write(&config, example.replace("[storage]", "[storage]\nfoler = \"x\"")).unwrap();
    let (code, out, error) = run(["config", "check", &config]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(error.contains("foler"), "{error}");
    let (code, _, error) = run(["config", "check", &in_folder(folder.path(), "none.toml")]);
    assert_eq!(code, 2, "{error}");
}

#[test]
fn two_satellites_do_not_share_a_key() {
    let folder = tempfile::tempdir().unwrap();
    let config = in_folder(folder.path(), "station.toml");
    let example = run(["config", "example"]).1;
    let second = "[[satellites]]\nname = \"pixelsat-2\"\nkey_file = \"copy.key\"\n\n[storage]";
    fs::write(&config, example.replacen("[storage]", second, 1)).unwrap();
    let key = folder.path().join("pixelsat-1.key");
    assert_eq!(run(["key", "new", &key.display().to_string()]).0, 0);
    fs::copy(&key, folder.path().join("copy.key")).unwrap();
    let wanted = "satellites pixelsat-1 and pixelsat-2 have the same key";
    for verb in
        [&["config", "check"][..], &["serve", "--log", "error", "--listen", "127.0.0.1:0", "--config"]]
    {
        let (code, out, error) = run(verb.iter().copied().chain([config.as_str()]));
        assert_eq!((code, out.as_str()), (3, ""), "{verb:?}: {error}");
        assert!(error.contains(wanted), "{verb:?}: {error}");
    }
}

#[test]
fn serve_refuses_before_it_begins() {
    let folder = tempfile::tempdir().unwrap();
    let config = in_folder(folder.path(), "station.toml");
    fs::write(&config, run(["config", "example"]).1).unwrap();
    let key = folder.path().join("pixelsat-1.key");
    fs::write(&key, "000102030405060708090a0b0c0d0e0f").unwrap();
    fs::set_permissions(&key, Permissions::from_mode(0o644)).unwrap();
    let serve = ["serve", "--config", &config, "--listen", "127.0.0.1:0", "--log", "error"];
    let (code, out, error) = run(serve);
    assert_eq!((code, out.as_str()), (3, ""));
    assert!(error.contains("chmod 600") && !error.contains("0a0b0c"), "{error}");

    fs::set_permissions(&key, Permissions::from_mode(0o600)).unwrap();
    fs::write(&key, "0001").unwrap();
    let (code, _, error) = run(serve);
    assert_eq!(code, 3);
    assert!(error.contains("32 hex digits"), "{error}");
    assert!(!folder.path().join("ground-data").exists(), "nothing was made");
}

#[test]
fn redecode_wants_a_data_folder() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, error) = run(["redecode", "--data", &in_folder(folder.path(), "none")]);
    assert_eq!(code, 2, "{error}");
    assert!(!folder.path().join("none").exists(), "nothing was made");
}
