// The first page: reads, follows the stream, paints what it knows.
import { paintAlerts, refreshAlerts } from "./alerts.js";
import { get } from "./api.js";
import { paintCommands, refreshCommands, wireHands } from "./commands.js";
import { addEvent, resetEvents } from "./events.js";
import { paintHeartbeat, refreshHeartbeat } from "./heartbeat.js";
import { paintLinks } from "./links.js";
import { model, satellite, takeStation } from "./model.js";
import { paintNotice } from "./notice.js";
import { paintPasses } from "./passes.js";
import { paintGrid, refreshPicture, resetPicture } from "./picture.js";
import { refreshSession, wireSession } from "./session.js";
import { follow } from "./stream.js";
import { paintTop } from "./top.js";

wireHands();
wireSession(paintCommands);
window.addEventListener("resize", paintGrid);

function paint() {
  paintTop();
  paintPasses();
  paintHeartbeat();
  paintCommands();
  paintLinks();
  paintAlerts();
  paintNotice();
}

let imageSeen = "";

function onStatus(station) {
  takeStation(station);
  const progress = JSON.stringify(satellite()?.image ?? null);
  if (progress !== imageSeen) {
    imageSeen = progress;
    refreshPicture();
  }
  paint();
}

function onEvent(event) {
  addEvent(event);
  if (event.kind === "frame-heard") refreshHeartbeat();
  if (event.kind === "command-stage") refreshCommands();
  if (event.kind === "alert") refreshAlerts();
  if (event.image !== null) refreshPicture();
}

function refreshAll() {
  refreshHeartbeat();
  refreshCommands();
  refreshPicture();
  refreshAlerts();
}

async function begin() {
  if (!(await refreshSession())) {
    location.replace("/login");
    return;
  }
  const [station, events] = await Promise.all([get("station"), get("events?limit=100")]);
  takeStation(station);
  for (const event of events.items.toReversed()) addEvent(event);
  refreshAll();
  paint();
  follow(events.items[0]?.sequence ?? 0, {
    event: onEvent,
    status: onStatus,
    open() {
      model.live = true;
      model.awaySince = null;
      refreshAll();
      paint();
    },
    away() {
      model.live = false;
      model.awaySince ??= Date.now();
      paint();
    },
    reset() {
      resetEvents();
      resetPicture();
      imageSeen = "";
    },
  });
  setInterval(paint, 250);
}

async function beginUntilItWorks() {
  for (;;) {
    try {
      await begin();
      return;
    } catch {
      model.awaySince ??= Date.now();
      paintNotice();
      await new Promise((done) => setTimeout(done, 2000));
    }
  }
}

beginUntilItWorks();
