//! Element care: where elements come from, and how they reach the engine.
//!
//! | file | idea |
//! |---|---|
//! | [`sets`] | which sets of a text belong to which satellite; never a guess |
//! | [`door`] | sets into the engine and the archive; what is held is not added again |
//! | `policy` | when a source may be asked |
//! | `memory` | what is remembered of each source across restarts |
//! | `client`, `credentials` | one polite request |
//! | [`fetcher`] | a round of sources: ask, keep, take up |
//! | [`task`] | the server's own rounds, and those that operators want |
//! | [`offline`], [`remote`] | the same from the command line: without a server, and beside one |
//!
//! Nothing is asked unless the configuration names a source. What a source gave lies on the disk before the engine sees it,
//! and is taken up at each start: a kill in between loses nothing and asks nobody twice.
//!
//! What it does **not** do: read elements (`tle` does), judge their age or use them (`mission::sky` does).

mod client;
mod credentials;
pub mod door;
pub mod fetcher;
mod memory;
pub mod offline;
mod policy;
pub mod remote;
pub mod sets;
pub mod task;

#[cfg(test)]
pub(crate) mod tests;

pub(crate) use client::{chain, http_client};
pub use door::{AddError, Door, held};
pub use fetcher::{Asker, Fetcher};
pub use offline::Offline;
pub use remote::{Remote, RemoteError};
pub use sets::{NoMatch, Refused, SetsOfText, Wanted, sets_of};
pub use task::{ElementsHandle, FetchError};
