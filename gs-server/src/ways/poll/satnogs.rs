//! What is asked of the database of SatNOGS: the frames of a window of time, page by page. Frames are handed in hours after
//! they were heard, so each look begins a day before the last one ended.

use mission::UtcUs;
use mission::reception::Ear;
use reqwest::Url;
use serde_json::Value;

use super::rhythm::MINUTE_US;
use super::{Broken, Poller};

const DAY_US: i64 = 24 * 60 * MINUTE_US;
/// Frames come so late.
const LATE_US: i64 = DAY_US;
/// The first look goes back so far.
const FIRST_US: i64 = 7 * DAY_US;
/// No longer window: an unbounded question takes the database too long.
const WINDOW_US: i64 = 7 * DAY_US;
/// Pages of one look.
const PAGES: usize = 20;
/// Between two pages: six requests a minute are allowed.
const PAUSE_US: u64 = 11_000_000;

impl Poller {
    pub(super) async fn look_at_satnogs(&mut self) -> Result<(), Broken> {
        let now = self.now();
        for page in 0..PAGES {
            if page > 0 {
                self.wait(PAUSE_US).await;
            }
            let (url, stop_us) = match self.state.page.clone() {
                Some((next, stop_us)) => match self.allowed(&next) {
                    Some(url) => (url, stop_us),
                    None => {
                        self.state.page = None;
                        return Err(Broken::Failed(
                            "the next page is said to lie somewhere else: it is not followed, and no token goes there".into(),
                        ));
                    }
                },
                None => self.window(now)?,
            };
            let Some(body) = self.ask(&url, 0).await? else {
                self.state.page = None;
                return Err(Broken::Failed(
                    "it knows no such satellite or address (404): look at norad and url".into(),
                ));
            };
            let parsed: Option<Value> = serde_json::from_slice(&body.bytes).ok();
            self.take(Ear::Satnogs, &body.bytes).await?;
            let whole = parsed.filter(|value| value.is_array() || value["results"].is_array());
            let Some(value) = whole else {
                return Err(Broken::Failed(
                    "the answer is no list of frames, or was cut; what was whole of it is kept".into(),
                ));
            };
            self.way.works();
            let next = body.next.or_else(|| Some(value["next"].as_str()?.to_owned()));
            let is_empty =
                value.as_array().or_else(|| value["results"].as_array()).is_some_and(Vec::is_empty);
            match next.filter(|_| !is_empty) {
                Some(next) => self.state.page = Some((next, stop_us)),
                None => {
                    self.state.page = None;
                    self.state.read_until_us = Some(stop_us);
                    if stop_us >= now.0 {
                        self.way.notes(None);
                        return Ok(());
                    }
                }
            }
        }
        self.way.notes(Some("there is more than one look takes: the rest comes with the next ones".into()));
        Ok(())
    }

    /// The question for the next window, and where it ends.
    fn window(&self, now: UtcUs) -> Result<(Url, i64), Broken> {
        let start_us = self.state.read_until_us.map_or(now.0 - FIRST_US, |until| until - LATE_US);
        let stop_us = (start_us + WINDOW_US).min(now.0);
        let mut url = self.base.clone();
        let number = self.names.first().cloned().unwrap_or_default();
        let stamp = |us: i64| api::Time::from_unix_us(us).to_string();
        url.query_pairs_mut()
            .append_pair("satellite", &number)
            .append_pair("start", &stamp(start_us))
            .append_pair("end", &stamp(stop_us))
            .append_pair("format", "json");
        if url.as_str().len() > 2_000 {
            return Err(Broken::Failed("the address is too long".into()));
        }
        Ok((url, stop_us))
    }

    /// A next page on the same host, by the same protocol, under the same path.
    fn allowed(&self, next: &str) -> Option<Url> {
        let url = self.base.join(next).ok().filter(|url| url.as_str().len() <= 4_000)?;
        let is_same = url.scheme() == self.base.scheme()
            && url.host_str() == self.base.host_str()
            && url.port_or_known_default() == self.base.port_or_known_default()
            && url.path() == self.base.path()
            && url.username().is_empty()
            && url.password().is_none();
        is_same.then_some(url)
    }
}
