// The last heartbeat: its values, its age, and when the next is due.
import { get } from "./api.js";
import { atMostEvery, byId, make, say } from "./dom.js";
import { clock, date, ms, number, span } from "./format.js";
import { model, now, satellite } from "./model.js";

// Rows in the order in which an operator reads them; several parameters share a row when they are a vector.
// `fold` marks what a phone leaves out.
const ROWS = [
  { name: "Temperature", of: ["temp"], digits: 1 },
  { name: "Uptime", of: ["uptime"], show: (v) => span(v), unit: "" },
  { name: "On-board time", of: ["timestamp"], show: (v) => (v === 0 ? "no clock" : `${date(v).slice(0, 10)} ${clock(v)}`), unit: "UTC" },
  { name: "Rate ω", prefix: "omega", digits: 4 },
  { name: "Attitude", prefix: "att", digits: 3 },
  { name: "Position", prefix: "r", digits: 0 },
  { name: "Velocity", prefix: "v", digits: 3 },
  { name: "Field", prefix: "mag", scale: 1e6, unit: "µT", digits: 1, fold: true },
  { name: "Accel.", prefix: "accel", digits: 3, fold: true },
  { name: "Sun ±X ±Y ±Z", of: ["css.plus_x", "css.minus_x", "css.plus_y", "css.minus_y", "css.plus_z", "css.minus_z"], per: 2, digits: 2, fold: true },
  { name: "Radiation, raw", of: ["rad"], digits: 2, fold: true },
  { name: "Camera, raw", of: ["cam"], digits: 0, fold: true },
];

let values = new Map();

export const refreshHeartbeat = atMostEvery(1000, async () => {
  const s = satellite();
  if (!s) return;
  const latest = await get(`telemetry/latest?satellite=${encodeURIComponent(s.satellite)}`);
  values = new Map();
  for (const item of latest.items) {
    if (item.parameter.startsWith("heartbeat.")) values.set(item.parameter.slice(10), item);
  }
  paintValues();
});

function matching(row) {
  if (row.of) return row.of.map((name) => values.get(name)).filter(Boolean);
  // `r` finds r.x and r_teme.x, and not rad. The answer is ordered by name: x, y, z.
  return [...values].filter(([name]) => name.startsWith(`${row.prefix}.`) || name.startsWith(`${row.prefix}_`)).map(([, item]) => item);
}

function paintValues() {
  const body = make("tbody");
  for (const row of ROWS) {
    const items = matching(row);
    if (items.length === 0) continue;
    const tr = make("tr", row.fold ? "fold" : "");
    tr.append(make("td", "name", row.name));
    const cell = make("td", "value");
    const perLine = row.per ?? 3;
    items.forEach(({ value }, i) => {
      if (i > 0) cell.append(i % perLine === 0 ? make("br") : "  ");
      if (value === null) cell.append(make("span", "invalid", "invalid"));
      else cell.append(row.show ? row.show(value) : number(value * (row.scale ?? 1), row.digits));
    });
    cell.title = items.map((item) => item.parameter).join(", ");
    tr.append(cell, make("td", "unit", row.unit ?? items[0].unit));
    body.append(tr);
  }
  byId("values").replaceChildren(body);
}

export function paintHeartbeat() {
  const s = satellite();
  if (!s) return;
  const t = now();
  const heard = ms(s.heartbeat_at);
  const age = byId("heartbeat-age");
  if (heard === null) {
    say(age, "");
    say(byId("heartbeat-due"), "No heartbeat heard yet.");
    return;
  }
  if (model.awaySince !== null) {
    age.classList.add("old");
    say(age, "old: the server is away");
    say(byId("heartbeat-due"), `heard ${date(heard).slice(0, 10)} ${clock(heard)} UTC`);
    return;
  }
  say(age, `${span(t - heard)} old`);
  const due = ms(s.next_heartbeat_at);
  const late = due !== null && t > due + 5000;
  age.classList.toggle("old", late && s.in_view !== false);
  say(byId("heartbeat-due"), `heard ${clock(heard)} UTC · ${dueText(due, t, s)}`);
}

function dueText(due, t, s) {
  if (s.in_view === false) return "out of view, none expected";
  if (due === null) return "next: cannot be told";
  return due >= t ? `next due in ${span(due - t)}` : `overdue by ${span(t - due)}`;
}
