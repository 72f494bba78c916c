//! Between the engine's records and the rows of the tables.

use mission::record::{
    ChunkRecord, CommandRecord, DownloadRecord, DownloadState, EventKind, EventRecord, FrameRecord, Gate,
    ImageRecord, LimitRecord, ReceptionRecord, Route, SealedRecord, Source, StageRecord, Subject,
};
use mission::{Accepted, IntentReceipt, Level, Principal, UtcUs};
use mission::{CommandId, DownloadId, FrameId, ImageId, LinkId, SatelliteId, StationId};
use protocol::{FrameForm, KeyId, RequestTag, Telecommand};

use super::StoreError;
use super::rows::{
    ChunkRow, CommandRow, DownloadRow, EventRow, FrameRow, ImageRow, IntentRow, LimitRow, ReceptionRow,
    SealedRow, StageRow,
};

/// An unsigned number of ours as SQLite's signed one.
pub(super) fn int(what: &'static str, value: u64) -> Result<i64, StoreError> {
    i64::try_from(value).map_err(|_| StoreError::OutOfRange { what, value })
}

fn optional(what: &'static str, value: Option<u64>) -> Result<Option<i64>, StoreError> {
    value.map(|value| int(what, value)).transpose()
}

/// A number out of a column that holds only what fits.
pub(super) fn narrow<T: TryFrom<i64>>(column: &str, value: i64) -> Result<T, StoreError> {
    T::try_from(value).map_err(|_| StoreError::damaged(format!("{column} holds {value}")))
}

/// Text out of a column that holds only what can be read.
pub(super) fn parse<T: std::str::FromStr>(column: &str, text: &str) -> Result<T, StoreError> {
    text.parse().map_err(|_| StoreError::damaged(format!("{column} holds '{text}'")))
}

/// Bytes out of a column that holds only that many.
pub(super) fn exactly<const N: usize>(column: &str, bytes: &[u8]) -> Result<[u8; N], StoreError> {
    bytes
        .try_into()
        .map_err(|_| StoreError::damaged(format!("{column} holds {} bytes, not {N}", bytes.len())))
}

fn id_of(column: &str, value: Option<i64>) -> Result<Option<u64>, StoreError> {
    value.map(|value| narrow(column, value)).transpose()
}

pub(super) fn route(satellite: &str, station: &str, link: &str) -> Result<Route, StoreError> {
    Ok(Route {
        satellite: parse("satellite", satellite)?,
        station: parse("station", station)?,
        link: parse("link", link)?,
    })
}

const fn form_name(form: FrameForm) -> &'static str {
    match form {
        FrameForm::Full => "full",
        FrameForm::Short => "short",
    }
}

impl FrameRow {
    pub(super) fn of(record: &FrameRecord) -> Result<Self, StoreError> {
        Ok(Self {
            id: int("frame", record.id.0)?,
            satellite: record.route.satellite.to_string(),
            station: record.route.station.to_string(),
            link: record.route.link.to_string(),
            bytes: record.bytes.to_vec(),
            form: form_name(record.form).into(),
            packet_type: record.packet_type.map(i64::from),
            tag: record.tag.map(|tag| i64::from(tag.get())),
            nested: record.nested,
            heard_at_us: record.heard_at.0,
        })
    }
}

impl ReceptionRow {
    pub(super) fn of(record: &ReceptionRecord) -> Result<Self, StoreError> {
        Ok(Self {
            frame: int("frame", record.frame.0)?,
            satellite: record.route.satellite.to_string(),
            station: record.route.station.to_string(),
            link: record.route.link.to_string(),
            source: record.source.name().into(),
            received_at_us: record.received_at.0,
            rssi_dbm: record.rssi_dbm.map(i64::from),
        })
    }

    /// How the frame came in.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when the word is none of ours.
    pub fn source(&self) -> Result<Source, StoreError> {
        [Source::Radio, Source::File]
            .into_iter()
            .find(|source| source.name() == self.source)
            .ok_or_else(|| StoreError::damaged(format!("receptions.source holds '{}'", self.source)))
    }
}

impl CommandRow {
    pub(super) fn of(record: &CommandRecord) -> Result<Self, StoreError> {
        let mut payload = [0; 196];
        let length = record.telecommand.encode_payload(&mut payload);
        Ok(Self {
            id: int("command", record.id.0)?,
            satellite: record.route.satellite.to_string(),
            station: record.route.station.to_string(),
            link: record.route.link.to_string(),
            key: record.key.to_string(),
            principal: record.principal.to_string(),
            download: optional("download", record.download.map(|id| id.0))?,
            packet_type: i64::from(record.telecommand.packet_type()),
            payload: payload.get(..length).unwrap_or_default().to_vec(),
            name: record.telecommand.name().into(),
            priority: i64::from(record.priority),
            gate: record.gate.name().into(),
            attempts_allowed: i64::from(record.attempts_allowed),
            created_at_us: record.created_at.0,
            expires_at_us: record.expires_at.map(|at| at.0),
        })
    }

    /// The telecommand with its arguments, out of type and payload.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when they are not what [`Telecommand::decode`] takes.
    pub fn telecommand(&self) -> Result<Telecommand, StoreError> {
        let packet_type = narrow("commands.packet_type", self.packet_type)?;
        Telecommand::decode(packet_type, &self.payload)
            .map_err(|error| StoreError::damaged(format!("the payload of command {}: {error}", self.id)))
    }

    pub(super) fn record(&self) -> Result<CommandRecord, StoreError> {
        Ok(CommandRecord {
            id: CommandId(narrow("commands.id", self.id)?),
            route: route(&self.satellite, &self.station, &self.link)?,
            key: parse("commands.key", &self.key)?,
            principal: Principal::new(&self.principal),
            download: id_of("commands.download", self.download)?.map(DownloadId),
            telecommand: self.telecommand()?,
            priority: narrow("commands.priority", self.priority)?,
            gate: [Gate::Heard, Gate::Blind]
                .into_iter()
                .find(|gate| gate.name() == self.gate)
                .ok_or_else(|| StoreError::damaged(format!("commands.gate holds '{}'", self.gate)))?,
            attempts_allowed: narrow("commands.attempts_allowed", self.attempts_allowed)?,
            created_at: UtcUs(self.created_at_us),
            expires_at: self.expires_at_us.map(UtcUs),
            // It stands beside, in a table of its own.
            when: None,
        })
    }
}

impl StageRow {
    pub(super) fn of(record: &StageRecord, route: &Route, key: &str) -> Result<Self, StoreError> {
        Ok(Self {
            command: int("command", record.command.0)?,
            satellite: route.satellite.to_string(),
            station: route.station.to_string(),
            link: route.link.to_string(),
            key: key.into(),
            attempt: i64::from(record.attempt),
            stage: record.stage.name().into(),
            at_us: record.at.0,
            who: record.who.to_string(),
            why: record.why.clone(),
            frame: optional("frame", record.frame.map(|id| id.0))?,
        })
    }
}

impl SealedRow {
    pub(super) fn of(record: &SealedRecord) -> Result<Self, StoreError> {
        Ok(Self {
            key: record.key.to_string(),
            counter: int("counter", record.counter.0)?,
            nonce: record.nonce.as_bytes().to_vec(),
            command: int("command", record.command.0)?,
            attempt: i64::from(record.attempt),
            tag: i64::from(record.tag.get()),
            satellite: record.route.satellite.to_string(),
            station: record.route.station.to_string(),
            link: record.route.link.to_string(),
            bytes: record.bytes.to_vec(),
            sealed_at_us: record.sealed_at.0,
        })
    }

    pub(super) fn tag(&self) -> Result<RequestTag, StoreError> {
        RequestTag::new(narrow("sealed_frames.tag", self.tag)?)
            .ok_or_else(|| StoreError::damaged("sealed_frames.tag holds 0"))
    }
}

impl ImageRow {
    pub(super) fn of(record: &ImageRecord) -> Result<Self, StoreError> {
        Ok(Self {
            id: int("image", record.id.0)?,
            satellite: record.route.satellite.to_string(),
            station: record.route.station.to_string(),
            link: record.route.link.to_string(),
            declared_by: int("frame", record.declared_by.0)?,
            declared_at_us: record.declared_at.0,
            size_bytes: i64::from(record.size_bytes),
            chunks: i64::from(record.chunks),
            width_px: i64::from(record.width_px),
            height_px: i64::from(record.height_px),
            held: i64::from(record.held),
            conflicts: i64::from(record.conflicts),
            completed_at_us: record.completed_at.map(|at| at.0),
            sha256: record.sha256.map(|hash| hash.to_vec()),
        })
    }

    pub(super) fn record(&self) -> Result<ImageRecord, StoreError> {
        Ok(ImageRecord {
            id: ImageId(narrow("images.id", self.id)?),
            route: route(&self.satellite, &self.station, &self.link)?,
            declared_by: FrameId(narrow("images.declared_by", self.declared_by)?),
            declared_at: UtcUs(self.declared_at_us),
            size_bytes: narrow("images.size_bytes", self.size_bytes)?,
            chunks: narrow("images.chunks", self.chunks)?,
            width_px: narrow("images.width_px", self.width_px)?,
            height_px: narrow("images.height_px", self.height_px)?,
            held: narrow("images.held", self.held)?,
            conflicts: narrow("images.conflicts", self.conflicts)?,
            completed_at: self.completed_at_us.map(UtcUs),
            sha256: self.sha256.as_deref().map(|hash| exactly("images.sha256", hash)).transpose()?,
        })
    }
}

impl ChunkRow {
    pub(super) fn of(record: &ChunkRecord) -> Result<Self, StoreError> {
        Ok(Self {
            image: int("image", record.image.0)?,
            chunk_index: i64::from(record.index),
            frame: int("frame", record.frame.0)?,
            satellite: record.route.satellite.to_string(),
            station: record.route.station.to_string(),
            link: record.route.link.to_string(),
            at_us: record.at.0,
            conflict: record.conflict,
            data: record.data.to_vec(),
        })
    }
}

impl DownloadRow {
    pub(super) fn of(record: &DownloadRecord) -> Result<Self, StoreError> {
        Ok(Self {
            id: int("download", record.id.0)?,
            satellite: record.route.satellite.to_string(),
            station: record.route.station.to_string(),
            link: record.route.link.to_string(),
            image: optional("image", record.image.map(|id| id.0))?,
            principal: record.principal.to_string(),
            state: record.state.name().into(),
            created_at_us: record.created_at.0,
            requests: i64::from(record.requests),
            chunks_requested: i64::from(record.chunks_requested),
            chunks_bridged: i64::from(record.chunks_bridged),
        })
    }

    pub(super) fn record(&self) -> Result<DownloadRecord, StoreError> {
        let states =
            [DownloadState::Active, DownloadState::Complete, DownloadState::Cancelled, DownloadState::Failed];
        Ok(DownloadRecord {
            id: DownloadId(narrow("downloads.id", self.id)?),
            route: route(&self.satellite, &self.station, &self.link)?,
            image: id_of("downloads.image", self.image)?.map(ImageId),
            principal: Principal::new(&self.principal),
            state: states
                .into_iter()
                .find(|state| state.name() == self.state)
                .ok_or_else(|| StoreError::damaged(format!("downloads.state holds '{}'", self.state)))?,
            created_at: UtcUs(self.created_at_us),
            requests: narrow("downloads.requests", self.requests)?,
            chunks_requested: narrow("downloads.chunks_requested", self.chunks_requested)?,
            chunks_bridged: narrow("downloads.chunks_bridged", self.chunks_bridged)?,
        })
    }
}

impl LimitRow {
    pub(super) fn of(record: &LimitRecord, station: &StationId) -> Self {
        Self {
            satellite: record.satellite.to_string(),
            parameter: record.parameter.clone(),
            station: station.to_string(),
            level: record.level.name().into(),
            since_us: record.since.0,
            value: record.value.filter(|value| value.is_finite()),
        }
    }

    pub(super) fn record(&self) -> Result<LimitRecord, StoreError> {
        Ok(LimitRecord {
            satellite: parse("limits.satellite", &self.satellite)?,
            parameter: self.parameter.clone(),
            level: parse::<Level>("limits.level", &self.level)?,
            since: UtcUs(self.since_us),
            value: self.value,
        })
    }
}

impl EventRow {
    pub(super) fn of(seq: i64, record: &EventRecord) -> Result<Self, StoreError> {
        Ok(Self {
            seq,
            at_us: record.at.0,
            kind: record.kind.name().into(),
            level: record.level.name().into(),
            satellite: record.satellite.as_ref().map(SatelliteId::to_string),
            station: record.station.to_string(),
            link: record.link.as_ref().map(LinkId::to_string),
            key: record.key.as_ref().map(KeyId::to_string),
            frame: optional("frame", record.subject.frame.map(|id| id.0))?,
            command: optional("command", record.subject.command.map(|id| id.0))?,
            image: optional("image", record.subject.image.map(|id| id.0))?,
            download: optional("download", record.subject.download.map(|id| id.0))?,
            message: record.message.clone(),
        })
    }

    pub(super) fn record(&self) -> Result<EventRecord, StoreError> {
        Ok(EventRecord {
            at: UtcUs(self.at_us),
            kind: EventKind::ALL
                .into_iter()
                .find(|kind| kind.name() == self.kind)
                .ok_or_else(|| StoreError::damaged(format!("events.kind holds '{}'", self.kind)))?,
            level: parse("events.level", &self.level)?,
            satellite: self.satellite.as_deref().map(|name| parse("events.satellite", name)).transpose()?,
            station: parse::<StationId>("events.station", &self.station)?,
            link: self.link.as_deref().map(|name| parse("events.link", name)).transpose()?,
            key: self.key.as_deref().map(|id| parse("events.key", id)).transpose()?,
            subject: Subject {
                frame: id_of("events.frame", self.frame)?.map(FrameId),
                command: id_of("events.command", self.command)?.map(CommandId),
                image: id_of("events.image", self.image)?.map(ImageId),
                download: id_of("events.download", self.download)?.map(DownloadId),
            },
            message: self.message.clone(),
        })
    }
}

impl IntentRow {
    pub(super) fn of(receipt: &IntentReceipt, station: &StationId) -> Result<Self, StoreError> {
        let (accepted, subject) = match receipt.accepted {
            Accepted::Command(id) => ("command", Some(id.0)),
            Accepted::Cancelled(id) => ("cancelled", Some(id.0)),
            Accepted::Download(id) => ("download", Some(id.0)),
            Accepted::DownloadCancelled(id) => ("download-cancelled", Some(id.0)),
            Accepted::Done => ("done", None),
        };
        Ok(Self {
            principal: receipt.principal.to_string(),
            idempotency_key: receipt.idempotency_key.clone(),
            station: station.to_string(),
            digest: receipt.digest.to_vec(),
            accepted: accepted.into(),
            subject: optional("subject", subject)?,
            at_us: receipt.at.0,
        })
    }

    pub(super) fn accepted(&self) -> Result<Accepted, StoreError> {
        let subject = id_of("intents.subject", self.subject)?;
        match (self.accepted.as_str(), subject) {
            ("command", Some(id)) => Ok(Accepted::Command(CommandId(id))),
            ("cancelled", Some(id)) => Ok(Accepted::Cancelled(CommandId(id))),
            ("download", Some(id)) => Ok(Accepted::Download(DownloadId(id))),
            ("download-cancelled", Some(id)) => Ok(Accepted::DownloadCancelled(DownloadId(id))),
            ("done", None) => Ok(Accepted::Done),
            (word, subject) => Err(StoreError::damaged(format!(
                "intents.accepted holds '{word}' with the subject {subject:?}"
            ))),
        }
    }
}
