//! A known key occurs nowhere outside its own file: not in the archive, its log, the reserve, the witness, a backup or the
//! twin's journal, not in logs at trace level, not in an answer of the API, a message of the stream or the page; where the
//! archive is a PostgreSQL, not in its files, its log of statements or a dump. The same for what people know, for the key
//! of TLS, for the passwords of mail server and database, and for what alerts are sent with.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

mod database;
mod look;
mod search;
mod targets;

use api::{CommandView, DownloadView, Page, RehearsalView, RunView, StationView};
use end_to_end::folder::{KEY, free_address, key_hex};
use end_to_end::process::{gs_server, run};
use end_to_end::stream::{Follower, Look};
use end_to_end::wait::{PATIENCE, until};
use end_to_end::{Client, Folder, Server, Twin, overhead};
use serde_json::{Value, json};

use database::Archive;
use look::{backup, scan, walk};
use search::{IN_A_ROW, Spellings, base64, find, spellings, spellings_of, words};
use targets::Correspondents;

const DATABASE_PASSWORD: &str = "Kc5-a-database-of-secrets-2Wd";

#[test]
fn the_scanner_finds_the_key_where_it_is() {
    let spellings = spellings();
    let found = |bytes: &[u8]| find(bytes, &spellings).is_some();
    assert!(found(&KEY) && found(key_hex().as_bytes()) && found(key_hex().to_uppercase().as_bytes()));
    assert!(found(format!("{KEY:?}").as_bytes()) && found(format!("{KEY:#?}").as_bytes()));
    assert!(found(format!("{KEY:x?}").as_bytes()) && found(format!("{KEY:02X?}").as_bytes()));
    assert!(found(b"AMD/7l7C5xM3utyrHt76ztU=") && found(b"wP/uXsLnEze63Kse3vrO1Q=="));
    assert!(found(&[b"....".as_slice(), &KEY[7..13], b"...."].concat()));
    assert!(!found(&[0; 64]) && !found(b"0123456789abcdef"));
    assert!(base64(&KEY).starts_with("wP/uXsLnEze63Kse3vrO1Q"));
}

#[test]
fn a_key_that_cannot_be_used_is_not_quoted() {
    let folder = Folder::new();
    let spellings = spellings();
    let config = folder.write_config();
    let hex = key_hex();
    let raw: String = KEY.iter().map(|byte| char::from(*byte)).collect();
    for (text, mode) in [
        (hex.clone(), 0o644),
        (hex[..30].to_owned(), 0o600),
        (format!("{hex}00"), 0o600),
        (format!("{hex}\n{hex}\n"), 0o600),
        (format!("x{hex}"), 0o600),
        (format!("key = \"{hex}\"\n"), 0o600),
        (raw, 0o600),
        (hex.clone(), 0o600),
    ] {
        folder.write_key("twin.key", &text, mode);
        for verb in [&["serve", "--log", "trace", "--config"][..], &["config", "check"]] {
            let mut command = gs_server(verb);
            command.arg(&config);
            let (code, out, error) = run(command);
            assert_ne!(code, 0, "{out}");
            assert_eq!(find(format!("{out}{error}").as_bytes(), &spellings), None, "{verb:?}");
        }
    }
}

/// TLS of the server's own; what its key is spelled like.
fn tls(folder: &mut Folder) -> Spellings {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).expect("a certificate");
    let (pem, der) = (made.signing_key.serialize_pem(), made.signing_key.serialize_der());
    std::fs::write(folder.file("cert.pem"), made.cert.pem()).expect("a certificate");
    folder.write_key("cert.key", &pem, 0o600);
    folder.sections += &format!(
        "[http.tls]\nlisten = \"{}\"\ncertificate = \"cert.pem\"\nkey = \"cert.key\"\n",
        free_address()
    );
    // PKCS #8: the secret number stands behind `OCTET STRING, 32 bytes`, and what follows is public.
    let begin = [2, 1, 1, 4, 32];
    let at = der.windows(5).position(|five| five == begin).expect("a key of P-256") + begin.len();
    let mut spellings = spellings_of(&der[at..at + 32], IN_A_ROW + 3);
    let lines: Vec<&str> = pem.lines().filter(|line| line.len() == 64).collect();
    spellings.push(("raw first line of the key of TLS".to_owned(), lines[0].as_bytes().to_vec()));
    spellings
}

fn post(client: &Client, path: &str, key: &str, body: &Value) -> Value {
    let answer = client.post(path, key, &body.to_string()).expect("an answer");
    assert!(answer.status < 300, "{path}: {}", answer.text());
    answer.json()
}

/// A pass over the station in which a plan runs, which is rehearsed beside it; and a command that waits for a second person.
fn live(folder: &Folder, client: &Client) {
    let station: StationView = client.read("/api/v1/station");
    let text = overhead::elements(folder, station.at.unix_us() + 60_000_000);
    post(client, "/api/v1/elements", "elements", &json!({"satellite": "sat", "text": text}));
    let ping = json!({"do": "command", "command": "Ping", "on_failure": "continue"});
    let plan = json!({
        "name": "night", "satellite": "sat", "transmit": true, "attach": {},
        "steps": [{"do": "wait-for", "until": {"heard_within_s": 15}, "timeout_s": 60}, ping],
    });
    post(client, "/api/v1/plans", "plan", &plan);
    post(client, "/api/v1/plans/night/arm", "arm", &json!({}));
    post(client, "/api/v1/rehearsals", "rehearse", &json!({"name": "night", "runs": 1}));
    let reset = json!({"command": "Reset", "confirm": "Reset"});
    let waits = post(client, "/api/v1/commands", "reset", &reset);
    assert_eq!(waits["outcome"], "awaiting-approval");
    until("the plan has run and was rehearsed", 4 * PATIENCE, || {
        let rehearsal: RehearsalView = client.read("/api/v1/rehearsals/1");
        let runs: Page<RunView> = client.read("/api/v1/runs");
        let is_over = |run: &RunView| run.started_at.is_some() && run.outcome.is_some();
        (rehearsal.state == "done" && runs.items.iter().any(is_over)).then_some(())
    });
    for of in ["reports/passes/1", "alerts/1", "approvals/1", "runs/1", "forwards/1"] {
        until(&format!("there is {of}"), 4 * PATIENCE, || {
            client.get(&format!("/api/v1/{of}")).is_ok_and(|answer| answer.status == 200).then_some(())
        });
    }
}

#[test]
fn secrets_stay_in_their_files_and_the_archive_is_a_file() {
    let mut folder = Folder::new();
    // A backup is made of that one alone.
    secrets_stay(&mut folder, &Archive::File, &["twin.key"]);
}

#[test]
fn secrets_stay_in_their_files_and_the_archive_is_a_postgresql() {
    let mut folder = Folder::new();
    let archive = Archive::postgres(&mut folder, DATABASE_PASSWORD);
    secrets_stay(&mut folder, &archive, &["twin.key", "database.password"]);
}

fn secrets_stay(folder: &mut Folder, archive: &Archive, own: &[&str]) {
    // A database that logs every statement answers later, and an exchange has only so much time.
    folder.speed = Some(if matches!(archive, Archive::File) { 20.0 } else { 8.0 });
    folder.heartbeat_s = 10;
    folder.log = "trace".to_owned();
    folder.station = overhead::PLACE.to_owned();
    folder.satellite = overhead::NUMBER.to_owned();
    folder.sections =
        "[people]\ntwo_person = \"critical\"\n[[satellites.limits]]\nparameter = \"heartbeat.temp\"\n\
                       above = { warning = -270.0 }\n"
            .to_owned();
    let correspondents = Correspondents::of(folder);
    let spellings: Spellings = [
        spellings(),
        Correspondents::spellings(),
        tls(folder),
        words(&[("password of the database", DATABASE_PASSWORD.to_owned())]),
    ]
    .concat();
    let own = [own, &Correspondents::FILES, &["cert.key"]].concat();
    let twin = Twin::start(folder, &["--log", "trace"]);
    let mut server = Server::start(folder);
    let client = server.client.clone();
    no_core_dump(&server);
    let mut stream = Follower::open(&client, 0).expect("a stream");
    for (path, key, body) in [
        ("/api/v1/commands", "ping", r#"{"command":"Ping"}"#),
        ("/api/v1/commands", "quaternion", r#"{"command":"GetAdcsInfo"}"#),
        ("/api/v1/downloads", "image", "{}"),
    ] {
        let answer = client.post(path, key, body).expect("an answer");
        assert_eq!(answer.status, 201, "{}", answer.text());
    }
    let path = format!("/api/v1/keys/{}/confirm-counter", folder.key().id());
    let answers = [
        client.post(&path, "confirm", "{}").expect("an answer"),
        client.post("/api/v1/keys/0000/confirm-counter", "other", "{}").expect("an answer"),
        client.post("/api/v1/clock/vouch", "vouch", "{}").expect("an answer"),
    ];
    until("commands are answered and an image is home", 4 * PATIENCE, || {
        if let Look::Message(message) = stream.look() {
            let text = serde_json::to_vec(&*message).expect("JSON");
            assert_eq!(find(&text, &spellings), None, "in the stream");
        }
        let commands: Page<CommandView> = client.read("/api/v1/commands?limit=1000");
        let downloads: Page<DownloadView> = client.read("/api/v1/downloads");
        let answered = commands.items.iter().filter(|command| command.stage == "answered").count();
        (answered >= 3 && downloads.items.iter().any(|download| download.state == "complete")).then_some(())
    });
    for answer in answers {
        assert_eq!(find(&answer.body, &spellings), None, "in an answer");
    }
    until("something was passed on, and refused", 4 * PATIENCE, || {
        let answer = client.get("/api/v1/forwards/1").ok()?;
        (answer.status == 200 && answer.text().contains("[secret]")).then_some(())
    });
    correspondents.are_told(&client);
    live(folder, &client);
    over_tls(folder, &spellings);
    walk(&client, &spellings, true);

    // While it runs, with its write-ahead log; after `kill -9`; after an orderly end.
    let mut wanted = vec!["reserve.bin", "serve.log", "twin.log", "twin.journal", "token"];
    if matches!(archive, Archive::File) {
        backup(folder);
        wanted.extend(["ground.sqlite3", "ground.sqlite3-wal", "backup.tar"]);
    }
    let alive = scan(folder, &own, &spellings);
    archive.scan(&spellings);
    let names: Vec<&str> = alive.iter().filter_map(|path| path.file_name()?.to_str()).collect();
    for wanted in wanted {
        assert!(names.contains(&wanted), "{wanted} is not among {names:?}");
    }
    assert!(names.iter().any(|name| *name == folder.key().id().to_string()), "no witness among {names:?}");
    let cmdline = std::fs::read(format!("/proc/{}/cmdline", server.process.pid())).expect("procfs");
    assert_eq!(find(&cmdline, &spellings), None, "cmdline");
    assert!(server.process.log().contains("TRACE"), "the log is not at trace level");
    server.process.kill9();
    scan(folder, &own, &spellings);
    Server::start(folder).stop();
    scan(folder, &own, &spellings);
    archive.scan(&spellings);
    drop(twin);
}

/// What is in memory reaches no disk when the process falls: neither a soft nor a hard limit allows a dump.
fn no_core_dump(server: &Server) {
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", server.process.pid())).expect("procfs");
    let row = limits.lines().find(|row| row.starts_with("Max core file size")).expect("a row");
    let words: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(words[4..6], ["0", "0"], "{row}");
}

/// Asks once over TLS, so that its key is used.
fn over_tls(folder: &Folder, spellings: &Spellings) {
    let address =
        folder.sections.split("[http.tls]\nlisten = \"").nth(1).and_then(|rest| rest.split('"').next());
    let mut command = std::process::Command::new("curl");
    command.args(["--silent", "--show-error", "--insecure", "--include"]);
    command.arg(format!("https://{}/healthz", address.expect("an address")));
    let (code, out, error) = run(command);
    assert_eq!(code, 0, "{error}");
    assert!(out.contains(" 200"), "{out}");
    assert_eq!(find(out.as_bytes(), spellings), None, "over TLS");
}

/// A password, a one-time code, a session's cookie and a machine's token are told once, to whom they belong, and stand
/// nowhere: not in the archive or its log, not in logs at trace level, not in an answer.
#[test]
fn what_people_know_stays_with_them_and_the_archive_is_a_file() {
    let mut folder = Folder::new();
    people(&mut folder, &Archive::File);
}

#[test]
fn what_people_know_stays_with_them_and_the_archive_is_a_postgresql() {
    let mut folder = Folder::new();
    let archive = Archive::postgres(&mut folder, DATABASE_PASSWORD);
    people(&mut folder, &archive);
}

fn people(folder: &mut Folder, archive: &Archive) {
    const PASSWORD: &str = "Qr8-unlikely-password-7Zk";
    folder.log = "trace".to_owned();
    let mut server = Server::start(folder);
    let client = server.client.clone();
    let json = [("content-type", "application/json")];
    let mut tries = 0..20;
    // The server makes a link of its own when it starts, and the newest alone opens.
    let (code, welcome) = loop {
        let key = format!("a{}", tries.next().expect("a link that opens"));
        let made = client.post("/api/v1/welcome/link", &key, "{}").expect("an answer").text();
        let made: api::LinkMade = serde_json::from_str(&made).expect("a link");
        let code = made.link.split('=').nth(1).expect("a code").to_owned();
        let body = format!(r#"{{"code":"{code}","name":"verma","password":"{PASSWORD}"}}"#);
        let welcome = client.ask("POST", "/api/v1/welcome", &json, body.as_bytes()).expect("an answer");
        if welcome.status != 410 {
            break (code, welcome);
        }
    };
    assert_eq!(welcome.status, 200, "{}", welcome.text());
    let body = format!(r#"{{"name":"verma","password":"{PASSWORD}"}}"#);
    let session = client.ask("POST", "/api/v1/session", &json, body.as_bytes()).expect("an answer");
    let cookie_of = |answer: &end_to_end::http::Answer| {
        let cookie = answer.header("set-cookie").expect("a cookie");
        cookie.split([';', '=']).nth(1).expect("its value").to_owned()
    };
    // The name is where people type their password by mistake.
    let body = format!(r#"{{"name":"{PASSWORD}","password":"x"}}"#);
    let mistaken = client.ask("POST", "/api/v1/session", &json, body.as_bytes()).expect("an answer");
    assert_eq!(mistaken.status, 401);
    let body = r#"{"name":"script","scopes":["look"],"days":3}"#;
    let token: api::TokenMade = client.post("/api/v1/tokens", "b", body).expect("an answer").json();
    let secrets = words(&[
        ("password", PASSWORD.to_owned()),
        ("one-time code", code),
        ("cookie of the welcome", cookie_of(&welcome)),
        ("cookie of the login", cookie_of(&session)),
        ("machine's token", token.secret.trim_start_matches("gst_").to_owned()),
        ("the server's own token", client.token.clone()),
    ]);
    let bearer = format!("Bearer {}", token.secret);
    assert_eq!(
        client.ask("GET", "/api/v1/station", &[("authorization", &bearer)], b"").expect("an answer").status,
        200
    );
    let cookie = format!("session={}", cookie_of(&session));
    let seen = client.ask("GET", "/api/v1/session", &[("cookie", &cookie)], b"").expect("an answer");
    assert_eq!(seen.status, 200);
    walk(&client, &secrets, false);
    if matches!(archive, Archive::File) {
        backup(folder);
    }
    scan(folder, &["data/token"], &secrets);
    archive.scan(&secrets);
    assert!(server.process.log().contains("TRACE"), "the log is not at trace level");
    server.process.kill9();
    scan(folder, &["data/token"], &secrets);
    archive.scan(&secrets);
}
