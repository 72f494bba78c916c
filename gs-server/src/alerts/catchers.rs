//! Far ends for tests: a mail server and a web server on real sockets, which take, refuse, answer wrong or hang.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, Method, StatusCode, Uri};
use tokio::io::{AsyncBufReadExt as _, AsyncWriteExt as _, BufReader};
use tokio::net::{TcpListener, TcpStream};

use crate::clock::wall_sleep;

/// Waits until so many have come.
async fn wait<T: Clone>(all: &Mutex<Vec<T>>, count: usize) -> Vec<T> {
    for _ in 0..1500 {
        let found = all.lock().unwrap().clone();
        if found.len() >= count {
            return found;
        }
        wall_sleep(Duration::from_millis(10)).await;
    }
    panic!("{count} never came, {} did", all.lock().unwrap().len());
}

/// A mail server that speaks as much SMTP as RFC 5321 asks of a small one.
#[derive(Clone)]
pub(crate) struct Mailbox {
    pub(crate) address: SocketAddr,
    mails: Arc<Mutex<Vec<String>>>,
    /// What is said to RCPT TO.
    says: Arc<Mutex<&'static str>>,
}

impl Mailbox {
    pub(crate) async fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let mailbox = Self {
            address: listener.local_addr().unwrap(),
            mails: Arc::default(),
            says: Arc::new(Mutex::new("250 ok")),
        };
        let server = mailbox.clone();
        tokio::spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                let server = server.clone();
                tokio::spawn(async move { server.serve(stream).await });
            }
        });
        mailbox
    }

    pub(crate) fn now_says(&self, to_receivers: &'static str) {
        *self.says.lock().unwrap() = to_receivers;
    }

    /// The mails, headers and all, once there are so many.
    pub(crate) async fn wait(&self, count: usize) -> Vec<String> {
        wait(&self.mails, count).await
    }

    async fn serve(&self, stream: TcpStream) -> Option<()> {
        let (read, mut write) = stream.into_split();
        let mut lines = BufReader::new(read).lines();
        write.write_all(b"220 catcher ESMTP\r\n").await.ok()?;
        while let Some(line) = lines.next_line().await.ok()? {
            let verb = line.split([' ', ':']).next().unwrap_or_default().to_ascii_uppercase();
            let answer = match verb.as_str() {
                "EHLO" => "250-catcher\r\n250 8BITMIME",
                "RCPT" => *self.says.lock().unwrap(),
                "DATA" => {
                    write.write_all(b"354 go on\r\n").await.ok()?;
                    let mut mail = String::new();
                    loop {
                        let line = lines.next_line().await.ok()??;
                        if line == "." {
                            break;
                        }
                        mail.push_str(line.strip_prefix('.').unwrap_or(&line));
                        mail.push('\n');
                    }
                    self.mails.lock().unwrap().push(mail);
                    "250 taken"
                }
                "QUIT" => {
                    write.write_all(b"221 bye\r\n").await.ok()?;
                    return Some(());
                }
                _ => "250 ok",
            };
            write.write_all(format!("{answer}\r\n").as_bytes()).await.ok()?;
        }
        Some(())
    }
}

/// One request as it came.
#[derive(Debug, Clone)]
pub(crate) struct Posted {
    pub(crate) line: String,
    pub(crate) headers: HeaderMap,
    pub(crate) body: String,
}

impl Posted {
    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", |value| value.to_str().unwrap())
    }
}

/// A web server that answers what it is told to; status 0: nothing, ever.
#[derive(Clone)]
pub(crate) struct Hook {
    pub(crate) url: String,
    posted: Arc<Mutex<Vec<Posted>>>,
    says: Arc<Mutex<u16>>,
}

impl Hook {
    pub(crate) async fn saying(status: u16) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let hook = Self {
            url: format!("http://{}/hook", listener.local_addr().unwrap()),
            posted: Arc::default(),
            says: Arc::new(Mutex::new(status)),
        };
        let router = Router::new().fallback(answer).with_state(hook.clone());
        tokio::spawn(async move { axum::serve(listener, router).await });
        hook
    }

    pub(crate) fn now_says(&self, status: u16) {
        *self.says.lock().unwrap() = status;
    }

    pub(crate) async fn wait(&self, count: usize) -> Vec<Posted> {
        wait(&self.posted, count).await
    }

    pub(crate) fn forget_last(&self) {
        self.posted.lock().unwrap().pop();
    }

    pub(crate) fn count(&self) -> usize {
        self.posted.lock().unwrap().len()
    }
}

async fn answer(
    State(hook): State<Hook>,
    method: Method,
    uri: Uri,
    headers: HeaderMap,
    body: Bytes,
) -> (StatusCode, &'static str) {
    let line = format!("{method} {uri}");
    let body = String::from_utf8_lossy(&body).into_owned();
    hook.posted.lock().unwrap().push(Posted { line, headers, body });
    let status = *hook.says.lock().unwrap();
    match status {
        0 => std::future::pending().await,
        status => (StatusCode::from_u16(status).unwrap(), "said the catcher"),
    }
}
