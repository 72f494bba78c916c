//! A known key occurs nowhere outside its own file: not in the archive, its log, the reserve, the witness, a backup or the
//! twin's journal, not in logs at trace level, not in an answer of the API, a message of the stream or the page. The same for
//! what people know, and for the passwords of the mail server and of the database.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};

use api::{CommandView, DownloadView, Page};
use end_to_end::folder::{KEY, key_hex};
use end_to_end::mail::MailCatcher;
use end_to_end::process::{gs_server, run};
use end_to_end::stream::{Follower, Look};
use end_to_end::wait::{PATIENCE, until};
use end_to_end::{Client, Folder, Server, Twin};

/// So many bytes of the key in a row are no accident.
const IN_A_ROW: usize = 5;

/// Every way in which somebody might write a piece of the key down by accident.
fn spellings() -> Vec<(String, Vec<u8>)> {
    let mut all = Vec::new();
    for (at, piece) in KEY.windows(IN_A_ROW).enumerate() {
        let join =
            |each: &dyn Fn(&u8) -> String, by: &str| piece.iter().map(each).collect::<Vec<_>>().join(by);
        let words = [
            ("hex", join(&|byte| format!("{byte:02x}"), "")),
            ("hex in pairs", join(&|byte| format!("{byte:02x}"), " ")),
            ("hex with colons", join(&|byte| format!("{byte:02x}"), ":")),
            ("hex numbers", join(&|byte| format!("0x{byte:02x}"), ", ")),
            ("Debug of hex", join(&|byte| format!("{byte:x}"), ", ")),
            ("Debug, JSON", join(&|byte| format!("{byte}"), ", ")),
            ("compact JSON", join(&|byte| format!("{byte}"), ",")),
            ("Debug in lines", join(&|byte| format!("{byte}"), ",\n    ")),
        ];
        all.push((format!("raw, from byte {at}"), piece.to_vec()));
        all.push((format!("raw, backwards, from byte {at}"), piece.iter().rev().copied().collect()));
        for (name, text) in words {
            all.push((format!("{name}, from byte {at}"), text.into_bytes()));
        }
    }
    // Base64, at each place in a group of three bytes where a key may begin.
    for text in ["wP/uXsLn", "wP_uXsLn", "/+5ewucT", "_-5ewucT", "7l7C5xM3"] {
        all.push(("base64".to_owned(), text.into()));
    }
    all
}

/// Where the key stands in these bytes; hexadecimal in either case.
fn find(bytes: &[u8], spellings: &[(String, Vec<u8>)]) -> Option<String> {
    let (exact, any_case): (Vec<_>, Vec<_>) =
        spellings.iter().partition(|(name, _)| name.starts_with("raw") || name == "base64");
    search(bytes, &exact).or_else(|| search(&bytes.to_ascii_lowercase(), &any_case))
}

/// One walk over logs of many megabytes: what a spelling begins with is looked up before it is compared.
fn search(bytes: &[u8], spellings: &[&(String, Vec<u8>)]) -> Option<String> {
    let mut begins = vec![false; 1 << 16];
    let place = |two: &[u8]| usize::from(two[0]) << 8 | usize::from(two[1]);
    spellings.iter().for_each(|(_, spelling)| begins[place(spelling)] = true);
    let mut at = 0;
    while at + 1 < bytes.len() {
        if begins[place(&bytes[at..])]
            && let Some((name, spelling)) =
                spellings.iter().find(|(_, spelling)| bytes[at..].starts_with(spelling))
        {
            let around = &bytes[at.saturating_sub(60)..(at + spelling.len() + 20).min(bytes.len())];
            return Some(format!("{name}, at {at}: {}", String::from_utf8_lossy(around)));
        }
        at += 1;
    }
    None
}

fn files(folder: &Path) -> Vec<PathBuf> {
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
fn paths(index: &str) -> Vec<String> {
    const TABLE: &str = include_str!("../../gs-server/src/http/routes.rs");
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
            paths.push(row.replace("{id}", "1").replace("{month}", "2026-11"));
        }
    }
    paths
}

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

#[test]
fn the_key_stays_in_its_file() {
    let mut folder = Folder::new();
    folder.speed = Some(20.0);
    folder.heartbeat_s = 10;
    folder.log = "trace".to_owned();
    let spellings = spellings();
    let twin = Twin::start(&folder, &["--log", "trace"]);
    let mut server = Server::start(&folder);
    let client = server.client.clone();
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
    until("commands are answered and an image is home", 2 * PATIENCE, || {
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
    walk(&client, &spellings, false);
    backup(&folder);

    // While it runs, with its write-ahead log; after `kill -9`; after an orderly end.
    let alive = scan(&folder, &spellings);
    let names: Vec<&str> = alive.iter().filter_map(|path| path.file_name()?.to_str()).collect();
    for wanted in [
        "ground.sqlite3",
        "ground.sqlite3-wal",
        "reserve.bin",
        "serve.log",
        "twin.log",
        "twin.journal",
        "token",
        "backup.tar",
    ] {
        assert!(names.contains(&wanted), "{wanted} is not among {names:?}");
    }
    assert!(names.iter().any(|name| *name == folder.key().id().to_string()), "no witness among {names:?}");
    let pid = server.process.pid();
    for of_process in ["cmdline", "environ"] {
        let bytes = std::fs::read(format!("/proc/{pid}/{of_process}")).expect("procfs");
        assert_eq!(find(&bytes, &spellings), None, "{of_process}");
    }
    assert!(server.process.log().contains("TRACE"), "the log is not at trace level");
    server.process.kill9();
    scan(&folder, &spellings);
    Server::start(&folder).stop();
    scan(&folder, &spellings);
    drop(twin);
}

/// A password, a one-time code, a session's cookie and a machine's token are told once, to whom they belong, and stand
/// nowhere: not in the archive or its log, not in logs at trace level, not in an answer.
#[test]
fn what_people_know_stays_with_them() {
    const PASSWORD: &str = "Qr8-unlikely-password-7Zk";
    let mut folder = Folder::new();
    folder.log = "trace".to_owned();
    let mut server = Server::start(&folder);
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
    let secrets: Vec<(String, Vec<u8>)> = [
        ("password", PASSWORD.to_owned()),
        ("one-time code", code),
        ("cookie of the welcome", cookie_of(&welcome)),
        ("cookie of the login", cookie_of(&session)),
        ("machine's token", token.secret.trim_start_matches("gst_").to_owned()),
        ("the server's own token", client.token.clone()),
    ]
    .into_iter()
    .map(|(name, secret)| (format!("raw {name}"), secret.into_bytes()))
    .collect();
    let bearer = format!("Bearer {}", token.secret);
    assert_eq!(
        client.ask("GET", "/api/v1/station", &[("authorization", &bearer)], b"").expect("an answer").status,
        200
    );
    let cookie = format!("session={}", cookie_of(&session));
    let seen = client.ask("GET", "/api/v1/session", &[("cookie", &cookie)], b"").expect("an answer");
    assert_eq!(seen.status, 200);
    walk(&client, &secrets, true);
    backup(&folder);
    let look = |folder: &Folder| {
        let own = folder.data().join("token");
        for path in files(folder.path()).into_iter().filter(|path| *path != own) {
            let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            assert_eq!(find(&bytes, &secrets), None, "{}", path.display());
        }
    };
    look(&folder);
    assert!(server.process.log().contains("TRACE"), "the log is not at trace level");
    server.process.kill9();
    look(&folder);
}

/// In Base64, as SMTP carries them.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let word = three.iter().fold(0_usize, |word, byte| word << 8 | usize::from(*byte))
            << (8 * (3 - three.len()));
        for place in 0..=three.len() {
            text.push(char::from(DIGITS[word >> (18 - 6 * place) & 63]));
        }
    }
    text
}

/// The station logs in to its mail server, well and badly; its password stands in its file and in the conversation alone.
#[test]
fn the_password_of_the_mail_server_stays_in_its_file() {
    const PASSWORD: &str = "Vb3-another-unlikely-one-9Tq";
    let catcher = MailCatcher::start();
    let mut folder = Folder::new();
    folder.log = "trace".to_owned();
    folder.sections = format!(
        "[[alerts.targets]]\nname = \"mail\"\nkind = \"email\"\nserver = \"{}\"\nsecurity = \"none\"\n\
         from = \"ground@example.org\"\nto = [\"ops@example.org\"]\nuser = \"ground\"\nsecret_file = \"mail.password\"\n",
        catcher.address
    );
    folder.write_key("mail.password", &format!("{PASSWORD}\n"), 0o600);
    let login = base64(format!("\0ground\0{PASSWORD}").as_bytes());
    // The last group of four holds what follows as well.
    let secrets: Vec<(String, Vec<u8>)> = [
        ("raw password", PASSWORD.to_owned()),
        ("raw login", login[..login.len() - 4].to_owned()),
        ("raw base64", base64(PASSWORD.as_bytes())),
    ]
    .into_iter()
    .map(|(name, secret)| (name.to_owned(), secret.into_bytes()))
    .collect();
    let mut server = Server::start(&folder);
    let client = server.client.clone();
    let test = |key: &str| client.post("/api/v1/alerts/targets/mail/test", key, "{}").expect("an answer");
    let sent = test("a");
    assert_eq!(sent.status, 200, "{}", sent.text());
    let said = catcher.said().join("\n");
    assert!(secrets.iter().any(|(_, secret)| said.contains(&*String::from_utf8_lossy(secret))), "{said}");
    catcher.refuse_logins();
    let refused = test("b");
    folder.write_key("mail.password", &format!("{PASSWORD}\n"), 0o644);
    let exposed = test("c");
    for answer in [&refused, &exposed] {
        assert!(answer.status >= 400, "{}", answer.text());
        assert_eq!(find(&answer.body, &secrets), None, "in an answer");
    }
    walk(&client, &secrets, true);
    backup(&folder);
    let look = |folder: &Folder| {
        let own = folder.file("mail.password");
        for path in files(folder.path()).into_iter().filter(|path| *path != own) {
            let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            assert_eq!(find(&bytes, &secrets), None, "{}", path.display());
        }
    };
    look(&folder);
    assert!(server.process.log().contains("TRACE"), "the log is not at trace level");
    server.process.kill9();
    look(&folder);
}

/// Asks whoever connects for the password in the clear, as PostgreSQL may, keeps what was said, and refuses it.
fn strict_database() -> (SocketAddr, Receiver<Vec<u8>>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_addr().expect("its address");
    let (told, heard) = channel();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            // Whoever hung up said nothing; nobody listens any more when the test is over.
            let _ = refuse(stream).map(|said| told.send(said));
        }
    });
    (address, heard)
}

fn refuse(mut stream: TcpStream) -> std::io::Result<Vec<u8>> {
    let mut piece = [0; 4096];
    let _startup = stream.read(&mut piece)?;
    // AuthenticationCleartextPassword
    stream.write_all(b"R\0\0\0\x08\0\0\0\x03")?;
    let count = stream.read(&mut piece)?;
    let fields = b"SFATAL\0VFATAL\0C28P01\0Mpassword authentication failed for user \"ground\"\0\0";
    stream.write_all(b"E")?;
    stream.write_all(&(4 + fields.len() as u32).to_be_bytes())?;
    stream.write_all(fields)?;
    Ok(piece[..count].to_vec())
}

#[test]
fn the_password_of_the_database_stays_in_its_file() {
    const PASSWORD: &str = "Kc5-a-database-of-secrets-2Wd";
    let secrets = [("raw password".to_owned(), PASSWORD.as_bytes().to_vec())];
    let (address, heard) = strict_database();
    let mut folder = Folder::new();
    folder.write_key("database.password", &format!("{PASSWORD}\n"), 0o600);
    let ask = |folder: &Folder, verb: &[&str]| {
        let config = folder.write_config();
        let mut command = gs_server(["--log", "trace"]);
        command.args(verb).arg("--config").arg(config);
        let (code, out, error) = run(command);
        assert_ne!(code, 0, "{verb:?}: {out}");
        let all = format!("{out}{error}");
        assert_eq!(find(all.as_bytes(), &secrets), None, "{verb:?}: {all}");
        all
    };
    folder.storage = format!(
        "database = \"postgres://ground@{address}/ground?sslmode=disable\"\npassword_file = \"database.password\"\n"
    );
    let told = ask(&folder, &["serve"]);
    assert!(told.contains("the archive cannot be opened"), "{told}");
    let said = heard.recv().expect("what it was asked with");
    assert!(find(&said, &secrets).is_some(), "the password was never used");
    // A file that others may read, and a password where it does not belong: refused, and not repeated.
    folder.write_key("database.password", &format!("{PASSWORD}\n"), 0o644);
    ask(&folder, &["serve"]);
    folder.storage = format!("database = \"postgres://ground:{PASSWORD}@{address}/ground\"\n");
    ask(&folder, &["serve"]);
    ask(&folder, &["config", "check"]);
    folder.storage = format!("database = \"postgres://ground@{address}/ground?password={PASSWORD}\"\n");
    ask(&folder, &["serve"]);
    for path in files(folder.path()) {
        if path == folder.file("database.password") || path == folder.file("station.toml") {
            continue;
        }
        let bytes = std::fs::read(&path).expect("a file");
        assert_eq!(find(&bytes, &secrets), None, "{}", path.display());
    }
}

/// A backup of the server that runs, beside its data folder.
fn backup(folder: &Folder) {
    let mut command = gs_server(["backup", "--config"]);
    command.arg(folder.file("station.toml")).arg(folder.file("backup.tar"));
    let (code, out, error) = run(command);
    assert_eq!(code, 0, "{out}{error}");
}

/// Every answer to a question, the page and all that it loads.
fn walk(client: &Client, spellings: &[(String, Vec<u8>)], is_empty: bool) {
    let index = client.get("/").expect("the page").text();
    let paths = paths(&index);
    assert!(paths.len() > 20, "{paths:?}");
    for path in paths {
        let lists = ["frames", "commands", "downloads", "images", "events"];
        let whole = lists.iter().any(|list| path == format!("/api/v1/{list}"));
        let asked = if whole { format!("{path}?limit=1000") } else { path };
        let bearer = format!("Bearer {}", client.token);
        let answer = client.ask("GET", &asked, &[("authorization", &bearer)], b"");
        let answer = answer.unwrap_or_else(|error| panic!("{asked}: {error}"));
        let needs_parameters = asked.ends_with("/telemetry");
        // This station has no place and no elements: what is asked of the sky says so.
        let no_sky = answer.status == 409 && answer.text().contains(":no-place");
        // Here no pass was flown, no plan ran, nothing is wrong and nothing was laid before a second person; and in an
        // empty archive there is no first of anything.
        let lacking = ["runs/1", "rehearsals/1", "approvals/1", "reports/passes/1", "alerts/1"];
        let nothing = answer.status == 404
            && (lacking.iter().any(|path| asked.ends_with(path)) || is_empty && asked.contains("/1"));
        assert!(
            answer.status < 400 || needs_parameters || no_sky || nothing,
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

/// Looks through every file of the folder but the key's own.
fn scan(folder: &Folder, spellings: &[(String, Vec<u8>)]) -> Vec<PathBuf> {
    let own = folder.file("twin.key");
    assert!(find(&std::fs::read(&own).expect("the key file"), spellings).is_some());
    let all: Vec<PathBuf> = files(folder.path()).into_iter().filter(|path| *path != own).collect();
    for path in &all {
        let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(find(&bytes, spellings), None, "{}", path.display());
    }
    all
}
