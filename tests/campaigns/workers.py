#!/usr/bin/env python3
"""A sweep by workers that are killed all the time, and by a server that is killed once: the same manifest as without."""
import collections
import random
import signal
import sys
import time

from cluster import Cluster, begun_sweep, recipe, require_whole, until_done
from served import arguments, load, require, sha256


def rendered(cluster: Cluster) -> tuple[int, int]:
    """How many cells were begun more often than once, and the most attempts at one."""
    begun = collections.Counter(event["cell"] for worker in cluster.workers for event in worker.events("cell_begun"))
    return sum(count > 1 for count in begun.values()), max(begun.values())


def main() -> None:
    options = arguments(__doc__, ("cells", 1000, "of the sweep"), ("workers", 4, "at once"),
                        ("samples", 1024, "per pixel of each cell"), ("seed", 1, "of the kills"),
                        ("every", 1, "seconds between kills of a worker"), ("least", 10, "kills that must have been"))
    sweep = recipe(options.cells, options.samples)
    dice = random.Random(options.seed)
    start = time.monotonic()
    with Cluster(options.program, options.workers) as calm:
        undisturbed = until_done(calm, begun_sweep(calm.port, sweep), patience_s=1800)
        calm_s = time.monotonic() - start
        require_whole(calm, undisturbed, options.cells)
        require(rendered(calm)[0] == 0, "cells were begun twice although nothing was killed")
    kills = 0
    # Attempts are bounded against cells that end their worker; here others end it, and often.
    with Cluster(options.program, options.workers, 3, ("--attempts", "20")) as cluster:
        start = time.monotonic()
        name = begun_sweep(cluster.port, sweep)

        def disturb(second: int) -> None:
            nonlocal kills
            if second == 10:
                require(cluster.server.end(signal.SIGKILL) == -signal.SIGKILL, "the server had ended before")
                cluster.serve()
            if second % options.every != 0:
                return
            victim = dice.choice(cluster.workers)
            victim.kill()
            victim.start()
            kills += 1
        manifest = until_done(cluster, name, disturb, patience_s=1800)
        wall_s = time.monotonic() - start
        require(kills > options.least, f"the sweep was done after {kills} kills: give it more cells or samples")
        require_whole(cluster, manifest, options.cells)
        again, most = rendered(cluster)
    require(manifest == undisturbed, f"manifests differ: {sha256(manifest)} {sha256(undisturbed)}")
    print(f"{options.cells} cells, {options.workers} workers, ack wait 3 s: {kills} workers and the server killed in "
          f"{wall_s:.0f} s ({calm_s:.0f} s without kills); every cell once, manifest of {len(manifest)} bytes the same; "
          f"{again} cells begun again, one of them {most} times in all; {load()}")


if __name__ == "__main__":
    sys.exit(main())
