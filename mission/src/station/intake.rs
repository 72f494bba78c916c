//! Bytes to frames, frames to records: raw first, then what follows from it.

use protocol::{DownFrame, DownItem, Downlink, RequestTag};

use super::link::LastFrame;
use super::recent::Recent;
use super::{About, Station};
use crate::clock::{Now, UtcUs};
use crate::id::{FrameId, LinkId};
use crate::level::Level;
use crate::port::ReservedFrame;
use crate::record::{
    DECODER_VERSION, EventKind, FrameRecord, ReceptionRecord, ReceptionRssi, Record, Route, Source, Subject,
    TelemetryRecord,
};
use crate::telemetry;

/// A frame that has just been taken in.
#[derive(Debug, Clone)]
pub(super) struct Heard {
    pub(super) id: FrameId,
    pub(super) route: Route,
    pub(super) link: usize,
    pub(super) at: Now,
    pub(super) tag: Option<RequestTag>,
    /// From our own radio, now: it tells about the present. Otherwise it only fills the archive.
    pub(super) live: bool,
    /// From our own radio, now or before storage failed.
    pub(super) from_radio: bool,
    /// Bytes of the frame, for how long it was on the air.
    pub(super) length: usize,
    /// These bytes were heard a moment ago already, by our radio.
    pub(super) repeat: bool,
    /// Its values are in the archive: somebody else's report of it came first.
    pub(super) has_values: bool,
    /// Somebody else's report of it came first, without a time: its values are filed as the frame is.
    pub(super) was_undated: bool,
    /// One of thousands: what it does not change is not told of it alone.
    pub(super) one_of_many: bool,
}

/// How a frame came in.
struct How {
    nested: bool,
    promoted: bool,
    source: Source,
    rssi_dbm: Option<i16>,
}

/// The rows of a frame that was heard.
fn rows(
    id: FrameId,
    route: Route,
    frame: &DownFrame<'_>,
    how: &How,
    heard_at: UtcUs,
) -> (FrameRecord, ReceptionRecord) {
    let record = FrameRecord {
        id,
        route: route.clone(),
        bytes: frame.bytes().into(),
        form: frame.form(),
        packet_type: frame.header().map(|header| header.packet_type),
        tag: frame.tag(),
        nested: how.nested,
        heard_at,
    };
    let reception = ReceptionRecord {
        frame: id,
        route,
        source: how.source,
        received_at: heard_at,
        rssi_dbm: how.rssi_dbm,
    };
    (record, reception)
}

/// An item of the decoder with its bytes, so that the decoder is free again.
enum Item {
    Frame { offset: u64, bytes: Box<[u8]>, nested: bool, promoted: bool, rssi_dbm: Option<i16> },
    Rssi { offset: u64, dbm: i16 },
}

/// Keeps an item; a level that follows its frame at once joins it.
fn collect(items: &mut Vec<Item>, item: DownItem<'_>) {
    let frame_item = |offset, frame: DownFrame<'_>, nested, promoted| Item::Frame {
        offset,
        bytes: frame.bytes().into(),
        nested,
        promoted,
        rssi_dbm: None,
    };
    match item {
        DownItem::Frame { offset, frame, nested } => items.push(frame_item(offset, frame, nested, false)),
        DownItem::Promoted { offset, frame } => items.push(frame_item(offset, frame, false, true)),
        DownItem::Rssi { frame_offset, dbm } => {
            let of_frame = items.iter_mut().rev().find_map(|item| match item {
                Item::Frame { offset, rssi_dbm, promoted: false, .. } if *offset == frame_offset => {
                    Some(rssi_dbm)
                }
                _ => None,
            });
            match of_frame {
                Some(level) => *level = Some(dbm),
                None => items.push(Item::Rssi { offset: frame_offset, dbm }),
            }
        }
    }
}

impl Station {
    pub(super) fn take_bytes(&mut self, link: &LinkId, bytes: &[u8], source: Source, received: Now) {
        let Some(l) = self.link_index(link) else { return };
        let mut items = Vec::new();
        self.links[l].last_bytes = received.mono;
        self.links[l].decoder.push(bytes, &mut |item| collect(&mut items, item));
        self.take_items(l, items, source, received);
    }

    /// A line that has gone quiet decides what was nested in a candidate that will not end any more.
    pub(super) fn end_silence(&mut self, now: Now) {
        for l in 0..self.links.len() {
            let link = &mut self.links[l];
            if link.decoder.in_frame() && now.mono >= link.receiving_until() {
                let mut items = Vec::new();
                link.decoder.silence(&mut |item| collect(&mut items, item));
                let source = if link.config.receive_only { Source::File } else { Source::Radio };
                self.take_items(l, items, source, now);
            }
        }
    }

    fn take_items(&mut self, l: usize, items: Vec<Item>, source: Source, received: Now) {
        for item in items {
            match item {
                Item::Frame { offset, bytes, nested, promoted, rssi_dbm } => {
                    let Ok(frame) = DownFrame::parse(&bytes) else { continue };
                    let rssi_dbm = rssi_dbm.or_else(|| promoted.then_some(self.links[l].rssi_dbm).flatten());
                    let how = How { nested, promoted, source, rssi_dbm };
                    let link = &mut self.links[l];
                    link.rssi_dbm = rssi_dbm.or(link.rssi_dbm);
                    link.last_frame = None;
                    let Some(heard) = self.archive(l, &frame, how, received) else { continue };
                    let link = &mut self.links[l];
                    link.last_frame = Some(LastFrame {
                        offset,
                        frame: heard.id,
                        route: heard.route.clone(),
                        received_at: heard.at.utc,
                    });
                    if !nested {
                        self.interpret(&heard, &frame);
                    }
                }
                Item::Rssi { offset, dbm } => self.late_rssi(l, offset, dbm),
            }
        }
    }

    fn late_rssi(&mut self, l: usize, offset: u64, dbm: i16) {
        let link = &mut self.links[l];
        link.rssi_dbm = Some(dbm);
        let Some(last) = link.last_frame.take_if(|last| last.offset == offset) else { return };
        self.journal.push(Record::ReceptionRssi(ReceptionRssi {
            frame: last.frame,
            route: last.route,
            received_at: last.received_at,
            rssi_dbm: dbm,
        }));
    }

    /// A frame that the reserve kept while storage failed: it fills the archive, it tells nothing of the present.
    pub(super) fn take_recovered(&mut self, kept: &ReservedFrame) {
        self.journal.mark_reserve_dirty();
        let Ok(frame) = DownFrame::parse(&kept.bytes) else { return };
        let at = Now { mono: crate::clock::MonoUs(0), utc: kept.received_at };
        let how = How { nested: false, promoted: false, source: kept.source, rssi_dbm: kept.rssi_dbm };
        let Some(l) = self.link_index(&kept.route.link) else {
            // The link has left the configuration since: the frame is kept all the same.
            self.ids.frame += 1;
            let id = FrameId(self.ids.frame);
            let (record, reception) = rows(id, kept.route.clone(), &frame, &how, kept.received_at);
            self.journal.push_frame(record, reception);
            return;
        };
        if let Some(heard) = self.archive(l, &frame, how, at) {
            self.interpret(&Heard { live: false, ..heard }, &frame);
        }
    }

    /// A frame that another station heard and stored. What it says of an image enters ours, as late news would; it answers
    /// nothing of ours and tells nothing of the contact here.
    pub(super) fn take_elsewhere(&mut self, now: Now, id: FrameId, kept: &ReservedFrame) {
        let Ok(frame) = DownFrame::parse(&kept.bytes) else { return };
        let Ok(packet @ (Downlink::ImageInfo(_) | Downlink::ImageChunk(_))) = frame.packet() else { return };
        let satellite = &kept.route.satellite;
        let Some(link) = self.links.iter().position(|l| self.satellites[l.satellite].id == *satellite) else {
            return;
        };
        let heard = Heard {
            id,
            route: kept.route.clone(),
            link,
            at: Now { mono: now.mono, utc: kept.received_at },
            tag: None,
            live: false,
            from_radio: kept.source == Source::Radio,
            length: frame.bytes().len(),
            repeat: false,
            has_values: false,
            was_undated: false,
            one_of_many: false,
        };
        self.packet(&heard, &packet);
    }

    /// Raw frame and reception, before anything else. What was promoted is stored already, as nested. `None` when there
    /// is no room for the frame: then nothing may follow from it.
    fn archive(&mut self, l: usize, frame: &DownFrame<'_>, how: How, received: Now) -> Option<Heard> {
        let route = self.route(l);
        let satellite = self.links[l].satellite;
        let known = self.recent.find(satellite, frame.bytes(), (received.utc, true)).map(|recent| {
            let others_first = std::mem::take(&mut recent.elsewhere);
            let has_values = std::mem::replace(&mut recent.dated, true);
            if !has_values {
                recent.at = received.utc;
            }
            (recent.id, others_first, has_values)
        });
        let id = known.map(|(id, ..)| id).unwrap_or_else(|| {
            self.ids.frame += 1;
            FrameId(self.ids.frame)
        });
        let heard = Heard {
            id,
            route: route.clone(),
            link: l,
            at: received,
            tag: frame.tag(),
            live: how.source == Source::Radio,
            from_radio: how.source == Source::Radio,
            length: frame.bytes().len(),
            repeat: known.is_some_and(|(_, others_first, _)| !others_first) && !how.promoted,
            has_values: known.is_some_and(|(_, others_first, has_values)| others_first && has_values),
            was_undated: known.is_some_and(|(_, others_first, has_values)| others_first && !has_values),
            one_of_many: false,
        };
        let (record, reception) = rows(id, route.clone(), frame, &how, received.utc);
        if how.promoted && known.is_some() {
            self.journal.push(Record::Frame(record));
            return Some(heard);
        }
        if known.is_some() {
            self.journal.push_reception(reception);
        } else if self.journal.push_frame(record, reception) {
            self.recent.remember(Recent {
                id,
                satellite,
                at: received.utc,
                bytes: frame.bytes().into(),
                elsewhere: false,
                dated: true,
            });
        } else {
            return None;
        }
        let message = format!(
            "{}{} of {} bytes heard over {}",
            frame.packet().map_or("frame", |packet| packet.name()),
            if how.nested { " (inside another frame)" } else { "" },
            frame.bytes().len(),
            route.link
        );
        self.heard_event(&heard, EventKind::FrameHeard, Level::Normal, message);
        Some(heard)
    }

    /// Values, then what the packet changes.
    fn interpret(&mut self, heard: &Heard, frame: &DownFrame<'_>) {
        if heard.live {
            self.heard_live(heard, frame.packet_type());
        }
        let packet = match frame.packet() {
            Ok(packet) => packet,
            Err(error) => {
                let message = match frame.packet_type() {
                    protocol::down_type::HEARTBEAT => {
                        format!("unknown heartbeat layout ({} bytes): kept raw", frame.payload().len())
                    }
                    _ => format!("a frame is kept raw, its packet cannot be read: {error}"),
                };
                self.heard_event(heard, EventKind::FrameHeard, Level::Watch, message);
                return;
            }
        };
        let points = telemetry::points(&packet);
        if !points.is_empty() && !heard.repeat {
            if heard.live {
                self.limits(heard, &points);
                self.note_readings(heard, &points);
            }
            if !heard.has_values {
                let filed =
                    heard.was_undated.then(|| super::outside::undated(&heard.route.satellite)).flatten();
                self.journal.push(Record::Telemetry(TelemetryRecord {
                    frame: heard.id,
                    route: filed.unwrap_or_else(|| heard.route.clone()),
                    at: heard.at.utc,
                    decoder_version: DECODER_VERSION,
                    points,
                }));
            }
        }
        self.packet(heard, &packet);
    }

    /// An event about a frame that was heard and is kept as its bytes alone.
    pub(super) fn kept_raw(&mut self, heard: &Heard, kind: EventKind, level: Level, message: String) {
        if heard.one_of_many {
            self.kept_raw += 1;
        } else {
            self.heard_event(heard, kind, level, message);
        }
    }

    /// An event about a frame that was heard.
    pub(super) fn heard_event(&mut self, heard: &Heard, kind: EventKind, level: Level, message: String) {
        let subject = Subject { frame: Some(heard.id), ..Subject::default() };
        let about = About { route: Some(heard.route.clone()), subject, ..About::default() };
        self.event(heard.at.utc, kind, level, about, message);
    }
}
