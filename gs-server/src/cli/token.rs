//! `gs-server token new|list|revoke`: tokens of machines, asked of the running server.

use api::{Nothing, Page, TokenMade, TokenRequest, TokenView};
use clap::{Args, Subcommand};

use super::elements::Of;
use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::people::Right;

/// `gs-server token`.
#[derive(Debug, Subcommand)]
pub enum Token {
    /// Make one: it is printed once and kept nowhere
    New(New),
    /// Which there are
    List(List),
    /// End its use, at once and for ever
    Revoke(Revoke),
}

impl Token {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::New(verb) => verb.run(),
            Self::List(verb) => verb.run(),
            Self::Revoke(verb) => verb.run(),
        }
    }
}

/// `gs-server token new`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server token new --config station.toml grafana --scope look --days 365
  gs-server token new --config station.toml night-script --scope look,command --days 30 --owner verma

Scopes: look, command, critical, plan, approve, manage-station, manage-people. With an owner the token
may do what both allow, and ends with the owner. Only a token with an owner can approve.")]
pub struct New {
    #[command(flatten)]
    of: Of,
    /// 1 to 32 of a-z, 0-9, - and _; never used again
    #[arg(value_name = "NAME")]
    name: String,
    /// What it may do
    #[arg(long, value_name = "SCOPE", required = true, value_delimiter = ',')]
    scope: Vec<Right>,
    /// For how long
    #[arg(long, value_name = "N")]
    days: u32,
    /// The user who answers for it
    #[arg(long, value_name = "USER")]
    owner: Option<String>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl New {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let request = TokenRequest {
            name: self.name,
            scopes: self.scope.iter().map(|right| right.name().to_owned()).collect(),
            days: self.days,
            owner: self.owner,
        };
        let made: TokenMade = runtime()?.block_on(remote.make("tokens", &request)).map_err(failure)?;
        if self.json {
            print_json(&made)?;
            return Ok(Exit::Done);
        }
        print_line(&made.secret)?;
        eprintln!(
            "gs-server: token {} is good until {}; this is the only time that it is shown",
            made.token.name,
            minute(made.token.expires_at)
        );
        Ok(Exit::Done)
    }
}

/// `gs-server token list`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server token list --config station.toml")]
pub struct List {
    #[command(flatten)]
    of: Of,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Listed {
    tokens: Vec<TokenView>,
}

impl List {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let page: Page<TokenView> = runtime()?.block_on(remote.get("tokens", &[])).map_err(failure)?;
        if self.json {
            print_json(&Listed { tokens: page.items })?;
            return Ok(Exit::Done);
        }
        if page.items.is_empty() {
            eprintln!("gs-server: there is no token; `gs-server token new` makes one");
            return Ok(Exit::Done);
        }
        print_line(format_args!("{:<32} {:<20} {:<18} scopes", "token", "owner", "good until"))?;
        for token in &page.items {
            let until = match token.revoked_at {
                Some(at) => format!("revoked {}", minute(at)),
                None => minute(token.expires_at),
            };
            let owner = token.owner.as_deref().unwrap_or("-");
            print_line(format_args!(
                "{:<32} {owner:<20} {until:<18} {}",
                token.name,
                token.scopes.join(" ")
            ))?;
        }
        Ok(Exit::Done)
    }
}

/// `gs-server token revoke`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server token revoke --config station.toml night-script")]
pub struct Revoke {
    #[command(flatten)]
    of: Of,
    /// Which
    #[arg(value_name = "NAME")]
    name: String,
}

impl Revoke {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let path = format!("tokens/{}", self.name);
        runtime()?.block_on(remote.take_back::<Nothing>(&path)).map_err(failure)?;
        print_line(format_args!("token {} is revoked", self.name))?;
        Ok(Exit::Done)
    }
}
