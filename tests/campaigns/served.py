"""What the campaigns share: `fstop serve` as a process, its memory and descriptors, requests, figures."""
import argparse
import contextlib
import hashlib
import http.client
import json
import os
import re
import resource
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent.parent
MEBIBYTE = 1 << 20
HOST = "127.0.0.1"

SCENE = {
    "format": "fstop-scene/1",
    "materials": {"wall": {"model": "unlit", "emission": [0.2, 0.4, 0.6]},
                  "ball": {"model": "phong", "ambient": [0.1, 0.1, 0.1], "diffuse": [0.8, 0.3, 0.2]}},
    "objects": [{"type": "quad", "corner_m": [-4, -4, -6], "edge_u_m": [8, 0, 0], "edge_v_m": [0, 8, 0],
                 "material": "wall"},
                {"type": "sphere", "center_m": [0, 0, -2], "radius_m": 0.3, "material": "ball"}],
    "lights": [{"type": "directional", "direction": [-1, -1, -1], "intensity": [1, 1, 1]}],
    "ambient_light": [0.2, 0.2, 0.2],
}
OPTICS = {"camera": {"lens": {"focal_length_mm": 50, "f_number": 2}}}


class Answer(NamedTuple):
    status: int
    headers: dict
    body: bytes

    def json(self):
        return json.loads(self.body)


def require(holds: bool, what: str) -> None:
    """Ends the campaign as failed unless `holds`."""
    if not holds:
        sys.exit(f"FAILED: {what}")


def render(seed: int, width: int = 48, height: int = 32, **members) -> dict:
    """A request for an image of the scene "tiny"; other seeds are other renders."""
    return {"scene": "tiny", "seed": seed, "camera": {"lens": {"f_number": 2, "focus_distance_m": 2}},
            "image": {"width": width, "height": height}, "quality": {"samples": 16}, **members}


def endless(seed: int) -> dict:
    """A render of a minute: whoever asks for it goes away before its end."""
    return render(seed, 1920, 1280, quality={"samples": 800, "method": "lens-sampling"})


def memory_of(process: int, kind: str) -> int:
    """Bytes of a kind of smaps_rollup; 0 for a process that has gone."""
    with contextlib.suppress(OSError):
        text = Path(f"/proc/{process}/smaps_rollup").read_text()
        return 1024 * int(re.search(rf"^{kind}:\s+(\d+)", text, re.MULTILINE)[1])
    return 0


class Served:
    """`fstop serve` with a data directory of its own, which holds the scene "tiny"."""

    def __init__(self, program: str, folder: Path, *arguments: str, port: int = 0):
        self.folder = folder
        scene = folder / "data/scenes/tiny/scene.json"
        scene.parent.mkdir(parents=True, exist_ok=True)
        scene.write_text(json.dumps(SCENE))
        for name in ("port", "probe-port"):
            (folder / name).unlink(missing_ok=True)
        # What a sanitizer says is kept apart from the log, and what a child says, too.
        environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=1:exitcode=99",
                       "UBSAN_OPTIONS": "print_stacktrace=1", "LSAN_OPTIONS": "exitcode=98"}
        with open(folder / "errors", "ab") as errors:
            self.process = subprocess.Popen(
                [program, "serve", "--port", str(port), "--port-file", folder / "port", "--data-dir", folder / "data",
                 "--probe-port", "0", "--probe-port-file", folder / "probe-port",
                 "--log-file", folder / "log", *arguments],
                stdin=subprocess.DEVNULL, stderr=errors, env=environment)
        self.port = self._port("port")
        self.probe_port = self._port("probe-port")

    def _port(self, name: str) -> int:
        file = self.folder / name
        for _ in range(6000):
            if file.exists() and (text := file.read_text()).endswith("\n"):
                return int(text)
            require(self.process.poll() is None, f"the server does not start: {self.errors()}")
            time.sleep(0.005)
        sys.exit("FAILED: the server does not get ready")

    def processes(self) -> list[int]:
        """Of the server and of all that it has begun."""
        parents = {}
        for entry in os.scandir("/proc"):
            if entry.name.isdigit():
                with contextlib.suppress(OSError):
                    status = Path(entry.path, "stat").read_text()
                    parents[int(entry.name)] = int(status.rpartition(")")[2].split()[1])
        found = [self.process.pid]
        for process in found:
            found.extend(child for child, parent in parents.items() if parent == process)
        return found

    def memory(self, kind: str = "Pss") -> int:
        """Bytes in memory, a page that processes share counted once; or of another kind of smaps_rollup."""
        return sum(memory_of(process, kind) for process in self.processes())

    def memory_asked_for(self) -> int:
        """Bytes that the server has asked for and not given back, and pages of its workers that no file backs."""
        workers = sum(memory_of(process, "Anonymous") for process in self.processes()[1:])
        return int(self.metric("fstop_heap_in_use_bytes")) + workers

    def descriptors(self) -> int:
        total = 0
        for process in self.processes():
            with contextlib.suppress(OSError):
                total += len(os.listdir(f"/proc/{process}/fd"))
        return total

    def metric(self, name: str) -> float:
        """The sum over all labels."""
        text = ask(self.probe_port, "GET", "/metrics").body.decode()
        values = re.findall(rf"^{name}(?:{{[^}}]*}})? (\S+)$", text, re.MULTILINE)
        return sum(map(float, values))

    def wait_until_idle(self, patience_s: float = 60) -> None:
        end = time.monotonic() + patience_s
        while self.metric("fstop_renders_running") + self.metric("fstop_renders_queued") > 0:
            require(time.monotonic() < end, "renders go on that nobody waits for")
            time.sleep(0.05)

    def errors(self) -> str:
        return (self.folder / "errors").read_text(errors="replace")[-20_000:]

    def events(self, name: str) -> list[dict]:
        """The log's lines of this kind."""
        lines = (self.folder / "log").read_text(errors="replace").splitlines()
        return [json.loads(line) for line in lines if f'"{name}"' in line]

    def send(self, number: int) -> None:
        self.process.send_signal(number)

    def end(self, number: int = signal.SIGTERM) -> int:
        """The exit code after this signal."""
        self.send(number)
        try:
            return self.process.wait(150)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            sys.exit("FAILED: the server does not end")

    def require_clean_end(self) -> None:
        """It lived, ends when asked to, and no sanitizer has reported anything."""
        require(self.process.poll() is None, f"the server ended, {self.process.poll()}: {self.errors()}")
        require(ask(self.probe_port, "GET", "/readyz").status == 200, "the server is not ready at the end")
        code = self.end()
        require(code == 0, f"the server ended with {code}: {self.errors()}")
        reports = re.findall(r"Sanitizer|runtime error", self.errors())
        require(not reports, f"a sanitizer reports: {self.errors()}")

    def kill(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


@contextlib.contextmanager
def served(program: str, *arguments: str):
    """A server that goes away with its folder."""
    folder = Path(tempfile.mkdtemp(prefix="fstop-campaign-"))
    server = None
    try:
        server = Served(program, folder, *arguments)
        yield server
    finally:
        if server is not None:
            server.kill()
        shutil.rmtree(folder, ignore_errors=True)


def connect(port: int, source: str = "", timeout_s: float = 120) -> socket.socket:
    made = socket.create_connection((HOST, port), timeout_s, (source, 0) if source else None)
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return made


def reset(connection: socket.socket) -> None:
    """Ends it as a process does that was killed."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    connection.close()


def request_bytes(method: str, target: str, body: bytes = b"", headers: dict | None = None) -> bytes:
    fields = {"Host": "localhost", **(headers or {})}
    if body or method in ("POST", "PUT"):
        fields = {"Content-Type": "application/json", **fields, "Content-Length": str(len(body))}
    lines = "".join(f"{name}: {value}\r\n" for name, value in fields.items())
    return f"{method} {target} HTTP/1.1\r\n{lines}\r\n".encode() + body


def read_answer(connection: socket.socket, method: str = "GET") -> Answer:
    """The next reply. Throws what http.client does where none comes."""
    response = http.client.HTTPResponse(connection, method=method)
    try:
        response.begin()
        return Answer(response.status, {k.lower(): v for k, v in response.getheaders()}, response.read())
    finally:
        response.close()


def ask(port: int, method: str, target: str, body=None, headers: dict | None = None, source: str = "",
        timeout_s: float = 600) -> Answer:
    """One request on a connection of its own. `body`: bytes, or what becomes JSON."""
    content = body if isinstance(body, bytes) else b"" if body is None else json.dumps(body).encode()
    with connect(port, source, timeout_s) as connection:
        connection.sendall(request_bytes(method, target, content, headers))
        return read_answer(connection, method)


def sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def together(count: int, work) -> None:
    """work(0) ... work(count - 1) at once; the first exception comes back."""
    failures = []

    def guarded(number: int) -> None:
        try:
            work(number)
        except BaseException as failure:  # also SystemExit of require()
            failures.append(failure)
    threads = [threading.Thread(target=guarded, args=(number,), daemon=True) for number in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]


def quantile(values: list[float], q: float) -> float:
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(q * len(ordered)))]


def slope(points: list[tuple[float, float]]) -> float:
    """Of the line of least squares through (x, y)."""
    mean_x = sum(x for x, _ in points) / len(points)
    mean_y = sum(y for _, y in points) / len(points)
    return (sum((x - mean_x) * (y - mean_y) for x, y in points)
            / sum((x - mean_x) ** 2 for x, _ in points))


def arguments(description: str, *numbers: tuple[str, float, str]) -> argparse.Namespace:
    """--program, and options that are numbers: name, default, meaning."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--program", default=str(ROOT / "build/release/fstop"))
    for name, default, meaning in numbers:
        parser.add_argument("--" + name, type=type(default), default=default, help=f"{meaning} (%(default)s)")
    # Some open thousands of connections; the server inherits it.
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 16384) if hard > 0 else 16384, hard))
    return parser.parse_args()


def load() -> str:
    """For every time that is told: how busy the machine was."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors"
