// What should not be: open alerts, the gravest first. Shape, word and colour; whoever has taken note of one says so.
import { get, maySend, post } from "./api.js";
import { atMostEvery, byId, make } from "./dom.js";
import { clock, date, ms } from "./format.js";

// Rows that are shown; of the rest the number.
const SHOWN = 5;
const ORDER = ["watch", "warning", "distress", "critical", "severe"];
const MARKS = { watch: "○", warning: "△", distress: "◇", critical: "⬠", severe: "■" };

let alerts = [];
let painted = "";
let failed = null;

export const refreshAlerts = atMostEvery(1000, async () => {
  alerts = (await get("alerts?limit=200")).items;
  paintAlerts();
});

export function paintAlerts() {
  const key = JSON.stringify([alerts, maySend(), failed]);
  if (key === painted) return;
  painted = key;
  // What is on the shelf or acknowledged comes last: somebody knows.
  const rank = (a) => (known(a) ? 0 : 1);
  const grave = (a) => ORDER.indexOf(a.level);
  const rows = alerts.toSorted((a, b) => rank(b) - rank(a) || grave(b) - grave(a) || b.id - a.id);
  const strip = byId("alerts");
  strip.hidden = rows.length === 0;
  const more = rows.length > SHOWN ? [make("li", "dim", `and ${rows.length - SHOWN} more: gs-server alert list`)] : [];
  strip.replaceChildren(...rows.slice(0, SHOWN).map(row), ...more);
}

function row(alert) {
  const level = alert.active ? alert.level : `${alert.level}, over`;
  const li = make("li", known(alert) ? "quiet" : "");
  const mark = make("span", `mark level-${alert.level}`, MARKS[alert.level] ?? "·");
  const word = make("span", `word level-${alert.level}`, level);
  const time = make("span", "time", clock(ms(alert.raised_at)));
  time.title = `raised ${date(ms(alert.raised_at))}, alert ${alert.id}`;
  li.append(mark, word, time, make("span", "text", text(alert)));
  if (!known(alert) && maySend()) {
    const button = make("button", "quiet", "Acknowledge");
    button.type = "button";
    button.addEventListener("click", () => acknowledge(alert, button));
    li.append(button);
  }
  return li;
}

const known = (alert) => alert.acknowledged_by !== null || alert.state === "shelved";

function text(alert) {
  const more = [];
  if (alert.times > 1) more.push(`${alert.times} times`);
  if (alert.state === "shelved") more.push(`on the shelf until ${clock(ms(alert.shelved_until))} UTC`);
  else if (alert.acknowledged_by) more.push(`known to ${alert.acknowledged_by}`);
  if (alert.assignee) more.push(`${alert.assignee}'s`);
  if (alert.note) more.push(alert.note);
  if (failed?.id === alert.id) more.push(failed.message);
  return more.length > 0 ? `${alert.message} (${more.join("; ")})` : alert.message;
}

async function acknowledge(alert, button) {
  button.disabled = true;
  failed = null;
  try {
    await post(`alerts/${alert.id}/acknowledge`, {});
  } catch (error) {
    failed = { id: alert.id, message: error.message };
  }
  painted = "";
  refreshAlerts();
  paintAlerts();
}
