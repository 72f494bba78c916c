//! A broker of our own, for boards that are pointed at it: MQTT 3.1.1, QoS 0 to 2 inwards.
//!
//! **It passes nothing on.** A session holds its own connection and the way into the archive, and knows no other session:
//! what one client publishes cannot reach another, whatever its topic. All that a board is ever sent besides the answers of
//! the protocol is the modem setting of the configuration (`begine`), in the session of the board that said hello. So
//! nobody can make a board transmit, restart or update itself through us.
//!
//! Bounded: connections, those that have not said who they are, the length of a packet, the time until CONNECT, the time
//! without a word.

mod session;

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use sha2::{Digest as _, Sha256};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_rustls::TlsAcceptor;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use super::intake::Intake;
use super::mqtt::wire::Stream;
use super::secret;
use super::status::Way;
use crate::clock::{Timer, wall_sleep, within};
use crate::config::EarSection;
use crate::http::{Tls, TlsFiles};
use crate::run::RunError;

/// Sessions at once.
const SESSIONS: usize = 64;
/// Connections that have not said who they are.
const HELLOS: usize = 16;
/// How long they may take for it.
const HELLO_TIME: Duration = Duration::from_secs(10);
/// Bytes of the file with the modem setting; a board takes no more than 1000 in all.
const MODEM_MAX: usize = 800;

/// The broker, listening.
pub(super) struct Broker {
    listener: TcpListener,
    tls: Option<TlsAcceptor>,
    shared: Arc<Shared>,
}

/// What sessions share. No queue and no socket of another session is in it.
struct Shared {
    /// Who may log in, with the digest of the password; empty: anybody on this machine.
    logins: Vec<(String, [u8; 32])>,
    modem: Option<Vec<u8>>,
    intake: Intake,
    way: Arc<Way>,
    /// Sessions by client id: who comes with the id of another takes its place.
    sessions: Mutex<BTreeMap<String, (u64, CancellationToken)>>,
}

impl Broker {
    /// Listens.
    ///
    /// # Errors
    /// [`RunError`] when the address is taken, or a password, the certificate or the modem setting cannot be read.
    pub(super) async fn open(
        section: &EarSection,
        intake: Intake,
        way: Arc<Way>,
        machine: Arc<dyn Timer>,
    ) -> Result<Self, RunError> {
        let wrong = |words: String| RunError::Ear { name: section.name.clone(), words };
        let mut logins = Vec::new();
        for board in &section.boards {
            let password = secret::load(&board.password_file).await.map_err(wrong)?;
            logins.push((board.user.clone(), Sha256::digest(password.as_bytes()).into()));
        }
        let modem = section.modem_file.as_deref().map(modem).transpose().map_err(wrong)?;
        let tls = section.tls.as_ref().map(|tls| {
            let files = TlsFiles { certificate: tls.certificate.clone(), key: tls.key.clone() };
            let tls = Tls::new(files, Arc::clone(&machine) as _);
            tls.map(|tls| tls.acceptor()).map_err(|error| error.to_string().replace("http.tls", "tls"))
        });
        let tls = tls.transpose().map_err(wrong)?;
        let address = section.listen();
        let listener = TcpListener::bind(address).await.map_err(|error| {
            wrong(format!("it cannot listen at {address} ({error}): is another broker running?"))
        })?;
        tracing::info!(ear = %section.name, "ear {}: boards may connect to {}", section.name, way_address(&listener, address));
        way.connected(0);
        way.works();
        let sessions = Mutex::new(BTreeMap::new());
        let shared = Arc::new(Shared { logins, modem, intake, way, sessions });
        Ok(Self { listener, tls, shared })
    }

    /// Takes connections until `stop`.
    pub(super) async fn run(self, stop: CancellationToken) {
        let (hellos, places) = (Arc::new(Semaphore::new(HELLOS)), Arc::new(Semaphore::new(SESSIONS)));
        let tasks = TaskTracker::new();
        loop {
            let accepted = tokio::select! {
                () = stop.cancelled() => break,
                accepted = self.listener.accept() => accepted,
            };
            let Ok((stream, peer)) = accepted else {
                // Out of file handles, or the client is gone already: neither is the end.
                wall_sleep(Duration::from_millis(50)).await;
                continue;
            };
            let Ok(hello) = Arc::clone(&hellos).try_acquire_owned() else {
                self.shared.way.count("turned-away");
                continue;
            };
            let (shared, places, tls) = (Arc::clone(&self.shared), Arc::clone(&places), self.tls.clone());
            let stop = stop.clone();
            tasks.spawn(async move {
                tokio::select! {
                    () = stop.cancelled() => {}
                    () = serve(shared, stream, peer, tls, (hello, places)) => {}
                }
            });
        }
        tasks.close();
        tasks.wait().await;
    }
}

/// One connection, from its handshake to its end.
async fn serve(
    shared: Arc<Shared>,
    stream: TcpStream,
    peer: SocketAddr,
    tls: Option<TlsAcceptor>,
    (hello, places): (OwnedSemaphorePermit, Arc<Semaphore>),
) {
    let _ = stream.set_nodelay(true);
    let stream: Box<dyn Stream> = match tls {
        None => Box::new(stream),
        Some(tls) => match within(HELLO_TIME, tls.accept(stream)).await {
            Some(Ok(stream)) => Box::new(stream),
            _ => {
                shared.way.count("handshakes-failed");
                tracing::debug!(%peer, "a handshake of TLS failed");
                return;
            }
        },
    };
    let Some(session) = session::begin(&shared, stream, peer).await else { return };
    drop(hello);
    let Ok(_place) = places.try_acquire_owned() else {
        shared.way.count("turned-away");
        return;
    };
    session.run(&shared).await;
}

impl Shared {
    /// Name and password are those of a board, or anybody may come. Gives the user under whose topics it may publish;
    /// `Some(None)`: any.
    fn admits(&self, login: Option<(&str, &str)>) -> Option<Option<String>> {
        if self.logins.is_empty() {
            return Some(None);
        }
        let (user, password) = login?;
        let digest: [u8; 32] = Sha256::digest(password.as_bytes()).into();
        let found = self.logins.iter().find(|(known, _)| known == user);
        found.filter(|(_, known)| *known == digest).map(|(user, _)| Some(user.clone()))
    }

    /// Takes the place of a client id; whoever had it is told to go.
    fn enter(&self, client_id: &str, gone: &CancellationToken) -> u64 {
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        let number = sessions.values().map(|(number, _)| *number).max().map_or(1, |most| most + 1);
        if let Some((_, other)) = sessions.insert(client_id.to_owned(), (number, gone.clone())) {
            other.cancel();
        }
        self.way.connected(sessions.len());
        number
    }

    fn leave(&self, client_id: &str, number: u64) {
        let mut sessions = self.sessions.lock().unwrap_or_else(PoisonError::into_inner);
        if sessions.get(client_id).is_some_and(|(held, _)| *held == number) {
            sessions.remove(client_id);
        }
        self.way.connected(sessions.len());
    }
}

fn way_address(listener: &TcpListener, wanted: SocketAddr) -> SocketAddr {
    listener.local_addr().unwrap_or(wanted)
}

/// The modem setting, as boards take it.
fn modem(path: &Path) -> Result<Vec<u8>, String> {
    let text = std::fs::read(path)
        .map_err(|error| format!("modem_file {} cannot be read: {error}", path.display()))?;
    let wrong = |what: &str| format!("modem_file {}: {what}; docs/ears.md has one", path.display());
    let value: serde_json::Value =
        serde_json::from_slice(&text).map_err(|error| wrong(&format!("it is no JSON ({error})")))?;
    if !(value["mode"].is_string() && value["freq"].is_number() && value["sat"].is_string()) {
        return Err(wrong("mode, freq or sat is missing"));
    }
    let short = serde_json::to_vec(&value).map_err(|error| wrong(&error.to_string()))?;
    if short.len() > MODEM_MAX { Err(wrong("it is longer than 800 bytes")) } else { Ok(short) }
}
