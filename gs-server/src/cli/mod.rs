//! The command line: `gs-server VERB`. Each verb is one file: its arguments, its help, what it prints.
//!
//! What a script may read goes to standard output (with `--json` as one object, or one object a line); everything said
//! to a person besides goes to standard error. Exit codes are those of [`Exit`], explained in `docs/cli.md`.

mod alert;
mod approve;
mod archive;
mod audit;
mod backup;
mod config;
mod decode;
mod demo;
mod doctor;
mod downlink;
mod ears;
mod elements;
mod export;
mod failure;
mod fit;
mod forward;
mod hold;
mod import;
mod key;
mod look;
mod openapi;
mod passes;
mod plan;
mod plans;
mod radio;
mod redecode;
mod rehearse;
mod report;
mod rig;
mod rotator;
mod runs;
mod schedule;
mod serve;
mod shell;
mod sky;
mod token;
mod twin;
mod user;

pub use failure::{Exit, Failure};

use std::sync::Arc;

use clap::{Parser, Subcommand};

/// Ground station and mission control for CubeSats that talk LoRa: the server, a satellite to practise on, and tools.
#[derive(Debug, Parser)]
#[command(
    name = "gs-server",
    version,
    max_term_width = 100,
    arg_required_else_help = true,
    subcommand_required = true,
    after_help = "Exit codes: 0 done, 1 failed or found nothing, 2 wrong usage, 3 refused. Every verb has --help.\n\
                  First contact: gs-server demo"
)]
pub struct Cli {
    /// What to log to standard error: a level, or `info,gs_server::links=debug`; also GS_LOG
    #[arg(
        long,
        global = true,
        value_name = "FILTER",
        env = "GS_LOG",
        hide_env_values = true,
        help_heading = "Logging"
    )]
    pub log: Option<String>,
    /// Log one JSON object a line
    #[arg(long, global = true, help_heading = "Logging")]
    pub log_json: bool,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run the station: links, engine, store, API and page
    Serve(serve::Serve),
    /// Check a configuration, or print an example of one
    #[command(subcommand)]
    Config(config::Config),
    /// Watch a simulated satellite pass, with everything real but the satellite
    Demo(demo::Demo),
    /// The simulated satellite alone, for any ground software
    #[command(subcommand)]
    Twin(twin::Twin),
    /// Decode a capture: frames in, JSON out; no key needed
    Decode(decode::Decode),
    /// Passes of satellites over stations, from a file of elements
    Passes(passes::Passes),
    /// Where satellites stand at instants, from a file of elements
    Look(look::Look),
    /// Print the OpenAPI document of the API
    Openapi(openapi::Openapi),
    /// The radio module by hand
    #[command(subcommand)]
    Radio(radio::Radio),
    /// Elements: give them, list them, fetch them, check a file, make some before launch
    #[command(subcommand)]
    Elements(elements::Elements),
    /// Plans: what to do in a pass. Begin one, check it, hand it over, attach it, arm it
    #[command(subcommand)]
    Plan(plan::Plan),
    /// Send a plan through its coming pass many times in simulation, and tell what to expect
    Rehearse(rehearse::Rehearse),
    /// When the satellite should send its picture to stations of the public network
    #[command(subcommand)]
    Downlink(downlink::Downlink),
    /// How late a satellite is against its elements, from the frequencies at which stations heard it
    Fit(fit::Fit),
    /// Which plan gets which pass of the coming two days, and why
    Schedule(schedule::Schedule),
    /// What became of plans in passes, or the report of one
    Runs(runs::Runs),
    /// Take a satellite over from the plan that runs
    Hold(hold::Hold),
    /// Give a satellite back to its plan
    Release(hold::Release),
    /// Alerts: what is wrong, who knows of it, who is told
    #[command(subcommand, visible_alias = "alerts")]
    Alert(alert::Alert),
    /// What is passed on to SatNOGS DB and others, and how it stands
    #[command(subcommand)]
    Forward(forward::Forward),
    /// What a pass brought, what the next shift must know, what a month came to
    #[command(subcommand)]
    Report(report::Report),
    /// The antenna's rotator by hand, through rotctld
    #[command(subcommand)]
    Rotator(rotator::Rotator),
    /// A rig by hand, through rigctld
    #[command(subcommand)]
    Rig(rig::Rig),
    /// Make and list key files; their bytes are never printed
    #[command(subcommand)]
    Key(key::Key),
    /// Who did what, and whether the record of it is whole
    #[command(subcommand)]
    Audit(audit::Audit),
    /// Look whether this machine is fit for its configuration, and say what to do
    Doctor(doctor::Doctor),
    /// Copy the archive while the server runs, or check such a copy
    Backup(backup::Backup),
    /// Make a data folder out of a backup
    Restore(backup::Restore),
    /// Who may come in: users, their roles and one-time links
    #[command(subcommand)]
    User(user::User),
    /// Tokens of machines
    #[command(subcommand)]
    Token(token::Token),
    /// What waits for a second person
    Approvals(approve::Approvals),
    /// Say yes to what another person asked for
    Approve(approve::Approve),
    /// Say no to it, or take back what one asked for oneself
    Refuse(approve::Refuse),
    /// Who hears the satellite, and how the ways in for what others heard work
    Ears(ears::ListEars),
    /// Bring in what others heard: files of TinyGS, SatNOGS, KISS, hex
    Import(import::Import),
    /// Write receptions out: what others reported, what our own stations heard
    Export(export::Export),
    /// Derive every value again from the raw frames
    Redecode(redecode::Redecode),
}

impl Cli {
    /// What to log and how: `--log` and GS_LOG go before the configuration; without any, the verbs that serve tell what
    /// they do, and the tools only what is wrong.
    pub fn log_settings(&self) -> LogSettings {
        let (filter, json) = match &self.command {
            // A configuration that is none is complained about where it is used.
            Command::Serve(serve) => match crate::config::Config::load(&serve.config) {
                Ok(config) => (config.log.filter, config.log.json),
                Err(_) => ("info".to_owned(), false),
            },
            _ => ("warn".to_owned(), false),
        };
        LogSettings { filter: self.log.clone().unwrap_or(filter), json: self.log_json || json }
    }

    /// Does what was asked. `set_log_filter` changes what the global logger logs.
    ///
    /// # Errors
    /// [`Failure`], with the exit code that goes with it.
    pub fn run(self, set_log_filter: SetLogFilter) -> Result<Exit, Failure> {
        match self.command {
            Command::Serve(serve) => serve.run(set_log_filter),
            Command::Config(config) => config.run(),
            Command::Demo(demo) => demo.run(),
            Command::Twin(twin) => twin.run(),
            Command::Decode(decode) => decode.run(),
            Command::Passes(passes) => passes.run(),
            Command::Look(look) => look.run(),
            Command::Openapi(openapi) => openapi.run(),
            Command::Radio(radio) => radio.run(),
            Command::Alert(alert) => alert.run(),
            Command::Forward(forward) => forward.run(),
            Command::Rotator(rotator) => rotator.run(),
            Command::Rig(rig) => rig.run(),
            Command::Elements(elements) => elements.run(),
            Command::Key(key) => key.run(),
            Command::Plan(plan) => plan.run(),
            Command::Rehearse(rehearse) => rehearse.run(),
            Command::Downlink(downlink) => downlink.run(),
            Command::Fit(fit) => fit.run(),
            Command::Schedule(schedule) => schedule.run(),
            Command::Runs(runs) => runs.run(),
            Command::Audit(audit) => audit.run(),
            Command::Doctor(doctor) => doctor.run(),
            Command::Backup(backup) => backup.run(),
            Command::Restore(restore) => restore.run(),
            Command::Hold(hold) => hold.run(),
            Command::Release(release) => release.run(),
            Command::User(user) => user.run(),
            Command::Token(token) => token.run(),
            Command::Approvals(approvals) => approvals.run(),
            Command::Approve(approve) => approve.run(),
            Command::Refuse(refuse) => refuse.run(),
            Command::Report(report) => report.run(),
            Command::Ears(ears) => ears.run(),
            Command::Import(import) => import.run(),
            Command::Export(export) => export.run(),
            Command::Redecode(redecode) => redecode.run(),
        }
    }
}

/// What the one global logger is set to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogSettings {
    /// A filter of `tracing`.
    pub filter: String,
    /// One JSON object a line.
    pub json: bool,
}

/// Changes the filter of the global logger, which only `main` has.
pub type SetLogFilter = Arc<dyn Fn(&str) + Send + Sync>;

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn arguments_contradict_nowhere() {
        Cli::command().debug_assert();
    }
}
