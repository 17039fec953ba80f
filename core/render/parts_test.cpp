#include "core/render/parts.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/render/busy_scene.h"
#include "core/render/simulation.h"

namespace fstop {
namespace {

// The wall farther off, and small bright balls before it.
Scene bright_scene() {
  Scene scene = busy_scene();
  scene.objects[0] = {
      .shape = QuadObject{.corner = {-6, -4, -8}, .edge_u = {12, 0, 0}, .edge_v = {0, 8, 0}}};
  scene.materials.push_back(Material{.emission = {.value = {90.0F, 60.0F, 30.0F}}});
  for (const double x : {-0.9, 0.4, 1.3}) {
    scene.objects.push_back(
        {.shape = SphereObject{.center = {x, 0.5, -6}, .radius = 0.004}, .material = 3});
  }
  return scene;
}

// Neither side is a multiple of a block's.
SimulationSpec shot(const std::string& method, double focus_m = 2.0) {
  SimulationSpec spec;
  spec.camera.optics = LensSpec{.lens = {.focal_length = 50.0_mm, .f_number = 1.4},
                                .focus_distance = Length::si(focus_m)};
  spec.width = 98;
  spec.height = 67;
  spec.camera.sensor_height = spec.camera.sensor_width * (67.0 / 98.0);
  spec.quality.method = method;
  spec.quality.max_error = 0.02;
  spec.seed = 7;
  return spec;
}

/// Traces parts as another process would: from bytes, with a scene and threads of its own, in
/// another order than they are asked for.
class Elsewhere : public PartTracer {
 public:
  Elsewhere(const SimulationSpec& spec, const Scene& scene, int count)
      : spec_(spec), scene_(scene), count_(count) {}

  int parts(double samples) const override { return samples > 0.0 ? count_ : 0; }

  void trace(std::span<const PartOrder> orders, const Take& take, const RunControl&) override {
    std::vector<std::size_t> numbers(orders.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
    std::shuffle(numbers.begin(), numbers.end(), random_);
    for (const std::size_t number : numbers) {
      WorkerPool workers(1 + static_cast<int>(number % 3));
      RunControl run;
      run.workers = &workers;
      const PartOrder order = part_order_of(bytes_of(orders[number]));
      EXPECT_TRUE(order == orders[number]);
      interleaved_ = interleaved_ || std::ranges::count(order.interleaved, 1) > 0;
      const TracedPart part = traced_part(spec_, scene_, order, run);
      take(number, traced_part_of(bytes_of(part, order), orders[number]));
      ++traced_;
    }
    ++rounds_;
  }

  int rounds_ = 0;
  int traced_ = 0;
  bool interleaved_ = false;

 private:
  SimulationSpec spec_;
  RayScene scene_;
  int count_;
  std::mt19937 random_{20261130};
};

// All of a report, every digit.
std::string text_of(const RenderReport& report) {
  std::ostringstream text;
  text << std::hexfloat << report.method;
  for (const ModelledEffect& e : report.model)
    text << '\n' << e.effect << ' ' << e.modelled << ' ' << e.bound << ' ' << e.why;
  for (const PassedOverMethod& p : report.passed_over) text << '\n' << p.method << ' ' << p.why;
  text << '\n'
       << report.error.estimate << ' ' << report.error.upper_95 << ' ' << report.error.energy << ' '
       << report.error.energy_upper_95 << ' ' << report.cost.rays << ' ' << report.cost.samples_mean
       << ' ' << report.cost.samples_max;
  for (const std::string& warning : report.warnings) text << '\n' << warning;
  return text.str();
}

void expect_same(const Photograph& parts, const Photograph& whole) {
  EXPECT_TRUE(parts.color == whole.color);
  EXPECT_TRUE(parts.layers == whole.layers);
  EXPECT_EQ(text_of(parts.report), text_of(whole.report));
}

struct Compared {
  std::string method = {};  // that was chosen
  int rounds = 0;
  bool interleaved = false;
  bool shared = false;  // samples, between pixels
};

Compared compare(const SimulationSpec& spec, const Scene& scene, int count = 7) {
  const RayScene here(scene);
  WorkerPool workers(2);
  RunControl run;
  run.workers = &workers;
  const Photograph whole = simulate(spec, here, run);
  Elsewhere elsewhere(spec, scene, count);
  const Photograph parts = simulate(spec, here, run, &elsewhere);
  expect_same(parts, whole);
  EXPECT_TRUE(is_made_in_parts(spec, here, run));
  EXPECT_GE(elsewhere.traced_, std::min(count, 2) * elsewhere.rounds_);
  const bool shared = std::ranges::any_of(whole.report.model, [](const ModelledEffect& effect) {
    return effect.effect == "samples shared between pixels";
  });
  return {whole.report.method, elsewhere.rounds_, elsewhere.interleaved_, shared};
}

TEST(Parts, AForcedCountIsTheSamePictureInAnyNumberOfThem) {
  SimulationSpec spec = shot("lens-sampling");
  spec.quality.samples = 37;
  for (const int count : {1, 3, 64, 100'000}) {
    EXPECT_EQ(compare(spec, busy_scene(), count).rounds, 1) << count;
  }
  spec.quality.samples = 1;  // the second replicate has none
  EXPECT_EQ(compare(spec, busy_scene()).rounds, 1);
}

TEST(Parts, ErrorsThatAreAskedForTakeTheSameRounds) {
  SimulationSpec spec = shot("auto");
  spec.quality.max_error = 0.004;
  const Compared compared = compare(spec, busy_scene());
  EXPECT_GE(compared.rounds, 3) << compared.method;
}

TEST(Parts, LayersAreTheSame) {
  SimulationSpec spec = shot("lens-sampling");
  spec.outputs = {Output::color,    Output::depth,  Output::all_in_focus,
                  Output::variance, Output::normal, Output::valid};
  // The second and further rounds, and one of the layer.
  EXPECT_GE(compare(spec, busy_scene()).rounds, 3);
  spec.quality.samples = 24;
  EXPECT_EQ(compare(spec, busy_scene()).rounds, 2) << "one of the picture, one of the layer";
}

TEST(Parts, SharedSamplesOfInterleavedTilesAreTheSame) {
  Scene scene = busy_scene();
  scene.objects.resize(1);
  SimulationSpec spec = shot("lens-reconstruction", 0.5);
  const Compared compared = compare(spec, scene);
  EXPECT_EQ(compared.method, "lens-reconstruction");
  EXPECT_TRUE(compared.interleaved && compared.shared);
  EXPECT_GE(compared.rounds, 2);
}

TEST(Parts, SplattedEmittersAreTheSame) {
  const SimulationSpec spec = shot("bokeh-splatting");
  EXPECT_EQ(compare(spec, bright_scene()).method, "bokeh-splatting");
  SimulationSpec sharp = shot("pinhole");
  sharp.effects.defocus = EffectChoice::off;
  EXPECT_EQ(compare(sharp, bright_scene()).method, "pinhole");
}

TEST(Parts, PatternsMotionAndGlobalLightAreTheSame) {
  SimulationSpec spec = shot("lens-sampling");
  spec.quality.samples = 30;
  spec.quality.sampling = {.pixel = SamplePattern::jittered,
                           .lens = SamplePattern::poisson_disc,
                           .time = SamplePattern::regular};
  spec.camera.shutter_seconds = 0.1;
  spec.camera.velocity = {0.3, 0.0, 0.0};
  compare(spec, busy_scene());
  SimulationSpec global = shot("lens-sampling");
  global.illumination = Illumination::global;
  global.quality.max_error = 0.1;
  compare(global, busy_scene());
}

TEST(Parts, WhatCannotBeCutIsMadeHere) {
  const Scene scene = busy_scene();
  const RayScene here(scene);
  const auto rounds = [&](const SimulationSpec& spec) {
    Elsewhere elsewhere(spec, scene, 4);
    expect_same(simulate(spec, here, {}, &elsewhere), simulate(spec, here, {}));
    EXPECT_FALSE(is_made_in_parts(spec, here, {}));
    return elsewhere.rounds_;
  };
  EXPECT_EQ(rounds(shot("wave")), 0);
  SimulationSpec alpha = shot("lens-sampling");
  alpha.quality.samples = 4;
  alpha.outputs = {Output::color, Output::alpha};
  EXPECT_EQ(rounds(alpha), 0);
  SimulationSpec timed = shot("lens-sampling");
  timed.quality.samples = 4;
  timed.quality.max_time_ms = 1e6;
  EXPECT_EQ(rounds(timed), 0);
  Scene far = scene;  // nothing is blurred over many pixels
  far.objects.resize(1);
  const RayScene there(far);
  SimulationSpec gathered = shot("gather", 8.0);
  EXPECT_FALSE(is_made_in_parts(gathered, there, {}));
  Elsewhere elsewhere(gathered, far, 4);
  simulate(gathered, there, {}, &elsewhere);
  EXPECT_EQ(elsewhere.rounds_, 0);
}

// Every missing sample is in one part, none that is there.
TEST(Parts, TheyCoverWhatIsMissingOnce) {
  ReplicateFilm film(103, 50);
  std::mt19937 numbers(5);
  const auto random = [&] { return static_cast<std::uint32_t>(numbers()); };
  BlockCounts counts;
  double all = 0.0;
  double most = 0.0;  // of a block
  for (int r = 0; r < kReplicates; ++r) {
    for (std::size_t block = 0; block < film.grid().count(); ++block) {
      const std::uint32_t first = random() % 4;
      const std::uint32_t more = random() % 5 < 2 ? 0 : random() % 50;
      if (first > 0) film.add(r, block, {}, first);
      counts[static_cast<std::size_t>(r)].push_back(first + more);
      all += double(more) * film.grid().pixels(block);
      most = std::max(most, 2.0 * 50 * kBlockPixels);
    }
  }
  EXPECT_EQ(static_cast<double>(missing_samples(film, counts)), all);
  for (const int count : {1, 2, 5, 17, 300, 10'000}) {
    const std::vector<PartOrder> parts = parts_of(film, counts, count);
    EXPECT_LE(parts.size(), static_cast<std::size_t>(count));
    std::array<std::vector<int>, kReplicates> times;
    for (auto& t : times) t.assign(film.grid().count(), 0);
    for (const PartOrder& part : parts) {
      double samples = 0.0;
      for (std::size_t i = 0; i < part.blocks(); ++i) {
        const std::size_t block = part.first_block + i;
        for (int r = 0; r < kReplicates; ++r) {
          const auto k = static_cast<std::size_t>(r);
          const SampleRange range = part.samples[k].at(i);
          EXPECT_EQ(range.first, film.samples(r, block));
          EXPECT_EQ(range.end, std::max(film.samples(r, block), counts[k][block]));
          ++times[k][block];
          samples += double(range.end - range.first) * film.grid().pixels(block);
        }
      }
      EXPECT_GT(samples, 0.0);
      EXPECT_LE(samples, all / count + most) << "of " << count;
    }
    for (std::size_t r = 0; r < kReplicates; ++r) {
      for (std::size_t block = 0; block < film.grid().count(); ++block) {
        const bool is_missing = counts[r][block] > film.samples(static_cast<int>(r), block);
        EXPECT_LE(times[r][block], 1);
        EXPECT_GE(times[r][block], is_missing ? 1 : 0);
      }
    }
  }
}

// A result has a bounded size, however few parts are wanted.
TEST(Parts, NoneIsLargerThanAFileMayBe) {
  const ReplicateFilm film(16'384, 256);  // 2^18 blocks
  BlockCounts counts;
  for (auto& c : counts) c.assign(film.grid().count(), 1);
  const std::vector<PartOrder> parts = parts_of(film, counts, 1);
  EXPECT_EQ(parts.size(), 2U);
  for (const PartOrder& part : parts) EXPECT_EQ(part.blocks(), kMostPartBlocks);
}

// Three blocks of a picture of 8 x 8: what a ray tracer would have made of them does not matter.
PartOrder small_order() {
  return {.method = "lens-sampling",
          .width = 30,
          .height = 20,
          .interleaved = {1, 0, 1, 1},
          .first_block = 2,
          .samples = {{{{0, 4}, {2, 2}, {1, 9}}, {{0, 0}, {0, 3}, {0, 1}}}}};
}
TracedPart small_part() {
  TracedPart part{.sums = std::vector<PartSums>(4), .rays = 123456789012345, .cut_squares = 77};
  for (std::size_t i = 0; i < part.sums.size(); ++i) {
    for (auto& channel : part.sums[i].value) channel.fill(0.1F * static_cast<float>(i + 1));
    part.sums[i].least_defocus = static_cast<float>(i);
  }
  part.sums[3].least_defocus = std::numeric_limits<float>::infinity();
  return part;
}

template <typename Act>
bool is_refused(const Act& act) {
  try {
    act();
    return false;
  } catch (const Error& error) {
    return error.code() == ErrorCode::invalid_request;
  }
}

TEST(PartBytes, ComeBackAsTheyWere) {
  const PartOrder order = small_order();
  EXPECT_TRUE(part_order_of(bytes_of(order)) == order);
  const TracedPart part = small_part();
  const TracedPart back = traced_part_of(bytes_of(part, order), order);
  EXPECT_EQ(back.rays, part.rays);
  EXPECT_EQ(back.cut_squares, part.cut_squares);
  ASSERT_EQ(back.sums.size(), part.sums.size());
  for (std::size_t i = 0; i < part.sums.size(); ++i) {
    EXPECT_EQ(back.sums[i].value, part.sums[i].value);
    EXPECT_EQ(back.sums[i].least_defocus, part.sums[i].least_defocus);
  }
}

// Little endian whatever the machine: name, version, length and text of the method.
TEST(PartBytes, AreTheFormThatIsWrittenDown) {
  const std::string bytes = bytes_of(small_order());
  const std::string head("fstop-part-order\1\0\0\0\15\0\0\0lens-sampling\0\0\0\0\36\0\0\0\24\0\0\0",
                         16 + 4 + 4 + 13 + 3 * 4);
  EXPECT_EQ(bytes.substr(0, head.size()), head);
  // 4 tiles in a byte; first block, blocks; two numbers for each of three blocks, twice.
  EXPECT_EQ(bytes.size(), head.size() + 8 + 1 + 8 + 8 + 2 * 3 * 8);
  EXPECT_EQ(bytes[head.size() + 8], 0b1101);
  const std::string part = bytes_of(small_part(), small_order());
  EXPECT_EQ(part.size(), 15U + 4 + 8 + 8 + 8 + 8 + 4 * 49 * 4);
}

TEST(PartBytes, OfOtherLengthsAreRefused) {
  const PartOrder order = small_order();
  const std::string of_order = bytes_of(order);
  for (std::size_t size = 0; size < of_order.size(); ++size)
    EXPECT_TRUE(is_refused([&] { part_order_of(of_order.substr(0, size)); })) << size;
  EXPECT_TRUE(is_refused([&] { part_order_of(of_order + '\0'); }));
  const std::string of_part = bytes_of(small_part(), order);
  for (std::size_t size = 0; size < of_part.size(); ++size)
    EXPECT_TRUE(is_refused([&] { traced_part_of(of_part.substr(0, size), order); })) << size;
  EXPECT_TRUE(is_refused([&] { traced_part_of(of_part + '\0', order); }));
}

TEST(PartBytes, OfOtherFormsAreRefused) {
  const PartOrder order = small_order();
  const std::string of_order = bytes_of(order);
  const std::string of_part = bytes_of(small_part(), order);
  const auto with = [](std::string bytes, std::size_t at, auto value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
    return bytes;
  };
  const auto refuses_order = [&](std::size_t at, auto value) {
    return is_refused([&] { part_order_of(with(of_order, at, value)); });
  };
  const auto refuses_part = [&](std::size_t at, auto value) {
    return is_refused([&] { traced_part_of(with(of_part, at, value), order); });
  };
  EXPECT_TRUE(refuses_order(0, 'F'));
  EXPECT_TRUE(refuses_order(16, std::uint32_t{2})) << "version";
  EXPECT_TRUE(refuses_order(20, std::uint32_t{0xffffffff})) << "length of the method's name";
  const std::size_t width = 16 + 4 + 4 + 13 + 4;
  for (const std::uint32_t wrong : {0U, 0xffffffffU, 31U << 20U})
    EXPECT_TRUE(refuses_order(width, wrong));
  EXPECT_TRUE(refuses_order(width, std::uint32_t{33})) << "other tiles";
  const std::size_t tiles = width + 8;
  for (const std::uint64_t wrong : {std::uint64_t{3}, ~std::uint64_t{0}, std::uint64_t{1} << 60U})
    EXPECT_TRUE(refuses_order(tiles, wrong));
  const std::size_t first = tiles + 8 + 1;
  for (const std::uint64_t wrong : {std::uint64_t{38}, ~std::uint64_t{0}})
    EXPECT_TRUE(refuses_order(first, wrong)) << "blocks outside the picture, which has 8 x 5";
  EXPECT_FALSE(refuses_order(first, std::uint64_t{37}));
  for (const std::uint64_t wrong :
       {std::uint64_t{0}, std::uint64_t{4}, ~std::uint64_t{0}, std::uint64_t{1} << 61U})
    EXPECT_TRUE(refuses_order(first + 8, wrong)) << "count of blocks";
  EXPECT_TRUE(refuses_order(first + 16, std::uint32_t{5})) << "samples from 5 to 4";
  EXPECT_TRUE(refuses_order(first + 20, std::uint32_t{65'537})) << "too many samples";

  EXPECT_TRUE(refuses_part(0, 'F'));
  EXPECT_TRUE(refuses_part(15, std::uint32_t{2})) << "version";
  EXPECT_TRUE(refuses_part(19, std::uint64_t{0})) << "of another order";
  for (const std::uint64_t wrong : {std::uint64_t{3}, std::uint64_t{1} << 60U, ~std::uint64_t{0}})
    EXPECT_TRUE(refuses_part(43, wrong)) << "count of sums";
  EXPECT_TRUE(refuses_part(51 + 48 * 4, -1.0F));
  EXPECT_TRUE(refuses_part(51 + 48 * 4, std::numeric_limits<float>::quiet_NaN()));
  PartOrder other = order;
  other.samples[0][0].end = 5;
  EXPECT_TRUE(is_refused([&] { traced_part_of(of_part, other); }));
}

// Whatever a byte is changed to, it is refused or means something else that can be.
TEST(PartBytes, AnyChangedByteIsHarmless) {
  const std::string bytes = bytes_of(small_order());
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (int value = 0; value < 256; ++value) {
      std::string changed = bytes;
      changed[at] = static_cast<char>(value);
      try {
        const PartOrder order = part_order_of(changed);
        EXPECT_LE(order.first_block + order.blocks(), order.grid().count());
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::invalid_request);
      }
    }
  }
}

TEST(Parts, OrdersOfOtherPicturesAreRefused) {
  const RayScene scene(busy_scene());
  const SimulationSpec spec = shot("lens-sampling");
  PartOrder order{.method = "lens-sampling",
                  .width = spec.width,
                  .height = spec.height,
                  .first_block = 3,
                  .samples = {{{{0, 2}}, {{0, 0}}}}};
  EXPECT_EQ(traced_part(spec, scene, order, {}).sums.size(), 1U);
  for (const char* method : {"wave", "gather", "auto", ""}) {
    PartOrder other = order;
    other.method = method;
    EXPECT_TRUE(is_refused([&] { traced_part(spec, scene, other, {}); })) << method;
  }
  PartOrder wide = order;
  wide.width = spec.width + 1;
  EXPECT_TRUE(is_refused([&] { traced_part(spec, scene, wide, {}); }));
  SimulationSpec timed = spec;
  timed.quality.max_time_ms = 100.0;
  EXPECT_TRUE(is_refused([&] { traced_part(timed, scene, order, {}); }));
}

TEST(Parts, AStopEndsThem) {
  const RayScene scene(busy_scene());
  SimulationSpec spec = shot("lens-sampling");
  std::stop_source stop;
  stop.request_stop();
  RunControl run;
  run.stop = stop.get_token();
  const PartOrder order{.method = "lens-sampling",
                        .width = spec.width,
                        .height = spec.height,
                        .samples = {{{{0, 2}}, {{0, 2}}}}};
  try {
    traced_part(spec, scene, order, run);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::cancelled);
  }
}

}  // namespace
}  // namespace fstop
