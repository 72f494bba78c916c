//! Reports: what a pass brought, what the next shift must know, what a month came to.
//!
//! A report is first a plain value ([`api::PassReport`], ...), derived from the archive when somebody asks and never
//! stored there, then a [`Document`] of headings, tables and plots, and last a page or a text. Whatever came from
//! outside (names, reasons, messages) is escaped in the two writers, and nowhere else.
//!
//! | file | what it holds |
//! |---|---|
//! | `pass` | [`pass_report`]: the archive to [`api::PassReport`] |
//! | `handover`, `month` | [`handover_report`], [`month_report`] |
//! | `next_steps` | what somebody should do after a pass |
//! | `orbit` | where the satellite stood, and when it comes again |
//! | `runs` | runs of plans in the words of the API |
//! | `document` | [`Document`]: what a report says, without its form |
//! | `words`, `summary_words` | [`pass_document`], [`handover_document`], [`month_document`]: reports in words |
//! | `plots` | strength over time and over elevation |
//! | `html`, `markdown` | the two forms |
//! | `file`, `task` | a page and a text of each pass, a minute after its LOS |
//!
//! What it does **not** do: know HTTP or SQL, read a clock.

mod document;
mod file;
mod handover;
mod html;
mod markdown;
mod month;
mod next_steps;
mod orbit;
mod pass;
mod plots;
mod runs;
mod summary_words;
mod task;
mod words;

#[cfg(test)]
mod tests;

pub use document::Document;
pub use file::{file_name, write_pass};
pub use handover::handover_report;
pub use html::{Style, html};
pub use markdown::markdown;
pub use month::{Month, MonthError, month_report};
pub use pass::{AFTER_LOS_US, pass_report};
pub(crate) use runs::{run_view, step_report};
pub use summary_words::{handover_document, month_document};
pub use task::ReportTask;
pub use words::pass_document;
