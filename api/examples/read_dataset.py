#!/usr/bin/python3
"""Reads what `fstop dataset` and `fstop sweep` make: the manifest, and of each image an EXR file.

    read_dataset.py FOLDER                 one line for each image
    read_dataset.py FOLDER --check         also the hash of every file
    read_dataset.py FOLDER --check-blur R  also, of images that show one plane square to the axis:
                                           the all-in-focus layer, blurred by the stored circle of
                                           confusion, must give the colour within an RMSE of R

Needs Debian's python3-openimageio and python3-numpy. As a module: `images(folder)` yields each
image's entry in the manifest with its arrays.
"""

import argparse
import hashlib
import json
import pathlib
import sys

import numpy
import OpenImageIO

PLANE = 1e-4  # relative differences of depth within one plane
OWN_NAMES = {"FNumber": "aperture", "ExposureTime": "expTime"}  # OpenImageIO renames OpenEXR's
EDGES = 1.5  # blur diameters from the frame's edges, beyond which light from outside is missing


def read_exr(path):
    """Channels by name, float32 arrays of height x width, and the attributes."""
    file = OpenImageIO.ImageInput.open(str(path))
    if file is None:
        raise OSError(OpenImageIO.geterror())
    spec = file.spec()
    pixels = file.read_image("float")
    file.close()
    channels = {name: pixels[:, :, i] for i, name in enumerate(spec.channelnames)}
    attributes = {OWN_NAMES.get(a.name, a.name): a.value for a in spec.extra_attribs}
    return channels, attributes


def stacked(channels, names):
    return numpy.stack([channels[name] for name in names], axis=-1)


def images(folder):
    """Yields (entry, arrays, attributes) of every image of a finished sweep."""
    folder = pathlib.Path(folder)
    manifest = json.loads((folder / "manifest.json").read_text())
    for entry in manifest["images"]:
        channels, attributes = read_exr(folder / entry["file"])
        arrays = {"color": stacked(channels, ["R", "G", "B"])}
        for name, channel in (
            ("depth", "Z"),
            ("distance", "dist.ray"),
            ("coc", "coc.signed"),
            ("coc_diameter", "coc.diameter"),
            ("valid", "mask.valid"),
        ):
            if channel in channels:
                arrays[name] = channels[channel]
        for name, stem in (("all_in_focus", "aif"), ("variance", "var")):
            if stem + ".R" in channels:
                arrays[name] = stacked(channels, [stem + "." + c for c in "RGB"])
        yield entry, arrays, attributes


def check_files(folder):
    """Whether every file of the manifest has the bytes that it tells of."""
    folder = pathlib.Path(folder)
    manifest = json.loads((folder / "manifest.json").read_text())
    for file in manifest["files"]:
        if hashlib.sha256((folder / file["path"]).read_bytes()).hexdigest() != file["sha256"]:
            raise ValueError(file["path"] + " is not what the manifest tells of")
    return len(manifest["files"])


def bessel_j1(x):
    """J1 by its integral, (1/pi) int_0^pi cos(t - x sin t) dt; Abramowitz & Stegun 9.1.21.

    The trapezoidal rule of a periodic function: exact to rounding while x is below the nodes.
    """
    nodes = max(64, int(1.2 * numpy.max(x)) + 40)
    t = (numpy.arange(nodes) + 0.5) * numpy.pi / nodes
    total = numpy.zeros_like(x)
    for angle in t:
        total += numpy.cos(angle - x * numpy.sin(angle))
    return total / nodes


def blurred_by_disc(image, diameter):
    """`image` convolved with a disc of `diameter` pixels: times 2 J1(pi d f)/(pi d f)."""
    height, width = image.shape[:2]
    pad = int(numpy.ceil(diameter)) + 1
    padded = numpy.pad(image.astype(float), ((pad, pad), (pad, pad), (0, 0)), mode="edge")
    fy = numpy.fft.fftfreq(padded.shape[0])[:, None]
    fx = numpy.fft.rfftfreq(padded.shape[1])[None, :]
    x = numpy.pi * diameter * numpy.hypot(fx, fy)
    small = x < 1e-6
    transfer = numpy.where(small, 1.0, 2.0 * bessel_j1(x) / numpy.where(small, 1.0, x))
    spectrum = numpy.fft.rfft2(padded, axes=(0, 1)) * transfer[:, :, None]
    out = numpy.fft.irfft2(spectrum, s=padded.shape[:2], axes=(0, 1))
    return out[pad : pad + height, pad : pad + width]


def blur_error(arrays):
    """RMSE of colour against blurred all-in-focus; None where there is not one plane alone."""
    depth = arrays["depth"]
    if not arrays["valid"].all() or numpy.ptp(depth) > PLANE * depth.mean():
        return None
    diameter = float(numpy.abs(arrays["coc"]).mean())
    margin = int(numpy.ceil(EDGES * diameter)) + 1
    height, width = depth.shape
    if 2 * margin >= min(height, width):
        return None
    blurred = blurred_by_disc(arrays["all_in_focus"], diameter)
    difference = (blurred - arrays["color"])[margin : height - margin, margin : width - margin]
    return diameter, float(numpy.sqrt(numpy.mean(difference**2)))


def main():
    parser = argparse.ArgumentParser(description="Reads a data set of fstop.")
    parser.add_argument("folder")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--check-blur", type=float, metavar="RMSE")
    options = parser.parse_args()
    if options.check:
        print(check_files(options.folder), "files are whole")
    planes = 0
    for entry, arrays, attributes in images(options.folder):
        line = "image {id}: scene {scene}, stack {stack}".format(**entry)
        line += ", f/{:.3g}".format(entry.get("f_number", attributes.get("aperture", 0.0)))
        line += ", focus {} m".format(entry.get("focus_distance_m"))
        if "coc" in arrays:
            line += ", blur {:.2f} to {:.2f} px".format(arrays["coc"].min(), arrays["coc"].max())
        if options.check_blur is not None and (result := blur_error(arrays)):
            planes += 1
            line += ", one plane: {:.2f} px, RMSE {:.4f}".format(*result)
            if result[1] > options.check_blur:
                print(line)
                sys.exit("the stored blur does not give the picture")
        print(line)
    if options.check_blur is not None and planes == 0:
        sys.exit("no image shows one plane alone")


if __name__ == "__main__":
    main()
