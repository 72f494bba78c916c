// How a page begins: somebody is there, the station is read, the stream is followed; and again until the server is there.
import { get, hasToken } from "./api.js";
import { model, takeStation } from "./model.js";
import { paintNotice } from "./notice.js";
import { refreshSession } from "./session.js";
import { follow } from "./stream.js";

const AGAIN_MS = 2000;

/**
 * `history`: how many of the newest events the page wants first, oldest first, in `started`.
 * `refresh`: reads what only events change; called whenever the stream opens.
 */
export async function beginPage({ history, started, refresh, event, status, paint, reset }) {
  const begin = async () => {
    if (!(await refreshSession())) {
      location.replace("/login");
      return;
    }
    const [station, events] = await Promise.all([get("station"), get(`events?limit=${history}`)]);
    takeStation(station);
    started(events.items.toReversed());
    follow(events.items[0]?.sequence ?? 0, {
      event,
      status,
      open() {
        model.live = true;
        model.awaySince = null;
        model.tokenRefused = false;
        // Somebody may have logged in again, here or in another tab.
        if (model.sessionOver) refreshSession().then(paint).catch(() => {});
        refresh();
        paint();
      },
      away() {
        model.live = false;
        model.awaySince ??= Date.now();
        paint();
        // A stream ends with its session or its token, and the page says so instead of calling the server away.
        refreshSession()
          .then(paint)
          .catch((error) => {
            model.tokenRefused = error.status === 401 && hasToken();
            paint();
          });
      },
      reset,
    });
    setInterval(paint, 250);
  };
  for (;;) {
    try {
      await begin();
      return;
    } catch (error) {
      // It answers: it is not away. Tried again, the same token would count as somebody's guessing.
      model.tokenRefused = error.status === 401 && hasToken();
      if (model.tokenRefused) {
        model.awaySince = null;
        paintNotice();
        return;
      }
      model.awaySince ??= Date.now();
      paintNotice();
      await new Promise((done) => setTimeout(done, AGAIN_MS));
    }
  }
}
