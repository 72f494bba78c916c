#!/usr/bin/env python3
"""Makes the known answers of orbits: tle/vectors/*.txt.

From other people's code (sgp4, Skyfield, ERFA), never from the crate it checks. Nothing is fetched: the verification set
of SGP4 comes with the package sgp4, the Earth's rotation with Skyfield, the Sun's place from ERFA's series.

    scripts/orbit_vectors.py            write the files
    scripts/orbit_vectors.py --check    make them again and compare with what is committed (exit code 1 if they differ)

A file is a list of records, separated by blank lines; a line is `key: value`; `#` begins a remark. Comparison is by number,
since another machine may round the last printed digit otherwise.

    sgp4.txt     the verification set of AIAA 2006-6753: states in TEME (km, km/s) and error codes by minutes from epoch
    look.txt     look angles and rates, and the place below, by Skyfield (WGS84, no polar motion)
    sun.txt      the Sun's direction by ERFA, and the edges of the Earth's shadow for some orbits
"""

import json
import math
import sys
from pathlib import Path

import erfa
import numpy as np
import sgp4
from sgp4 import exporter
from sgp4.api import WGS72, Satrec
from skyfield.api import EarthSatellite, load, wgs84

OUT = Path(__file__).resolve().parent.parent / "tle" / "vectors"


# --- the verification set ----------------------------------------------------------------------------------------------


def verification_set():
    """(remark, line 1, line 2, start, stop, step) of each run."""
    runs, remarks, line1 = [], [], None
    for line in (Path(sgp4.__file__).parent / "SGP4-VER.TLE").read_text().splitlines():
        if line.startswith("#"):
            remarks.append(line.lstrip("# -").rstrip(" -"))
        elif line.startswith("1 "):
            line1 = line
        elif line.startswith("2 "):
            runs.append((" ".join(" ".join(r for r in remarks if r).split()), line1, line, *map(float, line[69:].split())))
            remarks = []
    return runs


def steps(start, stop, step):
    """The minutes at which the reference programme prints, the epoch included."""
    times = [0.0] if start != 0.0 else []
    count = math.floor((stop - start) / step + 1e-9)
    times += [start + step * index for index in range(count + 1)]
    return times + ([stop] if stop - times[-1] > 1e-9 else [])


def sgp4_records():
    for remark, line1, line2, start, stop, step in verification_set():
        satellite = Satrec.twoline2rv(line1, line2, WGS72)
        yield f"# {remark}"
        yield f"line1: {line1}"
        yield f"line2: {line2}"
        if satellite.intldesg.strip():  # the exporter cannot do without
            yield f"omm: {json.dumps(exporter.export_omm(satellite, 'VERIFICATION'))}"
        failing = None
        for minutes in steps(start, stop, step):
            code, r, v = satellite.sgp4_tsince(minutes)
            if code != failing and failing is not None:
                failing = None
            if code:
                # Of a row of failing steps with one code only the first and the last count are told.
                if failing is None:
                    failing = code
                    yield f"error: {minutes:.7f} {code}"
            else:
                yield f"state: {minutes:.7f} " + " ".join(f"{x:.8f}" for x in r) + " " + " ".join(f"{x:.10f}" for x in v)
        yield ""


def check_against_published():
    """Our own vectors must be those that the authors published (tcppver.out), where both have a state."""
    published, states = {}, {}
    number, runs = None, {}
    for line in (Path(sgp4.__file__).parent / "tcppver.out").read_text().splitlines():
        fields = line.split()
        if len(fields) == 2 and fields[1] == "xx":
            runs[fields[0]] = runs.get(fields[0], 0) + 1
            number = (int(fields[0]), runs[fields[0]])
        elif len(fields) >= 7:
            published[number, round(float(fields[0]), 6)] = [float(x) for x in fields[1:7]]
    seen = {}
    for line in sgp4_records():
        if line.startswith("line1"):
            catalogue = int(line[9:14])
            seen[catalogue] = seen.get(catalogue, 0) + 1
        elif line.startswith("state"):
            numbers = [float(x) for x in line.split()[1:]]
            states[(catalogue, seen[catalogue]), round(numbers[0], 6)] = numbers[1:]
    compared = 0
    for key in published.keys() & states.keys():
        for axis, (ours, theirs) in enumerate(zip(states[key], published[key], strict=True)):
            assert abs(ours - theirs) < (5e-7 if axis < 3 else 2e-9), (key, axis, ours, theirs)
        compared += 1
    assert compared > 600, compared


# --- orbits for the other vectors --------------------------------------------------------------------------------------


def orbit(number, inclination, node, eccentricity, perigee, anomaly, mean_motion, bstar=2e-5):
    """A satellite with epoch 2024-06-15T06:00, and its two lines."""
    satellite = Satrec()
    epoch = 2460476.75 - 2433281.5  # days since 1950-01-00 UTC
    radians = math.radians
    satellite.sgp4init(
        WGS72, "i", number, epoch, bstar, 0.0, 0.0, eccentricity, radians(perigee), radians(inclination), radians(anomaly),
        mean_motion * 2 * math.pi / 1440.0, radians(node),
    )
    satellite.classification, satellite.intldesg, satellite.ephtype = "U", "24123A", 0
    satellite.elnum, satellite.revnum = 7, 77
    lines = exporter.export_tle(satellite)
    return Satrec.twoline2rv(*lines, WGS72), lines


ORBITS = [
    ("sun-synchronous 500 km", orbit(90001, 97.4, 250.3, 0.0012, 60.0, 300.0, 15.2194)),
    ("space station", orbit(90002, 51.64, 210.0, 0.0005, 30.0, 10.0, 15.5)),
    ("sun-synchronous dawn to dusk", orbit(90003, 98.1, 174.0, 0.0001, 90.0, 270.0, 14.6)),
    ("navigation", orbit(90004, 55.0, 100.0, 0.01, 200.0, 20.0, 2.00561, 0.0)),
    ("Molniya", orbit(90005, 63.4, 40.0, 0.72, 270.0, 0.0, 2.00613, 0.0)),
    ("geostationary", orbit(90006, 0.05, 80.0, 0.0002, 10.0, 150.0, 1.00272, 0.0)),
    ("transfer", orbit(90007, 27.0, 300.0, 0.73, 178.0, 0.0, 2.27, 1e-4)),
]

STATIONS = [
    ("Lausanne", 46.5191, 6.5668, 410.0),
    ("Quito", -0.18, -78.47, 2850.0),
    ("Svalbard", 78.23, 15.4, 450.0),
    ("Fiji, beside the date line", -16.5, 179.999, 5.0),
    ("south pole", -90.0, 0.0, 2835.0),
    ("Dead Sea", 31.5, 35.5, -430.0),
]


# --- look angles -------------------------------------------------------------------------------------------------------


def look_records():
    table = load.timescale(builtin=True)
    # UT1 = UTC: TT - UT1 is what TT - UTC has been since 2017.
    flat = load.timescale(builtin=True, delta_t=69.184)
    for name, (satrec, lines) in ORBITS:
        yield f"# {name}"
        yield f"line1: {lines[0]}"
        yield f"line2: {lines[1]}"
        for scale in (flat, table):
            satellite = EarthSatellite.from_satrec(satrec, scale)
            for index in range(24):
                # 2024-06-15T06:00 and 24 instants in the two days after it, none at a round time.
                second = 7 + index * 7321
                t = scale.utc(2024, 6, 15, 6, 0, second)
                dut1 = 0.0 if scale is flat else float(t.dut1)
                geocentric = satellite.at(t)
                below = wgs84.geographic_position_of(geocentric)
                unix_us = 1718431200_000000 + second * 1_000000
                yield (
                    f"below: {unix_us} {dut1:.6f} {below.latitude.degrees:.7f} {below.longitude.degrees:.7f} "
                    f"{below.elevation.km:.5f}"
                )
                place, latitude, longitude, height = STATIONS[index % len(STATIONS)]
                station = wgs84.latlon(latitude, longitude, height)
                seen = (satellite - station).at(t)
                alt, az, distance, alt_rate, az_rate, range_rate = seen.frame_latlon_and_rates(station)
                yield (
                    f"look: {unix_us} {dut1:.6f} {latitude} {longitude} {height} {az.degrees:.7f} {alt.degrees:.7f} "
                    f"{distance.km:.6f} {az_rate.degrees.per_second:.9f} {alt_rate.degrees.per_second:.9f} "
                    f"{range_rate.km_per_s:.9f}"
                )
        yield ""


# --- Sun and shadow ----------------------------------------------------------------------------------------------------

EARTH_KM, SUN_KM, AU_KM = 6378.137, 696000.0, 149597870.7


def sun_teme(unix_s):
    """The apparent Sun from the Earth's centre in TEME, km, by ERFA's series; an array of instants since 2017."""
    tt2 = (np.asarray(unix_s, float) + 69.184) / 86400.0 + (2440587.5 - 2451545.0)
    tt1 = 2451545.0
    heliocentric, barycentric = erfa.epv00(tt1, tt2)
    r = -heliocentric["p"]
    distance = np.linalg.norm(r, axis=-1, keepdims=True)
    v = barycentric["v"] * (AU_KM / 86400.0 / 299792.458)
    bm1 = np.sqrt(1.0 - np.sum(v * v, axis=-1))
    direction = erfa.ab(r / distance, v, distance[..., 0], bm1)
    of_date = np.einsum("...ij,...j->...i", erfa.pnm06a(tt1, tt2), direction)
    # From the true equinox to the mean one, along the true equator.
    turn = erfa.ee06a(tt1, tt2)
    x = np.cos(turn) * of_date[..., 0] + np.sin(turn) * of_date[..., 1]
    y = -np.sin(turn) * of_date[..., 0] + np.cos(turn) * of_date[..., 1]
    return np.stack([x, y, of_date[..., 2]], axis=-1) * distance * AU_KM


def sun_table(start, stop):
    """The Sun between two instants; a straight line over five minutes of its way is exact to 1e-10."""
    nodes = np.arange(start - 300.0, stop + 601.0, 300.0)
    table = sun_teme(nodes)
    return lambda unix_s: np.stack([np.interp(unix_s, nodes, table[:, axis]) for axis in range(3)], axis=-1)


def margins(satrec, sun_at, unix_s):
    """Angles by which the discs of Sun and Earth are apart, and by which the Sun is uncovered: negative in the shadow."""
    unix_s = np.asarray(unix_s, float)
    jd = np.full_like(unix_s, 2440587.5)
    code, r, _ = satrec.sgp4_array(jd, unix_s / 86400.0)
    assert not code.any()
    sun = sun_at(unix_s)
    to_sun = sun - r
    sun_range, radius = np.linalg.norm(to_sun, axis=-1), np.linalg.norm(r, axis=-1)
    a, b = np.arcsin(SUN_KM / sun_range), np.arcsin(EARTH_KM / radius)
    apart = np.arccos(np.clip(-np.sum(to_sun * r, axis=-1) / sun_range / radius, -1, 1))
    return apart - (a + b), apart - (b - a)


def crossings(satrec, start, stop):
    sun_at = sun_table(start, stop)
    times = np.arange(start, stop + 1, 2.0)
    found = []
    for which, names in enumerate((("penumbra-entered", "penumbra-left"), ("umbra-entered", "umbra-left"))):
        inside = margins(satrec, sun_at, times)[which] < 0
        for index in np.flatnonzero(inside[1:] != inside[:-1]):
            low, high = times[index], times[index + 1]
            for _ in range(30):
                middle = (low + high) / 2
                if bool(margins(satrec, sun_at, [middle])[which][0] < 0) == bool(inside[index]):
                    low = middle
                else:
                    high = middle
            found.append((high, names[int(inside[index])]))
    return sorted(found)


def sun_records():
    yield "# the Sun's direction (apparent, TEME), every 37 days from 2017"
    for index in range(120):
        unix_s = 1_483_228_800 + index * 37 * 86400 + index * 977
        x, y, z = sun_teme([float(unix_s)])[0]
        yield f"sun: {unix_s} {x:.0f} {y:.0f} {z:.0f}"
    yield ""
    start = 1_718_431_200
    # The geostationary orbit in the season of its eclipses, with an epoch of its own, is the orbit for 100 days later.
    for (name, (satrec, lines)), days, offset in zip(ORBITS, (1, 1, 1, 4, 4, 3, 4), (0, 0, 0, 0, 0, 92, 0), strict=True):
        yield f"# {name}"
        yield f"line1: {lines[0]}"
        yield f"line2: {lines[1]}"
        begin = start + offset * 86400
        yield f"window: {begin} {begin + days * 86400}"
        for when, edge in crossings(satrec, begin, begin + days * 86400):
            yield f"edge: {when:.3f} {edge}"
        yield ""


# --- files -------------------------------------------------------------------------------------------------------------

HEADER = "# Made by scripts/orbit_vectors.py: do not edit."
FILES = {"sgp4.txt": sgp4_records, "look.txt": look_records, "sun.txt": sun_records}


def same(ours, committed):
    if len(ours) != len(committed):
        return False
    for a, b in zip(ours, committed, strict=True):
        if a == b:
            continue
        words, others = a.split(), b.split()
        if len(words) != len(others):
            return False
        for word, other in zip(words, others, strict=True):
            try:
                if not math.isclose(float(word), float(other), rel_tol=1e-9, abs_tol=2e-7):
                    return False
            except ValueError:
                if word != other:
                    return False
    return True


def main():
    check_against_published()
    OUT.mkdir(parents=True, exist_ok=True)
    different = []
    for name, records in FILES.items():
        lines = [HEADER, "", *records()]
        text = "\n".join(lines).rstrip("\n") + "\n"
        path = OUT / name
        if "--check" not in sys.argv:
            path.write_text(text)
        elif not path.exists() or not same(text.splitlines(), path.read_text().splitlines()):
            different.append(name)
    if different:
        sys.exit(f"not what is committed: {', '.join(different)}")


if __name__ == "__main__":
    main()
