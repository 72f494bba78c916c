#!/usr/bin/env python3
"""A satellite that is not ours: docs/icd.md in another language, on a pseudo-terminal of its own.

    satellite.py LINK --key-file KEY [--period S] [--frame S] [--image FILE]

It shares no line with the project's crates. It sends heartbeats, answers Ping, GetImageInfo and GetImageChunk, says
MalformedPacket to everything else, and tells on standard output what it does, one JSON object a line. Needs Python and
its `cryptography`; docs/foreign-satellite.md shows the server's side.
"""

import argparse
import errno
import json
import os
import select
import struct
import sys
import time
import tty
import zlib

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

# ICD, sections 3, 4 and 6.
PING, GET_IMAGE_INFO, GET_IMAGE_CHUNK = 0, 1, 2
PONG, ERROR, IMAGE_INFO, IMAGE_CHUNK, HEARTBEAT = 0, 1, 2, 3, 6
MALFORMED_PACKET, CRC_FAILED, CAMERA_FAILURE = 1, 2, 34
CHUNK = 222


def say(what, **facts):
    print(json.dumps({"what": what, **facts}), flush=True)


def frame(kind, payload=b"", tag=0, full=False):
    """A downlink frame: magic, CRC of the contents, contents (a header of 4 bytes, then the payload)."""
    contents = struct.pack(">BBH", kind, tag, len(payload)) + payload
    if full:
        contents = contents.ljust(228, b"\0")
    return b"PIXELSAT" + struct.pack(">I", zlib.crc32(contents)) + contents


def heartbeat(uptime_ms):
    position, velocity = (6878.0, 12.5, -3.25), (0.0, 7.5, 1.0)
    rest = [0.0] * (3 + 3 + 3 + 6 + 3)
    floats = [*position, *velocity, *rest, 0.5, 17.25]
    payload = struct.pack(">26fIQ?", *floats, uptime_ms & 0xFFFFFFFF, 0, True)
    assert len(payload) == 117
    return frame(HEARTBEAT, payload)


class Satellite:
    def __init__(self, key, image, period_s, frame_s):
        self.gcm = AESGCM(key)
        self.image = image
        self.chunks = -(-len(image) // CHUNK)
        self.period_s, self.frame_s = period_s, frame_s
        self.highest = 0
        self.began = time.monotonic()
        self.next_beat = self.began + 1.0
        self.outbox = []
        self.free_at = self.began
        self.heard = b""

    def next_frame(self, now):
        """The next frame to send; a due heartbeat goes between two answers."""
        if now < self.free_at:
            return None
        if now >= self.next_beat:
            self.next_beat += self.period_s
            say("heartbeat")
            sending = heartbeat(int((now - self.began) * 1000))
        elif self.outbox:
            sending = self.outbox.pop(0)
        else:
            return None
        self.free_at = now + self.frame_s
        return sending

    def hear(self, data):
        """Bytes of the uplink: every magic with 232 bytes behind it is a candidate, the tag of GCM decides."""
        self.heard = (self.heard + data)[-4096:]
        while (at := self.heard.find(b"DESTINY_")) >= 0 and len(self.heard) >= at + 240:
            sealed, self.heard = self.heard[at : at + 240], self.heard[at + 240 :]
            self.uplink(sealed)

    def uplink(self, sealed):
        crc, nonce = struct.unpack(">I", sealed[8:12])[0], sealed[12:24]
        counter = struct.unpack(">Q", nonce[:8])[0]
        try:
            plain = self.gcm.decrypt(nonce, sealed[24:], None)
        except InvalidTag:
            return say("refused", why="authentication")
        if counter <= self.highest:
            return say("refused", why="counter", counter=counter)
        self.highest = counter
        kind, tag, length = struct.unpack(">BBH", plain[:4])
        if zlib.crc32(plain) != crc:
            return self.answer(ERROR, bytes([CRC_FAILED]), tag)
        payload = plain[4 : 4 + length]
        say("accepted", type=kind, tag=tag, counter=counter, payload=payload.hex())
        if kind == PING and not payload:
            self.answer(PONG, b"", tag)
        elif kind == GET_IMAGE_INFO and not payload:
            info = struct.pack(">?IIHH", bool(self.image), self.chunks, len(self.image), 64, 48)
            self.answer(IMAGE_INFO, info, tag, full=True)
        elif kind == GET_IMAGE_CHUNK and len(payload) == 4:
            first, count = struct.unpack(">HH", payload)
            wanted = range(first, min(first + count, self.chunks))
            for index in wanted:
                data = self.image[index * CHUNK : (index + 1) * CHUNK].ljust(CHUNK, b"\0")
                self.answer(IMAGE_CHUNK, struct.pack(">H", index) + data, tag)
            if not wanted:
                self.answer(ERROR, bytes([MALFORMED_PACKET if self.image else CAMERA_FAILURE]), tag)
        else:
            self.answer(ERROR, bytes([MALFORMED_PACKET]), tag)

    def answer(self, kind, payload, tag, full=False):
        self.outbox.append(frame(kind, payload, tag, full))


def open_port(link):
    """A pseudo-terminal, raw, behind a link. Its other end stays closed on our side: a ground may come and go."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    device = os.ttyname(theirs)
    os.close(theirs)
    os.set_blocking(ours, False)
    if os.path.islink(link):
        os.remove(link)
    os.symlink(device, link)
    return ours


def read(port):
    try:
        return os.read(port, 1024)
    except BlockingIOError:
        return b""
    except OSError as error:
        if error.errno != errno.EIO:
            raise
        time.sleep(0.05)  # nobody has the other end open
        return b""


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("link")
    arguments.add_argument("--key-file", required=True, help="a line of 32 hex digits; other lines are left alone")
    arguments.add_argument("--period", type=float, default=60.0, help="seconds between heartbeats")
    arguments.add_argument("--frame", type=float, default=1.2, help="seconds that a frame is on the air")
    arguments.add_argument("--image", help="the file that it offers as its image")
    given = arguments.parse_args()
    with open(given.key_file, encoding="ascii") as lines:
        key = next(bytes.fromhex(line) for line in lines if len(line.strip()) == 32 and line[0] != "#")
    image = b""
    if given.image:
        with open(given.image, "rb") as file:
            image = file.read()

    satellite = Satellite(key, image, given.period, given.frame)
    port = open_port(given.link)
    say("ready", link=given.link, chunks=satellite.chunks)
    while True:
        readable, _, _ = select.select([port], [], [], 0.02)
        if readable:
            satellite.hear(read(port))
        sending = satellite.next_frame(time.monotonic())
        if sending:
            try:
                os.write(port, sending)
            except (BlockingIOError, OSError):
                pass  # nobody listens: it goes into the air


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(0)
