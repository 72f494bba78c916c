//! `alert …` with a server that runs, is killed and runs again, and without one.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::OpenOptionsExt as _;
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::{gs_server, json, run};

/// A web server of plain sockets: writes down the number and the text of each message, and answers or hangs.
#[derive(Clone)]
struct Hook {
    port: u16,
    seen: Arc<Mutex<Vec<(String, String)>>>,
    answers: Arc<AtomicBool>,
}

impl Hook {
    fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let hook = Self {
            port: listener.local_addr().unwrap().port(),
            seen: Arc::default(),
            answers: Arc::default(),
        };
        let server = hook.clone();
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                let server = server.clone();
                std::thread::spawn(move || server.serve(stream.unwrap()));
            }
        });
        hook
    }

    fn serve(&self, mut stream: TcpStream) -> Option<()> {
        let mut reader = BufReader::new(stream.try_clone().ok()?);
        let (mut number, mut length) = (String::new(), 0);
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).ok()?;
            let Some((name, value)) = line.trim().split_once(": ") else {
                if line.trim().is_empty() {
                    break;
                }
                continue;
            };
            match name.to_ascii_lowercase().as_str() {
                "webhook-id" => number = value.to_owned(),
                "content-length" => length = value.parse().ok()?,
                _ => {}
            }
        }
        let mut body = vec![0; length];
        reader.read_exact(&mut body).ok()?;
        self.seen.lock().unwrap().push((number, String::from_utf8(body).ok()?));
        if self.answers.load(Ordering::SeqCst) {
            stream.write_all(b"HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n").ok()?;
        } else {
            // Until the other end is gone.
            reader.read_to_end(&mut Vec::new()).ok()?;
        }
        Some(())
    }

    fn wait(&self, count: usize) -> Vec<(String, String)> {
        for _ in 0..1200 {
            let seen = self.seen.lock().unwrap().clone();
            if seen.len() >= count {
                return seen;
            }
            pause();
        }
        panic!("{count} messages never came: {:?}", self.seen.lock().unwrap());
    }
}

#[expect(clippy::disallowed_methods, reason = "this test watches real processes from outside")]
fn pause() {
    std::thread::sleep(Duration::from_millis(50));
}

struct Station {
    config: String,
    _folder: tempfile::TempDir,
    server: Option<Child>,
}

impl Drop for Station {
    fn drop(&mut self) {
        self.kill();
    }
}

impl Station {
    /// A station whose radio is not there: the link's alert comes at once.
    fn new(hook: &Hook) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name).display().to_string();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let text = format!(
            r#"
            [station]
            name = "test"
            clock = "trust"
            [http]
            listen = "127.0.0.1:{port}"
            [[satellites]]
            name = "pixelsat-1"
            [[links]]
            name = "e22"
            satellite = "pixelsat-1"
            kind = "serial"
            port = "absent"
            [storage]
            folder = "data"
            [[alerts.rules]]
            kind = "link"
            on_delay_s = 0
            [[alerts.rules]]
            kind = "disk"
            enabled = false
            [[alerts.targets]]
            name = "hook"
            kind = "webhook"
            url = "http://127.0.0.1:{}/"
            secret_file = "hook.key"
            "#,
            hook.port
        );
        let mut options = fs::OpenOptions::new();
        let mut key =
            options.write(true).create(true).truncate(true).mode(0o600).open(file("hook.key")).unwrap();
        key.write_all(b"battery staple\n").unwrap();
        fs::write(file("station.toml"), text).unwrap();
        Self { config: file("station.toml"), _folder: folder, server: None }
    }

    fn verb(&self, words: &[&str]) -> (i32, String, String) {
        run(words.iter().copied().chain(["--config", self.config.as_str()]))
    }

    fn serve(&mut self) {
        let mut serve = gs_server(["serve", "--config", self.config.as_str()]);
        self.server = Some(serve.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap());
    }

    fn kill(&mut self) {
        if let Some(mut server) = self.server.take() {
            let _gone = server.kill();
            let _status = server.wait();
        }
    }
}

#[test]
fn what_a_killed_server_had_to_say_the_next_one_says_and_operators_take_note() {
    let hook = Hook::new();
    let mut station = Station::new(&hook);
    station.serve();
    // It reached the far end, which never said so.
    let lost = hook.wait(1).remove(0);
    station.kill();
    let (code, _, error) = station.verb(&["alert", "list"]);
    assert!(code == 1 && error.contains("gs-server serve"), "{error}");
    hook.answers.store(true, Ordering::SeqCst);
    station.serve();
    let seen = hook.wait(2);
    assert_eq!(seen[1].0, lost.0, "the same number");
    assert!(json(&seen[1].1)["text"].as_str().unwrap().contains("e22 is unavailable"), "{}", seen[1].1);

    let (code, out, error) = station.verb(&["alert", "list", "--json"]);
    assert_eq!(code, 0, "{error}");
    let listed = json(&out);
    assert_eq!(listed["alerts"].as_array().unwrap().len(), 1, "{out}");
    assert_eq!(
        (&listed["alerts"][0]["state"], &listed["alerts"][0]["times"]),
        (&"unacknowledged".into(), &1.into())
    );
    let (code, out, error) = station.verb(&["alert", "ack", "1", "--note", "it is in repair"]);
    assert!(code == 0 && out.contains("△ warning") && out.contains("note: it is in repair"), "{out}{error}");
    let (code, out, _) = station.verb(&["alerts", "shelve", "1", "--hours", "2"]);
    assert!(code == 0 && out.contains("shelved"), "{out}");
    let (code, out, _) = station.verb(&["alert", "assign", "1", "--to", "ben", "--json"]);
    assert!(code == 0 && json(&out)["assignee"] == "ben", "{out}");
    assert_eq!(station.verb(&["alert", "unshelve", "1"]).0, 0);
    let (code, _, error) = station.verb(&["alert", "acknowledge", "7"]);
    assert!(code == 3 && error.contains("no alert 7"), "{error}");

    let (code, out, _) = station.verb(&["alert", "test", "hook"]);
    assert!(code == 0 && out.contains("hook"), "{out}");
    assert!(hook.wait(3)[2].1.contains("alert.test"));
    let (code, _, error) = station.verb(&["alert", "test", "mail"]);
    assert!(code == 2 && error.contains("hook"), "{error}");
    let (code, out, _) = station.verb(&["alert", "targets"]);
    assert!(code == 0 && out.contains("ok") && !out.contains("staple"), "{out}");
    // What was told is not told again.
    station.kill();
    station.serve();
    for _ in 0..100 {
        pause();
    }
    assert_eq!(hook.seen.lock().unwrap().len(), 3);
}
