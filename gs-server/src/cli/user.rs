//! `gs-server user add|list|link|change`: people, asked of the running server.

use api::{LinkMade, Nothing, Page, UserChange, UserRequest, UserView};
use clap::{Args, Subcommand};

use super::elements::Of;
use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::config::Config;
use crate::people::Role;

/// `gs-server user`.
#[derive(Debug, Subcommand)]
pub enum User {
    /// Let somebody in: prints a one-time link
    Add(Add),
    /// Who there is
    List(List),
    /// A new one-time link: password forgotten, or the first administrator
    Link(Link),
    /// Another role, call sign or licence; shut somebody out, or let in again
    Change(Change),
}

impl User {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        match self {
            Self::Add(verb) => verb.run(),
            Self::List(verb) => verb.run(),
            Self::Link(verb) => verb.run(),
            Self::Change(verb) => verb.run(),
        }
    }
}

/// The address of the page that a link opens.
fn address(config: &Config, made: &LinkMade) -> String {
    let host = match config.http.allowed_hosts.first() {
        Some(host) if config.http.https => host.clone(),
        _ => config.http.listen.to_string(),
    };
    let scheme = if config.http.https { "https" } else { "http" };
    format!("{scheme}://{host}{}", made.link)
}

fn tell(config: &Config, made: &LinkMade, json: bool) -> Result<Exit, Failure> {
    if json {
        print_json(made)?;
        return Ok(Exit::Done);
    }
    print_line(address(config, made))?;
    eprintln!(
        "gs-server: good once, until {}; whoever opens it sets the password. Hand it over as you would a key",
        minute(made.expires_at)
    );
    Ok(Exit::Done)
}

/// `gs-server user add`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server user add --config station.toml verma --role operator --call-sign DL0ABC
  gs-server user add --config station.toml guest --role viewer

Roles: viewer looks; operator commands and plans; mission-lead approves and settles keys too;
administrator lets people in. The printed link sets the password; there is no default one.")]
pub struct Add {
    #[command(flatten)]
    of: Of,
    /// 1 to 32 of a-z, 0-9, - and _
    #[arg(value_name = "NAME")]
    name: String,
    /// viewer, operator, mission-lead or administrator
    #[arg(long, value_name = "ROLE")]
    role: Role,
    /// Amateur radio call sign: stands in the record of what this person sends
    #[arg(long, value_name = "SIGN")]
    call_sign: Option<String>,
    /// The licence in words, e.g. its class
    #[arg(long, value_name = "TEXT")]
    licence: Option<String>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Add {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        let remote = server(&config)?;
        let request = UserRequest {
            name: self.name.clone(),
            role: self.role.name().to_owned(),
            call_sign: self.call_sign,
            licence: self.licence,
        };
        let made = runtime()?.block_on(async {
            remote.make::<UserView>("users", &request).await?;
            remote.make::<LinkMade>(&format!("users/{}/link", self.name), &Nothing {}).await
        });
        tell(&config, &made.map_err(failure)?, self.json)
    }
}

/// `gs-server user list`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server user list --config station.toml
  gs-server user list --config station.toml --json | jq '.users[].name'")]
pub struct List {
    #[command(flatten)]
    of: Of,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Listed {
    users: Vec<UserView>,
}

impl List {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let page: Page<UserView> = runtime()?.block_on(remote.get("users", &[])).map_err(failure)?;
        if self.json {
            print_json(&Listed { users: page.items })?;
            return Ok(Exit::Done);
        }
        if page.items.is_empty() {
            eprintln!(
                "gs-server: nobody is let in yet; `gs-server user link` makes the first administrator's link"
            );
            return Ok(Exit::Done);
        }
        print_line(format_args!(
            "{:<32} {:<14} {:<10} {:<24} state",
            "user", "role", "call sign", "licence"
        ))?;
        for user in &page.items {
            let state = match (user.disabled, user.has_password, user.sessions) {
                (true, ..) => "disabled".to_owned(),
                (_, false, _) => "has not come yet".to_owned(),
                (_, _, sessions) => format!("{sessions} sessions"),
            };
            print_line(format_args!(
                "{:<32} {:<14} {:<10} {:<24} {state}",
                user.name,
                user.role,
                user.call_sign.as_deref().unwrap_or("-"),
                user.licence.as_deref().unwrap_or("-"),
            ))?;
        }
        Ok(Exit::Done)
    }
}

/// `gs-server user link`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server user link --config station.toml verma
  gs-server user link --config station.toml

Without a name: the link that makes the first administrator, while there is no user. A new link
spends the older ones of the same user; using it ends the user's sessions.")]
pub struct Link {
    #[command(flatten)]
    of: Of,
    /// Whose
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

impl Link {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let config = self.of.load()?;
        let remote = server(&config)?;
        let path = self.name.map_or_else(|| "welcome/link".to_owned(), |name| format!("users/{name}/link"));
        let made = runtime()?.block_on(remote.make::<LinkMade>(&path, &Nothing {}));
        tell(&config, &made.map_err(failure)?, self.json)
    }
}

/// `gs-server user change`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server user change --config station.toml verma --role mission-lead
  gs-server user change --config station.toml verma --call-sign DL0ABC --licence 'class A, BNetzA'
  gs-server user change --config station.toml guest --disable

Whoever is disabled has no session and no token any more, at once. Names are kept: records name them.")]
pub struct Change {
    #[command(flatten)]
    of: Of,
    /// Whom
    #[arg(value_name = "NAME")]
    name: String,
    /// viewer, operator, mission-lead or administrator
    #[arg(long, value_name = "ROLE")]
    role: Option<Role>,
    /// Another call sign; '' for none
    #[arg(long, value_name = "SIGN")]
    call_sign: Option<String>,
    /// Another licence; '' for none
    #[arg(long, value_name = "TEXT")]
    licence: Option<String>,
    /// Shut out
    #[arg(long)]
    disable: bool,
    /// Let in again
    #[arg(long, conflicts_with = "disable")]
    enable: bool,
}

impl Change {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = server(&self.of.load()?)?;
        let change = UserChange {
            role: self.role.map(|role| role.name().to_owned()),
            call_sign: self.call_sign,
            licence: self.licence,
            disabled: match (self.disable, self.enable) {
                (true, _) => Some(true),
                (_, true) => Some(false),
                _ => None,
            },
        };
        if change == UserChange::default() {
            return Err(Failure::usage(
                "nothing is to change: give --role, --call-sign, --licence, --disable or --enable",
            ));
        }
        let path = format!("users/{}", self.name);
        let user: UserView = runtime()?.block_on(remote.make(&path, &change)).map_err(failure)?;
        let state = if user.disabled { ", disabled" } else { "" };
        print_line(format_args!("user {} is {}{state}", user.name, user.role))?;
        Ok(Exit::Done)
    }
}
