#!/usr/bin/env python3
"""How fast /livez answers while 32 clients render and 1,000 dawdle: p99 below 2 ms, p99.9 below 10 ms."""
import gc
import json
import multiprocessing
import os
import sys
import threading
import time

from served import arguments, connect, load, quantile, read_answer, render, request_bytes, require, served

ADDRESSES = 8  # of the loopback: as many clients to the server
PAUSE_S = 0.002


def render_without_end(port: int, number: int) -> None:
    """One client that renders, each time something new."""
    seed = 1_000_000 * number
    while True:
        seed += 1
        wanted = render(seed, 480, 320, scene="still-life", quality={"samples": 16})
        connection = connect(port, f"127.0.0.{2 + number % ADDRESSES}")
        with connection:
            connection.sendall(request_bytes("POST", "/v1/renders", json.dumps(wanted).encode(), {"Prefer": "wait=600"}))
            read_answer(connection)


def dawdle(port: int, slow: int, renders: int, told) -> None:
    """All the load, in a process of its own: renders, and connections that send a byte now and then.

    It runs on the server's processors where real clients have their own: it yields to the server and the prober."""
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    for number in range(renders):
        threading.Thread(target=render_without_end, args=(port, number), daemon=True).start()
    wire = b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: " + b"a" * 4000
    connections = {}

    def renew(number: int) -> None:
        connections[number] = (connect(port, f"127.0.0.{2 + number % ADDRESSES}"), [0])
        connections[number][0].setblocking(False)
    for number in range(slow):
        renew(number)
    told.set()
    while True:
        for number in range(slow):
            connection, at = connections[number]
            try:
                connection.send(wire[at[0]:at[0] + 1])
                at[0] += 1
                connection.recv(4096)  # 408 and its end come here
                connection.close()
                renew(number)
            except BlockingIOError:
                pass
            except OSError:
                connection.close()
                renew(number)
            if number % 100 == 0:
                time.sleep(0.1)


def probe(port: int, seconds: float, answers) -> None:
    """One prober, as an orchestrator's, but 500 times a second."""
    gc.disable()
    times, errors = [], 0
    wire = request_bytes("GET", "/livez")
    connection = connect(port)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        start = time.perf_counter()
        connection.sendall(wire)
        reply = connection.recv(65536)
        times.append(time.perf_counter() - start)
        if not reply.startswith(b"HTTP/1.1 200") or not reply.rstrip().endswith(b'{"status":"alive"}'):
            errors += 1
        time.sleep(PAUSE_S)
    answers.put((times, errors))


def main() -> None:
    options = arguments(__doc__, ("seconds", 30, "of probing"), ("slow", 1000, "connections that dawdle"),
                        ("renders", 32, "clients that render"))
    with served(options.program, "--queued-renders", "256") as server:
        ready = multiprocessing.Event()
        crowd = multiprocessing.Process(target=dawdle, args=(server.port, options.slow, options.renders, ready), daemon=True)
        crowd.start()
        require(ready.wait(60), "the load comes up")
        time.sleep(1)
        busy = server.metric("fstop_renders_running") + server.metric("fstop_renders_queued")
        connections = server.metric("fstop_connections")
        answers = multiprocessing.Queue()
        prober = multiprocessing.Process(target=probe, args=(server.probe_port, options.seconds, answers), daemon=True)
        prober.start()
        times, errors = answers.get(timeout=options.seconds + 60)
        prober.join()
        during = server.metric("fstop_connections")
        crowd.terminate()
        crowd.join()
        # What is left of the renders is of no use: the clients are gone.
        server.wait_until_idle()
        server.require_clean_end()
    p50, p99, p999 = (1e3 * quantile(times, q) for q in (0.5, 0.99, 0.999))
    print(f"probes: {len(times)} of /livez, {errors} errors, p50 {p50:.2f} ms, p99 {p99:.2f} ms, p99.9 {p999:.2f} ms, most "
          f"{1e3 * max(times):.1f} ms; beside {connections:.0f} to {during:.0f} connections and {busy:.0f} renders "
          f"running or waiting; {load()}")
    require(errors == 0, "probes fail")
    require(connections >= options.slow, "all the slow connections are there")
    require(p99 < 2 and p999 < 10, "probes wait")


if __name__ == "__main__":
    sys.exit(main())
