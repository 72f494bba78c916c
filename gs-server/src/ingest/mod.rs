//! What ears other than our radio report: read, checked, merged into the archive.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Aliases`] | what our satellites are called elsewhere |
//! | [`Ears`] | the one way in: left out what is known, delivered, counted |
//! | [`Delivery`] | many reports part by part: one is stored while the next is looked up |
//! | [`formats`] | what files and messages look like; bounded readers, no I/O of their own |
//!
//! Reports are forgeable, all of them: they fill the archive and nothing else ([`mission::reception`]).

mod aliases;
mod delivery;
mod ears;
pub mod formats;

pub use aliases::Aliases;
pub use delivery::Delivery;
pub use ears::{EarCounts, Ears, EarsError, Outcome, TOGETHER, TOGETHER_ALONE};

#[cfg(test)]
mod tests;
