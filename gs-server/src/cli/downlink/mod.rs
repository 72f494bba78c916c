//! `gs-server downlink`: when the satellite should send its picture to strangers.

mod budget;
mod map;
mod own;
mod stations;
mod text;

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use api::FineTime;
use clap::{Args, Subcommand};
use mission::downlink::{Battery, DownlinkPlan, Link, Pointing, Task, TaskError};
use mission::sky::{ElementsAge, utc};
use mission::{PlanName, SatelliteId, UtcUs};
use serde::Serialize;
use tle::passes::{PassFinder, PassSearch};
use tle::{Elements, UtcInstant};

use super::shell::{print_json, print_text};
use super::sky::{Moment, Sky, SkyArgs, now, tell};
use super::{Exit, Failure};
use crate::sky::{Place, fine_time};

/// Runs on the twin that one call makes.
const RUNS_MAX: i64 = 10_000;

/// `gs-server downlink`.
#[derive(Debug, Subcommand)]
pub enum Downlink {
    /// Find the times and chunks for SetDownlinkSchedule that bring most of a picture to stations of the public network
    Plan(Box<DownlinkArgs>),
}

/// `gs-server downlink plan`.
#[derive(Debug, Args)]
#[command(
    override_usage = "gs-server downlink plan [OPTIONS] --config <FILE>\n       \
                      gs-server downlink plan [OPTIONS] --elements <FILE> --station <STATION>\n           \
                      --stations <FILE> --chunks <RANGES>",
    after_help = "\
Examples:
  gs-server downlink plan --config station.toml --stations tinygs.json --plan night.toml --runs 200
  gs-server downlink plan --elements gp.json --station 46.5191,6.5668,410 --stations tinygs.json \\
      --chunks 0-112
  gs-server downlink plan --elements gp.json --station 46.5191,6.5668,410 --stations tinygs.json \\
      --chunks 17-63,70,88-112 --from +2h --until +20h --runs 200 --map map.svg --plan night.toml \\
      --name night --satellite-name pixelsat-1

--stations is a JSON array, or one object a line: name, location [latitude, longitude], and where known
lastSeen (ms since 1970) and success (the share of passes in which it heard the satellite, 0 to 1).
The list of stations of TinyGS is such an array. Nothing is scheduled while the satellite is over
--station: it must hear us there. Nothing is sent: --plan writes a plan with one step, upload-schedule,
which goes the way of every plan.

With --config the elements, the place and the satellite are the station's own, the chunks are those that
the newest unfinished image misses (or --image), and whoever heard the satellite in the last 10 days is
a station as well, with the share of its passes in which it did. The server must run.

Exit code 1 if no schedule brings anything, 2 if the arguments make no sense."
)]
pub struct DownlinkArgs {
    /// The configuration of a station whose server runs: what is not given comes from there
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// A file of elements, or - for standard input
    #[arg(long, value_name = "FILE", required_unless_present = "config", conflicts_with = "config")]
    elements: Vec<PathBuf>,
    /// The satellite, where there are several: name, number or designator
    #[arg(long, value_name = "SATELLITE")]
    satellite: Option<String>,
    /// The own station, over which the satellite is silent: LATITUDE,LONGITUDE,HEIGHT_M
    #[arg(long, value_name = "STATION", allow_hyphen_values = true, required_unless_present = "config")]
    station: Option<Place>,
    /// Stations that may hear it
    #[arg(long, value_name = "FILE", required_unless_present = "config")]
    stations: Option<PathBuf>,
    /// Missing chunks, such as 0-112 or 3,5-9
    #[arg(long, value_name = "RANGES", value_parser = chunks, required_unless_present = "config")]
    chunks: Option<Chunks>,
    /// With --config: the chunks that this image misses
    #[arg(long, value_name = "NUMBER", requires = "config", conflicts_with = "chunks")]
    image: Option<u64>,
    /// When the schedule is on board, UTC
    #[arg(long, value_name = "T", default_value = "now", allow_hyphen_values = true)]
    from: Moment,
    /// The deadline, UTC, or a distance from --from
    #[arg(long, value_name = "T", default_value = "+24h", allow_hyphen_values = true)]
    until: Moment,
    /// Margin of the link to a station in the zenith at 500 km, dB
    #[arg(long, value_name = "DB", default_value_t = Link::default().margin_500km_db, allow_hyphen_values = true)]
    margin: f64,
    /// Chunks of one entry, at most: so long the satellite is deaf
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..=512))]
    entry_chunks: u16,
    /// The battery, which must stay above its floor: capacity_wh=…,charge_wh=…,floor_wh=…,sunlit_w=…,load_w=…,transmit_w=…
    #[arg(long, value_name = "VALUES", value_parser = budget::battery)]
    battery: Option<Battery>,
    /// An antenna that is better in one direction: axis=X/Y/Z,loose_db=…,held_db=…,settle_s=…; each entry carries the
    /// attitude that brings it to nadir
    #[arg(long, value_name = "VALUES", value_parser = budget::antenna, allow_hyphen_values = true)]
    antenna: Option<Pointing>,
    /// Rehearse the schedule on the twin so often
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=RUNS_MAX))]
    runs: u32,
    /// Write a map of stations, ground track and footprints as SVG
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Write a plan that uploads the schedule
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// The name of that plan
    #[arg(long, value_name = "NAME", default_value = "downlink", value_parser = PlanName::new)]
    name: PlanName,
    /// What the configuration calls the satellite, for that plan; `pixelsat-1`, or as --config has it
    #[arg(long, value_name = "NAME", value_parser = SatelliteId::new)]
    satellite_name: Option<SatelliteId>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// Chunk numbers, ascending, each once.
#[derive(Debug, Clone)]
struct Chunks(Vec<u16>);

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    satellite: String,
    elements_epoch: FineTime,
    elements_timing_error_s: f64,
    from: FineTime,
    until: FineTime,
    stations: usize,
    stations_refused: usize,
    passes: usize,
    covered_share: f64,
    missing_chunks: usize,
    expected_chunks: f64,
    upper_bound_chunks: f64,
    round_robin_chunks: f64,
    rehearsed: Option<Rehearsed>,
    entries: Vec<EntryView>,
}

/// What became of it on the twin.
#[derive(Serialize)]
struct Rehearsed {
    runs: usize,
    mean_chunks: f64,
    least_of_nine_in_ten: u32,
    median_chunks: u32,
    most_of_nine_in_ten: u32,
    elements_timing_error_s: f64,
}

#[derive(Serialize)]
struct EntryView {
    time: FineTime,
    ends: FineTime,
    first: u16,
    count: u16,
    missing: u16,
    attitude_mrp: Option<[f32; 3]>,
    heard_share: f64,
    expected_chunks: f64,
    stations: Vec<EarView>,
}

#[derive(Serialize)]
struct EarView {
    name: String,
    listening: f64,
    expected_frames: f64,
    max_elevation_deg: f64,
}

impl Downlink {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let Self::Plan(args) = self;
        args.run()
    }
}

impl DownlinkArgs {
    fn run(self) -> Result<Exit, Failure> {
        let now = now();
        let from = self.from.resolve(now, now);
        let until = self.until.resolve(now, from);
        let places = self.station.iter().cloned().collect();
        let sky = SkyArgs::of(self.elements.clone(), places, self.config.clone()).read((from, until))?;
        let (elements, label) = self.elements_of(&sky, from)?;
        let station = sky.places.first().ok_or_else(|| Failure::usage("no station: give --station"))?;
        let own = match &self.config {
            Some(config) => Some(own::ask(config, &label, self.image, self.chunks.is_none(), utc(from))?),
            None => None,
        };
        let listed = match &self.stations {
            Some(stations) => stations::read(stations)?,
            None => stations::Listed::default(),
        };
        tell(listed.refused.iter().cloned(), "stations left out");
        let mut listeners = listed.listeners;
        let mut missing = self.chunks.as_ref().map(|chunks| chunks.0.clone()).unwrap_or_default();
        if let Some(own) = own {
            let known = mission::downlink::listeners(&elements, sky.orientation, &own.heard, utc(from));
            listeners = mission::downlink::joined(listeners, known.map_err(failure)?);
            missing = self.chunks.as_ref().map_or(own.missing, |chunks| chunks.0.clone());
        }
        if listeners.is_empty() {
            return Err(Failure::failed(
                "nobody has heard the satellite yet, and no list of stations was given: name one with --stations",
            ));
        }
        let mut task = Task::new(elements, listeners, missing, utc(from), utc(until));
        task.link.margin_500km_db = self.margin;
        task.rules.chunks_max = self.entry_chunks;
        task.orientation = sky.orientation;
        task.battery = self.battery;
        task.pointing = self.antenna;
        task.silent = silent(&task, station).map_err(failure)?;
        let found = mission::downlink::plan(&task).map_err(failure)?;
        let rehearsed = self.rehearse(&task, &found)?;
        if let Some(path) = &self.map {
            write(path, &map::svg(&task, &found, station)?)?;
        }
        if let Some(path) = &self.plan {
            let own = || self.config.as_ref().and_then(|_| SatelliteId::new(&label).ok());
            let satellite = self.satellite_name.clone().or_else(own);
            let satellite = satellite.map_or_else(|| SatelliteId::new("pixelsat-1"), Ok);
            write(path, &text::plan(&found, &self.name, &satellite.map_err(Failure::usage)?))?;
        }
        let answer = answer(&task, &found, listed.refused.len(), rehearsed);
        if self.json {
            print_json(&answer)?;
        } else {
            print_text(&text::table(&answer))?;
        }
        Ok(if found.entries.is_empty() { Exit::Failed } else { Exit::Done })
    }

    /// The elements, and what their satellite is called.
    fn elements_of(&self, sky: &Sky, from: UtcInstant) -> Result<(Elements, String), Failure> {
        let named = |wanted: &String| {
            sky.catalogue.objects.iter().find(|object| {
                object.label().eq_ignore_ascii_case(wanted)
                    || object.norad_cat_id().is_some_and(|id| id.to_string() == *wanted)
            })
        };
        let object = match (&self.satellite, &sky.catalogue.objects[..]) {
            (None, [only]) => only,
            (None, objects) => {
                return Err(Failure::usage(format!(
                    "the elements are of {} satellites: choose one with --satellite",
                    objects.len()
                )));
            }
            (Some(wanted), _) => named(wanted).ok_or_else(|| {
                Failure::usage(format!("no satellite of the elements is called '{wanted}'"))
            })?,
        };
        Ok((object.set_for(from).clone(), object.label()))
    }

    fn rehearse(&self, task: &Task, found: &DownlinkPlan) -> Result<Option<Rehearsed>, Failure> {
        if self.runs == 0 || found.entries.is_empty() {
            return Ok(None);
        }
        let timing_s = ElementsAge::at(&task.elements, task.until).timing_error_s.min(120.0);
        let had = rehearsal::downlink::downlink(task, &found.schedule(), timing_s, 0..u64::from(self.runs))
            .map_err(Failure::failed)?;
        Ok(Some(Rehearsed {
            runs: had.chunks.len(),
            mean_chunks: had.mean(),
            least_of_nine_in_ten: had.quantile(0.1),
            median_chunks: had.quantile(0.5),
            most_of_nine_in_ten: had.quantile(0.9),
            elements_timing_error_s: timing_s,
        }))
    }
}

/// The passes over the own station.
fn silent(task: &Task, own: &Place) -> Result<Vec<Range<UtcUs>>, TaskError> {
    let search = PassSearch {
        orientation: task.orientation,
        ..PassSearch::new(mission::sky::instant(task.from), mission::sky::instant(task.until), 0.0)
    };
    let place = std::slice::from_ref(&own.station);
    let found = PassFinder::new(&task.elements)?.find(place, &search)?;
    Ok(found.stations.iter().flatten().map(|pass| utc(pass.aos.at)..utc(pass.los.at)).collect())
}

fn answer(task: &Task, found: &DownlinkPlan, refused: usize, rehearsed: Option<Rehearsed>) -> Answer {
    let time = |at: UtcUs| fine_time(mission::sky::instant(at));
    Answer {
        satellite: task.elements.label(),
        elements_epoch: fine_time(task.elements.epoch),
        elements_timing_error_s: ElementsAge::at(&task.elements, task.until).timing_error_s,
        from: time(task.from),
        until: time(task.until),
        stations: task.listeners.len(),
        stations_refused: refused,
        passes: found.visits,
        covered_share: found.coverage,
        missing_chunks: found.missing,
        expected_chunks: found.expected_chunks,
        upper_bound_chunks: found.upper_bound_chunks,
        round_robin_chunks: found.round_robin_chunks,
        rehearsed,
        entries: found
            .entries
            .iter()
            .map(|entry| EntryView {
                time: time(entry.at),
                ends: time(entry.end_at),
                first: entry.first,
                count: entry.count,
                missing: entry.missing,
                attitude_mrp: entry.attitude_mrp,
                heard_share: entry.heard,
                expected_chunks: entry.expected_chunks,
                stations: entry
                    .ears
                    .iter()
                    .map(|ear| EarView {
                        name: task.listeners[ear.listener].name.clone(),
                        listening: ear.listening,
                        expected_frames: ear.expected_frames,
                        max_elevation_deg: ear.max_elevation_deg,
                    })
                    .collect(),
            })
            .collect(),
    }
}

fn failure(error: TaskError) -> Failure {
    match error {
        TaskError::Elements(_) | TaskError::NoState(_) => Failure::failed(error),
        _ => Failure::usage(error),
    }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    fs::write(path, text)
        .map_err(|error| Failure::doing(format!("{} cannot be written", path.display()), error))
}

fn chunks(text: &str) -> Result<Chunks, String> {
    let mut found = std::collections::BTreeSet::new();
    for part in text.split(',').map(str::trim) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let number = |text: &str| {
            text.trim()
                .parse::<u16>()
                .map_err(|_| format!("'{part}' is no range of chunks: write 0-112 or 3,5-9"))
        };
        let (first, last) = (number(first)?, number(last)?);
        if last < first {
            return Err(format!("'{part}' ends before it begins"));
        }
        found.extend(first..=last);
    }
    Ok(Chunks(found.into_iter().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_read_in_any_order_and_each_counts_once() {
        assert_eq!(chunks("5-7, 3,6-8").unwrap().0, [3, 5, 6, 7, 8]);
        for wrong in ["", "a", "7-5", "1-", "70000"] {
            assert!(chunks(wrong).is_err(), "{wrong}");
        }
    }
}
