#!/usr/bin/env python3
"""Sweeps by 1, 2, 4 workers of one thread each: images per second, and what broker, store and workers spend on each."""
import json
import os
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "campaigns"))

from cluster import Cluster, begun_sweep, cpu_s, recipe, until_done  # noqa: E402
from served import arguments, load  # noqa: E402


def timed(cluster: Cluster, cells: int, samples: int, first: int) -> dict:
    """One sweep: wall seconds from its first cell to its last outcome, processor seconds of everybody meanwhile."""
    sweep = recipe(cells, samples, first=first)
    everybody = {"broker": [cluster.nats.process.pid], "store": cluster.server.processes(),
                 "workers": [worker.process.pid for worker in cluster.workers]}
    before = {name: sum(map(cpu_s, processes)) for name, processes in everybody.items()}
    start = time.monotonic()
    until_done(cluster, begun_sweep(cluster.port, sweep), patience_s=1800)
    wall = time.monotonic() - start
    return {"wall_s": wall, "per_s": cells / wall,
            **{name: sum(map(cpu_s, processes)) - before[name] for name, processes in everybody.items()}}


def measured(program: str, workers: int, cells: int, samples: int, repeats: int) -> list[dict]:
    with Cluster(program, workers, 30) as cluster:
        timed(cluster, 4 * workers, samples, 1_000_000)  # scenes are read
        return [timed(cluster, cells, samples, 1 + cells * i) for i in range(repeats)]


def main() -> None:
    options = arguments(__doc__, ("cells", 200, "of each sweep"), ("samples", 2048, "per pixel where speed is measured"),
                        ("small", 256, "samples per pixel where overhead is measured"), ("repeats", 5, "of each sweep"))
    print(f"{os.cpu_count()} processors, {load()}")
    single = None
    for workers in (1, 2, 4):
        runs = measured(options.program, workers, options.cells, options.samples, options.repeats)
        rate = statistics.median(run["per_s"] for run in runs)
        single = single or rate
        best = max(run["per_s"] for run in runs)
        print(f"{workers} workers: {rate:.2f} images/s (best {best:.2f}, of {len(runs)} sweeps of {options.cells}), "
              f"{rate / single:.2f} times one worker; {load()}", flush=True)
    runs = measured(options.program, 2, 3 * options.cells, options.small, options.repeats)
    run = sorted(runs, key=lambda each: each["per_s"])[len(runs) // 2]
    images = 3 * options.cells
    print(f"overhead, {images} images at {run['per_s']:.1f} a second by 2 workers (median of {len(runs)} sweeps):")
    for name in ("broker", "store", "workers"):
        each = run[name] / images
        print(f"  {name}: {1e3 * each:.2f} ms of a processor for an image; at 50 images/s {100 * 50 * each:.1f} % of "
              f"one processor, {100 * 50 * each / os.cpu_count():.1f} % of {os.cpu_count()}")
    print(json.dumps(runs))


if __name__ == "__main__":
    main()
