#include "core/render/adaptive.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>

#include "core/render/allocation.h"
#include "core/render/sample_loop.h"

namespace fstop {
namespace {

// Samples of a pixel between two looks at the stop token: a few milliseconds of work.
constexpr std::uint32_t kVisit = 256;
// Rounds aim a little below the target, so that one is mostly enough.
constexpr double kAim = 0.94;

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

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
  double samples_per_ms() const { return samples_ / std::max(trace_ms_, 1e-3); }

  // Traces what is missing to `counts`, but begins no tile after `deadline`; progress goes to `end`
  // of the whole.
  void trace(const BlockCounts& counts, double end,
             Clock::time_point deadline = Clock::time_point::max()) {
    const Clock::time_point start = Clock::now();
    const double begin = progress_;
    std::atomic<int> done = 0;
    const int tiles = tile_columns_ * tile_rows_;
    std::atomic<std::uint64_t> rays = 0;
    std::atomic<std::uint64_t> samples = 0;
    const bool limited = deadline != Clock::time_point::max();
    parallel_for(run_, tiles, [&](int tile) {
      if (limited && Clock::now() >= deadline) return;
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
    trace_ms_ += ms_since(start);
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
  double trace_ms_ = 0.0;  // spent in trace()
  double progress_ = 0.0;
  std::mutex mutex_;
  double reported_ = 0.0;
};

// Samples of a replicate's pixel in the pilot: small errors deserve a first look that is not blind
// to rare samples.
std::uint32_t pilot_samples(double max_error) {
  if (max_error >= 0.03) return 2;
  if (max_error >= 0.006) return 4;
  return max_error >= 0.002 ? 8 : 16;
}

class Rounds {
 public:
  Rounds(Picture& picture, const Shot& shot, double bias, const RunControl& run)
      : picture_(picture),
        quality_(shot.quality),
        start_(shot.start),
        bias_(bias),
        run_(run),
        // Where the omissions alone pass the target, noise is brought down to it all the same.
        goal_(std::pow(quality_.max_error, 2) - (bias < quality_.max_error ? bias * bias : 0.0)) {}

  void run() {
    pilot();
    for (measure(); noise_.mse_upper_95 > goal_; measure()) {
      const double remaining = budget();
      if (remaining <= 0.0) return;
      const double ratio = noise_.mse > 0.0 ? noise_.mse_upper_95 / noise_.mse : 1.0;
      const Allocation next = allocated(picture_.film(), {.mse = kAim * goal_ / ratio,
                                                          .measured = noise_.mse,
                                                          .most_growth = growth_,
                                                          .budget = remaining,
                                                          .most_samples = kMostSamples / 2});
      if (next.samples <= 0.0) {
        warning_ = quality_.max_time_ms ? kOutOfTime : kOutOfSamples;
        return;
      }
      growth_ = 8.0;
      const double share =
          std::min(1.0, next.predicted_mse > 0.0 ? goal_ / next.predicted_mse : 1.0);
      picture_.trace(next.counts, picture_.progress() + 0.9 * share * (1.0 - picture_.progress()),
                     deadline());
    }
  }
  const NoiseEstimate& noise() const { return noise_; }
  const std::string& warning() const { return warning_; }

 private:
  static constexpr const char* kOutOfSamples =
      "the noise was still above the target at the most samples allowed";
  static constexpr const char* kOutOfTime = "stopped by max_time_ms before the error was reached";

  void pilot() {
    const std::uint32_t count = quality_.max_time_ms ? 2 : pilot_samples(quality_.max_error);
    picture_.trace(picture_.uniform(count / 2, count / 2), 0.05);
    if (quality_.max_time_ms || run_.preview) measure();
    // In time only where another such pass fits.
    if (quality_.max_time_ms && left_ms() * picture_.samples_per_ms() < picture_.samples()) return;
    picture_.trace(picture_.uniform(count, count), 0.1, deadline());
  }

  void measure() {
    const Clock::time_point start = Clock::now();
    noise_ = picture_.film().noise(run_);
    // What comes after the last round: the same pass for the mean, and as much for the figures of
    // the finished picture.
    finish_ms_ = kFinishPasses * ms_since(start);
    if (!run_.preview || (previewed_ && ms_since(*previewed_) < 50.0)) return;
    run_.preview(picture_.film().mean(run_), std::sqrt(noise_.mse_upper_95 + bias_ * bias_));
    previewed_ = Clock::now();
  }

  // Until tracing has to end.
  double left_ms() const { return *quality_.max_time_ms - finish_ms_ - ms_since(start_); }
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
    if (in_time >= worth_a_round) return std::min(most, in_time);
    warning_ = left_ms() < 0.0 && picture_.film().samples_max() <= kReplicates
                   ? "one sample a pixel in each replicate took longer than max_time_ms"
                   : kOutOfTime;
    return 0.0;
  }

  // Of the time that is left a round plans to use: rates scatter.
  static constexpr double kTimeShare = 0.9;
  static constexpr double kFinishPasses = 4.0;

  Picture& picture_;
  const QualitySpec& quality_;
  Clock::time_point start_;
  double bias_;
  const RunControl& run_;
  double goal_;
  double growth_ = 4.0;
  double finish_ms_ = 0.0;
  std::optional<Clock::time_point> previewed_ = {};
  NoiseEstimate noise_ = {};
  std::string warning_ = {};
};

RenderOutcome finished(Picture& picture, const Shot& shot, const NoiseEstimate& noise,
                       const RunControl& run) {
  picture.report(1.0);
  const ReplicateFilm& film = picture.film();
  return {.color = film.mean(run),
          .variance = shot.wants_variance ? film.tile_variance(run) : Image{},
          .samples_mean = film.samples_mean(),
          .samples_max = film.samples_max(),
          .noise = noise,
          .rays = picture.rays()};
}

// A forced count: half of it in each replicate.
RenderOutcome render_exactly(Picture& picture, const Shot& shot, const RunControl& run) {
  const auto samples = static_cast<std::uint32_t>(*shot.quality.samples);
  picture.trace(picture.uniform((samples + 1) / 2, samples / 2), 0.95);
  RenderOutcome outcome = finished(picture, shot, picture.film().noise(run), run);
  if (samples == 1) outcome.warnings.emplace_back("one sample a pixel: the noise cannot be told");
  return outcome;
}

}  // namespace

RenderOutcome rendered_adaptively(const SampleSource& source, const Shot& shot, double bias,
                                  const RunControl& run) {
  Picture picture(source, shot.seed, run);
  if (shot.quality.samples) return render_exactly(picture, shot, run);
  Rounds rounds(picture, shot, bias, run);
  rounds.run();
  RenderOutcome outcome = finished(picture, shot, rounds.noise(), run);
  if (!rounds.warning().empty()) outcome.warnings.push_back(rounds.warning());
  return outcome;
}

}  // namespace fstop
