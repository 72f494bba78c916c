// What happened, newest first.
import { byId, make, say } from "./dom.js";
import { clock, date, ms } from "./format.js";

const KEEP = 200;
// Shape and word stand beside the colour.
const MARKS = { normal: "·", watch: "○", warning: "△", distress: "◇", critical: "⬠", severe: "■" };

export function addEvent(event) {
  const list = byId("event-list");
  list.prepend(row(event));
  while (list.childElementCount > KEEP) list.lastElementChild.remove();
  say(byId("last-event"), `${clock(ms(event.at))} ${event.message}`);
}

function row(event) {
  const li = make("li", event.kind === "frame-heard" ? "quiet" : "");
  const mark = make("span", `mark level-${event.level}`, MARKS[event.level] ?? "·");
  mark.title = event.level;
  const time = make("span", "time", clock(ms(event.at)));
  time.title = `${date(ms(event.at))}, event ${event.sequence}`;
  const text = make("span", "text", event.level === "normal" ? event.message : `${event.level}: ${event.message}`);
  li.append(mark, time, make("span", "kind", event.kind), text);
  return li;
}

export function resetEvents() {
  byId("event-list").replaceChildren();
}
