"""What the campaigns of the queue share: nats-server, workers and `fstop serve --queue` as processes, sweeps."""
import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

from served import HOST, Served, ask, render, require, sha256


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind((HOST, 0))
        return listener.getsockname()[1]


def cpu_s(process: int) -> float:
    """Processor seconds of a process so far, all its threads; 0 of one that has gone."""
    with contextlib.suppress(OSError):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


class Nats:
    """A nats-server with JetStream on the loopback, its store in a folder."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.port = free_port()
        self.url = f"nats://{HOST}:{self.port}"
        self.start()

    def start(self) -> None:
        with open(self.folder / "nats.log", "ab") as log:
            self.process = subprocess.Popen(
                ["nats-server", "-js", "-sd", self.folder / "nats", "-a", HOST, "-p", str(self.port)],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        for _ in range(2000):
            with contextlib.suppress(OSError), socket.create_connection((HOST, self.port), 1):
                return
            time.sleep(0.005)
        require(False, "nats-server does not start")

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()


class Worker:
    """`fstop worker` on one thread; started again on demand, its log goes on."""

    def __init__(self, cluster: "Cluster", name: str):
        self.cluster, self.log = cluster, cluster.folder / f"worker-{name}.log"
        self.start()

    def start(self) -> None:
        cluster = self.cluster
        with open(self.log, "ab") as log:
            self.process = subprocess.Popen(
                [cluster.program, "worker", "--queue", cluster.nats.url, "--results", cluster.url, "--threads", "1",
                 "--scenes-dir", cluster.folder / "data/scenes", *cluster.worker_arguments],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def events(self, name: str) -> list[dict]:
        """The log's lines of this kind; a kill may have cut one."""
        found = []
        for line in self.log.read_text(errors="replace").splitlines():
            with contextlib.suppress(json.JSONDecodeError):
                if f'"{name}"' in line:
                    found.append(json.loads(line))
        return found


class Cluster:
    """A server with a queue and its workers; goes away with its folder."""

    def __init__(self, program: str, workers: int, ack_wait_s: float = 3, worker_arguments: tuple = (),
                 folder: Path | None = None):
        self.program, self.ack_wait_s, self.worker_arguments = program, ack_wait_s, worker_arguments
        self.folder = folder or Path(tempfile.mkdtemp(prefix="fstop-campaign-"))
        self.nats = Nats(self.folder)
        self.port = free_port()
        self.url = f"http://{HOST}:{self.port}"
        self.serve()
        self.workers = [Worker(self, str(i)) for i in range(workers)]

    def serve(self) -> None:
        self.server = Served(self.program, self.folder, "--queue", self.nats.url, "--ack-wait-s",
                             str(self.ack_wait_s), port=self.port)

    def close(self) -> None:
        for worker in self.workers:
            worker.kill()
        self.server.kill()
        self.nats.kill()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def recipe(cells: int, samples: int, width: int = 48, height: int = 32, first: int = 1) -> dict:
    """So many images that differ in their seed alone."""
    base = render(0, width, height, quality={"samples": samples, "method": "lens-sampling"})
    return {"base": base, "axes": [{"member": "/seed", "values": list(range(first, first + cells))}]}


def begin(port: int, sweep: dict) -> str:
    """Asks for a sweep; the path of its job."""
    answer = ask(port, "POST", "/v1/sweeps", sweep)
    require(answer.status == 202, f"{answer.status}: {answer.body[:500]!r}")
    return answer.headers["location"]


def begun_sweep(port: int, sweep: dict) -> str:
    """Asks for a sweep; its id."""
    answer = ask(port, "POST", "/v1/sweeps", sweep)
    require(answer.status in (200, 202), f"{answer.status}: {answer.body[:500]!r}")
    return answer.json()["sweep"]


def until_done(cluster: Cluster, sweep: str, each_second=lambda second: None, patience_s: float = 600) -> bytes:
    """The manifest, once it is there. The server may be away meanwhile."""
    start, seconds = time.monotonic(), 0
    while time.monotonic() - start < patience_s:
        time.sleep(0.05)
        if time.monotonic() - start > seconds + 1:
            seconds += 1
            each_second(seconds)
        with contextlib.suppress(OSError):
            answer = ask(cluster.port, "GET", f"/v1/sweeps/{sweep}/manifest")
            if answer.status == 200:
                return answer.body
    require(False, f"the sweep is not done after {patience_s} s")
    return b""


def require_whole(cluster: Cluster, manifest: bytes, cells: int) -> None:
    """Every cell is there once, and every file is what the manifest says."""
    told = json.loads(manifest)
    require(not told["failures"], f"{len(told['failures'])} cells failed: {told['failures'][:1]}")
    require([image["id"] for image in told["images"]] == list(range(cells)), "cells are missing or there twice")
    for file in told["files"]:
        answer = ask(cluster.port, "GET", f"/v1/files/{file['sha256']}")
        require(answer.status == 200 and len(answer.body) == file["bytes"] and
                sha256(answer.body) == file["sha256"], f"file {file['path']} is not what the manifest says")


def ended(process: subprocess.Popen, number: int = signal.SIGTERM, patience_s: float = 60) -> int:
    """The exit code after this signal."""
    process.send_signal(number)
    return process.wait(patience_s)
