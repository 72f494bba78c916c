//! What a packet changes: contact, limits, images, and the command that it answers.

use protocol::{
    Answer, Downlink, ErrorCode, FRAME_LEN, Heartbeat, ImageChunk, ImageInfo, RequestTag, Telecommand,
    down_type,
};

use super::image::{Assembly, Fit, is_usable};
use super::intake::Heard;
use super::satellite::{Command, Exchange};
use super::{About, Station};
use crate::id::{CommandId, ImageId};
use crate::level::Level;
use crate::record::{
    ChunkRecord, DownloadState, EventKind, ImageRecord, LimitRecord, Point, Record, Subject,
};
use crate::stage::Stage;

/// A tag means an old request for this long; then it may have been used again (255 requests take 10 minutes).
const LATE_ANSWER_US: i64 = 300_000_000;

impl Station {
    /// A frame of the satellite was received just now, whatever is in it.
    pub(super) fn heard_live(&mut self, heard: &Heard, packet_type: u8) {
        let s = self.links[heard.link].satellite;
        let timing = self.links[heard.link].config.timing;
        let delay_us = timing.delivery_us(heard.length) + timing.frame_us(heard.length);
        let sat = &mut self.satellites[s];
        sat.contact.heard(heard.at);
        // Without tags the answer to a SetTimestamp looks like a heartbeat of the rhythm, which it does not move.
        let is_answer = !sat.profile.tags
            && matches!(&sat.exchange, Exchange::Awaiting(a) if a.answer == Answer::One(down_type::HEARTBEAT));
        if packet_type == down_type::HEARTBEAT && heard.tag.is_none() && !is_answer {
            sat.contact.heartbeat(heard.at, delay_us);
        }
        if packet_type != down_type::IMAGE_CHUNK {
            self.links[heard.link].chunk_row_broken();
        }
        self.note_contact(heard.at, s);
    }

    /// Takes a packet in.
    pub(super) fn packet(&mut self, heard: &Heard, packet: &Downlink) {
        let s = self.links[heard.link].satellite;
        let answered = if heard.live { self.answers(heard, s, packet) } else { None };
        match packet {
            Downlink::Heartbeat(heartbeat) => self.heartbeat(heard, s, heartbeat),
            Downlink::ImageInfo(info) => self.image_info(heard, s, info, answered),
            Downlink::ImageChunk(chunk) => self.image_chunk(heard, s, chunk),
            Downlink::Error(code) if heard.tag.is_none() => {
                let (level, message) = (error_level(*code), format!("the satellite reports {code}"));
                self.heard_event(heard, EventKind::SatelliteError, level, message);
            }
            _ => {}
        }
    }

    /// The command that this packet answers, if any: it has reached its stage.
    fn answers(&mut self, heard: &Heard, s: usize, packet: &Downlink) -> Option<CommandId> {
        let sat = &self.satellites[s];
        if sat.profile.tags && heard.tag.is_none() {
            if matches!(packet, Downlink::ImageChunk(_)) {
                // Chunks by the satellite's own schedule: the next one follows soon.
                self.let_it_finish(heard, s);
            }
            return None;
        }
        let expected = |answer: Answer, tag: RequestTag| {
            let is_kind = match (answer, packet) {
                (_, Downlink::Error(_)) => true,
                (Answer::One(kind), packet) => packet.packet_type() == kind,
                (Answer::Chunks, Downlink::ImageChunk(_)) => true,
                _ => false,
            };
            // Without tags an Error is the answer to a request that has one: a Reset is followed by an Error of the
            // satellite's own accord, which says nothing of it.
            is_kind && if sat.profile.tags { heard.tag == Some(tag) } else { answer != Answer::None }
        };
        let in_exchange = match &sat.exchange {
            Exchange::Awaiting(awaited) if expected(awaited.answer, awaited.tag) => Some(awaited.command),
            // The radio's word may come after the answer; without tags, what was heard before is not told from that.
            Exchange::OnAir { frame, .. } if sat.profile.tags => sat
                .commands
                .get(&frame.command)
                .filter(|c| expected(c.record.telecommand.answer(), frame.tag))
                .map(|c| c.record.id),
            _ => None,
        };
        let settling = || {
            let waits = sat.settling.iter().find(|w| expected(w.answer, w.tag));
            waits.map(|w| w.command)
        };
        let late = || {
            // An answer after its time: only a tag can say to what.
            let tag = heard.tag.filter(|_| sat.profile.tags)?;
            let unknown =
                sat.commands.values().rev().filter(|c| c.stage == Stage::Unknown || c.stage == Stage::Queued);
            let lately = |c: &&Command| {
                c.since_on_air_us(heard.at).is_some_and(|us| (0..LATE_ANSWER_US).contains(&us))
            };
            unknown
                .filter(lately)
                .filter(|c| c.tag == Some(tag) && expected(c.record.telecommand.answer(), tag))
                .map(|c| c.record.id)
                .next()
        };
        let Some(command) = in_exchange.or_else(settling).or_else(late) else {
            // An answer to a request that we do not know (another life's, another ground's): let it finish.
            self.let_it_finish(heard, s);
            return None;
        };
        if let Downlink::ImageChunk(chunk) = packet {
            self.links[heard.link].chunk_received(chunk.index.0, heard.at.mono);
        }
        self.answered(heard, s, command, packet);
        self.advance_answer(heard, s, command, packet);
        Some(command)
    }

    /// The satellite is sending something that takes more than one frame, perhaps: nothing of ours for so long.
    fn let_it_finish(&mut self, heard: &Heard, s: usize) {
        let quiet = self.links[heard.link].chunk_period_us() * 5 / 2;
        let contact = &mut self.satellites[s].contact;
        contact.quiet_until = contact.quiet_until.max(heard.at.mono.plus(quiet));
    }

    /// The stage that an answer proves.
    fn answered(&mut self, heard: &Heard, s: usize, command: CommandId, packet: &Downlink) {
        let Some(known) = self.satellites[s].commands.get(&command) else { return };
        let telecommand = &known.record.telecommand;
        let (stage, why) = match packet {
            Downlink::Error(code) => (Stage::Rejected, format!("the satellite answered with {code}")),
            Downlink::ImageInfo(info)
                if !info.exists && matches!(telecommand, Telecommand::CaptureImage { .. }) =>
            {
                return; // Still capturing.
            }
            packet => (Stage::Answered, format!("{} with its tag was heard", packet.name())),
        };
        if stage == Stage::Rejected {
            self.satellites[s].captures.remove(&command);
            self.download_refused(heard.at, s, command);
        }
        self.stage(heard.at, s, command, stage, &why, Some(heard.id));
    }

    /// The exchange goes on or ends with this answer.
    fn advance_answer(&mut self, heard: &Heard, s: usize, command: CommandId, packet: &Downlink) {
        let Self { satellites, links, .. } = self;
        let sat = &mut satellites[s];
        let is_error = matches!(packet, Downlink::Error(_));
        sat.settling.retain(|w| w.command != command || (w.answer == Answer::Chunks && !is_error));
        let Exchange::Awaiting(awaited) = &mut sat.exchange else { return };
        if awaited.command != command {
            return;
        }
        let link = &links[awaited.link];
        let after = match packet {
            Downlink::ImageChunk(chunk) => {
                awaited.got = awaited.got.saturating_add(1);
                // One that was not asked for says nothing of what is still to come.
                let Some(after) = awaited.chunks_after(chunk.index.0) else { return };
                after
            }
            Downlink::ImageInfo(info) if !info.exists && matches!(awaited.answer, Answer::One(_)) => {
                // The answer to a CaptureImage comes when the picture is taken; one to GetImageInfo is the answer.
                u64::from(sat.commands.contains_key(&command))
            }
            _ => 0,
        };
        if after == 0 {
            sat.exchange = Exchange::Idle;
        } else if awaited.answer == Answer::Chunks {
            let stretch = after * link.chunk_period_us();
            let heartbeat = link.config.timing.frame_us(FRAME_LEN) * sat.contact.heartbeats_within(stretch);
            awaited.deadline = heard.at.mono.plus(stretch + heartbeat + link.margin_us());
        }
    }

    fn heartbeat(&mut self, heard: &Heard, s: usize, heartbeat: &Heartbeat) {
        if heard.live && !heard.repeat {
            self.settle_by_heartbeat(heard, s, heartbeat.uptime_ms);
            self.satellites[s].uptime = Some((heard.at.utc, heartbeat.uptime_ms));
        }
    }

    /// Holds the values against their limits.
    pub(super) fn limits(&mut self, heard: &Heard, points: &[Point]) {
        let s = self.links[heard.link].satellite;
        for point in points {
            self.limit(heard, s, &point.parameter, point.value.unwrap_or(f64::NAN));
        }
    }

    /// What others report of the present may raise an alarm; that all is well again only our own radio can say.
    pub(super) fn limits_by_others(&mut self, heard: &Heard, points: &[Point]) {
        let s = self.links[heard.link].satellite;
        for point in points {
            let value = point.value.unwrap_or(f64::NAN);
            let known = self.satellites[s].limits.iter().find(|limit| limit.parameter() == point.parameter);
            if known.is_some_and(|limit| limit.is_worse(value)) {
                self.limit(heard, s, &point.parameter, value);
            }
        }
    }

    fn limit(&mut self, heard: &Heard, s: usize, parameter: &str, value: f64) {
        let sat = &mut self.satellites[s];
        let Some(limit) = sat.limits.iter_mut().find(|limit| limit.parameter() == parameter) else { return };
        let before = limit.level();
        let Some(level) = limit.sample(value) else { return };
        let record = LimitRecord {
            satellite: sat.id.clone(),
            parameter: parameter.to_owned(),
            level,
            since: heard.at.utc,
            value: Some(value).filter(|v| v.is_finite()),
        };
        self.journal.push(Record::Limit(record));
        let message = format!("{parameter} is {value}: {before} became {level}");
        self.heard_event(heard, EventKind::Limit, level, message);
    }

    fn image_info(&mut self, heard: &Heard, s: usize, info: &ImageInfo, answers: Option<CommandId>) {
        if !info.exists {
            if answers.is_some() {
                self.download_without_image(heard.at, s, "the satellite has no image");
            }
            return;
        }
        if !is_usable(info) {
            let message =
                format!("ImageInfo is not used: {} chunks do not fit {} bytes", info.chunks, info.size_bytes);
            self.kept_raw(heard, EventKind::ImageDeclared, Level::Distress, message);
            if answers.is_some() {
                self.download_without_image(
                    heard.at,
                    s,
                    "what the satellite says of its image makes no sense",
                );
            }
            return;
        }
        let sat = &mut self.satellites[s];
        let differs = sat.image.as_ref().is_none_or(|image| !image.is(info));
        // What comes from a file, or from before a failure of the storage, must not displace what is newer.
        let is_news = heard.live
            || (heard.from_radio
                && sat.image.as_ref().is_none_or(|image| image.record.declared_at < heard.at.utc));
        if !is_news {
            if differs {
                let message =
                    "ImageInfo tells of another image, but not from our radio now: kept raw".to_owned();
                self.kept_raw(heard, EventKind::ImageDeclared, Level::Watch, message);
            }
            return;
        }
        if differs || (heard.live && !sat.captures.is_empty()) {
            if heard.live {
                sat.captures.clear();
            }
            self.ids.image += 1;
            let record = ImageRecord {
                id: ImageId(self.ids.image),
                route: heard.route.clone(),
                declared_by: heard.id,
                declared_at: heard.at.utc,
                size_bytes: info.size_bytes,
                chunks: info.chunks,
                width_px: info.width_px,
                height_px: info.height_px,
                held: 0,
                conflicts: 0,
                completed_at: None,
                sha256: None,
            };
            let message = format!(
                "image {} declared: {} x {}, {} bytes in {} chunks",
                record.id, record.width_px, record.height_px, record.size_bytes, record.chunks
            );
            sat.image = Some(Assembly::new(record.clone()));
            self.journal.push(Record::Image(record.clone()));
            let subject = Subject { frame: Some(heard.id), image: Some(record.id), ..Subject::default() };
            let about = About { route: Some(heard.route.clone()), subject, ..About::default() };
            self.event(heard.at.utc, EventKind::ImageDeclared, Level::Normal, about, message);
        }
        self.download_sees_image(heard.at, s);
    }

    fn image_chunk(&mut self, heard: &Heard, s: usize, chunk: &ImageChunk) {
        let index = chunk.index.0;
        let Some(image) = &mut self.satellites[s].image else {
            let message = format!("chunk {index} of an image that nobody has declared: kept raw");
            self.kept_raw(heard, EventKind::ChunkReceived, Level::Watch, message);
            return;
        };
        if !heard.live && heard.at.utc < image.record.declared_at {
            let message =
                format!("chunk {index} was heard before image {} was declared: kept raw", image.record.id);
            self.kept_raw(heard, EventKind::ChunkReceived, Level::Watch, message);
            return;
        }
        let was_complete = image.is_complete();
        let fit = image.fit(index, &chunk.data);
        let id = image.record.id;
        let (keep, conflict) = match fit {
            Fit::New => (true, false),
            Fit::Same => return,
            Fit::Conflict { keep } => (keep, true),
            Fit::Outside => {
                let chunks = image.record.chunks;
                let message = format!("chunk {index} lies outside image {id} of {chunks} chunks: kept raw");
                self.kept_raw(heard, EventKind::ChunkReceived, Level::Watch, message);
                return;
            }
        };
        if !was_complete && image.is_complete() {
            image.record.completed_at = Some(heard.at.utc);
            image.record.sha256 = Some(image.sha256());
        }
        let record = image.record.clone();
        if keep {
            self.journal.push(Record::Chunk(ChunkRecord {
                image: id,
                index,
                frame: heard.id,
                route: heard.route.clone(),
                at: heard.at.utc,
                conflict,
                data: Box::new(chunk.data),
            }));
        }
        self.journal.push(Record::Image(record.clone()));
        let subject = Subject { frame: Some(heard.id), image: Some(id), ..Subject::default() };
        let about = About { route: Some(heard.route.clone()), subject, ..About::default() };
        let (kind, level, message) = if conflict {
            let message =
                format!("chunk {index} of image {id} came with other bytes than those held: both are kept");
            (EventKind::ChunkConflict, Level::Warning, message)
        } else {
            let message = format!("chunk {index} of image {id}: {} of {} held", record.held, record.chunks);
            (EventKind::ChunkReceived, Level::Normal, message)
        };
        self.event(heard.at.utc, kind, level, about.clone(), message);
        if !was_complete && record.completed_at.is_some() {
            let message =
                format!("image {id} is whole: {} bytes, {} conflicts", record.size_bytes, record.conflicts);
            self.event(heard.at.utc, EventKind::ImageComplete, Level::Normal, about, message);
            self.end_download(heard.at, s, DownloadState::Complete, "its image is whole");
        }
    }
}

/// How much an error of the satellite's own accord should worry somebody.
fn error_level(code: ErrorCode) -> Level {
    match code.0 {
        1..=4 | 17 | 19 => Level::Watch,
        16 | 18 | 20..=22 | 33..=35 => Level::Warning,
        32 => Level::Distress,
        23 | 36 => Level::Critical,
        _ => Level::Watch,
    }
}
