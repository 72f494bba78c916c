//! What keeps a server running for years: backups, metrics, looking after the machine.
//!
//! | module | what it holds |
//! |---|---|
//! | [`backup`] | taking, verifying and restoring backups |
//! | [`metrics`] | what is counted while the server runs |
//! | [`disk`] | how long the disk will do |
//! | [`upkeep`] | the task that looks at the disk, takes backups, removes what may go |
//! | [`sd`] | what systemd wants to hear |
//! | [`doctor`] | whether a machine is fit for its configuration |

pub mod backup;
pub mod disk;
pub mod doctor;
pub mod metrics;
pub mod sd;
pub mod upkeep;
