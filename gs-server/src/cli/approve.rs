//! `gs-server approvals|approve|refuse`: the two-person rule, asked of the running server.

use std::path::PathBuf;

use api::{ApprovalView, ApproveRequest, Outcome, Page, RefuseRequest};
use clap::Args;

use super::elements::Of;
use super::plans::{failure, minute, server};
use super::shell::{print_json, print_line, runtime};
use super::{Exit, Failure};
use crate::elements::Remote;
use crate::http::Token;

/// Characters of a digest that tell one thing from another.
const DIGEST_MIN: usize = 8;

/// As whom.
#[derive(Debug, Args)]
struct As {
    #[command(flatten)]
    of: Of,
    /// A 0600 file with a token of yours; else the server's own is used, which is nobody's and cannot approve
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
}

impl As {
    fn server(&self) -> Result<Remote, Failure> {
        let remote = server(&self.of.load()?)?;
        match &self.token_file {
            Some(file) => Ok(remote.with_token(Token::load(file).map_err(Failure::refused)?)),
            None => Ok(remote),
        }
    }
}

/// `gs-server approvals`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server approvals --config station.toml
  gs-server approvals --config station.toml --all --json

What is critical waits here for a second person when the configuration says people.two_person = \"critical\".")]
pub struct Approvals {
    #[command(flatten)]
    by: As,
    /// What was decided or is over, too
    #[arg(long)]
    all: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Listed {
    approvals: Vec<ApprovalView>,
}

impl Approvals {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = self.by.server()?;
        let query = [("open", (!self.all).to_string()), ("limit", "1000".to_owned())];
        let page: Page<ApprovalView> =
            runtime()?.block_on(remote.get("approvals", &query)).map_err(failure)?;
        if self.json {
            print_json(&Listed { approvals: page.items })?;
            return Ok(Exit::Done);
        }
        if page.items.is_empty() {
            eprintln!("gs-server: nothing waits for a second person");
        }
        for approval in &page.items {
            print_line(format_args!(
                "{} {} by {}, asked by {}, until {}: {}",
                approval.id,
                approval.digest.get(..16).unwrap_or_default(),
                approval.state,
                approval.person,
                minute(approval.expires_at),
                approval.summary,
            ))?;
        }
        Ok(Exit::Done)
    }
}

/// `gs-server approve`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server approve --config station.toml --token-file ~/.config/pixelsat/token 7 4b1f09c2a6d83e57

The digest is what `gs-server approvals` shows: you approve exactly that. Nobody approves what the same
person asked for.")]
pub struct Approve {
    #[command(flatten)]
    by: As,
    /// Its number
    #[arg(value_name = "NUMBER")]
    id: u64,
    /// What was looked at: the digest, or its first 8 characters or more
    #[arg(value_name = "DIGEST")]
    digest: String,
}

impl Approve {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = self.by.server()?;
        if self.digest.len() < DIGEST_MIN {
            return Err(Failure::usage(format!("digest: give at least its first {DIGEST_MIN} characters")));
        }
        let path = format!("approvals/{}", self.id);
        let outcome = runtime()?.block_on(async {
            let approval: ApprovalView = remote.get(&path, &[]).await.map_err(failure)?;
            if !approval.digest.starts_with(&self.digest.to_ascii_lowercase()) {
                let told = format!(
                    "number {} is something else than {}: {}",
                    self.id, self.digest, approval.summary
                );
                return Err(Failure::refused(told));
            }
            let request = ApproveRequest { digest: approval.digest };
            remote.make::<Outcome>(&format!("{path}/approve"), &request).await.map_err(failure)
        })?;
        match outcome.command {
            Some(command) => print_line(format_args!("number {} is approved: command {command}", self.id))?,
            None => print_line(format_args!("number {} is approved", self.id))?,
        }
        Ok(Exit::Done)
    }
}

/// `gs-server refuse`.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  gs-server refuse --config station.toml --token-file ~/.config/pixelsat/token 7 --why 'wrong mode'

Whoever asked may take it back in the same way.")]
pub struct Refuse {
    #[command(flatten)]
    by: As,
    /// Its number
    #[arg(value_name = "NUMBER")]
    id: u64,
    /// Why
    #[arg(long, value_name = "TEXT")]
    why: Option<String>,
}

impl Refuse {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let remote = self.by.server()?;
        let path = format!("approvals/{}/refuse", self.id);
        let request = RefuseRequest { why: self.why };
        let approval: ApprovalView = runtime()?.block_on(remote.make(&path, &request)).map_err(failure)?;
        print_line(format_args!("number {} is {}", approval.id, approval.state))?;
        Ok(Exit::Done)
    }
}
