//! Alarms: from what is seen to who must know, as a pure machine.
//!
//! [`judge()`] turns the station's [`Status`](crate::Status) and what the shell knows besides into [`Condition`]s: what
//! holds now and should not. [`Alerts`] gives each condition its one [`Alert`] (rule × subject), keeps its life by
//! ISA-18.2 (unacknowledged, acknowledged, returned to normal, shelved, closed), and says what is to be kept and who is to
//! be told. Values, states and events share the one model: what merely happened is an alert that returned at once.
//!
//! ```
//! use mission::alert::{AlertKind, Alerts, Condition, Policy};
//! use mission::{Level, MonoUs, Now, UtcUs};
//! let at = |s: u64| Now { mono: MonoUs(s * 1_000_000), utc: UtcUs(s as i64 * 1_000_000) };
//! let mut alerts = Alerts::new(Policy::default(), Vec::new(), 0, at(0));
//! let hot = Condition::new(AlertKind::Limit, "pixelsat-1 heartbeat.temp", Level::Warning, "61 is above 60");
//! alerts.observe(at(1), std::slice::from_ref(&hot));
//! alerts.observe(at(2), &[hot]);
//! assert_eq!(alerts.open().count(), 1);
//! ```
//!
//! What it does **not** do: read a clock, a disk or a database, send anything, or decide what a value's limits are
//! (`limits` does). The shell keeps what it says *before* it sends.

mod condition;
mod judge;
mod machine;
mod model;
mod notice;
mod operator;
mod policy;
mod quiet;
mod retry;

#[cfg(test)]
mod tests;

pub use condition::{AlertKind, Condition};
pub use judge::{LimitSeen, PassSeen, Surroundings, judge, next_judgement};
pub use machine::{Alerts, Changes};
pub use model::{Alert, AlertState, Shelf, Signed, Told};
pub use notice::{Notice, NoticeKind};
pub use operator::ActionError;
pub use policy::{Escalation, Policy, Rule, TargetPolicy, Thresholds};
pub use quiet::{QuietHours, QuietHoursError};
pub use retry::{GIVE_UP_US, retry_at};
