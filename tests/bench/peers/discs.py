"""The discs that small bright emitters become, and whether their light is all there."""

import math

import numpy as np

from scene_model import Sphere

BRIGHT = 4.0  # radiance from which a sphere counts as a bright emitter
SMALL = 0.5  # its image in focus, as a share of its blur disc


class Disc:
    def __init__(self, x, y, radius):
        self.x, self.y, self.radius = x, y, radius  # pixels

    def mask(self, shape):
        rows, columns = np.mgrid[: shape[0], : shape[1]] + 0.5
        return (columns - self.x) ** 2 + (rows - self.y) ** 2 <= self.radius**2


def find_discs(model):
    """Discs wholly in the picture, of spheres small against their blur.

    Blur diameter: A v |1/s - 1/d| on the picture plane at v (Gaussian lens, similar triangles).
    """
    camera = model.camera
    per_metre = camera.pixels[0] / camera.sensor[0]
    found = []
    for shape, name in model.objects:
        if not isinstance(shape, Sphere):
            continue
        glow = model.materials[name].glow
        if max((max(colour.scale) for colour in glow), default=0) < BRIGHT:
            continue
        offset = np.array(shape.center) - camera.position
        depth = float(offset @ camera.forward)
        if depth <= 0:
            continue
        scale = camera.image_distance / depth * per_metre
        x = camera.pixels[0] / 2 + float(offset @ camera.right) * scale
        y = camera.pixels[1] / 2 - float(offset @ camera.up) * scale
        vergence = abs(1 / camera.focus_distance - 1 / depth)
        blur = camera.aperture_diameter * camera.image_distance * vergence * per_metre / 2
        sharp = shape.radius * scale
        radius = blur + sharp + 1.5
        inside = all(radius <= at <= n - radius for at, n in zip((x, y), camera.pixels))
        if inside and sharp <= SMALL * blur and math.isfinite(radius):
            found.append(Disc(x, y, radius))
    return found


class DiscEnergy:
    """Sums of unclipped values over every disc, against the reference's."""

    def __init__(self, model, reference):
        shape = reference.mean.shape
        self.masks = [disc.mask(shape) for disc in find_discs(model)]
        self.true = self.sums(reference.mean)
        noise = (reference.pictures[0] - reference.pictures[-1]) / 2
        self.noise = self.sums(noise) / self.true if self.masks else np.zeros(0)

    def sums(self, picture):
        return np.array([picture[mask].sum() for mask in self.masks])

    def figures(self, picture):
        if not self.masks:
            return {}
        ratio = self.sums(picture.astype(np.float64)) / self.true
        return {
            "discs": len(ratio),
            "disc_energy": float((ratio * self.true).sum() / self.true.sum()),
            "disc_least": float(ratio.min()),
            "disc_most": float(ratio.max()),
            "disc_rms": float(np.sqrt(((ratio - 1) ** 2).mean())),
            "disc_rms_of_reference": float(np.sqrt((self.noise**2).mean())),
        }
