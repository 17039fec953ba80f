#include "core/render/adaptive.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "core/render/allocation.h"
#include "core/render/defocus_filter.h"
#include "core/render/sample_loop.h"
#include "core/render/splatted_light.h"

namespace fstop {
namespace {

// Samples of a pixel between two looks at the stop token: a few milliseconds of work.
constexpr std::uint32_t kVisit = 256;
// Rounds aim a little below the target, so that one is mostly enough.
constexpr double kAim = 0.94;

class Clock {
 public:
  double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// The picture under way: both replicates' sources and their film.
class Picture {
 public:
  Picture(const SampleSource& source, std::uint32_t seed, const RunControl& run)
      : sources_{with_sequence(source, SampleSequence(seed)),
                 with_sequence(source, SampleSequence(hash_of(seed, kSecondReplicate)))},
        film_(source.sensor.width, source.sensor.height),
        tile_columns_((source.sensor.width + kTile - 1) / kTile),
        tile_rows_((source.sensor.height + kTile - 1) / kTile),
        run_(run) {}

  ReplicateFilm& film() { return film_; }
  std::uint64_t rays() const { return rays_; }
  double samples() const { return samples_; }

  // Traces what is missing to `counts`; progress goes to `end` of the whole.
  void trace(const BlockCounts& counts, double end) {
    const double begin = progress_;
    std::atomic<int> done = 0;
    const int tiles = tile_columns_ * tile_rows_;
    std::atomic<std::uint64_t> rays = 0;
    std::atomic<std::uint64_t> samples = 0;
    parallel_for(run_, tiles, [&](int tile) {
      for_each_block(film_.grid(), tile % tile_columns_, tile / tile_columns_,
                     [&](std::size_t block) {
                       for (int r = 0; r < kReplicates; ++r) {
                         const auto counted = trace_block(r, block, counts);
                         rays += counted.rays;
                         samples += counted.samples;
                       }
                     });
      report(begin + (end - begin) * ++done / tiles);
    });
    throw_if_stopped(run_);
    rays_ += rays;
    samples_ += static_cast<double>(samples.load());
    progress_ = end;
  }

  BlockCounts uniform(std::uint32_t a, std::uint32_t b) const {
    BlockCounts counts;
    counts[0].assign(film_.grid().count(), a);
    counts[1].assign(film_.grid().count(), b);
    return counts;
  }

  double progress() const { return progress_; }
  void report(double fraction) {
    if (!run_.progress) return;
    const std::scoped_lock lock(mutex_);
    if (fraction <= reported_) return;
    reported_ = fraction;
    run_.progress(fraction);
  }

 private:
  static constexpr std::uint32_t kSecondReplicate = 0x5eed0002U;
  struct Counted {
    std::uint64_t rays = 0;
    std::uint64_t samples = 0;
  };

  static SampleSource with_sequence(SampleSource source, const SampleSequence& sequence) {
    source.sequence = sequence;
    return source;
  }

  Counted trace_block(int replicate, std::size_t block, const BlockCounts& counts) {
    const std::uint32_t wanted = counts[static_cast<std::size_t>(replicate)][block];
    std::uint32_t first = film_.samples(replicate, block);
    if (first >= wanted) return {};
    Counted counted;
    BlockSums sums;
    const std::uint32_t missing = wanted - first;
    BlockTracer tracer(sources_[static_cast<std::size_t>(replicate)], film_.grid(), block);
    for (; first < wanted; first += kVisit) {
      if (run_.stop.stop_requested()) return counted;
      counted.rays += tracer.trace(first, std::min(kVisit, wanted - first), sums);
    }
    film_.add(replicate, block, sums, missing);
    counted.samples = std::uint64_t{missing} * static_cast<unsigned>(film_.grid().pixels(block));
    return counted;
  }

  std::array<SampleSource, kReplicates> sources_;
  ReplicateFilm film_;
  int tile_columns_;
  int tile_rows_;
  const RunControl& run_;
  std::uint64_t rays_ = 0;
  double samples_ = 0.0;
  double progress_ = 0.0;
  std::mutex mutex_;
  double reported_ = 0.0;
};

// Samples of a replicate's pixel in the pilot: small errors deserve a first look that is not blind
// to rare samples.
std::uint32_t pilot_samples(double max_error) {
  if (max_error >= 0.012) return 2;
  if (max_error >= 0.004) return 4;
  return max_error >= 0.0015 ? 8 : 16;
}

// What is known of the picture's error, and how much of it more samples would mend.
struct Judgement {
  NoiseEstimate noise = {};
  double variance = 0.0;  // of the mean square error; the rest is a filter's bias
};

// The filter that shares samples between pixels, chosen by a pilot's own errors.
class Sharing {
 public:
  Sharing(double blur_px, const RunControl& run) : blur_px_(blur_px), run_(run) {}

  /// The error of the filtered picture if that is smaller than `raw`, of the film as it is.
  Judgement judged(const ReplicateFilm& film, const NoiseEstimate& raw, double goal) {
    const Image a = film.replicate(0);
    const Image b = film.replicate(1);
    if (!chosen_) {
      // A plain mean of narrow windows is best where few samples do, parabolas where many must.
      const Try mean = tried(film, a, b, {.keeps_parabolas = false, .share = 0.18});
      const Try parabola = tried(film, a, b, {.keeps_parabolas = true, .share = 0.35});
      chosen_ = samples_needed(mean.certificate, goal) < samples_needed(parabola.certificate, goal)
                    ? mean.kind
                    : parabola.kind;
      last_ = chosen_->keeps_parabolas ? parabola : mean;
    } else {
      last_ = tried(film, a, b, *chosen_);
    }
    const Certificate& c = last_.certificate;
    is_better_ = last_.filter && c.mse_upper_95 < raw.mse_upper_95;
    if (!is_better_) return {.noise = raw, .variance = raw.mse};
    Judgement result{.noise = raw, .variance = c.variance};
    result.noise.mse = c.mse;
    result.noise.mse_upper_95 = c.mse_upper_95;
    return result;
  }
  bool is_better() const { return is_better_; }
  const Certificate& certificate() const { return last_.certificate; }

  /// By block: what filtering leaves of its variance.
  std::vector<float> shares(const BlockGrid& grid) const {
    std::vector<float> result(grid.count(), 1.0F);
    if (!is_better_) return result;
    for (std::size_t block = 0; block < grid.count(); ++block) {
      const int radius = last_.filter->radius(grid.left(block) / DefocusFilter::kTileSide,
                                              grid.top(block) / DefocusFilter::kTileSide);
      result[block] = static_cast<float>(last_.certificate.gain[static_cast<std::size_t>(radius)]);
    }
    return result;
  }

  /// The picture that was judged.
  Image picture() const {
    Image image = last_.a;
    for (std::size_t i = 0; i < image.pixels().size(); ++i) {
      // Weights below 0 may undershoot black.
      image.pixels()[i] = std::max(0.0F, 0.5F * (last_.a.pixels()[i] + last_.b.pixels()[i]));
    }
    return image;
  }
  /// Widest window, pixels.
  int widest() const {
    int radius = 0;
    for (int row = 0; row < last_.filter->rows(); ++row) {
      for (int column = 0; column < last_.filter->columns(); ++column) {
        radius = std::max(radius, last_.filter->radius(column, row));
      }
    }
    return 2 * radius + 1;
  }

 private:
  struct Try {
    FilterKind kind = {};
    std::optional<DefocusFilter> filter = {};
    Certificate certificate = {};
    Image a = {};
    Image b = {};
  };

  Try tried(const ReplicateFilm& film, const Image& a, const Image& b, const FilterKind& kind) {
    Try result{.kind = kind};
    result.filter.emplace(film, a, b, blur_px_, kind);
    if (!result.filter->does_something()) {
      result.filter.reset();
      result.certificate.mse = result.certificate.mse_upper_95 = result.certificate.variance =
          std::numeric_limits<double>::infinity();
      return result;
    }
    result.a = result.filter->applied(a, run_);
    result.b = result.filter->applied(b, run_);
    result.certificate = certified(*result.filter, a, b, result.a, result.b);
    return result;
  }

  // In units of those there are, by the law of the nets; what bias leaves no room for is infinite.
  static double samples_needed(const Certificate& c, double goal) {
    const double room = goal - std::max(0.0, c.bias_squared);
    if (room <= 0.0) return std::numeric_limits<double>::infinity();
    return std::pow(c.variance / room, 1.0 / ReplicateFilm::kNetOrder);
  }

  double blur_px_;
  const RunControl& run_;
  std::optional<FilterKind> chosen_ = {};
  Try last_ = {};
  bool is_better_ = false;
};

class Rounds {
 public:
  Rounds(Picture& picture, const QualitySpec& quality, double bias, Sharing* sharing)
      : picture_(picture),
        quality_(quality),
        // Where the omissions alone pass the target, noise is brought down to it all the same.
        goal_(std::pow(quality.max_error, 2) - (bias < quality.max_error ? bias * bias : 0.0)),
        sharing_(sharing) {}

  void run() {
    pilot();
    while (true) {
      const Judgement known = judged();
      noise_ = known.noise;
      if (noise_.mse_upper_95 <= goal_) return;
      const double remaining = budget();
      if (remaining <= 0.0) return;
      if (!trace_towards_goal(known, remaining)) return;
    }
  }
  const NoiseEstimate& noise() const { return noise_; }
  const std::string& warning() const { return warning_; }

 private:
  void pilot() {
    if (quality_.max_time_ms) {
      picture_.trace(picture_.uniform(1, 1), 0.1);
      return;
    }
    const std::uint32_t count = pilot_samples(quality_.max_error);
    picture_.trace(picture_.uniform(count / 2, count / 2), 0.05);
    const double half = picture_.film().noise().mse;
    picture_.trace(picture_.uniform(count, count), 0.1);
    const double whole = picture_.film().noise().mse;
    // How fast this picture's nets converge, as the pilot's doubling showed.
    if (whole > 0.0 && half > whole) order_ = std::clamp(std::log2(half / whole), 1.0, 1.75);
  }

  Judgement judged() {
    const NoiseEstimate raw = picture_.film().noise();
    if (sharing_ == nullptr) return {.noise = raw, .variance = raw.mse};
    return sharing_->judged(picture_.film(), raw, kAim * goal_);
  }

  // Another round; false where nothing more can be traced.
  bool trace_towards_goal(const Judgement& known, double remaining) {
    const NoiseEstimate& noise = known.noise;
    const double ratio = noise.mse > 0.0 ? noise.mse_upper_95 / noise.mse : 1.0;
    const double bias = std::max(0.0, noise.mse - known.variance);
    // A bias that leaves no room is not mended by samples: then half of the noise goes.
    const double room = std::max(kAim * goal_ / ratio - bias, 0.25 * known.variance);
    const std::vector<float> shares =
        sharing_ != nullptr ? sharing_->shares(picture_.film().grid()) : std::vector<float>{};
    const Allocation next =
        allocated(picture_.film(), {.mse = room,
                                    .measured = known.variance,
                                    .most_growth = kMostGrowth,
                                    .budget = remaining,
                                    .most_samples = kMostSamples / 2,
                                    .order = order_,
                                    .shares = shares.empty() ? nullptr : &shares});
    if (next.samples <= 0.0) {
      warning_ = "the noise was still above the target at the most samples allowed";
      return false;
    }
    const double reached =
        next.predicted_mse > 0.0 ? std::min(1.0, room / next.predicted_mse) : 1.0;
    picture_.trace(next.counts, picture_.progress() + 0.9 * reached * (1.0 - picture_.progress()));
    return true;
  }

  // Samples that may still be traced; says why where there are none.
  double budget() {
    const double most = static_cast<double>(quality_.most_samples) - picture_.samples();
    if (most <= 0.0) warning_ = "the noise was still above the target at the most samples allowed";
    if (!quality_.max_time_ms) return most;
    const double left = 0.95 * *quality_.max_time_ms - clock_.ms();
    const double in_time = picture_.samples() * left / std::max(clock_.ms(), 1e-3);
    const double worth_a_round = 0.1 * picture_.samples();
    if (in_time >= worth_a_round) return std::min(most, in_time);
    warning_ = "stopped by max_time_ms before the error was reached";
    return 0.0;
  }

  static constexpr double kMostGrowth = 8.0;  // of a block's count in a round

  Picture& picture_;
  const QualitySpec& quality_;
  double goal_;
  Sharing* sharing_;
  double order_ = ReplicateFilm::kNetOrder;
  Clock clock_ = {};
  NoiseEstimate noise_ = {};
  std::string warning_ = {};
};

RenderOutcome finished(Picture& picture, const NoiseEstimate& noise) {
  picture.report(1.0);
  const ReplicateFilm& film = picture.film();
  return {.color = film.mean(),
          .variance = film.tile_variance(),
          .samples_mean = film.samples_mean(),
          .samples_max = film.samples_max(),
          .noise = noise,
          .rays = picture.rays()};
}

// A forced count: half of it in each replicate.
NoiseEstimate trace_exactly(Picture& picture, std::uint32_t samples, Sharing* sharing) {
  picture.trace(picture.uniform((samples + 1) / 2, samples / 2), 0.95);
  const NoiseEstimate raw = picture.film().noise();
  if (sharing == nullptr || samples < 2) return raw;
  return sharing->judged(picture.film(), raw, raw.mse).noise;
}

// Splats are cheap beside samples: they get a tenth of the error, and at most as many points as a
// forced or timed render traces samples.
void add_splats(const AdaptiveSpec& spec, SplattedLight& light, Picture& picture,
                const RunControl& run) {
  const double pixels = double(kBlockPixels) * static_cast<double>(picture.film().grid().count());
  const double free = spec.quality.max_time_ms ? pixels : 4e8;
  light.splat(0.1 * std::pow(spec.quality.max_error, 2), free, picture.film(), run);
}

}  // namespace

RenderOutcome rendered_adaptively(const SampleSource& source, const AdaptiveSpec& spec,
                                  const RunControl& run) {
  Picture picture(source, spec.seed, run);
  std::optional<SplattedLight> light;
  if (spec.splats != nullptr) {
    light.emplace(*spec.splats);
    add_splats(spec, *light, picture, run);
  }
  const BlockTracer any(source, picture.film().grid(), 0);
  std::optional<Sharing> sharing;
  if (spec.shares_samples) sharing.emplace(any.blur_px(), run);
  Sharing* shared = sharing ? &*sharing : nullptr;

  NoiseEstimate noise;
  std::string warning;
  if (spec.quality.samples) {
    const auto samples = static_cast<std::uint32_t>(*spec.quality.samples);
    noise = trace_exactly(picture, samples, shared);
    if (samples == 1) warning = "one sample a pixel: the noise cannot be told";
  } else {
    Rounds rounds(picture, spec.quality, spec.bias, shared);
    rounds.run();
    noise = rounds.noise();
    warning = rounds.warning();
  }
  RenderOutcome outcome = finished(picture, noise);
  if (!warning.empty()) outcome.warnings.push_back(warning);
  if (light) {
    outcome.rays += light->rays();
    outcome.splatted_points = light->points();
  }
  if (!sharing || !sharing->is_better()) return outcome;
  outcome.color = sharing->picture();
  outcome.shared =
      SharedSamples{.widest_window = sharing->widest(),
                    .bias = std::sqrt(std::max(0.0, sharing->certificate().bias_squared))};
  return outcome;
}

}  // namespace fstop
