// Requests. The token lives in this variable only: not in storage, not in a cookie, gone with the tab.

let token = null;
// Who is logged in, as GET /session tells; its csrf goes with each write.
let session = null;

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
export const keepSession = (found) => {
  session = found;
};
export const forgetSession = () => {
  session = null;
};
/** Whether writes have somebody behind them. */
export const maySend = () => token !== null || (session?.rights.includes("command") ?? false);

/** Whether the session may say yes for somebody else; the token is a machine's and may not. */
export const mayApprove = () => token === null && (session?.rights.includes("approve") ?? false);
/** Who is logged in. */
export const person = () => (session?.csrf ? session.name : null);

export const mayPlan = () => token !== null || (session?.rights.includes("plan") ?? false);

/** An address of this server with the token in its fragment, which never leaves the browser. */
export const withToken = (path) => (token === null ? path : `${path}#token=${encodeURIComponent(token)}`);

export async function get(path) {
  const headers = { accept: "application/json" };
  if (token !== null) headers.authorization = `Bearer ${token}`;
  return read(await fetch(`/api/v1/${path}`, { headers, cache: "no-store" }));
}

/** A write. Each call is one intent: it has its own idempotency key, and a lost answer is asked for again with it. */
export const post = (path, body) => write("POST", path, body);
export const remove = (path) => write("DELETE", path, {});

async function write(method, path, body) {
  const key = randomKey();
  const request = () => {
    const headers = { "content-type": "application/json", "idempotency-key": key };
    if (token !== null) headers.authorization = `Bearer ${token}`;
    else if (session?.csrf) headers["x-csrf-token"] = session.csrf;
    return fetch(`/api/v1/${path}`, { method, headers, body: JSON.stringify(body) });
  };
  let answer = await request().catch(request);
  if (answer.status === 403 && token === null) {
    // Another tab may have exchanged the session's cookie, and with it the word.
    session = await get("session");
    answer = await request();
  }
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
