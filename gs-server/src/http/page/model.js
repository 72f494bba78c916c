// What the page knows. The views read it; the stream and the answers of the API write it.

export const model = {
  station: null, // newest StationView
  receivedAt: 0, // performance.now() when it came
  live: false, // the stream is open
  awaySince: null, // wall time when it broke
  satellite: null, // name of the satellite shown
};

/** The station's time now, in ms. Simulated time is not guessed: it stands where it was last told. */
export function now() {
  const { station, receivedAt } = model;
  if (!station) return null;
  const told = Date.parse(station.at);
  return station.simulated ? told : told + (performance.now() - receivedAt);
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
