#include "core/render/light_tracing.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>

#include "core/camera/film_projection.h"
#include "core/sampling/stream.h"
#include "core/shading/illumination.h"
#include "core/shading/light.h"
#include "core/shading/material.h"
#include "core/shading/ray_tree.h"

namespace fstop {
namespace {

constexpr std::uint32_t kChunk = 1024;  // paths that one thread traces between two looks at a list
constexpr std::uint32_t kChunksAtOnce = 256;
constexpr int kLongestPath = 64;                 // turns
constexpr std::uint32_t kStream = 0x11c4'77a9U;  // apart from camera rays' and splats' samples
constexpr std::uint32_t kFewestPaths = 1U << 12;
constexpr std::uint32_t kMostPaths = 1U << 24;

bool is_sheet(const Material& material) { return material.transmission > 0.0 && !material.ior; }

// Where light goes on from a surface, and how much of it.
struct Shares {
  float mirrored = 0.0F;
  float onwards = 0.0F;
  float kept = 1.0F;  // of what the surface scatters
  float eta = 1.0F;   // index on the ray's side over the one beyond
};

Shares shares_of(const Material& material, float cosine, bool outside) {
  Shares shares{.mirrored = static_cast<float>(material.reflection),
                .onwards = static_cast<float>(material.transmission)};
  if (material.ior) {
    const auto index = static_cast<float>(*material.ior);
    shares.eta = outside ? 1.0F / index : index;
    if (!material.fresnel) return shares;
    const float reflectance = fresnel_reflectance(std::clamp(cosine, 0.0F, 1.0F), shares.eta);
    shares.mirrored *= reflectance;
    shares.onwards *= 1.0F - reflectance;
  } else {
    shares.kept = 1.0F - shares.onwards;
    shares.mirrored *= shares.kept;
  }
  return shares;
}

float largest(const Rgb& color) { return std::max({color[0], color[1], color[2]}); }

struct Splat {
  std::uint32_t pixel = 0;
  Rgb light = {};
};
struct ChunkLight {
  std::vector<Splat> splats = {};
  std::uint64_t rays = 0;
};

// Sixteen paths.
struct Paths {
  SampleKeys keys = {};
  RayPacket ray = {};
  alignas(64) LaneMask alive = {};
  std::array<Rgb, kLanes> weight = {};
  std::array<float, kLanes> length = {};  // metres, to the first scattering surface
  std::array<bool, kLanes> turned = {};
  std::array<bool, kLanes> scattered = {};
};

// Carries one aim's light.
class Carrier {
 public:
  Carrier(const LightCarrier& carrier, const FilmProjection& film, std::uint32_t aim,
          std::uint32_t replicate, std::uint32_t count)
      : rays_(carrier.rays),
        scene_(carrier.rays.scene),
        film_(film),
        aim_(carrier.aims[aim]),
        light_(scene_.scene().lights[aim_.light]),
        sequence_(hash_of(carrier.seed, kStream + replicate)),
        pixel_key_(hash_of(aim_.light, 0x51a3U + aim_.object)),
        share_(1.0F / static_cast<float>(count)),
        aimer_(scene_, aim_, rays_.shutter_seconds) {}

  void trace(std::uint32_t first, std::uint32_t count, ChunkLight& chunk) const {
    for (std::uint32_t begin = 0; begin < count; begin += kLanes) {
      Paths paths;
      paths.keys.pixel.fill(pixel_key_);
      for (std::uint32_t i = 0; i < kLanes; ++i) paths.keys.index[i] = first + begin + i;
      start(paths);
      for (std::uint32_t turn = 0; turn < kLongestPath && go_on(paths, turn, chunk); ++turn) {
      }
    }
  }

 private:
  void start(Paths& paths) const {
    LaneValues u, v, s, t, time = {};
    sequence_.fill(paths.keys, Dimension::pixel_x, u);
    sequence_.fill(paths.keys, Dimension::pixel_y, v);
    sequence_.fill(paths.keys, Dimension::light_u, s);
    sequence_.fill(paths.keys, Dimension::light_v, t);
    if (rays_.shutter_seconds > 0.0F) sequence_.fill(paths.keys, Dimension::time, time);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double seconds = time[k] * double{rays_.shutter_seconds};
      const double factor =
          aimer_.aim({u[k], v[k]}, {s[k], t[k]}, seconds, static_cast<int>(k), paths.ray);
      paths.alive[k] = factor > 0.0 ? -1 : 0;
      paths.weight[k] = light_.intensity * (static_cast<float>(factor) * share_);
    }
  }

  float radial(float distance) const {
    return std::visit(
        [&](const auto& lamp) {
          if constexpr (requires { lamp.attenuation; })
            return distance * distance * radial_attenuation(lamp.attenuation, distance);
          else
            return 1.0F;
        },
        light_.kind);
  }

  // To the next surface; what it scatters goes to the film, what it sends on becomes the paths'
  // next ray. False where all paths have ended.
  bool go_on(Paths& paths, std::uint32_t turn, ChunkLight& chunk) const {
    bool any = false;
    for (const std::int32_t lane : paths.alive) {
      chunk.rays += lane != 0 ? 1U : 0U;
      any = any || lane != 0;
    }
    if (!any) return false;
    scene_.intersect(paths.ray, paths.alive, Coherence::incoherent);
    LaneSurfaces surfaces;
    LaneColors diffuse;
    const SampleKeys keys = stream_keys(paths.keys, 0x9000U + turn);
    Views views;
    look(keys, paths, views);
    const ShadingInputs inputs{.scene = scene_,
                               .sequence = sequence_,
                               .keys = keys,
                               .film = &views.places,
                               .illumination = Illumination::global};
    diffuse_colors(inputs, paths.ray, paths.alive, surfaces, diffuse);
    LaneValues u, v;
    sequence_.fill(keys, Dimension::light_u, u);
    sequence_.fill(keys, Dimension::light_v, v);
    any = false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (paths.alive[k] == 0) continue;
      if (surfaces.material[k] < 0) {
        paths.alive[k] = 0;
        continue;
      }
      const Rgb color = diffuse.get(static_cast<int>(k));
      if (!paths.scattered[k]) paths.length[k] += paths.ray.far[k];
      if (paths.turned[k]) send_to_film(paths, k, surfaces, color, views, chunk);
      const float chance = sequence_.decision(keys.pixel[k], keys.index[k]);
      paths.alive[k] = next_ray(paths, k, surfaces, color, chance, {u[k], v[k]}) ? -1 : 0;
      any = any || paths.alive[k] != 0;
    }
    return any;
  }

  struct Views {
    LaneValues lens_x = {};  // metres
    LaneValues lens_y = {};
    LaneValues raster_x = {};
    LaneValues raster_y = {};
    LaneValues z = {};  // metres along the axis
    FilmPlaces places = {};
  };

  Vec3 seen_from_camera(const Paths& paths, std::size_t k, Vec3f world) const {
    const float seconds = paths.ray.time[k] * static_cast<float>(kLongestShutter);
    const Vec3f shifted = world - rays_.velocity * seconds;
    return film_.world_from_camera.from_world(
        {double{shifted.x}, double{shifted.y}, double{shifted.z}});
  }

  // Where the points that were hit would fall on the film, each through a point of the pupil.
  void look(const SampleKeys& keys, const Paths& paths, Views& views) const {
    sequence_.fill(keys, Dimension::lens_u, views.lens_x);
    sequence_.fill(keys, Dimension::lens_v, views.lens_y);
    rays_.pupil.apply(views.lens_x, views.lens_y);
    views.places = FilmPlaces(film_.width, film_.height, 0.0F);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double radius = rays_.samples_pupil ? film_.pupil_radius : 0.0;
      views.lens_x[k] *= radius;
      views.lens_y[k] *= radius;
      const int lane = static_cast<int>(k);
      if (paths.alive[k] == 0 || !paths.ray.hit(lane)) continue;
      const Vec3f hit = paths.ray.origin(lane) + paths.ray.direction(lane) * paths.ray.far[k];
      const Vec3 point = seen_from_camera(paths, k, hit);
      views.z[k] = point.z;
      if (!(point.z > 0.0)) continue;
      const Vec2 raster = film_.raster(point, views.lens_x[k], views.lens_y[k]);
      views.raster_x[k] = raster.x;
      views.raster_y[k] = raster.y;
      views.places.set(k, static_cast<float>(raster.x), static_cast<float>(raster.y));
    }
  }

  void send_to_film(const Paths& paths, std::size_t k, const LaneSurfaces& surfaces,
                    const Rgb& color, const Views& views, ChunkLight& chunk) const {
    const bool inside = views.z[k] > 0.0 && views.raster_x[k] >= 0.0 && views.raster_y[k] >= 0.0 &&
                        views.raster_x[k] < film_.width && views.raster_y[k] < film_.height;
    if (!inside || !(largest(color) > 0.0F)) return;
    const int lane = static_cast<int>(k);
    const Vec3f direction = paths.ray.direction(lane);
    const Vec3f face = surfaces.face(k);
    const Vec3f normal = surfaces.normal(k);
    const Vec3f position = surfaces.position(k);
    const Vec3 point = seen_from_camera(paths, k, position);
    const Vec3 lens{views.lens_x[k], views.lens_y[k], 0.0};
    const Vec3 ray = point - lens;
    const double distance = norm(ray);
    const Vec3f to_point = to_float(film_.world_from_camera.vector(ray * (1.0 / distance)));
    const float facing = -dot(face, to_point);
    const float arriving = -dot(normal, direction);
    if (!(facing > 0.0F) || !(arriving > 0.0F)) return;  // seen from behind, or lit from there
    const Vec3f origin = position + face * surfaces.error[k];
    const float passed = scene_.transmittance(origin, to_point * -1.0F,
                                              static_cast<float>(distance), paths.ray.time[k]);
    ++chunk.rays;
    if (!(passed > 0.0F)) return;
    const Material& material = scene_.material(surfaces.material[k]);
    const float kept = is_sheet(material) ? 1.0F - static_cast<float>(material.transmission) : 1.0F;
    const double area_px =
        film_.px_per_steradian(ray.z / distance) * double{facing} / (distance * distance);
    double factor = area_px * double{rays_.exposure} * double{passed * kept} *
                    double{irradiance_ratio(direction, normal, face)};
    if (!paths.scattered[k]) factor *= double{radial(paths.length[k])};
    const Vec2 raster{views.raster_x[k], views.raster_y[k]};
    if (rays_.falloff)
      factor *= std::visit([&](const auto& any) { return any.falloff(raster); }, rays_.camera);
    // What lamps light answers in full, what surfaces light as ray_tree scatters it.
    const float most = paths.scattered[k] ? 1.0F : kFar;
    Splat splat{.pixel = static_cast<std::uint32_t>(static_cast<int>(raster.y) * film_.width +
                                                    static_cast<int>(raster.x))};
    for (std::size_t c = 0; c < 3; ++c)
      splat.light[c] = static_cast<float>(factor) * paths.weight[k][c] * std::min(color[c], most);
    chunk.splats.push_back(splat);
  }

  // Paths meet a surface as often as its face says, camera rays light it as its shading normal
  // does. Source: Veach 1997, 5.3.
  static float irradiance_ratio(Vec3f direction, Vec3f normal, Vec3f face) {
    const float as_faced = std::abs(dot(face, direction));
    return as_faced > 0.0F ? std::max(0.0F, -dot(normal, direction)) / as_faced : 0.0F;
  }

  // Chooses among the ways on, each as often as it carries light; what is left ends the path.
  bool next_ray(Paths& paths, std::size_t k, const LaneSurfaces& surfaces, const Rgb& color,
                float chance, Vec2 uv) const {
    const int lane = static_cast<int>(k);
    const Material& material = scene_.material(surfaces.material[k]);
    const Vec3f direction = paths.ray.direction(lane);
    const Vec3f normal = surfaces.normal(k);
    const bool outside = surfaces.outside[k] != 0;
    Shares shares = shares_of(material, -dot(direction, normal), outside);
    Rgb scatters = {0, 0, 0};
    if (!paths.turned[k]) {
      if (paths.ray.object[k] != aim_.object) {
        // Straight on through sheets, else this light is another aim's or found by shadow rays.
        if (!is_sheet(material)) return false;
        shares.mirrored = 0.0F;
      } else if (!material.ior) {
        shares.onwards = 0.0F;  // straight through a sheet light has not turned
      }
    } else {
      const bool answers = -dot(normal, direction) > 0.0F;
      for (std::size_t c = 0; c < 3; ++c)
        scatters[c] = answers ? shares.kept * std::min(color[c], 1.0F) : 0.0F;
    }
    const float scattered = largest(scatters);
    const float sum = shares.mirrored + shares.onwards + scattered;
    // Above 1 all go on and weigh more.
    const float scale = std::max(1.0F, sum);
    const float at = chance * scale;
    Vec3f next;
    if (at < shares.mirrored) {
      next =
          spread(mirrored(direction, normal), material.reflection_exponent, surfaces.face(k), uv);
      paths.turned[k] = true;
      paths.weight[k] = paths.weight[k] * scale;
    } else if (at < shares.mirrored + shares.onwards) {
      next = direction;
      float gain = scale;
      if (material.ior) {
        const bool passes = refracted(direction, normal, shares.eta, next);
        if (passes) gain *= shares.eta * shares.eta;
        if (!passes) next = mirrored(direction, normal);
        next = spread(next, material.transmission_exponent, surfaces.face(k), uv);
        paths.turned[k] = true;
      }
      paths.weight[k] = paths.weight[k] * gain;
    } else if (at < sum) {
      next = spread(normal, 1.0, surfaces.face(k), uv);
      float gain = scale * irradiance_ratio(direction, normal, surfaces.face(k)) / scattered;
      if (!paths.scattered[k]) gain *= radial(paths.length[k]);
      for (std::size_t c = 0; c < 3; ++c) paths.weight[k][c] *= gain * scatters[c];
      paths.scattered[k] = true;
    } else {
      return false;
    }
    const Vec3f face = surfaces.face(k);
    const float side = dot(face, next) >= 0.0F ? 1.0F : -1.0F;
    paths.ray.set(lane, surfaces.position(k) + face * (side * surfaces.error[k]), normalized(next),
                  kFar, paths.ray.time[k]);
    return true;
  }

  // As ray_tree: about the ideal direction, on its side of the face.
  static Vec3f spread(Vec3f ideal, const std::optional<double>& exponent, Vec3f face, Vec2 uv) {
    if (!exponent) return ideal;
    const Vec3f axis = normalized(ideal);
    const Vec3f chosen = lobe_direction(axis, static_cast<float>(*exponent),
                                        static_cast<float>(uv.x), static_cast<float>(uv.y));
    return dot(chosen, face) * dot(axis, face) < 0.0F ? mirrored(chosen, face) : chosen;
  }

  const SampleSource& rays_;
  const RayScene& scene_;
  const FilmProjection& film_;
  LightAim aim_;
  const Light& light_;
  SampleSequence sequence_;
  std::uint32_t pixel_key_;
  float share_;
  LightAimer aimer_;
};

}  // namespace

std::uint64_t carry_light(const LightCarrier& carrier, std::uint32_t replicate, std::uint32_t count,
                          SplatImage& light, const RunControl& run) {
  const FilmProjection film(carrier.rays.camera);
  std::uint64_t rays = 0;
  for (std::uint32_t aim = 0; aim < carrier.aims.size(); ++aim) {
    const Carrier one(carrier, film, aim, replicate, count);
    std::vector<ChunkLight> chunks;
    for (std::uint32_t first = 0; first < count; first += kChunk * kChunksAtOnce) {
      const std::uint32_t left = (count - first + kChunk - 1) / kChunk;
      chunks.assign(std::min(left, kChunksAtOnce), {});
      parallel_for(run, static_cast<int>(chunks.size()), [&](int i) {
        const std::uint32_t begin = first + static_cast<std::uint32_t>(i) * kChunk;
        one.trace(begin, std::min(kChunk, count - begin), chunks[static_cast<std::size_t>(i)]);
      });
      throw_if_stopped(run);
      for (const ChunkLight& chunk : chunks) {  // in order: sums do not depend on threads
        rays += chunk.rays;
        for (const Splat& splat : chunk.splats) {
          double* const pixel = light.at(splat.pixel);
          for (std::size_t c = 0; c < 3; ++c) pixel[c] += static_cast<double>(splat.light[c]);
        }
      }
    }
  }
  return rays;
}

CarriedLight carry_light(const LightCarrier& carrier, double goal_mse, double most_paths,
                         ReplicateFilm& film, const RunControl& run) {
  CarriedLight result;
  if (carrier.aims.empty()) return result;
  const RunControl silent{.stop = run.stop, .workers = run.workers};
  const double each = static_cast<double>(kReplicates * carrier.aims.size());
  std::uint32_t first = kFewestPaths;
  while (first > kLanes && each * first > most_paths) first /= 4;  // of many aims
  for (std::uint32_t count = first;; count *= 4) {
    std::array<Image, kReplicates> images;
    for (std::uint32_t r = 0; r < kReplicates; ++r) {
      SplatImage light(film.grid().width, film.grid().height);
      result.rays += carry_light(carrier, r, count, light, silent);
      images[r] = image_of(light);
    }
    result.paths = static_cast<std::uint64_t>(each) * count;
    double squares = 0.0;
    double light = 0.0;
    for (std::size_t i = 0; i < images[0].pixels().size(); ++i) {
      const double a = std::clamp(double{images[0].pixels()[i]}, 0.0, 1.0);
      const double b = std::clamp(double{images[1].pixels()[i]}, 0.0, 1.0);
      squares += 0.25 * (a - b) * (a - b);
      light += 0.25 * (a + b) * (a + b);
    }
    const auto values = static_cast<double>(images[0].pixels().size());
    result.mse = squares / values;
    result.rms = std::sqrt(light / values);
    // As the error falls with the paths, at least.
    const bool is_enough =
        result.mse <= goal_mse || count >= kMostPaths || 4.0 * each * count > most_paths;
    if (!is_enough) continue;
    for (int r = 0; r < kReplicates; ++r) film.add_extra(r, images[static_cast<std::size_t>(r)]);
    return result;
  }
}

}  // namespace fstop
