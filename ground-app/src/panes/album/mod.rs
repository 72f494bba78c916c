//! The image that is looked at: its file as far as it is held, its chunks, and who brought them. Gallery, picture and
//! chunks show the same one.

mod pixels;
mod sources;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use api::client::{ClientError, IdempotencyKey, ImageFile};
use api::{ChunkMap, DownloadRequest, DownloadView, ImageView, Outcome};

pub(super) use pixels::Pixels;
pub(super) use sources::{Heard, Sources, Version, bytes_of};

use super::Scene;
use crate::link::Pending;
use crate::model::Model;

/// Nothing is asked for more often.
const PAUSE: Duration = Duration::from_millis(400);
/// The pace of chunks is that of so long.
const PACE_US: i64 = 60_000_000;

/// What is held of the image that is looked at.
#[derive(Default)]
pub(super) struct Album {
    /// The one that was chosen; `None`: the newest.
    chosen: Option<u64>,
    shown: Option<u64>,
    /// Chunks held, conflicts, completeness when the file was asked for.
    asked_at: Option<(u32, u32, bool)>,
    last_question: Option<Instant>,
    file: Option<Pending<Option<ImageFile>>>,
    map: Option<Pending<ChunkMap>>,
    failure: Option<String>,
    /// The file as far as it is held.
    pub(super) held: Option<ImageFile>,
    /// Which chunks are held.
    pub(super) chunks: Option<ChunkMap>,
    /// Counts maps of chunks.
    pub(super) revision: u64,
    /// Who brought them.
    pub(super) sources: Sources,
    /// The picture.
    pub(super) pixels: Pixels,
    /// Time and chunks held, whenever they changed.
    pace: VecDeque<(i64, u32)>,
    order: Option<(Order, IdempotencyKey, Option<Pending<Outcome>>)>,
    /// What became of the last order.
    pub(super) told: Option<String>,
    world: u64,
}

/// What may be asked of the server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Order {
    /// Bring the image home.
    Bring(String),
    /// Ask for no more.
    Cancel(u64),
}

/// When an image will be whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Eta {
    /// UTC in microseconds since 1970.
    pub(super) at_us: i64,
    /// Chunks that will be missing at LOS; `None` when LOS is not known.
    pub(super) missing_at_los: Option<u32>,
}

impl Album {
    /// Shows this one from now on.
    pub(super) fn choose(&mut self, image: u64) {
        self.chosen = Some(image);
    }

    /// The image that is looked at: the chosen one, or else the satellite's newest.
    pub(super) fn image<'a>(&self, model: &'a Model, satellite: &str) -> Option<&'a ImageView> {
        let images = &model.images.value()?.items;
        let chosen = images.iter().find(|image| Some(image.id) == self.chosen);
        chosen.or_else(|| {
            images.iter().filter(|image| image.satellite == satellite).max_by_key(|image| image.id)
        })
    }

    /// Once a frame for whoever shows it: takes answers, and asks for what is new.
    pub(super) fn turn(&mut self, scene: &Scene<'_>, context: &egui::Context) {
        let model = scene.model;
        if self.world != model.world {
            *self = Self { world: model.world, ..Self::default() };
        }
        let Some(satellite) = scene.satellite().map(|view| view.satellite.as_str()) else { return };
        let Some(image) = self.image(model, satellite).cloned() else { return };
        if self.shown != Some(image.id) {
            *self = Self { chosen: self.chosen, shown: Some(image.id), world: self.world, ..Self::default() };
        }
        self.take(context);
        self.take_order();
        if let Some(now_us) = scene.now_us
            && self.pace.back().is_none_or(|(_, held)| *held != image.held)
        {
            self.pace.push_back((now_us, image.held));
            while self.pace.len() > 500 || self.pace.front().is_some_and(|(at, _)| now_us - at > 3 * PACE_US)
            {
                self.pace.pop_front();
            }
        }
        let state = (image.held, image.conflicts, image.complete);
        let paused = self.last_question.is_some_and(|at| scene.now.saturating_duration_since(at) < PAUSE);
        if self.asked_at != Some(state) && self.file.is_none() && self.map.is_none() && !paused {
            self.asked_at = Some(state);
            self.last_question = Some(scene.now);
            let known = self.held.as_ref().and_then(|held| held.tag.clone());
            let id = image.id;
            self.file = Some(
                scene.courier.ask(move |client| async move { client.image_file(id, known.as_deref()).await }),
            );
            self.map = Some(scene.courier.ask(move |client| async move { client.image_chunks(id).await }));
        }
        if let Some(chunks) = &self.chunks {
            self.sources.turn(scene, &image, chunks);
        }
    }

    fn take(&mut self, context: &egui::Context) {
        self.pixels.turn(context);
        if let Some(answer) = self.file.as_ref().and_then(Pending::take) {
            self.file = None;
            match answer {
                Ok(Some(file)) => {
                    self.failure = None;
                    self.pixels.decode(&file);
                    self.held = Some(file);
                }
                Ok(None) => self.failure = None,
                Err(error) => self.fail(&error),
            }
        }
        if let Some(answer) = self.map.as_ref().and_then(Pending::take) {
            self.map = None;
            match answer {
                Ok(map) => {
                    self.chunks = Some(map);
                    self.revision += 1;
                }
                Err(error) => self.fail(&error),
            }
        }
    }

    fn fail(&mut self, error: &ClientError) {
        self.failure = Some(error.to_string());
        self.asked_at = None;
    }

    /// Why it is not newer.
    pub(super) fn failure(&self) -> Option<&str> {
        self.failure.as_deref().or(self.pixels.failure())
    }

    /// When it will be whole at the pace of the last minute; `None` while nothing comes.
    pub(super) fn eta(&self, image: &ImageView, now_us: i64, los_us: Option<i64>) -> Option<Eta> {
        eta(&self.pace, image.chunks.saturating_sub(image.held), now_us, los_us)
    }

    /// Asks the server; one order at a time.
    pub(super) fn order(&mut self, scene: &Scene<'_>, order: Order) {
        if self.order.as_ref().is_some_and(|(_, _, pending)| pending.is_some()) {
            return;
        }
        // The same intent again after no answer came has the same key: it is done once.
        let key = match self.order.take() {
            Some((last, key, _)) if last == order && self.told.is_some() => key,
            _ => IdempotencyKey::fresh(),
        };
        let (words, again) = (order.clone(), key.clone());
        let pending = scene.courier.ask(move |client| async move {
            match words {
                Order::Bring(satellite) => {
                    let request = DownloadRequest { satellite: Some(satellite), link: None };
                    client.order_download(&request, &again).await
                }
                Order::Cancel(download) => client.cancel_download(download, &again).await,
            }
        });
        self.told = None;
        self.order = Some((order, key, Some(pending)));
    }

    fn take_order(&mut self) {
        let Some((order, _, pending)) = &mut self.order else { return };
        let Some(answer) = pending.as_ref().and_then(Pending::take) else { return };
        *pending = None;
        match (answer, &order) {
            (Ok(_), Order::Bring(_)) => self.told = Some("Ordered".to_owned()),
            (Ok(_), Order::Cancel(_)) => self.told = Some("Cancelled".to_owned()),
            (Err(error), _) => {
                self.told = Some(error.to_string());
                if error.is_temporary() {
                    return;
                }
            }
        }
        self.order = None;
    }
}

/// The order that stands for this satellite.
pub(super) fn active_download<'a>(model: &'a Model, satellite: &str) -> Option<&'a DownloadView> {
    let downloads = &model.downloads.value()?.items;
    downloads.iter().find(|download| download.satellite == satellite && download.state == "active")
}

fn eta(pace: &VecDeque<(i64, u32)>, missing: u32, now_us: i64, los_us: Option<i64>) -> Option<Eta> {
    let (last_us, last) = *pace.back()?;
    let (first_us, first) = *pace.iter().find(|(at_us, _)| now_us - at_us <= PACE_US)?;
    if missing == 0 || last <= first || last_us <= first_us || now_us - last_us > PACE_US / 2 {
        return None;
    }
    let per_us = f64::from(last - first) / (last_us - first_us) as f64;
    let at_us = now_us.saturating_add((f64::from(missing) / per_us) as i64);
    let missing_at_los = los_us.map(|los_us| {
        let brought = per_us * (los_us - now_us).max(0) as f64;
        (f64::from(missing) - brought).ceil().max(0.0) as u32
    });
    Some(Eta { at_us, missing_at_los })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_whole_when_the_missing_chunks_came_at_the_pace_of_the_last_minute() {
        let s = 1_000_000;
        let pace: VecDeque<(i64, u32)> = (0..=20).map(|i| (i * s, i as u32 * 2)).collect();
        let now = 20 * s;
        let whole = eta(&pace, 60, now, Some(50 * s)).unwrap();
        assert_eq!((whole.at_us, whole.missing_at_los), (50 * s, Some(0)));
        assert_eq!(eta(&pace, 60, now, Some(40 * s)).unwrap().missing_at_los, Some(20));
        assert_eq!(eta(&pace, 60, now, None).unwrap().missing_at_los, None);
        assert_eq!(eta(&pace, 0, now, None), None);
        assert_eq!(eta(&pace, 60, now + 31 * s, None), None, "nothing comes any more");
        assert_eq!(eta(&VecDeque::new(), 60, now, None), None);
    }
}
