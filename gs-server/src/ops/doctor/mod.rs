//! `gs-server doctor`: is this machine fit to run this station, and if not, what to do.
//!
//! Each check tells what it found, and a remedy when that is not good. Nothing is changed, nothing is radiated, no port is
//! opened; a server may be running.

mod ears;
mod machine;
mod network;
mod postgres;
mod state;

use std::path::Path;

use mission::{Clock as _, UtcUs};
use serde::Serialize;

use crate::clock::SystemClock;
use crate::config::Config;

/// How much anybody should care.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// All is well.
    Ok,
    /// Works, and is worth an eye.
    Watch,
    /// Will not work, or not for long.
    Warning,
}

impl Verdict {
    /// The word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Watch => "watch",
            Self::Warning => "warning",
        }
    }
}

/// What one check found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Which check, a word or two.
    pub check: String,
    /// How it stands.
    pub verdict: Verdict,
    /// What was found, as a sentence.
    pub found: String,
    /// What to do, when it is not good.
    pub remedy: Option<String>,
}

impl Finding {
    fn ok(check: impl Into<String>, found: impl Into<String>) -> Self {
        Self { check: check.into(), verdict: Verdict::Ok, found: found.into(), remedy: None }
    }

    fn watch(check: impl Into<String>, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        let remedy = Some(remedy.into());
        Self { check: check.into(), verdict: Verdict::Watch, found: found.into(), remedy }
    }

    fn warning(check: impl Into<String>, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        let remedy = Some(remedy.into());
        Self { check: check.into(), verdict: Verdict::Warning, found: found.into(), remedy }
    }
}

/// Does all checks, in an order in which later ones rest on earlier ones.
pub async fn examine(file: &Path) -> Vec<Finding> {
    let mut findings = vec![machine::version()];
    let config = match Config::load(file).and_then(|config| config.check().map(|()| config)) {
        Ok(config) => config,
        Err(error) => {
            let remedy = "Mend the file; `gs-server config example` prints one that is explained.";
            findings.push(Finding::warning("configuration", with_reasons(&error), remedy));
            return findings;
        }
    };
    let told = format!(
        "{}: station {}, {} satellites, {} links{}",
        file.display(),
        config.station.name,
        config.satellites.len(),
        config.links.len(),
        if config.is_simulated() { ", simulated" } else { "" },
    );
    findings.push(Finding::ok("configuration", told));
    let now = SystemClock::new().now().utc;
    findings.extend(machine::keys(&config));
    findings.push(machine::clock(&config).await);
    let holder = state::holder(&config);
    findings.extend(state::folder(&config));
    findings.extend(state::database(&config, now).await);
    findings.extend(machine::backups(&config, now));
    findings.extend(machine::ports(&config, holder.is_some()));
    findings.extend(network::daemons(&config).await);
    findings.extend(ears::ways(&config, holder.is_some(), now).await);
    findings.extend(network::server(&config, holder).await);
    findings
}

/// An error with all its reasons.
fn with_reasons(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string().trim_end().replace('\n', " ");
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_text = cause.to_string();
        if !text.contains(&cause_text) {
            text.push_str(": ");
            text.push_str(&cause_text);
        }
        source = cause.source();
    }
    text
}

fn days(since: UtcUs, now: UtcUs) -> f64 {
    (now.0 - since.0) as f64 / 86_400e6
}
