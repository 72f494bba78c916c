//! What a demo came to: the one JSON object that scripts read.

use std::collections::BTreeMap;

use mission::Clock as _;
use radio::airtime::LinkTiming;
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::scene::Scene;
use super::{DemoError, DemoOptions, Ending};
use crate::storage::{CommandQuery, FrameQuery, Page, Scope, Store};

/// Rows in one page; the most that storage gives.
const PAGE: u32 = 1000;

/// What it came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The image on the ground equals the satellite's, byte for byte.
    pub equal: bool,
    /// Why not.
    pub reason: Option<String>,
    /// The seed that shows it again.
    pub seed: u64,
    /// Downlink frames.
    pub frames: Frames,
    /// Requests for chunks that were radiated.
    pub requests: i64,
    /// Chunks of the image.
    pub chunks: Chunks,
    /// Time on the air.
    pub airtime: Airtime,
    /// SHA-256 of both images, in hex.
    pub sha256: Hashes,
    /// Commands by the stage that they ended in, or stand in.
    pub commands: BTreeMap<String, u64>,
    /// Simulated seconds.
    pub simulated_s: f64,
    /// Seconds on the wall.
    pub wall_s: f64,
}

/// Downlink frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Frames {
    /// That the satellite radiated.
    pub sent: u64,
    /// Heard whole.
    pub heard: u64,
    /// Lost on the way while the satellite was in view.
    pub lost: u64,
    /// Lost because nobody was in view.
    pub out_of_view: u64,
    /// Heard damaged.
    pub bad: u64,
}

/// Chunks of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Chunks {
    /// Of which the image consists.
    pub total: i64,
    /// That the satellite radiated.
    pub sent: u64,
    /// Heard whole, repeated ones counted again.
    pub received: u64,
    /// Held at the end.
    pub held: i64,
    /// Asked for although held, because that cost less airtime than another request.
    pub bridged: i64,
}

/// Time on the air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Airtime {
    /// Both ways together, in seconds.
    pub used_s: f64,
    /// Ground to satellite, in seconds.
    pub up_s: f64,
    /// Satellite to ground, in seconds.
    pub down_s: f64,
    /// What no scheduler can beat: N / (1 - loss) frames.
    pub bound_frames: f64,
    /// Their time on the air, in seconds.
    pub bound_s: f64,
}

/// SHA-256 of both images, in hex; `None` where there is none.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Hashes {
    /// What we hold.
    pub ground: Option<String>,
    /// What the satellite holds.
    pub twin: Option<String>,
}

impl Summary {
    pub(super) async fn gather(
        options: &DemoOptions,
        scene: &Scene,
        ending: &Ending,
    ) -> Result<Self, DemoError> {
        let store = &scene.ready.store;
        let twin = scene.twin_view().await?;
        let status = scene.ready.engine.status();
        let (heard, bad) = status.links.first().map_or((0, 0), |link| (link.frames, link.bad));
        let newest = Page { before: Some(i64::MAX), limit: 1, ..Page::default() };
        let image = store.images(&Scope::default(), &newest).await?.into_iter().next();
        let download = store.downloads(&Scope::default(), &newest).await?.into_iter().next();
        let ground = match &image {
            Some(image) => {
                store.image_bytes(image.id).await?.filter(|bytes| bytes.complete).map(|bytes| bytes.bytes)
            }
            None => None,
        };
        let equal = ground.as_ref().is_some_and(|ground| *ground == twin.image && !ground.is_empty());
        let reason = (!equal).then(|| reason(ending, image.as_ref().map(|image| (image.held, image.chunks))));
        let timing = LinkTiming::default();
        let total = image.as_ref().map_or(0, |image| image.chunks);
        let bound_frames = total as f64 / (1.0 - options.channel.loss).max(f64::MIN_POSITIVE);
        let us = |us: u64| us as f64 / 1e6;
        Ok(Self {
            equal,
            reason,
            seed: options.seed,
            frames: Frames {
                sent: twin.stats.twin.frames,
                heard,
                lost: twin.stats.channel.lost_down,
                out_of_view: twin.stats.channel.out_of_view,
                bad,
            },
            requests: download.as_ref().map_or(0, |download| download.requests),
            chunks: Chunks {
                total,
                sent: twin.stats.twin.chunks,
                received: chunks_received(store).await?,
                held: image.as_ref().map_or(0, |image| image.held),
                bridged: download.as_ref().map_or(0, |download| download.chunks_bridged),
            },
            airtime: Airtime {
                used_s: us(twin.stats.airtime_up_us + twin.stats.airtime_down_us),
                up_s: us(twin.stats.airtime_up_us),
                down_s: us(twin.stats.airtime_down_us),
                bound_frames,
                bound_s: bound_frames * us(timing.frame_us(protocol::FRAME_LEN)),
            },
            sha256: Hashes {
                ground: ground.map(|bytes| hex::encode(Sha256::digest(bytes))),
                twin: (!twin.image.is_empty()).then(|| hex::encode(Sha256::digest(&twin.image))),
            },
            commands: commands(store).await?,
            simulated_s: us(scene.timer.now().mono.0),
            wall_s: us(scene.wall.now().mono.0),
        })
    }
}

fn reason(ending: &Ending, held: Option<(i64, i64)>) -> String {
    let held = match held {
        Some((held, chunks)) => format!("{held} of {chunks} chunks are home"),
        None => "no image was declared".to_owned(),
    };
    match ending {
        Ending::Home => "the image on the ground differs from the satellite's".to_owned(),
        Ending::Stopped => format!("stopped: {held}"),
        Ending::TimeUp => format!("the simulated time is up: {held}"),
        Ending::PartEnded => format!("server or twin ended by itself: {held}"),
    }
}

async fn chunks_received(store: &Store) -> Result<u64, DemoError> {
    let mut query =
        FrameQuery { packet_type: Some(protocol::down_type::IMAGE_CHUNK), ..FrameQuery::default() };
    query.page = Page { after: Some(0), before: None, limit: PAGE };
    let mut received = 0;
    loop {
        let page = store.frames(&query).await?;
        let Some(last) = page.last() else { return Ok(received) };
        query.page.after = Some(last.frame.id);
        received += page.iter().map(|heard| heard.receptions.len().max(1) as u64).sum::<u64>();
    }
}

async fn commands(store: &Store) -> Result<BTreeMap<String, u64>, DemoError> {
    let mut query =
        CommandQuery { page: Page { after: Some(0), before: None, limit: PAGE }, ..CommandQuery::default() };
    let mut by_stage = BTreeMap::new();
    loop {
        let page = store.commands(&query).await?;
        let Some(last) = page.last() else { return Ok(by_stage) };
        query.page.after = Some(last.command.id);
        for command in &page {
            let stage = command.last.as_ref().map_or("queued", |last| last.stage.as_str());
            *by_stage.entry(stage.to_owned()).or_default() += 1;
        }
    }
}
