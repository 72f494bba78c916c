//! Records as the engine makes them.

use std::sync::atomic::{AtomicU64, Ordering};

use mission::record::{
    AuditRecord, ChunkRecord, CommandRecord, CounterFloorRecord, DownloadRecord, DownloadState, EventKind,
    EventRecord, FrameRecord, Gate, ImageRecord, LimitRecord, ReceptionRecord, Record, Route, SealedRecord,
    Source, StageRecord, Subject, TelemetryRecord,
};
use mission::{
    Accepted, Batch, BatchId, CommandId, DownloadId, FrameId, ImageId, IntentReceipt, Level, LinkId,
    Principal, SatelliteId, Stage, StationId, UtcUs,
};
use protocol::{
    Counter, DownFrame, Downlink, FrameForm, Heartbeat, Key, KeyId, Nonce, RequestTag, Telecommand,
    encode_down,
};

pub(super) const NOON_US: i64 = 1_795_000_000_000_000;

/// A batch with a number of its own, as the engine gives them.
pub(super) fn batch(records: Vec<Record>) -> Batch {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    Batch { id: BatchId(NEXT.fetch_add(1, Ordering::Relaxed)), records }
}

pub(super) fn route() -> Route {
    Route {
        satellite: SatelliteId::new("pixelsat-1").unwrap(),
        station: StationId::new("oslo").unwrap(),
        link: LinkId::new("uhf").unwrap(),
    }
}

pub(super) fn other_route() -> Route {
    Route {
        satellite: SatelliteId::new("pixelsat-2").unwrap(),
        station: StationId::new("tromso").unwrap(),
        link: LinkId::new("vhf").unwrap(),
    }
}

pub(super) fn key() -> KeyId {
    Key::from_bytes([7; 16]).id()
}

pub(super) fn heartbeat(number: u64) -> Heartbeat {
    let x = number as f32;
    Heartbeat {
        r_teme_km: [x, -x, 0.1],
        v_teme_km_s: [7.5, 1e-30, -0.0],
        mag_t: [1.0 / 3.0, 2e-5, f32::MIN_POSITIVE],
        omega_rad_s: [0.01; 3],
        accel_m_s2: [f32::NAN, f32::INFINITY, f32::MAX],
        css: [0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
        att_mrp: [0.1, 0.2, 0.3],
        rad: 42.0,
        temp_c: 20.0 + x / 7.0,
        uptime_ms: number as u32 * 1000,
        timestamp_ms: 1_795_000_000_000 + number,
        cam: number.is_multiple_of(2),
    }
}

pub(super) fn frame_of(id: u64, packet: &Downlink, route: &Route) -> FrameRecord {
    let mut bytes = [0; 240];
    let form = if id.is_multiple_of(2) { FrameForm::Full } else { FrameForm::Short };
    let length = encode_down(packet, RequestTag::new((id % 256) as u8), form, &mut bytes);
    let parsed = DownFrame::parse(&bytes[..length]).unwrap();
    FrameRecord {
        id: FrameId(id),
        route: route.clone(),
        bytes: bytes[..length].into(),
        form: parsed.form(),
        packet_type: Some(parsed.packet_type()),
        tag: parsed.tag(),
        nested: false,
        heard_at: UtcUs(NOON_US + id.cast_signed() * 1_000_000),
    }
}

pub(super) fn reception_of(frame: &FrameRecord) -> ReceptionRecord {
    ReceptionRecord {
        frame: frame.id,
        route: frame.route.clone(),
        source: Source::Radio,
        received_at: frame.heard_at,
        rssi_dbm: None,
    }
}

pub(super) fn telemetry_of(frame: &FrameRecord, packet: &Downlink) -> TelemetryRecord {
    TelemetryRecord {
        frame: frame.id,
        route: frame.route.clone(),
        at: frame.heard_at,
        decoder_version: mission::record::DECODER_VERSION,
        points: mission::telemetry::points(packet),
    }
}

pub(super) fn event(kind: EventKind, message: &str) -> EventRecord {
    EventRecord {
        at: UtcUs(NOON_US),
        kind,
        level: Level::Normal,
        satellite: Some(route().satellite),
        station: route().station,
        link: Some(route().link),
        key: None,
        subject: Subject::default(),
        message: message.into(),
    }
}

/// What a heard heartbeat leaves: frame, reception, values, two events.
pub(super) fn heard(id: u64) -> Vec<Record> {
    let packet = Downlink::Heartbeat(heartbeat(id));
    let frame = frame_of(id, &packet, &route());
    let subject = Subject { frame: Some(frame.id), ..Subject::default() };
    vec![
        Record::Reception(reception_of(&frame)),
        Record::Telemetry(telemetry_of(&frame, &packet)),
        Record::Frame(frame),
        Record::Event(EventRecord { subject, ..event(EventKind::FrameHeard, "heard a heartbeat") }),
        Record::Event(EventRecord { subject, ..event(EventKind::Contact, "the satellite is there") }),
    ]
}

pub(super) fn command(id: u64, telecommand: Telecommand) -> CommandRecord {
    CommandRecord {
        id: CommandId(id),
        route: route(),
        key: key(),
        principal: Principal::new("ada"),
        download: None,
        telecommand,
        priority: -3,
        gate: Gate::Heard,
        attempts_allowed: 5,
        created_at: UtcUs(NOON_US + id.cast_signed()),
        expires_at: Some(UtcUs(NOON_US + 3_600_000_000)),
        when: None,
    }
}

pub(super) fn stage(command: u64, attempt: u16, stage: Stage, at_us: i64) -> StageRecord {
    StageRecord {
        command: CommandId(command),
        attempt,
        stage,
        at: UtcUs(at_us),
        who: Principal::engine(),
        why: format!("it is {stage} now"),
        frame: None,
    }
}

pub(super) fn sealed(command: u64, attempt: u16, counter: u64) -> SealedRecord {
    let mut bytes = Box::new([0xa5; 240]);
    bytes[..8].copy_from_slice(b"DESTINY_");
    bytes[8..16].copy_from_slice(&counter.to_be_bytes());
    SealedRecord {
        key: key(),
        counter: Counter(counter),
        nonce: Nonce::new(Counter(counter), [1, 2, 3, 4]),
        command: CommandId(command),
        attempt,
        tag: RequestTag::new((counter % 255 + 1) as u8).unwrap(),
        route: route(),
        bytes,
        sealed_at: UtcUs(NOON_US),
    }
}

pub(super) fn floor(counter: u64) -> CounterFloorRecord {
    CounterFloorRecord {
        key: key(),
        counter: Counter(counter),
        at: UtcUs(NOON_US),
        who: Principal::new("ada"),
    }
}

pub(super) fn image(id: u64, declared_by: u64, chunks: u32) -> ImageRecord {
    ImageRecord {
        id: ImageId(id),
        route: route(),
        declared_by: FrameId(declared_by),
        declared_at: UtcUs(NOON_US),
        size_bytes: chunks * 222 - 100,
        chunks,
        width_px: 640,
        height_px: 480,
        held: 0,
        conflicts: 0,
        completed_at: None,
        sha256: None,
    }
}

pub(super) fn chunk(image: u64, index: u16, frame: u64, fill: u8, conflict: bool) -> ChunkRecord {
    ChunkRecord {
        image: ImageId(image),
        index,
        frame: FrameId(frame),
        route: route(),
        at: UtcUs(NOON_US),
        conflict,
        data: Box::new([fill; 222]),
    }
}

pub(super) fn download(id: u64, image: Option<u64>, state: DownloadState) -> DownloadRecord {
    DownloadRecord {
        id: DownloadId(id),
        route: route(),
        image: image.map(ImageId),
        principal: Principal::new("ada"),
        state,
        created_at: UtcUs(NOON_US),
        requests: 3,
        chunks_requested: 20,
        chunks_bridged: 1,
    }
}

pub(super) fn limit(parameter: &str, level: Level, value: Option<f64>) -> LimitRecord {
    LimitRecord {
        satellite: route().satellite,
        parameter: parameter.into(),
        level,
        since: UtcUs(NOON_US),
        value,
    }
}

pub(super) fn audit(action: &'static str) -> AuditRecord {
    AuditRecord { at: UtcUs(NOON_US), who: Principal::new("ada"), action, detail: "command 1".into() }
}

pub(super) fn receipt(key: &str, accepted: Accepted) -> IntentReceipt {
    IntentReceipt {
        principal: Principal::new("ada"),
        idempotency_key: key.into(),
        digest: [9; 32],
        accepted,
        at: UtcUs(NOON_US),
    }
}
