//! A mail catcher: takes every mail that comes over SMTP (RFC 5321, no TLS, any or no login), and keeps it.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// It lives as long as the test.
#[derive(Debug, Clone)]
pub struct MailCatcher {
    /// Where it listens.
    pub address: SocketAddr,
    mails: Arc<Mutex<Vec<String>>>,
    said: Arc<Mutex<Vec<String>>>,
    refuses: Arc<AtomicBool>,
}

impl MailCatcher {
    /// Listens on a free port of this machine.
    ///
    /// # Panics
    /// When there is none.
    #[must_use]
    pub fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let catcher = Self {
            address: listener.local_addr().expect("its address"),
            mails: Arc::default(),
            said: Arc::default(),
            refuses: Arc::default(),
        };
        let server = catcher.clone();
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let server = server.clone();
                std::thread::spawn(move || server.serve(stream));
            }
        });
        catcher
    }

    /// The mails so far, headers and all.
    #[must_use]
    pub fn mails(&self) -> Vec<String> {
        self.mails.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Every line that clients have said, but for the mails.
    #[must_use]
    pub fn said(&self) -> Vec<String> {
        self.said.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// From now on no login is good.
    pub fn refuse_logins(&self) {
        self.refuses.store(true, Ordering::Relaxed);
    }

    fn serve(&self, mut stream: TcpStream) -> Option<()> {
        let mut lines = BufReader::new(stream.try_clone().ok()?).lines();
        stream.write_all(b"220 catcher ESMTP\r\n").ok()?;
        while let Some(Ok(line)) = lines.next() {
            self.said.lock().unwrap_or_else(PoisonError::into_inner).push(line.clone());
            let verb = line.split([' ', ':']).next().unwrap_or_default().to_ascii_uppercase();
            let answer = match verb.as_str() {
                "EHLO" => "250-catcher\r\n250-AUTH PLAIN\r\n250 8BITMIME",
                "AUTH" if self.refuses.load(Ordering::Relaxed) => {
                    // As bad servers do, with the login in their words.
                    stream.write_all(format!("535 {line}: who are you?\r\n").as_bytes()).ok()?;
                    continue;
                }
                "AUTH" => "235 come in",
                "DATA" => {
                    stream.write_all(b"354 go on\r\n").ok()?;
                    let mail = lines.by_ref().map_while(Result::ok).take_while(|line| line != ".");
                    let mail: Vec<String> =
                        mail.map(|line| line.strip_prefix('.').unwrap_or(&line).to_owned()).collect();
                    self.mails.lock().unwrap_or_else(PoisonError::into_inner).push(mail.join("\n"));
                    "250 taken"
                }
                "QUIT" => {
                    stream.write_all(b"221 bye\r\n").ok()?;
                    return Some(());
                }
                _ => "250 ok",
            };
            stream.write_all(format!("{answer}\r\n").as_bytes()).ok()?;
        }
        Some(())
    }
}
