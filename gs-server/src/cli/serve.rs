//! `gs-server serve`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot};
use tokio_util::sync::CancellationToken;

use super::shell::{print_json, print_line, runtime, signals};
use super::{Exit, Failure, SetLogFilter};
use crate::config::{Config, ConfigError};
use crate::run::{Ready, RunError, RunOptions, run_with};
use crate::storage::StoreError;

/// `gs-server serve`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server serve --config /etc/pixelsat-ground/station.toml
  gs-server serve --config station.toml --listen 127.0.0.1:0 --json

One line goes to standard output when the API listens, the log to standard error. SIGTERM and
SIGINT end it in order, a second one at once; SIGHUP reads the configuration again and says what
needs a restart. GS_LISTEN, GS_DATA and GS_LOG go before the file.")]
pub struct Serve {
    /// The configuration
    #[arg(long, value_name = "FILE")]
    pub(super) config: PathBuf,
    /// Address and port of the API and the page, before what the configuration says; port 0 takes any
    #[arg(long, value_name = "ADDR")]
    listen: Option<SocketAddr>,
    /// One JSON object when ready
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct ReadyLine {
    ready: bool,
    address: SocketAddr,
    url: String,
    /// While nobody is let in: where the first administrator begins.
    #[serde(skip_serializing_if = "Option::is_none")]
    welcome: Option<String>,
}

impl Serve {
    pub(super) fn run(self, set_log_filter: SetLogFilter) -> Result<Exit, Failure> {
        let mut config = Config::load(&self.config).map_err(Failure::usage)?;
        if let Some(listen) = self.listen {
            config.http.listen = listen;
        }
        config.check().map_err(Failure::usage)?;
        runtime()?.block_on(self.serve(config, set_log_filter))
    }

    async fn serve(self, config: Config, set_log_filter: SetLogFilter) -> Result<Exit, Failure> {
        let stop = CancellationToken::new();
        let (reload, reloads) = mpsc::channel(1);
        let listen = self.listen;
        let path = self.config.clone();
        signals(&stop, move || match changed(&path, listen) {
            // One that waits already is as new as this one.
            Ok(config) => drop(reload.try_send(config)),
            Err(error) => {
                let reason = std::error::Error::source(&error).map(|source| format!(": {source}"));
                tracing::error!(
                    "reload: the old configuration stays in force: {error}{}",
                    reason.unwrap_or_default()
                );
            }
        })?;
        let address = config.http.listen;
        let listener = TcpListener::bind(address)
            .await
            .map_err(|error| Failure::doing(format!("{address} cannot be listened on"), error))?;
        let (ready, is_ready) = oneshot::channel();
        let options = RunOptions {
            ready: Some(ready),
            config_file: Some(self.config.clone()),
            reload: Some(reloads),
            set_log_filter: Some(Box::new(move |filter| set_log_filter(filter))),
            ..RunOptions::new(config)
        };
        tokio::spawn(async move {
            if let Ok(ready) = is_ready.await {
                let url = format!("http://{}/", ready.address);
                let welcome = welcome(&ready, &url).await;
                let told = if self.json {
                    print_json(&ReadyLine { ready: true, address: ready.address, url, welcome })
                } else {
                    print_line(format_args!("gs-server ready at {url}")).and_then(|()| match welcome {
                        Some(link) => print_line(format_args!(
                            "nobody is let in yet: the first administrator begins at {link} (once, within 24 h)"
                        )),
                        None => Ok(()),
                    })
                };
                if let Err(error) = told {
                    tracing::warn!("{error}");
                }
            }
        });
        let report = run_with(options, listener, stop).await.map_err(failure)?;
        if report.abandoned_tasks == 0 {
            Ok(Exit::Done)
        } else {
            Err(Failure::failed(format!("{} tasks did not end in time", report.abandoned_tasks)))
        }
    }
}

/// The one-time link of the first administrator, as long as nobody is let in.
async fn welcome(ready: &Ready, url: &str) -> Option<String> {
    match ready.people.first_welcome().await {
        Ok(path) => path.map(|path| format!("{}{path}", url.trim_end_matches('/'))),
        Err(error) => {
            tracing::warn!(%error, "no link for the first administrator could be made: {error}");
            None
        }
    }
}

fn changed(path: &std::path::Path, listen: Option<SocketAddr>) -> Result<Config, ConfigError> {
    let mut config = Config::load(path)?;
    if let Some(listen) = listen {
        config.http.listen = listen;
    }
    config.check()?;
    Ok(config)
}

/// Which exit code goes with the end of a run.
pub(super) fn failure(error: RunError) -> Failure {
    match &error {
        RunError::Config(_) => Failure::usage(error),
        RunError::Key(_)
        | RunError::KeyKind { .. }
        | RunError::KeyShared { .. }
        | RunError::ClockKind
        | RunError::StoreKind { .. } => Failure::refused(error),
        RunError::Store(store) if is_refusal(store) => Failure::refused(error),
        _ => Failure::failed(error),
    }
}

/// The folder is in use, of another kind, or of another version: nothing is wrong with it.
pub(super) fn is_refusal(error: &StoreError) -> bool {
    matches!(
        error,
        StoreError::Locked { .. } | StoreError::NewerSchema { .. } | StoreError::SimulatedMark { .. }
    )
}
