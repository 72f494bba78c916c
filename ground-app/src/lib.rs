//! The operator's desktop app: one window on a server and its satellites, or on a server and a simulated satellite that
//! it carries inside itself.
//!
//! | part | idea |
//! | --- | --- |
//! | `args` | the command line |
//! | `clock` | the one file that reads this machine's time |
//! | [`link`] | the network thread: the stream, questions, answers that come later |
//! | [`model`] | what is known of the server: plain values with their age |
//! | [`desk`] | what the operator has arranged: layout, theme, drafts; kept in one file |
//! | `bars` | the frame that is the same on every layout |
//! | [`keys`] | what keys do: one table for the window, the palette and the list under `?` |
//! | [`palette`] | whatever can be done, found by typing |
//! | [`panes`] | what can be docked: one file each |
//! | [`app`] | the window: keys, bars, panes |
//! | [`orbit`] | where the satellite is, computed here |
//! | `embedded` | the server and the satellite inside |

pub mod app;
pub mod args;
mod bars;
pub mod clock;
pub mod desk;
#[cfg(feature = "embedded")]
pub mod embedded;
mod help;
pub mod keys;
pub mod link;
pub mod model;
pub mod orbit;
pub mod palette;
pub mod panes;

pub use app::App;
