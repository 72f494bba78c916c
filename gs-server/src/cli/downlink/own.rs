//! What the station's own server knows: missing chunks, and who heard the satellite lately.

use std::path::Path;

use api::{ChunkMap, ImageView, OutsideView, Page, Time};
use mission::UtcUs;
use mission::downlink::HeardBy;
use tle::Station;

use super::super::plans::{failure, server};
use super::super::shell::runtime;
use super::Failure;
use crate::config::Config;
use crate::elements::Remote;

/// Receptions older than this say little of who listens now, and with elements of today nobody knows in which pass they were,
/// microseconds.
const HISTORY_US: i64 = 10 * 86_400_000_000;
/// Reports that are asked for at most: then the newest count.
const REPORTS_MAX: usize = 200_000;

/// The answer.
pub(super) struct Own {
    /// Missing chunks, ascending.
    pub(super) missing: Vec<u16>,
    /// Who heard something when.
    pub(super) heard: Vec<HeardBy>,
}

/// Asks the server that runs under this configuration.
pub(super) fn ask(
    config: &Path,
    satellite: &str,
    image: Option<u64>,
    wants_chunks: bool,
    from: UtcUs,
) -> Result<Own, Failure> {
    let config = Config::load(config).map_err(Failure::usage)?;
    let remote = server(&config)?;
    runtime()?.block_on(async {
        let missing = if wants_chunks { missing(&remote, satellite, image).await? } else { Vec::new() };
        let heard = heard(&remote, satellite, from).await?;
        Ok(Own { missing, heard })
    })
}

async fn missing(remote: &Remote, satellite: &str, image: Option<u64>) -> Result<Vec<u16>, Failure> {
    let image = match image {
        Some(image) => image,
        None => {
            let query = [("satellite", satellite.to_owned()), ("limit", "100".to_owned())];
            let page: Page<ImageView> = remote.get("images", &query).await.map_err(failure)?;
            let newest = page.items.iter().find(|image| !image.complete);
            newest.map(|image| image.id).ok_or_else(|| {
                Failure::failed(format!("no image of {satellite} is unfinished: give --image or --chunks"))
            })?
        }
    };
    let map: ChunkMap = remote.get(&format!("images/{image}/chunks"), &[]).await.map_err(failure)?;
    let missing: Vec<u16> = map
        .map
        .bytes()
        .enumerate()
        .filter(|(_, letter)| *letter == b'.')
        .filter_map(|(index, _)| u16::try_from(index).ok())
        .collect();
    if missing.is_empty() {
        return Err(Failure::failed(format!("image {image} misses no chunk")));
    }
    eprintln!("gs-server: image {image} misses {} of {} chunks", missing.len(), map.chunks);
    Ok(missing)
}

/// Frames and detections alike: whoever noticed it was listening.
async fn heard(remote: &Remote, satellite: &str, from: UtcUs) -> Result<Vec<HeardBy>, Failure> {
    let (mut heard, mut asked, mut before) = (Vec::new(), 0, None);
    loop {
        let mut query = vec![
            ("satellite", satellite.to_owned()),
            ("start", Time::from_unix_us(from.0.saturating_sub(HISTORY_US)).to_string()),
            ("limit", "1000".to_owned()),
        ];
        query.extend(before.map(|before: u64| ("before", before.to_string())));
        let page: Page<OutsideView> = remote.get("receptions", &query).await.map_err(failure)?;
        asked += page.items.len();
        heard.extend(page.items.iter().filter_map(by));
        match page.next {
            Some(next) if asked < REPORTS_MAX => before = Some(next),
            _ => return Ok(heard),
        }
    }
}

/// `None`: nobody said who it was, or where.
fn by(report: &OutsideView) -> Option<HeardBy> {
    let name = report.receiver_name.clone().or_else(|| report.receiver.clone())?;
    let height_m = report.altitude_m.unwrap_or(0.0);
    let place = Station::new(report.latitude_deg?, report.longitude_deg?, height_m).ok()?;
    let id = report.receiver.clone().unwrap_or_else(|| name.clone());
    Some(HeardBy { id, name, place, at: UtcUs(report.received_at.unix_us()) })
}
