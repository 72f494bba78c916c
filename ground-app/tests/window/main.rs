//! The window on a real server with a simulated satellite, driven by accessible labels. One program, for it is linked
//! with the whole server: a topic is a module.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot be set up has failed")]

mod commanding;
mod common;
mod frame;
mod lost;
