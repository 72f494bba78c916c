// The door: name and password against a session. The password is in the field and in one request, nowhere else.
import { knock } from "./door.js";
import { byId } from "./dom.js";

byId("login").addEventListener("submit", (event) => {
  event.preventDefault();
  knock(event.target, "session", { name: byId("name").value.trim(), password: byId("password").value });
});
