//! What is asked of the API of TinyGS: the newest packets of each name, and of each new one the stations that heard it.
//!
//! The list holds the newest packets only, 5 to 100 of them by its version, and was seen frozen for hours. So each look
//! takes all of it, older pages where the version has them, until it meets what is known; where it cannot, that is told.

use mission::UtcUs;
use mission::reception::Ear;
use reqwest::Url;
use serde_json::Value;

use super::rhythm::MINUTE_US;
use super::{Broken, Poller};

/// Older pages of one look.
const PAGES: usize = 10;
/// A look goes back behind what it knows by so much: packets come late.
const OVERLAP_US: i64 = 10 * MINUTE_US;
/// The list is suspected to be old when nothing new was in it for so long.
const SUSPECT_US: i64 = 60 * MINUTE_US;
/// The list is old when the satellite's page tells of packets newer by so much.
const STALE_US: i64 = 10 * MINUTE_US;
/// Stations report for a while: a packet is asked for so long after its time.
const SETTLED_US: i64 = 2 * MINUTE_US;
/// Packets that wait to be asked for, and such that were.
const WANTED_MOST: usize = 500;
const KNOWN_MOST: usize = 2_000;
/// Requests for stations in half an hour; never two in a minute.
const DETAILS_MOST: usize = 25;
const HALF_HOUR_US: i64 = 30 * MINUTE_US;
/// Requests that stations leave for lists.
const SPARE: u32 = 6;

/// What a look at the list of one name came to.
enum Found {
    /// All since the last look.
    All,
    /// Some may be missing, in words.
    Missed(String),
    /// There is no such list, in words.
    Nothing(String),
}

/// What a page of the list holds.
struct Listed {
    newest_us: i64,
    oldest_us: i64,
    /// Ids and times.
    packets: Vec<(String, i64)>,
}

impl Poller {
    pub(super) async fn look_at_tinygs(&mut self) -> Result<(), Broken> {
        let mut note = None;
        let mut is_stale = None;
        let mut nowhere = Vec::new();
        for name in self.names.clone() {
            match self.list(&name).await? {
                Found::Missed(missed) => note = Some(missed),
                Found::All => is_stale = self.is_old(&name).await?.or(is_stale),
                // The others are asked for first.
                Found::Nothing(words) => nowhere.push(words),
            }
        }
        if !nowhere.is_empty() {
            return Err(Broken::Failed(nowhere.join("; ")));
        }
        match is_stale {
            Some(words) => self.way.is_stale(words),
            None => {
                self.way.works();
                self.way.notes(note);
            }
        }
        Ok(())
    }

    fn at(&self, path: &str, query: &[(&str, &str)]) -> Result<Url, Broken> {
        let mut url = self.base.join(path).map_err(|error| Broken::Failed(error.to_string()))?;
        if !query.is_empty() {
            url.query_pairs_mut().extend_pairs(query);
        }
        Ok(url)
    }

    /// The packets of one name.
    async fn list(&mut self, name: &str) -> Result<Found, Broken> {
        let now = self.now();
        let met_us = self.state.newest_us.get(name).copied();
        let mut before: Option<i64> = None;
        let mut newest_us = met_us.unwrap_or(0);
        let mut missed = None;
        for page in 0..PAGES {
            let before_ms = before.map(|before_us| (before_us / 1_000).to_string());
            let mut query = vec![("satellite", name)];
            query.extend(before_ms.as_deref().map(|before| ("before", before)));
            let url = self.at("packets", &query)?;
            let Some(body) = self.ask(&url, 0).await? else {
                // Behind the last page; but the first one is there wherever the address and the name are right.
                if page > 0 {
                    break;
                }
                return Ok(Found::Nothing(format!(
                    "{url} is not there (404): there is no API at this address, or TinyGS has no packet under '{name}'. Look at url \
                     (it ends in the version, /v3/) and at names; before the first packet of a new satellite this is so, too"
                )));
            };
            let listed = listed(&body.bytes);
            // First what is whole, also of an answer that was cut; then what is wrong with it.
            let (outcome, ids) = self.take(Ear::TinygsApi, &body.bytes).await?;
            let Some(listed) = listed else {
                return Err(Broken::Failed(
                    "the answer is no list of packets, or was cut; what was whole of it is kept".into(),
                ));
            };
            if outcome.frames + outcome.merged + outcome.without_frame > 0 {
                self.state.fresh_at_us = Some(now.0);
            }
            self.want(&ids, &listed);
            if listed.packets.is_empty() {
                break;
            }
            newest_us = newest_us.max(listed.newest_us.min(now.0));
            let meets = met_us.is_none_or(|met| listed.oldest_us <= met - OVERLAP_US) && met_us.is_some();
            let is_last = before.is_some_and(|before| listed.oldest_us >= before);
            if meets || is_last {
                break;
            }
            let gap = met_us.is_some_and(|met| listed.oldest_us > met);
            if !self.section.paging || page + 1 == PAGES {
                if gap {
                    self.way.count("gaps");
                    missed = Some(format!(
                        "the list of {name} did not reach back to the last look: packets before {} may be missing. Look more often \
                         (near_pass_every_min), set paging = true where the API has it, or import a file",
                        api::Time::from_unix_us(listed.oldest_us)
                    ));
                }
                break;
            }
            before = Some(listed.oldest_us);
        }
        if newest_us > 0 {
            self.state.newest_us.insert(name.to_owned(), newest_us);
        }
        Ok(missed.map_or(Found::All, Found::Missed))
    }

    /// Remembers whose stations to ask for.
    fn want(&mut self, ids: &[String], listed: &Listed) {
        if self.section.details == Some(false) {
            return;
        }
        for (id, at_us) in &listed.packets {
            let is_new = ids.contains(id)
                && !self.state.known.contains(id)
                && !self.state.wanted.iter().any(|(wanted, _)| wanted == id);
            if is_new {
                self.state.wanted.push((id.clone(), at_us.saturating_add(SETTLED_US)));
            }
        }
        // The newest is asked for first; of too many the oldest go.
        self.state.wanted.sort_by_key(|(_, not_before_us)| *not_before_us);
        let over = self.state.wanted.len().saturating_sub(WANTED_MOST);
        self.state.wanted.drain(..over);
    }

    /// When the stations of a packet may be asked for; `None`: none is wanted.
    pub(super) fn detail_due(&self, now: UtcUs) -> Option<UtcUs> {
        let (_, not_before_us) = self.state.wanted.last()?;
        let recent = self.state.details_at_us.iter().filter(|at| now.0 - **at < HALF_HOUR_US);
        let mut due = (*not_before_us).min(now.0 + SETTLED_US).max(self.state.wait_until_us.unwrap_or(0));
        if let Some(last) = self.state.details_at_us.iter().max() {
            due = due.max(last + MINUTE_US);
        }
        if recent.clone().count() >= DETAILS_MOST {
            due = due.max(recent.min().copied().unwrap_or(now.0) + HALF_HOUR_US);
        }
        Some(UtcUs(due))
    }

    /// Asks for the stations of one packet.
    pub(super) async fn one_detail(&mut self) -> Result<(), Broken> {
        let Some((id, _)) = self.state.wanted.last().cloned() else { return Ok(()) };
        let now = self.now();
        self.state.details_at_us.retain(|at| now.0 - at < HALF_HOUR_US);
        self.state.details_at_us.push(now.0);
        let path = format!("packet/{id}");
        let done = match self.ask(&self.at(&path, &[])?, SPARE).await {
            Ok(Some(body)) => self.take(Ear::TinygsApi, &body.bytes).await.map(drop),
            Ok(None) => Ok(()),
            // The next one is due in a minute, and the budget may have room then.
            Err(Broken::NoBudget) => return Ok(()),
            Err(broken) => Err(broken),
        };
        // Also one that failed is not asked for again: the list has the packet.
        self.state.wanted.retain(|(wanted, _)| *wanted != id);
        self.state.known.push(id);
        let over = self.state.known.len().saturating_sub(KNOWN_MOST);
        self.state.known.drain(..over);
        done
    }

    /// Whether the list is old, by what the satellite's own page tells. Looked at when nothing new came for an hour.
    async fn is_old(&mut self, name: &str) -> Result<Option<String>, Broken> {
        let now = self.now();
        let Some(newest_us) = self.state.newest_us.get(name).copied() else { return Ok(None) };
        let fresh_us = self.state.fresh_at_us.get_or_insert(now.0);
        if now.0 - *fresh_us < SUSPECT_US {
            return Ok(None);
        }
        let Some(body) = self.ask(&self.at(&format!("satellite/{}", quoted(name)), &[])?, 1).await? else {
            return Ok(None);
        };
        let told: Value = serde_json::from_slice(&body.bytes).unwrap_or_default();
        let Some(last_ms) = told["lastPacketTime"].as_i64() else { return Ok(None) };
        let last_us = last_ms.saturating_mul(1_000).min(now.0);
        if last_us - newest_us <= STALE_US {
            return Ok(None);
        }
        let hours = (last_us - newest_us) as f64 / 3.6e9;
        Ok(Some(format!(
            "the list of {name} is {hours:.1} h behind what TinyGS tells of the satellite: it is frozen, the satellite is not silent"
        )))
    }
}

/// A name as a part of a path.
fn quoted(name: &str) -> String {
    let mut text = String::new();
    for byte in name.bytes() {
        if byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'.' | b'_' | b'~') {
            text.push(char::from(byte));
        } else {
            text.push_str(&format!("%{byte:02X}"));
        }
    }
    text
}

/// Ids and times of a whole list; `None` when it is none, or not whole.
fn listed(body: &[u8]) -> Option<Listed> {
    let value: Value = serde_json::from_slice(body).ok()?;
    let packets = value["packets"].as_array().or_else(|| value.as_array())?;
    let mut listed = Listed { newest_us: i64::MIN, oldest_us: i64::MAX, packets: Vec::new() };
    for packet in packets {
        let Some(at_us) = packet["serverTime"].as_i64().and_then(|ms| ms.checked_mul(1_000)) else {
            continue;
        };
        (listed.newest_us, listed.oldest_us) = (listed.newest_us.max(at_us), listed.oldest_us.min(at_us));
        let is_id = |id: &&str| {
            (1..=64).contains(&id.len())
                && id.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-')
        };
        if let Some(id) = packet["id"].as_str().filter(is_id) {
            listed.packets.push((id.to_owned(), at_us));
        }
    }
    Some(listed)
}
