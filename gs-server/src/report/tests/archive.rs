//! One pass of the ISS over Lausanne with everything that a report tells, and a little before and after it.

use std::sync::Arc;

use mission::plan::{CheckContext, Progress, RunEnd, StepEnd, StepResult};
use mission::record::{
    ChunkRecord, CommandRecord, ElementsRecord, EventKind, EventRecord, FrameRecord, Gate, ImageRecord,
    PassRecord, ReceptionRecord, Record, Route, Source, StageRecord, Subject,
};
use mission::run::{PlanRecord, RunRecord, RunState};
use mission::{
    Batch, BatchId, CommandId, ElementsId, FrameId, ImageId, Level, LinkConfig, LinkId, PassId, PlanId,
    Principal, Profile, RunId, SatelliteConfig, SatelliteId, Site, Stage, StationConfig, StationId, UtcUs,
};
use protocol::{
    ChunkIndex, DownFrame, Downlink, FrameForm, Heartbeat, ImageChunk, ImageInfo, Key, RequestTag,
    Telecommand, encode_down,
};
use radio::airtime::{LinkTiming, LoraPhy};
use tle::formats::{Checksums, sets};
use tle::{EarthOrientation, Elements, Station};

use super::super::orbit::{numbered, passes_ahead};
use crate::http::Identity;
use crate::plan::check_words;
use crate::storage::{Store, StoreOptions};

/// 2026-11-22T00:00:00Z.
pub(super) const MIDNIGHT_US: i64 = 1_795_305_600_000_000;
pub(super) const S: i64 = 1_000_000;
/// What a page must not believe.
pub(super) const EVIL: &str = "<script>alert(\"x\")</script>|`*\u{202e}&'\n# h";

const OMM: &str = r#"[{"OBJECT_NAME": "ISS (ZARYA)", "OBJECT_ID": "1998-067A", "NORAD_CAT_ID": 25544,
    "EPOCH": "2026-11-21T22:00:00.000000", "MEAN_MOTION": 15.495, "ECCENTRICITY": 0.0001413,
    "INCLINATION": 51.6461, "RA_OF_ASC_NODE": 221.2784, "ARG_OF_PERICENTER": 89.1723,
    "MEAN_ANOMALY": 280.4612, "BSTAR": 0.00003}]"#;
const PLAN: &str = r#"{"name":"night","satellite":"pixelsat-1","transmit":true,
    "steps":[{"do":"listen","for_s":5},{"do":"command","command":"Ping"},{"do":"download-image"}]}"#;

pub(super) struct Archive {
    pub(super) store: Store,
    pub(super) identity: Identity,
    /// AOS, TCA, LOS of pass 1.
    pub(super) times: (i64, i64, i64),
    _folder: tempfile::TempDir,
}

fn satellite() -> SatelliteId {
    SatelliteId::new("pixelsat-1").unwrap()
}

fn route() -> Route {
    Route {
        satellite: satellite(),
        station: StationId::new("lausanne").unwrap(),
        link: LinkId::new("e22").unwrap(),
    }
}

fn config() -> StationConfig {
    let place = Station::new(46.5191, 6.5668, 410.0).unwrap();
    StationConfig {
        station: route().station,
        site: Some(Site { place, min_elevation_deg: 5.0, orientation: EarthOrientation::new(0.0).unwrap() }),
        times: Default::default(),
        satellites: vec![SatelliteConfig {
            id: satellite(),
            profile: Profile::default(),
            key: Some(Key::from_bytes([7; 16])),
            limits: Vec::new(),
        }],
        links: vec![LinkConfig {
            id: route().link,
            satellite: satellite(),
            timing: LinkTiming { phy: LoraPhy::LIKELY_2K4, baud: 9600, turn_round_us: 100_000 },
            armed: true,
            receive_only: false,
        }],
    }
}

/// What the engine would have written.
struct Writer {
    records: Vec<Record>,
    frames: u64,
}

impl Writer {
    fn heard(&mut self, at_us: i64, packet: &Downlink, rssi_dbm: Option<i16>) -> u64 {
        self.frames += 1;
        let id = FrameId(self.frames);
        let mut bytes = [0; 240];
        let length = encode_down(packet, RequestTag::new(1), FrameForm::Full, &mut bytes);
        let parsed = DownFrame::parse(&bytes[..length]).unwrap();
        self.records.push(Record::Frame(FrameRecord {
            id,
            route: route(),
            bytes: bytes[..length].into(),
            form: parsed.form(),
            packet_type: Some(parsed.packet_type()),
            tag: parsed.tag(),
            nested: false,
            heard_at: UtcUs(at_us),
        }));
        self.records.push(Record::Reception(ReceptionRecord {
            frame: id,
            route: route(),
            source: Source::Radio,
            received_at: UtcUs(at_us),
            rssi_dbm,
        }));
        self.frames
    }

    fn command(&mut self, id: u64, telecommand: Telecommand, who: &str, stages: &[(Stage, i64)]) {
        self.records.push(Record::Command(CommandRecord {
            id: CommandId(id),
            route: route(),
            key: Key::from_bytes([7; 16]).id(),
            principal: Principal::new(who),
            download: None,
            telecommand,
            priority: 0,
            gate: Gate::Heard,
            attempts_allowed: 3,
            created_at: UtcUs(stages[0].1),
            expires_at: None,
            when: None,
        }));
        for (stage, at_us) in stages {
            self.records.push(Record::Stage(StageRecord {
                command: CommandId(id),
                attempt: 1,
                stage: *stage,
                at: UtcUs(*at_us),
                who: Principal::engine(),
                why: if *stage == Stage::Unknown { EVIL.to_owned() } else { format!("it is {stage}") },
                frame: None,
            }));
        }
    }

    fn event(&mut self, at_us: i64, kind: EventKind, level: Level, message: &str) {
        self.records.push(Record::Event(EventRecord {
            at: UtcUs(at_us),
            kind,
            level,
            satellite: Some(satellite()),
            station: route().station,
            link: None,
            key: None,
            subject: Subject::default(),
            message: message.into(),
        }));
    }
}

pub(super) fn heartbeat() -> Downlink {
    Downlink::Heartbeat(Heartbeat {
        r_teme_km: [6878.0, -120.5, 33.25],
        v_teme_km_s: [0.1, 7.6, 0.02],
        mag_t: [2.1e-5, -1.4e-5, 0.0],
        omega_rad_s: [0.0012, -0.0034, 0.0101],
        accel_m_s2: [0.0, 0.001, -0.002],
        css: [0.0; 6],
        att_mrp: [0.1, -0.2, 0.3],
        rad: 3.5,
        temp_c: 21.5,
        uptime_ms: 9_876_543,
        timestamp_ms: 1_795_324_765_123,
        cam: true,
    })
}

fn run(state: RunState, progress: Progress, (aos_us, los_us): (i64, i64), id: u64) -> Record {
    Record::Run(Box::new(RunRecord {
        id: RunId(id),
        plan: PlanId(1),
        satellite: satellite(),
        station: route().station,
        link: Some(route().link),
        pass: Some(PassId(1)),
        aos_at: UtcUs(aos_us),
        los_at: UtcUs(los_us),
        state,
        progress,
        at: UtcUs(los_us),
    }))
}

fn plan() -> Record {
    let context = CheckContext { timing: Default::default(), profile: None, pass: None, now: None };
    Record::Plan(PlanRecord {
        id: PlanId(1),
        station: route().station,
        plan: Arc::new(check_words(&serde_json::from_str(PLAN).unwrap(), &context).0.unwrap()),
        text: Arc::from(PLAN),
        added_at: UtcUs(MIDNIGHT_US),
        who: Principal::new("ada"),
        armed: true,
        picks: Vec::new(),
        withdrawn_at: None,
    })
}

fn result(step: &str, (from_us, to_us): (i64, i64), end: StepEnd) -> StepResult {
    StepResult {
        step: step.to_owned(),
        rounds: Vec::new(),
        entered_at: UtcUs(from_us),
        ended_at: UtcUs(to_us),
        end,
    }
}

pub(super) fn iss() -> Elements {
    sets(OMM, Checksums::Strict).unwrap().next().unwrap().unwrap().elements
}

/// The archive of the pass.
pub(super) async fn flown() -> Archive {
    let folder = tempfile::tempdir().unwrap();
    let options = StoreOptions {
        folder: folder.path().join("data"),
        station: Some(route().station),
        simulated: true,
        max_page_count: None,
        postgres: None,
        reserve_bytes: 0,
    };
    let store = Store::open(options).await.unwrap();
    let config = config();
    let set = iss();
    let site = config.site.clone().unwrap();
    let passes = passes_ahead(&site, &[numbered(1, set.clone())], MIDNIGHT_US);
    let pass = passes.iter().find(|pass| pass.max_elevation_deg > 40.0).unwrap();
    let times = (pass.aos_at.0, pass.tca_at.0, pass.los_at.unwrap().0);
    let (aos, _, los) = times;

    let mut writer = Writer { records: Vec::new(), frames: 0 };
    writer.records.push(Record::Elements(ElementsRecord {
        id: ElementsId(1),
        satellite: satellite(),
        station: route().station,
        source: "file".to_owned(),
        added_at: UtcUs(MIDNIGHT_US),
        who: Principal::new("ada"),
        elements: Arc::new(set),
    }));
    writer.records.push(Record::Pass(PassRecord {
        id: PassId(1),
        satellite: satellite(),
        station: route().station,
        aos_at: pass.aos_at,
        tca_at: pass.tca_at,
        los_at: pass.los_at,
        max_elevation_deg: pass.max_elevation_deg,
        elements: vec![(ElementsId(1), pass.aos_at)],
        ended_at: pass.los_at,
    }));
    writer.records.push(plan());

    // Long before, and long after: nothing of this pass.
    writer.heard(aos - 3600 * S, &heartbeat(), Some(-90));
    // A little before AOS; then each minute, but for the third and fourth.
    writer.heard(aos - 10 * S, &heartbeat(), Some(-121));
    for minute in [1, 2, 5, 6, 7, 8, 9] {
        let at = aos + minute * 60 * S;
        writer.heard(at, &heartbeat(), Some(-118 + 3 * minute as i16));
    }
    let info = ImageInfo { exists: true, chunks: 12, size_bytes: 12 * 222 - 10, width_px: 64, height_px: 48 };
    let declared = writer.heard(aos + 130 * S, &Downlink::ImageInfo(info), Some(-111));
    writer.records.push(Record::Image(ImageRecord {
        id: ImageId(1),
        route: route(),
        declared_by: FrameId(declared),
        declared_at: UtcUs(aos + 130 * S),
        size_bytes: info.size_bytes,
        chunks: 12,
        width_px: 64,
        height_px: 48,
        held: 7,
        conflicts: 1,
        completed_at: None,
        sha256: None,
    }));
    for (place, index) in [0_u16, 1, 2, 3, 6, 7, 11, 3].into_iter().enumerate() {
        let at = aos + (310 + 3 * place as i64) * S;
        let packet = Downlink::ImageChunk(ImageChunk { index: ChunkIndex(index), data: [place as u8; 222] });
        let frame = writer.heard(at, &packet, if place == 4 { None } else { Some(-101) });
        writer.records.push(Record::Chunk(ChunkRecord {
            image: ImageId(1),
            index,
            frame: FrameId(frame),
            route: route(),
            at: UtcUs(at),
            conflict: place == 7,
            data: Box::new([place as u8; 222]),
        }));
    }
    // After the report is due.
    writer.heard(los + 61 * S, &heartbeat(), Some(-125));

    let sent = |from: i64| {
        vec![
            (Stage::Queued, aos - 7200 * S),
            (Stage::Sealed, from),
            (Stage::Radiating, from),
            (Stage::Radiated, from + 2 * S),
        ]
    };
    let ended = |from: i64, stage: Stage, at: i64| [sent(from), vec![(stage, at)]].concat();
    writer.command(1, Telecommand::Ping, "ada", &ended(aos + 65 * S, Stage::Answered, aos + 69_500_000));
    writer.command(2, Telecommand::Reset, EVIL, &ended(aos + 200 * S, Stage::Unknown, aos + 220 * S));
    writer.command(3, Telecommand::Ping, "ben", &[(Stage::Queued, los - 10 * S)]);
    // Settled long before, and given long after: not of this pass.
    writer.command(
        4,
        Telecommand::Ping,
        "ada",
        &[(Stage::Queued, aos - 9000 * S), (Stage::Expired, aos - 8000 * S)],
    );
    writer.command(5, Telecommand::Ping, "ada", &[(Stage::Queued, los + 600 * S)]);

    writer.event(aos - 4000 * S, EventKind::Limit, Level::Severe, "before the pass");
    writer.event(aos + 70 * S, EventKind::Limit, Level::Warning, "heartbeat.temp is 61.5 degC, above 60");
    writer.event(aos + 71 * S, EventKind::Limit, Level::Watch, "only worth an eye");
    writer.event(aos + 90 * S, EventKind::SatelliteError, Level::Distress, EVIL);

    let progress = Progress {
        started_at: Some(UtcUs(aos)),
        results: vec![
            result("steps[0]", (aos, aos + 5 * S), StepEnd::Done),
            result("steps[1]", (aos + 5 * S, aos + 70 * S), StepEnd::Done),
            result(
                "steps[2]",
                (aos + 70 * S, los),
                StepEnd::Unfinished("5 of 12 chunks are missing".to_owned()),
            ),
        ],
        end: Some(RunEnd::Unfinished),
        ..Progress::default()
    };
    writer.records.push(run(RunState::Ended, progress, (aos, los), 1));
    // Of the pass before.
    writer.records.push(run(
        RunState::Missed("asleep".to_owned()),
        Progress::default(),
        (aos - 7000 * S, aos - 6500 * S),
        2,
    ));

    store.apply(&Batch { id: BatchId(1), records: writer.records }).await.unwrap();
    Archive { store, identity: Identity::of(&config, true), times, _folder: folder }
}
