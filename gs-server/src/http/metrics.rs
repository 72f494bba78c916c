//! `GET /metrics`: how the server is, as Prometheus reads it. docs/operations.md lists the names.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use mission::status::{LinkStatus, SatelliteStatus};
use mission::{LinkState, Status};

use super::App;
use crate::ops::metrics::machine::{Folder, Process};
use crate::ops::metrics::text::{CONTENT_TYPE, Exposition};
use crate::ops::metrics::{Metrics, SatelliteLink};

/// States that a link may have.
const LINK_STATES: [&str; 4] = ["ok", "unavailable", "disabled", "failed"];

pub(super) async fn get(State(app): State<App>) -> Response {
    let status = app.state.engine.status();
    let metrics = app.state.engine.metrics();
    let mut page = Exposition::default();
    identity(&mut page, &app);
    links(&mut page, &status);
    satellites(&mut page, &status, app.state.timer.now().utc.0);
    archive(&mut page, &app, &status, metrics).await;
    engine(&mut page, metrics);
    antenna(&mut page, &app);
    ways(&mut page, &app);
    upkeep(&mut page, metrics);
    machine(&mut page, app.state.store.folder().to_path_buf()).await;
    ([(header::CONTENT_TYPE, CONTENT_TYPE)], page.finish()).into_response()
}

fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

fn identity(page: &mut Exposition, app: &App) {
    let identity = &app.state.identity;
    let schema = migrations::newest_sqlite().to_string();
    let labels = [
        ("version", env!("CARGO_PKG_VERSION")),
        ("schema", schema.as_str()),
        ("station", identity.station.as_str()),
        ("simulated", if identity.simulated { "true" } else { "false" }),
    ];
    page.gauge("gs_build_info", "The program and its station; always 1.").is(&labels, 1.0);
    page.gauge("gs_time_seconds", "The station's clock, seconds since 1970.")
        .is(&[], app.state.timer.now().utc.0 as f64 / 1e6);
}

/// A metric with one value per link.
fn per_link(
    page: &mut Exposition,
    status: &Status,
    name: &'static str,
    help: &str,
    value: impl Fn(&LinkStatus) -> Option<f64>,
) {
    match name.ends_with("_total") {
        true => page.counter(name, help),
        false => page.gauge(name, help),
    };
    for link in &status.links {
        let labels = [("satellite", link.satellite.as_str()), ("link", link.link.as_str())];
        page.may_be(&labels, value(link));
    }
}

fn links(page: &mut Exposition, status: &Status) {
    page.gauge("gs_link_state", "1 for the state that the link is in.");
    for link in &status.links {
        for state in LINK_STATES {
            let labels =
                [("satellite", link.satellite.as_str()), ("link", link.link.as_str()), ("state", state)];
            page.is(&labels, flag(link.state.name() == state));
        }
    }
    let mut each =
        |name, help, value: fn(&LinkStatus) -> Option<f64>| per_link(page, status, name, help, value);
    each("gs_link_up", "The link works.", |link| Some(flag(link.state == LinkState::Ok)));
    each("gs_link_armed", "The link may transmit.", |link| Some(flag(link.armed)));
    each("gs_link_on_air", "The link is transmitting.", |link| Some(flag(link.on_air)));
    each("gs_link_frames_total", "Whole frames heard since the start.", |link| Some(link.frames as f64));
    each("gs_link_bad_frames_total", "Candidates for a frame that failed, by CRC or otherwise.", |link| {
        Some(link.bad as f64)
    });
    each("gs_link_noise_bytes_total", "Bytes that belonged to no frame.", |link| {
        Some(link.skipped_bytes as f64)
    });
    each("gs_link_radiated_frames_total", "Uplink frames radiated.", |link| Some(link.radiated as f64));
    each("gs_link_radiating_seconds_total", "Time on the air.", |link| Some(link.airtime_us as f64 / 1e6));
    each("gs_link_rssi_dbm", "The level of the newest frame.", |link| link.rssi_dbm.map(f64::from));
}

/// A gauge with one value per satellite.
fn per_satellite(
    page: &mut Exposition,
    status: &Status,
    name: &'static str,
    help: &str,
    value: impl Fn(&SatelliteStatus) -> Option<f64>,
) {
    page.gauge(name, help);
    for satellite in &status.satellites {
        page.may_be(&[("satellite", satellite.satellite.as_str())], value(satellite));
    }
}

fn satellites(page: &mut Exposition, status: &Status, now_us: i64) {
    let mut each = |name, help, value: &dyn Fn(&SatelliteStatus) -> Option<f64>| {
        per_satellite(page, status, name, help, value);
    };
    each("gs_satellite_in_contact", "Heard lately.", &|satellite| Some(flag(satellite.in_contact)));
    each("gs_satellite_in_view", "Above the horizon, by its elements.", &|satellite| {
        satellite.in_view.map(flag)
    });
    each("gs_satellite_silent_seconds", "Since it was last heard.", &|satellite| {
        satellite.heard_at.map(|at| (now_us - at.0) as f64 / 1e6)
    });
    each("gs_commands_queued", "Commands that wait.", &|satellite| Some(satellite.queued as f64));
    each("gs_elements_age_days", "Age of the elements in use.", &|satellite| {
        satellite.sky.as_ref().map(|sky| sky.age.age_days)
    });
    each("gs_elements_timing_error_seconds", "Expected error of AOS and LOS.", &|satellite| {
        satellite.sky.as_ref().map(|sky| sky.age.timing_error_s)
    });
    page.gauge("gs_sealing_locked", "1 while nothing is sealed with the key.");
    for sealing in &status.sealing {
        let key = sealing.key.to_string();
        page.is(
            &[("satellite", sealing.satellite.as_str()), ("key", key.as_str())],
            flag(sealing.locked.is_some()),
        );
    }
    page.gauge("gs_plans_armed", "Plans that may run.")
        .is(&[], status.plans.iter().filter(|plan| plan.armed).count() as f64);
    page.gauge("gs_plan_runs_open", "Runs of plans that are not over.").is(&[], status.runs.len() as f64);
}

async fn archive(page: &mut Exposition, app: &App, status: &Status, metrics: &Metrics) {
    let stored = metrics.what_was_stored();
    let routes = |page: &mut Exposition, counts: &std::collections::BTreeMap<SatelliteLink, u64>| {
        for ((satellite, link), count) in counts {
            page.is(&[("satellite", satellite.as_str()), ("link", link.as_str())], *count as f64);
        }
    };
    page.counter("gs_stored_frames_total", "New frames that became durable since the start.");
    routes(page, &stored.frames);
    page.counter("gs_stored_receptions_total", "Receptions that became durable since the start.");
    routes(page, &stored.receptions);
    page.counter("gs_stored_values_total", "Values of telemetry since the start.")
        .is(&[], stored.values as f64);
    page.counter("gs_command_stages_total", "Commands that reached a stage since the start.");
    for (stage, count) in &stored.stages {
        page.is(&[("stage", stage)], *count as f64);
    }
    page.counter("gs_events_total", "Events since the start.");
    for (level, count) in &stored.events {
        page.is(&[("level", level)], *count as f64);
    }
    let last = app.state.store.last_event_seq().await.ok();
    page.gauge("gs_event_sequence", "Place of the newest event in the archive.")
        .may_be(&[], last.map(|last| last as f64));
    let storage = &status.storage;
    page.gauge("gs_storage_failing", "Nothing is stored at present.")
        .is(&[], flag(storage.failing.is_some()));
    page.gauge("gs_storage_waiting_records", "Records that wait to be stored.")
        .is(&[], storage.waiting as f64);
    page.gauge("gs_storage_reserved_frames", "Raw frames in the reserve since storage failed.")
        .is(&[], storage.reserved as f64);
    page.gauge("gs_storage_unreserved_frames", "Raw frames in memory only since storage failed.")
        .is(&[], storage.unreserved as f64);
    page.counter("gs_storage_derived_dropped_total", "Derived records dropped; redecode makes them again.")
        .is(&[], storage.derived_dropped as f64);
    page.counter("gs_storage_frames_lost_total", "Raw frames that found no place at all.")
        .is(&[], storage.frames_lost as f64);
}

fn engine(page: &mut Exposition, metrics: &Metrics) {
    page.histogram(
        "gs_engine_input_seconds",
        "From the last received byte to the engine.",
        &metrics.engine_inputs(),
    );
    page.histogram("gs_persist_seconds", "Until a batch is durable.", &metrics.persists());
    page.counter("gs_persist_failures_total", "Batches that could not be stored; each is tried again.")
        .is(&[], metrics.persist_failures() as f64);
    page.gauge("gs_streams", "WebSocket clients.").is(&[], metrics.streams() as f64);
    page.counter("gs_streams_ended_total", "WebSocket clients that are gone, by reason.");
    for (reason, count) in metrics.streams_that_ended() {
        page.is(&[("reason", reason)], count as f64);
    }
    page.gauge("gs_clock_synchronised", "Somebody says that the machine's clock is right.")
        .is(&[], flag(metrics.is_clock_good()));
}

fn antenna(page: &mut Exposition, app: &App) {
    let found = app.state.antenna.status();
    if let Some(rotator) = &found.rotator {
        page.gauge("gs_rotator_connected", "rotctld answers.").is(&[], flag(rotator.is_connected));
        page.gauge("gs_rotator_trouble", "Something is wrong with it.")
            .is(&[], flag(rotator.trouble.is_some()));
        page.gauge("gs_rotator_moving", "It turns.").is(&[], flag(rotator.is_moving));
        page.gauge("gs_rotator_on_target", "It is where it was told to be.")
            .is(&[], flag(rotator.is_on_target));
        let position = rotator.position;
        page.gauge("gs_rotator_azimuth_degrees", "Where it stands.")
            .may_be(&[], position.map(|position| position.azimuth_deg));
        page.gauge("gs_rotator_elevation_degrees", "Where it stands.")
            .may_be(&[], position.map(|position| position.elevation_deg));
    }
    if let Some(rig) = &found.rig {
        page.gauge("gs_rig_connected", "rigctld answers.").is(&[], flag(rig.is_connected));
    }
}

/// Ways in over the network, and the boards that speak by them.
fn ways(page: &mut Exposition, app: &App) {
    let views = app.state.ways.views();
    if views.is_empty() {
        return;
    }
    page.gauge("gs_ear_working", "The way in works.");
    for way in &views {
        page.is(&[("ear", &way.name), ("kind", &way.kind)], flag(way.state == api::WayState::Working));
    }
    page.gauge("gs_ear_age_seconds", "Since it answered, or a message came, last.");
    for way in &views {
        page.may_be(&[("ear", &way.name), ("kind", &way.kind)], way.age_s);
    }
    page.counter("gs_ear_counts_total", "Requests, messages, receptions, and refusals by reason.");
    for way in &views {
        for (what, count) in &way.counts {
            page.is(&[("ear", &way.name), ("what", what)], *count as f64);
        }
    }
    let online = app.state.ways.boards().iter().filter(|(.., board)| board.online).count();
    page.gauge("gs_boards_online", "Boards of one's own that are there.").is(&[], online as f64);
}

fn upkeep(page: &mut Exposition, metrics: &Metrics) {
    let seen = metrics.what_upkeep_saw();
    page.gauge("gs_clock_offset_seconds", "How far the machine's clock is off, when chrony keeps it.")
        .may_be(&[], seen.clock_offset_s);
    page.gauge("gs_disk_level", "0 normal, 1 watch, 2 warning, 4 critical.")
        .may_be(&[], seen.disk.map(|disk| f64::from(disk.level as u8)));
    page.gauge("gs_disk_days_left", "Until the disk is full at the present rate.")
        .may_be(&[], seen.disk.and_then(|disk| disk.days_left));
    page.gauge("gs_backup_timestamp_seconds", "When this process finished its newest backup.")
        .may_be(&[], seen.backup_at.map(|at| at.0 as f64 / 1e6));
    page.gauge("gs_backup_bytes", "Size of that.").may_be(&[], seen.backup_bytes.map(|bytes| bytes as f64));
    page.gauge("gs_backup_failing", "The newest attempt at a backup failed.")
        .is(&[], flag(seen.backup_trouble.is_some()));
    page.counter("gs_backup_failures_total", "Backups that failed.").is(&[], seen.backup_failures as f64);
    page.counter("gs_values_removed_total", "Values that retention has removed.")
        .is(&[], seen.values_removed as f64);
}

async fn machine(page: &mut Exposition, folder: std::path::PathBuf) {
    let look = move || (Folder::look(&folder), Process::look());
    let Ok((folder, process)) = tokio::task::spawn_blocking(look).await else { return };
    let mut known = |name, help, value: Option<u64>| {
        page.gauge(name, help).may_be(&[], value.map(|value| value as f64));
    };
    known("gs_disk_free_bytes", "Left on the disk of the data folder.", folder.free_bytes);
    known("gs_disk_size_bytes", "The disk of the data folder.", folder.disk_bytes);
    known("gs_database_bytes", "The database.", folder.database_bytes);
    known("gs_database_log_bytes", "Its write-ahead log.", folder.log_bytes);
    known("process_resident_memory_bytes", "Memory that the process holds.", process.resident_bytes);
    known("process_open_fds", "Open files and sockets.", process.open_files);
    known("process_max_fds", "How many may be open.", process.open_files_max);
    known("process_threads", "Threads.", process.threads);
    page.counter("process_cpu_seconds_total", "Processor time.")
        .may_be(&[], process.cpu_ms.map(|ms| ms as f64 / 1e3));
}
