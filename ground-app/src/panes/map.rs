//! The world: where the satellites are, who sees them, who heard them.

use std::collections::BTreeMap;

use api::ReceiverView;
use egui::Ui;
use ui::geo::Place;
use ui::map::{Receiver, Satellite, Station, TrackPoint, World, WorldMap};

use super::Scene;
use crate::orbit::{self, Orbits};

/// A point of the ground track so often.
const STEP_US: i64 = 30_000_000;
/// The track is drawn anew when so much time has gone by.
const MINUTE_US: i64 = 60_000_000;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    map: Option<WorldMap>,
    tracks: Tracks,
}

/// Ground tracks, computed once a minute.
#[derive(Default)]
pub(super) struct Tracks {
    of: Option<(u64, i64)>,
    tracks: BTreeMap<String, Vec<TrackPoint>>,
}

impl Tracks {
    /// One revolution back and two ahead of each satellite.
    fn renew(&mut self, orbits: &Orbits, scene: &Scene0<'_>, now_us: i64) {
        let of = (orbits.revision(), now_us.div_euclid(MINUTE_US));
        if self.of == Some(of) {
            return;
        }
        self.of = Some(of);
        self.tracks.clear();
        for name in scene.names {
            if let Ok(orbit) = orbits.of(scene.model, name) {
                let period_us = orbit.period_us();
                let track = orbit.track(now_us - period_us / 2, now_us + 3 * period_us / 2, STEP_US);
                self.tracks.insert(name.clone(), track);
            }
        }
    }
}

/// What tracks are made of.
struct Scene0<'a> {
    model: &'a crate::model::Model,
    names: &'a [String],
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let Some(now_us) = scene.now_us else { return super::blank::show(ui, scene) };
    let Some((status, _)) = &scene.model.status else { return super::blank::show(ui, scene) };
    let names: Vec<String> = status.satellites.iter().map(|view| view.satellite.clone()).collect();
    let ours = scene.satellite().map(|view| view.satellite.clone());
    let kept = &mut *scene.kept;
    kept.orbits.renew(scene.model);
    let (orbits, state) = (&kept.orbits, &mut kept.map);
    state.tracks.renew(orbits, &Scene0 { model: scene.model, names: &names }, now_us);
    let footprints: Vec<Vec<Place>> = names
        .iter()
        .map(|name| orbits.of(scene.model, name).map(|orbit| orbit.footprint(now_us)).unwrap_or_default())
        .collect();
    let satellites: Vec<Satellite<'_>> = names
        .iter()
        .zip(&footprints)
        .map(|(name, footprint)| Satellite {
            name,
            place: orbits.of(scene.model, name).ok().and_then(|orbit| Some(orbit.below(now_us)?.0)),
            track: state.tracks.tracks.get(name).map_or(&[], Vec::as_slice),
            footprint,
            is_ours: ours.as_ref() == Some(name),
        })
        .collect();
    let heard = receivers(scene.model.receivers.value().map_or(&[][..], |page| &page.items));
    let world = World {
        now: orbit::timestamp(now_us),
        subsolar: Some(orbit::subsolar(now_us)),
        satellites: &satellites,
        stations: &station(orbits, &status.station),
        receivers: &heard,
    };
    let map = state.map.get_or_insert_with(|| WorldMap::new(ui::map_base::View::default()));
    let below = 22.0;
    map.show(ui, (ui.available_height() - below).max(80.0), &world);
    let words = match ours.as_deref().map(|name| orbits.of(scene.model, name)) {
        Some(Ok(orbit)) => match orbit.below(now_us) {
            Some((place, height_km)) => format!(
                "over {}, {} up",
                ui::format::place(place.longitude_deg, place.latitude_deg),
                ui::format::Quantity::of(Some(height_km), 0, "km")
            ),
            None => "The elements tell no place for this time".to_owned(),
        },
        Some(Err(why)) => why.to_string(),
        None => "No satellite".to_owned(),
    };
    ui.weak(words);
}

/// Our station, as the map takes it.
pub(super) fn station<'a>(orbits: &Orbits, name: &'a str) -> Vec<Station<'a>> {
    let place = orbits.station().map(|at| Place::new(at.longitude_deg(), at.latitude_deg()));
    place.map(|place| Station { name, place }).into_iter().collect()
}

/// Those of whom it is known where they are, as the map takes them.
pub(super) fn receivers(views: &[ReceiverView]) -> Vec<Receiver<'_>> {
    views.iter().filter_map(receiver).collect()
}

fn receiver(view: &ReceiverView) -> Option<Receiver<'_>> {
    Some(Receiver {
        name: view.name.as_deref().unwrap_or(&view.id),
        place: Place::new(view.longitude_deg?, view.latitude_deg?),
        last_heard: orbit::timestamp(view.last_heard_at?.unix_us()),
    })
}
