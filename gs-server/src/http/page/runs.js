// What became of plans in passes: newest first, each opens into the report of its pass.
import { get } from "./api.js";
import { atMostEvery, byId, make } from "./dom.js";
import { clock, date, ms, span } from "./format.js";

// Words that need an eye, and their marks.
const MARKS = { aborted: "◇", missed: "◇", "out-of-time": "△", unfinished: "△", dropped: "○", stopped: "○" };
const LEVELS = { aborted: "distress", missed: "distress", "out-of-time": "warning", unfinished: "warning", dropped: "watch", stopped: "watch" };
const STEP_LEVELS = { failed: "distress", unfinished: "warning", partly: "watch", skipped: "watch" };

let shown = "";
const opened = new Set();
const reports = new Map();

export const refreshRuns = atMostEvery(1000, async () => {
  const page = await get("runs?limit=60");
  const key = JSON.stringify(page.items);
  if (key === shown) return;
  shown = key;
  const past = page.items.filter((run) => run.state !== "planned");
  const none = make("p", "dim line", "No plan has run yet.");
  byId("runs").replaceChildren(...(past.length === 0 ? [none] : past.map(row)));
});

function row(run) {
  const box = make("details", "run");
  const word = run.outcome ?? run.state;
  const head = make("summary", "run-head");
  const why = run.why ?? run.outcome_why;
  const level = LEVELS[word];
  head.append(
    make("span", "num when", `${date(ms(run.aos)).slice(5, 10)} ${clock(ms(run.aos)).slice(0, 5)}Z`),
    make("span", "who-gets", run.satellite),
    make("span", "plan-name", run.name),
    make("span", `outcome ${level ? `level-${level}` : isOn(run) ? "present" : ""}`, `${MARKS[word] ? `${MARKS[word]} ` : ""}${word}`),
    make("span", "why", why ?? ""),
  );
  box.append(head);
  const body = make("div", "report");
  box.append(body);
  box.addEventListener("toggle", () => {
    if (!box.open) return opened.delete(run.id);
    opened.add(run.id);
    load(run, body);
  });
  if (opened.has(run.id)) {
    box.open = true;
    if (reports.has(run.id)) body.replaceChildren(...report(reports.get(run.id)));
  }
  return box;
}

const isOn = (run) => ["running", "held", "waiting"].includes(run.state);

async function load(run, body) {
  try {
    const found = await get(`runs/${run.id}`);
    reports.set(run.id, found);
    body.replaceChildren(...report(found));
  } catch (error) {
    body.replaceChildren(make("p", "dim", error.message));
  }
}

function report({ run, plan, steps, steps_dropped, commands, downloads, frames_heard, chunks_gained }) {
  const [aos, los] = [ms(run.aos), ms(run.los)];
  const facts = [`contact ${clock(aos)}Z to ${clock(los)}Z, ${span(los - aos)}`, run.link && `over ${run.link}`, `${frames_heard} frames heard`, `${chunks_gained} new chunks`];
  if (run.started_at) facts.push(`began ${clock(ms(run.started_at))}Z`);
  const parts = [make("p", "facts", facts.filter(Boolean).join(" · "))];
  if (run.why ?? run.outcome_why) parts.push(make("p", "facts", run.why ?? run.outcome_why));
  parts.push(table("step", ["step", "planned", "came to it", "took", "what happened"], stepRows(plan, steps, run)));
  if (steps_dropped > 0) parts.push(make("p", "dim", `${steps_dropped} more steps ended and found no place in the list.`));
  if (commands.length > 0) parts.push(table("command", ["command", "", "stages"], commands.map(commandRow)));
  if (downloads.length > 0) parts.push(make("p", "facts", downloads.map((d) => `download ${d.id}: ${d.state}`).join(" · ")));
  return parts;
}

function table(name, heads, rows) {
  const box = make("table", `report-table ${name}`);
  const tr = make("tr");
  for (const head of heads) tr.append(make("th", "", head));
  box.append(tr, ...rows);
  return box;
}

/** Each step that ended, then the steps of the plan that nothing is told of. */
function stepRows(plan, steps, run) {
  const cells = (classes, texts) => {
    const tr = make("tr");
    texts.forEach((text, at) => tr.append(make("td", classes[at] ?? "", text)));
    return tr;
  };
  const rows = steps.map((step) => {
    const level = STEP_LEVELS[step.end];
    const round = step.rounds.map((r) => ` round ${r + 1}`).join("");
    const [entered, ended] = [ms(step.entered_at), ms(step.ended_at)];
    return cells(["num", "", "num", "num", level ? `level-${level}` : ""], [`${step.step.replaceAll("steps", "")}${round}`, step.do ?? "", `${clock(entered)}Z`, span(ended - entered), step.why ? `${step.end}: ${step.why}` : step.end]);
  });
  plan.steps.forEach((step, at) => {
    const place = `steps[${at}]`;
    if (steps.some((other) => other.step === place)) return;
    const touched = steps.some((other) => other.step.startsWith(`${place}.`));
    const says = isOn(run) ? (touched ? "under way" : "to come") : touched ? "not finished" : "not come to";
    rows.push(cells(["num", "", "", "", "dim"], [`[${at}]`, step.command ? `${step.do} ${step.command}` : step.do, "", "", says]));
  });
  return rows;
}

function commandRow(command) {
  const tr = make("tr");
  const stages = (command.stages ?? []).map((stage) => `${stage.stage} ${clock(ms(stage.at))}`).join(" → ");
  const isBad = ["rejected", "unknown", "failed", "expired"].includes(command.stage);
  tr.append(make("td", "num", `#${command.id}`), make("td", "", command.command), make("td", isBad ? "level-distress" : "", stages));
  return tr;
}
