#!/usr/bin/python3
"""Kills `fstop sweep` at random instants: nothing lost, nothing made twice, the same manifest.

    sweeps.py [--program FSTOP] [--kills N] [--cells N] [--seed S]

A sweep without kills first; then the same one, killed (SIGKILL) after random times until it has been
killed N times or is done, over and over into new folders. After each kill the state must hold no cell
fewer than before; at the end the manifests must be equal byte for byte, every file whole, and as many
cells made as there are: counted by the summaries and the state between them.
"""

import argparse
import json
import pathlib
import random
import sqlite3
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "api/examples"))
import read_dataset  # noqa: E402


def recipe(cells):
    return {
        "base": {
            "scene": "spheres",
            "camera": {"lens": {"f_number": 2}},
            "image": {"width": 96, "height": 64, "format": "exr"},
            "outputs": ["color", "depth", "coc", "valid"],
            "quality": {"samples": 16},
        },
        "axes": [{"member": "/seed", "range": {"from": 1, "to": cells, "step": 1}}],
    }


def recorded(folder):
    state = folder / "state.db"
    if not state.exists():
        return 0
    try:
        with sqlite3.connect(state) as database:
            return database.execute("SELECT count(*) FROM cells").fetchone()[0]
    except sqlite3.OperationalError:  # killed before the tables were made
        return 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", default=str(ROOT / "build/release/fstop"))
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--cells", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    dice = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        (folder / "recipe.json").write_text(json.dumps(recipe(options.cells)))

        def start(out):
            return subprocess.Popen(
                [options.program, "sweep", str(folder / "recipe.json"), "--out", str(out)],
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )

        begin = time.monotonic()
        whole = start(folder / "whole")
        whole.communicate()
        took = time.monotonic() - begin
        if whole.returncode != 0:
            sys.exit("the sweep failed")
        manifest = (folder / "whole/manifest.json").read_bytes()
        kills = rounds = 0
        while kills < options.kills:
            rounds += 1
            out = folder / ("killed-%d" % rounds)
            before = 0
            while True:
                process = start(out)
                try:
                    process.wait(timeout=dice.random() * took * 0.6)
                    summary = json.loads(process.stdout.read())
                    break
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
                    kills += 1
                now = recorded(out)
                if now < before:
                    sys.exit("%d cells were lost" % (before - now))
                before = now
            if summary["kept"] < before or summary["kept"] + summary["made"] != options.cells:
                sys.exit("cells were made twice: %s after %d" % (summary, before))
            if (out / "manifest.json").read_bytes() != manifest:
                sys.exit("the manifests differ")
            read_dataset.check_files(out)
            if list(out.rglob("*.part*")):
                sys.exit("something half written is left")
        print("%d kills in %d sweeps of %d cells: none lost, none made twice, manifests equal"
              % (kills, rounds, options.cells))


if __name__ == "__main__":
    main()
