#include "api/baseline_record.h"

#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/problem.h"
#include "api/render_id.h"
#include "api/render_request.h"

namespace fstop::api {
namespace {

ImageBaseline some_baseline() {
  BaselineBuilder builder;
  for (int k = 0; k < 3; ++k) {
    Image image(20, 18, 3);
    for (std::size_t i = 0; i < image.pixels().size(); ++i) {
      image.pixels()[i] =
          0.01F * static_cast<float>((i * 7 + static_cast<std::size_t>(k) * 13) % 29);
    }
    builder.add(image);
  }
  return builder.finish();
}

BaselineRecord some_record(const ImageBaseline& baseline, const std::vector<std::byte>& file) {
  return {.request = R"({"scene":"tiny","seed":5})",
          .image_sha256 = sha256_hex(file),
          .replicates = baseline.replicates,
          .total = baseline.total,
          .total_variance = baseline.total_variance,
          .accepted = {{.who = "one",
                        .why = "new \"sky\"",
                        .engine = "fstop/1",
                        .change = BaselineChange{.rmse = 0.1,
                                                 .largest_deviation = 12.0,
                                                 .brightness = {1.01, 1.0, 0.99}}},
                       {.who = "another", .why = "first", .engine = "fstop/0"}}};
}

TEST(BaselineRecord, IsReadAsItWasWritten) {
  const ImageBaseline baseline = some_baseline();
  const std::vector<std::byte> file = baseline_file(baseline);
  const BaselineRecord record = some_record(baseline, file);
  const BaselineRecord read = parse_baseline_record(baseline_record_json(record), Limits{});
  EXPECT_EQ(read.request, record.request);
  EXPECT_EQ(read.total, record.total);
  EXPECT_EQ(read.total_variance, record.total_variance);
  ASSERT_EQ(read.accepted.size(), 2U);
  EXPECT_EQ(read.accepted[0].why, "new \"sky\"");
  ASSERT_TRUE(read.accepted[0].change);
  EXPECT_EQ(read.accepted[0].change->brightness[2], 0.99);
  EXPECT_FALSE(read.accepted[1].change);
  const ImageBaseline image = baseline_of(file, read);
  EXPECT_EQ(image.mean, baseline.mean);
  EXPECT_EQ(image.variance, baseline.variance);
  EXPECT_EQ(image.block_variance, baseline.block_variance);
  EXPECT_EQ(image.replicates, 3);
}

TEST(BaselineRecord, OtherBytesThanThoseAcceptedAreRefused) {
  const ImageBaseline baseline = some_baseline();
  std::vector<std::byte> file = baseline_file(baseline);
  const BaselineRecord record = some_record(baseline, file);
  file.back() ^= std::byte{1};
  EXPECT_THROW(baseline_of(file, record), Error);
  EXPECT_THROW(parse_baseline_record("{\"format\": \"fstop-baseline/1\"}", Limits{}),
               InvalidRequest);
  EXPECT_THROW(parse_baseline_record("", Limits{}), InvalidRequest);
}

TEST(BaselineRecord, ReplicatesDifferFromTheRequestInTheSeedAlone) {
  const RenderRequest request = parse_render_request(
      R"({"scene": "tiny", "camera": {"lens": {"f_number": 2}}, "seed": 4294967295,
          "image": {"width": 30, "height": 20, "format": "png"}})",
      Limits{}, SceneNames::stored_only);
  std::set<std::uint32_t> seeds = {request.spec.seed};
  for (int i = 0; i < 256; ++i) seeds.insert(replicate_seed(request.spec.seed, i));
  EXPECT_EQ(seeds.size(), 257U);
  const std::string text = request_with_seed(request.normalised, 17);
  const RenderRequest other = parse_render_request(text, Limits{}, SceneNames::stored_only);
  EXPECT_EQ(other.spec.seed, 17U);
  EXPECT_EQ(other.format, ImageFormat::exr);
  const RenderRequest back = parse_render_request(request_with_seed(text, request.spec.seed),
                                                  Limits{}, SceneNames::stored_only);
  EXPECT_EQ(back.normalised, request.normalised);
}

}  // namespace
}  // namespace fstop::api
