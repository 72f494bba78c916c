// Each link: how it is and what it counted since the start.
import { byId, make } from "./dom.js";
import { model } from "./model.js";

let painted = "";

export function paintLinks() {
  const { station } = model;
  if (!station) return;
  // Built anew only when something changed: a tooltip or a selection survives.
  const key = JSON.stringify([station.links, station.storage]);
  if (key === painted) return;
  painted = key;
  byId("link-list").replaceChildren(...station.links.flatMap(link), ...storage(station.storage));
}

function counters(pairs) {
  const dl = make("dl", "counter");
  for (const [name, value] of pairs) dl.append(make("dt", "", name), make("dd", "", value));
  return dl;
}

function link(l) {
  const head = make("p", l.state === "ok" ? "link-name" : "link-name level-distress", `${l.link} · ${l.state}${l.reason ? `: ${l.reason}` : ""}`);
  return [head, counters([
    ["Frames heard", String(l.frames)],
    ["Bytes skipped", String(l.skipped_bytes)],
    ["Damaged candidates", String(l.bad)],
    ["Frames radiated", String(l.radiated)],
    ["Airtime", `${(l.airtime_ms / 1000).toFixed(1)} s`],
    ["RSSI", l.rssi_dbm === null ? "—" : `${l.rssi_dbm} dBm`],
  ])];
}

function storage(s) {
  const pairs = [];
  if (s.waiting > 0) pairs.push(["Records waiting", String(s.waiting)]);
  if (s.reserved > 0) pairs.push(["Frames in reserve", String(s.reserved)]);
  if (s.unreserved > 0) pairs.push(["Frames in memory only", String(s.unreserved)]);
  if (s.derived_dropped > 0) pairs.push(["Derived rows dropped", String(s.derived_dropped)]);
  if (s.frames_lost > 0) pairs.push(["Frames lost", String(s.frames_lost)]);
  return pairs.length > 0 ? [counters(pairs)] : [];
}
