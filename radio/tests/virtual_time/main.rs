//! Driver and model joined in virtual time.

mod bench;
mod bounds;
mod faults;
mod module;
mod wirings;
