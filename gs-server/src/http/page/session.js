// Who is logged in: shown in the top bar. The cookie is the browser's; this page never sees it, only the word (csrf)
// that goes with each write.
import { forgetSession, get, hasToken, keepSession, post, remove } from "./api.js";
import { byId, say } from "./dom.js";
import { model } from "./model.js";

// The session's cookie is exchanged now and then, when it is asked for.
// An open page is in use: more often than the shortest idle time that can be set.
const AGAIN_MS = 4 * 60 * 1000;

/** True when there is somebody, or looking needs nobody. */
export async function refreshSession() {
  const session = await get("session");
  keepSession(session);
  paintSession(session);
  const isThere = session.rights.includes("look") || hasToken();
  model.sessionOver = !isThere;
  return isThere;
}

function paintSession(session) {
  const isPerson = session.csrf !== null;
  say(byId("person"), isPerson ? `${session.name} · ${session.role}` : "");
  byId("log-in").hidden = isPerson;
  byId("log-out").hidden = !isPerson;
}

export function wireSession(painted) {
  byId("log-out").addEventListener("click", async () => {
    await remove("session").catch(() => {});
    forgetSession();
    location.replace("/login");
  });
  setInterval(() => refreshSession().then(painted).catch(() => {}), AGAIN_MS);
}
