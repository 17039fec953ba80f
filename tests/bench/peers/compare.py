#!/usr/bin/python3
"""Compares fstop with Blender Cycles and POV-Ray on the same scenes in one run.

    compare.py [scenes...] [--quick] ...

A scene is one of the peers' folder (slats, spheres), a bundled scene (still-life, night, ...), or a
scene or request file. Needs Debian 12's blender, povray, povray-includes, python3-numpy,
python3-openimageio. Writes OUT/peers.json, OUT/peers.csv and OUT/table.md; pictures stay in
OUT/SCENE.
"""

import argparse
import hashlib
import os
import statistics
import subprocess
import sys

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.normpath(os.path.join(HERE, "..", "..", ".."))
sys.path.insert(0, HERE)

import figures
from cases import prepare, read_json, write_json
from discs import DiscEnergy, find_discs
from pictures import Reference, read_picture, write_side_by_side
from programs import Cycles, Failed, Fstop, PovRay
from scene_model import files_of, read_model

DEFAULT_SCENES = ("slats", "spheres", "still-life", "night")
CHEAP = 3.0  # CPU seconds: runs below are repeated, and the median counts
REPEATS = 5
FINEST = 1e-4  # relMSE at which a program's ladder ends
COUNTS = (1, 4, 16, 64, 256, 1024, 4096)
MAX_ERRORS = (
    *(0.15, 0.08, 0.04, 0.02, 0.014, 0.01, 0.007, 0.005, 0.0035, 0.0025, 0.0018, 0.00125, 0.0009),
)
ADAPTIVE = 0.01  # Cycles' own default threshold


def log(text):
    print(text, flush=True)


class Meter:
    """Runs settings of one case and measures what comes out."""

    def __init__(self, case, reference, discs):
        self.case, self.reference, self.discs = case, reference, discs
        self.points = []

    def file_of(self, program, setting, seed=""):
        words = "-".join(f"{key}-{value}" for key, value in setting.items())
        return os.path.join(self.case.folder, f"{program}-{words}{seed}.exr")

    def run(self, program, setting):
        file = self.file_of(program.name, setting)
        if all(point["program"] != program.name for point in self.points):
            program.render(self.case, setting, file)  # not counted: it finds its files in no cache
        runs = [program.render(self.case, setting, file)]
        while runs[0]["cpu_s"] < CHEAP and len(runs) < REPEATS:
            runs.append(program.render(self.case, setting, file))
        picture = read_picture(file)
        point = {"program": program.name, "setting": setting, **runs[0], "runs": len(runs)}
        for key in ("cpu_s", "wall_s"):
            point[key] = statistics.median(run[key] for run in runs)
        point.update(self.reference.errors(picture))
        point.update(self.discs.figures(picture))
        self.points.append(point)
        words = " ".join(f"{key} {value}" for key, value in setting.items())
        log(
            f"  {program.name:8s} {words:18s} {point['cpu_s']:8.2f} CPU s {point['wall_s']:7.2f} s"
            f"  relMSE {point['relmse']:.3e}  energy {point['energy_ratio']:.4f}"
        )
        return point

    def show_finest(self):
        """The best picture of each program and the reference, side by side."""
        finest = {}
        for point in self.points:
            best = finest.setdefault(point["program"], point)
            finest[point["program"]] = min(best, point, key=lambda p: abs(p["relmse"]))
        pictures = [read_picture(self.file_of(p["program"], p["setting"])) for p in finest.values()]
        pictures.append(self.reference.mean)
        write_side_by_side(os.path.join(self.case.folder, "side-by-side.png"), pictures)

    def bias(self, program, setting):
        """relMSE of what differs beside noise: the product of two independent pictures' errors."""
        pictures = []
        for seed in (11, 12):
            file = self.file_of(program.name, setting, f"-seed-{seed}")
            program.render(self.case, setting, file, seed=seed)
            pictures.append(read_picture(file))
        return self.reference.bias(*pictures, self.discs.outside)


# ---- References


def reference_of(case, fstop, samples, out):
    """The converged picture that came with the case, or two of fstop, kept for the next run."""
    if case.given_reference is not None:
        file, noise = case.given_reference
        return Reference([read_picture(file)], noise, os.path.basename(file))
    # Lens sampling meets a small emitter so rarely that its noise would hide what is compared. How
    # much light a disc holds is told beside, against lens sampling.
    bright = find_discs(read_model(case.scene_file, case.request()))
    method = "bokeh-splatting" if bright else "lens-sampling"
    pictures = [kept_reference(case, fstop, method, samples, seed, out) for seed in (1001, 1002)]
    return Reference(pictures, source=f"fstop, {method}, 2 x {samples} samples")


def kept_reference(case, fstop, method, samples, seed, out):
    digest = hashlib.sha256()
    scene = read_json(os.path.join(case.folder, "exact.json"))
    for name in ["exact.json", "request.json", *files_of(scene)]:
        with open(os.path.join(case.folder, name), "rb") as file:
            digest.update(file.read())
    folder = os.path.join(out, "references")
    os.makedirs(folder, exist_ok=True)
    file = os.path.join(folder, f"{case.name}-{digest.hexdigest()[:16]}-{method}-{samples}-{seed}.exr")
    if not os.path.exists(file):
        log(f"  reference: {samples} samples, seed {seed}")
        setting = {"samples": samples, "method": method}
        partial = file[:-4] + "-partial.exr"
        fstop.render(case, setting, partial, seed=seed, scene="exact.json")
        os.replace(partial, file)
    return read_picture(file)


# ---- Ladders of settings


class Ladder:
    """The next setting of a program, by what its last ones cost and reached."""

    def __init__(self, program, cap, finest):
        self.program, self.cap, self.finest = program, cap, finest
        self.points = []

    def next(self):
        raise NotImplementedError

    def reached(self):
        return bool(self.points) and self.points[-1]["relmse"] <= self.finest

    def predicted(self, samples):
        """CPU seconds, linear in samples through the last two points."""
        if len(self.points) < 2:
            return 0.0
        a, b = self.points[-2:]
        n_a, n_b = a["setting"]["samples"], b["setting"]["samples"]
        return b["cpu_s"] + (b["cpu_s"] - a["cpu_s"]) * (samples - n_b) / (n_b - n_a)


class CountLadder(Ladder):
    def next(self):
        if self.reached():
            return None
        if not self.points:
            return {"samples": COUNTS[0]}
        last = self.points[-1]["setting"]["samples"]
        if last not in COUNTS:
            return None  # the step below a full one was the last that the cap allowed
        for samples in (4 * last, 2 * last):
            if samples <= COUNTS[-1] and self.predicted(samples) <= self.cap:
                return {"samples": samples}
        return None


class ErrorLadder(Ladder):
    """fstop: one sample, then falling max_error."""

    def next(self):
        if not self.points:
            return {"samples": 1, "max_error": MAX_ERRORS[0]}
        errors = len(self.points) - 1
        dear = self.points[-1]["cpu_s"] * 2 > self.cap
        if errors == len(MAX_ERRORS) or (errors > 0 and self.reached()) or dear:
            return None
        return {"max_error": MAX_ERRORS[errors]}


def climb(meter, ladders):
    """One setting of each program after another, so that all see the machine alike."""
    open_ladders = list(ladders)
    while open_ladders:
        for ladder in list(open_ladders):
            setting = ladder.next()
            if setting is None:
                open_ladders.remove(ladder)
                continue
            try:
                ladder.points.append(meter.run(ladder.program, setting))
            except Failed as failure:
                log(f"  {ladder.program.name}: {failure}")
                open_ladders.remove(ladder)


# ---- One case


def compare(case, options, kept):
    log(f"\n{case.name}: " + ("; ".join(case.notes) or "nothing to match"))
    fstop = Fstop(options.fstop, options.threads)
    reference = reference_of(case, fstop, options.reference_samples, options.out)
    log(f"  reference: {reference.source}, own relMSE {reference.noise:.2e}")
    discs = DiscEnergy(read_model(case.scene_file, case.request()), reference)
    meter = Meter(case, reference, discs)
    finest = 3e-3 if options.quick else FINEST
    ladders = [ErrorLadder(fstop, options.cap, finest)]
    peers = [peer for peer in (Cycles(options.threads), PovRay(options.threads))
             if peer.name.lower().replace("-", "") in options.programs]
    for peer in peers:
        if kept and any(point["program"] == peer.name for point in kept["points"]):
            meter.points += [point for point in kept["points"] if point["program"] == peer.name]
            continue
        try:
            peer.prepare(case)
            ladders.append(CountLadder(peer, options.cap, finest))
        except Failed as failure:
            log(f"  {peer.name} left out: {failure}")
    climb(meter, ladders)
    cycles = next((ladder for ladder in ladders if ladder.program.name == "Cycles"), None)
    if cycles and discs.masks and not options.quick:
        samples = max(point["setting"]["samples"] for point in cycles.points)
        meter.run(cycles.program, {"samples": 4 * samples, "adaptive": ADAPTIVE})
    result = {
        "name": case.name,
        "notes": case.notes,
        "reference": {"source": reference.source, "relmse": reference.noise},
        "points": meter.points,
    }
    if not options.quick:
        found = agreement(meter, fstop, cycles)
        result["agreement"] = found or (kept or {}).get("agreement")
        if result["agreement"]:
            relmse, error = result["agreement"]["relmse"], result["agreement"]["standard_error"]
            log(f"  the models differ by relMSE {relmse:.1e} +- {error:.1e}")
    meter.show_finest()
    return result


def agreement(meter, fstop, cycles):
    """fstop's and Cycles' difference without noise; the reference stands for its own program."""
    if meter.case.given_reference is None:
        if cycles is None:
            return None
        samples = min(64, max(point["setting"]["samples"] for point in cycles.points))
        return meter.bias(cycles.program, {"samples": samples})
    return meter.bias(fstop, {"max_error": 0.0035})


def write_csv(path, result):
    """Rows for the chart."""
    with open(path, "w", encoding="utf-8") as file:
        file.write("scene;program;adaptive;cpu_s;net_cpu_s;relmse\n")
        for case in result["cases"]:
            rows = sorted(case["points"], key=lambda p: (p["program"], -p["relmse"]))
            for point in rows:  # together and in order, or gnuplot's lines would break
                start = figures.one_sample_cost(case["points"], point["program"])
                adaptive = int("adaptive" in point["setting"])
                forced = point["program"] == "fstop" and "samples" in point["setting"]
                if point["relmse"] <= 0 or forced:
                    continue
                net = max(point["cpu_s"] - start, 1e-3)
                file.write(f"{case['name']};{point['program']};{adaptive};{point['cpu_s']};")
                file.write(f"{net};{point['relmse']}\n")


def machine(options):
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    return {
        "processor": names[0] if names else "",
        "threads": options.threads,
        "load_before": os.getloadavg()[0],
        "blender": first_line(["blender", "--version"]),
        "povray": first_line(["povray", "--version"]),
    }


def first_line(command):
    """Of what a program says of itself; POV-Ray complains about missing settings first."""
    output = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = (output.stdout + output.stderr).splitlines()
    return next((line.strip() for line in lines if line.startswith(("Blender", "POV-Ray"))), "")


def parsed_options():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenes", nargs="*", help=f"default: {' '.join(DEFAULT_SCENES)}")
    parser.add_argument("--quick", action="store_true", help="to relMSE 3e-3 only, no cross-check")
    parser.add_argument("--reuse", action="store_true", help="the peers' points of the last run")
    parser.add_argument("--programs", default="cycles,povray", help="peers to run")
    parser.add_argument("--cap", type=float, default=150.0, help="CPU seconds of one run")
    parser.add_argument("--reference-samples", type=int, default=512)
    parser.add_argument("--size", help="WIDTHxHEIGHT instead of the scene's own")
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--peers", default=os.path.join(ROOT, "..", "shared", "peers"))
    parser.add_argument("--fstop", default=os.path.join(ROOT, "build", "release", "fstop"))
    parser.add_argument("--out", default=os.path.join(ROOT, "build", "bench", "peers"))
    options = parser.parse_args()
    options.programs = options.programs.split(",")
    options.out = os.path.abspath(options.out)
    options.scenes = options.scenes or DEFAULT_SCENES
    return options


def main():
    options = parsed_options()
    os.makedirs(options.out, exist_ok=True)
    json_file = os.path.join(options.out, "peers.json")
    last = read_json(json_file) if options.reuse and os.path.exists(json_file) else {"cases": []}
    kept = {case["name"]: case for case in last["cases"]}
    pixels = tuple(map(int, options.size.split("x"))) if options.size else None
    result = {
        "machine": machine(options),
        "programs": ["fstop", "Cycles", "POV-Ray"],
        "cases": [],
    }
    for name in options.scenes:
        case = prepare(name, options.out, ROOT, options.peers, pixels)
        result["cases"].append(compare(case, options, kept.get(case.name)))
        write_json(json_file, result)
    write_csv(os.path.join(options.out, "peers.csv"), result)
    tables = [figures.table(result), figures.disc_table(result)]
    text = "\n\n".join(table for table in tables if table)
    with open(os.path.join(options.out, "table.md"), "w", encoding="utf-8") as file:
        file.write(text + "\n")
    log("\nCPU seconds net of each program's own one-sample run (gross): ratio to fstop")
    log("\n" + text)


main()
