#!/usr/bin/env python3
"""Mixed load for minutes: the memory stays flat, its slope after the warm-up below 1 MiB in ten minutes."""
import collections
import contextlib
import json
import random
import sys
import threading
import time

from mutations import archive, mutated, seeds, status_of
from served import (MEBIBYTE, OPTICS, arguments, ask, connect, endless, load, render, request_bytes, require, reset,
                    served, slope)

CLIENTS = 6
ALLOWED = MEBIBYTE  # in ten minutes
ROUND_S = 20.0
REST_S = 1.5  # idle workers give memory back after a second


class Load:
    """What one client does, one thing after the other, at random."""

    def __init__(self, port: int, number: int, counts: collections.Counter):
        self.port = port
        self.dice = random.Random(number)
        self.counts = counts
        self.wires = seeds()
        self.archive = archive()
        self.seed = 10_000_000 * (number + 1)

    def fresh_seed(self) -> int:
        self.seed += 1
        return self.seed

    def a_new_render(self):
        answer = ask(self.port, "POST", "/v1/renders", render(self.fresh_seed()), {"Prefer": "wait=60"})
        return answer.status, (200, 429, 503)

    def a_finished_render(self):
        answer = ask(self.port, "POST", "/v1/renders", render(self.dice.randrange(20)), {"Prefer": "wait=60"})
        if answer.status != 200:
            return answer.status, (429, 503)
        name = answer.headers["fstop-render-id"]
        form = self.dice.choice(["png", "jpeg", "webp", "tiff", "exr"])
        return ask(self.port, "GET", f"/v1/renders/{name}/image?format={form}").status, (200,)

    def optics(self):
        return ask(self.port, "POST", "/v1/optics", OPTICS).status, (200,)

    def a_point(self):
        body = {**OPTICS, "object_distance_m": 3, "image": {"width": 32, "height": 32}}
        return ask(self.port, "POST", "/v1/psf", body, {"Accept": "image/png"}).status, (200, 503)

    def a_job_withdrawn(self):
        answer = ask(self.port, "POST", "/v1/renders", endless(self.fresh_seed()), {"Prefer": "respond-async"})
        if answer.status != 202:
            return answer.status, (429, 503)
        job = answer.headers["location"]
        with connect(self.port) as connection:
            connection.sendall(request_bytes("GET", job + "/events"))
            connection.recv(4096)
        return ask(self.port, "DELETE", job).status, (204,)

    def a_client_that_vanishes(self):
        connection = connect(self.port)
        connection.sendall(request_bytes("POST", "/v1/renders", json.dumps(endless(self.fresh_seed())).encode()))
        time.sleep(self.dice.uniform(0, 0.1))
        reset(connection)
        return 204, (204,)

    def an_upload(self):
        name = f"/v1/scenes/sent-{self.dice.randrange(4)}"
        answer = ask(self.port, "PUT", name, self.archive, {"Content-Type": "application/zip"})
        return answer.status, (200, 201, 422, 503)  # 422: it had no time, beside all else

    def a_bad_request(self):
        status = status_of(self.port, mutated(self.dice.choice(self.wires), self.dice))
        return status, [status] if status != 500 else ()

    def a_page(self):
        return ask(self.port, "GET", self.dice.choice(["/docs", "/openapi.json", "/metrics", "/v1/scenes"])).status, (200,)

    def run(self, pauses: "Pauses") -> None:
        kinds = [(self.a_new_render, 3), (self.a_finished_render, 6), (self.optics, 6), (self.a_point, 1),
                 (self.a_job_withdrawn, 1), (self.a_client_that_vanishes, 1), (self.an_upload, 1),
                 (self.a_bad_request, 4), (self.a_page, 2)]
        while pauses.go_on():
            work = self.dice.choices([kind for kind, _ in kinds], [weight for _, weight in kinds])[0]
            status, expected = work()
            require(status in expected, f"{status} for {work.__name__}")
            self.counts[work.__name__] += 1
            time.sleep(self.dice.uniform(0, 0.05))


class Pauses:
    """All clients rest at once from time to time: memory is told then, what requests use comes and goes."""

    def __init__(self, clients: int):
        self.barrier = threading.Barrier(clients + 1)
        self.rests = threading.Event()
        self.is_over = threading.Event()

    def go_on(self) -> bool:
        """A client asks between two requests, and waits while all rest."""
        if self.rests.is_set():
            self.barrier.wait()  # here it rests
            self.barrier.wait()  # here it goes on
        return not self.is_over.is_set()

    def at_rest(self, measure):
        self.rests.set()
        self.barrier.wait()
        measured = measure()
        self.rests.clear()
        self.barrier.wait()
        return measured

    def end(self) -> None:
        self.is_over.set()
        self.barrier.abort()


def main() -> None:
    options = arguments(__doc__, ("minutes", 10.0, "of load, a third of them warm-up"))
    counts = collections.Counter()
    failures = []
    samples = []
    pauses = Pauses(CLIENTS)
    # Bounds that are reached within the warm-up, so that what is kept does not grow any more.
    with served(options.program, "--memory-mib", "8", "--cache-mib", "16") as server:
        def client(number: int) -> None:
            try:
                Load(server.port, number, counts).run(pauses)
            except threading.BrokenBarrierError:
                pass
            except BaseException as failure:  # also SystemExit of require()
                failures.append(failure)
                pauses.end()

        def memory() -> int:
            server.wait_until_idle()
            time.sleep(REST_S)
            return server.memory_asked_for()
        clients = [threading.Thread(target=client, args=(number,), daemon=True) for number in range(CLIENTS)]
        start = time.monotonic()
        for thread in clients:
            thread.start()
        with contextlib.suppress(threading.BrokenBarrierError):
            while time.monotonic() - start < 60 * options.minutes:
                pauses.is_over.wait(ROUND_S)
                samples.append((time.monotonic() - start, pauses.at_rest(memory)))
        evicted = server.metric("fstop_cache_evicted_total") if not failures else 0
        pauses.end()
        for thread in clients:
            thread.join()
        if failures:
            raise failures[0]
        server.wait_until_idle()
        server.require_clean_end()
    flat = [(at, memory) for at, memory in samples if at > 20 * options.minutes]
    growth = 600 * slope(flat) / MEBIBYTE
    memories = [memory / MEBIBYTE for _, memory in flat]
    print(f"soak: {options.minutes:g} min, {sum(counts.values())} requests ("
          + ", ".join(f"{name}: {count}" for name, count in sorted(counts.items()))
          + f"), {evicted:.0f} results evicted; memory at rest {min(memories):.1f} to {max(memories):.1f} MiB after the "
            f"warm-up, slope {growth:+.2f} MiB in 10 min; {load()}")
    print("memory at rest, MiB: " + " ".join(f"{memory / MEBIBYTE:.1f}" for _, memory in samples))
    require(growth < ALLOWED / MEBIBYTE, "memory grows")


if __name__ == "__main__":
    sys.exit(main())
