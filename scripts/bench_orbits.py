#!/usr/bin/env python3
"""Times Skyfield and python sgp4 on the element sets that `orbit-peers` wrote, and prints all figures as tables.

Called by scripts/bench-orbits. One thread throughout, and the processor's time, not the clock's. The peers get every
ninth satellite, since all would take half an hour; their time is given for as many pairs as ours. Rises that each finds
are counted on the same pairs.
"""

import json
import os
import sys
import time
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np  # noqa: E402
from sgp4 import omm  # noqa: E402
from sgp4.api import Satrec, SatrecArray  # noqa: E402
from skyfield.api import EarthSatellite, load, wgs84  # noqa: E402

# The same as in orbit-peers.
EVERY = 9


def satellites(path):
    for fields in json.loads(path.read_text()):
        satrec = Satrec()
        # No launch has a designator here, and python sgp4 wants one.
        text = {"OBJECT_ID": "2026-001A"} | {key: str(value) for key, value in fields.items()}
        omm.initialize(satrec, text)
        yield satrec


def skyfield(directory, ours, name, threshold):
    """Seconds for as many pairs as ours, and rises found in the sample."""
    timescale = load.timescale(builtin=True)
    start = timescale.tt_jd(2440587.5 + ours["start_us"] / 86400e6 + 69.184 / 86400)
    stop = timescale.tt_jd(start.tt + ours["days"])
    stations = [wgs84.latlon(latitude, longitude, height) for latitude, longitude, height in ours["stations"]]
    everything = list(satellites(directory / f"{name}.json"))
    sample = everything[::EVERY]
    begin, rises = time.process_time(), 0
    for satrec in sample:
        satellite = EarthSatellite.from_satrec(satrec, timescale)
        for station in stations:
            _, events = satellite.find_events(station, start, stop, altitude_degrees=threshold)
            rises += int(np.count_nonzero(events == 0))
    return (time.process_time() - begin) * len(everything) / len(sample), rises


def satrec_array(directory, ours):
    """ns a state of SatrecArray, one thread."""
    satrecs = list(satellites(directory / "low.json"))
    fleet = SatrecArray(satrecs)
    count = 2016
    day = np.full(count, 2440587.5 + ours["start_us"] // 86_400_000_000)
    fraction = ours["start_us"] % 86_400_000_000 / 86400e6 + np.arange(count) * 300 / 86400
    best = min(timed(lambda: fleet.sgp4(day, fraction)) for _ in range(5))
    return best / (len(satrecs) * count) * 1e9


def timed(run):
    begin = time.process_time()
    run()
    return time.process_time() - begin


def main():
    directory = Path(sys.argv[1])
    ours = json.loads((directory / "ours.json").read_text())
    print("| 100 satellites, 10 stations, 7 days | passes | ours, s | SGP4 states a pass | sgp4-predict, s | ratio | Skyfield, s | ratio | rises in a ninth | Skyfield's |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for search in ours["searches"]:
        seconds, rises = skyfield(directory, ours, search["set"], search["threshold_deg"])
        print(
            f"| {search['set']}, above {search['threshold_deg']:.0f} degrees | {search['passes']:,} | {search['ours_s']:.3f} "
            f"| {search['calls_per_pass']:.2f} | {search['sgp4_predict_s']:.2f} | **{search['sgp4_predict_s'] / search['ours_s']:.0f}** "
            f"| {seconds:.0f} | **{seconds / search['ours_s']:.0f}** "
            f"| {search['sample_rises']:,} | {rises:,} |",
            flush=True,
        )
    array_ns = satrec_array(directory, ours)
    lanes, scalar = ours["propagation"]["lanes_ns"], ours["propagation"]["scalar_ns"]
    print()
    print("| near-earth SGP4, one thread | ns a state | times the lanes |")
    print("| --- | ---: | ---: |")
    print(f"| ours, in vector lanes | {lanes:.1f} | 1 |")
    print(f"| ours, scalar (crate sgp4) | {scalar:.0f} | {scalar / lanes:.1f} |")
    print(f"| python sgp4, `SatrecArray` (C++) | {array_ns:.0f} | **{array_ns / lanes:.1f}** |")
    catalogue = ours["catalogue"]
    print()
    print(
        f"{catalogue['objects']:,} objects over one station for a day, {catalogue['threads']} threads: "
        f"{catalogue['passes']:,} passes in {catalogue['seconds']:.2f} s."
    )


if __name__ == "__main__":
    main()
