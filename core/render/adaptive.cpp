#include "core/render/adaptive.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/render/allocation.h"
#include "core/render/light_tracing.h"
#include "core/render/sample_loop.h"
#include "core/render/sharing.h"
#include "core/render/splatted_light.h"
#include "core/render/traced_picture.h"

namespace fstop {
namespace {

using Clock = std::chrono::steady_clock;

// Rounds aim a little below the target, so that one is mostly enough.
constexpr double kAim = 0.94;

// Samples of a replicate's pixel in the pilot: small errors deserve a first look that is not blind
// to rare samples.
std::uint32_t pilot_samples(double max_error) {
  if (max_error >= 0.012) return 2;
  if (max_error >= 0.004) return 4;
  return max_error >= 0.0015 ? 8 : 16;
}

// A picture of few pixels tells its error by few differences: more samples of each make up for it.
std::uint32_t least_samples(double pixels) {
  constexpr double kFewest = 1024.0;  // of a replicate's whole picture
  return std::bit_ceil(static_cast<std::uint32_t>(std::max(1.0, kFewest / pixels)));
}

class Rounds {
 public:
  // `forward_mse`: noise of the picture that samples do not lower, of what comes from the light.
  Rounds(TracedPicture& picture, const Shot& shot, double bias, double forward_mse,
         bool hides_highlights, Sharing* sharing, const RunControl& run)
      : picture_(picture),
        quality_(shot.quality),
        seed_(shot.seed),
        start_(shot.start),
        bias_(bias),
        hides_highlights_(hides_highlights),
        sharing_(sharing),
        run_(run),
        // Where the omissions alone pass the target, noise is brought down to it all the same.
        // Twice that noise leaves as much for that of the samples.
        goal_(std::max(
            std::pow(quality_.max_error, 2) - (bias < quality_.max_error ? bias * bias : 0.0),
            2.0 * forward_mse)) {}

  void run() {
    pilot();
    double before = std::numeric_limits<double>::infinity();
    int idle_rounds = 0;
    while (true) {
      const Judgement known = judged();
      if (known.noise.mse_upper_95 <= goal_) return;
      idle_rounds = known.noise.mse > kHardlyLess * before ? idle_rounds + 1 : 0;
      before = known.noise.mse;
      // Rare bright hits, too, make the noise grow for a while: only more samples tell.
      const bool is_of_samples = raw_.mse > kMuchOfTheGoal * known.noise.mse;
      if (idle_rounds >= (is_of_samples ? kMostIdleRoundsOfSamples : kMostIdleRounds)) {
        warning_ = kNoLongerFalls;
        return;
      }
      const double remaining = budget();
      if (remaining <= 0.0) return;
      if (!trace_towards_goal(known, remaining)) return;
    }
  }
  const NoiseEstimate& noise() const { return noise_; }
  const std::string& warning() const { return warning_; }

 private:
  static constexpr const char* kOutOfSamples =
      "the noise was still above the target at the most samples allowed";
  static constexpr const char* kNoLongerFalls =
      "more samples no longer lowered the noise, which was still above the target";
  static constexpr const char* kOutOfTime = "stopped by max_time_ms before the error was reached";

  void pilot() {
    const std::uint32_t count = quality_.max_time_ms ? 2
                                                     : std::max(pilot_samples(quality_.max_error),
                                                                least_samples(picture_.pixels()));
    if (quality_.max_time_ms) {
      picture_.trace(picture_.first_look(seed_), 0.02);
      const Clock::time_point start = Clock::now();
      const NoiseEstimate noise = picture_.film().noise(run_);
      finish_ms_ = kFinishPasses * ms_since(start);
      if (run_.preview) show(noise, picture_.film().mean(run_));
      const double rest = 2.0 * picture_.pixels() - picture_.samples();
      if (left_ms() * picture_.samples_per_ms() < rest) return;
    }
    picture_.trace(picture_.uniform(count / 2, count / 2), 0.05);
    const Clock::time_point start = Clock::now();
    const NoiseEstimate first = picture_.film().noise(run_);
    const double half = first.mse;
    finish_ms_ = kFinishPasses * ms_since(start);
    if (run_.preview && !previewed_) show(first, picture_.film().mean(run_));
    // In time only where another such pass fits.
    if (quality_.max_time_ms && left_ms() * picture_.samples_per_ms() < picture_.samples()) return;
    picture_.trace(picture_.uniform(count, count), 0.1, deadline());
    seen_ = picture_.film().noise(run_);
    const double whole = seen_->mse;
    // How fast this picture's nets converge, as the pilot's doubling showed.
    if (whole > 0.0 && half > whole) order_ = std::clamp(std::log2(half / whole), 1.0, 1.75);
    if (!hides_highlights_ || quality_.max_time_ms) return;
    picture_.trace(picture_.where_sharp(kLongLook * count), 0.15);
    seen_.reset();
  }

  Judgement judged() {
    const Clock::time_point start = Clock::now();
    const NoiseEstimate raw = seen_ ? *seen_ : picture_.film().noise(run_);
    seen_.reset();
    raw_ = raw;
    Judgement known{.noise = raw, .variance = raw.mse};
    const bool is_paired = picture_.film().is_paired();
    if (sharing_ != nullptr && is_paired)
      known = sharing_->judged(picture_.film(), raw, kAim * goal_);
    noise_ = known.noise;
    // What comes after the last round: the same passes for the mean, and as much for the figures of
    // the finished picture.
    finish_ms_ = kFinishPasses * ms_since(start);
    if (run_.preview && (!previewed_ || ms_since(*previewed_) >= 50.0)) {
      const bool filtered = sharing_ != nullptr && sharing_->is_better();
      show(noise_, filtered ? sharing_->picture() : picture_.film().mean(run_));
    }
    return known;
  }

  void show(const NoiseEstimate& noise, const Image& picture) {
    run_.preview(picture, std::sqrt(noise.mse_upper_95 + bias_ * bias_));
    previewed_ = Clock::now();
  }

  // How the goal is reached by the fewest samples: with what sharing leaves of the noise, or, where
  // the bias of sharing takes the goal's room, by samples alone.
  Allocation cheaper(const Judgement& known, double remaining) const {
    const double bias = std::max(0.0, known.noise.mse - known.variance);
    const double goal = room_for(known.noise);
    std::vector<float> shares;
    if (sharing_ != nullptr) shares = sharing_->shares(picture_.film().grid());
    // A bias that leaves no room is not mended by samples: then most of the noise goes.
    const double room = std::max(goal - bias, 0.25 * known.variance);
    const Allocation shared =
        allocation(room, known.variance, remaining, shares.empty() ? nullptr : &shares);
    if (bias < kMuchOfTheGoal * goal) return shared;
    const Allocation alone = allocation(room_for(raw_), raw_.mse, remaining, nullptr);
    // Where time ends the picture, what this round leaves is what counts.
    const bool sharing_is_better = quality_.max_time_ms
                                       ? shared.predicted_mse + bias < alone.predicted_mse
                                       : bias < goal && shared.last_samples < alone.last_samples;
    return sharing_is_better ? shared : alone;
  }
  double room_for(const NoiseEstimate& noise) const {
    return kAim * goal_ / (noise.mse > 0.0 ? noise.mse_upper_95 / noise.mse : 1.0);
  }
  Allocation allocation(double mse, double measured, double budget,
                        const std::vector<float>* shares) const {
    return allocated(picture_.film(), {.mse = mse,
                                       .measured = measured,
                                       .most_growth = kMostGrowth,
                                       .budget = budget,
                                       .most_samples = kMostSamples / 2,
                                       .order = order_,
                                       .shares = shares});
  }

  // Another round; false where nothing more can be traced.
  bool trace_towards_goal(const Judgement& known, double remaining) {
    const Allocation next = cheaper(known, remaining);
    if (next.samples <= 0.0) {
      warning_ = quality_.max_time_ms ? kOutOfTime : kOutOfSamples;
      return false;
    }
    const double reached =
        next.predicted_mse > 0.0 ? std::min(1.0, kAim * goal_ / next.predicted_mse) : 1.0;
    picture_.trace(next.counts, picture_.progress() + 0.9 * reached * (1.0 - picture_.progress()),
                   deadline());
    return true;
  }

  // Until tracing has to end.
  double left_ms() const {
    return kUsedTime * *quality_.max_time_ms - finish_ms_ - ms_since(start_);
  }
  Clock::time_point deadline() const {
    if (!quality_.max_time_ms) return Clock::time_point::max();
    return Clock::now() + std::chrono::duration_cast<Clock::duration>(
                              std::chrono::duration<double, std::milli>(left_ms()));
  }

  // Samples that may still be traced; says why where there are none.
  double budget() {
    const double most = static_cast<double>(quality_.most_samples) - picture_.samples();
    if (most <= 0.0) warning_ = kOutOfSamples;
    if (!quality_.max_time_ms) return most;
    const double in_time = kTimeShare * left_ms() * picture_.samples_per_ms();
    const double worth_a_round = 0.1 * picture_.samples();
    if (in_time >= worth_a_round && picture_.film().is_paired()) return std::min(most, in_time);
    warning_ = left_ms() < 0.0 && !picture_.film().is_paired()
                   ? "one sample a pixel took longer than max_time_ms"
                   : kOutOfTime;
    return 0.0;
  }

  // Of the time that was asked for: the finish scatters by a few milliseconds.
  static constexpr double kUsedTime = 0.94;
  // Of the time that is left a round plans to use: rates scatter.
  static constexpr double kTimeShare = 0.9;
  static constexpr double kFinishPasses = 6.0;
  // Rounds in a row that leave nearly all of the noise: something other than samples makes it.
  static constexpr double kHardlyLess = 0.97;
  static constexpr int kMostIdleRounds = 3;
  static constexpr int kMostIdleRoundsOfSamples = 16;
  // Mirrors and glass make small images of lamps, which a pilot's few samples may all miss: there
  // it looks longer. A block of 16 pixels of which one in a hundred points of each shines is missed
  // by all of 64 samples a pixel once in 30,000 pictures, of 8 in every fourth.
  static constexpr std::uint32_t kLongLook = 8;
  static constexpr double kMuchOfTheGoal = 0.3;  // a bias that may make sharing the dearer way
  static constexpr double kMostGrowth = 8.0;     // of a block's count in a round

  TracedPicture& picture_;
  const QualitySpec& quality_;
  std::uint32_t seed_;
  Clock::time_point start_;
  double bias_;
  bool hides_highlights_;
  Sharing* sharing_;
  const RunControl& run_;
  double goal_;
  double order_ = ReplicateFilm::kNetOrder;
  double finish_ms_ = 0.0;
  std::optional<NoiseEstimate> seen_ = {};  // of the film as it is
  std::optional<Clock::time_point> previewed_ = {};
  NoiseEstimate raw_ = {};  // of the film as it is
  NoiseEstimate noise_ = {};
  std::string warning_ = {};
};

RenderOutcome finished(TracedPicture& picture, const Shot& shot, const NoiseEstimate& noise,
                       const Sharing* sharing, const RunControl& run) {
  picture.report(1.0);
  const ReplicateFilm& film = picture.film();
  const bool is_shared = sharing != nullptr && sharing->is_better();
  Image variance;
  if (shot.wants_variance) variance = is_shared ? sharing->error_tiles() : film.tile_variance(run);
  return {.color = is_shared ? sharing->picture() : film.mean(run),
          .variance = std::move(variance),
          .samples_mean = film.samples_mean(),
          .samples_max = film.samples_max(),
          .noise = noise,
          .rays = picture.rays(),
          .cut_rmse = picture.cut_rmse()};
}

// A forced count: half of it in each replicate.
NoiseEstimate trace_exactly(TracedPicture& picture, std::uint32_t samples, Sharing* sharing,
                            const RunControl& run) {
  picture.trace(picture.uniform((samples + 1) / 2, samples / 2), 0.95);
  const NoiseEstimate raw = picture.film().noise(run);
  if (sharing == nullptr || samples < 2) return raw;
  return sharing->judged(picture.film(), raw, raw.mse).noise;
}

// What comes from the light gets a fifth of the error, as much as it costs beside samples in a
// picture of many lamps, and at most as many points as a forced or timed render traces samples.
double forward_goal(const QualitySpec& quality) { return 0.2 * std::pow(quality.max_error, 2); }
double most_forward(const QualitySpec& quality, const ReplicateFilm& film, double most) {
  const double pixels = double(kBlockPixels) * static_cast<double>(film.grid().count());
  if (quality.samples) return pixels * *quality.samples;
  return quality.max_time_ms ? pixels : most;
}
constexpr double kMostPoints = 4e8;  // of emitters
// Paths from lamps may all miss the picture, however many there are.
double most_paths(const ReplicateFilm& film) {
  return std::min(1e8, 1024.0 * kBlockPixels * static_cast<double>(film.grid().count()));
}

// What two halves miss alike, so that their difference tells too little of the error. `factor` of
// its squares was measured: bright discs by two samples had up to 1.4 times what halves told.
struct HiddenFromHalves {
  double factor = 1.0;
  const char* why = nullptr;
};

HiddenFromHalves hidden_from_halves(const QualitySpec& quality) {
  constexpr int kFewSamples = 4;
  for (const SamplePattern pattern :
       {quality.sampling.pixel, quality.sampling.lens, quality.sampling.time}) {
    if (pattern == SamplePattern::regular)
      return {
          2.25,
          "regular samples alias, which their halves do alike: the bound is half as wide again"};
  }
  if (quality.samples && *quality.samples > 1 && *quality.samples < kFewSamples)
    return {
        1.5,
        "fewer than four samples a pixel tell little of their error: the bound is a fifth wider"};
  return {};
}

}  // namespace

RenderOutcome rendered_adaptively(const SampleSource& source, const Shot& shot,
                                  const AdaptiveMeans& means, const RunControl& run) {
  if (shot.part != nullptr) return {.part = ReplicateTracer(source, shot).trace(*shot.part, run)};
  BlockGrid grid(source.sensor.width, source.sensor.height);
  if (means.interleaved != nullptr) grid.interleaved = *means.interleaved;
  TracedPicture picture(source, std::move(grid), shot, run);
  std::optional<SplattedLight> light;
  double splatted_mse = 0.0;
  if (means.splats != nullptr) {
    light.emplace(*means.splats);
    splatted_mse =
        light->splat(forward_goal(shot.quality),
                     most_forward(shot.quality, picture.film(), kMostPoints), picture.film(), run);
  }
  const CarriedLight carried = carry_light(
      {.rays = source, .aims = light_aims(source.scene, shot.illumination), .seed = shot.seed},
      forward_goal(shot.quality),
      most_forward(shot.quality, picture.film(), most_paths(picture.film())), picture.film(), run);
  const BlockTracer any(source, picture.film().grid(), 0);
  std::optional<Sharing> sharing;
  if (means.shares_samples) sharing.emplace(any.blur_px(), run);
  Sharing* shared = sharing ? &*sharing : nullptr;

  NoiseEstimate noise;
  std::string warning;
  if (shot.quality.samples) {
    const auto samples = static_cast<std::uint32_t>(*shot.quality.samples);
    noise = trace_exactly(picture, samples, shared, run);
    if (samples == 1) warning = "one sample a pixel: the noise cannot be told";
  } else {
    constexpr float kHighlight = 4.0F;
    const bool hides_highlights = source.scene.branches() &&
                                  source.illumination != Illumination::local &&
                                  source.brightest > kHighlight;
    Rounds rounds(picture, shot, means.bias, carried.mse + splatted_mse, hides_highlights, shared,
                  run);
    rounds.run();
    noise = rounds.noise();
    warning = rounds.warning();
  }
  RenderOutcome outcome = finished(picture, shot, noise, shared, run);
  if (!warning.empty()) outcome.warnings.push_back(warning);
  if (const HiddenFromHalves hidden = hidden_from_halves(shot.quality); hidden.why != nullptr) {
    outcome.noise.mse_upper_95 *= hidden.factor;
    outcome.warnings.emplace_back(hidden.why);
  }
  if (carried.mse > 0.5 * std::pow(shot.quality.max_error, 2))
    outcome.warnings.emplace_back(
        "light carried from lamps was still noisy at the most paths allowed");
  outcome.rays += carried.rays;
  outcome.carried_paths = carried.paths;
  outcome.samples_pupil = source.samples_pupil;
  outcome.carried_rms = carried.rms;
  if (light) {
    outcome.rays += light->rays();
    outcome.splats_emitters = true;
  }
  if (!sharing || !sharing->is_better()) return outcome;
  outcome.shared =
      SharedSamples{.widest_window = sharing->widest(),
                    .bias = std::sqrt(std::max(0.0, sharing->certificate().bias_squared))};
  return outcome;
}

}  // namespace fstop
