//! What else must hold before a command leaves: elevation, a beacon, values, the time in the pass.

use std::collections::BTreeMap;

use super::gate::Wait;
use super::intake::Heard;
use super::{Station, runner};
use crate::clock::Now;
use crate::id::CommandId;
use crate::plan::{Condition, ContactWindow, Holds, Reading, RunView};
use crate::record::Point;

/// Parameters whose newest value is kept, of one satellite.
const READINGS_MAX: usize = 4096;

impl Station {
    /// Keeps the newest value of each parameter.
    pub(super) fn note_readings(&mut self, heard: &Heard, points: &[Point]) {
        let Some(s) = self.satellite_index(&heard.route.satellite) else { return };
        let readings = &mut self.satellites[s].readings;
        for point in points {
            let value = (point.value, heard.at.mono);
            if let Some(held) = readings.get_mut(&point.parameter) {
                *held = value;
            } else if readings.len() < READINGS_MAX {
                readings.insert(point.parameter.clone(), value);
            }
        }
    }

    /// The values that these parameters have now.
    pub(super) fn readings_of<'a>(
        &self,
        now: Now,
        s: usize,
        parameters: impl IntoIterator<Item = &'a str>,
    ) -> BTreeMap<String, Reading> {
        let readings = &self.satellites[s].readings;
        let one = |name: &str| {
            let (value, at) = readings.get(name)?;
            Some((name.to_owned(), Reading { value: *value, age_us: now.mono.since(*at) }))
        };
        parameters.into_iter().filter_map(one).collect()
    }

    /// The values that a run looks at.
    pub(super) fn readings(&self, now: Now, s: usize, at: usize) -> BTreeMap<String, Reading> {
        let parameters = runner::parameters(&self.runs[at]);
        self.readings_of(now, s, parameters.iter().map(String::as_str))
    }

    /// Whether the conditions of a command hold. What they wait for holds up this command and no other.
    pub(super) fn condition_gate(&self, now: Now, s: usize, id: CommandId) -> Result<(), Wait> {
        let sat = &self.satellites[s];
        let Some(when) = sat.commands.get(&id).and_then(|command| command.record.when.as_deref()) else {
            return Ok(());
        };
        let pass = sat.believed_pass(now.utc);
        let needs_pass =
            when.min_elevation_deg.is_some() || when.after_aos_us.is_some() || when.before_los_us.is_some();
        let window = match pass {
            Some(pass) => {
                ContactWindow { aos: pass.aos_at, los: pass.los_at.unwrap_or(crate::UtcUs(i64::MAX)) }
            }
            None if needs_pass => {
                let why = "its conditions speak of a pass, and none lasts".into();
                return Err(Wait {
                    why,
                    until: sat.believed_aos(now.utc).map(|aos| super::outcome::mono_of(now, aos)),
                });
            }
            None => ContactWindow { aos: now.utc, los: crate::UtcUs(i64::MAX) },
        };
        let telemetry = self.readings_of(now, s, when.telemetry.iter().map(|guard| guard.parameter.as_str()));
        let view = RunView {
            now,
            window,
            elevation_deg: self.site.as_ref().and_then(|site| sat.sky.elevation_deg(site, now.utc)),
            heard_ago_us: sat.contact.heard_ago_us(now.mono),
            telemetry: &telemetry,
            asked: &BTreeMap::new(),
            held: false,
        };
        match Condition::holds(when, &view) {
            Holds::Yes => Ok(()),
            Holds::NotYet { why, look_after_us } => {
                Err(Wait { why: why.into(), until: look_after_us.map(|us| now.mono.plus(us)) })
            }
            // In this pass no more; in the next one perhaps.
            Holds::Never(why) => Err(Wait { why: why.into(), until: None }),
        }
    }
}
