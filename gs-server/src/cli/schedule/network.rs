//! `schedule --stations`: many satellites over the antennas of several stations, from files, without a server.

use std::ops::ControlFlow;
use std::path::PathBuf;

use api::{ContactView, FineTime, PassView, RefusedView};
use mission::schedule::{
    self as scheduler, Candidate, Foretold, Partial, Policy, Problem, Schedule, identify,
};
use mission::{StationId, UtcUs};
use serde::Serialize;
use tle::UtcInstant;
use tle::passes::PassSearch;

use super::file::{Ground, Network, Wanted};
use super::{contact_line, refused_line, summary};
use crate::cli::shell::{print_json, print_line};
use crate::cli::sky::{Moment, SkyArgs, now};
use crate::cli::{Exit, Failure};
use crate::schedule::{self, Taker};
use crate::sky::{Object, Place, fine_time, predict};

/// The scheduler looks no further ahead.
const DAYS_MAX: f64 = 31.0;
/// Nobody plans for more passes at once.
const PASSES_MAX: usize = 20_000;

/// What is asked.
pub(super) struct Ask {
    pub(super) stations: PathBuf,
    pub(super) elements: Vec<PathBuf>,
    pub(super) start: Moment,
    pub(super) days: f64,
    pub(super) json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Told<'a> {
    start: FineTime,
    stop: FineTime,
    passes: usize,
    contacts: &'a [ContactView],
    refused: &'a [RefusedView],
    /// Satellites without any pass long and high enough, by name.
    without_passes: Vec<&'a str>,
    worth: f64,
    bound: f64,
    gap: f64,
    proved: bool,
}

impl Ask {
    pub(super) fn answer(self) -> Result<Exit, Failure> {
        if !(self.days > 0.0 && self.days <= DAYS_MAX) {
            return Err(Failure::usage(format!(
                "--days: must be above 0, {DAYS_MAX} at most, found {}",
                self.days
            )));
        }
        let network = Network::load(&self.stations)?;
        let now = now();
        let start = self.start.resolve(now, now);
        let window = (start, start.plus_seconds(self.days * 86_400.0));
        let objects = self.objects(&network, window)?;
        let mut problem = Problem { policy: Policy::default(), ..Problem::default() };
        for ground in &network.stations {
            problem.antennas.extend(ground.antennas.iter().cloned());
            problem.sites.push(ground.site.clone());
            problem.blackouts.extend(ground.blackouts.iter().cloned());
            problem.candidates.extend(candidates(ground, &network.satellites, &objects, window)?);
            if problem.candidates.len() > PASSES_MAX {
                return Err(Failure::usage(format!(
                    "there are more than {PASSES_MAX} passes: ask for fewer --days, or for higher or longer passes"
                )));
            }
        }
        self.tell(&network, &problem, &scheduler::plan(&problem, &[]), window)
    }

    /// The elements of each satellite, in the order of the file.
    fn objects(&self, network: &Network, window: (UtcInstant, UtcInstant)) -> Result<Vec<Object>, Failure> {
        // The places come from the file; those of the arguments are not looked at.
        let anywhere: Vec<Place> = network
            .stations
            .iter()
            .map(|ground| Place { name: ground.id.to_string(), station: ground.place.place.clone() })
            .collect();
        let catalogue = SkyArgs::of(self.elements.clone(), anywhere, None).read(window)?.catalogue;
        let mut objects = Vec::new();
        for (at, wanted) in network.satellites.iter().enumerate() {
            let mut found = catalogue.clone();
            found.keep(std::slice::from_ref(&wanted.elements)).map_err(|error| {
                Failure::failed(format!(
                    "{}: satellites[{at}]: {error}; say with `elements` how the elements call it",
                    self.stations.display()
                ))
            })?;
            let [object] = &found.objects[..] else {
                return Err(Failure::usage(format!(
                    "{}: satellites[{at}]: {} objects of the elements are called '{}'; name one by its catalogue number with `elements`",
                    self.stations.display(),
                    found.objects.len(),
                    wanted.elements
                )));
            };
            objects.extend(Object::named(wanted.id.as_str(), object.sets().to_vec()));
        }
        Ok(objects)
    }

    fn tell(
        &self,
        network: &Network,
        problem: &Problem,
        answer: &Schedule,
        (start, stop): (UtcInstant, UtcInstant),
    ) -> Result<Exit, Failure> {
        let several =
            network.stations.len() > 1 || network.stations.iter().any(|ground| ground.antennas.len() > 1);
        let taker = Taker { armed: true, wants: "" };
        let contacts: Vec<ContactView> =
            answer.contacts.iter().map(|contact| schedule::contact(contact, taker)).collect();
        let refused: Vec<RefusedView> = answer.refused.iter().map(schedule::refused).collect();
        let has_passes =
            |wanted: &&Wanted| !problem.candidates.iter().any(|pass| pass.satellite == wanted.id);
        let without: Vec<&str> =
            network.satellites.iter().filter(has_passes).map(|wanted| wanted.id.as_str()).collect();
        if self.json {
            print_json(&Told {
                start: fine_time(start),
                stop: fine_time(stop),
                passes: problem.candidates.len(),
                contacts: &contacts,
                refused: &refused,
                without_passes: without,
                worth: answer.worth.points(),
                bound: answer.bound.points(),
                gap: answer.gap(),
                proved: answer.is_proved(),
            })?;
        } else {
            for contact in &contacts {
                let by =
                    if several { format!("{}/{}", contact.station, contact.antenna) } else { String::new() };
                print_line(contact_line(
                    contact,
                    &by,
                    if contact.listens_along { "listens" } else { "served" },
                ))?;
            }
            for refused in &refused {
                print_line(refused_line(refused, if several { &refused.station } else { "" }))?;
            }
            for name in without {
                eprintln!("gs-server: {name} has no pass that is long and high enough");
            }
            print_line(summary(
                (contacts.len(), refused.len()),
                answer.worth.points(),
                answer.bound.points(),
                answer.gap(),
                answer.is_proved(),
            ))?;
        }
        Ok(if problem.candidates.is_empty() { Exit::Failed } else { Exit::Done })
    }
}

/// The passes over one station that are wanted.
fn candidates(
    ground: &Ground,
    satellites: &[Wanted],
    objects: &[Object],
    (start, stop): (UtcInstant, UtcInstant),
) -> Result<Vec<Candidate>, Failure> {
    let place = Place { name: ground.id.to_string(), station: ground.place.place.clone() };
    let search = PassSearch {
        orientation: ground.place.orientation,
        ..PassSearch::new(start, stop, ground.place.min_elevation_deg)
    };
    let found = predict(objects, &[place], &search, None, |_| ControlFlow::Continue(()))
        .map_err(|error| Failure::failed(format!("passes over {}: {error}", ground.id)))?;
    let mut out = Vec::new();
    for wanted in satellites.iter().filter(|wanted| wanted.may_use(&ground.id)) {
        let passes: Vec<&PassView> = found
            .passes
            .iter()
            .filter(|pass| pass.satellite == wanted.id.as_str() && wanted.takes(pass))
            .collect();
        let times: Vec<(UtcUs, UtcUs)> =
            passes.iter().map(|pass| (UtcUs(pass.aos.unix_us()), UtcUs(pass.los.unix_us()))).collect();
        let none: [Foretold; 0] = [];
        let keys = identify(&wanted.id, &ground.id, &none, &times);
        for ((key, (aos, los)), pass) in keys.into_iter().zip(times).zip(passes) {
            let value =
                f64::from(scheduler::points(wanted.priority, pass.duration_s as u32, pass.max_elevation_deg));
            out.push(Candidate {
                key,
                satellite: wanted.id.clone(),
                station: ground.id.clone(),
                antennas: Vec::new(),
                aos,
                los,
                max_elevation_deg: pass.max_elevation_deg,
                value: (value * wanted.worth).clamp(1.0, f64::from(Candidate::MAX_VALUE)) as u32,
                min_duration_s: wanted.min_duration_s,
                partial: Partial::Proportional,
                transmit: wanted.transmit,
                plan: None,
            });
        }
    }
    Ok(out)
}

impl Wanted {
    fn may_use(&self, station: &StationId) -> bool {
        self.stations.is_empty() || self.stations.contains(station)
    }

    /// Low ones are nothing to it, and those that the window cuts are not its passes.
    fn takes(&self, pass: &PassView) -> bool {
        pass.max_elevation_deg >= self.min_max_elevation_deg
    }
}
