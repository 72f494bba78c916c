//! `gs-server passes`.

use std::fs;
use std::io::IsTerminal as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use api::{FineTime, PassView, RefusedElements, SkyGapView};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use tle::UtcInstant;
use tle::passes::{PassSearch, SearchError};

use super::shell::{print_json, print_text, runtime, stop_on_signals};
use super::sky::{Moment, Sky, SkyArgs, now, tell};
use super::{Exit, Failure};
use crate::sky::{
    PredictError, Prediction, Timeline, fine_time, icalendar, pass_table, plot_pass, predict, timeline_svg,
};

/// Sky plots that one call writes.
const PLOTS_MAX: usize = 1000;

/// `gs-server passes`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  gs-server passes --elements gp.json --station 46.5191,6.5668,410
  gs-server passes --elements gp.json --station Lausanne=46.5191,6.5668,410 --satellite 25544 \\
      --start 2026-11-22T00:00:00Z --stop +7d --min-elevation 10 --frequency 437e6 --json
  curl -s https://celestrak.org/NORAD/elements/gp.php?GROUP=cubesat\\&FORMAT=json |
      gs-server passes --elements - --station 46.5191,6.5668,410 --timeline day.svg --ics day.ics

Times are UTC: 2026-11-22T05:19:25Z, 2026-11-22, now, or a distance: --start from now, --stop from
--start. AOS and LOS are geometric crossings of --min-elevation, without refraction. A pass that the
window cuts is marked < or > (its true ends are in the JSON), one that the elements cut, !.

A file may hold several sets of one object: a pass is computed with the newest at or before its AOS.

Exit code 0 also if there is no pass; 1 if a set of elements was refused (the others are used); 2 if
the arguments make no sense.")]
pub struct Passes {
    #[command(flatten)]
    sky: SkyArgs,
    /// Begin of the window, UTC
    #[arg(long, value_name = "T", default_value = "now", allow_hyphen_values = true)]
    start: Moment,
    /// End of the window, UTC
    #[arg(long, value_name = "T", default_value = "+24h", allow_hyphen_values = true)]
    stop: Moment,
    /// Elevation above which a pass is a pass, degrees; 0, or what the configuration says. Where a station has a mask, the
    /// higher counts
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    min_elevation: Option<f64>,
    /// Write the sky plot of the highest pass; into a folder: of every pass
    #[arg(long, value_name = "FILE or DIR")]
    svg: Option<PathBuf>,
    /// Write a timeline of the passes as SVG
    #[arg(long, value_name = "FILE")]
    timeline: Option<PathBuf>,
    /// Write the passes as a calendar
    #[arg(long, value_name = "FILE")]
    ics: Option<PathBuf>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    start: FineTime,
    stop: FineTime,
    min_elevation_deg: f64,
    frequency_hz: Option<f64>,
    ut1_minus_utc_s: f64,
    satellites: usize,
    passes: Vec<PassView>,
    gaps: Vec<SkyGapView>,
    refused: Vec<RefusedElements>,
}

impl Passes {
    pub(super) fn run(self) -> Result<Exit, Failure> {
        let now = now();
        let start = self.start.resolve(now, now);
        let stop = self.stop.resolve(now, start);
        // What cannot be searched is said before anything is read.
        search_nothing(&PassSearch::new(start, stop, self.min_elevation.unwrap_or_default()))?;
        let sky = self.sky.read((start, stop))?;
        let min_elevation_deg = self.min_elevation.unwrap_or(sky.min_elevation_deg);
        let search =
            PassSearch { orientation: sky.orientation, ..PassSearch::new(start, stop, min_elevation_deg) };
        let found = self.search(&sky, &search)?;
        tell(
            found.gaps.iter().map(|gap| {
                format!("{}: no state from {} to {}: {}", gap.satellite, gap.from, gap.until, gap.error)
            }),
            "stretches without a state",
        );
        self.write(&sky, &search, &found, now)?;
        let exit = if sky.catalogue.refused.is_empty() { Exit::Done } else { Exit::Failed };
        if self.sky.json {
            print_json(&Answer {
                start: fine_time(start),
                stop: fine_time(stop),
                min_elevation_deg,
                frequency_hz: self.sky.frequency,
                ut1_minus_utc_s: sky.orientation.ut1_minus_utc_s(),
                satellites: sky.catalogue.objects.len(),
                passes: found.passes,
                gaps: found.gaps,
                refused: sky.catalogue.refused,
            })?;
        } else if found.passes.is_empty() {
            eprintln!("gs-server: no pass between {start} and {stop}");
        } else {
            print_text(&pass_table(&found.passes))?;
        }
        Ok(exit)
    }

    /// Searches on all cores, with a bar for those who watch, until a signal.
    fn search(&self, sky: &Sky, search: &PassSearch) -> Result<Prediction, Failure> {
        let objects = &sky.catalogue.objects;
        let is_watched = std::io::stderr().is_terminal() && objects.len() > 1;
        let bar = if is_watched { ProgressBar::new(objects.len() as u64) } else { ProgressBar::hidden() };
        bar.set_style(
            ProgressStyle::with_template("{bar:40} satellite {pos} of {len}, {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        let runtime = runtime()?;
        let _context = runtime.enter();
        let stop = stop_on_signals()?;
        let found = predict(objects, &sky.places, search, self.sky.frequency, |done| {
            bar.set_position(done as u64);
            if stop.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        bar.finish_and_clear();
        found.map_err(failure)
    }

    fn write(
        &self,
        sky: &Sky,
        search: &PassSearch,
        found: &Prediction,
        now: UtcInstant,
    ) -> Result<(), Failure> {
        if let Some(path) = &self.svg {
            write_plots(path, sky, search, &found.passes)?;
        }
        if let Some(path) = &self.timeline {
            let timeline = Timeline { start: search.start, stop: search.stop, passes: &found.passes };
            write_file(path, &timeline_svg(&timeline))?;
        }
        if let Some(path) = &self.ics {
            let names: Vec<_> = sky.places.iter().map(|place| place.name.as_str()).collect();
            let name = format!("Passes over {}", names.join(", "));
            write_file(path, &icalendar(&found.passes, &name, fine_time(now)))?;
        }
        Ok(())
    }
}

fn search_nothing(search: &PassSearch) -> Result<(), Failure> {
    predict(&[], &[], search, None, |_| ControlFlow::Continue(())).map(drop).map_err(failure)
}

fn failure(error: PredictError) -> Failure {
    match error {
        PredictError::Search(SearchError::Stopped { .. }) | PredictError::Elements { .. } => {
            Failure::failed(error)
        }
        PredictError::Search(_) | PredictError::TooMany => Failure::usage(error),
    }
}

fn write_plots(path: &Path, sky: &Sky, search: &PassSearch, passes: &[PassView]) -> Result<(), Failure> {
    if !path.is_dir() {
        let best = passes.iter().max_by(|a, b| a.max_elevation_deg.total_cmp(&b.max_elevation_deg));
        let Some(best) = best else {
            return Err(Failure::failed(
                "there is no pass to draw: choose a longer window or a lower elevation",
            ));
        };
        return write_file(path, &plot(sky, search, best)?);
    }
    if passes.len() > PLOTS_MAX {
        return Err(Failure::usage(format!(
            "{} passes are more than {PLOTS_MAX} plots: choose a shorter window or fewer satellites",
            passes.len()
        )));
    }
    for pass in passes {
        let aos: String = pass.aos.to_string().chars().take(19).filter(|c| !matches!(c, '-' | ':')).collect();
        let name = format!("{aos}Z-{}-{}.svg", file_name(&pass.satellite), file_name(&pass.station));
        write_file(&path.join(name), &plot(sky, search, pass)?)?;
    }
    Ok(())
}

fn plot(sky: &Sky, search: &PassSearch, pass: &PassView) -> Result<String, Failure> {
    let object = sky.catalogue.objects.iter().find(|object| {
        object.label() == pass.satellite
            && object.norad_cat_id() == pass.norad_cat_id
            && object.sets().iter().any(|set| fine_time(set.epoch) == pass.epoch)
    });
    let set =
        object.and_then(|object| object.sets().iter().rev().find(|set| fine_time(set.epoch) == pass.epoch));
    let place = sky.places.iter().find(|place| place.name == pass.station);
    let (Some(set), Some(place)) = (set, place) else {
        return Err(Failure::failed(format!("the elements of {} are gone", pass.satellite)));
    };
    plot_pass(pass, set, place, search.orientation)
        .map_err(|error| Failure::doing(format!("the pass of {} cannot be drawn", pass.satellite), error))
}

fn file_name(name: &str) -> String {
    let kept = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '.' | ',' | '+') { c } else { '_' };
    name.chars().take(40).map(kept).collect()
}

fn write_file(path: &Path, text: &str) -> Result<(), Failure> {
    fs::write(path, text)
        .map_err(|error| Failure::doing(format!("{} cannot be written", path.display()), error))
}
