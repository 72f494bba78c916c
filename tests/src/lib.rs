//! What end-to-end tests need: the real binary, real processes, real sockets, real pseudo-terminals.
//!
//! | module | what |
//! | --- | --- |
//! | [`binary`] | where `gs-server` is, built when it is missing or old |
//! | [`folder`] | a folder of its own for each test, with a configuration and a key |
//! | [`process`] | a server, a twin, a foreign satellite: started, watched, killed |
//! | [`overhead`] | elements that bring the satellite over the station when a test wants it |
//! | [`http`] | a client of API v1 that believes only whole answers |
//! | [`pty`] | a pseudo-terminal, for tests that play the radio themselves |
//! | [`stream`] | a follower of the WebSocket |
//! | [`crowd`] | a thousand clients of the stream, some of them stalled or hostile, and what it costs |
//! | [`journal`] | what the twin wrote down: the far end's own witness |
//! | [`strace`] | system calls, as strace tells them |
//! | [`watch`], [`operator`] | somebody who remembers what the server published; somebody who commands |
//! | [`guide`], [`terminal`] | a page of the documentation as a list of things to do; the terminals to do them in |
//! | [`mail`] | a mail catcher |
//! | [`reports`] | reports of volunteers' stations, made up |
//! | [`wait`] | waiting for the real world |
//!
//! Everything here is as far outside the server as an operator is: it knows the wire types (`api`), the radio link
//! (`protocol`) and the twin's journal (`satellite`), and nothing of the server's inside.
#![expect(clippy::expect_used, clippy::panic, reason = "a test that cannot be set up has failed, loudly")]

pub mod binary;
pub mod crowd;
pub mod folder;
pub mod guide;
pub mod http;
pub mod journal;
pub mod mail;
pub mod mqtt;
pub mod operator;
pub mod overhead;
pub mod process;
pub mod pty;
pub mod reports;
pub mod strace;
pub mod stream;
pub mod terminal;
pub mod wait;
pub mod watch;

pub use folder::Folder;
pub use http::Client;
pub use process::{Process, Server, Twin};
pub use pty::Pty;
