"""The room behind the table: wall, window, painting, sideboard with a lamp, chair."""

import numpy as np

import mesh
import pictures
from mesh import merged, revolution, rounded_box
from scene_file import plain, quad

WALL = -6.0
SILL = 0.02  # height of the dado rail


def chair(x, z, turn):
    """Ladder-back: two turned posts and four curved slats; the seat is below the table."""
    parts = []
    for side in (-0.21, 0.21):
        profile = [
            (0.018, -0.9),
            (0.018, 0.06),
            (0.021, 0.08),
            (0.014, 0.10),
            (0.019, 0.14),
            (0.024, 0.165),
            (0.017, 0.19),
            (0.0005, 0.205),
        ]
        parts.append(revolution(profile, 16, 36).moved(side))
    for height in (-0.42, -0.25, -0.08, 0.06):

        def slat(u, v, height=height):
            x = (u - 0.5) * 0.40
            return np.stack(
                [
                    x,
                    height + (v - 0.5) * (0.060 + 0.030 * np.cos(np.pi * (u - 0.5))),
                    -0.05 * np.cos(np.pi * (u - 0.5)),
                ],
                -1,
            )

        front = mesh.surface(slat, 24, 3)
        parts += [front, front.moved(z=-0.012).flipped()]
    return merged(parts).rotated("x", -7).rotated("y", turn).moved(x, 0.0, z)


def room(stage):
    """Wall, window, painting, sideboard with a lamp, chair."""
    stage.paint("wall", pictures.wall(), wrap="clamp")
    stage.objects.append(quad((-3.2, SILL, WALL), (6.4, 0, 0), (0, 3.2, 0), "wall"))
    stage.paint("walnut", pictures.walnut(), specular=(0.16, 0.15, 0.13), shininess=24)
    stage.materials["cream paint"] = plain((0.52, 0.50, 0.43))
    boards = [rounded_box((6.4, 0.05, 0.06), 0.015).moved(0, SILL, WALL + 0.03)]
    for k in range(8):
        boards.append(
            rounded_box((0.66, 0.80, 0.03), 0.012).moved(-2.8 + 0.8 * k, SILL - 0.52, WALL + 0.01)
        )
    boards.append(rounded_box((6.4, 1.2, 0.02), 0.002).moved(0, SILL - 0.62, WALL - 0.01))
    # Window: frame and bars before a bright garden.
    x0, x1, y0, y1 = -1.98, -0.98, 0.16, 1.75
    middle = 0.5 * (x0 + x1)
    for x in (x0, middle, x1):
        boards.append(
            rounded_box((0.07 if x != middle else 0.04, y1 - y0, 0.07), 0.01).moved(
                x, 0.5 * (y0 + y1), WALL + 0.05
            )
        )
    for y in (y0, 0.68, 1.20, y1):
        boards.append(
            rounded_box((x1 - x0, 0.07 if y in (y0, y1) else 0.035, 0.06), 0.01).moved(
                middle, y, WALL + 0.05
            )
        )
    stage.add("joinery.glb", merged(boards), "cream paint")
    stage.glow("garden", pictures.garden(), scale=1.05)
    stage.objects.append(quad((x0, y0, WALL + 0.02), (x1 - x0, 0, 0), (0, y1 - y0, 0), "garden"))
    # Painting in a gilt frame.
    stage.paint("landscape", pictures.landscape(), wrap="clamp")
    px, py, pw, ph = 0.98, 0.86, 0.62, 0.465
    stage.objects.append(
        quad((px - pw / 2, py - ph / 2, WALL + 0.03), (pw, 0, 0), (0, ph, 0), "landscape")
    )
    frame = [
        rounded_box((pw + 0.14, 0.08, 0.06), 0.02).moved(px, py + s * (ph / 2 + 0.03), WALL + 0.03)
        for s in (-1, 1)
    ]
    frame += [
        rounded_box((0.08, ph + 0.14, 0.06), 0.02).moved(px + s * (pw / 2 + 0.03), py, WALL + 0.03)
        for s in (-1, 1)
    ]
    stage.materials["gilt"] = plain((0.34, 0.22, 0.07), (0.5, 0.4, 0.2), 20)
    stage.add("frame.obj", merged(frame), "gilt")
    # Sideboard with a lamp and two jars, at 5.3 m.
    top = -0.16
    board = [rounded_box((1.5, 0.05, 0.50), 0.012, 0.6).moved(1.62, top - 0.025, -5.45)]
    board += [rounded_box((1.44, 0.8, 0.46), 0.006, 0.6).moved(1.62, top - 0.45, -5.45)]
    stage.add("sideboard.ply", merged(board + [chair(-0.62, -3.75, 18)]), "walnut")
    lamp = revolution(
        [
            (0.09, 0.0),
            (0.09, 0.015),
            (0.03, 0.03),
            (0.05, 0.09),
            (0.10, 0.16),
            (0.09, 0.23),
            (0.03, 0.29),
            (0.015, 0.32),
            (0.015, 0.40),
        ],
        32,
        36,
    ).moved(1.62, top, -5.45)
    stage.materials["jade"] = plain((0.13, 0.22, 0.16), (0.4, 0.4, 0.4), 50)
    jar = revolution(
        [(0.05, 0.0), (0.08, 0.05), (0.095, 0.12), (0.07, 0.20), (0.045, 0.23), (0.055, 0.26)],
        28,
        24,
    )
    stage.add(
        "lamp.ply",
        merged([lamp, jar.moved(2.02, top, -5.40), jar.scaled(0.7).moved(1.22, top, -5.38)]),
        "jade",
    )
    stage.glow("shade", pictures.lampshade())
    shade = revolution([(0.20, 0.0), (0.12, 0.26)], 48, 8).moved(1.62, top + 0.36, -5.45)
    stage.add("shade.ply", shade, "shade")
