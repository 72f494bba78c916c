//! The program `gs-server`: arguments in, exit code out. Everything else is in the library.

use std::io::IsTerminal as _;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Context as _;
use clap::Parser as _;
use gs_server::cli::{Cli, Exit, LogSettings, SetLogFilter};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{EnvFilter, Layer, Registry, fmt, reload};

fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome = start_logging(&cli.log_settings()).and_then(|set_filter| Ok(cli.run(set_filter)?));
    match outcome {
        Ok(exit) => exit.into(),
        Err(error) => {
            eprintln!("gs-server: {}", sentence(&error));
            error.downcast_ref::<gs_server::cli::Failure>().map_or(Exit::Failed, |f| f.exit()).into()
        }
    }
}

/// The error and all its reasons on one line, each said once.
fn sentence(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for reason in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = reason;
        } else if !text.ends_with(&reason) {
            text.push_str(": ");
            text.push_str(&reason);
        }
    }
    text
}

/// Sets the one global logger, to standard error, and gives the way to change its filter later.
fn start_logging(settings: &LogSettings) -> anyhow::Result<SetLogFilter> {
    let filter = EnvFilter::try_new(&settings.filter).with_context(|| {
        format!("'{}' is no log filter; try `info` or `info,gs_server::links=debug`", settings.filter)
    })?;
    let (filter, handle) = reload::Layer::<EnvFilter, Registry>::new(filter);
    let lines: Box<dyn Layer<_> + Send + Sync> = if settings.json {
        Box::new(fmt::layer().json().with_writer(std::io::stderr))
    } else {
        let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        Box::new(fmt::layer().with_target(false).with_ansi(colours).with_writer(std::io::stderr))
    };
    tracing_subscriber::registry().with(filter).with(lines).init();
    Ok(Arc::new(move |filter: &str| {
        let changed = EnvFilter::try_new(filter)
            .map_err(|error| error.to_string())
            .and_then(|filter| handle.reload(filter).map_err(|error| error.to_string()));
        if let Err(error) = changed {
            tracing::error!(%filter, "the log filter stays as it is: {error}");
        }
    }))
}
