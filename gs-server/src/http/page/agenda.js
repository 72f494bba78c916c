// What the plan page knows: passes, schedule and plans, and which pass is looked at.
import { ms } from "./format.js";

export const agenda = {
  schedule: null, // newest ScheduleView
  plans: [], // PlanViews
  passes: [], // PassViews of the window
  remedy: "", // why no pass is known, and what to do
  start: 0, // the window, ms
  stop: 0,
  chosen: null, // key of the pass that is looked at
};

let painted = () => {};

/** Who paints when another pass is looked at. */
export function inOrder(paint) {
  painted = paint;
}

export function choose(key) {
  agenda.chosen = agenda.chosen === key ? null : key;
  painted();
}

export const keyOf = (satellite, aos) => `${satellite} ${aos}`;

/** Wanted passes, served or refused, in order of time, each with the pass that it lies in. */
export function wanted() {
  const { schedule, passes } = agenda;
  const pass = (satellite, start, stop) => passes.find((p) => p.satellite === satellite && ms(p.aos) < stop && start < ms(p.los));
  const served = schedule.contacts.map((contact) => {
    const [start, stop] = [ms(contact.start), ms(contact.stop)];
    return { ...contact, start, stop, state: contact.armed ? "armed" : "idle", pass: pass(contact.satellite, start, stop) };
  });
  const refused = schedule.refused.map((other) => {
    const [start, stop] = [ms(other.aos), ms(other.los)];
    return { ...other, start, stop, state: "refused", pass: pass(other.satellite, start, stop) };
  });
  const all = [...served, ...refused].sort((a, b) => a.start - b.start);
  for (const one of all) one.key = keyOf(one.satellite, one.pass ? ms(one.pass.aos) : one.start);
  return all;
}
