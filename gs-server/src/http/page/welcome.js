// A one-time link: its code stands behind #, which is never sent by itself; it is cleared from the address at once.
import { knock } from "./door.js";
import { byId, say } from "./dom.js";

let code = "";

function takeCode() {
  const found = /(?:^#|&)code=([^&]*)/.exec(location.hash);
  if (!found) return;
  code = decodeURIComponent(found[1]);
  history.replaceState(null, "", location.pathname);
}

takeCode();
window.addEventListener("hashchange", takeCode);
if (!code) say(byId("note"), "This address has no code: open the whole link that you were given.");

byId("welcome").addEventListener("submit", (event) => {
  event.preventDefault();
  if (byId("password").value !== byId("again").value) {
    say(byId("note"), "The two passwords differ.");
    return;
  }
  const filled = (id) => byId(id).value.trim() || null;
  knock(event.target, "welcome", {
    code,
    name: filled("name"),
    password: byId("password").value,
    call_sign: filled("call-sign"),
    licence: filled("licence"),
  });
});
