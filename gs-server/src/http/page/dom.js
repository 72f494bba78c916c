// Small hands for the document. Data reaches it as text only, never as markup.

export const byId = (id) => document.getElementById(id);

/** Sets text, only when it differs, so that selections and screen readers are left in peace. */
export function say(node, text) {
  const value = text ?? "";
  if (node.textContent !== value) node.textContent = value;
}

/** A new element with a class and text. */
export function make(tag, className, text) {
  const node = document.createElement(tag);
  if (className) node.className = className;
  if (text !== undefined && text !== null) node.textContent = text;
  return node;
}

/** Runs `work` at once, then at most once in `ms`; calls in between are joined into one. */
export function atMostEvery(ms, work) {
  let timer = null;
  let again = false;
  const run = async () => {
    timer = setTimeout(() => {
      timer = null;
      if (again) {
        again = false;
        run();
      }
    }, ms);
    try {
      await work();
    } catch {
      // The stream notices when the server is away; the next event asks again.
    }
  };
  return () => {
    if (timer === null) run();
    else again = true;
  };
}
