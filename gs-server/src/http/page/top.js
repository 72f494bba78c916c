// The top bar: who, when, heard or not, may transmit or not. Always in the same place.
import { byId, say } from "./dom.js";
import { clock, date, ms, span } from "./format.js";
import { model, now, satellite } from "./model.js";
import { passClock } from "./passes.js";

export function paintTop() {
  const { station } = model;
  if (!station) return;
  const s = satellite();
  const t = now();
  say(byId("satellite"), s?.satellite ?? station.station);
  say(byId("station"), s ? `station ${station.station}` : "");
  say(byId("clock"), clock(t));
  say(byId("date"), date(t));
  byId("simulated").hidden = !station.simulated;
  byId("top").classList.toggle("is-simulated", station.simulated);
  document.title = `${station.simulated ? "SIMULATED · " : ""}${s?.satellite ?? "PixelSat Ground"}`;
  if (!s) return;
  const heard = ms(s.heard_at);
  // While the server is away nobody knows how things stand: no age is made up, no lamp claims anything.
  const isAway = model.awaySince !== null;
  say(byId("pass-clock"), (isAway ? null : passClock(s, t)) ?? "—");
  say(byId("contact"), isAway ? "unknown" : contact(s, t));
  const age = isAway ? `${clock(heard)} UTC` : `${span(t - heard)} ago`;
  say(byId("link-lamp"), heard === null ? "nothing yet" : age);
  say(byId("uplink"), s.uplink || "—");
  byId("uplink").title = s.uplink;
  paintTransmitter(station.links.filter((l) => l.satellite === s.satellite), isAway);
}

function contact(s, t) {
  if (s.in_contact) {
    const los = ms(s.los_at);
    return los !== null && los > t ? `in contact, LOS in ${span(los - t)}` : "in contact";
  }
  if (s.in_view === false) return "out of view";
  return s.heard_at === null ? "not heard yet" : "silent";
}

function paintTransmitter(links, isAway) {
  const lamp = byId("transmitter");
  if (isAway) {
    lamp.className = "lamp";
    say(lamp, "UNKNOWN");
    return;
  }
  const state = links.some((l) => l.on_air) ? "on-air" : links.some((l) => l.armed) ? "armed" : "safe";
  lamp.className = `lamp ${state}`;
  say(lamp, { "on-air": "ON AIR", armed: "ARMED", safe: "SAFE" }[state]);
}
