//! The satellite in the ground station's sky: whether it is up, how high, how far, and when that changes.
//!
//! Times are the twin's microseconds. Where the sky follows an orbit, UTC is `utc_at_zero` plus these; nothing else knows
//! UTC here.

use std::ops::Range;

use tle::{
    EarthOrientation, PropagationError, Station, UtcInstant, ecef_from_teme, gmst_rad, passes::PassSearch,
};

use crate::{
    orbit::Orbit,
    passes::{PassProfile, range_km},
};

/// Speed of light, km/s.
const LIGHT_KM_S: f64 = tle::doppler::LIGHT_KM_S;
/// What a station sees of a satellite far below its horizon, degrees.
const BELOW_DEG: f64 = -90.0;
/// Passes are searched in pieces of the calendar, so that an answer does not depend on what was asked before it.
const CHUNK_US: i64 = 86_400_000_000;
/// So many pieces ahead the next change is looked for.
const CHUNKS_AHEAD: i64 = 32;

/// Where the satellite stands in the station's sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyLook {
    /// Elevation, degrees; -90 where nothing is known of a satellite below the horizon.
    pub elevation_deg: f64,
    /// Distance, km.
    pub range_km: f64,
    /// How the distance changes, km/s: negative while approaching. 0 in a stored profile, which knows of no Doppler.
    pub range_rate_km_s: f64,
}

impl SkyLook {
    /// How long light takes over the distance, microseconds.
    #[must_use]
    pub fn delay_us(&self) -> u64 {
        (self.range_km / LIGHT_KM_S * 1e6) as u64
    }

    const BELOW: Self = Self { elevation_deg: BELOW_DEG, range_km: 0.0, range_rate_km_s: 0.0 };
}

/// The sky over the ground station, one satellite in it.
///
/// Answers are pure functions of the time; what was computed last is kept, because the channel asks for each frame.
#[derive(Clone, Debug)]
pub struct Sky(Geometry);

#[derive(Clone, Debug)]
enum Geometry {
    Stored(PassProfile),
    Orbit(Box<OrbitSky>),
}

impl Sky {
    /// The sky of a profile. `orbit` and `utc_at_zero`, the UTC at the twin's microsecond 0, count for
    /// [`PassProfile::Orbit`] alone.
    #[must_use]
    pub fn new(profile: &PassProfile, orbit: &Orbit, utc_at_zero: UtcInstant) -> Self {
        Self(match profile {
            PassProfile::Orbit { station, orientation } => Geometry::Orbit(Box::new(OrbitSky {
                orbit: orbit.clone(),
                station: (**station).clone(),
                orientation: *orientation,
                utc_at_zero,
                chunks: [None, None],
                run: None,
                fault: Fault::None,
            })),
            stored => Geometry::Stored(stored.clone()),
        })
    }

    /// The satellite flies another orbit from now on. Stored profiles take no notice.
    pub fn exchange(&mut self, orbit: &Orbit) {
        if let Geometry::Orbit(sky) = &mut self.0 {
            sky.orbit = orbit.clone();
            (sky.chunks, sky.run, sky.fault) = ([None, None], None, Fault::None);
        }
    }

    /// Whether the satellite is above the horizon, and the station's mask.
    pub fn in_view(&mut self, now_us: u64) -> bool {
        match &mut self.0 {
            Geometry::Stored(profile) => profile.in_view(now_us),
            Geometry::Orbit(sky) => sky.run_at(now_us).in_view,
        }
    }

    /// The next moment after `now_us` at which [`Self::in_view`] changes; `None` if it never does, or not in the next
    /// 32 days.
    pub fn next_change_us(&mut self, now_us: u64) -> Option<u64> {
        match &mut self.0 {
            Geometry::Stored(profile) => profile.next_change_us(now_us),
            Geometry::Orbit(sky) => {
                let zero_us = sky.utc_at_zero.unix_us();
                let run = sky.run_at(now_us);
                let since_zero_us = run.utc_us.end.checked_sub(zero_us)?;
                run.changes.then(|| u64::try_from(since_zero_us).ok())?
            }
        }
    }

    /// Where the satellite stands. Where the elements have no state it is far below the horizon.
    pub fn look(&mut self, now_us: u64) -> SkyLook {
        match &mut self.0 {
            Geometry::Stored(profile) => {
                let elevation_deg = profile.elevation_deg(now_us);
                SkyLook { elevation_deg, range_km: range_km(elevation_deg), range_rate_km_s: 0.0 }
            }
            Geometry::Orbit(sky) => sky.look(now_us),
        }
    }

    /// Why the elements had no state, the first time that there was none; then never again until they are exchanged.
    pub fn take_fault(&mut self) -> Option<PropagationError> {
        let Geometry::Orbit(sky) = &mut self.0 else { return None };
        let Fault::New(fault) = sky.fault else { return None };
        sky.fault = Fault::Told;
        Some(fault)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    New(PropagationError),
    Told,
}

/// A piece of the calendar, and when in it the satellite is up: ascending, from the first moment up to the first down.
#[derive(Clone, Debug)]
struct Chunk {
    number: i64,
    up_us: Vec<Range<i64>>,
}

/// A stretch of UTC (µs) in which nothing changes; `changes` at its end, or the search ended there.
#[derive(Clone, Debug)]
struct Run {
    utc_us: Range<i64>,
    in_view: bool,
    changes: bool,
}

/// A sky that an orbit fills.
#[derive(Clone, Debug)]
struct OrbitSky {
    orbit: Orbit,
    station: Station,
    orientation: EarthOrientation,
    utc_at_zero: UtcInstant,
    /// Even and odd pieces: a question around a border does not search twice.
    chunks: [Option<Chunk>; 2],
    run: Option<Run>,
    fault: Fault,
}

impl OrbitSky {
    fn utc(&self, now_us: u64) -> UtcInstant {
        self.utc_at_zero.plus_us(i64::try_from(now_us).unwrap_or(i64::MAX))
    }

    fn look(&mut self, now_us: u64) -> SkyLook {
        let at = self.utc(now_us);
        match self.orbit.at(at) {
            Ok(state) => {
                let look = self.station.look(&ecef_from_teme(&state, gmst_rad(at, self.orientation)));
                SkyLook {
                    elevation_deg: look.elevation_deg,
                    range_km: look.range_km,
                    range_rate_km_s: look.range_rate_km_s,
                }
            }
            Err(error) => {
                if self.fault == Fault::None {
                    self.fault = Fault::New(error);
                }
                SkyLook::BELOW
            }
        }
    }

    fn run_at(&mut self, now_us: u64) -> &Run {
        let at_us = self.utc(now_us).unix_us();
        let run = match self.run.take() {
            Some(run) if run.utc_us.contains(&at_us) => run,
            _ => self.find_run(at_us),
        };
        self.run.insert(run)
    }

    fn find_run(&mut self, at_us: i64) -> Run {
        let first = at_us.div_euclid(CHUNK_US);
        let up_us = self.up_in(first);
        let in_view = up_us.iter().any(|up| up.contains(&at_us));
        let before = up_us.iter().flat_map(|up| [up.start, up.end]).take_while(|edge| *edge <= at_us).last();
        let start_us = before.unwrap_or_else(|| first.saturating_mul(CHUNK_US));
        let mut end_us = at_us;
        for number in first..first.saturating_add(CHUNKS_AHEAD) {
            let (chunk_us, after_us) = bounds(number);
            let up_us = self.up_in(number);
            end_us = if in_view {
                // Up to the end of this pass, and of what joins it.
                let at_us = end_us.max(chunk_us);
                up_us.iter().find(|up| up.contains(&at_us)).map_or(at_us, |up| up.end)
            } else {
                up_us.iter().map(|up| up.start).find(|start| *start >= end_us).unwrap_or(after_us)
            };
            if end_us < after_us {
                return Run { utc_us: start_us..end_us, in_view, changes: true };
            }
        }
        Run { utc_us: start_us..end_us.max(at_us.saturating_add(1)), in_view, changes: false }
    }

    /// When the satellite is up in a piece of the calendar.
    fn up_in(&mut self, number: i64) -> &[Range<i64>] {
        let slot = &mut self.chunks[usize::from(number & 1 == 1)];
        let chunk = match slot.take() {
            Some(chunk) if chunk.number == number => chunk,
            _ => {
                let (start_us, stop_us) = bounds(number);
                let search = PassSearch {
                    orientation: self.orientation,
                    beyond_window: false,
                    // The mask alone says what is up: it may be below 0 on a mountain.
                    ..PassSearch::new(
                        UtcInstant::from_unix_us(start_us),
                        UtcInstant::from_unix_us(stop_us),
                        self.station.mask().range_deg().0,
                    )
                };
                // Outside the years 1900 to 2200 nothing is known of passes, and none comes.
                let found = self.orbit.finder().find(std::slice::from_ref(&self.station), &search);
                let passes = found.map(|found| found.stations).unwrap_or_default();
                let up = passes.iter().flatten().map(|pass| pass.aos.at.unix_us()..pass.los.at.unix_us());
                Chunk { number, up_us: up.filter(|up| !up.is_empty()).collect() }
            }
        };
        &slot.insert(chunk).up_us
    }
}

fn bounds(number: i64) -> (i64, i64) {
    let start_us = number.saturating_mul(CHUNK_US);
    (start_us, start_us.saturating_add(CHUNK_US))
}
