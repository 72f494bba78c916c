// The list below the timeline: each contact with its plan and why, each refused pass with why and its rivals.
import { agenda, choose, wanted } from "./agenda.js";
import { WORDS } from "./days.js";
import { byId, make, say } from "./dom.js";
import { clock, date, ms } from "./format.js";

let shown = "";

export function paintComing() {
  const all = wanted();
  const key = JSON.stringify([all, agenda.chosen]);
  if (key === shown) return;
  shown = key;
  const refused = all.filter((one) => one.state === "refused").length;
  say(byId("coming-count"), all.length === 0 ? "" : `${all.length - refused} served, ${refused} refused`);
  const rows = [];
  let day = "";
  for (const one of all) {
    const on = date(one.start);
    if (on !== day) {
      day = on;
      rows.push(make("li", "day", on));
    }
    rows.push(row(one, all));
  }
  if (rows.length === 0) rows.push(make("li", "dim", "No plan wants a pass of the coming two days. Hand one over with `gs-server plan add`, and attach it."));
  byId("coming").replaceChildren(...rows);
  byId("coming").querySelector(".chosen")?.scrollIntoView({ block: "nearest" });
}

const short = (t) => clock(t).slice(0, 5);

function row(one, all) {
  const li = make("li", `wanted ${one.state}`);
  if (one.key === agenda.chosen) li.classList.add("chosen");
  const head = make("button", "head");
  head.type = "button";
  head.setAttribute("aria-pressed", String(one.key === agenda.chosen));
  head.addEventListener("click", () => choose(one.key));
  head.append(
    make("span", "num when", `${short(one.start)}–${short(one.stop)}Z`),
    make("span", "who-gets", one.satellite),
    make("span", "num high", one.pass ? `${one.pass.max_elevation_deg.toFixed(0)}°` : ""),
    make("span", "plan-name", one.plan ?? "—"),
    make("span", `state ${one.state}`, WORDS[one.state]),
  );
  li.append(head);
  const why = make("p", "why", [one.why, one.cut_start && `begins late: ${one.cut_start}`, one.cut_stop && `ends early: ${one.cut_stop}`].filter(Boolean).join("; "));
  li.append(why);
  for (const rival of one.rivals ?? []) li.append(rivalLine(rival, all));
  if (one.key === agenda.chosen) li.append(more(one));
  return li;
}

/** Whoever stands in the way, a click away. */
function rivalLine(rival, all) {
  const [start, stop] = [ms(rival.start), ms(rival.stop)];
  const other = all.find((one) => one.state !== "refused" && one.satellite === rival.satellite && one.start < stop && start < one.stop);
  const text = `${rival.satellite} ${short(start)}–${short(stop)}Z, worth ${rival.worth.toFixed(0)}${rival.kept ? ", promised before" : ""}${other?.plan ? `, plan ${other.plan}` : ""}`;
  const line = make("p", "rival", "in the way: ");
  if (!other) {
    line.append(text);
    return line;
  }
  const button = make("button", "text-link", text);
  button.type = "button";
  button.addEventListener("click", () => choose(other.key));
  line.append(button);
  return line;
}

function more(one) {
  const list = make("dl", "more");
  const say = (name, text) => text && list.append(make("dt", "", name), make("dd", "num", text));
  say("from, to", `${clock(one.start)}Z, ${clock(one.stop)}Z`);
  if (one.pass) say("pass", `${clock(ms(one.pass.aos))}Z to ${clock(ms(one.pass.los))}Z, ${one.pass.max_elevation_deg.toFixed(1)}° high, azimuth ${one.pass.aos_azimuth_deg.toFixed(0)}° to ${one.pass.los_azimuth_deg.toFixed(0)}°`);
  say("worth", one.worth.toFixed(0));
  if (one.transmit_from) say("transmits", `${clock(ms(one.transmit_from))}Z to ${clock(ms(one.transmit_until))}Z`);
  if (one.kept) say("promised", "by the schedule before");
  return list;
}
