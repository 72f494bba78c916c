// What hands need on every page: keys that must be held, and the token.
import { hasToken, keepToken, maySend, takeTokenFromAddress, withToken } from "./api.js";
import { byId } from "./dom.js";

const HOLD_MS = 800;

/** Fires after the pointer or the space bar was held for 0.8 s; leaving, Esc or letting go is away from danger. */
export function onHold(button, fire) {
  let timer = null;
  const begin = () => {
    if (button.disabled || timer !== null) return;
    button.classList.add("holding");
    timer = setTimeout(() => {
      end();
      fire();
    }, HOLD_MS);
  };
  const end = () => {
    clearTimeout(timer);
    timer = null;
    button.classList.remove("holding");
  };
  button.addEventListener("pointerdown", begin);
  for (const type of ["pointerup", "pointerleave", "pointercancel", "blur"]) button.addEventListener(type, end);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("keydown", (event) => {
    if (event.key === "Enter") event.preventDefault();
    else if (event.key === "Escape") end();
    else if (event.key === " ") {
      event.preventDefault();
      if (!event.repeat) begin();
    }
  });
  button.addEventListener("keyup", end);
}

/** The form that takes the token, the button that forgets it, and the links that hand it on to the other page. */
export function wireToken(changed) {
  takeTokenFromAddress();
  byId("token-form").addEventListener("submit", (event) => {
    event.preventDefault();
    keepToken(byId("token").value);
    byId("token").value = "";
    changed("");
  });
  byId("forget").addEventListener("click", () => {
    keepToken("");
    changed("Token forgotten.");
  });
  // A printed address that is pasted into an open tab changes the fragment only.
  window.addEventListener("hashchange", () => {
    takeTokenFromAddress();
    changed("");
  });
  for (const link of document.querySelectorAll(".pages a")) {
    const plain = link.getAttribute("href");
    // Only on its way: the next page takes it out of the address at once.
    link.addEventListener("click", (event) => {
      if (event.button === 0 && !event.ctrlKey && !event.metaKey && !event.shiftKey) {
        event.preventDefault();
        location.assign(withToken(plain));
      }
    });
  }
}

export function paintToken() {
  byId("token-form").hidden = maySend();
  byId("forget").hidden = !hasToken();
}
