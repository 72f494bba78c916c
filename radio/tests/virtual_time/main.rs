//! Driver and model joined in virtual time.

#![expect(clippy::expect_used, reason = "a test that cannot go on says why")]

mod bench;
mod bounds;
mod faults;
mod module;
mod wirings;
