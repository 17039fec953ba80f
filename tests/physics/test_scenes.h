#pragma once

#include "core/camera/camera_spec.h"
#include "core/encode/image_codec.h"
#include "core/render/simulation.h"
#include "core/scene/scene.h"

namespace fstop {

/// 50 mm focused at 2 m before a sensor of square pixels of `pitch`, looking along -z.
SimulationSpec lens_shot(double f_number, Length pitch, int width, int height);
/// A hole before the same sensor, 50 mm away.
SimulationSpec pinhole_shot(Length diameter, Length pitch, int width, int height);

/// A parallelogram of constant radiance 1 at `depth` in front of the camera, world frame.
Object glowing_quad(Vec3 corner, Vec3 edge_u, Vec3 edge_v);
/// A square on the axis whose pinhole image is `side_px` wide for `shot`'s camera.
Object glowing_square(const SimulationSpec& shot, Length depth, double side_px);

/// Black surroundings, one unlit white material, the given objects.
Scene glowing_scene(std::vector<Object> objects);

/// Renders, encodes as EXR, decodes: channels R, G, B of the finished file.
Image finished_exr(const SimulationSpec& spec, const RayScene& scene, int threads = 2);

}  // namespace fstop
