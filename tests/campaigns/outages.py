#!/usr/bin/env python3
"""In the midst of a sweep: the disk full, the results store gone, the queue gone for 30 s. It waits, says for what, goes on."""
import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from cluster import Cluster, begun_sweep, recipe, require_whole, until_done
from served import arguments, ask, load, require

CELLS = 300


def waits(cluster: Cluster) -> set[str]:
    """What workers have said they wait for."""
    return {event["for"] for worker in cluster.workers for event in worker.events("waiting")}


def job_waits(cluster: Cluster, sweep: str) -> str:
    with contextlib.suppress(OSError):
        answer = ask(cluster.port, "GET", f"/v1/sweeps/{sweep}")
        if answer.status == 200:
            return answer.json().get("waiting_for", "")
    return ""


def until(holds, what: str, patience_s: float = 60) -> None:
    end = time.monotonic() + patience_s
    while not holds():
        require(time.monotonic() < end, what)
        time.sleep(0.05)


def through(cluster: Cluster, outage) -> bytes:
    """The manifest of a sweep that `outage(cluster, sweep)` befalls once a third is done."""
    sweep = begun_sweep(cluster.port, recipe(CELLS, 256))
    until(lambda: sum(len(worker.events("cell_done")) for worker in cluster.workers) > CELLS // 3,
          "no third is done")
    outage(cluster, sweep)
    manifest = until_done(cluster, sweep)
    require_whole(cluster, manifest, CELLS)
    begun = [event["cell"] for worker in cluster.workers for event in worker.events("cell_begun")]
    require(len(set(begun)) == CELLS, "cells were not begun")
    return manifest


def nats_gone(seconds: float):
    def outage(cluster: Cluster, sweep: str) -> None:
        cluster.nats.kill()
        until(lambda: "queue" in job_waits(cluster, sweep), "the job does not say that it waits for the queue")
        print(f"  the job waits for {job_waits(cluster, sweep)!r}, workers for {sorted(waits(cluster))}")
        time.sleep(seconds)
        cluster.nats.start()
    return outage


def store_gone(seconds: float):
    def outage(cluster: Cluster, sweep: str) -> None:
        require(cluster.server.end(signal.SIGKILL) == -signal.SIGKILL, "the server had ended before")
        until(lambda: any("results store" in what for what in waits(cluster)), "no worker waits for the store")
        print(f"  workers wait for {sorted(waits(cluster))}")
        time.sleep(seconds)
        cluster.serve()
    return outage


def disk_full(cluster: Cluster, sweep: str) -> None:
    ballast = cluster.folder / "data/ballast"
    size = shutil.disk_usage(cluster.folder / "data").free
    with contextlib.suppress(OSError), open(ballast, "wb") as file:
        while size > 0:
            size -= file.write(b"\0" * 4096)
            file.flush()
    until(lambda: any("disk space" in what for what in waits(cluster)), "no worker waits for disk space")
    until(lambda: "disk space" in job_waits(cluster, sweep), "the job does not say that it waits for disk space")
    print(f"  the job waits for {job_waits(cluster, sweep)!r}, workers for {sorted(waits(cluster))}")
    time.sleep(5)
    ballast.unlink()


@contextlib.contextmanager
def small_disk(mebibytes: int):
    """A folder whose data/ is a file system of its own."""
    folder = Path(tempfile.mkdtemp(prefix="fstop-campaign-"))
    data = folder / "data"
    data.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={mebibytes}m", "tmpfs", data],
                             check=False, capture_output=True).returncode == 0
    try:
        yield folder if mounted else None
    finally:
        if mounted:
            subprocess.run(["umount", data], check=False)
        shutil.rmtree(folder, ignore_errors=True)


def main() -> None:
    options = arguments(__doc__, ("away", 30.0, "seconds that the queue is gone"))
    manifests = []
    for name, outage in (("queue gone", nats_gone(options.away)), ("results store gone", store_gone(5))):
        start = time.monotonic()
        with Cluster(options.program, 2) as cluster:
            manifests.append(through(cluster, outage))
        print(f"{name}: {CELLS} cells, nothing lost, {time.monotonic() - start:.0f} s; {load()}", flush=True)
    with small_disk(64) as folder:
        if folder is None:
            print(f"disk full: not tried, a tmpfs cannot be mounted here (uid {os.getuid()})")
        else:
            start = time.monotonic()
            with Cluster(options.program, 2, folder=folder) as cluster:
                manifests.append(through(cluster, disk_full))
            print(f"disk full: {CELLS} cells, nothing lost, {time.monotonic() - start:.0f} s; {load()}", flush=True)
    require(len(set(manifests)) == 1, "manifests differ")


if __name__ == "__main__":
    sys.exit(main())
