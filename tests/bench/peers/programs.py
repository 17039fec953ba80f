"""The programs that are compared: how each is told what to render, run and timed."""

import json
import os
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))


class Failed(Exception):
    """A program that ended with an error, or a scene that it cannot be told."""


def run(command, cwd=None):
    """CPU seconds (user + system, with children) and wall seconds of the whole process."""
    start = time.perf_counter()
    nothing, pipe, joined = subprocess.DEVNULL, subprocess.PIPE, subprocess.STDOUT
    try:
        process = subprocess.Popen(command, cwd=cwd, stdin=nothing, stdout=pipe, stderr=joined)
    except FileNotFoundError as error:
        raise Failed(f"{command[0]} is not there") from error
    output = process.stdout.read().decode("utf-8", "replace")
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise Failed(f"{command[0]} ended with {process.returncode}:\n{output[-2000:]}")
    return {
        "cpu_s": round(usage.ru_utime + usage.ru_stime, 3),
        "wall_s": round(time.perf_counter() - start, 3),
    }


class Fstop:
    """`fstop render`, method auto, unless a setting forces `samples`."""

    name = "fstop"

    def __init__(self, binary, threads):
        self.binary = os.path.abspath(binary)
        self.threads = threads

    def prepare(self, case):
        pass

    def render(self, case, setting, out, seed=0, scene="scene.json"):
        request = case.write_request("fstop-request.json", setting, seed, scene)
        report = os.path.join(case.folder, "fstop-report.json")
        threads = ["--threads", str(self.threads)]
        cost = run([self.binary, "render", request, "--out", out, "--report", report, *threads])
        with open(report, encoding="utf-8") as file:
            facts = json.load(file)
        cost["method"] = facts["method"]
        cost["samples_mean"] = facts["cost"]["samples_mean"]
        cost["estimate"] = facts["error"]["estimate"]
        cost["upper_95"] = facts["error"]["upper_95"]
        return cost


class Cycles:
    """Blender's Cycles on a .blend file, which is written beforehand and not timed."""

    name = "Cycles"

    def __init__(self, threads):
        self.threads = threads

    def command(self, script, *blend):
        script = os.path.join(HERE, script)
        start = ["blender", "-b", "--factory-startup", *blend]
        return [*start, "--python-exit-code", "3", "--python", script, "--"]

    def prepare(self, case):
        out = os.path.join(case.folder, "scene.blend")
        run([*self.command("blender_export.py"), case.scene_file, case.request_file, out])

    def render(self, case, setting, out, seed=3):
        blend = os.path.join(case.folder, "scene.blend")
        words = [f"{key}={value}" for key, value in setting.items()]
        words += [f"seed={seed}", f"threads={self.threads}"]
        return run([*self.command("blender_render.py", blend), out, *words])


class PovRay:
    """POV-Ray on a scene file, which is written beforehand and not timed; parsing it is."""

    name = "POV-Ray"

    def __init__(self, threads):
        self.threads = threads

    def prepare(self, case):
        out = os.path.join(case.folder, "scene.pov")
        script = os.path.join(HERE, "pov_export.py")
        run([sys.executable, script, case.scene_file, case.request_file, out])

    def render(self, case, setting, out):
        size = case.request()["image"]
        command = ["povray", "+Iscene.pov", "+O" + os.path.abspath(out), "+FE", "-D", "-A", "-V"]
        command += [f"+W{size['width']}", f"+H{size['height']}", f"+WT{self.threads}"]
        command += ["Dither=off", f"Declare=Samples={setting['samples']}"]
        return run(command, cwd=case.folder)
