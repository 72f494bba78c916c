//! The server and the simulated satellite inside the app: a demo of `gs-server` on a thread of its own, reached over
//! loopback like any other server.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::mpsc;
use std::thread::JoinHandle;

use gs_server::demo::{self, DemoError, DemoOptions, Stage};
use tempfile::TempDir;
use tokio_util::sync::CancellationToken;

use crate::link::Server;

/// How it is to be.
#[derive(Debug, Clone, Default)]
pub struct EmbeddedOptions {
    /// Everything is kept here; `None`: a new folder that goes at the end.
    pub data: Option<PathBuf>,
    /// Simulated seconds per second; `None`: as fast as the machine can.
    pub speed: Option<f64>,
    /// Whether it sends by itself what an operator would.
    pub operates: bool,
}

/// Why there is none.
#[derive(Debug, thiserror::Error)]
pub enum EmbeddedError {
    /// No folder, no thread, no runtime.
    #[error("this machine gives no {what}")]
    Machine {
        /// What.
        what: &'static str,
        /// Why.
        source: std::io::Error,
    },
    /// The demo.
    #[error("the server inside could not begin")]
    Demo(#[from] DemoError),
    /// It ended before it began.
    #[error("the server inside ended before it began")]
    Died,
}

/// Runs until it is dropped; then server and satellite end in order.
pub struct Embedded {
    server: Server,
    stop: CancellationToken,
    thread: Option<JoinHandle<Result<(), DemoError>>>,
    _folder: Option<TempDir>,
}

impl Embedded {
    /// Begins; comes back when the server answers.
    ///
    /// # Errors
    /// [`EmbeddedError`].
    pub fn start(options: EmbeddedOptions) -> Result<Self, EmbeddedError> {
        let machine = |what| move |source| EmbeddedError::Machine { what, source };
        let (data, folder) = match options.data {
            Some(data) => (data, None),
            None => {
                let folder = tempfile::Builder::new().prefix("ground-app-").tempdir();
                let folder = folder.map_err(machine("folder"))?;
                (folder.path().join("data"), Some(folder))
            }
        };
        let listen = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let demo = DemoOptions::to_watch(data, options.speed, listen)
            .map_err(|error| machine("place")(std::io::Error::other(error)))?;
        let demo = DemoOptions { operates: options.operates, ..demo };
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
        let runtime = runtime.map_err(machine("runtime"))?;
        let stop = CancellationToken::new();
        let (tell, told) = mpsc::sync_channel::<Server>(1);
        let run = {
            let stop = stop.clone();
            move || {
                let ready = move |stage: &Stage| {
                    let token = stage.url.split_once("#token=").map(|(_, token)| token.to_owned());
                    // Whoever waits for it went away: then nobody looks.
                    let _ = tell.send(Server { address: format!("http://{}", stage.address), token });
                };
                runtime.block_on(demo::run(demo, stop, ready, |_| {})).map(|_| ())
            }
        };
        let thread = std::thread::Builder::new().name("server".to_owned()).spawn(run);
        let thread = thread.map_err(machine("thread"))?;
        let Ok(server) = told.recv() else {
            return Err(match thread.join() {
                Ok(Err(error)) => error.into(),
                _ => EmbeddedError::Died,
            });
        };
        Ok(Self { server, stop, thread: Some(thread), _folder: folder })
    }

    /// Where it is.
    #[must_use]
    pub fn server(&self) -> &Server {
        &self.server
    }
}

impl Drop for Embedded {
    fn drop(&mut self) {
        self.stop.cancel();
        if let Some(thread) = self.thread.take()
            && let Ok(Err(error)) = thread.join()
        {
            tracing::warn!("the server inside: {error}");
        }
    }
}
