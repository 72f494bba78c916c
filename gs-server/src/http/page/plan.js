// The plan page: who gets which pass of the coming days and why, what is armed, and what became of it.
import { get } from "./api.js";
import { paintApprovals, refreshApprovals, wireApprovals } from "./approvals.js";
import { beginPage } from "./begin.js";
import { paintComing } from "./coming.js";
import { paintDays } from "./days.js";
import { atMostEvery, byId, say } from "./dom.js";
import { clock, countdown, date, ms } from "./format.js";
import { paintToken, wireToken } from "./hands.js";
import { paintHeld } from "./held.js";
import { model, now, takeStation } from "./model.js";
import { paintNotice } from "./notice.js";
import { wireSession } from "./session.js";
import { refreshRuns } from "./runs.js";
import { agenda, inOrder } from "./agenda.js";

const HOUR_MS = 3600000;
const SPAN_MS = 48 * HOUR_MS;
// Drawn anew at least so often: the window moves with the time.
const ANEW_MS = 60000;

wireToken((told) => {
  say(byId("held-note"), told);
  paintAll();
});
wireSession(paintAll);
wireApprovals();
window.addEventListener("resize", atMostEvery(200, async () => paintDays()));

const refresh = atMostEvery(1000, async () => {
  const start = Math.floor(now() / HOUR_MS) * HOUR_MS - HOUR_MS;
  const window = `start=${new Date(start).toISOString()}&stop=${new Date(start + SPAN_MS).toISOString()}`;
  const [schedule, plans, passes] = await Promise.all([
    get("schedule"),
    get("plans"),
    get(`passes?${window}`).catch((error) => ({ passes: [], remedy: error.message })),
  ]);
  Object.assign(agenda, { schedule, plans: plans.items, passes: passes.passes, remedy: passes.remedy ?? "", start, stop: start + SPAN_MS });
  paintAll();
});

function paintAll() {
  paintToken();
  paintTop();
  if (!agenda.schedule) return;
  paintDays();
  paintComing();
  paintHeld(refresh);
}

function paintTop() {
  const { station } = model;
  if (!station) return;
  const t = now();
  say(byId("station"), station.station);
  say(byId("clock"), clock(t));
  say(byId("date"), date(t));
  byId("simulated").hidden = !station.simulated;
  byId("top").classList.toggle("is-simulated", station.simulated);
  document.title = `${station.simulated ? "SIMULATED · " : ""}Plan · ${station.station}`;
  const { schedule } = agenda;
  if (!schedule) return;
  const next = schedule.contacts.find((contact) => ms(contact.stop) > t);
  const until = next && (ms(next.start) > t ? `AOS −${countdown(ms(next.start) - t)}` : `LOS −${countdown(ms(next.stop) - t)}`);
  say(byId("next"), next && model.awaySince === null ? `${until} ${next.satellite}` : "—");
  const wanted = schedule.contacts.length + schedule.refused.length;
  const sure = schedule.proved ? "no schedule is worth more" : `${(schedule.gap * 100).toFixed(1)} % may be missing`;
  say(byId("worth"), wanted === 0 ? "no plan wants a pass" : `${schedule.contacts.length} of ${wanted} wanted passes, worth ${schedule.worth.toFixed(0)}: ${sure}`);
}

function onEvent(event) {
  say(byId("last-event"), `${clock(ms(event.at))}Z ${event.message}`);
  if (event.kind === "plan" || event.kind === "elements" || event.kind === "pass") {
    refresh();
    refreshRuns();
  }
  if (event.kind === "command-stage") refreshRuns();
}

function refreshAll() {
  refresh();
  refreshRuns();
  refreshApprovals();
}

inOrder(paintAll);
beginPage({
  history: 1,
  started: refreshAll,
  refresh: refreshAll,
  event: onEvent,
  status: takeStation,
  paint() {
    paintTop();
    paintApprovals();
    paintNotice();
  },
  reset() {},
});
setInterval(() => {
  if (agenda.schedule) refresh();
}, ANEW_MS);
