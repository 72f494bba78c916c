#!/usr/bin/env python3
"""A small client of PixelSat Ground: follow what happens, send a ping, fetch an image. Standard library alone.

    ground.py follow --after 0                 # events from the first one on, then live; Ctrl-C ends it
    ground.py --token data/token ping          # queue a Ping and tell each of its stages
    ground.py image 1 image.jpg                # the image as far as it is held

docs/api.md tells the rest.
"""

import argparse
import base64
import json
import os
import pathlib
import socket
import struct
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid


class Refused(Exception):
    """The server said no, and why (RFC 9457)."""


class Ground:
    def __init__(self, address, token=None):
        self.address = address.rstrip("/")
        self.token = token

    def ask(self, path, body=None, key=None):
        """Reads a path, or writes to it when there is a body. Returns headers and bytes."""
        request = urllib.request.Request(f"{self.address}/api/v1/{path}")
        if self.token:
            request.add_header("Authorization", f"Bearer {self.token}")
        if body is not None:
            # The same key for the same intent: asked twice, it is done once.
            request.add_header("Idempotency-Key", key or str(uuid.uuid4()))
            request.add_header("Content-Type", "application/json")
            request.data = json.dumps(body).encode()
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                return answer.headers, answer.read()
        except urllib.error.HTTPError as error:
            problem = json.loads(error.read())
            raise Refused(f"{problem['title']}: {problem['detail']} ({problem['type']})") from None

    def get(self, path):
        return json.loads(self.ask(path)[1])

    def post(self, path, body, key=None):
        return json.loads(self.ask(path, body, key)[1])

    def messages(self, after=None, topics="events"):
        """What the stream says, for ever; it comes back by itself and goes on after the last event."""
        waits = 0.5
        while True:
            try:
                for message in self._stream(after, topics):
                    waits = 0.5
                    if message["type"] == "hello" and (after is None or message["reset"]):
                        after = message["after"]
                    # One topic: each number comes once. With more, see docs/api.md on resuming.
                    after = message.get("sequence", after)
                    yield message
            except OSError as error:
                print(f"the server is away ({error}); again in {waits} s", file=sys.stderr)
            time.sleep(waits)
            waits = min(waits * 2, 8)

    def _stream(self, after, topics):
        """One connection: a WebSocket (RFC 6455), as far as this server needs it."""
        url = urllib.parse.urlsplit(self.address)
        query = {"topics": topics} | ({} if after is None else {"after": after})
        line = socket.create_connection((url.hostname, url.port or 80), timeout=40)
        with line, line.makefile("rb") as read:
            key = base64.b64encode(os.urandom(16)).decode()
            token = f"Authorization: Bearer {self.token}\r\n" if self.token else ""
            line.sendall(
                f"GET {url.path}/api/v1/stream?{urllib.parse.urlencode(query)} HTTP/1.1\r\n"
                f"Host: {url.netloc}\r\n{token}Connection: Upgrade\r\nUpgrade: websocket\r\n"
                f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode()
            )
            status = read.readline().decode()
            while read.readline().strip():
                pass
            if " 101 " not in status:
                raise OSError(f"the stream is refused: {status.strip()}")
            while True:
                head = read.read(2)
                if len(head) < 2:
                    raise OSError("the line broke")
                kind, length = head[0] & 15, head[1] & 127
                if length > 125:
                    form, size = (">H", 2) if length == 126 else (">Q", 8)
                    (length,) = struct.unpack(form, read.read(size))
                content = read.read(length)
                if kind == 1:
                    yield json.loads(content)
                elif kind == 8:
                    raise OSError(content[2:].decode() or "the server closed")
                elif kind == 9:  # ping: answered with the same content, masked as a client must
                    mask = os.urandom(4)
                    masked = bytes(byte ^ mask[at % 4] for at, byte in enumerate(content))
                    line.sendall(bytes([0x8A, 0x80 | len(content)]) + mask + masked)


def follow(ground, wanted):
    for message in ground.messages(after=wanted.after):
        if message["type"] == "event":
            print(f"{message['sequence']:6} {message['at']} {message['level']:8} {message['message']}", flush=True)
        if message["type"] == "live" and wanted.until_live:
            return


def ping(ground, wanted):
    stream = ground.messages(topics="commands")
    next(stream)  # hello: from here on nothing is missed
    done = ground.post("commands", {"command": "Ping"})
    print(f"command {done['command']} is queued", flush=True)
    for message in stream:
        if message["type"] == "command" and message["command"]["id"] == done["command"]:
            stage = message["command"]["stage"]
            print(f"{message['command']['stage_at']} {stage}", flush=True)
            if stage == "answered":
                return
            if stage in ("rejected", "failed", "expired", "cancelled", "unknown"):
                sys.exit(f"it was not answered: {stage}")


def image(ground, wanted):
    headers, content = ground.ask(f"images/{wanted.id}/file")
    pathlib.Path(wanted.file).write_bytes(content)
    whole = "whole" if headers["x-image-complete"] == "true" else "not whole yet"
    print(f"{wanted.file}: {len(content)} bytes, {whole}")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--server", default="http://127.0.0.1:8700", help="address of the server")
    arguments.add_argument("--token", type=pathlib.Path, help="a file with a token, for what not everybody may do")
    verbs = arguments.add_subparsers(required=True)
    verb = verbs.add_parser("follow", help="tell what happens")
    verb.add_argument("--after", type=int, help="begin after this event")
    verb.add_argument("--until-live", action="store_true", help="end when the archive is read")
    verb.set_defaults(do=follow)
    verb = verbs.add_parser("ping", help="send a Ping and wait for its answer")
    verb.set_defaults(do=ping)
    verb = verbs.add_parser("image", help="fetch the file of an image")
    verb.add_argument("id", type=int)
    verb.add_argument("file")
    verb.set_defaults(do=image)
    wanted = arguments.parse_args()
    token = wanted.token.read_text().strip() if wanted.token else None
    try:
        wanted.do(Ground(wanted.server, token), wanted)
    except Refused as problem:
        sys.exit(f"the server refuses: {problem}")
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
