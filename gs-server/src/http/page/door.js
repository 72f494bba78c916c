// What both doors do: send the form, tell what is wrong, go in.
import { byId, say } from "./dom.js";

export async function knock(form, path, body) {
  const button = form.querySelector("button");
  button.disabled = true;
  say(byId("note"), "");
  try {
    const answer = await fetch(`/api/v1/${path}`, {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify(body),
    });
    if (answer.ok) {
      location.replace("/");
      return;
    }
    const problem = await answer.json().catch(() => null);
    say(byId("note"), problem?.detail ?? `The server answered ${answer.status}.`);
  } catch {
    say(byId("note"), "The server does not answer. Try again.");
  }
  button.disabled = false;
}
