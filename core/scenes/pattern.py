"""Procedural pictures for the bundled scenes: noise, blends, strokes, and image files.

A picture is a float array (rows, columns, 3), row 0 at the top. Colours are painted in sRGB code
values in [0, 1] unless a name says linear. Random numbers come from RandomState, whose stream
NumPy keeps for ever, so that the files come out the same everywhere.
"""

import numpy as np
import OpenImageIO as oiio


def uv_grid(width, height):
    """Texel centres: u to the right, v up."""
    u = (np.arange(width) + 0.5) / width
    v = 1.0 - (np.arange(height) + 0.5) / height
    return np.meshgrid(u, v)


def smoothstep(low, high, x):
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def mix(a, b, weight):
    """a where weight is 0, b where it is 1; colours are broadcast over the picture."""
    a, b, weight = np.asarray(a, dtype=float), np.asarray(b, dtype=float), np.asarray(weight)
    if a.ndim != weight.ndim or b.ndim != weight.ndim:
        weight = weight[..., None]
    return a + (b - a) * weight


def ramp(t, *stops):
    """Colour at t of a gradient of (position, (r, g, b)) stops."""
    places = [stop[0] for stop in stops]
    return np.stack([np.interp(t, places, [stop[1][c] for stop in stops]) for c in range(3)], -1)


def noise(x, y, period=None, seed=0):
    """Gradient noise in about [-1, 1] over a lattice of unit cells, tiling after `period` cells."""
    random = np.random.RandomState(seed)
    columns, rows = (256, 256) if period is None else period
    angle = random.uniform(0.0, 2.0 * np.pi, (rows, columns))
    cell_x, cell_y = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - cell_x, y - cell_y

    def corner(dx, dy):
        a = angle[(cell_y + dy) % rows, (cell_x + dx) % columns]
        return np.cos(a) * (fx - dx) + np.sin(a) * (fy - dy)

    wx, wy = fx**3 * (fx * (6 * fx - 15) + 10), fy**3 * (fy * (6 * fy - 15) + 10)
    low = corner(0, 0) * (1 - wx) + corner(1, 0) * wx
    high = corner(0, 1) * (1 - wx) + corner(1, 1) * wx
    return 1.5 * (low * (1 - wy) + high * wy)


def fbm(x, y, octaves=5, gain=0.5, period=None, seed=0):
    """Sum of octaves of noise, in about [-1, 1]."""
    total, weight, reach = 0.0, 1.0, 0.0
    for octave in range(octaves):
        tile = None if period is None else (period[0] << octave, period[1] << octave)
        total = total + weight * noise(x * 2**octave, y * 2**octave, tile, seed + 17 * octave)
        reach += weight
        weight *= gain
    return total / reach


def cells(x, y, period, seed=0, jitter=0.9):
    """Worley cells: distance to the nearest point, to the second, and the cell's random number."""
    random = np.random.RandomState(seed)
    columns, rows = period
    offset = 0.5 + jitter * (random.uniform(size=(rows, columns, 2)) - 0.5)
    number = random.uniform(size=(rows, columns))
    cell_x, cell_y = np.floor(x).astype(int), np.floor(y).astype(int)
    first, second = np.full(x.shape, 9.0), np.full(x.shape, 9.0)
    owner = np.zeros(x.shape)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            j, i = (cell_y + dy) % rows, (cell_x + dx) % columns
            distance = np.hypot(
                cell_x + dx + offset[j, i, 0] - x, cell_y + dy + offset[j, i, 1] - y
            )
            nearer = distance < first
            second = np.where(nearer, first, np.minimum(second, distance))
            owner = np.where(nearer, number[j, i], owner)
            first = np.where(nearer, distance, first)
    return first, second, owner


def segment_distance(x, y, a, b):
    """Distance of points to the segment from a to b."""
    (ax, ay), (bx, by) = a, b
    dx, dy = bx - ax, by - ay
    t = np.clip(((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-12), 0.0, 1.0)
    return np.hypot(x - ax - t * dx, y - ay - t * dy)


# Strokes of each sign on a grid 4 wide and 6 high: polylines, one per word, two digits a point.
STROKES = {
    "0": "011030414536160501",
    "1": "152620 1030",
    "2": "05163645440040",
    "3": "05163645443313 334241301001",
    "4": "30360242",
    "5": "460603334241301001",
    "6": "4536160501103041423303",
    "7": "06464510",
    "8": "13040516364544331302011030414233",
    "9": "0110304145361605041343",
    ".": "2021",
    "-": "1333",
    "/": "0046",
    " ": "",
    "A": "0004264440 0242",
    "B": "00063645443303 3342413000",
    "C": "4536160501103041",
    "D": "00062644422000",
    "E": "46060040 0333",
    "F": "460600 0333",
    "G": "45361605011030414323",
    "H": "0006 4046 0343",
    "I": "2026",
    "J": "4641301001",
    "K": "0006 4602 1340",
    "L": "060040",
    "M": "0006234640",
    "N": "00064046",
    "O": "011030414536160501",
    "P": "00063645443303",
    "Q": "011030414536160501 2240",
    "R": "00063645443303 2340",
    "S": "453616050413334241301001",
    "T": "0646 2620",
    "U": "060110304146",
    "V": "062046",
    "W": "0610243046",
    "X": "0046 0640",
    "Y": "0623 462320",
    "Z": "06460040",
    "m": "0004 03142320 23344340",
}


def text_distance(x, y, text, left, base, height):
    """Distance of points to the strokes of `text` (a sign of STROKES each); letters are 0.667 wide,
    one sign every 0.95 of `height`."""
    nearest = np.full(x.shape, 1e9)
    unit_length = height / 6.0
    for k, sign in enumerate(text):
        origin = left + k * 0.95 * height
        for line in STROKES[sign].split():
            points = [
                (origin + int(line[j]) * unit_length, base + int(line[j + 1]) * unit_length)
                for j in range(0, len(line) - 1, 2)
            ]
            for a, b in zip(points, points[1:]):
                nearest = np.minimum(nearest, segment_distance(x, y, a, b))
    return nearest


def text_width(text, height):
    return (0.95 * (len(text) - 1) + 0.667) * height


def ink(distance, half_width, soft):
    """1 on a stroke of the given half width, 0 off it, `soft` wide in between."""
    return 1.0 - smoothstep(half_width - 0.5 * soft, half_width + 0.5 * soft, distance)


def linear_from_srgb(code):
    code = np.asarray(code, dtype=float)
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(value):
    value = np.clip(value, 0.0, 1.0)
    return np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)


def write_picture(path, picture, quality=92):
    """PNG or JPEG (8-bit code values) by the name's ending."""
    codes = np.ascontiguousarray(np.rint(np.clip(picture, 0.0, 1.0) * 255.0).astype(np.uint8))
    spec = oiio.ImageSpec(codes.shape[1], codes.shape[0], codes.shape[2], oiio.UINT8)
    spec.attribute("oiio:ColorSpace", "sRGB")
    spec.attribute("Compression", f"jpeg:{quality}")
    if path.endswith(".png"):
        spec.attribute("png:compressionLevel", 9)
    write(path, spec, codes)


def write_linear(path, picture, pixel_type=oiio.HALF):
    """OpenEXR, scene-linear, with fixed metadata (the writer would put in the clock)."""
    values = np.ascontiguousarray(picture.astype(np.float32))
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], pixel_type)
    spec.attribute("compression", "zip")
    spec.attribute("DateTime", "2000:01:01 00:00:00")
    write(path, spec, values)


def write(path, spec, values):
    file = oiio.ImageOutput.create(path)
    if file is None or not file.open(path, spec):
        raise OSError(oiio.geterror())
    if not file.write_image(values):
        raise OSError(file.geterror())
    file.close()
