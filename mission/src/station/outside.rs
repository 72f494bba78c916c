//! What others heard: into the archive and into the gaps of images, and nowhere else.
//!
//! Anyone can make a report up. So nothing of it is contact, answers a command, declares an image, settles what a Reset
//! did or feeds a condition of a plan. A value of the present may raise an alarm, never end one.

use protocol::{DownFrame, Downlink};

use super::intake::Heard;
use super::recent::{Recent, nearness};
use super::{About, Station};
use crate::clock::Now;
use crate::id::{FrameId, LinkId, SatelliteId, StationId};
use crate::level::Level;
use crate::port::Effect;
use crate::reception::{Delivered, ELSEWHERE, Known, NotTaken, Reception, Taken, UNDATED};
use crate::record::{DECODER_VERSION, EventKind, FrameRecord, OutsideRecord, Record, Route, TelemetryRecord};
use crate::telemetry;

/// Above this many waiting records strangers wait: the rest of the room is for the radio.
const ROOM: usize = 20_000;
/// A report of a frame that was heard within this time tells of the present, microseconds.
const FRESH_US: u64 = 600_000_000;
/// So many frames of one delivery have an event each; whoever sends thousands has not that many things to tell.
const TOLD: u32 = 20;

impl Station {
    pub(super) fn take_outside(&mut self, now: Now, delivery: u64, receptions: &[Delivered]) {
        let refuse = if self.stopping {
            Some(NotTaken::Stopping)
        } else if self.journal.failing().is_some() || self.journal.waiting() > ROOM {
            Some(NotTaken::Busy)
        } else if receptions.iter().any(|delivered| self.satellite_index(&delivered.satellite).is_none()) {
            Some(NotTaken::UnknownSatellite)
        } else {
            None
        };
        if let Some(refusal) = refuse {
            self.effects.push_back(Effect::Taken { delivery, result: Err(refusal) });
            return;
        }
        self.recent.make_room(receptions.len());
        let (mut taken, mut told) = (Taken::default(), 0);
        self.kept_raw = 0;
        for delivered in receptions {
            self.take_report(now, delivered, &mut taken, &mut told);
        }
        if self.kept_raw > 0 {
            let message = format!("{} more frames of images that others heard were kept raw", self.kept_raw);
            self.event(now.utc, EventKind::FrameHeard, Level::Normal, About::default(), message);
        }
        self.journal.when_durable(Effect::Taken { delivery, result: Ok(taken) });
    }

    fn take_report(&mut self, now: Now, delivered: &Delivered, taken: &mut Taken, told: &mut u32) {
        let Some(s) = self.satellite_index(&delivered.satellite) else { return };
        let reception = &delivered.reception;
        let parsed = reception.frame().and_then(|bytes| DownFrame::parse(bytes).ok());
        let Some(frame) = parsed else {
            taken.without_frame += 1;
            self.push_outside(now, delivered, None);
            return;
        };
        let at = (reception.received_at, reception.is_dated());
        let remembered = self.recent.find(s, frame.bytes(), at).map(|recent| Known {
            frame: recent.id,
            at: recent.at,
            dated: recent.dated,
        });
        // Of a frame that is remembered memory knows more than the archive said when it was asked, a batch ago: that one
        // does not count, and the others do. So it does not matter how much of what came before was stored by then.
        let near = |known: &Known| nearness(known.at, at.0, known.frame);
        let is_news = |known: &Known| !self.recent.holds(s, frame.bytes(), known.frame);
        let archived = delivered.known.iter().copied().filter(is_news);
        match remembered.into_iter().chain(archived).min_by_key(near) {
            Some(known) => {
                taken.merged += 1;
                self.push_outside(now, delivered, Some(known.frame));
                if at.1 && !known.dated {
                    self.recent.date(Recent {
                        id: known.frame,
                        satellite: s,
                        at: at.0,
                        bytes: frame.bytes().into(),
                        elsewhere: true,
                        dated: true,
                    });
                    self.derive(now, s, delivered, (known.frame, false), &frame, told);
                }
            }
            None => {
                taken.frames += 1;
                self.ids.frame += 1;
                let id = FrameId(self.ids.frame);
                let Some(route) = route(&delivered.satellite, reception) else { return };
                self.journal.push(Record::Frame(FrameRecord {
                    id,
                    route,
                    bytes: frame.bytes().into(),
                    form: frame.form(),
                    packet_type: frame.header().map(|header| header.packet_type),
                    tag: frame.tag(),
                    nested: false,
                    heard_at: reception.received_at,
                }));
                self.push_outside(now, delivered, Some(id));
                self.recent.remember(Recent {
                    id,
                    satellite: s,
                    at: reception.received_at,
                    bytes: frame.bytes().into(),
                    elsewhere: true,
                    dated: at.1,
                });
                self.derive(now, s, delivered, (id, true), &frame, told);
            }
        }
    }

    fn push_outside(&mut self, now: Now, delivered: &Delivered, frame: Option<FrameId>) {
        self.journal.push(Record::Outside(Box::new(OutsideRecord {
            satellite: delivered.satellite.clone(),
            station: self.station.clone(),
            frame,
            reception: delivered.reception.clone(),
            taken_at: now.utc,
        })));
    }

    /// Values, images and what is worth an event, of a frame that is new.
    fn derive(
        &mut self,
        now: Now,
        s: usize,
        delivered: &Delivered,
        (id, is_new): (FrameId, bool),
        frame: &DownFrame<'_>,
        told: &mut u32,
    ) {
        let reception = &delivered.reception;
        let route =
            if is_new { route(&delivered.satellite, reception) } else { undated(&delivered.satellite) };
        let Some(route) = route else { return };
        let Some(link) = self.links.iter().position(|link| link.satellite == s) else { return };
        let mut heard = Heard {
            id,
            route,
            link,
            at: Now { mono: now.mono, utc: reception.received_at },
            tag: None,
            live: false,
            from_radio: false,
            length: frame.bytes().len(),
            repeat: false,
            has_values: false,
            was_undated: false,
            one_of_many: true,
        };
        let is_fresh = reception.is_dated() && now.utc.0.abs_diff(heard.at.utc.0) <= FRESH_US;
        let packet = frame.packet();
        let is_of_image = matches!(packet, Ok(Downlink::ImageInfo(_) | Downlink::ImageChunk(_)));
        let is_worth_it = is_fresh || is_of_image;
        *told += u32::from(is_worth_it);
        heard.one_of_many = *told > TOLD;
        if is_worth_it && !heard.one_of_many {
            let what = packet.as_ref().map_or("frame", Downlink::name);
            let (bytes, ear) = (frame.bytes().len(), reception.ear.name());
            let who = reception.receiver.name.as_deref().or(reception.receiver.id.as_deref());
            let who = who.unwrap_or("somebody");
            let message = format!("{what} of {bytes} bytes was heard by {who}, as {ear} reports");
            self.heard_event(&heard, EventKind::FrameHeard, Level::Normal, message);
        }
        let Ok(packet) = packet else { return };
        if !reception.is_dated() {
            if matches!(packet, Downlink::ImageChunk(_)) {
                let message =
                    "a chunk whose time is not known may belong to another image: kept raw".to_owned();
                self.kept_raw(&heard, EventKind::ChunkReceived, Level::Watch, message);
            }
            return;
        }
        let points = telemetry::points(&packet);
        if !points.is_empty() {
            if is_fresh {
                self.limits_by_others(&heard, &points);
            }
            self.journal.push(Record::Telemetry(TelemetryRecord {
                frame: id,
                route: heard.route.clone(),
                at: heard.at.utc,
                decoder_version: DECODER_VERSION,
                points,
            }));
        }
        if is_of_image {
            self.packet(&heard, &packet);
        }
    }
}

/// How the rows of what others heard are filed.
fn route(satellite: &SatelliteId, reception: &Reception) -> Option<Route> {
    filed(satellite, if reception.is_dated() { reception.ear.name() } else { UNDATED })
}

/// How the values of a frame are filed that came without a time, whoever told it then: as the frame itself is.
pub(super) fn undated(satellite: &SatelliteId) -> Option<Route> {
    filed(satellite, UNDATED)
}

fn filed(satellite: &SatelliteId, link: &str) -> Option<Route> {
    Some(Route {
        satellite: satellite.clone(),
        station: StationId::new(ELSEWHERE).ok()?,
        link: LinkId::new(link).ok()?,
    })
}
