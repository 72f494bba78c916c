// Who hears us: receivers elsewhere, one's own boards, and ways in that do not work. What strangers call themselves is text.
import { get } from "./api.js";
import { atMostEvery, byId, make } from "./dom.js";
import { clock, date, ms, span } from "./format.js";

// Rows that are shown; of the rest the number.
const SHOWN = 12;

let painted = "";

export const refreshEars = atMostEvery(15000, async () => {
  const [receivers, ways] = await Promise.all([get("receivers"), get("ears/ways")]);
  paint(receivers.items, ways.items);
});

function paint(receivers, ways) {
  const key = JSON.stringify([receivers, ways.map((way) => [way.name, way.state, way.note, way.error])]);
  if (key === painted) return;
  painted = key;
  byId("ears").hidden = receivers.length === 0 && ways.length === 0;
  const rows = receivers.slice(0, SHOWN).map(row);
  const head = make("tr");
  for (const name of ["Receiver", "Heard", "Frames", "SNR dB", ""]) head.append(make("th", "", name));
  byId("ear-list").replaceChildren(...(rows.length > 0 ? [head, ...rows] : []));
  const troubled = ways.filter((way) => way.state !== "working" || way.note !== null);
  const notes = troubled.map((way) => `${way.name}: ${way.state}${words(way)}`);
  if (receivers.length > SHOWN) notes.push(`and ${receivers.length - SHOWN} more: gs-server ears`);
  byId("ear-notes").replaceChildren(...notes.map((text) => make("li", "dim", text)));
}

const words = (way) => (way.note ?? (way.state === "working" ? null : way.error) ? `, ${way.note ?? way.error}` : "");

function row(receiver) {
  const tr = make("tr");
  const name = make("td", "clip", receiver.name ?? receiver.id);
  name.title = `${receiver.id}, by ${receiver.sources.join(", ") || "its own word"}`;
  const at = ms(receiver.last_heard_at);
  const today = at !== null && Date.now() - at < 86400e3;
  const heard = make("td", "num", at === null ? "—" : today ? clock(at) : date(at).slice(0, 10));
  if (at !== null) heard.title = `${date(at)}, ${span(Date.now() - at)} ago`;
  const snr = receiver.median_snr_db === null ? "—" : receiver.median_snr_db.toFixed(1);
  tr.append(name, heard, make("td", "num", String(receiver.frames)), make("td", "num", snr), make("td", "", state(receiver.board)));
  return tr;
}

const state = (board) => (board === null ? "" : board.online ? "online" : "offline");
