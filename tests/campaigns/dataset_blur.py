#!/usr/bin/python3
"""A data set of one plane, read by the example: its stored blur must give its pictures.

    dataset_blur.py [--program FSTOP]

A wall square to the axis, in a bundled texture, at 3 m, focused before, at and behind it. The
all-in-focus layer, blurred by the disc that the file tells of, and the picture differ by the noise of
both (asked for 0.003 each, at 95 %) and by what pixels do not resolve of the texture: 0.006.
The same pictures with a blur that is 5 % off must fail.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
READER = ROOT / "api/examples/read_dataset.py"
BOUND = 0.006

SCENE = {
    "format": "fstop-scene/1",
    "textures": {"bricks": {"file": "fence/bricks.jpg", "wrap": "repeat"}},
    "materials": {"wall": {"model": "unlit", "emission": {"texture": "bricks"}}},
    "objects": [
        {
            "type": "quad",
            "corner_m": [-3, -3, -3],
            "edge_u_m": [6, 0, 0],
            "edge_v_m": [0, 6, 0],
            "material": "wall",
        }
    ],
}
SWEEP = {
    "base": {
        "scene": SCENE,
        "camera": {"lens": {"focal_length_mm": 50, "f_number": 1.4}},
        "image": {"width": 240, "height": 160, "format": "exr"},
        "outputs": ["color", "depth", "coc", "all_in_focus", "valid"],
        "quality": {"max_error": 0.003},
        "effects": {"diffraction": "off"},
    },
    "axes": [
        {"member": "/camera/lens/focus_distance_m", "values": [1.2, 2, 3, 6]},
        {"member": "/camera/breathing", "values": [True, False]},
    ],
}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", default=str(ROOT / "build/release/fstop"))
    fstop = str(pathlib.Path(parser.parse_args().program).resolve())
    with tempfile.TemporaryDirectory() as folder:
        made = subprocess.run(
            [fstop, "sweep", "-", "--out", folder],
            input=json.dumps(SWEEP).encode(),
            cwd=ROOT / "core/scenes",
            stdout=subprocess.PIPE,
            check=False,
        )
        if made.returncode != 0:
            sys.exit(made.stdout.decode())
        command = [sys.executable, str(READER), folder, "--check", "--check-blur", str(BOUND)]
        read = subprocess.run(command, stdout=subprocess.PIPE, check=False)
        sys.stdout.write(read.stdout.decode())
        if read.returncode != 0 or read.stdout.count(b"one plane") != 8:
            sys.exit("the stored blur does not give the pictures")
        sys.path.insert(0, str(READER.parent))
        import read_dataset

        for entry, arrays, _ in read_dataset.images(folder):
            arrays["coc"] = 1.05 * arrays["coc"]
            diameter, error = read_dataset.blur_error(arrays)
            if diameter > 15 and error <= BOUND:
                sys.exit("a blur that is 5 % off is not seen: image %d" % entry["id"])


if __name__ == "__main__":
    main()
