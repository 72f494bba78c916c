//! Plans: what to do in a pass, whether it can be done, and the machine that does it.
//!
//! | module | idea |
//! | --- | --- |
//! | [`step`] | a [`Plan`] and its steps, as typed values |
//! | [`condition`] | what must hold before a step begins |
//! | [`approval`] | who allowed a critical command beforehand, and exactly which |
//! | [`rule`] | which passes a plan attaches itself to |
//! | [`need`] | the least time that a plan takes |
//! | [`mod@check`] | everything that is wrong with a plan, each with its place and remedy |
//! | [`view`] | what the machine sees, and what it wishes |
//! | [`progress`] | how far a run has come: a plain value that outlives the process |
//! | [`run`] | the machine: [`PlanRun`] |
//!
//! All of it is pure: no clock, no I/O, no randomness. How a plan is written (TOML, JSON) is the shell's business.

pub mod approval;
pub mod check;
pub mod condition;
pub mod need;
pub mod progress;
pub mod rule;
pub mod run;
pub mod step;
pub mod view;

pub use approval::Approval;
pub use check::{CheckContext, Finding, PassShape, Severity, check};
pub use condition::{Condition, Guard, Holds, Op, Reading};
pub use progress::{Ask, Frame, Progress, RunEnd, StepEnd, StepResult, Ticket};
pub use rule::{AttachRule, Hours, NoMatch, PassFacts};
pub use run::PlanRun;
pub use step::{Action, AtLos, MinPass, OnFailure, Ordinal, Plan, Send, Step};
pub use view::{AskState, ContactWindow, DownloadView, RunView, Wish};
