//! Recorded events of an autonomous satellite (ICD section 7).

use crate::{
    PayloadError, down_type,
    wire::{Reader, Walk, Wire, Writer, packet},
};

packet! {
    /// One recorded event, 17 bytes.
    pub struct EventRecord (17 bytes) {
        /// Number of the event since the log began.
        sequence: u32 = ["event.sequence"], "";
        /// Time, ms since 1970 UTC.
        time_ms: u64 = ["event.time"], "ms";
        /// What happened.
        event: u8 = ["event.code"], "";
        /// Its argument.
        argument: u32 = ["event.argument"], "";
    }
}

/// Count and events, at most 13, oldest first.
///
/// The list lives in an array so that a packet stays `Copy`; read it through [`EventReport::events`].
#[derive(Clone, Copy, Debug)]
pub struct EventReport {
    count: u8,
    records: [EventRecord; Self::MAX],
}

impl EventReport {
    /// Most events in one report.
    pub const MAX: usize = 13;
    const EMPTY: EventRecord = EventRecord { sequence: 0, time_ms: 0, event: 0, argument: 0 };

    /// A report of these events; `None` when there are more than 13.
    #[must_use]
    pub fn new(events: &[EventRecord]) -> Option<Self> {
        let mut records = [Self::EMPTY; Self::MAX];
        records.get_mut(..events.len())?.copy_from_slice(events);
        Some(Self { count: events.len() as u8, records })
    }

    /// The events.
    #[must_use]
    pub fn events(&self) -> &[EventRecord] {
        self.records.get(..self.count.into()).unwrap_or(&[])
    }

    pub(super) const fn payload_len(&self) -> usize {
        1 + self.count as usize * EventRecord::LEN
    }

    pub(super) fn decode(payload: &[u8]) -> Result<Self, PayloadError> {
        let (packet_type, found) = (down_type::EVENT_REPORT, payload.len());
        let Some(&count) = payload.first() else {
            return Err(PayloadError::Length { packet_type, found, expected: 1 });
        };
        if usize::from(count) > Self::MAX {
            return Err(PayloadError::Count { found: count, max: Self::MAX as u8 });
        }
        let expected = 1 + usize::from(count) * EventRecord::LEN;
        if found != expected {
            return Err(PayloadError::Length { packet_type, found, expected });
        }
        let mut reader = Reader::new(payload);
        let _count: u8 = reader.read()?;
        let mut records = [Self::EMPTY; Self::MAX];
        for record in records.iter_mut().take(count.into()) {
            *record = reader.read()?;
        }
        Ok(Self { count, records })
    }

    pub(super) fn write(&self, writer: &mut Writer<'_>) {
        writer.write(&self.count);
        self.events().iter().for_each(|event| writer.write(event));
    }

    pub(super) fn walk(&self, walk: &mut Walk<'_>) {
        walk.value(&self.count, &["count"], "");
        for (index, event) in (0..).zip(self.events()) {
            walk.index = Some(index);
            walk.value(event, &[], "");
        }
        walk.index = None;
    }
}

impl PartialEq for EventReport {
    fn eq(&self, other: &Self) -> bool {
        self.events() == other.events()
    }
}
