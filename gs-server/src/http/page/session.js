// Who is logged in: shown in the top bar. The cookie is the browser's; this page never sees it, only the word (csrf)
// that goes with each write.
import { forgetSession, get, hasToken, keepSession, post, remove } from "./api.js";
import { byId, say } from "./dom.js";

// The session's cookie is exchanged now and then, when it is asked for.
const AGAIN_MS = 10 * 60 * 1000;

/** True when there is somebody, or looking needs nobody. */
export async function refreshSession() {
  const session = await get("session");
  keepSession(session);
  paintSession(session);
  return session.rights.includes("look") || hasToken();
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
