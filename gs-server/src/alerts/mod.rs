//! Alerts: what should not be, who knows of it, and who is told.
//!
//! [`mission::alert`] decides; here is its shell: a task that looks at the station ([`AlertsHandle`] is its door), keeps
//! what has changed, and one outbox for each target, which sends what is kept.
//!
//! | file | what |
//! | --- | --- |
//! | `task` | looks when something has changed or is due, keeps, answers operators |
//! | `gather` | what the station's status does not tell: disk, clock, limits, passes |
//! | `message` | alerts in words |
//! | `outbox` | one for each target: sends, tries again, makes digests |
//! | `view` | an alert as it goes over the wire |
//! | `target` | e-mail, webhook, Matrix, Slack, Discord: one attempt each |
//!
//! A message is durable before it is sent, and carries a number that is the same in each attempt: after a crash it may
//! come twice, and whoever gets it can tell.

mod gather;
mod handle;
mod message;
mod outbox;
pub(crate) mod target;
mod task;
mod view;

#[cfg(test)]
pub(crate) mod catchers;
#[cfg(test)]
mod tests;

pub(crate) use gather::Watched;
pub use handle::{Acted, Action, ActionFailure, AlertsHandle, TargetNow, TestFailure};
pub(crate) use message::shape;
pub(crate) use target::secret_of_file;
pub(crate) use task::{AlertsParts, AlertsTask};
pub(crate) use view::view;
