#!/usr/bin/env python3
"""Decodes the packets of a file with the parser that the Kaitai Struct compiler made of docs/decoder/pixelsat.ksy
(module pixelsat, found by PYTHONPATH), as a script of a student would: JSON, base64, checksum, every field. Prints how
many packets, how many frames of ours among them, and the seconds. Called by scripts/bench-import."""

import base64
import json
import sys
import time
import zlib

from pixelsat import Pixelsat


def fields(value):
    """How many values a packet holds; looks at each of them."""
    count = 0
    for name, member in vars(value).items():
        if name.startswith("_"):
            continue
        count += fields(member) if hasattr(member, "_io") else 1
    return count


def main(path):
    packets = frames = values = 0
    began = time.perf_counter()
    with open(path, encoding="utf-8") as lines:
        for line in lines:
            packets += 1
            message = json.loads(line[line.index("{") :])
            packet = Pixelsat.from_bytes(base64.b64decode(message["data"]))
            if packet.length <= packet.available and zlib.crc32(packet.checked_short) == packet.crc32:
                frames += 1
                values += fields(packet)
    print(json.dumps({"packets": packets, "frames": frames, "values": values, "seconds": time.perf_counter() - began}))


if __name__ == "__main__":
    main(sys.argv[1])
