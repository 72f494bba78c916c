#!/usr/bin/env python3
"""Decodes every packet of KIT/frames.json in Python, with the parser that the Kaitai Struct compiler made (module
pixelsat, found by PYTHONPATH) and with space_packet_parser by KIT/pixelsat.xtce.xml, which is validated by the schema of
XTCE 1.2 before; compares field by field, and looks at KIT/tinygs-modem.json. Called by scripts/decoder-kit."""

import json
import math
import struct
import sys
import warnings
import zlib
from enum import IntEnum
from pathlib import Path

from kaitaistruct import KaitaiStructError
from pixelsat import Pixelsat
from space_packet_parser.xtce.definitions import XtcePacketDefinition
from space_packet_parser.xtce.validation import validate_xtce


class Report:
    """Counts what was compared and says what differs."""

    def __init__(self, reader):
        self.reader, self.values, self.differences = reader, 0, 0

    def differ(self, name, place, found, wanted):
        self.differences += 1
        print(f"{self.reader}: {name}: {place} is {found!r}, expected {wanted!r}", file=sys.stderr)

    def compare(self, name, place, found, wanted):
        self.values += 1
        if not same(found, wanted):
            self.differ(name, place, found, wanted)

    def close(self, what):
        print(f"{self.reader}: {what}, {self.values} values, {self.differences} differ")
        return self.differences == 0 and self.values > 0


def same(found, wanted):
    """Whether a value is the one that frames.json writes down."""
    if isinstance(found, bytes):
        return found.hex() == wanted
    if isinstance(found, float):
        wanted = float(wanted)
        return math.isnan(found) and math.isnan(wanted) or struct.pack(">d", found) == struct.pack(">d", wanted)
    return found == (int(wanted) if isinstance(wanted, str) and isinstance(found, int) else wanted)


def flat(value, place):
    """The path of every value in nested members and lists."""
    if isinstance(value, dict):
        for name, member in value.items():
            yield from flat(member, [*place, name])
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            yield from flat(entry, [*place, str(index)])
    else:
        yield place, value


def kaitai(frames):
    report = Report("python")

    def at(value, path):
        for step in path:
            value = dict(enumerate(value)).get(int(step)) if isinstance(value, list) else getattr(value, step, None)
        return value

    for frame in frames:
        name = frame["name"]
        try:
            packet = Pixelsat.from_bytes(bytes.fromhex(frame["hex"]))
        except (KaitaiStructError, EOFError) as refusal:
            packet = None
            if frame["ours"]:
                report.differ(name, "the packet", f"refused ({refusal})", "ours")
        if packet is None:
            continue
        if not frame["ours"]:
            report.differ(name, "the packet", "accepted", "refused")
            continue
        checked = [part for part in (packet.checked_short, packet.checked_full) if part is not None]
        kind = packet.packet_type
        report.compare(name, "module_header", packet.module_header, frame["module_header"])
        report.compare(name, "crc32", f"{packet.crc32:08x}", frame["crc32"])
        report.compare(name, "crc_ok", packet.crc32 in map(zlib.crc32, checked), frame["crc_ok"])
        report.compare(name, "packet_type", int(kind), frame["packet_type"])
        report.compare(name, "packet_type_name", kind.name if isinstance(kind, IntEnum) else None, frame["packet_type_name"])
        report.compare(name, "tag", packet.tag, frame["tag"])
        report.compare(name, "length", packet.length, frame["length"])
        report.compare(name, "rest", packet.rest, frame["rest"])
        if "payload_raw" in frame:
            report.compare(name, "payload", packet.payload, frame["payload_raw"])
        else:
            for path, wanted in flat(frame["payload"], []):
                found = at(packet.payload, path)
                report.compare(name, ".".join(path), int(found) if isinstance(found, IntEnum) else found, wanted)
    return report.close(f"{len(frames)} packets")


def xtce(path, frames):
    verdict = validate_xtce(path, level="all", raise_on_error=False, print_results=False, allow_schema_download=False)
    if not verdict.valid:
        print(f"xtce: {verdict}", file=sys.stderr)
        return False
    definition = XtcePacketDefinition.from_xtce(path)
    report = Report("xtce")
    # A full frame ends with padding, which is no part of a packet.
    warnings.simplefilter("ignore")
    read = 0
    for frame in frames:
        # XTCE knows no frame that was cut: only intact ones are for it.
        if not frame["ours"] or not frame["crc_ok"]:
            continue
        name = frame["name"]
        read += 1
        received = bytes.fromhex(frame["hex"])[len(frame["module_header"]) // 2 :]
        try:
            packet = definition.parse_bytes(received, root_container_name="received")
        except ValueError as refusal:
            report.differ(name, "the frame", f"refused ({refusal})", "read")
            continue
        report.compare(name, "crc32", f"{packet['crc32'].raw_value:08x}", frame["crc32"])
        for member in ("packet_type", "tag", "length"):
            report.compare(name, member, packet[member].raw_value, frame[member])
        if "payload" not in frame:
            continue
        expected = dict(flat_names(frame))
        found = set(packet) - {"magic", "crc32", "packet_type", "tag", "length"}
        for place in sorted(found ^ set(expected)):
            report.differ(name, place, "there" if place in found else "not there", "the other way round")
        for place in sorted(found & set(expected)):
            raw = packet[place].raw_value
            report.compare(name, place, raw, expected[place])
        for coded in ("code", "mode"):
            if frame.get(f"{coded}_name"):
                label = packet[f"{frame['packet_type_name']}_{coded}"]
                report.compare(name, f"{coded}_name", str(label).lower(), frame[f"{coded}_name"].replace("_", ""))
    return report.close(f"valid by the schema of XTCE 1.2; {read} intact frames")


def flat_names(frame):
    """The values of a payload under the names of the XTCE file."""
    for path, value in flat(frame["payload"], []):
        yield "_".join([frame["packet_type_name"], *path]), value


# What the modem JSON of TinyGS can say, and what is known of our satellite without a measurement.
CERTAIN = {"mode": "LoRa", "freq": 435.0, "sat": "PixelSat-I"}
MEASURED = {"bw", "sf", "cr", "sw", "pl", "crc", "fldro", "iIQ", "len"}
ASSIGNED = {"NORAD"}


def modem(path):
    told = json.loads(path.read_text(encoding="utf-8"))
    right = (
        told["modem"] == CERTAIN
        and set(told["to_be_measured"]) == MEASURED
        and set(told["to_be_assigned"]) == ASSIGNED
    )
    print(f"modem: {'only what is known' if right else 'not what is known'}, {len(MEASURED)} values to be measured")
    return right


def main(folder):
    kit = Path(folder)
    frames = json.loads((kit / "frames.json").read_text(encoding="utf-8"))["frames"]
    results = [kaitai(frames), xtce(kit / "pixelsat.xtce.xml", frames), modem(kit / "tinygs-modem.json")]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
