//! A row in every table there is: what an upgrade must not lose. A new table gets its row here.

use mission::Stage;
use mission::plan::Condition;
use mission::record::{CommandRecord, DECODER_VERSION, DownloadState, EventKind, Record};
use mission::run::RunState;
use protocol::{Downlink, Telecommand};

use super::super::db::{Connection, sql};
use super::super::forwards::{ForwardRow, ForwardTargetRow};
use super::super::people::PeopleChange;
use super::super::row::Row as _;
use super::super::*;
use super::records::*;
use super::{Kind, alerts, plans, sky};

/// Fills every table, through the store as far as the store makes the rows.
pub(super) async fn fill(kind: Kind, store: &Store, beside: &mut Connection) {
    for id in 1..=5 {
        store.apply(&batch(heard(id))).await.unwrap();
    }
    store.change_people(&people(), &[audit("user.create")]).await.unwrap();
    let when = Condition { min_elevation_deg: Some(12.5), ..Condition::default() };
    let records = vec![
        Record::Frame(frame_of(6, &Downlink::Pong, &route())),
        Record::Image(image(1, 6, 30)),
        Record::Chunk(chunk(1, 0, 6, 1, false)),
        Record::Download(download(1, Some(1), DownloadState::Active)),
        Record::Command(CommandRecord { when: Some(Box::new(when)), ..command(1, Telecommand::Ping) }),
        Record::Stage(stage(1, 1, Stage::Sealed, NOON_US)),
        Record::Sealed(sealed(1, 1, 77)),
        Record::Stage(stage(1, 1, Stage::Radiating, NOON_US + 1)),
        Record::CounterFloor(floor(100)),
        Record::Limit(limit("heartbeat.temp", mission::Level::Watch, Some(40.5))),
        sky::epoch(1, NOON_US),
        Record::Pass(sky::pass(1, &[(1, NOON_US)], None)),
        Record::Plan(plans::plan(1, true)),
        plans::run(1, 1, RunState::Planned, None),
        Record::Audit(audit("a")),
        Record::Intent(receipt("once", mission::Accepted::Done)),
        Record::Event(event(EventKind::Station, "filled")),
    ];
    store.apply(&batch(records)).await.unwrap();
    let kept = AlertBatch {
        alerts: vec![alerts::full_of_everything(1)],
        deliveries: vec![alerts::message("a", 1, DeliveryState::Waiting)],
        progress: Some((3, NOON_US)),
        ..AlertBatch::default()
    };
    store.keep_alerts(&kept).await.unwrap();

    outside().bind(sql(OutsideRow::INSERT)).execute(&mut *beside).await.unwrap();
    forward().bind(sql(ForwardRow::INSERT)).execute(&mut *beside).await.unwrap();
    let target = ForwardTargetRow {
        id: 1,
        station: "oslo".into(),
        target: "db".into(),
        radio_through: 5,
        outside_through: 1,
        paused_by: Some("ada".into()),
        paused_at_us: Some(NOON_US),
    };
    target.bind(sql(ForwardTargetRow::INSERT)).execute(&mut *beside).await.unwrap();
    // Of another decoder, so that the next `redecode` begins at the first frame.
    sql("insert into redecode (decoder_version, last_frame) values (?, 3)")
        .bind(i64::from(DECODER_VERSION) + 1)
        .execute(&mut *beside)
        .await
        .unwrap();
    if kind == Kind::Pg {
        // Of another server: what is this one's own ends with its life.
        sql("delete from leases").execute(&mut *beside).await.unwrap();
        let leases = "insert into leases (key, station, life, epoch, until_us) values ('0123abcd', 'tromso', 'x', 7, 1)";
        sql(leases).execute(&mut *beside).await.unwrap();
        let claims = "insert into claims (principal, idempotency_key, life) values ('ada', 'twice', 'x')";
        sql(claims).execute(beside).await.unwrap();
    }
}

fn people() -> Vec<PeopleChange> {
    let user = UserRow {
        name: "ada".into(),
        role: "operator".into(),
        password: Some("$argon2id$…".into()),
        password_at_us: Some(NOON_US),
        call_sign: "LB1XY".into(),
        licence: "full".into(),
        disabled: false,
        created_at_us: NOON_US,
        created_by: "local".into(),
    };
    let link = LinkRow {
        code_hash: vec![1; 32],
        user_name: Some("ada".into()),
        made_by: "local".into(),
        created_at_us: NOON_US,
        expires_at_us: NOON_US + 1,
        used_at_us: None,
    };
    let session = SessionRow {
        id: "s1".into(),
        user_name: "ada".into(),
        token_hash: vec![2; 32],
        previous_hash: Some(vec![3; 32]),
        previous_until_us: Some(NOON_US + 2),
        created_at_us: NOON_US,
        rotated_at_us: NOON_US + 1,
        seen_at_us: NOON_US + 2,
        ended_at_us: None,
        ended_why: None,
    };
    let token = TokenRow {
        name: "logger".into(),
        token_hash: vec![4; 32],
        owner: Some("ada".into()),
        scopes: "look command".into(),
        created_at_us: NOON_US,
        created_by: "ada".into(),
        expires_at_us: NOON_US + 3,
        revoked_at_us: Some(NOON_US + 2),
    };
    let approval = ApprovalRow {
        id: 1,
        kind: "command".into(),
        request: "{}".into(),
        digest: vec![5; 32],
        summary: "Reboot".into(),
        principal: "ada".into(),
        person: "ada".into(),
        idempotency_key: "once".into(),
        request_digest: vec![6; 32],
        asked_at_us: NOON_US,
        expires_at_us: NOON_US + 4,
        state: "awaiting".into(),
        decided_by: None,
        decided_at_us: None,
        why: None,
        command: None,
        released_at_us: None,
    };
    let licence =
        StationLicenceRow { station: "oslo".into(), call_sign: "LA1K".into(), licence: "club".into() };
    vec![
        PeopleChange::User(user),
        PeopleChange::NewLink(link),
        PeopleChange::Session(session),
        PeopleChange::Token(token),
        PeopleChange::NewApproval(approval),
        PeopleChange::StationLicence(licence),
    ]
}

fn forward() -> ForwardRow {
    ForwardRow {
        id: 1,
        message_id: "f1".into(),
        station: "oslo".into(),
        target: "db".into(),
        satellite: route().satellite.to_string(),
        frame: 6,
        source: "own-mqtt".into(),
        reception: 1,
        receiver: "SP9X".into(),
        received_at_us: NOON_US,
        made_at_us: NOON_US + 1,
        state: "refused".into(),
        attempts: 2,
        sent_at_us: None,
        error: Some("422".into()),
    }
}

fn outside() -> OutsideRow {
    OutsideRow {
        satellite: route().satellite.to_string(),
        station: route().station.to_string(),
        frame: Some(6),
        kind: "frame".into(),
        source: "satnogs".into(),
        source_id: "4711".into(),
        receiver: "SP9X".into(),
        receiver_name: Some("roof".into()),
        latitude_deg: Some(1.0 / 3.0),
        longitude_deg: None,
        altitude_m: Some(-1.5),
        received_at_us: NOON_US,
        time_basis: "receiver".into(),
        time_error_us: Some(5),
        frequency_hz: Some(435e6),
        frequency_offset_hz: None,
        doppler_hz: Some(-7_001.25),
        frequency_error_hz: None,
        spreading_factor: Some(9),
        bandwidth_hz: Some(125e3),
        coding_rate: Some(5),
        rssi_dbm: Some(-127.5),
        snr_db: Some(-11.0),
        radio_crc: "right".into(),
        noisy: false,
        label: Some("PIXELSAT-1".into()),
        norad: Some(270_000_123),
        trim_bytes: 1,
        trim_bits: 3,
        repaired_bit: None,
        doubts: "clock".into(),
        original: Some(vec![0, 1, 2, 255]),
        taken_at_us: NOON_US + 9,
    }
}
