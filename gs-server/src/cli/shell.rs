//! What several verbs need from the operating system: standard output, a runtime, signals.

use std::io::{self, Write};

use serde::Serialize;
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;

use super::{Exit, Failure};
use crate::lifecycle::watch_signals;

/// Writes one line of JSON to standard output.
pub(super) fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    serde_json::to_writer(&mut out, value)
        .map_err(io::Error::from)
        .and_then(|()| out.write_all(b"\n"))
        .and_then(|()| out.flush())
        .or_else(quiet_pipe)
        .map_err(|error| Failure::doing("standard output cannot be written", error))
}

/// Writes one line of text to standard output.
pub(super) fn print_line(line: impl std::fmt::Display) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    writeln!(out, "{line}")
        .and_then(|()| out.flush())
        .or_else(quiet_pipe)
        .map_err(|error| Failure::doing("standard output cannot be written", error))
}

/// Writes text to standard output, at once.
pub(super) fn print_text(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .or_else(quiet_pipe)
        .map_err(|error| Failure::doing("standard output cannot be written", error))
}

/// Whoever reads us has seen enough (`| head`): not an error.
pub(super) fn quiet_pipe(error: io::Error) -> io::Result<()> {
    if error.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(error) }
}

/// A runtime for verbs that wait for several things at once.
pub(super) fn runtime() -> Result<Runtime, Failure> {
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .thread_name("gs")
        .build()
        .map_err(|error| Failure::doing("no runtime: the operating system gives no threads", error))
}

/// Cancels `stop` at the first SIGINT or SIGTERM and calls `reload` at SIGHUP; a second signal to stop ends the process
/// at once, with code 1.
pub(super) fn signals(
    stop: &CancellationToken,
    reload: impl FnMut() + Send + 'static,
) -> Result<(), Failure> {
    let watch = watch_signals(stop.clone(), reload);
    tokio::spawn(async move {
        match watch.await {
            Ok(()) => {
                eprintln!("gs-server: second signal, ending at once");
                std::process::exit(Exit::Failed as i32);
            }
            Err(error) => tracing::error!(%error, "signals cannot be heard: {error}"),
        }
    });
    Ok(())
}

/// A token that is cancelled by SIGINT or SIGTERM.
pub(super) fn stop_on_signals() -> Result<CancellationToken, Failure> {
    let stop = CancellationToken::new();
    signals(&stop, || {})?;
    Ok(stop)
}

/// Random bytes from the operating system, for keys and seeds.
pub(super) fn fill_random(bytes: &mut [u8]) -> Result<(), Failure> {
    getrandom::fill(bytes)
        .map_err(|error| Failure::failed(format!("the operating system gives no random bytes: {error}")))
}
