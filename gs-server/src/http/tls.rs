//! TLS by rustls: a second listener beside the plain one, which stays for programs on this machine.
//!
//! Handshakes run beside each other, so that one slow or hostile client holds up nobody; at most [`HANDSHAKES_MAX`] at
//! once, [`HANDSHAKE_TIME`] each. The certificate's file is looked at again when it has changed, at most once a minute:
//! whoever renews it need not restart the server.

use std::fs::File;
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use axum::Router;
use axum::extract::connect_info::{ConnectInfo, Connected};
use axum::extract::{Extension, Request};
use axum::middleware::{Next, from_fn};
use axum::response::Response;
use axum::serve::{IncomingStream, Listener};
use mission::{Clock, MonoUs};
use rustls::ServerConfig;
use rustls::crypto::ring;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::server::{ClientHello, ResolvesServerCert};
use rustls::sign::CertifiedKey;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;
use tokio_util::sync::CancellationToken;

use crate::clock::{wall_sleep, within};

/// Handshakes under way; further connections wait in the kernel.
const HANDSHAKES_MAX: usize = 128;
/// What a handshake may take.
const HANDSHAKE_TIME: Duration = Duration::from_secs(10);
/// The files are looked at again after so long, microseconds.
const LOOK_AGAIN_US: u64 = 60_000_000;

/// Why there can be no TLS. `Display` names the file and the remedy, never what is in the key.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// A file cannot be read.
    #[error("{} cannot be read: name a PEM file in http.tls.{key}", path.display())]
    Io {
        /// Which setting names it.
        key: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
    /// It is no PEM file of that kind.
    #[error("{} holds no {what} in PEM form: write `-----BEGIN …` as the authority gave it (http.tls.{key})", path.display())]
    Malformed {
        /// Which setting names it.
        key: &'static str,
        /// The file.
        path: PathBuf,
        /// What was looked for.
        what: &'static str,
    },
    /// Others may read the key.
    #[error("{} has mode {mode:04o}: run `chmod 600` on it, the key of a certificate is for its owner alone", path.display())]
    Exposed {
        /// The file.
        path: PathBuf,
        /// Its permission bits.
        mode: u32,
    },
    /// Key and certificate are not of each other, or of a kind that we do not know.
    #[error(
        "certificate and key do not fit: http.tls.certificate must begin with the certificate of the key in http.tls.key"
    )]
    Misfit(#[source] rustls::Error),
}

/// Where certificate and key lie.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlsFiles {
    /// The chain, the server's own certificate first; PEM.
    pub certificate: PathBuf,
    /// Its private key, mode 0600; PEM.
    pub key: PathBuf,
}

impl TlsFiles {
    fn load(&self) -> Result<CertifiedKey, TlsError> {
        let malformed = |key, path: &Path, what| TlsError::Malformed { key, path: path.to_owned(), what };
        let chain = read("certificate", &self.certificate)?;
        let chain: Vec<_> = CertificateDer::pem_slice_iter(&chain)
            .collect::<Result<_, _>>()
            .map_err(|_| malformed("certificate", &self.certificate, "certificate"))?;
        if chain.is_empty() {
            return Err(malformed("certificate", &self.certificate, "certificate"));
        }
        let mode = std::fs::metadata(&self.key).map(|about| about.mode() & 0o7777).unwrap_or(0);
        if mode & 0o077 != 0 {
            return Err(TlsError::Exposed { path: self.key.clone(), mode });
        }
        let key = zeroize::Zeroizing::new(read("key", &self.key)?);
        let key =
            PrivateKeyDer::from_pem_slice(&key).map_err(|_| malformed("key", &self.key, "private key"))?;
        let key = ring::sign::any_supported_type(&key).map_err(TlsError::Misfit)?;
        let whole = CertifiedKey::new(chain, key);
        whole.keys_match().map_err(TlsError::Misfit)?;
        Ok(whole)
    }

    /// When either was changed last.
    fn changed(&self) -> Option<[SystemTime; 2]> {
        let of = |path: &Path| File::open(path).and_then(|file| file.metadata()?.modified()).ok();
        Some([of(&self.certificate)?, of(&self.key)?])
    }
}

fn read(key: &'static str, path: &Path) -> Result<Vec<u8>, TlsError> {
    std::fs::read(path).map_err(|source| TlsError::Io { key, path: path.to_owned(), source })
}

/// The certificate as it lies on the disk, renewed when that is.
struct Renewed {
    files: TlsFiles,
    clock: Arc<dyn Clock>,
    held: Mutex<Held>,
}

struct Held {
    key: Arc<CertifiedKey>,
    changed: Option<[SystemTime; 2]>,
    looked_at: MonoUs,
}

impl std::fmt::Debug for Renewed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renewed").field("files", &self.files).finish_non_exhaustive()
    }
}

impl ResolvesServerCert for Renewed {
    fn resolve(&self, _: ClientHello<'_>) -> Option<Arc<CertifiedKey>> {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        let now = self.clock.now().mono;
        if now.0.saturating_sub(held.looked_at.0) >= LOOK_AGAIN_US {
            held.looked_at = now;
            let changed = self.files.changed();
            if changed.is_some() && changed != held.changed {
                held.changed = changed;
                match self.files.load() {
                    Ok(key) => {
                        tracing::info!("The certificate was renewed.");
                        held.key = Arc::new(key);
                    }
                    Err(error) => tracing::warn!(%error, "The old certificate stays: {error}"),
                }
            }
        }
        Some(Arc::clone(&held.key))
    }
}

/// What the listener needs to open connections.
pub struct Tls(TlsAcceptor);

impl Tls {
    /// Reads certificate and key.
    ///
    /// # Errors
    /// [`TlsError`].
    pub fn new(files: TlsFiles, clock: Arc<dyn Clock>) -> Result<Self, TlsError> {
        let held =
            Held { key: Arc::new(files.load()?), changed: files.changed(), looked_at: clock.now().mono };
        let renewed = Arc::new(Renewed { files, clock, held: Mutex::new(held) });
        let mut config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(TlsError::Misfit)?
            .with_no_client_auth()
            .with_cert_resolver(renewed);
        config.alpn_protocols = vec![b"http/1.1".to_vec()];
        Ok(Self(TlsAcceptor::from(Arc::new(config))))
    }

    /// For what does not speak HTTP.
    pub(crate) fn acceptor(self) -> TlsAcceptor {
        self.0
    }
}

/// Hands out connections whose handshake is done.
struct TlsListener {
    ready: mpsc::Receiver<(TlsStream<TcpStream>, SocketAddr)>,
    address: SocketAddr,
}

impl TlsListener {
    fn new(listener: TcpListener, tls: Tls, stop: CancellationToken) -> io::Result<Self> {
        let address = listener.local_addr()?;
        let (sender, ready) = mpsc::channel(1);
        tokio::spawn(async move {
            tokio::select! {
                () = stop.cancelled() => {}
                () = accept(listener, tls.0, sender) => {}
            }
        });
        Ok(Self { ready, address })
    }
}

async fn accept(
    listener: TcpListener,
    acceptor: TlsAcceptor,
    ready: mpsc::Sender<(TlsStream<TcpStream>, SocketAddr)>,
) {
    let places = Arc::new(Semaphore::new(HANDSHAKES_MAX));
    loop {
        let Ok(place) = Arc::clone(&places).acquire_owned().await else { return };
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                // Out of file handles, or the client is gone already: neither is the end.
                tracing::debug!(%error, "A connection was not taken.");
                wall_sleep(Duration::from_millis(50)).await;
                continue;
            }
        };
        let (acceptor, ready) = (acceptor.clone(), ready.clone());
        tokio::spawn(async move {
            let _ = stream.set_nodelay(true);
            match within(HANDSHAKE_TIME, acceptor.accept(stream)).await {
                Some(Ok(stream)) => {
                    drop(place);
                    // Refused only when nobody serves any more.
                    let _ = ready.send((stream, peer)).await;
                }
                Some(Err(error)) => tracing::debug!(%peer, %error, "A handshake failed."),
                None => tracing::debug!(%peer, "A handshake took too long."),
            }
        });
    }
}

impl Listener for TlsListener {
    type Io = TlsStream<TcpStream>;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Self::Io, Self::Addr) {
        match self.ready.recv().await {
            Some(accepted) => accepted,
            // The server stops; whoever waits here is told by other means.
            None => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> io::Result<Self::Addr> {
        Ok(self.address)
    }
}

/// Where a connection comes from.
#[derive(Debug, Clone, Copy)]
struct Peer(SocketAddr);

impl Connected<IncomingStream<'_, TlsListener>> for Peer {
    fn connect_info(stream: IncomingStream<'_, TlsListener>) -> Self {
        Self(*stream.remote_addr())
    }
}

/// As [`super::serve`], over TLS.
///
/// # Errors
/// When the listener fails.
pub async fn serve_tls(
    listener: TcpListener,
    tls: Tls,
    router: Router,
    stop: CancellationToken,
) -> io::Result<()> {
    let listener = TlsListener::new(listener, tls, stop.clone())?;
    // Handlers know one kind of peer.
    let router = router.layer(from_fn(
        |Extension(ConnectInfo(Peer(peer))): Extension<ConnectInfo<Peer>>,
         mut request: Request,
         next: Next| async move {
            request.extensions_mut().insert(ConnectInfo(peer));
            let response: Response = next.run(request).await;
            response
        },
    ));
    let router = router.into_make_service_with_connect_info::<Peer>();
    axum::serve(listener, router).with_graceful_shutdown(stop.cancelled_owned()).await
}
