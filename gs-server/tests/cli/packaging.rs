//! What the package brings along fits the program.

use std::path::Path;

use gs_server::config::Config;

fn file(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../packaging").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn the_configuration_of_the_package_is_one() {
    let text = file("station.toml");
    let config = Config::from_toml(&text, Path::new("/etc/pixelsat-ground")).expect("a configuration");
    config.check().expect("it makes sense");
    assert_eq!(config.storage.folder, Path::new("/var/lib/pixelsat-ground"), "what StateDirectory makes");
    let with_key = text.replace("# key_file", "key_file");
    assert!(with_key.contains("\nkey_file"));
    Config::from_toml(&with_key, Path::new("/")).expect("also with a key").check().expect("it makes sense");
    assert!(!config.links[0].armed, "a fresh installation transmits nothing");
}

#[test]
fn the_unit_starts_the_server_with_that_configuration_and_does_not_repeat_what_is_refused() {
    let unit = file("systemd/gs-server.service");
    for line in [
        "Type=notify",
        "ExecStart=/usr/bin/gs-server serve --config /etc/pixelsat-ground/station.toml",
        "User=pixelsat-ground",
        "StateDirectory=pixelsat-ground",
        "RestartPreventExitStatus=2 3",
        "NoNewPrivileges=yes",
        "ProtectSystem=strict",
    ] {
        assert!(unit.lines().any(|found| found == line), "{line}");
    }
    assert!(file("debian/postinst").contains("user=pixelsat-ground"));
}
