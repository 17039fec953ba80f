#!/usr/bin/env python3
"""Servers that are stopped and killed at random instants: nothing accepted, nothing acknowledged is lost."""
import http.client
import json
import random
import shutil
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

from served import Answer, Served, arguments, ask, connect, load, read_answer, render, request_bytes, require, sha256

CLIENTS = 6
REMEMBERED = 20  # results of former rounds that are looked at again in each


class Round:
    """What the clients of one server's life sent and were told."""

    def __init__(self, first_seed: int):
        self.seed = first_seed
        self.lock = threading.Lock()
        self.sent = 0
        self.answered = 0
        self.lost = []                          # sent before the signal, never answered
        self.results: dict[str, str] = {}       # id: hash of its picture, none for a job's
        self.jobs: dict[str, str] = {}          # id: where its job is
        self.signalled = float("inf")
        self.is_over = threading.Event()

    def next_seed(self) -> int:
        with self.lock:
            self.seed += 1
            return self.seed

    def acknowledged(self) -> int:
        with self.lock:
            return len(self.results)

    def note(self, answer: Answer, seed: int) -> None:
        require(answer.status in (200, 202, 503), f"{answer.status} for seed {seed}: {answer.body[:300]!r}")
        if answer.status == 503:
            return
        name = answer.headers["fstop-render-id"]
        self.results[name] = sha256(answer.body) if answer.status == 200 else ""
        if answer.status == 202:
            self.jobs[name] = answer.headers["location"]


def ask_until_over(port: int, round_: Round, number: int) -> None:
    """Asks for small renders, always on new connections, every third as a job."""
    headers = {"Prefer": "respond-async" if number % 3 == 0 else "wait=60"}
    while not round_.is_over.is_set():
        seed = round_.next_seed()
        wire = request_bytes("POST", "/v1/renders", json.dumps(render(seed)).encode(), headers)
        try:
            connection = connect(port)
        except OSError:
            return  # it listens no more
        with connection:
            sent_at = float("inf")
            try:
                connection.sendall(wire)
                sent_at = time.monotonic()
                answer = read_answer(connection)
            except (OSError, http.client.HTTPException):
                with round_.lock:
                    if sent_at < round_.signalled:
                        round_.lost.append(seed)
                return
        with round_.lock:
            round_.sent += 1
            round_.answered += 1
            round_.note(answer, seed)
        if number % 3 == 0:
            time.sleep(0.02)  # jobs are taken faster than they are made


def life(program: str, folder: Path, number: int, first_seed: int, dice: random.Random) -> tuple[Round, Served]:
    """A server, from its start to `number`, which comes at a random instant."""
    server = Served(program, folder, "--drain-s", "120")  # however busy the machine is
    round_ = Round(first_seed)
    clients = [threading.Thread(target=ask_until_over, args=(server.port, round_, i), daemon=True) for i in range(CLIENTS)]
    for client in clients:
        client.start()
    # Between two answers, as far from the start as the machine's other work lets them come.
    enough, end = dice.randrange(12), time.monotonic() + 60
    while round_.acknowledged() < enough and time.monotonic() < end:
        time.sleep(0.001)
    time.sleep(dice.uniform(0, 0.05))
    round_.signalled = time.monotonic()
    code = server.end(number)
    round_.is_over.set()
    for client in clients:
        client.join()
    require(code == (0 if number == signal.SIGTERM else -signal.SIGKILL), f"it ended with {code}: {server.errors()}")
    return round_, server


def missing(port: int, results: dict[str, str]) -> list[str]:
    """The ids of which the server no longer has the report, or has another picture."""
    gone = []
    for name, digest in results.items():
        report = ask(port, "GET", f"/v1/renders/{name}")
        picture = ask(port, "GET", f"/v1/renders/{name}/image")
        is_there = report.status == 200 and report.json()["id"] == name and picture.status == 200
        if not is_there or (digest and sha256(picture.body) != digest):
            gone.append(name)
    return gone


def unmade(port: int, jobs: dict[str, str]) -> list[str]:
    """The jobs that the next server does not know, or does not bring to their end."""
    lost = []
    end = time.monotonic() + 300
    for job in jobs.values():
        told = ask(port, "GET", job)
        while told.status == 200 and told.json()["state"] in ("queued", "running") and time.monotonic() < end:
            time.sleep(0.05)
            told = ask(port, "GET", job)
        if told.status != 200 or told.json()["state"] != "done" or ask(port, "GET", job + "/image").status != 200:
            lost.append(job)
    return lost


def campaign(program: str, number: int, rounds: int) -> None:
    name = signal.Signals(number).name
    folder = Path(tempfile.mkdtemp(prefix="fstop-campaign-"))
    dice = random.Random(number)
    everything: dict[str, str] = {}
    answered = jobs = seed = 0
    start = time.monotonic()
    try:
        for count in range(rounds):
            round_, server = life(program, folder, number, seed, dice)
            seed = round_.seed
            answered += round_.answered
            results = dict(round_.results)
            if number == signal.SIGTERM:
                late = len(server.events("drain_deadline"))
                require(not round_.lost, f"round {count}: {len(round_.lost)} requests were sent and never answered, "
                                         f"{late} drains too late so far")
            jobs += sum(not digest for digest in results.values())
            again = dict(dice.sample(sorted(everything.items()), min(REMEMBERED, len(everything))))
            after = Served(program, folder)
            try:
                lost = unmade(after.port, round_.jobs)
                require(not lost, f"round {count}: {len(lost)} jobs are lost, {lost[:3]}")
                gone = missing(after.port, {**again, **results})
                require(not gone, f"round {count}: {len(gone)} results are lost, {gone[:3]}")
                require(after.metric("fstop_cache_damaged_total") == 0, f"round {count}: a file is damaged")
                require(after.end() == 0, f"round {count}: the next server does not end well")
            finally:
                after.kill()
            everything.update(results)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    require(len(everything) > rounds, f"only {len(everything)} results in {rounds} rounds")
    print(f"{name}: {rounds} servers, {answered} requests answered, {len(everything)} results acknowledged "
          f"({jobs} of them as jobs), none lost; {time.monotonic() - start:.0f} s; {load()}")


def main() -> None:
    options = arguments(__doc__, ("count", 100, "of servers for each signal"))
    campaign(options.program, signal.SIGTERM, options.count)
    campaign(options.program, signal.SIGKILL, options.count)


if __name__ == "__main__":
    sys.exit(main())
