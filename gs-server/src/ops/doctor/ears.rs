//! Ways in over the network: is each configured so that it can work, is its other side there, when did it bring anything.

use std::collections::BTreeMap;

use mission::UtcUs;
use reqwest::Url;
use tokio::net::{TcpListener, TcpStream};

use super::network::PATIENCE;
use super::{Finding, days};
use crate::clock::within;
use crate::config::{Config, EarKind, EarSection};
use crate::storage::{Archive, utc};

/// Nothing for so long is worth a look, days.
const SILENT_DAYS: f64 = 7.0;

/// Nothing is asked of anybody's API: that somebody listens there is all that is looked at.
pub(super) async fn ways(config: &Config, is_running: bool, now: UtcUs) -> Vec<Finding> {
    let heard = if config.ears.is_empty() { BTreeMap::new() } else { heard(config).await };
    let mut findings = Vec::new();
    for section in &config.ears {
        let check = format!("ear {}", section.name);
        findings.push(match way(section, is_running).await {
            Ok(found) => judged(check, &found, heard.get(source(section.kind)).copied(), now),
            Err((found, remedy)) => Finding::warning(check, found, remedy),
        });
    }
    findings
}

/// Under which source its reports are in the archive.
const fn source(kind: EarKind) -> &'static str {
    match kind {
        EarKind::Mqtt | EarKind::Broker => "own-mqtt",
        EarKind::TinygsApi => "tinygs-api",
        EarKind::SatnogsDb => "satnogs",
    }
}

async fn heard(config: &Config) -> BTreeMap<String, i64> {
    let Ok(postgres) = crate::run::postgres(config) else { return BTreeMap::new() };
    let archive = Archive { folder: config.storage.folder.clone(), postgres };
    // What is wrong with the archive is told of the database.
    archive.heard_by_source().await.unwrap_or_default()
}

fn judged(check: String, found: &str, heard_us: Option<i64>, now: UtcUs) -> Finding {
    let Some(heard_us) = heard_us else {
        return Finding::ok(check, format!("{found}; nothing came by its kind yet"));
    };
    let silent_days = days(UtcUs(heard_us), now);
    let found = format!("{found}; the last report of its kind came {}", utc(heard_us));
    if silent_days < SILENT_DAYS {
        return Finding::ok(check, found);
    }
    let remedy =
        "`gs-server ears` and GET /api/v1/ears/ways tell how it works; docs/ears.md tells what may be wrong.";
    Finding::watch(check, format!("{found}, {silent_days:.0} days ago"), remedy)
}

/// What it is and that it can work; or why not, and what to do.
async fn way(section: &EarSection, is_running: bool) -> Result<String, (String, String)> {
    let boards = section.boards.iter().map(|board| &board.password_file);
    for file in section.password_file.iter().chain(&section.token_file).chain(boards) {
        crate::ways::secret(file).await.map_err(|why| {
            (why, "Write it in there, as a file of mode 0600 that the server's user owns.".to_owned())
        })?;
    }
    let kind = section.kind.name();
    if section.kind == EarKind::Broker {
        let listen = section.listen();
        if is_running {
            let there = within(PATIENCE, TcpStream::connect(listen)).await.is_some_and(|there| there.is_ok());
            return if there {
                Ok(format!("{kind} listens at {listen}"))
            } else {
                let remedy =
                    "Was the server started with this configuration? Restart it, or look in its log.";
                Err((format!("the server runs, and nobody listens at {listen}"), remedy.to_owned()))
            };
        }
        return match TcpListener::bind(listen).await {
            Ok(_) => Ok(format!("{kind} at {listen}, which is free")),
            Err(error) => {
                let remedy = "Stop what listens there (`ss -ltnp`), or give another listen.";
                Err((format!("{kind} cannot listen at {listen}: {error}"), remedy.to_owned()))
            }
        };
    }
    let url = Url::parse(section.url()).ok();
    let host = url.as_ref().and_then(|url| Some(url.host_str()?.trim_matches(['[', ']']).to_owned()));
    let port = url.as_ref().and_then(|url| match url.scheme() {
        "mqtt" => url.port().or(Some(1883)),
        "mqtts" => url.port().or(Some(8883)),
        _ => url.port_or_known_default(),
    });
    let (Some(host), Some(port)) = (host, port) else {
        return Err((format!("its url '{}' names no host", section.url()), "Correct url.".to_owned()));
    };
    let remedy = || "Is url right, is there a network, and no firewall between?".to_owned();
    match within(PATIENCE, TcpStream::connect((host.as_str(), port))).await {
        Some(Ok(_)) => Ok(format!("{kind}: {host} answers at port {port}")),
        Some(Err(error)) => {
            Err((format!("{kind}: {host} does not answer at port {port}: {error}"), remedy()))
        }
        None => Err((format!("{kind}: {host} does not answer at port {port} within 3 s"), remedy())),
    }
}
