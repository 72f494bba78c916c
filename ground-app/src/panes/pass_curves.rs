//! Doppler, range, elevation over the pass that lasts or comes next, and how strongly frames were heard in it.

use std::time::{Duration, Instant};

use api::AntennaView;
use egui::Ui;
use jiff::SignedDuration;
use ui::plot::{Curve, Series, View, plot_ui};

use super::Scene;
use crate::link::Pending;
use crate::orbit;

/// The carrier is asked for so often.
const ASK: Duration = Duration::from_secs(60);
/// Points of the curves so often.
const STEP_US: i64 = 5_000_000;

/// What this pane keeps between frames.
#[derive(Default)]
pub(super) struct State {
    curves: Option<Curves>,
    view: Option<View>,
    asked: Option<(Instant, Pending<AntennaView>)>,
    antenna: Option<AntennaView>,
}

/// The curves of one pass.
struct Curves {
    of: (String, u64, i64, Option<u64>),
    elevation: Series,
    range: Series,
    doppler: Series,
    rssi: Series,
    /// The newest frame that was looked at.
    seen: u64,
}

pub(super) fn show(ui: &mut Ui, scene: &mut Scene<'_>) {
    let (Some(now_us), Some(satellite)) =
        (scene.now_us, scene.satellite().map(|view| view.satellite.clone()))
    else {
        return super::blank::show(ui, scene);
    };
    let mut state = std::mem::take(&mut scene.kept.pass_curves);
    state.ask(scene);
    state.show(ui, scene, &satellite, now_us);
    scene.kept.pass_curves = state;
}

impl State {
    /// On which frequency it sends, is not in what the stream tells.
    fn ask(&mut self, scene: &Scene<'_>) {
        if let Some(Ok(view)) = self.asked.as_ref().and_then(|(_, pending)| pending.take()) {
            self.antenna = Some(view);
        }
        let due = self.asked.as_ref().is_none_or(|(at, _)| scene.now.saturating_duration_since(*at) >= ASK);
        if due && scene.model.connection.is_live() {
            self.asked = Some((scene.now, scene.courier.ask(|client| async move { client.antenna().await })));
        }
    }

    fn frequency_hz(&self, satellite: &str) -> Option<f64> {
        let antenna = self.antenna.as_ref()?;
        let radio = antenna.doppler.iter().find(|radio| radio.satellite == satellite);
        radio.map(|radio| radio.frequency_hz).or(antenna.rig.as_ref()?.receive_hz)
    }

    fn show(&mut self, ui: &mut Ui, scene: &mut Scene<'_>, satellite: &str, now_us: i64) {
        scene.kept.orbits.renew(scene.model);
        let orbits = &scene.kept.orbits;
        let orbit = match orbits.of(scene.model, satellite) {
            Ok(orbit) => orbit,
            Err(why) => {
                ui.weak(why.to_string());
                return;
            }
        };
        let (Some(station), Some(pass)) =
            (orbits.station(), orbit::current_pass(scene.model, satellite, now_us))
        else {
            ui.weak("No pass within two days");
            return;
        };
        let (aos_us, los_us) = orbit::span_us(pass);
        let frequency_hz = self.frequency_hz(satellite);
        let of = (satellite.to_owned(), orbits.revision(), aos_us, frequency_hz.map(f64::to_bits));
        if self.curves.as_ref().is_none_or(|curves| curves.of != of) {
            let mut curves = Curves {
                of,
                elevation: Series::new(None),
                range: Series::new(None),
                doppler: Series::new(None),
                rssi: Series::new(Some(SignedDuration::from_secs(90))),
                seen: 0,
            };
            for (at_us, look) in orbit.looks(station, aos_us, los_us, STEP_US) {
                let at = orbit::timestamp(at_us);
                curves.elevation.push(at, Some(look.elevation_deg));
                curves.range.push(at, Some(look.range_km));
                let shift =
                    frequency_hz.map(|hz| tle::doppler::downlink_shift_hz(hz, look.range_rate_km_s) / 1e3);
                curves.doppler.push(at, shift.or(Some(look.range_rate_km_s)));
            }
            self.curves = Some(curves);
            self.view = Some(View::new(orbit::timestamp(aos_us), orbit::timestamp(los_us)));
        }
        let (Some(curves), Some(view)) = (&mut self.curves, &mut self.view) else { return };
        for frame in scene.model.live_frames.iter().rev().take_while(|frame| frame.id > curves.seen) {
            let heard_us = frame.heard_at.unix_us();
            let rssi = frame.receptions.first().and_then(|reception| reception.rssi_dbm);
            if frame.satellite == satellite && (aos_us..=los_us).contains(&heard_us) && rssi.is_some() {
                curves.rssi.push(orbit::timestamp(heard_us), rssi.map(f64::from));
            }
        }
        curves.seen = scene.model.live_frames.back().map_or(curves.seen, |frame| frame.id.max(curves.seen));
        let now = orbit::timestamp(now_us);
        let (name, unit) = if frequency_hz.is_some() { ("Doppler", "kHz") } else { ("range rate", "km/s") };
        let curve = |name, unit, series| Curve { name, unit, series, limits: &[], colour: None };
        let height = (ui.available_height() / 2.0 - 8.0).max(90.0);
        let above = [curve(name, unit, &curves.doppler), curve("RSSI", "dBm", &curves.rssi)];
        let shown = if curves.rssi.is_empty() { &above[..1] } else { &above[..] };
        plot_ui(ui, "doppler", shown, view, now, height);
        let below = [curve("elevation", "°", &curves.elevation), curve("range", "km", &curves.range)];
        plot_ui(ui, "elevation", &below, view, now, height);
    }
}
