//! Those who are told of alerts, with a secret each: they take it, and they throw it back.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use end_to_end::mail::MailCatcher;
use end_to_end::{Client, Folder};

use super::search::{Spellings, base64, find, words};

const PASSWORD: &str = "Vb3-another-unlikely-one-9Tq";
const SIGNATURE: &str = "Hx7-key-of-all-the-seals-4Lp";
const ACCESS: &str = "syt_Zr2-access-to-a-room-8Wk";
const FORWARD: &str = "Gm2-token-for-the-world-7Px";
const SLACK: &str = "Ns6SlackAddressNobodyGuesses1Jd";
const DISCORD: &str = "Yt9DiscordAddressNobodyGuesses5Fm";

/// Takes whatever comes over HTTP; when it is in a bad mood it refuses with all that was said, as many servers do.
#[derive(Clone)]
pub(crate) struct WebCatcher {
    address: SocketAddr,
    said: Arc<Mutex<String>>,
    refuses: Arc<AtomicBool>,
}

impl WebCatcher {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("its address");
        let catcher = Self { address, said: Arc::default(), refuses: Arc::default() };
        let server = catcher.clone();
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                // Whoever hung up said nothing.
                let _ = server.serve(stream);
            }
        });
        catcher
    }

    fn serve(&self, mut stream: TcpStream) -> std::io::Result<()> {
        let mut reader = BufReader::new(stream.try_clone()?);
        let (mut head, mut length) = (String::new(), 0);
        loop {
            let mut line = String::new();
            if reader.read_line(&mut line)? <= 2 {
                break;
            }
            if let Some(bytes) = line.to_ascii_lowercase().strip_prefix("content-length:") {
                length = bytes.trim().parse().unwrap_or(0);
            }
            head += &line;
        }
        let mut body = vec![0; length];
        reader.read_exact(&mut body)?;
        self.said.lock().unwrap_or_else(PoisonError::into_inner).push_str(&head);
        let (status, words) = match self.refuses.load(Ordering::Relaxed) {
            true => ("404 Not Found", format!("Cannot {}", head.replace("\r\n", " "))),
            false => ("200 OK", "{}".to_owned()),
        };
        let length = words.len();
        write!(stream, "HTTP/1.1 {status}\r\ncontent-length: {length}\r\nconnection: close\r\n\r\n{words}")
    }
}

/// One target of each kind.
pub(crate) struct Correspondents {
    mail: MailCatcher,
    web: WebCatcher,
    /// Where frames are passed on to; never in a good mood.
    world: WebCatcher,
}

impl Correspondents {
    /// The files with their secrets.
    pub(crate) const FILES: [&str; 6] =
        ["mail.password", "webhook.key", "matrix.token", "slack.address", "discord.address", "forward.token"];
    const TARGETS: [&str; 5] = ["mail", "webhook", "matrix", "slack", "discord"];

    /// Listens, and makes a station of this folder write to them.
    pub(crate) fn of(folder: &mut Folder) -> Self {
        let (mail, web, world) = (MailCatcher::start(), WebCatcher::start(), WebCatcher::start());
        world.refuses.store(true, Ordering::Relaxed);
        let secrets = [
            PASSWORD.to_owned(),
            SIGNATURE.to_owned(),
            ACCESS.to_owned(),
            format!("http://{}/services/T0/B0/{SLACK}", web.address),
            format!("http://{}/api/webhooks/1/{DISCORD}", web.address),
            FORWARD.to_owned(),
        ];
        for (name, secret) in Self::FILES.iter().zip(secrets) {
            folder.write_key(name, &format!("{secret}\n"), 0o600);
        }
        let target = |name: &str, kind: &str, file: &str, more: &str| {
            format!(
                "[[alerts.targets]]\nname = \"{name}\"\nkind = \"{kind}\"\nsecret_file = \"{file}\"\n{more}\n"
            )
        };
        let kinds = ["email", "webhook", "matrix", "slack", "discord"];
        let more = [
            format!(
                "server = \"{}\"\nsecurity = \"none\"\nfrom = \"ground@example.org\"\nto = [\"ops@example.org\"]\n\
                 user = \"ground\"\n",
                mail.address
            ),
            format!("url = \"http://{}/hook\"\n", web.address),
            format!("url = \"http://{}\"\nroom = \"!room:example.org\"\n", web.address),
            String::new(),
            String::new(),
        ];
        for (place, name) in Self::TARGETS.iter().enumerate() {
            folder.sections += &target(name, kinds[place], Self::FILES[place], &more[place]);
        }
        folder.sections += &format!(
            "[[forward]]\nname = \"world\"\nkind = \"sids\"\nreceiver = \"N0CALL\"\nlive = true\nsecret_file = \"forward.token\"\n\
             url = \"http://{}/\"\n",
            world.address
        );
        Self { mail, web, world }
    }

    /// What must be found nowhere.
    pub(crate) fn spellings() -> Spellings {
        let login = base64(format!("\0ground\0{PASSWORD}").as_bytes());
        words(&[
            ("password", PASSWORD.to_owned()),
            // The last group of four holds what follows as well.
            ("login", login[..login.len() - 4].to_owned()),
            ("password in base64", base64(PASSWORD.as_bytes())),
            ("key of signatures", SIGNATURE.to_owned()),
            ("access token", ACCESS.to_owned()),
            ("token of the world", FORWARD.to_owned()),
            ("address at Slack", SLACK.to_owned()),
            ("address at Discord", DISCORD.to_owned()),
        ])
    }

    /// Each is told something and takes it; then each refuses, and repeats what it was told.
    pub(crate) fn are_told(&self, client: &Client) {
        let test = |name: &str, key: &str| {
            let path = format!("/api/v1/alerts/targets/{name}/test");
            client.post(&path, &format!("{key}-{name}"), "{}").expect("an answer")
        };
        for name in Self::TARGETS {
            let sent = test(name, "good");
            assert_eq!(sent.status, 200, "{name}: {}", sent.text());
        }
        let said = self.web.said.lock().unwrap_or_else(PoisonError::into_inner).clone();
        for wanted in [ACCESS, SLACK, DISCORD, "webhook-signature"] {
            assert!(said.contains(wanted), "{wanted} was never used: {said}");
        }
        let world = self.world.said.lock().unwrap_or_else(PoisonError::into_inner).clone();
        assert!(world.contains(FORWARD), "nothing was passed on: {world}");
        let mails = self.mail.said().join("\n");
        assert!(find(mails.as_bytes(), &Self::spellings()).is_some(), "the password was never used: {mails}");
        self.web.refuses.store(true, Ordering::Relaxed);
        self.mail.refuse_logins();
        for name in Self::TARGETS {
            let refused = test(name, "bad");
            assert!(refused.status >= 400, "{name}: {}", refused.text());
            assert_eq!(find(&refused.body, &Self::spellings()), None, "{name}");
            // Its own words are told, but for the secret in them.
            let hides = refused.text().contains("[secret]");
            assert_eq!(hides, ["mail", "slack", "discord"].contains(&name), "{name}: {}", refused.text());
        }
    }
}
