use super::*;

const SMALL: &str = r#"
[station]
name = "roof"
[[satellites]]
name = "pixelsat-1"
[[links]]
name = "e22"
satellite = "pixelsat-1"
kind = "serial"
port = "/dev/ttyUSB0"
[storage]
folder = "data"
"#;

fn parse(text: &str) -> Result<Config, ConfigError> {
    Config::from_toml(text, Path::new("/srv"))
}

fn refused(text: &str) -> String {
    match parse(text).and_then(|config| config.check()) {
        Ok(()) => panic!("was accepted: {text}"),
        Err(error) => error.to_string(),
    }
}

fn with(line: &str, after: &str) -> String {
    assert!(SMALL.contains(after), "{after}");
    SMALL.replace(after, &format!("{after}\n{line}"))
}

#[test]
fn the_smallest_configuration_has_the_documented_defaults() {
    let config = parse(SMALL).unwrap();
    config.check().unwrap();
    assert_eq!(config.http.listen.to_string(), "127.0.0.1:8700");
    assert_eq!(config.storage.reserve_bytes, 4_194_304);
    let link = &config.links[0];
    assert_eq!((link.baud, link.channel, link.frequency_hz, link.power_dbm), (9600, 25, 435_000_000, 21));
    assert_eq!((link.mode_pins(), link.aux()), (ModePinWiring::Lines, AuxInput::Cts));
    assert!(!link.armed && !link.transmit_unverified && !link.simulated);
    assert_eq!(config.token_file(), Path::new("/srv/data/token"));
}

#[test]
fn an_unknown_key_is_refused_with_its_line() {
    let error = refused(&with("bauds = 9600", "port = \"/dev/ttyUSB0\""));
    assert!(error.contains("bauds") && error.contains("line 11"), "{error}");
    let error = refused(&with("colour = 1", "folder = \"data\""));
    assert!(error.contains("colour"), "{error}");
}

#[test]
fn each_wrong_value_names_its_key_and_a_remedy() {
    for (line, after, key) in [
        ("baud = 19200", "port = \"/dev/ttyUSB0\"", "links[0]"),
        ("power_dbm = 20", "port = \"/dev/ttyUSB0\"", "links[0].power_dbm"),
        ("channel = 84", "port = \"/dev/ttyUSB0\"", "links[0]"),
        ("frequency_hz = 868000000", "port = \"/dev/ttyUSB0\"", "links[0]"),
        ("file = \"x\"", "port = \"/dev/ttyUSB0\"", "links[0].file"),
        ("heartbeat_period_s = 0", "name = \"pixelsat-1\"", "satellites[0].heartbeat_period_s"),
        ("reserve_bytes = 1", "folder = \"data\"", "storage.reserve_bytes"),
        ("database = \"postgres://ada:secret@host/db\"", "folder = \"data\"", "storage.database"),
        ("database = \"sqlite://x\"", "folder = \"data\"", "storage.database"),
        ("password_file = \"x\"", "folder = \"data\"", "storage.password_file"),
        (
            "database = \"postgres://ada@host/db\"\nmax_page_count = 9",
            "folder = \"data\"",
            "storage.max_page_count",
        ),
        ("[simulation]", "folder = \"data\"", "simulation"),
        (
            "[[satellites.limits]]\nparameter = \"heartbeat.temp\"\nabove = { hot = 40 }",
            "name = \"pixelsat-1\"",
            "satellites[0].limits[0].above.hot",
        ),
    ] {
        let error = refused(&with(line, after));
        assert!(error.contains(key) && error.ends_with('.'), "{line}: {error}");
        assert!(!error.contains("secret"), "{line}: {error}");
    }
}

#[test]
fn simulated_and_real_links_never_mix() {
    let twin = "[[links]]\nname = \"twin\"\nsatellite = \"pixelsat-1\"\nkind = \"tcp\"\nconnect = \"localhost:9000\"\nsimulated = true";
    let error = refused(&with(twin, "port = \"/dev/ttyUSB0\""));
    assert!(error.contains("Simulated and real"), "{error}");
}

#[test]
fn a_link_needs_what_its_kind_says() {
    assert!(refused(&SMALL.replace("port = \"/dev/ttyUSB0\"", "")).contains("radio list"));
    let tcp = SMALL.replace(
        "kind = \"serial\"\nport = \"/dev/ttyUSB0\"",
        "kind = \"tcp\"\nconnect = \"h:1\"\naux = \"cts\"",
    );
    assert!(refused(&tcp).contains("modem lines"));
    assert!(
        refused(&SMALL.replace("satellite = \"pixelsat-1\"", "satellite = \"other\"")).contains("'other'")
    );
}

#[test]
fn the_environment_goes_over_the_file() {
    let mut config = parse(SMALL).unwrap();
    config.apply(&Environment {
        listen: "0.0.0.0:1".parse().ok(),
        data: Some("/x".into()),
        log: Some("debug".into()),
    });
    assert_eq!(config.http.listen.port(), 1);
    assert_eq!(config.storage.folder, Path::new("/x"));
    assert_eq!(config.log.filter, "debug");
}

#[test]
fn a_reload_says_what_needs_a_restart() {
    let old = parse(SMALL).unwrap();
    assert!(Changes::between(&old, &old).is_empty());
    let mut new = old.clone();
    new.links[0].armed = true;
    new.log.filter = "debug".into();
    let changes = Changes::between(&old, &new);
    assert_eq!(changes.armed, [("e22".to_owned(), true)]);
    assert!(changes.need_restart.is_empty());
    new.links[0].channel = 3;
    new.http.allowed_hosts.push("ground.example".into());
    assert_eq!(Changes::between(&old, &new).need_restart, ["http", "links 'e22'"]);
}

#[test]
fn the_summary_names_files_and_no_secret() {
    let config = parse(&with("key_file = \"up.key\"", "name = \"pixelsat-1\"")).unwrap();
    let summary = config.to_string();
    assert!(summary.contains("key in /srv/up.key") && summary.contains("not armed"), "{summary}");
}

#[test]
fn the_example_configurations_are_configurations() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let mut seen = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(&path).unwrap();
            Config::from_toml(&text, &folder)
                .and_then(|c| c.check())
                .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            seen += 1;
        }
    }
    assert!(seen >= 3);
}

#[test]
fn the_engine_gets_what_the_file_says() {
    let text = with("ranges = true\nheartbeat_period_s = 2.5", "name = \"pixelsat-1\"");
    let config = parse(&with("rssi = false\nturn_round_ms = 700", "port = \"/dev/ttyUSB0\"")).unwrap();
    let station = station_config(&config, &Default::default()).unwrap();
    assert!(!station.satellites[0].profile.rssi && station.satellites[0].key.is_none());
    assert_eq!(station.links[0].timing.turn_round_us, 700_000);
    let station = station_config(&parse(&text).unwrap(), &Default::default()).unwrap();
    assert_eq!(station.satellites[0].profile.heartbeat_period_us, 2_500_000);
    assert!(station.satellites[0].profile.ranges);
}

#[test]
fn a_key_that_counts_one_by_one_is_not_shared() {
    let text = |counter: &str| {
        format!(
            "[station]\nname = \"roof\"\n[[satellites]]\nname = \"pixelsat-1\"\nkey_file = \"k\"\ncounter = \"{counter}\"\n[[links]]\nname = \"e22\"\n\
             satellite = \"pixelsat-1\"\nkind = \"serial\"\nport = \"/dev/ttyUSB0\"\n[storage]\nfolder = \"data\"\n\
             database = \"postgres://ground@db.example/ground\"\n"
        )
    };
    let check = |counter| Config::from_toml(&text(counter), Path::new("/srv")).unwrap().check();
    check("time").unwrap();
    let error = check("sequence").unwrap_err().to_string();
    assert!(error.contains("key satellites[0].counter: it counts one by one"), "{error}");
}
