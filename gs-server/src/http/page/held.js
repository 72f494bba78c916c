// Plans in use: what they want, whether they may run; arming is a held key, disarming is not.
import { agenda } from "./agenda.js";
import { get, keepToken, mayPlan, post } from "./api.js";
import { byId, make, say } from "./dom.js";
import { clock, date, ms } from "./format.js";
import { onHold, paintToken } from "./hands.js";
import { model } from "./model.js";

// A rehearsal is looked at so often while it goes on; one that nobody looks at is given up by the server.
const LOOK_MS = 700;
const RUNS = 100;

let shown = "";
const rehearsals = new Map(); // newest RehearsalView or error by plan

export function paintHeld(refresh) {
  const ready = mayPlan() && model.live;
  const key = JSON.stringify([agenda.plans, ready, [...rehearsals]]);
  if (key === shown) return;
  shown = key;
  const { plans } = agenda;
  say(byId("held-count"), plans.length === 0 ? "" : `${plans.filter((plan) => plan.armed).length} of ${plans.length} armed`);
  const none = make("p", "dim line", "None. Hand one over with `gs-server plan add`.");
  byId("held").replaceChildren(...(plans.length === 0 ? [none] : plans.map((plan) => card(plan, ready, refresh))));
}

function card(plan, ready, refresh) {
  const box = make("article", "held-plan");
  const head = make("p", "held-head");
  head.append(make("strong", "", plan.name), make("span", "dim", plan.satellite), make("span", plan.armed ? "lamp armed" : "lamp", plan.armed ? "ARMED" : "NOT ARMED"));
  const text = plan.plan;
  const steps = make("p", "held-steps", text.steps.map(step).join(" · "));
  const facts = [passes(plan), text.transmit ? "transmits" : "only listens", text.priority ? `priority ${text.priority}` : "", `by ${plan.added_by}`];
  box.append(head, steps, make("p", "dim held-facts", facts.filter(Boolean).join("; ")));
  const hands = make("div", "hands");
  const button = make("button", plan.armed ? "" : "hold", plan.armed ? "Disarm" : "Hold: Arm");
  button.type = "button";
  button.disabled = !ready;
  const verb = plan.armed ? "disarm" : "arm";
  const fire = () => send(`plans/${plan.name}/${verb}`, {}, `${plan.name} is ${plan.armed ? "disarmed" : "armed"}.`, refresh);
  if (plan.armed) button.addEventListener("click", fire);
  else onHold(button, fire);
  const trial = make("button", "quiet", "Rehearse");
  trial.type = "button";
  trial.disabled = !ready || ["waiting", "running"].includes(rehearsals.get(plan.name)?.state);
  trial.title = "Send it through its coming pass a hundred times in simulation";
  trial.addEventListener("click", () => rehearse(plan.name, refresh));
  hands.append(button, trial);
  box.append(hands);
  const told = rehearsals.get(plan.name);
  if (told) box.append(rehearsed(told));
  return box;
}

/** `command Ping`, `repeat-until (3)` */
function step(one) {
  if (one.command) return `${one.do} ${one.command}`;
  return one.steps ? `${one.do} (${one.steps.length})` : one.do;
}

function passes(plan) {
  const parts = [];
  if (plan.plan.attach) parts.push("finds its passes itself");
  const chosen = plan.picks.map((pick) => `${date(ms(pick)).slice(5, 10)} ${clock(ms(pick)).slice(0, 5)}Z`);
  if (chosen.length > 0) parts.push(`chosen: ${chosen.join(", ")}`);
  return parts.length > 0 ? parts.join("; ") : "no pass: attach it";
}

async function send(path, body, told, refresh) {
  const note = byId("held-note");
  say(note, "Sending …");
  try {
    await post(path, body);
    say(note, told);
    refresh();
  } catch (error) {
    refused(error);
    say(note, error.message);
  }
}

function refused(error) {
  if (error.status !== 401) return;
  keepToken("");
  paintToken();
}

async function rehearse(name, refresh) {
  const tell = (view) => {
    rehearsals.set(name, view);
    paintHeld(refresh);
  };
  try {
    let job = await post("rehearsals", { name, runs: RUNS });
    tell(job);
    while (["waiting", "running"].includes(job.state)) {
      await new Promise((done) => setTimeout(done, LOOK_MS));
      job = await get(`rehearsals/${job.id}`);
      tell(job);
    }
  } catch (error) {
    refused(error);
    tell({ state: "failed", why: error.message });
  }
}

function rehearsed(job) {
  const box = make("div", "rehearsed");
  const { answer } = job;
  if (!answer) {
    const going = job.runs_done > 0 ? `rehearsing: ${job.runs_done} of ${job.runs}` : "rehearsing …";
    box.append(make("p", "dim", job.why ?? going));
    return box;
  }
  const { figures } = answer;
  const range = ({ p10, p50, p90 }) => `${p50.toFixed(0)} (${p10.toFixed(0)} to ${p90.toFixed(0)})`;
  const parts = [`began in ${answer.begun} of ${answer.runs} runs`, `commands answered ${range(figures.commands_answered)}`];
  if (figures.chunks_of) parts.push(`chunks home ${range(figures.chunks_home)} of ${range(figures.chunks_of)}`, `image whole in ${answer.images_whole}`);
  parts.push(`steps undone at LOS ${range(figures.steps_undone)}`);
  const { pass } = answer;
  box.append(make("p", "dim", `Rehearsed for ${date(ms(pass.aos)).slice(5, 10)} ${clock(ms(pass.aos)).slice(0, 5)}Z, ${pass.max_elevation_deg.toFixed(0)}°; median, and where eight of ten runs lie:`), make("p", "", parts.join("; ")));
  for (const finding of answer.findings) box.append(make("p", finding.severity === "error" ? "level-distress" : "level-warning", `${finding.severity === "error" ? "◇" : "△"} ${finding.place || "plan"}: ${finding.problem}. ${finding.remedy}`));
  return box;
}
