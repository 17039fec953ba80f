#include "server/cost_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <mutex>
#include <unordered_map>
#include <variant>

#include "server/regression.h"

namespace fstop::server {
namespace {

constexpr std::size_t kMostGroups = 4096;
constexpr std::size_t kRemembered = 64;  // renders of a group
constexpr double kFewestChosen = 4.0;    // samples of a pixel, whatever error is asked for
// Resident memory at 2400 x 1600 over that at 600 x 400, measured: 341 bytes a pixel for `wave`,
// which `auto` may choose, at most 150 for the others; 380 MiB once for a bundled scene and its
// planning.
constexpr double kBytesPerPixelOfWaves = 350.0;
constexpr double kBytesPerPixel = 150.0;
constexpr double kBytesOnce = 384.0 * (1 << 20);

// Logarithms, about a usual request: pixels, error, working f-number; diffraction in pixels.
struct Features {
  double pixels = 0.0;
  double error = 0.0;
  double f_number = 0.0;
  double diffraction = 0.0;
  double samples = 0.0;  // where they are forced
  bool is_forced = false;
};

double pixels_of(const SimulationSpec& spec) {
  return static_cast<double>(spec.width) * static_cast<double>(spec.height);
}

double bytes_of_waves(const SimulationSpec& spec, double diffraction_px) {
  return std::max(kBytesPerPixelOfWaves * pixels_of(spec),
                  transform_bytes(diffraction_px, spec.width, spec.height));
}

Features features_of(const SimulationSpec& spec) {
  const QualitySpec& quality = spec.quality;
  const double f_number = std::max(working_f_number(spec.camera), 1e-3);
  const double pitch_m = spec.camera.sensor_width.si() / spec.width;
  return {.pixels = std::log(pixels_of(spec) / 4e4),
          .error = std::log(std::max(quality.max_error, 1e-6) / 0.01),
          .f_number = std::log(f_number / 4.0),
          .diffraction = std::log(spec.camera.wavelength.si() * f_number / pitch_m),
          .samples = quality.samples ? std::log(static_cast<double>(*quality.samples)) : 0.0,
          .is_forced = quality.samples.has_value()};
}

// Square of the distance between requests, in units within which their costs are alike.
double distance(const Features& a, const Features& b) {
  if (a.is_forced != b.is_forced) return 16.0;
  const double quality = a.is_forced ? a.samples - b.samples : a.error - b.error;
  const double pixels = (a.pixels - b.pixels) / 1.5;
  const double f_number = (a.f_number - b.f_number) / 1.5;
  return quality * quality + pixels * pixels + f_number * f_number;
}

// The same for their methods, which forced samples do not change.
double planning_distance(const Features& a, const Features& b) {
  const double diffraction = (a.diffraction - b.diffraction) / 0.4;
  const double f_number = (a.f_number - b.f_number) / 0.6;
  const double error = (a.error - b.error) / 1.5;
  return diffraction * diffraction + f_number * f_number + error * error;
}

// Logarithm of the samples that an error takes.
using SampleModel = Regression<4>;
SampleModel::Vector sample_terms(const Features& f) { return {1.0, f.error, f.pixels, f.f_number}; }

// Logarithm of nanoseconds a pixel.
using TimeModel = Regression<4>;
TimeModel::Vector time_terms(const Features& f, double samples, bool is_wave) {
  // Waves are made of planes of spectra: samples count where they are forced. Else a pixel's own
  // cost is that of some samples; in small pictures rays lie farther apart and cost more.
  const double forced = f.is_forced ? f.samples - std::log(32.0) : 0.0;
  return {1.0, is_wave ? forced : std::log(samples + 3.0), f.pixels, f.f_number};
}

// Of the bundled scenes, on one core at 2.6 GHz.
SampleModel first_samples() { return {{3.4, -1.45, -0.25, -0.05}, {1.0, 0.2, 0.15, 0.15}}; }
TimeModel first_times(bool is_wave) {
  return is_wave ? TimeModel({9.4, 0.4, -0.3, 0.3}, {0.7, 0.3, 0.2, 0.2})
                 : TimeModel({5.9, 0.88, -0.27, 0.0}, {1.0, 0.15, 0.1, 0.05});
}
constexpr double kSampleNoise = 0.4;  // of logarithms
constexpr double kTimeNoise = 0.3;
constexpr int kEnoughElsewhere = 10;  // renders, to be believed of other scenes

/// What was learnt of some renders that are alike.
struct Models {
  std::array<SampleModel, 2> samples = {first_samples(), first_samples()};  // by is_wave
  std::array<TimeModel, 2> times = {first_times(false), first_times(true)};

  double chosen_samples(const Features& f, bool is_wave) const {
    return std::max(kFewestChosen, std::exp(samples[is_wave].predicted(sample_terms(f))));
  }
};

struct Group {
  struct Render {
    Features features = {};
    bool is_wave = false;
    double left = 0.0;  // of the logarithm of its time, that the models do not tell
  };
  Models models = {};
  std::deque<Render> renders = {};
};

bool is_pinhole(const SimulationSpec& spec) {
  return std::holds_alternative<PinholeSpec>(spec.camera.optics);
}

// Renders of one kind choose among the same methods.
std::string kind_of(const SimulationSpec& spec) {
  std::string kind = spec.quality.method + (is_pinhole(spec) ? "/pinhole" : "/lens");
  for (const EffectChoice effect :
       {spec.effects.defocus, spec.effects.diffraction, spec.effects.motion})
    kind += static_cast<char>('0' + static_cast<int>(effect));
  kind += static_cast<char>('0' + static_cast<int>(spec.illumination));
  const bool is_twice = std::ranges::count(spec.outputs, Output::all_in_focus) > 0;
  const bool has_alpha = std::ranges::count(spec.outputs, Output::alpha) > 0;
  return kind + (is_twice ? "+" : "") + (has_alpha ? "a" : "");
}

// What the group does not know yet it believes of what others of the kind have shown.
void believe(Models& models, const Models& elsewhere) {
  for (const bool is_wave : {false, true}) {
    const SampleModel& samples = elsewhere.samples[is_wave];
    if (samples.count() >= kEnoughElsewhere)
      models.samples[is_wave] = SampleModel(samples.weights(), {1.0, 0.2, 0.15, 0.15});
    const TimeModel& times = elsewhere.times[is_wave];
    if (times.count() >= kEnoughElsewhere)
      models.times[is_wave] = TimeModel(times.weights(), {0.7, 0.15, 0.1, 0.1});
  }
}

// As the nearest render of the group. Far from all of them: pinholes are left to waves where
// diffraction spans pixels (of the bundled scenes: from about a quarter of one), lenses are not.
bool is_wave(const SimulationSpec& spec, const Features& f, const Group& group) {
  if (spec.quality.method != "auto") return spec.quality.method == "wave";
  constexpr double kNear = 4.0;
  const double reach = f.diffraction + 0.3 * f.f_number - 0.3 * f.error;
  bool answer =
      is_pinhole(spec) && spec.effects.diffraction != EffectChoice::off && reach > std::log(0.55);
  double nearest = kNear;
  for (const Group::Render& render : group.renders) {
    const double far = planning_distance(f, render.features);
    if (far > nearest) continue;
    nearest = far;
    answer = render.is_wave;
  }
  return answer;
}

// What the models have not told of renders near this one.
double left_nearby(const Features& f, bool is_wave, const Group& group) {
  double sum = 0.0;
  double weights = 0.5;  // for nothing left
  for (const Group::Render& render : group.renders) {
    if (render.is_wave != is_wave) continue;
    const double weight = std::exp(-distance(f, render.features));
    sum += weight * render.left;
    weights += weight;
  }
  return sum / weights;
}

void teach(Models& models, const Features& f, bool is_wave, const CostModel::Done& done,
           double log_time, bool chose_samples) {
  // Where the fewest are enough, the error would have taken fewer.
  const bool is_telling = done.samples_mean > 1.01 * kFewestChosen ||
                          models.chosen_samples(f, is_wave) > 1.01 * kFewestChosen;
  if (chose_samples && is_telling)
    models.samples[is_wave].learn(sample_terms(f), std::log(done.samples_mean), kSampleNoise);
  models.times[is_wave].learn(time_terms(f, done.samples_mean, is_wave), log_time, kTimeNoise);
}

}  // namespace

struct CostModel::Memory {
  // The group's, or what a new one would begin with. With the mutex held.
  Group recalled(const std::string& kind, const std::string& scene_hash) const {
    if (const auto known = groups.find(scene_hash + '/' + kind); known != groups.end())
      return known->second;
    Group fresh;
    if (const auto others = kinds.find(kind); others != kinds.end())
      believe(fresh.models, others->second);
    return fresh;
  }

  std::mutex mutex = {};
  std::unordered_map<std::string, Group> groups = {};  // by scene and kind
  std::deque<std::string> order = {};                  // their keys, oldest first
  std::unordered_map<std::string, Models> kinds = {};  // of all scenes
};

CostModel::CostModel(int threads) : threads_(threads), memory_(std::make_unique<Memory>()) {}
CostModel::~CostModel() = default;

api::CostPrediction CostModel::predict(const SimulationSpec& spec,
                                       const std::string& scene_hash) const {
  Group group;
  {
    const std::lock_guard lock(memory_->mutex);
    group = memory_->recalled(kind_of(spec), scene_hash);
  }
  const double pixels = pixels_of(spec);
  const QualitySpec& quality = spec.quality;
  const Features f = features_of(spec);
  const bool wave = is_wave(spec, f, group);
  const double samples =
      quality.samples ? static_cast<double>(*quality.samples)
                      : std::min(group.models.chosen_samples(f, wave),
                                 std::max(1.0, static_cast<double>(quality.most_samples) / pixels));
  const double log_ns = group.models.times[wave].predicted(time_terms(f, samples, wave)) +
                        left_nearby(f, wave, group);
  api::CostPrediction cost;
  cost.samples = pixels * samples;
  cost.cpu_s = 1e-9 * pixels * std::exp(log_ns);
  if (quality.max_time_ms && !quality.samples)  // a forced count takes its time
    cost.cpu_s = std::min(cost.cpu_s, 1e-3 * *quality.max_time_ms * threads_);
  cost.wall_s = cost.cpu_s / threads_;
  const bool may_be_waves = quality.method == "auto" || quality.method == "wave";
  cost.memory_bytes = kBytesOnce + (may_be_waves ? bytes_of_waves(spec, std::exp(f.diffraction))
                                                 : kBytesPerPixel * pixels);
  return cost;
}

void CostModel::learn(const SimulationSpec& spec, const std::string& scene_hash, const Done& done) {
  if (!(done.samples_mean > 0.0) || !(done.cpu_ms > 0.0)) return;
  const Features f = features_of(spec);
  const bool wave = done.method == "wave";
  const double log_ns = std::log(1e6 * done.cpu_ms / pixels_of(spec));
  const bool chose_samples = !spec.quality.samples && !spec.quality.max_time_ms;
  const std::string kind = kind_of(spec);
  const std::lock_guard lock(memory_->mutex);
  const std::string key = scene_hash + '/' + kind;
  if (!memory_->groups.contains(key)) {
    memory_->groups.emplace(key, memory_->recalled(kind, scene_hash));
    memory_->order.push_back(key);
  }
  Group& group = memory_->groups.at(key);
  teach(group.models, f, wave, done, log_ns, chose_samples);
  teach(memory_->kinds[kind], f, wave, done, log_ns, chose_samples);
  const double samples = spec.quality.samples       ? static_cast<double>(*spec.quality.samples)
                         : spec.quality.max_time_ms ? done.samples_mean
                                                    : group.models.chosen_samples(f, wave);
  const double told = group.models.times[wave].predicted(time_terms(f, samples, wave));
  group.renders.push_back({.features = f, .is_wave = wave, .left = log_ns - told});
  if (group.renders.size() > kRemembered) group.renders.pop_front();
  if (memory_->order.size() <= kMostGroups) return;
  memory_->groups.erase(memory_->order.front());
  memory_->order.pop_front();
}

}  // namespace fstop::server
