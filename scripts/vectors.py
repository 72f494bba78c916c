#!/usr/bin/env python3
"""Makes the known answers of the radio link: protocol/vectors/*.txt.

Written from docs/icd.md with struct, zlib and cryptography, and never from the crate it checks, so that an
encoder and a decoder cannot agree on a mistake.

    scripts/vectors.py            write the files
    scripts/vectors.py --check    make them again and compare with what is committed (exit code 1 if they differ)

A file is a list of records, separated by blank lines; a line is `key: value`, and what follows ` # ` is a remark for
people. Fields of a payload are `field: name @offset+length kind:value unit`; floats are given by their bits.
"""

import hashlib
import math
import random
import struct
import sys
import zlib
from pathlib import Path

from cryptography.hazmat.primitives.ciphers.aead import AESGCM

OUT = Path(__file__).resolve().parent.parent / "protocol" / "vectors"
NAN, INF = float("nan"), float("inf")


# --- scalars -------------------------------------------------------------------------------------------------------


class Payload:
    """A payload under construction, and the lines that tell its fields."""

    def __init__(self):
        self.bytes = b""
        self.lines = []

    def add(self, name, raw, kind, shown, unit="", remark=""):
        line = f"field: {name} @{len(self.bytes)}+{len(raw)} {kind}:{shown}"
        if unit:
            line += f" {unit}"
        if remark:
            line += f" # {remark}"
        self.lines.append(line)
        self.bytes += raw
        return self

    def u(self, name, size, value, unit=""):
        return self.add(name, value.to_bytes(size, "big"), "u", value, unit)

    def flag(self, name, value):
        return self.add(name, bytes([value]), "bool", int(value))

    def f(self, name, value, unit=""):
        raw = value if isinstance(value, bytes) else struct.pack(">f", value)
        decimal = struct.unpack(">f", raw)[0]
        return self.add(name, raw, "f32", raw.hex(), unit, repr(decimal))

    def vec(self, name, values, unit="", parts="xyz"):
        for part, value in zip(parts, values, strict=True):
            self.f(f"{name}.{part}", value, unit)
        return self

    def raw(self, name, value, remark=""):
        return self.add(name, value, "bytes", value.hex(), "", remark)


CSS = ["plus_x", "minus_x", "plus_y", "minus_y", "plus_z", "minus_z"]


# --- frames --------------------------------------------------------------------------------------------------------


def down_frame(packet_type, tag, payload, form, length=None, padding=None):
    length = len(payload) if length is None else length
    contents = struct.pack(">BBH", packet_type, tag, length) + payload
    if form == "full":
        contents += bytes(228 - len(contents)) if padding is None else padding
        assert len(contents) == 228
    return b"PIXELSAT" + struct.pack(">I", zlib.crc32(contents)) + contents


def up_plaintext(packet_type, tag, payload, padding, length=None):
    length = len(payload) if length is None else length
    text = struct.pack(">BBH", packet_type, tag, length) + payload
    return text + padding[len(text) : 200]


def up_frame(key, nonce, plaintext, crc=None):
    crc = zlib.crc32(plaintext) if crc is None else crc
    sealed = AESGCM(key).encrypt(nonce, plaintext, None)
    frame = b"DESTINY_" + struct.pack(">I", crc) + nonce + sealed
    assert len(frame) == 240
    return frame


def record(**pairs):
    lines = []
    for key, value in pairs.items():
        if key == "fields":
            lines += value
        else:
            lines.append(f"{key}: {value}")
    return "\n".join(lines)


# --- downlink ------------------------------------------------------------------------------------------------------


def pong():
    return Payload()


def error(code):
    return Payload().u("code", 1, code)


def image_info(exists, chunks, size, width, height):
    p = Payload().flag("exists", exists).u("chunks", 4, chunks).u("image_size", 4, size, "B")
    return p.u("res_x", 2, width, "px").u("res_y", 2, height, "px")


def image_chunk(index, data):
    assert len(data) == 222
    return Payload().u("index", 2, index).raw("data", data)


def heartbeat(vectors, css, att, rad, temp, uptime, timestamp, cam):
    r, v, mag, omega, accel = vectors
    p = Payload().vec("r_teme", r, "km").vec("v_teme", v, "km/s").vec("mag", mag, "T").vec("omega", omega, "rad/s")
    p.vec("accel", accel, "m/s²").vec("css", css, "", CSS).vec("att", att, "MRP").f("rad", rad).f("temp", temp, "°C")
    p.u("uptime", 4, uptime, "ms").u("timestamp", 8, timestamp, "ms").flag("cam", cam)
    assert len(p.bytes) == 117
    return p


def adcs_info(uptime, mode, estimator, controller, vectors, css):
    gyro, mag, accel, attitude, rate, bias, target, err, torque = vectors
    p = Payload().u("uptime", 4, uptime, "ms").u("mode", 1, mode)
    p.u("estimator_status", 2, estimator).u("controller_status", 2, controller)
    p.vec("gyro", gyro, "rad/s").vec("mag", mag, "T").vec("accel", accel, "m/s²").vec("css", css, "", CSS)
    p.vec("attitude", attitude, "MRP").vec("angular_velocity", rate, "rad/s").vec("gyro_bias", bias, "rad/s")
    p.vec("target_attitude", target, "MRP").vec("attitude_error", err, "MRP").vec("commanded_torque", torque, "N·m")
    assert len(p.bytes) == 141
    return p


def schedule_info(entries, next_ms):
    return Payload().u("entries", 1, entries).u("next", 8, next_ms, "ms")


def mode_report(model, mode, substate, triggers, in_mode, no_comm, boots, left, battery):
    p = Payload().u("model", 1, model).u("mode", 1, mode).u("substate", 1, substate).u("triggers", 4, triggers)
    p.u("in_mode", 4, in_mode, "s").u("no_comm", 4, no_comm, "s").u("boots", 4, boots)
    p.u("schedule_left", 2, left).f("battery", battery, "V")
    assert len(p.bytes) == 25
    return p


def event_report(events):
    p = Payload().u("count", 1, len(events))
    for i, (sequence, time, code, argument) in enumerate(events):
        p.u(f"[{i}]event.sequence", 4, sequence).u(f"[{i}]event.time", 8, time, "ms")
        p.u(f"[{i}]event.code", 1, code).u(f"[{i}]event.argument", 4, argument)
    return p


def numbers(seed, count, scale=1.0):
    rng = random.Random(seed)
    return [rng.uniform(-scale, scale) for _ in range(count)]


def triples(seed, count):
    flat = numbers(seed, 3 * count)
    return [flat[i : i + 3] for i in range(0, 3 * count, 3)]


def downlink():
    rng = random.Random("image")
    hb_vectors = [[6778.25, -1234.5, 0.125], [-1.5, 7.25, 0.5], [2.5e-5, -3.1e-5, 1.25e-6], [0.01, -0.02, 0.003], [0.0, -0.0, 9.81]]
    bad_vectors = [[NAN, INF, -INF], [0.0] * 3, [b"\x7f\x80\x00\x01", b"\xff\xff\xff\xff", b"\x00\x00\x00\x01"], [3.4e38, -3.4e38, 1e-45], [NAN] * 3]
    packets = {
        "pong": (0, [("empty", pong())]),
        "error": (1, [(f"code_{c}", error(c)) for c in [1, 2, 3, 4, *range(16, 24), *range(32, 37), 0, 5, 200, 255]]),
        "image_info": (
            2,
            [
                ("cif", image_info(True, 91, 20_000, 408, 304)),
                ("none_while_capturing", image_info(False, 0, 0, 0, 0)),
                ("largest", image_info(True, 0xFFFFFFFF, 0xFFFFFFFF, 0xFFFF, 0xFFFF)),
                ("inconsistent_chunks", image_info(True, 90, 20_000, 818, 610)),
            ],
        ),
        "image_chunk": (
            3,
            [
                ("first", image_chunk(0, bytes(i % 251 for i in range(222)))),
                ("random_65535", image_chunk(65_535, rng.randbytes(222))),
                ("last_zero_padded", image_chunk(258, b"\xff\xd9" + bytes(220))),
                ("holds_a_whole_frame", image_chunk(7, (b"##" + down_frame(0, 0, b"", "short")).ljust(222, b"#"))),
            ],
        ),
        "adcs_info": (
            4,
            [
                ("tracking", adcs_info(86_400_000, 2, 0x0102, 0xFFFE, triples("adcs", 9), numbers("css", 6))),
                ("failed_sensors", adcs_info(0xFFFFFFFF, 9, 0, 0, [[NAN, INF, -INF]] * 9, [NAN] * 6)),
            ],
        ),
        "schedule_info": (5, [("two", schedule_info(2, 1_800_000_000_123)), ("empty", schedule_info(0, 0))]),
        "heartbeat": (
            6,
            [
                ("nominal", heartbeat(hb_vectors, numbers("hb", 6), [0.1, -0.2, 0.3], 0.75, -12.5, 123_456_789, 1_800_000_000_000, True)),
                ("no_clock_failed_sensors", heartbeat(bad_vectors, [INF] * 6, [NAN, 0.0, NAN], NAN, -INF, 0, 0, False)),
                ("extremes", heartbeat([[1.0] * 3] * 5, [0.0] * 6, [1.0] * 3, 1.0, 1.0, 0xFFFFFFFF, 2**64 - 1, True)),
            ],
        ),
        "mode_report": (0x40, [("chess_safe", mode_report(1, 5, 1, 0x00000101, 3600, 7200, 42, 3, 7.5)), ("hermes", mode_report(2, 1, 255, 0, 0, 0, 1, 0xFFFF, NAN))]),
        "event_report": (
            0x41,
            [
                ("none", event_report([])),
                ("one", event_report([(1, 1_800_000_000_000, 7, 0xDEADBEEF)])),
                ("thirteen", event_report([(1000 + i, 1_800_000_000_000 + 500 * i, i, 2**32 - 1 - i) for i in range(13)])),
            ],
        ),
        "unknown": (0x3F, [("no_payload", Payload())]),
    }
    for kind, (packet_type, cases) in packets.items():
        records = []
        for n, (name, payload) in enumerate(cases):
            for form in ["short", "full"]:
                tag = (17 * n) % 256
                frame = down_frame(packet_type, tag, payload.bytes, form)
                records.append(
                    record(
                        name=f"{kind}/{name}/{form}",
                        type=packet_type,
                        tag=tag,
                        length=len(payload.bytes),
                        form="full" if len(frame) == 240 else "short",
                        crc32=frame[8:12].hex(),
                        fields=payload.lines,
                        frame=frame.hex(),
                    )
                )
        yield f"down_{kind}.txt", records


def malformed_down():
    """Frames that are no frames (`frame_error`), and intact frames whose payload breaks the rules (`payload_error`)."""
    records = []

    def bad_frame(name, frame, error):
        records.append(record(name=name, frame_error=error, frame=frame.hex()))

    def bad_payload(name, frame, error):
        records.append(record(name=name, payload_error=error, frame=frame.hex()))

    good = down_frame(0, 1, b"", "short")
    full = down_frame(0, 1, b"", "full")
    bad_frame("empty", b"", "length")
    bad_frame("fifteen_bytes", good[:15], "length")
    bad_frame("short_with_a_byte_behind", good + b"\0", "length")
    bad_frame("full_cut_by_one", full[:-1], "length")
    bad_frame("full_with_a_byte_behind", full + b"\0", "length")
    bad_frame("magic_in_lower_case", b"pixelsat" + good[8:], "magic")
    bad_frame("magic_of_the_uplink", b"DESTINY_" + good[8:], "magic")
    bad_frame("crc_of_zero", good[:8] + bytes(4) + good[12:], "crc")
    bad_frame("crc_in_little_endian", good[:8] + good[8:12][::-1] + good[12:], "crc")
    bad_frame("flip_in_padding", full[:-1] + b"\x01", "crc")
    bad_frame("one_bit_in_the_tag", good[:13] + b"\x03" + good[14:], "crc")

    bad_payload("header_length_225", down_frame(3, 0, bytes(224), "full", 225), "header_length")
    bad_payload("header_length_65535", down_frame(6, 0, bytes(117), "full", 65535), "header_length")
    bad_payload("pong_with_a_byte", down_frame(0, 0, b"\0", "short"), "length")
    bad_payload("error_without_code", down_frame(1, 0, b"", "short"), "length")
    bad_payload("error_with_two_codes", down_frame(1, 0, b"\1\2", "short"), "length")
    bad_payload("image_info_of_12", down_frame(2, 0, bytes(12), "short"), "length")
    bad_payload("image_info_exists_2", down_frame(2, 0, b"\2" + bytes(12), "short"), "bool")
    bad_payload("image_chunk_of_223", down_frame(3, 0, bytes(223), "full"), "length")
    bad_payload("adcs_info_of_142", down_frame(4, 0, bytes(142), "short"), "length")
    bad_payload("schedule_info_of_8", down_frame(5, 0, bytes(8), "short"), "length")
    bad_payload("heartbeat_of_113", down_frame(6, 0, bytes(113), "short"), "heartbeat_layout")
    bad_payload("heartbeat_of_118", down_frame(6, 0, bytes(118), "full"), "heartbeat_layout")
    bad_payload("heartbeat_cam_255", down_frame(6, 0, bytes(116) + b"\xff", "full"), "bool")
    bad_payload("mode_report_of_24", down_frame(0x40, 0, bytes(24), "short"), "length")
    bad_payload("event_report_empty", down_frame(0x41, 0, b"", "short"), "length")
    bad_payload("event_report_of_14", down_frame(0x41, 0, b"\x0e" + bytes(223), "full"), "count")
    bad_payload("event_report_count_too_small", down_frame(0x41, 0, b"\0" + bytes(17), "short"), "length")
    rng = random.Random("padding")
    records.append(record(name="full_with_junk_as_padding", payload_error="none", frame=down_frame(0, 9, b"", "full", padding=rng.randbytes(224)).hex()))
    yield "malformed_down.txt", records


# --- uplink --------------------------------------------------------------------------------------------------------

LINE_1 = b"1 00000U 27001A   27074.50000000  .00001234  00000+0  12345-3 0  9993"
LINE_2 = b"2 00000  97.5000 123.4567 0001234  90.0000 270.0000 15.20000000    17"


def count_list(name, entries):
    """A list of payload makers after its count; names get their index."""
    p = Payload().u("n", 1, len(entries))
    return entries_after(p, entries)


def entries_after(p, entries):
    for i, entry in enumerate(entries):
        for line in entry.lines:
            key, name, at, rest = line.split(" ", 3)
            offset, length = at[1:].split("+")
            p.lines.append(f"{key} [{i}]{name} @{len(p.bytes) + int(offset)}+{length} {rest}")
        p.bytes += entry.bytes
    return p


def torque_step(torque, duration):
    return Payload().vec("step.torque", torque, "N·m").u("step.duration", 4, duration, "ms")


def slot(time, first, count, attitude):
    p = Payload().u("slot.time", 8, time, "ms").u("slot.first", 2, first).u("slot.count", 2, count)
    return p.vec("slot.attitude", attitude, "MRP")


def chunk_range(first, count):
    return Payload().u("range.first", 2, first).u("range.count", 2, count)


def schedule_entry(time, script, argument):
    return Payload().u("entry.time", 8, time, "ms").u("entry.script", 1, script).vec("entry.argument", argument, "", "012")


def script_step(offset, command, argument, expect, timeout, on_fail):
    p = Payload().u("step.offset", 4, offset, "ms").u("step.command", 1, command).vec("step.argument", argument, "", "012")
    return p.u("step.expect", 1, expect).u("step.timeout", 4, timeout, "ms").u("step.on_fail", 1, on_fail)


def upload_schedule(schedule, part, parts, entries):
    crc = zlib.crc32(b"".join(e.bytes for e in entries))
    p = Payload().u("schedule", 1, schedule).u("part", 1, part).u("parts", 1, parts).u("n", 1, len(entries))
    return entries_after(p.u("entries_crc32", 4, crc), entries)


def upload_script(script, part, parts, steps):
    p = Payload().u("script", 1, script).u("part", 1, part).u("parts", 1, parts).u("n", 1, len(steps))
    return entries_after(p, steps)


def guidance(id_, actuator, start, coefficients):
    p = Payload().u("id", 1, id_).u("actuator", 1, actuator).u("degree", 1, len(coefficients) - 1).u("start", 8, start, "ms")
    return entries_after(p, [Payload().vec("coefficient", c) for c in coefficients])


def lines(one, two):
    return Payload().raw("line_1", one, one.decode()).raw("line_2", two, two.decode())


NO_ATTITUDE = [b"\x7f\xc0\x00\x00"] * 3


def uplink():
    t = 1_800_000_000_000
    steps = [torque_step(v, 50_000) for v in triples("torque", 12)]
    slots = [slot(t + 60_000 * i, 100 * i, 64, v) for i, v in enumerate(triples("slot", 7))] + [slot(t + 10**6, 65535, 65535, NO_ATTITUDE)]
    entries = [schedule_entry(t + i, i, v) for i, v in enumerate(triples("entry", 8))]
    script = [script_step(1000 * i, i, v, 255 - i, 5000, 2) for i, v in enumerate(triples("script", 8))]
    return {
        "ping": (0, [("empty", Payload())]),
        "get_image_info": (1, [("empty", Payload())]),
        "get_image_chunk": (2, [("paper_example", Payload().u("first", 2, 1).u("count", 2, 2)), ("largest", Payload().u("first", 2, 65535).u("count", 2, 65535))]),
        "reset": (3, [("empty", Payload())]),
        "execute_torque_profile": (4, [("none", count_list("step", [])), ("twelve_600_s", count_list("step", steps))]),
        "get_adcs_info": (5, [("empty", Payload())]),
        "capture_image": (6, [(f"resolution_{r}_flags_{f}", Payload().u("resolution", 1, r).u("flags", 1, f)) for r, f in [(0, 0), (1, 1), (0, 2), (1, 3)]]),
        "set_downlink_schedule": (7, [("clear", count_list("slot", [])), ("eight_last_without_attitude", count_list("slot", slots))]),
        "set_adcs_omega_kill": (8, [("empty", Payload())]),
        "set_adcs_attitude": (9, [("some", Payload().vec("attitude", [0.25, -0.5, 1.0], "MRP"))]),
        "set_adcs_target": (10, [("vienna", Payload().f("latitude", 48.2, "deg").f("longitude", 16.37, "deg")), ("corner", Payload().f("latitude", -90.0, "deg").f("longitude", 180.0, "deg"))]),
        "set_adcs_auto": (11, [("empty", Payload())]),
        "set_timestamp": (12, [("some", Payload().u("utc", 8, t, "ms")), ("largest", Payload().u("utc", 8, 2**64 - 1, "ms"))]),
        "set_tle": (13, [("made_up", lines(LINE_1, LINE_2))]),
        "get_image_ranges": (14, [("none", count_list("range", [])), ("two", count_list("range", [chunk_range(5, 1), chunk_range(0, 3)])), ("forty_eight", count_list("range", [chunk_range(10 * i, i + 1) for i in range(48)]))]),
        "set_transmitter": (15, [("off", Payload().flag("on", False)), ("on", Payload().flag("on", True))]),
        "set_mode": (0x40, [("go_to_safe_com", Payload().u("mode", 1, 5).u("substate", 1, 1)), ("no_substate", Payload().u("mode", 1, 1).u("substate", 1, 255))]),
        "upload_schedule": (0x41, [("none", upload_schedule(1, 0, 1, [])), ("eight", upload_schedule(3, 1, 2, entries))]),
        "get_mode_report": (0x42, [("empty", Payload())]),
        "set_parameter": (0x43, [("some", Payload().u("parameter", 1, 12).f("value", -0.0))]),
        "upload_script": (0x44, [("none", upload_script(0, 0, 1, [])), ("eight", upload_script(9, 2, 3, script))]),
        "get_events": (0x45, [("some", Payload().u("first", 4, 4_000_000_000))]),
        "upload_guidance": (0x46, [("constant", guidance(1, 0, t, triples("g0", 1))), ("quintic", guidance(255, 1, t, triples("g5", 6)))]),
    }


def up_record(name, key, nonce, padding, packet_type, tag, payload, fields):
    plaintext = up_plaintext(packet_type, tag, payload, padding)
    frame = up_frame(key, nonce, plaintext)
    return record(
        name=name,
        key=key.hex(),
        key_id=hashlib.sha256(key).hexdigest()[:8],
        counter=int.from_bytes(nonce[:8], "big"),
        nonce=nonce.hex(),
        type=packet_type,
        tag=tag,
        length=len(payload),
        crc32=frame[8:12].hex(),
        fields=fields,
        padding=padding.hex(),
        plaintext=plaintext.hex(),
        gcm_tag=frame[-16:].hex(),
        frame=frame.hex(),
    )


def sealed():
    rng = random.Random("uplink")
    for kind, (packet_type, cases) in uplink().items():
        records = []
        for name, payload in cases:
            key, padding = rng.randbytes(16), rng.randbytes(200)
            nonce = rng.randbytes(12)
            tag = rng.randrange(1, 256)
            records.append(up_record(f"{kind}/{name}", key, nonce, padding, packet_type, tag, payload.bytes, payload.lines))
        yield f"up_{kind}.txt", records


def malformed_up():
    """Authentic uplinks that break a rule (`payload_error`, `crc_error`), and frames that do not open (`open_error`)."""
    rng = random.Random("malformed uplink")
    records = []

    def sealed_case(name, error, packet_type, payload, length=None, tag=5):
        key, nonce, padding = rng.randbytes(16), rng.randbytes(12), rng.randbytes(200)
        frame = up_frame(key, nonce, up_plaintext(packet_type, tag, payload, padding, length))
        records.append(record(name=name, key=key.hex(), payload_error=error, frame=frame.hex()))

    f = lambda *values: b"".join(struct.pack(">f", v) for v in values)  # noqa: E731
    step = lambda ms: f(0, 0, 0) + struct.pack(">I", ms)  # noqa: E731
    slot_bytes = lambda ms, *mrp: struct.pack(">QHH", ms, 0, 1) + f(*mrp)  # noqa: E731
    utf8 = "ü".encode()
    sealed_case("header_length_197", "header_length", 0, b"", 197)
    sealed_case("header_length_65535", "header_length", 0, b"", 65535)
    sealed_case("unknown_type_16", "unknown_telecommand", 16, b"")
    sealed_case("unknown_type_71", "unknown_telecommand", 0x47, b"")
    sealed_case("ping_with_a_byte", "length", 0, b"\0")
    sealed_case("reset_of_196", "length", 3, bytes(196))
    sealed_case("get_image_chunk_of_3", "length", 2, bytes(3))
    sealed_case("get_image_chunk_of_5", "length", 2, bytes(5))
    sealed_case("torque_without_count", "length", 4, b"")
    sealed_case("torque_count_1_without_step", "length", 4, b"\1")
    sealed_case("torque_of_13", "count", 4, b"\x0d" + bytes(195))
    sealed_case("torque_over_600_s", "duration", 4, b"\2" + step(600_000) + step(1))
    sealed_case("torque_sum_over_u32", "duration", 4, b"\2" + step(0xFFFFFFFF) * 2)
    sealed_case("torque_nan", "not_finite", 4, b"\1" + f(0, NAN, 0) + bytes(4))
    sealed_case("capture_resolution_2", "range", 6, b"\2\0")
    sealed_case("capture_flag_4", "range", 6, b"\0\4")
    sealed_case("schedule_of_9", "count", 7, b"\x09" + bytes(195))
    sealed_case("schedule_equal_times", "order", 7, b"\2" + slot_bytes(5, 0, 0, 0) * 2)
    sealed_case("schedule_descending", "order", 7, b"\2" + slot_bytes(5, 0, 0, 0) + slot_bytes(4, 0, 0, 0))
    sealed_case("schedule_one_nan_of_three", "not_finite", 7, b"\1" + slot_bytes(5, NAN, 0, 0))
    sealed_case("schedule_infinity", "not_finite", 7, b"\1" + slot_bytes(5, INF, INF, INF))
    sealed_case("schedule_other_nan_is_no_attitude", "none", 7, b"\1" + slot_bytes(5, 0, 0, 0)[:12] + b"\xff\xc0\x00\x01" * 3)
    sealed_case("attitude_infinity", "not_finite", 9, f(0, 0, -INF))
    sealed_case("target_nan", "not_finite", 10, f(NAN, 0))
    sealed_case("target_latitude_90_5", "range", 10, f(90.5, 0))
    sealed_case("target_longitude_minus_181", "range", 10, f(0, -181))
    sealed_case("timestamp_of_4", "length", 12, bytes(4))
    sealed_case("tle_of_137", "length", 13, (LINE_1 + LINE_2)[:-1])
    sealed_case("tle_with_line_end", "text", 13, LINE_1 + b"\n" + LINE_2[:-1])
    sealed_case("tle_with_utf8_text", "text", 13, LINE_1[:10] + utf8 + LINE_1[12:] + LINE_2)
    sealed_case("ranges_of_49", "count", 14, b"\x31" + bytes(195))
    sealed_case("ranges_count_too_large", "length", 14, b"\2" + bytes(4))
    sealed_case("transmitter_2", "bool", 15, b"\2")
    sealed_case("schedule_upload_part_2_of_2", "range", 0x41, bytes([1, 2, 2, 0]) + bytes(4))
    sealed_case("schedule_upload_of_9", "count", 0x41, bytes([1, 0, 1, 9]) + bytes(192))
    sealed_case("schedule_upload_nan", "not_finite", 0x41, bytes([1, 0, 1, 1]) + bytes(4) + bytes(9) + f(NAN, NAN, NAN))
    sealed_case("script_upload_part_0_of_0", "range", 0x44, bytes([1, 0, 0, 0]))
    sealed_case("script_upload_of_3", "length", 0x44, bytes([1, 0, 1]))
    sealed_case("parameter_infinity", "not_finite", 0x43, b"\0" + f(INF))
    sealed_case("guidance_degree_6", "range", 0x46, bytes([1, 0, 6]) + bytes(8 + 7 * 12))
    sealed_case("guidance_degree_1_with_one", "length", 0x46, bytes([1, 0, 1]) + bytes(8 + 12))
    sealed_case("tag_0_still_opens", "none", 0, b"", tag=0)

    key, nonce, padding = rng.randbytes(16), rng.randbytes(12), rng.randbytes(200)
    plaintext = up_plaintext(0, 1, b"", padding)
    good = up_frame(key, nonce, plaintext)
    records.append(record(name="crc_of_other_text", key=key.hex(), crc_error="mismatch", frame=up_frame(key, nonce, plaintext, 0x12345678).hex()))
    records.append(record(name="crc_field_flipped_on_the_way", key=key.hex(), crc_error="mismatch", frame=(good[:8] + bytes([good[8] ^ 1]) + good[9:]).hex()))
    for name, at in [("nonce_flipped", 12), ("ciphertext_flipped", 24), ("last_ciphertext_byte_flipped", 223), ("tag_flipped", 224), ("last_byte_flipped", 239)]:
        bad = bytearray(good)
        bad[at] ^= 0x80
        records.append(record(name=name, key=key.hex(), open_error="authentication", frame=bytes(bad).hex()))
    records.append(record(name="other_key", key=bytes(16).hex(), open_error="authentication", frame=good.hex()))
    yield "malformed_up.txt", records


# --- files ---------------------------------------------------------------------------------------------------------

HEAD = "# Made by scripts/vectors.py; do not edit. UTF-8.\n\n"


def files():
    assert zlib.crc32(b"123456789") == 0xCBF43926
    assert math.isnan(NAN) and len(LINE_1) == len(LINE_2) == 69
    for part in [downlink, malformed_down, sealed, malformed_up]:
        for name, records in part():
            yield name, HEAD + "\n\n".join(records) + "\n"


def main(argv):
    made = dict(files())
    if argv == ["--check"]:
        held = {path.name: path.read_text(encoding="utf-8") for path in OUT.glob("*.txt")}
        different = sorted(name for name in made.keys() | held.keys() if made.get(name) != held.get(name))
        for name in different:
            print(f"{OUT / name} differs from what this script makes", file=sys.stderr)
        print(f"{len(made)} vector files, {sum(t.count('name: ') for t in made.values())} records, {len(different)} differ")
        return 1 if different else 0
    if argv:
        print(__doc__, file=sys.stderr)
        return 2
    OUT.mkdir(parents=True, exist_ok=True)
    for stale in OUT.glob("*.txt"):
        stale.unlink()
    for name, text in made.items():
        (OUT / name).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
