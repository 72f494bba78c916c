// Telecommands and their stage lights; the hands that send. Enter never sends to the satellite: firing is a held key.
import { get, keepToken, maySend, post } from "./api.js";
import { atMostEvery, byId, make, say } from "./dom.js";
import { onHold, paintToken, wireToken } from "./hands.js";
import { model, satellite } from "./model.js";

const LIGHTS = ["queued", "sealed", "radiated", "answered"];
// How many lights a last stage proves; the stages that end badly colour the last of them.
const REACHED = { queued: 1, sealed: 2, radiating: 2, radiated: 3, answered: 4, rejected: 4, unknown: 3, failed: 1, expired: 1, cancelled: 1 };
const BAD = ["rejected", "unknown", "failed", "expired"];
const GOING = ["queued", "sealed", "radiating", "radiated"];

export const refreshCommands = atMostEvery(500, async () => {
  const s = satellite();
  if (!s) return;
  const page = await get(`commands?limit=40&satellite=${encodeURIComponent(s.satellite)}`);
  byId("command-list").replaceChildren(...page.items.map(row));
});

function row(command) {
  const li = make("li", "command");
  if (!GOING.includes(command.stage)) li.classList.add("over");
  li.append(make("span", "id", `#${command.id}`));
  const args = Object.entries(command.arguments)
    .filter(([, value]) => value !== false)
    .map(([name, value]) => (value === true ? name : `${name} ${typeof value === "string" ? value : JSON.stringify(value)}`))
    .join(", ");
  const what = make("span", "what", `${command.command} ${short(command.arguments) ?? args}`.trim());
  what.title = `${command.command} ${args}\nby ${command.principal}, attempt ${command.attempt} of ${command.attempts_allowed}`;
  li.append(what, lights(command), make("span", isWorrying(command) ? "word bad" : "word", command.stage));
  return li;
}

/** The machine repeats its own requests by itself: one that was lost is nothing to worry about. */
const isWorrying = (command) => BAD.includes(command.stage) && !(command.stage === "unknown" && command.download !== null);

/** A range of chunks as operators say it. */
function short({ first, count }) {
  if (first === undefined || count === undefined) return null;
  return count === 1 ? `${first}` : `${first} – ${first + count - 1}`;
}

function lights(command) {
  const box = make("span", "lights");
  box.setAttribute("role", "img");
  box.setAttribute("aria-label", `stage ${command.stage}`);
  box.title = `queued – sealed – radiated – answered: ${command.stage}`;
  const reached = REACHED[command.stage] ?? 0;
  LIGHTS.forEach((_, i) => {
    const light = make("i");
    if (i < reached) light.classList.add("lit");
    if (i === reached - 1 && BAD.includes(command.stage)) light.classList.add(isWorrying(command) ? "bad" : "lost");
    else if (i === reached - 1 && GOING.includes(command.stage)) light.classList.add("now");
    box.append(light);
  });
  return box;
}

export function paintCommands() {
  const s = satellite();
  say(byId("queued"), s && s.queued > 0 ? `${s.queued} waiting` : "");
  const ready = maySend() && model.live;
  byId("ping").disabled = !ready;
  byId("download").disabled = !ready || Boolean(s?.download);
  say(byId("download"), s?.download ? "Bringing image home" : "Hold: Bring image home");
  paintToken();
}

export function wireHands() {
  onHold(byId("ping"), () => send("commands", { satellite: satellite()?.satellite, command: "Ping" }, (o) => `Ping is queued as #${o.command}.`));
  onHold(byId("download"), () => send("downloads", { satellite: satellite()?.satellite }, (o) => `Download ${o.download} is ordered.`));
  wireToken((told) => {
    say(byId("command-note"), told);
    paintCommands();
  });
}

async function send(path, body, told) {
  const note = byId("command-note");
  say(note, "Sending …");
  try {
    say(note, told(await post(path, body)));
    refreshCommands();
  } catch (error) {
    if (error.status === 401) keepToken("");
    say(note, error.message);
    paintCommands();
  }
}
