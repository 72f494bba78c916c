// What the page knows. The views read it; the stream and the answers of the API write it.

// The server says how it stands at least this often.
const WORD_MS = 1000;

export const model = {
  station: null, // newest StationView
  receivedAt: 0, // performance.now() when it came
  live: false, // the stream is open
  awaySince: null, // wall time when it broke
  sessionOver: false, // who was here must log in again
  tokenRefused: false, // the server does not know the token of the address (any more)
  satellite: null, // name of the satellite shown
};

let shown = -Infinity;

/**
 * The station's time now, in ms, by the server's clock: this browser's clock only counts from its last word. Simulated
 * time goes on at the speed that the server tells, until its next word is due; without one it stands where it was told.
 */
export function now() {
  const { station, receivedAt } = model;
  if (!station) return null;
  const told = Date.parse(station.at);
  const speed = station.simulated ? (station.demo?.speed ?? 0) : 1;
  const since = performance.now() - receivedAt;
  const guess = told + speed * (station.simulated ? Math.min(since, WORD_MS) : since);
  // A clock that stood still meanwhile is behind the guess: the shown time waits for it and does not run backwards.
  shown = shown > guess && shown - guess < 2 * speed * WORD_MS ? shown : guess;
  return shown;
}

/** The satellite that is shown. */
export function satellite() {
  const list = model.station?.satellites ?? [];
  return list.find((s) => s.satellite === model.satellite) ?? list[0] ?? null;
}

export function takeStation(station) {
  model.station = station;
  model.receivedAt = performance.now();
  model.satellite ??= station.satellites[0]?.satellite ?? null;
}
