"""The far side of the harbour: town, lamps, and their reflection in the water.

The town is a painted screen at 45 m, some three times nearer than it looks. The water's radiance
is that seen from the origin, the only place from which the scene is meant to be photographed.
"""

from dataclasses import dataclass

import numpy as np

import mesh
import pattern
from pattern import fbm, mix, smoothstep, uv_grid

SCREEN_Z, SCREEN_X, SCREEN_Y = -45.0, (-17.5, 17.5), (-1.7, 11.6)
WATER = -1.7
WATER_Z = (-5.5, -45.0)
GLITTER = 2.5  # brighter than nature, as a long evening's eye sees it
PIXEL = 0.036 / 960 * 19.5  # metres per metre of distance: default camera, focus at 2 m

SODIUM, TUNGSTEN, NEUTRAL, COOL = (
    (1.0, 0.52, 0.14),
    (1.0, 0.68, 0.32),
    (1.0, 0.86, 0.66),
    (0.72, 0.86, 1.0),
)
RED, GREEN, PINK, BLUE = (1.0, 0.10, 0.06), (0.10, 0.95, 0.42), (1.0, 0.22, 0.55), (0.22, 0.42, 1.0)


@dataclass
class Emitter:
    place: tuple
    diameter: float
    radiance: tuple


def blur_disc_px(distance):
    """Blur disc of the default camera: 50 mm f/1.4 at 2 m, 37.5 um pixels."""
    image_distance = 1.0 / (1.0 / 0.05 - 1.0 / 2.0)
    return 0.05 / 1.4 * image_distance * abs(0.5 - 1.0 / distance) / 37.5e-6


def emitter(place, size_px, colour, brightness):
    """A sphere `size_px` across in the image whose blur disc is as bright as `brightness`."""
    distance = -place[2]
    source = 0.25 * np.pi * size_px**2
    disc = 0.25 * np.pi * blur_disc_px(distance) ** 2
    level = np.clip(brightness * (disc + source) / source, 5.0, 400.0)
    return Emitter(
        tuple(place), size_px * PIXEL * distance, tuple(float(level * c) for c in colour)
    )


def far_lamps():
    """Promenade, hillside, boats and buoys: some ninety lamps from 9 m to 44 m."""
    random = np.random.RandomState(2)
    lamps = []
    for k, x in enumerate(np.linspace(-16.2, 16.2, 19)):  # promenade
        colour = (SODIUM, SODIUM, TUNGSTEN)[k % 3]
        lamps.append(
            emitter(
                (x + random.uniform(-0.3, 0.3), -0.55 + random.uniform(-0.05, 0.05), -44.0),
                3.0,
                colour,
                random.uniform(0.55, 0.95),
            )
        )
    for _ in range(26):  # hillside
        x = random.uniform(-16.5, 16.5)
        y = -0.1 + random.uniform(0.25, 0.95) * hill(x)
        colour = (TUNGSTEN, NEUTRAL, COOL, SODIUM)[random.randint(4)]
        lamps.append(
            emitter((x, y, -44.5), random.uniform(1.6, 2.4), colour, random.uniform(0.12, 0.42))
        )
    for x, y, colour in (
        (-9.6, 0.12, PINK),
        (-9.1, 0.12, PINK),
        (-8.6, 0.12, PINK),
        (6.2, 0.05, BLUE),
        (6.7, 0.05, BLUE),
        (11.9, 0.25, GREEN),
        (-3.4, 0.0, COOL),
        (-2.9, 0.0, COOL),
    ):  # signs
        lamps.append(emitter((x, y, -43.8), 2.6, colour, 0.55))
    lamps.append(emitter((12.9, 4.35, -44.2), 3.4, NEUTRAL, 1.6))  # the lighthouse
    for x, z, colour in (
        (-6.2, -30.0, RED),
        (5.0, -33.0, GREEN),
        (8.6, -26.0, RED),
        (-10.0, -36.0, GREEN),
    ):
        lamps.append(emitter((x, WATER + 0.55, z), 3.0, colour, 0.7))
    return lamps


def hill(x):
    """Height of the hill's crest above the water at the screen."""
    return 2.6 + 1.5 * np.sin(0.19 * x + 0.6) + 0.7 * np.sin(0.47 * x + 2.0) + 0.05 * x


def skyline(width=1024, height=400):
    """Linear radiance of the screen: afterglow, clouds, hill, three rows of houses, windows."""
    u, v = uv_grid(width, height)
    x = SCREEN_X[0] + u * (SCREEN_X[1] - SCREEN_X[0])
    y = SCREEN_Y[0] + v * (SCREEN_Y[1] - SCREEN_Y[0])
    up = np.clip((y + 1.0) / 12.0, 0, 1)
    sky = pattern.ramp(
        up,
        (0.0, (0.150, 0.066, 0.034)),
        (0.16, (0.085, 0.052, 0.050)),
        (0.36, (0.030, 0.036, 0.062)),
        (0.65, (0.011, 0.019, 0.046)),
        (1.0, (0.005, 0.010, 0.028)),
    )
    sky = sky * (0.75 + 0.55 * np.exp(-(((x + 3.0) / 10.0) ** 2)))[..., None]
    cloud = smoothstep(0.05, 0.55, fbm(x * 0.16, y * 0.55, 5, 0.55, seed=12)) * smoothstep(
        1.0, 4.0, y
    )
    sky = mix(sky, sky * 0.55 + np.array((0.006, 0.006, 0.009)), 0.7 * cloud)
    crest = hill(x) + 0.22 * fbm(x * 1.6, x * 0, 4, 0.55, seed=13)
    picture = mix(
        sky,
        np.array((0.0075, 0.0085, 0.013)) * (1 + 0.4 * fbm(x * 2, y * 2, 4, seed=14))[..., None],
        smoothstep(0.05, -0.05, y - crest),
    )
    for row, (base, tall, wide, tone) in enumerate(
        ((0.35, 1.35, 0.80, 0.8), (-0.25, 1.25, 0.95, 1.1), (-0.95, 1.35, 1.15, 1.5))
    ):
        picture = houses(picture, x, y, base, tall, wide, tone, 20 + row)
    tower = (np.abs(x - 12.9) < 0.30 - 0.03 * (y + 1.0)) & (y < 4.1)
    gallery = ((np.abs(x - 12.9) < 0.30) & (np.abs(y - 4.1) < 0.07)) | (
        (np.abs(x - 12.9) < 0.13) & (y > 4.1) & (y < 4.75)
    )
    picture[tower] = (0.020, 0.019, 0.020)
    picture[tower & (np.floor((y + 1.7) / 0.9) % 2 == 0)] = (0.030, 0.010, 0.009)
    picture[gallery] = (0.010, 0.010, 0.012)
    quay = smoothstep(0.02, -0.02, y + 1.15)
    stone = (
        np.array((0.030, 0.020, 0.012))
        * (1 + 0.6 * np.cos(2 * np.pi * (x + 16.2) / 1.8))[..., None]
    )
    return np.maximum(mix(picture, stone, quay), 0.0)


def houses(picture, x, y, base, tall, wide, tone, seed):
    """A row of gabled fronts with some windows lit."""
    random = np.random.RandomState(seed)
    edges = [SCREEN_X[0] - 1.0]
    while edges[-1] < SCREEN_X[1] + 1.0:
        edges.append(edges[-1] + wide * random.uniform(0.7, 1.4))
    edges = np.array(edges)
    house = np.clip(np.searchsorted(edges, x) - 1, 0, len(edges) - 2)
    rise = tall * random.uniform(0.6, 1.25, len(edges))
    gable = random.uniform(0.15, 0.45, len(edges))
    colour = np.array([0.014, 0.011, 0.010]) * tone * random.uniform(
        0.6, 1.5, (len(edges), 1)
    ) + random.uniform(0, 0.004, (len(edges), 3))
    inside = (x - edges[house]) / (edges[house + 1] - edges[house])
    roof = base + rise[house] + gable[house] * (1 - np.abs(2 * inside - 1))
    body = smoothstep(0.02, -0.02, y - roof)
    front = colour[house] * (0.8 + 1.3 * np.exp(-(y + 1.0) / 0.5))[..., None]
    front = np.where((y > base + rise[house])[..., None], front * 0.55, front)
    column, line = np.floor(inside * 4), np.floor((y - base) / 0.30)
    key = (house * 31 + column * 7 + line * 13 + seed * 5).astype(int) % 997
    lottery = random.uniform(size=997)[key]
    hue = np.array([TUNGSTEN, SODIUM, NEUTRAL, TUNGSTEN, COOL])[(key * 7) % 5]
    fx, fy = (inside * 4) % 1, ((y - base) / 0.30) % 1
    pane = (np.abs(fx - 0.5) < 0.24) & (np.abs(fy - 0.5) < 0.30) & (y < base + rise[house] - 0.06)
    lit = pane & (lottery < 0.30)
    glow = np.where(
        lit[..., None],
        hue * (0.25 + 2.4 * lottery / 0.30)[..., None],
        np.where(pane[..., None], front * 0.4, front),
    )
    return mix(picture, glow, body)


def water_mesh():
    """Water from 5.5 m to the screen; its uv are the image's columns and rows."""
    v = np.linspace(0.0, 1.0, 97)
    z = 1.0 / ((1.0 - v) / WATER_Z[0] + v / WATER_Z[1])
    u = np.linspace(0.0, 1.0, 25)
    uu, zz = np.meshgrid(u, z)
    positions = np.stack([(uu - 0.5) * 0.84 * -zz, np.full_like(uu, WATER), zz], -1)
    uv = np.stack([uu, np.repeat(v[:, None], 25, axis=1)], -1)
    return mesh.Mesh(
        positions.reshape(-1, 3),
        np.tile([0.0, 1.0, 0.0], (uv[..., 0].size, 1)),
        uv.reshape(-1, 2),
        mesh.grid_triangles(24, 96),
    )


def water(lamps, screen, hulls, width=1024, height=512):
    """Linear radiance of the water: each lamp's glitter (Cox and Munk 1954: the share of facets
    with the slope that mirrors it), the town upside down, ripples that break both up."""
    u, v = uv_grid(width, height)
    z = 1.0 / ((1.0 - v) / WATER_Z[0] + v / WATER_Z[1])
    x = (u - 0.5) * 0.84 * -z
    place = np.stack([x, np.full_like(x, WATER), z], -1)
    distance = np.linalg.norm(place, axis=-1)
    to_eye = -place / distance[..., None]
    grazing = to_eye[..., 1]
    mirror = 0.02 + 0.98 * (1.0 - grazing) ** 5
    # Ripples: long crests across the view, finer with distance because of perspective.
    chop = fbm(x * 1.1, z * 3.2, 5, 0.62, seed=31) + 0.6 * fbm(
        x * 3.5 + 9, z * 9.0, 4, 0.6, seed=32
    )
    slope_x, slope_z = 0.030, 0.062
    radiance = np.zeros_like(place)
    for lamp in lamps:
        to_lamp = np.array(lamp.place) - place
        gap = np.linalg.norm(to_lamp, axis=-1)
        half = to_lamp / gap[..., None] + to_eye
        half /= np.linalg.norm(half, axis=-1, keepdims=True)
        sx = half[..., 0] / half[..., 1] + 0.010 * chop
        sz = half[..., 2] / half[..., 1] + 0.050 * chop
        facets = np.exp(-0.5 * ((sx / slope_x) ** 2 + (sz / slope_z) ** 2)) / (
            2 * np.pi * slope_x * slope_z
        )
        solid = GLITTER * 0.25 * np.pi * lamp.diameter**2 / gap**2
        radiance += (facets * solid * mirror / (4 * np.maximum(grazing, 0.02) * half[..., 1] ** 4))[
            ..., None
        ] * lamp.radiance
    # The screen upside down, smeared along the view.
    rows, columns = screen.shape[:2]
    total = np.zeros_like(place)
    for k in range(12):
        tilt = (k - 5.5) / 6.0 * 0.075 + 0.045 * chop
        rise = np.abs(grazing + 2 * tilt * 0.5) + 0.004
        reach = (z - SCREEN_Z) / np.maximum(-(place[..., 2] / distance), 0.1)
        at_x = x + x / distance * reach + 0.25 * chop
        at_y = WATER + rise * reach
        i = np.clip(
            ((at_x - SCREEN_X[0]) / (SCREEN_X[1] - SCREEN_X[0]) * columns).astype(int),
            0,
            columns - 1,
        )
        j = np.clip(
            ((SCREEN_Y[1] - at_y) / (SCREEN_Y[1] - SCREEN_Y[0]) * rows).astype(int), 0, rows - 1
        )
        total += np.minimum(screen[j, i], 0.6)
    radiance += total / 12.0 * mirror[..., None]
    for left, right, at in hulls:  # what a hull hides of the far shore
        under = smoothstep(
            0.06, -0.02, np.abs(x / -z - 0.5 * (left + right)) - 0.5 * (right - left)
        ) * smoothstep(0.0, 0.4, z - at)
        fade = np.exp(-(z - at).clip(0) / (0.14 * -at))
        radiance *= (1.0 - 0.8 * under * fade)[..., None]
    return radiance * (1.0 + 0.25 * chop[..., None]).clip(0.2) + np.array((0.0008, 0.0014, 0.0030))
