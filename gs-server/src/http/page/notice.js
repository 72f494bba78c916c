// What must be known at once: the server is away, sealing is locked, storage fails. No dialog covers live data.
import { byId, say } from "./dom.js";
import { clock } from "./format.js";
import { model } from "./model.js";

export function paintNotice() {
  const lines = [];
  if (model.tokenRefused) {
    lines.push("The token in this page's address (#token=…) is wrong or has expired. Open the page without it and log in, or open it with a good one: the server's own stands in the file 'token' of its data folder, others are made by 'gs-server token new'.");
  } else if (model.sessionOver) {
    lines.push("Your session has ended: nobody used it for a while, or it was too old. Log in (above, or in another tab) and this page goes on. What you see is old.");
  } else if (model.awaySince !== null) {
    lines.push(`The server is away since ${clock(model.awaySince)} UTC (this machine's clock). What you see is old. Trying again by itself.`);
  }
  const { station } = model;
  if (station?.storage.failing) lines.push(`Storage: ${station.storage.failing}`);
  for (const s of station?.sealing ?? []) {
    if (s.locked) lines.push(`Key ${s.key}: ${s.locked}`);
  }
  const notice = byId("notice");
  notice.hidden = lines.length === 0;
  say(notice, lines.join("\n"));
  document.body.classList.toggle("old-data", model.awaySince !== null);
  const connection = byId("connection");
  connection.classList.toggle("away", !model.live);
  say(connection, model.live ? "● live" : model.tokenRefused ? "○ token refused" : model.awaySince === null ? "connecting" : model.sessionOver ? "○ logged out" : "○ server away");
}
