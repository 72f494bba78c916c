//! Who has the satellite in view when, and how likely a frame is heard: everything on one raster of time, a beat for a chunk.

use tle::passes::{PassFinder, PassSearch};
use tle::{EarthFixed, UtcInstant, ecef_from_teme, gmst_rad};

use crate::clock::UtcUs;
use crate::sky::instant;

use super::task::{Task, TaskError};

/// A pass of the satellite over a listener.
#[derive(Debug, Clone)]
pub(super) struct Visit {
    pub(super) listener: usize,
    /// Whether it listens at all.
    pub(super) listening: f64,
    /// The first beat.
    pub(super) first: usize,
    /// Margin of the link, dB, beat by beat.
    pub(super) margins_db: Vec<f32>,
    /// Elevation at its greatest, degrees.
    pub(super) elevation_deg: f64,
}

/// The window, beat by beat.
#[derive(Debug, Clone)]
pub struct Coverage {
    pub(super) from: UtcUs,
    pub(super) beat_us: i64,
    pub(super) visits: Vec<Visit>,
    /// Which visits last in each beat.
    pub(super) in_view: Vec<Vec<u32>>,
    /// The probability that anybody hears a frame of that beat, at best.
    pub(super) anybody: Vec<f64>,
    /// Where the satellite must be silent.
    pub(super) is_silent: Vec<bool>,
    pub(super) sunlit: Vec<bool>,
}

impl Coverage {
    /// Looks through the window.
    ///
    /// # Errors
    /// Elements without a state somewhere in the window.
    pub fn of(task: &Task) -> Result<Self, TaskError> {
        task.check()?;
        let finder = PassFinder::new(&task.elements)?;
        let beat_us = task.rules.beat_us();
        let beats = usize::try_from((task.until.0 - task.from.0) / beat_us).unwrap_or(0);
        // A frame counts where it is in its middle.
        let middle = |beat: usize| instant(UtcUs(task.from.0 + beat as i64 * beat_us + beat_us / 2));
        let mut states: Vec<Option<EarthFixed>> = vec![None; beats];
        let search = PassSearch {
            orientation: task.orientation,
            beyond_window: false,
            ..PassSearch::new(instant(task.from), instant(task.until), 0.0)
        };
        let places: Vec<tle::Station> = task.listeners.iter().map(|one| one.place.clone()).collect();
        let found = finder.find(&places, &search)?;
        let mut visits = Vec::new();
        for (listener, passes) in found.stations.iter().enumerate() {
            let ear = &task.listeners[listener];
            for pass in passes {
                let beat_of = |at: UtcInstant| {
                    usize::try_from((at.unix_us() - task.from.0).div_euclid(beat_us)).unwrap_or(0)
                };
                let (first, end) = (beat_of(pass.aos.at), (beat_of(pass.los.at) + 1).min(beats));
                let mut margins_db = Vec::with_capacity(end.saturating_sub(first));
                for (beat, state) in states.iter_mut().enumerate().take(end).skip(first) {
                    let object = match state {
                        Some(object) => *object,
                        None => {
                            let at = middle(beat);
                            let made = finder.propagator().at(at)?;
                            *state.insert(ecef_from_teme(&made, gmst_rad(at, task.orientation)))
                        }
                    };
                    let look = ear.place.look(&object);
                    let is_up = look.elevation_deg > 0.0 && ear.place.sees(&look);
                    let margin = task.link.margin_db(look.elevation_deg, look.range_km);
                    margins_db.push(if is_up { margin as f32 } else { f32::NEG_INFINITY });
                }
                let listening = ear.listening(UtcUs(pass.tca.at.unix_us()));
                if !margins_db.is_empty() && listening > 0.0 {
                    let elevation_deg = pass.tca.look.elevation_deg;
                    visits.push(Visit { listener, listening, first, margins_db, elevation_deg });
                }
            }
        }
        let mut in_view = vec![Vec::new(); beats];
        for (number, visit) in visits.iter().enumerate() {
            for beat in &mut in_view[visit.first..visit.first + visit.margins_db.len()] {
                beat.push(number as u32);
            }
        }
        let mut coverage = Self {
            from: task.from,
            beat_us,
            visits,
            in_view,
            anybody: Vec::new(),
            is_silent: vec![false; beats],
            sunlit: Vec::new(),
        };
        let held_db = task.pointing.map_or(0.0, |pointing| pointing.held_loss_db);
        coverage.anybody = (0..beats)
            .map(|beat| {
                1.0 - coverage.in_view[beat]
                    .iter()
                    .map(|&visit| {
                        let visit = &coverage.visits[visit as usize];
                        1.0 - visit.listening * visit.heard(task, beat, held_db)
                    })
                    .product::<f64>()
            })
            .collect();
        for span in &task.silent {
            let beat_of = |at: UtcUs| usize::try_from((at.0 - task.from.0).div_euclid(beat_us)).unwrap_or(0);
            let (start, end) = (beat_of(span.start).min(beats), (beat_of(span.end) + 1).min(beats));
            if span.end > task.from && start < end {
                coverage.is_silent[start..end].fill(true);
            }
        }
        for (beat, is_silent) in coverage.is_silent.iter().enumerate() {
            if *is_silent {
                coverage.anybody[beat] = 0.0;
            }
        }
        if task.battery.is_some() {
            // Shadow edges move by seconds at most between two looks.
            for beat in 0..beats {
                let known = (beat % 16 != 0).then(|| coverage.sunlit.last().copied()).flatten();
                coverage.sunlit.push(match known {
                    Some(lit) => lit,
                    None => {
                        let at = middle(beat);
                        let state = finder.propagator().at(at)?;
                        tle::shadow::light(state.r_teme_km, at) == tle::shadow::Light::Sunlit
                    }
                });
            }
        }
        Ok(coverage)
    }

    /// Beats in the window.
    pub(super) fn beats(&self) -> usize {
        self.anybody.len()
    }

    /// When a beat begins.
    pub(super) fn at(&self, beat: usize) -> UtcUs {
        UtcUs(self.from.0 + beat as i64 * self.beat_us)
    }

    /// Passes over listeners in the window.
    #[must_use]
    pub fn visits(&self) -> usize {
        self.visits.len()
    }

    /// The share of the window in which at least one listener has the satellite in view.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.in_view.iter().filter(|beat| !beat.is_empty()).count() as f64 / self.beats().max(1) as f64
    }
}

impl Visit {
    /// The probability that a frame of this beat is heard if the listener listens.
    pub(super) fn heard(&self, task: &Task, beat: usize, loss_db: f64) -> f64 {
        let margin = beat.checked_sub(self.first).and_then(|since| self.margins_db.get(since));
        margin.map_or(0.0, |&margin| task.link.heard(f64::from(margin) - loss_db))
    }
}
