//! The command line as scripts see it: help, exit codes, what goes to standard output.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot be set up has failed"
)]

mod alerts;
mod downlink;
mod files;
mod help;
mod packaging;
mod plan;
mod plans;
mod radio;
mod rehearse;
mod schedule;
mod twin;

use std::ffi::OsStr;
use std::process::{Command, Output, Stdio};

/// The program, with nothing of the environment's.
fn gs_server<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gs-server"));
    command.args(arguments).stdin(Stdio::null());
    for name in ["GS_LOG", "GS_DATA", "GS_LISTEN"] {
        command.env_remove(name);
    }
    command
}

/// Runs it to its end.
fn run<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> (i32, String, String) {
    let Output { status, stdout, stderr } = gs_server(arguments).output().expect("the program runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (status.code().expect("it was not killed"), text(stdout), text(stderr))
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}
