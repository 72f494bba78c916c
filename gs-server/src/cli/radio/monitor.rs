//! `gs-server radio monitor`: what is heard, as it is heard.

use std::time::Duration;

use clap::Args;
use radio::driver::DriverState;
use serde::Serialize;

use super::super::shell::{print_json, print_line, runtime, stop_on_signals};
use super::bench::{Bench, Notice, utc_text};
use super::{Exit, Failure, Wiring};
use crate::clock::wall_sleep;
use crate::config::driver_config;
use crate::decode::{Decoder, Report};

/// A line that is silent for longer has nothing more to add to a frame.
const QUIET: Duration = Duration::from_millis(120);

/// `gs-server radio monitor`.
#[derive(Debug, Args)]
pub struct Monitor {
    #[command(flatten)]
    wiring: Wiring,
    /// Whether the module appends an RSSI byte, where it cannot be asked (strapped)
    #[arg(long)]
    rssi: bool,
    /// Leave out what was skipped
    #[arg(long)]
    frames_only: bool,
    /// End after so many frames
    #[arg(long, value_name = "N")]
    count: Option<u64>,
}

#[derive(Serialize)]
struct Line<'a> {
    at: String,
    #[serde(flatten)]
    report: &'a Report,
}

impl Monitor {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        runtime()?.block_on(self.monitor())
    }

    async fn monitor(self) -> Result<Exit, Failure> {
        let stop = stop_on_signals()?;
        let section = self.wiring.section()?;
        let config = driver_config(&section);
        let mut bench = Bench::open(&section, config, true, self.wiring.raw_log.as_deref()).await?;
        let mut decoder: Option<Decoder> = None;
        let mut reports = Vec::new();
        let mut frames = 0;
        loop {
            let notice = tokio::select! {
                () = stop.cancelled() => break,
                notice = bench.next() => Some(notice),
                () = wall_sleep(QUIET), if decoder.is_some() => None,
            };
            match notice {
                None => {
                    if let Some(decoder) = &mut decoder {
                        decoder.silence(&mut |report| reports.push(report));
                    }
                }
                Some(Notice::State(DriverState::Ready) | Notice::WouldChange(_)) => {
                    let rssi = bench.driver.facts().rssi_byte.unwrap_or(self.rssi);
                    eprintln!(
                        "listening on {}, RSSI byte {}",
                        self.wiring.port,
                        if rssi { "on" } else { "off" }
                    );
                    decoder.get_or_insert_with(|| Decoder::new(rssi).with_hex(true));
                }
                Some(Notice::State(DriverState::Fault)) => {
                    return Err(Failure::failed(
                        "the module does not work; the findings above name what to check",
                    ));
                }
                Some(Notice::State(state)) => tracing::info!("{state:?}"),
                Some(Notice::Finding(finding)) => eprintln!("{finding}"),
                Some(Notice::Heard(bytes)) => {
                    let decoder = decoder.get_or_insert_with(|| Decoder::new(self.rssi).with_hex(true));
                    decoder.push(&bytes, &mut |report| reports.push(report));
                }
                Some(Notice::Lost(reason)) => {
                    return Err(Failure::failed(format!("the port is gone: {reason}")));
                }
            }
            for report in reports.drain(..) {
                frames += u64::from(matches!(report, Report::Frame(_)));
                self.tell(&report, &bench)?;
            }
            if self.count.is_some_and(|count| frames >= count) {
                break;
            }
        }
        if let Some(decoder) = decoder {
            let summary = decoder.finish(&mut |report| reports.push(report));
            for report in &reports {
                self.tell(report, &bench)?;
            }
            self.tell(&Report::Summary(summary), &bench)?;
        }
        Ok(Exit::Done)
    }

    fn tell(&self, report: &Report, bench: &Bench) -> Result<(), Failure> {
        if self.frames_only && matches!(report, Report::Skipped(_) | Report::Text(_)) {
            return Ok(());
        }
        let at = utc_text(bench.timer.now());
        if self.wiring.json {
            return print_json(&Line { at, report });
        }
        let text = match report {
            Report::Frame(frame) => {
                let level = frame.rssi_dbm.map(|dbm| format!(" {dbm} dBm")).unwrap_or_default();
                let tag = frame.tag.map(|tag| format!(" tag {tag}")).unwrap_or_default();
                let nested = if frame.nested { " nested" } else { "" };
                let fields = match &frame.fields {
                    Some(fields) => fields.one_line(),
                    None => format!(" {}", frame.error.as_deref().unwrap_or_default()),
                };
                let hex = frame.hex.as_deref().unwrap_or_default();
                format!("{}{tag}{level}{nested} {}{fields}\n    {hex}", frame.name, frame.form)
            }
            Report::SealedUplink(uplink) => format!("sealed uplink, counter {}", uplink.counter),
            Report::Skipped(run) => format!("{} bytes skipped: {}", run.length, run.detail),
            Report::Text(note) => note.reason.to_owned(),
            Report::Summary(summary) => format!(
                "{} bytes: {} frames, {} bad, {} bytes skipped",
                summary.bytes, summary.frames, summary.bad, summary.skipped_bytes
            ),
        };
        print_line(format_args!("{at} {text}"))
    }
}
