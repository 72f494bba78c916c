// The next passes: when, how high, where from and where to; the sky of the next one, and two days at a glance.
import { get } from "./api.js";
import { byId, make, say } from "./dom.js";
import { clock, countdown, date, ms, wind } from "./format.js";
import { model, now } from "./model.js";

const MARKS = { watch: "○", warning: "△", distress: "◇" };
// Rows of a satellite that is alone, and of one among several.
const ROWS = 5;
const ROWS_AMONG_SEVERAL = 2;
// No picture is asked for more often than this, in wall time.
const SKY_MS = 4000;
const TIMELINE_MS = 15000;
// The timeline begins anew after so much of the station's time.
const TIMELINE_STEP_MS = 600000;
// And so long ago, that a pass that lasts is whole.
const BEFORE_MS = 900000;
const REMEDY_MS = 30000;

const byDay = window.matchMedia("(prefers-color-scheme: light)");
let tiles = "";
let clocks = []; // [node, satellite's name] of the countdowns on the screen
let remedy = { asked: -Infinity, text: "" };

/** The pass that lasts or comes next, at the station's time. */
export function nextPass(s, t) {
  return s.next_passes.find((pass) => pass.los === null || ms(pass.los) > t) ?? null;
}

/** `AOS −00:04:12`, or `LOS −00:03:10` in a pass; null when none is known. */
export function passClock(s, t) {
  const pass = nextPass(s, t);
  if (!pass) return null;
  if (ms(pass.aos) > t) return `AOS −${countdown(ms(pass.aos) - t)}`;
  return pass.los === null ? "always up" : `LOS −${countdown(ms(pass.los) - t)}`;
}

export function paintPasses() {
  const { station } = model;
  if (!station) return;
  const t = now();
  const { satellites } = station;
  askForRemedy(satellites);
  // Built anew only when something changed: a selection or a tooltip survives.
  const shown = satellites.map((s) => [s.satellite, s.expectation, s.elements?.id, age(s), s.elements?.fault, coming(s, t)]);
  const key = JSON.stringify([shown, remedy.text, model.awaySince !== null]);
  if (key !== tiles) {
    tiles = key;
    clocks = [];
    byId("pass-tiles").classList.toggle("several", satellites.length > 1);
    byId("pass-tiles").replaceChildren(...satellites.map((s) => tile(s, t)));
  }
  for (const [node, name] of clocks) {
    const s = satellites.find((other) => other.satellite === name);
    // While the server is away nobody knows what its clock says.
    say(node, model.awaySince !== null ? "—" : ((s && passClock(s, t)) ?? ""));
  }
  paintSky(satellites, t);
  paintTimeline(satellites, t);
}

const rows = () => (model.station.satellites.length > 1 ? ROWS_AMONG_SEVERAL : ROWS);

function coming(s, t) {
  return s.next_passes.filter((pass) => pass.los === null || ms(pass.los) > t).slice(0, rows()).map((pass) => [pass.aos, ms(pass.aos) <= t]);
}

const age = (s) => (s.elements ? Math.floor(s.elements.age_days * 10) : null);

function tile(s, t) {
  const box = make("div", "tile");
  const head = make("p", "tile-head");
  const isLate = s.expectation.includes("overdue");
  head.append(make("strong", "", s.satellite), make("span", isLate ? "level-distress" : "dim", isLate ? `${MARKS.distress} ${s.expectation}` : s.expectation));
  box.append(head);
  const passes = s.next_passes.filter((pass) => pass.los === null || ms(pass.los) > t);
  if (passes.length > 0) {
    const time = make("p", "countdown num");
    clocks.push([time, s.satellite]);
    box.append(time);
  }
  box.append(elements(s));
  if (passes.length === 0) return box;
  const table = make("table", "pass-list");
  const header = make("tr");
  for (const name of ["AOS, UTC", "max", "from, over, to", "lasts"]) header.append(make("th", "", name));
  table.append(header);
  let day = date(t).slice(0, 10);
  for (const pass of passes.slice(0, rows())) {
    const on = date(ms(pass.aos)).slice(0, 10);
    if (on !== day) {
      day = on;
      const tr = make("tr");
      const cell = make("td", "day", `${on} UTC`);
      cell.colSpan = 4;
      tr.append(cell);
      table.append(tr);
    }
    table.append(row(pass, t));
  }
  box.append(table);
  return box;
}

function row(pass, t) {
  const aos = ms(pass.aos);
  const los = ms(pass.los);
  const tr = make("tr", aos <= t ? "present" : pass.max_elevation_deg < 10 ? "low" : "");
  const lasts = los === null ? "does not set" : `${Math.floor((los - aos) / 60000)}:${String(Math.floor((los - aos) / 1000) % 60).padStart(2, "0")}`;
  tr.append(
    make("td", "num", `${clock(aos)}Z`),
    make("td", "num", `${pass.max_elevation_deg.toFixed(0)}°`),
    make("td", "", pass.azimuths_deg.map(wind).join(" → ")),
    make("td", "num", lasts),
  );
  const [from, over, to] = pass.azimuths_deg.map((azimuth) => `${azimuth.toFixed(0)}°`);
  tr.title = `AOS ${clock(aos)}Z at azimuth ${from}, highest ${clock(ms(pass.tca))}Z at ${over}, LOS ${los === null ? "—" : `${clock(los)}Z at ${to}`}; elements ${pass.elements}`;
  return tr;
}

/** The elements' age with its level: colour, shape and word. */
function elements(s) {
  if (!s.elements) return make("p", "line", remedy.text);
  const { age_days, timing_error_s, level, fault, epoch } = s.elements;
  const mark = MARKS[level];
  const days = `${Math.abs(age_days).toFixed(1)} d ${age_days < 0 ? "before their epoch" : "old"}`;
  const error = timing_error_s < 10 ? timing_error_s.toFixed(1) : timing_error_s.toFixed(0);
  const says = fault ? `elements: ${fault}` : `elements ${days}, times ± ${error} s`;
  const line = make("p", mark ? `line level-${level}` : "line dim", mark ? `${mark} ${level}: ${says}` : says);
  line.title = `elements ${s.elements.id}, epoch ${date(ms(epoch)).slice(0, 10)} ${clock(ms(epoch))} UTC`;
  return line;
}

/** Why nothing is known, and what to do: the server knows. */
async function askForRemedy(satellites) {
  const without = satellites.find((s) => !s.elements);
  if (!without || performance.now() - remedy.asked < REMEDY_MS) return;
  remedy.asked = performance.now();
  try {
    await get(`look?satellite=${encodeURIComponent(without.satellite)}`);
    remedy.text = "";
  } catch (error) {
    remedy.text = error.status === 409 ? error.message : "";
  }
}

/** A picture that is exchanged when it is ready: no flicker. */
class Plot {
  key = "";
  asked = -Infinity;
  busy = false;

  constructor(id, every) {
    this.img = byId(id);
    this.every = every;
  }

  async show(key, path, alt) {
    if (key === this.key || this.busy || performance.now() - this.asked < this.every) return;
    this.asked = performance.now();
    this.busy = true;
    const next = new Image();
    next.src = `/api/v1/${path}&theme=${byDay.matches ? "light" : "dark"}`;
    try {
      await next.decode();
      this.img.src = next.src;
      this.img.alt = alt;
      this.img.hidden = false;
      this.key = key;
    } catch {
      // What was there stays; it is asked for again.
    }
    this.busy = false;
  }

  hide() {
    this.img.hidden = true;
    this.key = "";
  }
}

const sky = new Plot("sky-plot", SKY_MS);
const timeline = new Plot("timeline", TIMELINE_MS);

function paintSky(satellites, t) {
  const next = satellites
    .map((s) => ({ s, pass: nextPass(s, t) }))
    .filter(({ pass }) => pass)
    .sort((a, b) => ms(a.pass.aos) - ms(b.pass.aos))[0];
  if (!next) return sky.hide();
  const { s, pass } = next;
  const isUp = ms(pass.aos) <= t;
  // The mark of the satellite moves while it is up.
  const step = isUp ? Math.floor(t / SKY_MS) : "to come";
  const name = encodeURIComponent(s.satellite);
  const at = new Date(isUp ? t : ms(pass.aos)).toISOString();
  const [from, over, to] = pass.azimuths_deg.map(wind);
  const alt = `Sky plot of ${s.satellite}: from ${from} over ${over} to ${to}, ${pass.max_elevation_deg.toFixed(0)} degrees high, AOS ${clock(ms(pass.aos))}Z`;
  sky.show(
    JSON.stringify([s.satellite, pass, step, byDay.matches]),
    `passes/sky.svg?satellite=${name}&at=${at}&form=compact`,
    alt,
  );
}

function paintTimeline(satellites, t) {
  const known = satellites.filter((s) => s.next_passes.length > 0);
  const panel = byId("timeline-panel");
  panel.hidden = known.length === 0;
  const width = Math.max(280, Math.round(byId("timeline-box").clientWidth));
  if (known.length === 0) return timeline.hide();
  const start = new Date(t - BEFORE_MS).toISOString();
  timeline.show(
    JSON.stringify([known.map((s) => [s.satellite, s.elements?.id]), Math.floor(t / TIMELINE_STEP_MS), width, byDay.matches]),
    `passes/timeline.svg?start=${start}&width=${width}&form=compact`,
    "Passes of the next two days",
  );
}
