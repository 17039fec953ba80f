#!/usr/bin/env python3
"""Clients that vanish in the middle: memory and descriptors come back to where they were."""

import json
import random
import sys
import time

from served import (MEBIBYTE, arguments, ask, connect, endless, load, read_answer, render, request_bytes, require, reset,
                    served, together)

AT_ONCE = 20
ALLOWED = 64 * MEBIBYTE

def vanish_from_render(port: int, seed: int, dice: random.Random) -> None:
    connection = connect(port)
    connection.sendall(request_bytes("POST", "/v1/renders", json.dumps(endless(seed)).encode(), {"Prefer": "wait=600"}))
    time.sleep(dice.uniform(0, 0.3))
    reset(connection)

def vanish_from_upload(port: int, seed: int, dice: random.Random) -> None:
    size = dice.randrange(1, 8 * MEBIBYTE)
    wire = request_bytes("PUT", "/v1/scenes/half", dice.randbytes(size), {"Content-Type": "application/zip"})
    connection = connect(port)
    try:
        connection.sendall(wire[:dice.randrange(len(wire))])
    except ConnectionError:
        pass  # refused, for there are too many at once
    reset(connection)

def vanish_from_events(port: int, seed: int, dice: random.Random) -> None:
    answer = ask(port, "POST", "/v1/renders", endless(seed), {"Prefer": "respond-async"})
    if answer.status != 202:
        require(answer.status in (429, 503), f"{answer.status} for a job: {answer.body[:300]!r}")
        return
    job = answer.headers["location"]
    connection = connect(port)
    connection.sendall(request_bytes("GET", job + "/events"))
    connection.recv(4096)
    time.sleep(dice.uniform(0, 0.2))
    reset(connection)
    # The job is its own client: it is withdrawn by another one.
    require(ask(port, "DELETE", job).status == 204, "a job is withdrawn")

def vanish_from_picture(port: int, seed: int, dice: random.Random) -> None:
    """Asks for a picture again and again and never reads it."""
    connection = connect(port)
    big = request_bytes("POST", "/v1/renders", json.dumps(render(1, 960, 640, quality={"samples": 1})).encode(),
                        {"Prefer": "wait=60", "Accept": "image/x-exr"})
    try:
        connection.sendall(big * 8)
    except ConnectionError:
        pass
    time.sleep(dice.uniform(0, 0.2))
    reset(connection)

def vanish_from_head(port: int, seed: int, dice: random.Random) -> None:
    connection = connect(port)
    wire = request_bytes("POST", "/v1/optics", b"{}")
    connection.sendall(wire[:dice.randrange(len(wire))])
    reset(connection)

WAYS = [vanish_from_render, vanish_from_upload, vanish_from_events, vanish_from_picture, vanish_from_head]

def settled(server) -> tuple[int, int]:
    """Memory and descriptors once all has ended."""
    server.wait_until_idle()
    for _ in range(100):
        if server.metric("fstop_connections") == 0:
            break
        time.sleep(0.1)
    time.sleep(0.5)
    return server.memory(), server.descriptors()

def main() -> None:
    options = arguments(__doc__, ("count", 500, "of clients"))
    with served(options.program) as server:
        def vanish(first: int, count: int) -> None:
            def client(number: int) -> None:
                for seed in range(first + number, first + count, AT_ONCE):
                    WAYS[seed % len(WAYS)](server.port, seed, random.Random(seed))
            together(AT_ONCE, client)

        fresh = server.memory()
        vanish(0, 2 * AT_ONCE)  # what is taken once and kept: threads, caches, the one picture
        memory, descriptors = settled(server)
        start = time.monotonic()
        vanish(1000, options.count)
        most = server.memory()
        seconds = time.monotonic() - start
        for _ in range(20):
            memory_after, descriptors_after = settled(server)
            if memory_after <= memory + ALLOWED and descriptors_after <= descriptors:
                break
        server.require_clean_end()
    growth = (memory_after - memory) / MEBIBYTE
    print(f"vanish: {options.count} clients, memory {memory / MEBIBYTE:.0f} MiB before (fresh {fresh / MEBIBYTE:.0f}), "
          f"{most / MEBIBYTE:.0f} at the end, {growth:+.1f} MiB once idle; descriptors {descriptors} before, "
          f"{descriptors_after} after; {seconds:.0f} s; {load()}")
    require(memory_after <= memory + ALLOWED, "memory does not come back")
    require(descriptors_after <= descriptors, "descriptors do not come back")

if __name__ == "__main__":
    sys.exit(main())
