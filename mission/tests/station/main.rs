//! The station engine, driven by hand: a world that confirms what it is asked for, late or never, and writes down
//! everything in the order in which it happened. No satellite here: what it would say is said by the test.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot be set up has failed"
)]

mod alerts;
mod at_most_once;
mod chaos;
mod clocks;
mod frames;
mod gates;
mod health;
mod images;
mod locks;
mod order;
mod outside;
mod plans;
mod restarts;
mod sky;
mod storage;
mod stored;
mod world;
