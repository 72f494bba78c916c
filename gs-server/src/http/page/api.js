// Requests. The token lives in this variable only: not in storage, not in a cookie, gone with the tab.

let token = null;

/** Takes the token out of the address (`#token=…`, which is never sent to the server) and clears the address bar. */
export function takeTokenFromAddress() {
  const found = /(?:^#|&)token=([^&]*)/.exec(location.hash);
  if (!found) return;
  keepToken(decodeURIComponent(found[1]));
  history.replaceState(null, "", location.pathname + location.search);
}

export function keepToken(text) {
  token = text.trim() || null;
}

export const hasToken = () => token !== null;

/** An address of this server with the token in its fragment, which never leaves the browser. */
export const withToken = (path) => (token === null ? path : `${path}#token=${encodeURIComponent(token)}`);

export async function get(path) {
  const answer = await fetch(`/api/v1/${path}`, { headers: { accept: "application/json" }, cache: "no-store" });
  return read(answer);
}

/** A write. Each call is one intent: it has its own idempotency key, and a lost answer is asked for again with it. */
export async function post(path, body) {
  const headers = {
    authorization: `Bearer ${token}`,
    "content-type": "application/json",
    "idempotency-key": randomKey(),
  };
  const request = () => fetch(`/api/v1/${path}`, { method: "POST", headers, body: JSON.stringify(body) });
  const answer = await request().catch(request);
  return read(answer);
}

async function read(answer) {
  const body = await answer.json().catch(() => null);
  if (answer.ok) return body;
  const error = new Error(body?.detail ?? `The server answered ${answer.status}.`);
  error.status = answer.status;
  throw error;
}

function randomKey() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (b) => b.toString(16).padStart(2, "0")).join("");
}
