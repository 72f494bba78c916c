// The timeline of the coming days: a band for each day or half of one, a row for each satellite, a bar for each pass, as
// tall as the pass is high.
import { agenda, choose, keyOf, wanted } from "./agenda.js";
import { byId, make } from "./dom.js";
import { clock, date, ms } from "./format.js";
import { model, now } from "./model.js";

const SVG = "http://www.w3.org/2000/svg";
const HOUR_MS = 3600000;
const ROW = 46;
const BAR_MAX = 26;
const HEAD = 20;
// A pass is drawn so wide at least, px.
const LEAST = 3;

const LEGEND = [
  ["armed", "armed"],
  ["idle", "not armed"],
  ["refused", "refused: in conflict"],
  ["free", "no plan wants it"],
  ["closed", "station closed"],
  ["unlicensed", "may not transmit"],
];

let drawn = "";

export function paintDays() {
  const box = byId("days");
  const width = Math.round(box.clientWidth);
  if (width === 0 || !agenda.schedule) return;
  const minute = Math.floor(now() / 60000);
  const key = JSON.stringify([width, minute, agenda]);
  if (key === drawn) return;
  drawn = key;
  paintLegend();
  if (agenda.remedy && agenda.passes.length === 0) {
    box.replaceChildren(make("p", "line", agenda.remedy));
    return;
  }
  const hours = width > 900 ? 24 : width > 560 ? 12 : 8;
  const bands = [];
  for (let from = agenda.start; from < agenda.stop; from += hours * HOUR_MS) {
    const until = from + hours * HOUR_MS;
    const isEmpty = !agenda.passes.some((pass) => ms(pass.aos) < until && ms(pass.los) > from);
    // On a phone hours without a pass are not worth the way; the ones that last are.
    if (isEmpty && hours < 24 && !(from <= now() && now() < until)) continue;
    bands.push(band(from, hours, width));
  }
  box.replaceChildren(...bands);
}

function paintLegend() {
  const legend = byId("legend");
  if (legend.childElementCount > 0) return;
  for (const [name, text] of LEGEND) {
    const item = make("span", "key");
    const svg = el("svg", { width: 14, height: 12, viewBox: "0 0 14 12" });
    svg.append(hatches(), el("rect", { class: `slot ${name}`, x: 1, y: 1, width: 12, height: 10 }));
    item.append(svg, text);
    legend.append(item);
  }
}

function el(name, attributes = {}, text) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

let patterns = 0;

/** Each drawing has its own patterns: those of a hidden one are not drawn. */
function hatches() {
  const defs = el("defs");
  patterns += 1;
  for (const [name, step] of [["conflict", 5], ["shut", 9]]) {
    const pattern = el("pattern", { id: `${name}-${patterns}`, class: `hatch-${name}`, width: step, height: step, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" });
    pattern.append(el("rect", { width: step, height: step, class: "under" }), el("line", { x1: 0, y1: 0, x2: 0, y2: step }));
    defs.append(pattern);
  }
  return defs;
}

/** What a bar is filled with. */
const filling = (state) => ({ refused: `url(#conflict-${patterns})`, closed: `url(#shut-${patterns})` })[state];

function band(from, hours, width) {
  const names = [...new Set([...(model.station?.satellites ?? []).map((s) => s.satellite), ...agenda.passes.map((p) => p.satellite)])];
  const isNarrow = width <= 560;
  const left = isNarrow ? 0 : 104;
  const until = from + hours * HOUR_MS;
  const x = (t) => left + ((t - from) / (until - from)) * (width - left);
  const height = HEAD + names.length * ROW;
  const svg = el("svg", { class: "band", width, height, viewBox: `0 0 ${width} ${height}`, role: "group" });
  svg.setAttribute("aria-label", `Passes from ${date(from)} ${clock(from).slice(0, 5)} for ${hours} hours`);
  svg.append(hatches());
  grid(svg, from, until, x, height, left, hours);
  closed(svg, from, until, x, height);
  const all = wanted();
  names.forEach((name, at) => {
    const base = HEAD + at * ROW + BAR_MAX + 4;
    svg.append(el("line", { class: "ground", x1: left, x2: width, y1: base, y2: base }));
    row(svg, name, base, x, from, until, all);
    const label = el("text", isNarrow ? { class: "name", x: 4, y: base - BAR_MAX + 8 } : { class: "name", x: 0, y: base }, name);
    svg.append(label);
  });
  const t = now();
  if (from <= t && t < until) svg.append(el("line", { class: "now", x1: x(t), x2: x(t), y1: HEAD - 6, y2: height }));
  return svg;
}

function grid(svg, from, until, x, height, left, hours) {
  const step = hours === 24 && x(from + HOUR_MS) - x(from) > 40 ? 2 : hours === 8 ? 2 : 3;
  for (let t = from; t < until; t += HOUR_MS) {
    const hour = new Date(t).getUTCHours();
    const isDay = hour === 0;
    if (!isDay && hour % step !== 0) continue;
    svg.append(el("line", { class: isDay ? "grid day" : "grid", x1: x(t), x2: x(t), y1: HEAD - 4, y2: height }));
    const text = isDay ? date(t).slice(5, 10) : clock(t).slice(0, 5);
    if (x(t) < x(until) - 24) svg.append(el("text", { class: isDay ? "hour day" : "hour", x: x(t) + 3, y: 11 }, text));
  }
  if (left > 0) svg.append(el("text", { class: "hour day", x: 0, y: 11 }, date(from)));
}

/** Blackouts, and where a licence does not allow to transmit. */
function closed(svg, from, until, x, height) {
  const { schedule } = agenda;
  for (const { start, stop, why } of schedule.closed) {
    const [a, b] = [Math.max(ms(start), from), Math.min(ms(stop), until)];
    if (a >= b) continue;
    const rect = el("rect", { class: "slot closed", fill: filling("closed"), x: x(a), y: HEAD - 4, width: Math.max(LEAST, x(b) - x(a)), height: height - HEAD + 4 });
    rect.append(el("title", {}, `closed ${clock(ms(start))}Z to ${clock(ms(stop))}Z: ${why}`));
    svg.append(rect);
    const room = x(b) - x(a) - 8;
    if (room > 30) svg.append(el("text", { class: "closed-why", x: x(a) + 4, y: HEAD + 6 }, fit(why, room)));
  }
  if (!schedule.licence) return;
  let at = from;
  const shut = (a, b) => {
    if (a >= b) return;
    const rect = el("rect", { class: "slot unlicensed", x: x(a), y: HEAD - 4, width: x(b) - x(a), height: 3 });
    rect.append(el("title", {}, "outside of the licence: nothing is transmitted"));
    svg.append(rect);
  };
  for (const { start, stop } of schedule.licence) {
    if (ms(stop) <= from || ms(start) >= until) continue;
    shut(at, Math.max(at, ms(start)));
    at = Math.max(at, ms(stop));
  }
  shut(at, until);
}

/** As much of a word as the room has place for. */
function fit(text, room) {
  const letters = Math.floor(room / 5.6);
  return text.length <= letters ? text : letters < 3 ? "" : `${text.slice(0, letters - 1)}…`;
}

function row(svg, name, base, x, from, until, all) {
  const shown = agenda.passes.filter((p) => p.satellite === name && ms(p.los) > from && ms(p.aos) < until);
  shown.forEach((pass, at) => {
    const [aos, los] = [ms(pass.aos), ms(pass.los)];
    const of = all.find((one) => one.pass === pass);
    const state = of?.state ?? "free";
    const high = Math.max(3, Math.round((Math.min(90, pass.max_elevation_deg) / 90) * BAR_MAX));
    const wide = Math.max(LEAST, x(los) - x(aos));
    const g = el("g", { class: "pass", tabindex: of ? 0 : -1, role: of ? "button" : "img" });
    const says = `${name} ${clock(aos)}Z to ${clock(los)}Z, ${pass.max_elevation_deg.toFixed(0)}° high: ${of ? `${of.plan ?? "no plan"}, ${WORDS[state]}. ${of.why}` : WORDS.free}`;
    g.setAttribute("aria-label", says);
    g.append(el("title", {}, says));
    // The finger needs more than the eye.
    const next = shown[at + 1];
    const room = (next ? x(ms(next.aos)) : x(until)) - x(aos) - 4;
    g.append(el("rect", { class: "touch", x: x(aos) - 4, y: base - BAR_MAX - 2, width: Math.max(16, Math.min(room, 60)), height: ROW - 4 }));
    if (of && (of.start > aos + 1000 || of.stop < los - 1000) && state !== "refused") {
      g.append(el("rect", { class: "slot whole", x: x(aos), y: base - high, width: wide, height: high }));
      g.append(el("rect", { class: `slot ${state}`, x: x(of.start), y: base - high, width: Math.max(LEAST, x(of.stop) - x(of.start)), height: high }));
    } else {
      const bar = el("rect", { class: `slot ${state}`, x: x(aos), y: base - high, width: wide, height: high });
      if (filling(state)) bar.setAttribute("fill", filling(state));
      g.append(bar);
    }
    if (of) {
      const key = keyOf(name, aos);
      if (agenda.chosen === key) g.classList.add("chosen");
      g.append(el("text", { class: `plan ${state}`, x: x(aos), y: base + 11 }, fit(of.plan ?? "", room)));
      g.addEventListener("click", () => choose(key));
      g.addEventListener("keydown", (event) => {
        if (event.key === "Enter" || event.key === " ") {
          event.preventDefault();
          choose(key);
        }
      });
    }
    svg.append(g);
  });
}

export const WORDS = { armed: "armed", idle: "not armed", refused: "refused", free: "no plan wants it" };
