//! What to ask for next, so that the image comes home with the least airtime.

use protocol::heapless::Vec as Bounded;
use protocol::{ChunkRange, ChunkRanges, RANGE_MAX, Telecommand};

use super::gate::{Need, Wait};
use super::outcome::mono_of;
use super::satellite::{Before, Command};
use super::uplink::REFUSED_US;
use super::{About, Station};
use crate::clock::{MonoUs, Now};
use crate::cover::{Cost, Range, cheapest_cover, exact_runs};
use crate::id::CommandId;
use crate::level::Level;
use crate::record::{CommandRecord, DownloadState, EventKind, Record, Subject};
use crate::stage::Stage;

/// ImageInfo said that there is no image: ask again after this (a capture takes a while)...
const NO_IMAGE_RETRY_US: u64 = 10_000_000;
/// ...and give up after so many times.
const NO_IMAGE_TIMES: u32 = 6;
/// Priority of requests that the machine makes: after everything that a person asked for.
const MACHINE_PRIORITY: i16 = -100;
/// Ranges that one GetImageRanges can name.
const RANGES_MAX: usize = 48;

/// What to ask for, and what it bridges.
struct Request {
    telecommand: Telecommand,
    asked: u32,
    bridged: u32,
    /// Why held chunks are asked for again, when they are.
    justification: Option<String>,
}

impl Station {
    /// The next request of the active download as a queued command; `None` when there is nothing to ask.
    pub(super) fn next_request(&mut self, now: Now, s: usize) -> Result<Option<CommandId>, Wait> {
        let sat = &self.satellites[s];
        let Some(download) = &sat.download else { return Ok(None) };
        let Some(l) = self.link_index(&download.record.route.link) else { return Ok(None) };
        if now.mono < download.not_before {
            return Err(Wait { why: "waiting for an image".into(), until: Some(download.not_before) });
        }
        let request = if download.ask_info || sat.image.is_none() {
            let telecommand = Telecommand::GetImageInfo;
            Request { telecommand, asked: 0, bridged: 0, justification: None }
        } else {
            match self.chunk_request(now, s, l)? {
                Some(request) => request,
                None => return Ok(None),
            }
        };
        let answer_us = self.answer_us(s, l, &request.telecommand);
        self.gate(now, s, l, Need { gate: Self::machine_gate(), answer_us })?;
        Ok(self.queue_request(now, s, request))
    }

    /// The range of the cheapest cover that brings most, as long as the pass carries it.
    fn chunk_request(&self, now: Now, s: usize, l: usize) -> Result<Option<Request>, Wait> {
        let (sat, link) = (&self.satellites[s], &self.links[l]);
        let Some(image) = &sat.image else { return Ok(None) };
        let missing = image.missing();
        if missing.is_empty() {
            return Ok(None);
        }
        let fits = self.chunks_that_fit(now, s, l);
        if fits == 0 {
            return Err(Wait { why: "no chunk would come home before loss of signal".into(), until: None });
        }
        if sat.profile.ranges {
            let runs = exact_runs(&missing, RANGES_MAX, fits);
            let asked = runs.iter().map(|run| u32::from(run.count)).sum();
            let ranges: Bounded<ChunkRange, RANGES_MAX> =
                runs.iter().map(|run| ChunkRange { first: run.first, count: run.count }).collect();
            let telecommand = Telecommand::GetImageRanges(ChunkRanges { ranges });
            return Ok(Some(Request { telecommand, asked, bridged: 0, justification: None }));
        }
        let timing = link.config.timing;
        let cost = Cost {
            request_us: timing.uplink_us() + 2 * timing.turn_round_us + timing.delivery_us(240),
            chunk_us: link.chunk_period_us(),
        };
        let cover = cheapest_cover(&missing, RANGE_MAX, cost);
        let best = cover.ranges.iter().max_by_key(|range| (range.missing(), std::cmp::Reverse(range.first)));
        let Some(best) = best else { return Ok(None) };
        let range = shorten(best, fits, &missing);
        let justification = (range.bridged > 0).then(|| {
            format!(
                "chunks {}..{} are asked for together: {} of them are held, their {} ms cost less than another request's {} ms",
                range.first,
                u32::from(range.first) + u32::from(range.count) - 1,
                range.bridged,
                u64::from(range.bridged) * cost.chunk_us / 1_000,
                cost.request_us / 1_000
            )
        });
        Ok(Some(Request {
            telecommand: Telecommand::GetImageChunk { first: range.first, count: range.count },
            asked: u32::from(range.count),
            bridged: u32::from(range.bridged),
            justification,
        }))
    }

    /// How many chunks can be asked for so that the answer ends before loss of signal.
    fn chunks_that_fit(&self, now: Now, s: usize, l: usize) -> u16 {
        let Some(los) = self.satellites[s].contact.los() else { return RANGE_MAX };
        let left_us =
            mono_of(now, los).since(now.mono).saturating_sub(self.links[l].config.timing.uplink_us());
        let takes = |count: u16| self.answer_us(s, l, &Telecommand::GetImageChunk { first: 0, count });
        // Monotonic in count: the longest that fits.
        let (mut low, mut high) = (0, RANGE_MAX);
        while low < high {
            let middle = low + (high - low).div_ceil(2);
            if takes(middle) <= left_us { low = middle } else { high = middle - 1 }
        }
        low
    }

    fn queue_request(&mut self, now: Now, s: usize, request: Request) -> Option<CommandId> {
        let me = self.me.clone();
        let sat = &mut self.satellites[s];
        let key = sat.sealer.as_ref()?.id;
        let download = sat.download.as_mut()?;
        if request.asked > 0 {
            download.record.requests += 1;
            download.record.chunks_requested += request.asked;
            download.record.chunks_bridged += request.bridged;
            self.journal.push(Record::Download(download.record.clone()));
        }
        self.ids.command += 1;
        let id = CommandId(self.ids.command);
        let record = CommandRecord {
            id,
            route: download.record.route.clone(),
            key,
            principal: me,
            download: Some(download.record.id),
            telecommand: request.telecommand,
            priority: MACHINE_PRIORITY,
            gate: Self::machine_gate(),
            attempts_allowed: 1,
            created_at: now.utc,
            expires_at: None,
            when: None,
        };
        let about = About {
            route: Some(record.route.clone()),
            key: None,
            subject: Subject {
                command: Some(id),
                download: Some(download.record.id),
                image: download.record.image,
                ..Subject::default()
            },
        };
        self.add_command(now, s, record, "asked for by the download");
        if let Some(message) = request.justification {
            self.event(now.utc, EventKind::Bridge, Level::Normal, about, message);
        }
        Some(id)
    }

    /// A new command: its row, its first stage.
    pub(super) fn add_command(&mut self, now: Now, s: usize, record: CommandRecord, why: &str) {
        let id = record.id;
        self.journal.push(Record::Command(record.clone()));
        let who = record.principal.clone();
        let (route, key, name) = (record.route.clone(), record.key, record.telecommand.name());
        let command = Command {
            record,
            stage: Stage::Queued,
            stage_at: now.utc,
            attempt: 0,
            tag: None,
            on_air_at: None,
            on_air_mono: None,
            before: Before::default(),
            sealed: None,
            not_before: MonoUs(0),
        };
        self.satellites[s].commands.insert(id, command);
        self.journal.push(Record::Stage(crate::record::StageRecord {
            command: id,
            attempt: 0,
            stage: Stage::Queued,
            at: now.utc,
            who,
            why: why.to_owned(),
            frame: None,
        }));
        let subject = Subject { command: Some(id), ..Subject::default() };
        let about = About { route: Some(route), key: Some(key), subject };
        let message = format!("{name} (command {id}) is queued: {why}");
        self.event(now.utc, EventKind::CommandStage, Level::Normal, about, message);
    }

    /// An ImageInfo told what the image is.
    pub(super) fn download_sees_image(&mut self, now: Now, s: usize) {
        let sat = &mut self.satellites[s];
        let (Some(download), Some(image)) = (&mut sat.download, &sat.image) else { return };
        download.ask_info = false;
        download.no_image = 0;
        let id = image.record.id;
        let complete = image.is_complete();
        if download.record.image.is_some_and(|before| before != id) {
            self.end_download(now, s, DownloadState::Failed, "the satellite has another image now");
        } else {
            if download.record.image.is_none() {
                download.record.image = Some(id);
                self.journal.push(Record::Download(download.record.clone()));
            }
            if complete {
                self.end_download(now, s, DownloadState::Complete, "every chunk of it is held");
            }
        }
    }

    /// The satellite has no image, or none that can be used.
    pub(super) fn download_without_image(&mut self, now: Now, s: usize, why: &str) {
        let Some(download) = &mut self.satellites[s].download else { return };
        download.ask_info = true;
        download.no_image += 1;
        download.not_before = now.mono.plus(NO_IMAGE_RETRY_US);
        if download.no_image >= NO_IMAGE_TIMES {
            self.end_download(now, s, DownloadState::Failed, why);
        }
    }

    /// A request of the download was refused. Chunks: what the image is must be asked again, after a while. What the
    /// image is: as if there were none.
    pub(super) fn download_refused(&mut self, now: Now, s: usize, id: CommandId) {
        let sat = &mut self.satellites[s];
        let Some(command) = sat.commands.get(&id) else { return };
        let asked_by = command.record.download;
        let asked_info = command.record.telecommand == Telecommand::GetImageInfo;
        let Some(download) = sat.download.as_mut().filter(|d| Some(d.record.id) == asked_by) else { return };
        if asked_info {
            self.download_without_image(now, s, "the satellite does not tell what its image is");
        } else {
            download.ask_info = true;
            download.not_before = now.mono.plus(REFUSED_US);
        }
    }

    /// The order is over.
    pub(super) fn end_download(&mut self, now: Now, s: usize, state: DownloadState, why: &str) {
        let Some(mut download) = self.satellites[s].download.take() else { return };
        download.record.state = state;
        for run in &mut self.runs {
            run.note_download(download.record.id, state);
        }
        self.journal.push(Record::Download(download.record.clone()));
        let subject = Subject {
            image: download.record.image,
            download: Some(download.record.id),
            ..Subject::default()
        };
        let about = About { route: Some(download.record.route.clone()), key: None, subject };
        let level = if state == DownloadState::Failed { Level::Warning } else { Level::Normal };
        let message = format!("download {} is {}: {why}", download.record.id, state.name());
        self.event(now.utc, EventKind::Download, level, about, message);
    }
}

/// The beginning of a range that still fits; it never ends with chunks that are held.
fn shorten(range: &Range, fits: u16, missing: &[u16]) -> Range {
    let count = range.count.min(fits);
    let end = u32::from(range.first) + u32::from(count);
    let inside: Vec<u16> =
        missing.iter().copied().filter(|&m| m >= range.first && u32::from(m) < end).collect();
    let last = inside.last().copied().unwrap_or(range.first);
    let count = last - range.first + 1;
    let wanted = u16::try_from(inside.len()).unwrap_or(u16::MAX);
    Range { first: range.first, count, bridged: count.saturating_sub(wanted) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shortened_range_ends_with_a_missing_chunk() {
        let range = Range { first: 10, count: 10, bridged: 4 };
        let missing = [10, 11, 15, 17, 18, 19];
        assert_eq!(shorten(&range, 5, &missing), Range { first: 10, count: 2, bridged: 0 });
        assert_eq!(shorten(&range, 64, &missing), range);
    }
}
