//! The app's line to a server. All of the network lives on one thread of its own; the window never waits for it.
//!
//! ```text
//!            Courier::ask(future) ──▶ bounded queue ──▶ network thread ──▶ Pending<T>, looked at each frame
//!  window                                                    │
//!            reads  Mutex<Model> ◀── Model::apply ◀── stream, which comes back by itself
//! ```

mod follow;
mod pending;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use api::client::{Client, ClientError};
use tokio::sync::{mpsc, watch};

use crate::model::Model;
pub use pending::Pending;

/// Requests that may wait at once; the next one is told that the app is busy.
const QUEUE: usize = 64;

type Job = Pin<Box<dyn Future<Output = ()> + Send>>;

/// Wakes the window: it is drawn once more.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Which server, and what lets one in.
#[derive(Clone, PartialEq, Eq)]
pub struct Server {
    /// `http://HOST:PORT`.
    pub address: String,
    /// What lets one do more than look; `None`: look only.
    pub token: Option<String>,
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server").field("address", &self.address).finish_non_exhaustive()
    }
}

/// The line: it is cut, and its thread ended, when this is dropped.
pub struct Link {
    model: Arc<Mutex<Model>>,
    courier: Courier,
    /// Closed: end.
    stop: Option<watch::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// Takes requests to the network thread.
#[derive(Clone)]
pub struct Courier {
    client: Client,
    jobs: mpsc::Sender<Job>,
    wake: Wake,
}

impl Link {
    /// Opens a line. Whether the server is there shows later, in [`Model::connection`].
    ///
    /// # Errors
    /// [`ClientError`] for an address or a token that is none.
    pub fn open(server: &Server, wake: Wake) -> Result<Self, ClientError> {
        let client = Client::new(&server.address, server.token.as_deref())?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(|error| ClientError::Setup(error.to_string()))?;
        let model = Arc::new(Mutex::new(Model::new(server.address.clone())));
        let (jobs, mut queue) = mpsc::channel::<Job>(QUEUE);
        let (stop, stopped) = watch::channel(());
        let follower = follow::Follower::new(client.clone(), Arc::clone(&model), Arc::clone(&wake));
        let run = move || {
            runtime.block_on(async move {
                let mut stopped = stopped;
                let work = async {
                    while let Some(job) = queue.recv().await {
                        tokio::spawn(job);
                    }
                };
                tokio::select! {
                    _ = stopped.changed() => {}
                    () = follower.run() => {}
                    () = work => {}
                }
            });
        };
        let thread = std::thread::Builder::new()
            .name("network".to_owned())
            .spawn(run)
            .map_err(|error| ClientError::Setup(error.to_string()))?;
        let courier = Courier { client, jobs, wake };
        Ok(Self { model, courier, stop: Some(stop), thread: Some(thread) })
    }

    /// What is known. Hold it no longer than a frame takes to draw.
    pub fn model(&self) -> MutexGuard<'_, Model> {
        self.model.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes requests.
    #[must_use]
    pub fn courier(&self) -> &Courier {
        &self.courier
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // It waits for nothing but us; what it died of the panic message has told.
            let _ = catch_unwind(AssertUnwindSafe(|| thread.join()));
        }
    }
}

impl Courier {
    /// Asks the server; the answer is in what is returned, once it has come. A full queue answers at once.
    ///
    /// A write repeats nothing by itself: keep the [`api::client::IdempotencyKey`] and ask again with it.
    pub fn ask<T, F>(&self, question: impl FnOnce(Client) -> F) -> Pending<T>
    where
        T: Send + 'static,
        F: Future<Output = Result<T, ClientError>> + Send + 'static,
    {
        let pending = Pending::new();
        let answer = pending.slot();
        let question = question(self.client.clone());
        let wake = Arc::clone(&self.wake);
        let job: Job = Box::pin(async move {
            answer.put(question.await);
            wake();
        });
        if self.jobs.try_send(job).is_err() {
            pending.slot().put(Err(ClientError::NoAnswer {
                url: "app".to_owned(),
                why: "too many requests wait already; nothing was sent".to_owned(),
            }));
        }
        pending
    }

    /// Draws the window again after this time.
    pub fn wake(&self) {
        (self.wake)();
    }
}

/// How long a lost line may stay unnoticed at most.
pub const NOTICED_WITHIN: Duration = Duration::from_secs(1);
