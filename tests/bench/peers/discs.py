"""The discs that small bright emitters become, and whether their light is all there."""

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


def bright_discs(model):
    """The disc of every bright sphere before the camera, and whether it is small.

    Blur diameter: A v |1/s - 1/d| on the picture plane at v (Gaussian lens, similar triangles).
    """
    camera = model.camera
    per_metre = camera.pixels[0] / camera.sensor[0]
    for shape, name in model.objects:
        if not isinstance(shape, Sphere):
            continue
        glow = model.materials[name].glow
        offset = np.array(shape.center) - camera.position
        depth = float(offset @ camera.forward)
        if depth <= 0 or max((max(colour.scale) for colour in glow), default=0) < BRIGHT:
            continue
        scale = camera.image_distance / depth * per_metre
        x = camera.pixels[0] / 2 + float(offset @ camera.right) * scale
        y = camera.pixels[1] / 2 - float(offset @ camera.up) * scale
        vergence = abs(1 / camera.focus_distance - 1 / depth)
        blur = camera.aperture_diameter * camera.image_distance * vergence * per_metre / 2
        sharp = shape.radius * scale
        yield Disc(x, y, blur + sharp + 1.5), sharp <= SMALL * blur


def find_discs(model):
    """Discs wholly in the picture, of spheres small against their blur."""

    def is_inside(disc):
        sides = zip((disc.x, disc.y), model.camera.pixels)
        return all(disc.radius <= at <= side - disc.radius for at, side in sides)

    return [disc for disc, small in bright_discs(model) if small and is_inside(disc)]


def outside_discs(model, shape):
    """Pixels that no bright sphere's disc reaches: where models can be told apart from noise."""
    outside = np.ones(shape[:2], bool)
    for disc, _ in bright_discs(model):
        outside &= ~disc.mask(shape)
    return outside


class DiscEnergy:
    """Sums of unclipped values over every disc, against the reference's."""

    def __init__(self, model, reference):
        shape = reference.mean.shape
        self.masks = [disc.mask(shape) for disc in find_discs(model)]
        self.outside = outside_discs(model, shape)
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
