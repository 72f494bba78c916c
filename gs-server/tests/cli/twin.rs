//! The twin alone, and with a server in another process.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};

use rustix::process::{Pid, Signal, kill_process};

use super::{gs_server, json, run};

/// A process that ends with the test, and the first line that it says.
pub(crate) struct Running {
    child: Child,
    out: BufReader<std::process::ChildStdout>,
}

impl Running {
    fn start(arguments: &[&str]) -> Self {
        let mut child = gs_server(arguments).stdout(Stdio::piped()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        Self { child, out }
    }

    fn line(&mut self) -> serde_json::Value {
        let mut line = String::new();
        self.out.read_line(&mut line).unwrap();
        json(&line)
    }

    /// Asks it to end; exit code, and what it still said.
    fn stop(mut self) -> (Option<i32>, String) {
        let pid = Pid::from_raw(self.child.id().try_into().unwrap()).unwrap();
        kill_process(pid, Signal::TERM).unwrap();
        let mut rest = String::new();
        self.out.read_to_string(&mut rest).unwrap();
        (self.child.wait().unwrap().code(), rest)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A twin behind a pseudo-terminal in a folder of its own.
pub(crate) struct Twin {
    folder: tempfile::TempDir,
    running: Option<Running>,
}

impl Twin {
    pub(crate) fn start(more: &[&str]) -> Self {
        let mut twin = Self { folder: tempfile::tempdir().unwrap(), running: None };
        twin.restart(more);
        twin
    }

    fn restart(&mut self, more: &[&str]) -> serde_json::Value {
        let (port, journal) = (self.port(), self.file("twin.journal"));
        let arguments =
            [&["twin", "serve", "--json", "--pty", &port, "--journal", &journal][..], more].concat();
        let mut running = Running::start(&arguments);
        let ready = running.line();
        assert_eq!(ready["ready"], true);
        self.running = Some(running);
        ready
    }

    fn stop(&mut self) -> serde_json::Value {
        let (code, rest) = self.running.take().unwrap().stop();
        assert_eq!(code, Some(0));
        json(&rest)
    }

    pub(crate) fn port(&self) -> String {
        self.file("radio")
    }

    pub(crate) fn file(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }
}

#[test]
fn one_twin_per_journal_and_it_flies_on() {
    let mut twin = Twin::start(&[]);
    let (port, journal) = (twin.port(), twin.file("twin.journal"));
    let (code, _, error) = run(["twin", "serve", "--pty", &twin.file("other"), "--journal", &journal]);
    assert_eq!(code, 3, "{error}");
    assert!(error.contains("in use"), "{error}");
    assert_eq!(twin.stop()["ready"], false);
    assert!(std::fs::symlink_metadata(&port).is_err(), "the link goes with its twin");

    let again = twin.restart(&[]);
    assert_eq!(again["boots"], 1, "it was found running, not switched on");
    twin.stop();

    let real = twin.file("real.key");
    assert_eq!(run(["key", "new", &real]).0, 0);
    let (code, _, error) = run(["twin", "serve", "--pty", &port, "--journal", &journal, "--key", &real]);
    assert_eq!(code, 3);
    assert!(error.contains("--simulated"), "{error}");
    std::fs::write(&port, "a file").unwrap();
    let (code, _, error) = run(["twin", "serve", "--pty", &port, "--journal", &journal]);
    assert_eq!(code, 3, "{error}");
}

/// One request; status and body.
fn http(address: &str, request: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap();
    (head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned())
}

fn get(address: &str, path: &str) -> serde_json::Value {
    let (status, body) =
        http(address, &format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n"));
    assert_eq!(status, 200, "{body}");
    json(&body)
}

fn post(address: &str, path: &str, key: &str, token: &str, body: &str) {
    let request = format!(
        "POST {path} HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {token}\r\nIdempotency-Key: {key}\r\n\
         Content-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
        body.len()
    );
    let (status, body) = http(address, &request);
    assert!((200..300).contains(&status), "{status} {body}");
}

#[expect(clippy::disallowed_methods, reason = "two processes in real time")]
fn until(what: &str, mut holds: impl FnMut() -> bool) {
    for _ in 0..600 {
        if holds() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    panic!("after 30 s still not: {what}");
}

fn config(folder: &Path) -> String {
    let text = r#"
[station]
name = "two-processes"
[[satellites]]
name = "pixelsat-1"
key_file = "twin.journal.key"
heartbeat_period_s = 20
[[links]]
name = "twin"
satellite = "pixelsat-1"
kind = "serial"
port = "PORT"
simulated = true
mode_pins = "software"
aux = "absent"
armed = true
[storage]
folder = "data"
[simulation]
speed = 20
"#;
    let path = folder.join("station.toml");
    std::fs::write(&path, text.replace("PORT", &folder.join("radio").display().to_string())).unwrap();
    path.display().to_string()
}

#[test]
fn a_server_in_another_process_commands_it_and_both_may_restart() {
    let with = ["--speed", "20", "--heartbeat-s", "20"];
    let mut twin = Twin::start(&with);
    let config = config(twin.folder.path());
    let mut counters = Vec::new();
    for _round in 0..2 {
        let mut server = Running::start(&[
            "serve",
            "--config",
            &config,
            "--listen",
            "127.0.0.1:0",
            "--json",
            "--log",
            "warn",
        ]);
        let ready = server.line();
        let address = ready["address"].as_str().unwrap().to_owned();
        let token = std::fs::read_to_string(twin.folder.path().join("data/token")).unwrap();
        until("heard", || get(&address, "/api/v1/station")["satellites"][0]["in_contact"] == true);
        let key = format!("ping-{}", counters.len());
        post(&address, "/api/v1/commands", &key, token.trim(), r#"{"command": "Ping"}"#);
        until("answered", || {
            let commands = get(&address, "/api/v1/commands");
            commands["items"].as_array().is_some_and(|items| {
                items.iter().filter(|command| command["stage"] == "answered").count() > counters.len()
            })
        });
        assert_eq!(server.stop().0, Some(0));
        let counts = twin.stop();
        assert!(counts["requests_accepted"].as_u64().unwrap() >= 1);
        counters.push(twin.restart(&with)["counter"].as_u64().unwrap());
    }
    assert!(counters[0] < counters[1], "counters survive both restarts: {counters:?}");
}
