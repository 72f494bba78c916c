//! A file on its way in: one thread cuts it into items, as many as there are cores read them, the archive takes them in
//! their order.

use std::collections::BTreeMap;
use std::io::{BufReader, Read};
use std::path::Path;
use std::time::Duration;

use api::{ImportItem, ImportReport, ImportRequest};
use indicatif::ProgressBar;
use mission::SatelliteId;
use mission::reception::Ear;
use rayon::prelude::*;
use serde::Serialize;
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use super::super::Failure;
use crate::elements::{Remote, RemoteError};
use crate::ingest::formats::{Context, Format, Item, Items, read};
use crate::ingest::{Delivery, Ears, EarsError, Outcome, TOGETHER_ALONE};

/// Items that are read together: enough for all cores, little enough to hold.
const AT_ONCE: usize = TOGETHER_ALONE;
/// Bytes of items in one request: the API takes 512 KiB with everything escaped.
const REQUEST_MAX: usize = 240 << 10;
/// Items in one request.
const ITEMS_MAX: usize = 1_000;
/// Between two tries.
const AGAIN: Duration = Duration::from_secs(1);
/// How often a busy archive is asked again, with a second between.
const PATIENCE: u32 = 120;

/// Where the items go.
pub(super) enum Taker {
    /// Into the archive in this process, where nothing else is done meanwhile.
    Here(Ears, SatelliteId),
    /// To the server that runs.
    There(Box<Remote>, ImportRequest),
}

/// What it all came to.
#[derive(Debug, Clone, Default, Serialize)]
pub(super) struct Sum {
    pub(super) frames: u64,
    pub(super) merged: u64,
    pub(super) without_frame: u64,
    pub(super) repeated: u64,
    pub(super) refused: u64,
    pub(super) reasons: BTreeMap<String, u64>,
}

impl Sum {
    pub(super) fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.merged += other.merged;
        self.without_frame += other.without_frame;
        self.repeated += other.repeated;
        self.refused += other.refused;
        for (reason, count) in &other.reasons {
            *self.reasons.entry(reason.clone()).or_default() += count;
        }
    }

    /// Reports that were read, whatever became of them.
    pub(super) const fn packets(&self) -> u64 {
        self.frames + self.merged + self.without_frame + self.repeated + self.refused
    }

    fn took(&mut self, outcome: &Outcome) {
        self.frames += outcome.frames;
        self.merged += outcome.merged;
        self.without_frame += outcome.without_frame;
        self.repeated += outcome.repeated;
        self.refused += outcome.refused;
    }

    fn took_there(&mut self, report: &ImportReport) {
        self.frames += report.frames;
        self.merged += report.merged;
        self.without_frame += report.without_frame;
        self.repeated += report.repeated;
        self.refused += report.refused;
    }
}

/// Why a file was not imported to its end. What was taken is durable; the same import again goes on.
pub(super) enum Broken {
    File(std::io::Error),
    Here(EarsError),
    There(RemoteError),
}

impl Broken {
    pub(super) fn of_file(self, path: &Path) -> Failure {
        let what = format!("{} was not imported to its end; the same command again goes on", path.display());
        match self {
            Self::File(error) => Failure::doing(what, error),
            Self::Here(error) => Failure::doing(what, error),
            Self::There(error) => refused(error),
        }
    }
}

pub(super) fn refused(error: RemoteError) -> Failure {
    match error {
        RemoteError::Refused(_) | RemoteError::Busy(_) | RemoteError::Token(_) => Failure::refused(error),
        RemoteError::NoPort => Failure::usage(error),
        _ => Failure::failed(error),
    }
}

/// Imports what a reader has, until its end or until `stop`.
pub(super) async fn import(
    format: Format,
    reader: impl Read + Send + 'static,
    context: &Context,
    taker: &Taker,
    (bar, stop): (&ProgressBar, &CancellationToken),
) -> Result<Sum, Broken> {
    // One batch waits, one is being read: what is read waits for what is stored.
    let (sender, mut batches) = mpsc::channel(1);
    let is_here = matches!(taker, Taker::Here(..));
    let context = context.clone();
    let cutter = tokio::task::spawn_blocking(move || cut(format, reader, is_here, &context, &sender));
    let mut delivery = match taker {
        Taker::Here(ears, satellite) => {
            Some(ears.deliver(satellite, Ear::File, TOGETHER_ALONE, PATIENCE).await.map_err(Broken::Here)?)
        }
        Taker::There(..) => None,
    };
    let mut sum = Sum::default();
    while let Some(batch) = batches.recv().await {
        match (batch.map_err(Broken::File)?, &mut delivery, taker) {
            (Batch::Read(found), Some(delivery), _) => here(delivery, found, &mut sum).await?,
            (Batch::Items(items), _, Taker::There(remote, request)) => {
                there(remote, request, items, (&mut sum, stop)).await?;
            }
            _ => {}
        }
        let rate = sum.packets() as f64 / bar.elapsed().as_secs_f64().max(0.001);
        bar.set_message(format!("{} packets, {rate:.0}/s, {} new frames", sum.packets(), sum.frames));
        if stop.is_cancelled() {
            break;
        }
    }
    // What cuts notices that nobody takes any more.
    drop(batches);
    cutter.await.map_err(|error| Broken::File(std::io::Error::other(error)))?;
    if let Some(delivery) = delivery {
        sum.took(&delivery.end().await.map_err(Broken::Here)?);
    }
    Ok(sum)
}

/// Items, read where they are to be stored here.
enum Batch {
    Read(Vec<crate::ingest::formats::Read>),
    Items(Vec<Item>),
}

fn cut(
    format: Format,
    reader: impl Read,
    is_here: bool,
    context: &Context,
    sender: &mpsc::Sender<Result<Batch, std::io::Error>>,
) {
    let mut items = Items::new(format, BufReader::with_capacity(1 << 18, reader)).peekable();
    while items.peek().is_some() {
        let together: Result<Vec<Item>, _> = items.by_ref().take(AT_ONCE).collect();
        let batch = together.map(|together| {
            if !is_here {
                return Batch::Items(together);
            }
            let each = |item: &Item| {
                let mut out = Vec::new();
                read(item, context, &mut out);
                out
            };
            Batch::Read(together.par_iter().flat_map_iter(each).collect())
        });
        if sender.blocking_send(batch).is_err() {
            return;
        }
    }
}

async fn here(
    delivery: &mut Delivery,
    found: Vec<crate::ingest::formats::Read>,
    sum: &mut Sum,
) -> Result<(), Broken> {
    for refused in found.iter().filter_map(|read| read.as_ref().err()) {
        *sum.reasons.entry(refused.reason.to_string()).or_default() += 1;
    }
    sum.took(&delivery.push(found).await.map_err(Broken::Here)?);
    Ok(())
}

async fn there(
    remote: &Remote,
    request: &ImportRequest,
    items: Vec<Item>,
    (sum, stop): (&mut Sum, &CancellationToken),
) -> Result<(), Broken> {
    let mut part = ImportRequest { items: Vec::new(), ..request.clone() };
    let mut bytes = 0;
    for item in items {
        let Some((length, item)) = wire(item, sum) else { continue };
        if (bytes + length > REQUEST_MAX || part.items.len() >= ITEMS_MAX) && !part.items.is_empty() {
            send(remote, &mut part, sum).await?;
            bytes = 0;
            if stop.is_cancelled() {
                return Ok(());
            }
        }
        bytes += length;
        part.items.push(item);
    }
    if part.items.is_empty() { Ok(()) } else { send(remote, &mut part, sum).await }
}

async fn send(remote: &Remote, part: &mut ImportRequest, sum: &mut Sum) -> Result<(), Broken> {
    let mut tries = PATIENCE;
    let report: ImportReport = loop {
        match remote.make("receptions", part).await {
            Err(RemoteError::Busy(_)) if tries > 0 => tries -= 1,
            report => break report.map_err(Broken::There)?,
        }
        crate::clock::wall_sleep(AGAIN).await;
    };
    sum.took_there(&report);
    part.items.clear();
    Ok(())
}

/// An item as the API takes it, and its length; `None` when it was refused already.
fn wire(item: Item, sum: &mut Sum) -> Option<(usize, ImportItem)> {
    let mut refuse = |reason: String| {
        sum.refused += 1;
        *sum.reasons.entry(reason).or_default() += 1;
        None
    };
    let body = match item.body {
        Ok(body) if body.len() > REQUEST_MAX => {
            return refuse(
                "longer than a request to the server may be: import it while the server is stopped".into(),
            );
        }
        Ok(body) => body,
        Err(reason) => return refuse(reason.to_string()),
    };
    let length = body.len() + 128;
    let text = String::from_utf8(body);
    let (text, hex) = match text {
        Ok(text) if item.format != Format::Raw && item.format != Format::Kiss => (Some(text), None),
        Ok(text) => (None, Some(hex::encode(text))),
        Err(bytes) => (None, Some(hex::encode(bytes.into_bytes()))),
    };
    let item = ImportItem {
        format: item.format.name().to_owned(),
        text,
        hex,
        topic: item.prefix,
        occurrence: Some(item.occurrence),
    };
    Some((length, item))
}
