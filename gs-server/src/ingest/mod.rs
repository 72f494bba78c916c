//! What ears other than our radio report: read, checked, merged into the archive.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Aliases`] | what our satellites are called elsewhere |
//! | [`Ears`] | the one way in: left out what is known, delivered, counted |
//! | [`formats`] | what files and messages look like; bounded readers, no I/O of their own |
//!
//! Reports are forgeable, all of them: they fill the archive and nothing else ([`mission::reception`]).

mod aliases;
mod ears;
pub mod formats;

pub use aliases::Aliases;
pub use ears::{EarCounts, Ears, EarsError, Outcome, TOGETHER};

#[cfg(test)]
mod tests;
