//! Rotators and rigs, through the network protocol of hamlib's daemons (rotctld, rigctld).
//!
//! | file | what it holds |
//! |---|---|
//! | `connection` | one TCP connection: a command, its whole answer, or no connection any more |
//! | `rotator`, `rig` | what the two daemons can be asked |
//! | `turning`, `tuning` | the tasks that follow a satellite with them |
//! | `antenna` | the handle by which the rest of the server steers both, and their status |
//! | `inbox` | the newest wish and nothing older |
//!
//! The protocol has traps, and each has a test here (docs/antenna.md):
//! - *No reply at all* to what a daemon does not know: every exchange has a time limit, and after it the connection is
//!   closed, because a late answer would be taken for the next one's.
//! - *`RPRT 0` for nonsense* (`nan`, `180,5`): numbers are finite, inside the limits of configuration and daemon, and
//!   written with fixed decimals; what a rotator does is read back, what a rig was set to as well.
//! - *`RPRT 0` means accepted*, not arrived: the position is polled once a second, and a rotator that does not move is told
//!   again and reported.
//! - *Answers out of step*, cut lines, endless lines: each answer repeats its command's name and ends with `RPRT`; what does
//!   not fit costs the connection. Nothing is read without a bound.
//!
//! A daemon that is not there is looked for with growing pauses (1 to 30 s) and stops nothing: no antenna hardware is needed
//! to run a station. What it does **not** do: key a transmitter, choose what to follow.

mod antenna;
mod connection;
mod error;
mod inbox;
mod rig;
mod rotator;
#[cfg(test)]
mod tests;
mod tuning;
mod turning;

pub use antenna::{
    AntennaHandle, AntennaStatus, AntennaTask, Goal, RigStatus, RotatorStatus, RouteStatus, Tracking,
    Trouble, antenna,
};
pub use connection::Patience;
pub use error::HamlibError;
pub use rig::{RigClient, RigReading};
pub use rotator::{RotatorClient, RotatorLimits};
