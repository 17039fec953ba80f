#include "core/render/coverage.h"

#include <algorithm>
#include <utility>

#include "core/build_stop.h"

namespace fstop {
namespace {

// A stencil has no emitters brighter than white: where those were splatted samples find it.
std::string stencil_method(const QualitySpec& quality, std::string_view method) {
  if (quality.method == "auto" && !quality.samples) return "auto";
  const bool is_lens = method == "lens-reconstruction" || method == "bokeh-splatting";
  return is_lens ? "lens-sampling" : std::string(method);
}

SimulationSpec stencil_spec(const SimulationSpec& spec, std::string_view method) {
  SimulationSpec stencil = spec;
  stencil.camera.exposure.reset();
  stencil.effects.falloff = EffectChoice::off;
  stencil.quality.method = stencil_method(spec.quality, method);
  stencil.illumination = Illumination::recursive;
  stencil.outputs = {Output::color};
  stencil.halftone.reset();
  return stencil;
}

Image mean_of_channels(const Image& color) {
  Image alpha(color.width(), color.height(), 1);
  for (int y = 0; y < color.height(); ++y) {
    for (int x = 0; x < color.width(); ++x) {
      const float* c = color.at(x, y);
      // Of three equal channels exactly their value.
      const double mean = (double{c[0]} + double{c[1]} + double{c[2]}) / 3.0;
      *alpha.at(x, y) = static_cast<float>(std::clamp(mean, 0.0, 1.0));
    }
  }
  return alpha;
}

}  // namespace

Scene matte_of(const Scene& scene) {
  Scene matte;
  matte.objects = scene.objects;
  for (const Material& material : scene.materials) {
    Material white{.model = ShadingModel::unlit, .emission = {.value = {1.0F, 1.0F, 1.0F}}};
    if (!material.ior) {
      white.transmission = material.transmission;
      white.transmission_exponent = material.transmission_exponent;
    }
    matte.materials.push_back(std::move(white));
  }
  for (Object& object : matte.objects) {
    object.mapping = OwnMapping{};
    if (auto* shape = std::get_if<MeshObject>(&object.shape)) {
      shape->crease_angle.reset();
      shape->mesh.normals.clear();
      shape->mesh.uvs.clear();
    }
  }
  return matte;
}

Coverage coverage(const SimulationSpec& spec, const RayScene& scene, std::string_view method,
                  const RunControl& run) {
  const BuildStop until(run.stop);
  const RayScene matte(matte_of(scene.scene()));
  const Photograph stencil = simulate(stencil_spec(spec, method), matte, run);
  const ImageError& error = stencil.report.error;
  return {.alpha = mean_of_channels(stencil.color),
          .error = error,
          .rays = stencil.report.cost.rays,
          .missed_target = error.upper_95 > error.target};
}

}  // namespace fstop
