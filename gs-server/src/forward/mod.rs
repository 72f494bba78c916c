//! Passing on what we hear: to SatNOGS DB and others that speak SiDS, and to one's own webhook.
//!
//! | file | what |
//! | --- | --- |
//! | `form` | the exact request for a reception: what a dry run shows is what would be sent |
//! | `target` | one attempt, and what its answer means |
//! | `task` | takes up receptions, sends them one by one, writes down what became of each |
//! | `handle` | the door for the API |
//!
//! Each reception is written down for each target before it is sent, and marked as under way before the request leaves.
//! SiDS knows no repetition: a second POST makes a second frame. So when nobody knows whether a request arrived, it is
//! `unknown` and stays so until a person decides. A webhook carries its number, so it is asked again.
//!
//! What it does **not** do: send what others than our own stations and boards heard, or what was replayed or made up.

mod form;
mod handle;
mod target;
mod task;

#[cfg(test)]
mod tests;

pub use handle::{ForwardTargetNow, ForwardsHandle};
pub(crate) use task::{ForwardParts, spawn};
