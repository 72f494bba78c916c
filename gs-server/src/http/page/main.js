// The first page: reads, follows the stream, paints what it knows.
import { paintAlerts, refreshAlerts } from "./alerts.js";
import { paintApprovals, refreshApprovals, wireApprovals } from "./approvals.js";
import { beginPage } from "./begin.js";
import { paintCommands, refreshCommands, wireHands } from "./commands.js";
import { refreshEars } from "./ears.js";
import { addEvent, resetEvents } from "./events.js";
import { paintHeartbeat, refreshHeartbeat } from "./heartbeat.js";
import { paintLinks } from "./links.js";
import { satellite, takeStation } from "./model.js";
import { paintNotice } from "./notice.js";
import { paintPasses } from "./passes.js";
import { paintGrid, refreshPicture, resetPicture } from "./picture.js";
import { wireSession } from "./session.js";
import { paintTop } from "./top.js";

wireHands();
wireSession(paintCommands);
wireApprovals();
window.addEventListener("resize", paintGrid);

function paint() {
  paintTop();
  paintPasses();
  paintHeartbeat();
  paintCommands();
  paintLinks();
  paintAlerts();
  paintApprovals();
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
  if (event.kind === "frame-heard") {
    refreshHeartbeat();
    refreshEars();
  }
  if (event.kind === "command-stage") refreshCommands();
  if (event.kind === "alert") refreshAlerts();
  if (event.image !== null) refreshPicture();
}

function refreshAll() {
  refreshHeartbeat();
  refreshCommands();
  refreshPicture();
  refreshAlerts();
  refreshApprovals();
  refreshEars();
}

beginPage({
  history: 100,
  started(events) {
    for (const event of events) addEvent(event);
    refreshAll();
    paint();
  },
  refresh: refreshAll,
  event: onEvent,
  status: onStatus,
  paint,
  reset() {
    resetEvents();
    resetPicture();
    imageSeen = "";
  },
});
