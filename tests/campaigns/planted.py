#!/usr/bin/env python3
"""Plants one error after the other into a copy of the sources and builds the tests that stand against it: each must
fail. Without errors the same tests must pass. The copy is build/planted; sources that changed are copied anew."""
import argparse
import collections
import os
import pathlib
import re
import subprocess
import sys

from planted_errors import PLANTED

ROOT = pathlib.Path(__file__).resolve().parents[2]
COPY = ROOT / "build" / "planted"
BUILD = COPY / "build" / "release"  # as deep as the sources' own: the compiler cache knows most of it
SOURCES = ["CMakeLists.txt", "CMakePresets.json", "api", "core", "server", "tests"]


def run(*command: str | pathlib.Path, limit_s: int = 1800) -> subprocess.CompletedProcess:
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=limit_s, check=False)


def must(*command: str | pathlib.Path) -> None:
    done = run(*command)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")


def copy_sources() -> None:
    COPY.mkdir(parents=True, exist_ok=True)
    # Times are kept where the contents are equal, so that ninja builds what has changed alone.
    for name in SOURCES:
        for path in [ROOT / name, *(ROOT / name).rglob("*")] if (ROOT / name).is_dir() else [ROOT / name]:
            target = COPY / path.relative_to(ROOT)
            if path.is_dir():
                target.mkdir(exist_ok=True)
            elif not target.exists() or target.read_bytes() != path.read_bytes():
                target.write_bytes(path.read_bytes())


def program_path(name: str) -> pathlib.Path:
    found = [path for path in BUILD.rglob(name) if path.is_file() and os.access(path, os.X_OK)]
    return found[0]


def failed_tests(program: str, tests: list[str]) -> set[str]:
    """Those of `tests` that do not pass; a program that dies fails all that it had not passed."""
    done = run(program_path(program), f"--gtest_filter={':'.join(tests)}")
    passed = set(re.findall(r"^\[       OK \] (\S+) \(", done.stdout, re.MULTILINE))
    return set(tests) - passed


def build(program: str) -> None:
    jobs = os.environ.get("FSTOP_JOBS") or str(os.cpu_count())
    must("ninja", "-C", BUILD, "-j", jobs, program)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("only", nargs="*", help="words: errors whose text or file has one of them")
    parser.add_argument("--oracle", default=ROOT.parent / "shared" / "oracle", help="folder of the fixtures")
    parser.add_argument("--first", type=int, default=1, help="number of the error to begin with")
    options = parser.parse_args()
    chosen = [error for error in PLANTED
              if not options.only or any(word in error[0] or word in error[1] for word in options.only)]
    for what, file, sound, _, _, _ in PLANTED:
        if (ROOT / file).read_text().count(sound) != 1:
            sys.exit(f"{file} has not once what is to become wrong: {what}")
    copy_sources()
    must("cmake", "-S", COPY, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
         "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache", f"-DFSTOP_ORACLE_DIR={options.oracle}")

    wanted = collections.defaultdict(list)
    for *_, program, tests in chosen[options.first - 1:]:
        wanted[program] += [test for test in tests if test not in wanted[program]]
    must("ninja", "-C", BUILD, *wanted)
    for program, tests in wanted.items():
        if failed := failed_tests(program, tests):
            sys.exit(f"without an error {program} fails {', '.join(sorted(failed))}")
    print(f"without an error {sum(map(len, wanted.values()))} tests pass", flush=True)

    missed = 0
    for number, (what, file, sound, wrong, program, tests) in enumerate(chosen, 1):
        if number < options.first:
            continue
        path = COPY / file
        text = path.read_text()
        path.write_text(text.replace(sound, wrong))
        try:
            build(program)
            passed = sorted(set(tests) - failed_tests(program, tests))
        finally:
            path.write_text(text)
        missed += bool(passed)
        print(f"{number}/{len(chosen)} {what}: " + (f"NOT SEEN by {', '.join(passed)}" if passed else
                                                   f"{len(tests)} of {len(tests)} tests fail"), flush=True)
    if missed:
        sys.exit(f"{missed} of {len(chosen)} errors were not seen by all their tests")
    print(f"all {len(chosen)} errors were seen")


if __name__ == "__main__":
    main()
