"""Renders a .blend file of blender_export.py with Cycles:

    blender -b --factory-startup FILE.blend --python blender_render.py -- OUT.exr samples=64

Also seed=0, threads=4, adaptive=0.01 (a noise threshold; off where absent).
"""

import os
import sys

import bpy

out, *words = sys.argv[sys.argv.index("--") + 1 :]
options = dict(word.split("=", 1) for word in words)
scene = bpy.context.scene
scene.cycles.samples = int(options["samples"])
scene.cycles.seed = int(options.get("seed", 0))
scene.cycles.use_adaptive_sampling = "adaptive" in options
if "adaptive" in options:
    scene.cycles.adaptive_threshold = float(options["adaptive"])
    scene.cycles.adaptive_min_samples = 0  # Cycles' own choice
scene.render.threads_mode = "FIXED"
scene.render.threads = int(options.get("threads", os.cpu_count()))
scene.render.filepath = os.path.abspath(out)
bpy.ops.render.render(write_still=True)
