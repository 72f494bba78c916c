// What waits for a second person. Approving is held, not clicked, and says yes to the digest that this page has shown.
import { get, mayApprove, maySend, person, post } from "./api.js";
import { atMostEvery, byId, make, say } from "./dom.js";
import { clock, countdown, date, ms } from "./format.js";
import { onHold } from "./hands.js";
import { now } from "./model.js";

// Asking makes no event of the station: it is looked for.
const AGAIN_MS = 10000;

let waiting = [];
let painted = "";
let told = null;

export const refreshApprovals = atMostEvery(1000, async () => {
  waiting = (await get("approvals?open=true&limit=50")).items.filter((approval) => approval.state === "awaiting");
  paintApprovals();
});

export function wireApprovals() {
  setInterval(refreshApprovals, AGAIN_MS);
}

export function paintApprovals() {
  const open = waiting.filter((approval) => ms(approval.expires_at) > now());
  for (const approval of open) {
    const left = document.getElementById(`left-${approval.id}`);
    if (left) say(left, countdown(ms(approval.expires_at) - now()));
  }
  const key = JSON.stringify([open, maySend(), mayApprove(), told]);
  if (key === painted) return;
  painted = key;
  const strip = byId("approvals");
  strip.hidden = open.length === 0 && told === null;
  const word = told === null ? [] : [make("li", "dim", told)];
  strip.replaceChildren(...open.map(row), ...word);
}

function row(approval) {
  const li = make("li");
  const left = make("span", "time num");
  left.id = `left-${approval.id}`;
  left.title = `asked ${date(ms(approval.asked_at))} ${clock(ms(approval.asked_at))} UTC, approval ${approval.id}, digest ${approval.digest}`;
  const isOwn = approval.person === person();
  const who = isOwn ? "you" : approval.person;
  const text = make("span", "text", `${approval.summary} (asked by ${who}; digest ${approval.digest.slice(0, 12)})`);
  li.append(make("span", "word", "needs a second person"), left, text);
  if (mayApprove() && !isOwn) {
    const yes = make("button", "hold", "Hold: Approve");
    yes.type = "button";
    onHold(yes, () => decide(approval, yes, "approve", { digest: approval.digest }));
    li.append(yes);
  }
  if (maySend()) {
    const no = make("button", "quiet", isOwn ? "Take back" : "Refuse");
    no.type = "button";
    no.addEventListener("click", () => decide(approval, no, "refuse", {}));
    li.append(no);
  }
  return li;
}

async function decide(approval, button, verb, body) {
  button.disabled = true;
  try {
    await post(`approvals/${approval.id}/${verb}`, body);
    told = null;
  } catch (error) {
    told = `Approval ${approval.id}: ${error.message}`;
  }
  painted = "";
  refreshApprovals();
  paintApprovals();
}
