#!/usr/bin/env python3
"""Requests with bytes changed at random: no crash, no report of a sanitizer, no leak, never a 500."""
import collections
import io
import itertools
import json
import random
import re
import sys
import threading
import time
import zipfile

from served import (OPTICS, SCENE, arguments, connect, load, render, request_bytes, require, reset, served,
                    together)

CLIENTS = 48
PATIENCE_S = 0.2  # then it gets no more bytes, which is an answer to what waits for more
PIECES = [b"\r\n", b"\r\n\r\n", b"\0", b": ", b"chunked", b"0\r\n\r\n", b"Content-Length: 3\r\n", b"%00", b"../", b'"',
          b"{", b"]", b"1e999", b"-0", b"HTTP/1.1", b"\xff", b"PUT ", b"Transfer-Encoding: chunked\r\n", b"null"]
SWEEP = {"base": render(1), "axes": [
    {"member": "/camera/lens/f_number", "range": {"from": 1.4, "to": 8, "spacing": "third-stop"}},
    {"member": "/seed", "values": [1, 2]}], "combine": "cross", "seed": 3, "dry_run": True}
PSF = {"camera": {"lens": {"f_number": 8}}, "object_distance_m": 3}


def archive() -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as files:
        files.writestr("scene.json", json.dumps(SCENE))
    return out.getvalue()


def seeds() -> list[bytes]:
    optics = json.dumps(OPTICS).encode()
    chunks = b"%x;a=b\r\n%s\r\n%x\r\n%s\r\n0\r\n\r\n" % (20, optics[:20], len(optics) - 20, optics[20:])
    bounded = render(1, quality={"samples": 1, "max_time_ms": 20})
    inline = {**bounded, "scene": SCENE}
    chunked = request_bytes("GET", "/v1/optics", b"", {"Content-Type": "application/json",
                                                       "Transfer-Encoding": "chunked"})
    job = "/v1/jobs/0123456789abcdef0123456789abcdef"
    return [
        request_bytes("GET", "/"), request_bytes("GET", "/v1/scenes/tiny"), request_bytes("OPTIONS", "*"),
        request_bytes("GET", job + "/events", headers={"Last-Event-ID": "3"}), request_bytes("DELETE", job),
        request_bytes("GET", "/v1/renders/" + "0" * 64 + "/image?format=exr", headers={"If-None-Match": '"a"'}),
        request_bytes("POST", "/v1/optics", optics), chunked.replace(b"GET", b"POST", 1) + chunks,
        request_bytes("POST", "/v1/renders", json.dumps(bounded).encode(),
                      {"Prefer": "wait=1", "Idempotency-Key": "k", "Fstop-Deadline-Ms": "2000"}),
        request_bytes("POST", "/v1/renders", json.dumps(inline).encode(), {"Prefer": "respond-async"}),
        request_bytes("POST", "/v1/sweeps", json.dumps(SWEEP).encode()),
        request_bytes("GET", "/v1/sweeps/" + "0" * 64 + "/files/" + "0" * 64),
        request_bytes("POST", "/v1/psf", json.dumps(PSF).encode(), {"Accept": "application/json"}),
    ]


def mutated(data: bytes, dice: random.Random) -> bytes:
    """Anywhere, or within the body alone, whose length then is told."""
    head, _, body = data.partition(b"\r\n\r\n")
    if body and b"Content-Length" in head and dice.randrange(2):
        body = changed(body, dice)
        return re.sub(rb"Content-Length: \d+", b"Content-Length: %d" % len(body), head) + b"\r\n\r\n" + body
    return changed(data, dice)


def changed(data: bytes, dice: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(dice.randint(1, 4)):
        if not out:
            break
        at = dice.randrange(len(out))
        kind = dice.randrange(6)
        if kind == 0:
            out[at] = dice.randrange(256)
        elif kind == 1:
            del out[at:at + dice.randint(1, 8)]
        elif kind == 2:
            out[at:at] = dice.choice(PIECES)
        elif kind == 3:
            out[at:at] = out[at:at + dice.randint(1, 40)]
        elif kind == 4:
            out[at] ^= 1 << dice.randrange(8)
        else:
            del out[at:]
    return bytes(out)


def status_of(port: int, wire: bytes) -> int:
    """Of the first reply; 0 where the connection ends without one."""
    with connect(port, timeout_s=PATIENCE_S) as connection:
        reply = b""
        try:
            connection.sendall(wire)
            try:
                reply = connection.recv(65536)
            except TimeoutError:
                connection.shutdown(1)
                connection.settimeout(PATIENCE_S * 1000)  # readers of uploads give way to all else
                reply = connection.recv(65536)
        except (ConnectionError, OSError) as error:
            require(not isinstance(error, TimeoutError), f"no end to {wire!r}")
        reset(connection)
    require(not reply or reply.startswith(b"HTTP/1.1 "), f"{reply[:80]!r} answers {wire!r}")
    return int(reply[9:12]) if reply else 0


def main() -> None:
    options = arguments(__doc__, ("count", 100_000, "of requests"), ("uploads", 1, "of 100 that send a scene"))
    statuses = collections.Counter()
    lock = threading.Lock()
    numbers = itertools.count()
    wires = seeds()
    upload = request_bytes("PUT", "/v1/scenes/sent", archive(), {"Content-Type": "application/zip"})

    with served(options.program) as server:
        def client(_: int) -> None:
            while (number := next(numbers)) < options.count:
                dice = random.Random(number)
                is_upload = dice.randrange(100) < options.uploads
                wire = mutated(upload if is_upload else dice.choice(wires), dice)
                status = status_of(server.port, wire)
                with lock:
                    statuses[status] += 1
                require(status != 500, f"500 for request {number}, {wire!r}")

        start = time.monotonic()
        together(CLIENTS, client)
        seconds = time.monotonic() - start
        # What has begun ends before leaks are looked for.
        server.wait_until_idle()
        crashes = [event for event in server.events("scene_reader_ended") if event["exit_code"] > 128 and not event["timed_out"]]
        require(not crashes, f"the reader of scenes crashed: {crashes}")
        answered = options.count - statuses[0]
        require(sum(statuses.values()) == options.count, "every request was sent")
        require(answered > options.count / 2, f"only {answered} were answered")
        require(len([s for s in statuses if 200 <= s < 300]) > 0, "some mutants are still requests")
        server.require_clean_end()
    told = ", ".join(f"{status or 'none'}: {count}" for status, count in sorted(statuses.items()))
    print(f"mutations: {options.count} requests, {answered} answered, no 500, no crash, no report; {seconds:.0f} s; {load()}")
    print(f"  by status: {told}")


if __name__ == "__main__":
    sys.exit(main())
