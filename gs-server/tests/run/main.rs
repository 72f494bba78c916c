//! The whole server over real pseudo-terminals.
#![expect(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot be set up has failed")]

mod antenna;
mod disk;
mod serial;
mod start_and_end;
mod support;
mod tcp;
mod tls;
mod twin;
