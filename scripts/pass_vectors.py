#!/usr/bin/env python3
"""Makes the known answers of the pass search: tle/vectors/passes.txt.

Skyfield's altitude function, sampled and solved to a tenth of a microsecond; never its `find_events`, which stops at
half a second. UT1 is taken as UTC on both sides, and there is no polar motion.

    scripts/pass_vectors.py            write the file (some minutes)
    scripts/pass_vectors.py --check    make it again and compare with what is committed (exit code 1 if they differ by
                                       more than a microsecond or 1e-7 degrees)

Needs skyfield and sgp4 (scripts/setup.sh python). A record is a search; its lines are `key: value`:

    elements: mean motion (rev/day), eccentricity, inclination, node, argument of perigee, mean anomaly (deg), B*
    epoch_us: microseconds since 1970 (UTC, no leap seconds counted); start_us and stop_us: the window
    station: latitude, longitude (deg), height (m)
    threshold_deg
    pass: how it begins, seconds since start, elevation rate (deg/s); how it ends, seconds, rate; greatest elevation (deg),
          number of summits. `cross` is the threshold, `cut` the window's end, `lost` the last state of SGP4.
"""

import math
import random
import sys
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
from sgp4 import omm
from sgp4.api import Satrec
from skyfield.api import EarthSatellite, load, wgs84

OUT = Path(__file__).resolve().parent.parent / "tle" / "vectors" / "passes.txt"
EPOCH_US = 1_790_000_000_123_456
MU = 398600.8
# TT - UT1 with UT1 = UTC and 37 leap seconds.
TIMESCALE = load.timescale(delta_t=37 + 32.184, builtin=True)
DAY = 86400.0


class Sky:
    """One satellite over one station; times are seconds since the window's start."""

    def __init__(self, elements, epoch_us, station, start_us):
        names = ("MEAN_MOTION", "ECCENTRICITY", "INCLINATION", "RA_OF_ASC_NODE", "ARG_OF_PERICENTER", "MEAN_ANOMALY", "BSTAR")
        epoch = datetime(1970, 1, 1) + timedelta(microseconds=epoch_us)
        fields = dict(zip(names, map(repr, elements)))
        fields |= {
            "OBJECT_ID": "2026-001A", "EPOCH": epoch.isoformat(timespec="microseconds"), "EPHEMERIS_TYPE": "0",
            "CLASSIFICATION_TYPE": "U", "NORAD_CAT_ID": "1", "ELEMENT_SET_NO": "1", "REV_AT_EPOCH": "1",
            "MEAN_MOTION_DOT": "0", "MEAN_MOTION_DDOT": "0",
        }
        self.satrec = Satrec()
        omm.initialize(self.satrec, fields)
        self.satellite = EarthSatellite.from_satrec(self.satrec, TIMESCALE)
        self.apparent = self.satellite - wgs84.latlon(station[0], station[1], station[2])
        start = datetime(1970, 1, 1) + timedelta(microseconds=start_us)
        self.midnight = (start.year, start.month, start.day)
        self.offset = start.hour * 3600 + start.minute * 60 + start.second
        self.fraction = start.microsecond * 1e-6
        self.days = start_us // 86_400_000_000

    def altitude(self, seconds):
        """Degrees; NaN where SGP4 has no state."""
        seconds = np.atleast_1d(np.asarray(seconds, dtype=float))
        times = TIMESCALE.utc(*self.midnight, 0, 0, self.offset + (seconds + self.fraction))
        altitude = self.apparent.at(times).altaz()[0].degrees
        return np.where(self.failed(seconds), np.nan, altitude)

    def failed(self, seconds):
        whole = np.floor((seconds + self.offset) / DAY)
        rest = (seconds + self.offset - whole * DAY + self.fraction) / DAY
        error, _, _ = self.satrec.sgp4_array(2440587.5 + self.days + whole, rest)
        return error != 0

    def rate(self, seconds):
        return (self.altitude(seconds + 0.05) - self.altitude(seconds - 0.05)) / 0.1


def bisect(inside, low, high):
    """Vectors of brackets: `inside(low)` differs from `inside(high)`; the place where it changes."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    if low.size == 0:
        return low
    at_low = inside(low)
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = inside(middle) == at_low
        low, high = np.where(same, middle, low), np.where(same, high, middle)
        if np.max(high - low) < 1e-8:
            break
    return 0.5 * (low + high)


def peaks(sky, low, high, sign):
    """Golden section for the greatest (sign 1) or least (sign -1) altitude in each bracket."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    if low.size == 0:
        return low
    golden = (math.sqrt(5) - 1) / 2
    for _ in range(60):
        a, b = high - golden * (high - low), low + golden * (high - low)
        left = sign * sky.altitude(a) > sign * sky.altitude(b)
        low, high = np.where(left, low, a), np.where(left, b, high)
        if np.max(high - low) < 1e-6:
            break
    return 0.5 * (low + high)


def passes(sky, length, threshold, step):
    """What is above the threshold, as the lines of the file tell it."""
    # A sample close to every end shows which way the altitude goes there, so that a summit in the first step is not lost.
    close = 0.01
    times = np.unique(np.concatenate([np.arange(0.0, length, step), [close, length - close, length]]))
    altitude = sky.altitude(times)
    # Times without states: their exact edges join the samples; nothing is above there.
    bad = np.isnan(altitude)
    edges = np.nonzero(bad[1:] != bad[:-1])[0]
    lost = bisect(sky.failed, times[edges], times[edges + 1])
    kept = [(t, a) for t, a in zip(times, altitude) if not math.isnan(a)]
    for t, i in zip(lost, edges):
        for inside in (t - 1e-6, t - close) if not bad[i] else (t + 1e-6, t + close):
            if (altitude_there := float(sky.altitude(inside)[0])) == altitude_there:
                kept.append((inside, altitude_there))
    kept.sort()
    # Summits and valleys become samples too, so that nothing hides between two.
    t, a = np.array([k[0] for k in kept]), np.array([k[1] for k in kept])
    joined = ~np.array([any(x <= e <= y for e in lost) for x, y in zip(t[:-1], t[1:])]) if len(lost) else np.ones(len(t) - 1, bool)
    inner = joined[:-1] & joined[1:]
    tops = np.nonzero(inner & (a[1:-1] >= a[:-2]) & (a[1:-1] > a[2:]) & (a[1:-1] > threshold - 5))[0]
    dips = np.nonzero(inner & (a[1:-1] <= a[:-2]) & (a[1:-1] < a[2:]) & (abs(a[1:-1] - threshold) < 5))[0]
    summits = peaks(sky, t[tops], t[tops + 2], 1)
    valleys = peaks(sky, t[dips], t[dips + 2], -1)
    more = np.concatenate([summits, valleys])
    t = np.concatenate([t, more])
    a = np.concatenate([a, sky.altitude(more) if len(more) else []])
    order = np.argsort(t)
    t, a = t[order], a[order]
    above = a > threshold
    is_lost = lambda x, y: any(x <= e <= y for e in lost)  # noqa: E731
    flips = [i for i in range(len(t) - 1) if above[i] != above[i + 1] and not is_lost(t[i], t[i + 1])]
    crossings = dict(zip(flips, bisect(lambda s: sky.altitude(s) > threshold, t[flips], t[np.array(flips, int) + 1]))) if flips else {}

    found, open_ = [], None
    if above[0]:
        open_ = ("cut" if t[0] == 0.0 else "lost", t[0])
    for i in range(len(t) - 1):
        if is_lost(t[i], t[i + 1]):
            if open_:
                found.append((*open_, "lost", t[i]))
                open_ = None
            if above[i + 1]:
                open_ = ("lost", t[i + 1])
        elif i in crossings:
            if open_:
                found.append((*open_, "cross", crossings[i]))
                open_ = None
            else:
                open_ = ("cross", crossings[i])
    if open_:
        found.append((*open_, "cut" if t[-1] == length else "lost", t[-1]))
    lines = []
    for rise, aos, fall, los in found:
        inside = [s for s in summits if aos <= s <= los]
        best = max(sky.altitude(np.array([aos, los, *inside])))
        rates = [0.0 if kind == "lost" else float(sky.rate(at)[0]) for kind, at in ((rise, aos), (fall, los))]
        lines.append(f"{rise} {aos:.7f} {rates[0]:.6f} {fall} {los:.7f} {rates[1]:.6f} {best:.8f} {len(inside)}")
    return lines


# --- what is searched ----------------------------------------------------------------------------------------------------

STATIONS = {
    "north pole": (90.0, 0.0, 2800.0),
    "south pole": (-90.0, 77.0, 2835.0),
    "Svalbard": (78.2297, 15.4077, 458.0),
    "Zurich": (47.3769, 8.5417, 430.0),
    "west of the date line": (-16.5, 179.9999, 10.0),
    "east of the date line": (0.0, -179.9999, 0.0),
    "Dead Sea": (31.5, 35.48, -430.0),
    "Santiago": (-33.13, -70.67, 730.0),
    "Altiplano": (-22.95, -67.75, 5058.0),
}


def rev_day(axis_km):
    return DAY / (2 * math.pi * math.sqrt(axis_km**3 / MU))


def low_orbits(rng, count):
    for _ in range(count):
        inclination = rng.choice([97.0 + 2 * rng.random(), 51.6, 30 + 60 * rng.random(), 5 * rng.random(), 140.0])
        yield (round(rev_day(6378 + 350 + 700 * rng.random()), 8), round(0.015 * rng.random() ** 2, 7), round(inclination, 4),
               *(round(360 * rng.random(), 4) for _ in range(3)), round(1e-4 * rng.random(), 9))


def eccentric_orbits(rng, count):
    for _ in range(count):
        e = 0.03 + 0.6 * rng.random()
        axis = (6378 + 300 + 800 * rng.random()) / (1 - e)
        yield (round(rev_day(axis), 8), round(e, 7), round(100 * rng.random(), 4), *(round(360 * rng.random(), 4) for _ in range(3)),
               round(1e-5 * rng.random(), 9))


def searches():
    """Yields (name, elements, station, start_us, length_s, threshold_deg, step_s)."""
    rng = random.Random(20260921)
    names = list(STATIONS)
    second = 1_000_000
    for k, elements in enumerate(low_orbits(rng, 16)):
        for j, threshold in enumerate((0.0, 5.0, 10.0, -2.0)):
            station = names[(k + 2 * j) % len(names)]
            yield f"low orbit {k}, {station}", elements, STATIONS[station], EPOCH_US + k * 3571 * second, 4 * DAY, threshold, 20.0
    # A window that begins long before the epoch, and one that begins and ends within passes.
    elements = next(low_orbits(rng, 1))
    yield "low orbit, before the epoch", elements, STATIONS["Svalbard"], EPOCH_US - 12 * 86400 * second, 2 * DAY, 0.0, 20.0
    sky = Sky(elements, EPOCH_US, STATIONS["Svalbard"], EPOCH_US)
    lines = [line.split() for line in passes(sky, DAY, 0.0, 20.0)]
    first, last = [line for line in lines if line[0] == line[3] == "cross"][1::6][:2]
    middle = [(float(line[1]) + float(line[4])) / 2 for line in (first, last)]
    yield ("low orbit, window begins and ends within passes", elements, STATIONS["Svalbard"], EPOCH_US + int(middle[0] * second),
           round(middle[1] - middle[0], 3), 0.0, 20.0)
    yield ("low orbit, window within one pass", elements, STATIONS["Svalbard"], EPOCH_US + int((middle[0] - 30) * second), 60.0, 0.0,
           5.0)
    # Thresholds just below a summit: passes of seconds.
    for line in lines[1:6]:
        threshold = round(float(line[6]) - 2e-4, 6)
        yield "low orbit, threshold just below a summit", elements, STATIONS["Svalbard"], EPOCH_US, DAY, threshold, 10.0
    for k, elements in enumerate(eccentric_orbits(rng, 14)):
        for j, threshold in enumerate((0.0, 10.0)):
            station = names[(k + 4 * j) % len(names)]
            yield f"eccentric orbit {k}, {station}", elements, STATIONS[station], EPOCH_US, 4 * DAY, threshold, 20.0
    molniya = (2.00612, 0.7222, 63.4, 110.0, 270.0, 10.0, 0.0)
    transfer = (2.2705, 0.7311, 6.0, 40.0, 178.0, 200.0, 1e-4)
    tundra = (1.0027, 0.2684, 63.4, 200.0, 270.0, 30.0, 0.0)
    geo = (1.0027, 0.0003, 0.05, 90.0, 20.0, 250.0, 0.0)
    inclined_geo = (1.0027, 0.001, 14.0, 90.0, 20.0, 250.0, 0.0)
    galileo = (1.70475, 0.0003, 56.0, 30.0, 60.0, 90.0, 0.0)
    beyond = (0.21, 0.8, 30.0, 60.0, 45.0, 100.0, 0.0)
    for name, orbit in (("Molniya", molniya), ("transfer orbit", transfer), ("Tundra", tundra), ("Galileo", galileo),
                        ("inclined geosynchronous", inclined_geo), ("nearly five days a revolution", beyond)):
        for station in names:
            yield f"{name}, {station}", orbit, STATIONS[station], EPOCH_US, 6 * DAY, 5.0, 60.0
    for longitude in (-150, -90, -30, 30, 90, 150):
        # Always up over some, never over others, and at the edge where its small circle rises and sets.
        yield f"geostationary, equator at {longitude}", geo, (0.0, float(longitude), 0.0), EPOCH_US, 3 * DAY, 0.0, 60.0
    yield "retrograde and low over the equator", (15.0, 0.001, 179.0, 0.0, 0.0, 0.0, 1e-5), (0.0, 30.0, 0.0), EPOCH_US, 2 * DAY, 0.0, 20.0
    yield "low and equatorial, over the equator", (15.2, 0.001, 0.01, 0.0, 0.0, 0.0, 1e-5), (0.0, 30.0, 0.0), EPOCH_US, 2 * DAY, 0.0, 20.0
    yield "low and equatorial, never seen from Svalbard", (15.2, 0.001, 0.01, 0.0, 0.0, 0.0, 1e-5), STATIONS["Svalbard"], EPOCH_US, 2 * DAY, 0.0, 60.0
    # Decays within the window, after two days or four: over stations anywhere, and over one in whose sky it happens.
    for k, (motion, drag) in enumerate(((16.3, 0.001), (16.35, 0.001), (16.43, 0.0003), (16.3, 0.002))):
        orbit = (motion, 0.0008, 51.6, 40.0 * k, 100.0, 10.0, drag)
        for name, station in (("Zurich", STATIONS["Zurich"]), ("below", below(orbit, 5 * DAY, 1)), ("aside", below(orbit, 5 * DAY, 1, 4.0))):
            yield f"decaying {k}, {name}", orbit, station, EPOCH_US, 5 * DAY, 0.0, 10.0
    # Dips below the surface at every perigee: no state there, but before and after.
    dipping = (2.2705, 0.7405, 6.0, 40.0, 178.0, 200.0, 0.0)
    for name, station in (("Santiago", STATIONS["Santiago"]), ("where it goes down", below(dipping, 2 * DAY, 1)),
                          ("where it comes up", below(dipping, 2 * DAY, -1)), ("aside", below(dipping, 2 * DAY, 1, 2.0))):
        yield f"perigee below the surface, {name}", dipping, station, EPOCH_US, 4 * DAY, -4.0, 10.0


def below(orbit, length, way, aside_deg=0.0):
    """A station below the place where states first end (way 1) or begin again (way -1)."""
    sky = Sky(orbit, EPOCH_US, (0.0, 0.0, 0.0), EPOCH_US)
    times = np.arange(0.0, length, 10.0)
    bad = sky.failed(times)
    k = next(k for k in range(len(times) - 1) if (bad[k + 1], bad[k]) == ((True, False) if way == 1 else (False, True)))
    at = TIMESCALE.utc(*sky.midnight, 0, 0, sky.offset + sky.fraction + times[k if way == 1 else k + 1])
    place = wgs84.subpoint(sky.satellite.at(at))
    return (round(float(place.latitude.degrees) + aside_deg, 4), round(float(place.longitude.degrees), 4), 0.0)


def records():
    for name, elements, station, start_us, length, threshold, step in searches():
        sky = Sky(elements, EPOCH_US, station, start_us)
        lines = [f"search: {name}", "elements: " + " ".join(map(repr, elements)), f"epoch_us: {EPOCH_US}",
                 "station: " + " ".join(map(repr, station)), f"start_us: {start_us}", f"stop_us: {start_us + round(length * 1e6)}",
                 f"threshold_deg: {threshold!r}"]
        found = passes(sky, round(length * 1e6) / 1e6, threshold, step)
        print(f"{name}: {len(found)} passes", file=sys.stderr)
        yield "\n".join(lines + [f"pass: {line}" for line in found]) + "\n"


def differs(old, new):
    """Whether two files differ by more than rounding."""
    if len(old) != len(new):
        return True
    for a, b in zip(old, new):
        if a == b:
            continue
        x, y = a.split(), b.split()
        if not a.startswith("pass:") or len(x) != len(y):
            return True
        for k, limit in ((2, 1e-6), (3, 1e-5), (5, 1e-6), (6, 1e-5), (7, 1e-7)):
            if abs(float(x[k]) - float(y[k])) > limit:
                return True
        if (x[1], x[4], x[8]) != (y[1], y[4], y[8]):
            return True
    return False


def main():
    text = "# Made by scripts/pass_vectors.py: do not edit.\n\n" + "\n".join(records())
    print(sum(line.startswith("pass:") for line in text.splitlines()), "passes", file=sys.stderr)
    if "--check" in sys.argv:
        if differs(OUT.read_text().splitlines(), text.splitlines()):
            print(f"{OUT} differs from what this script makes", file=sys.stderr)
            sys.exit(1)
    else:
        OUT.write_text(text)


if __name__ == "__main__":
    main()
