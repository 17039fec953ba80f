#include "api/composite.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/contract_schema.h"
#include "core/encode/image_codec.h"
#include "core/error.h"

namespace fstop::api {
namespace {

using nlohmann::json;

const std::string kId(64, 'a');

json stack_of(int count) {
  json request = {{"layers", json::array()}};
  for (int i = 0; i < count; ++i) request["layers"].push_back({{"render", kId}});
  return request;
}

CompositeRequest parsed(const json& request, SceneNames names = SceneNames::stored_only) {
  return parse_composite_request(request.dump(), Limits{}, names);
}

Image flat(int width, int height, std::initializer_list<float> values) {
  Image image(width, height, static_cast<int>(values.size()));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) std::copy(values.begin(), values.end(), image.at(x, y));
  }
  return image;
}

// The fault at `pointer`, or all that there are.
std::string fault_at(const std::function<void()>& act, const std::string& pointer) {
  try {
    act();
  } catch (const InvalidRequest& refused) {
    std::string all;
    for (const FieldFault& fault : refused.faults()) {
      if (fault.pointer == pointer) return fault.detail;
      all += " [" + fault.pointer + ": " + fault.detail + "]";
    }
    return "no such fault:" + all;
  }
  return "nothing was refused";
}

TEST(CompositeRequest, ReadsLayersAndFillsDefaults) {
  const CompositeRequest request = parsed(json::parse(R"({"layers": [
      {"render": {"scene": "charts", "camera": {"lens": {}}}},
      {"render": {"scene": "charts", "camera": {"lens": {}}, "image": {"format": "jpeg"}},
       "opacity": 0.5, "offset_px": [-3, 4]},
      {"image": {"base64": "AAAA", "color_space": "linear", "alpha": "premultiplied"},
       "operation": "key", "key": {"color": [0, 0.5, 0], "softness": 0}}],
      "outputs": ["alpha"], "image": {"format": "exr", "precision": "half"}})"));
  ASSERT_EQ(request.layers.size(), 3U);
  EXPECT_EQ(request.format, ImageFormat::exr);
  EXPECT_EQ(request.precision, Precision::half);
  EXPECT_TRUE(request.wants_alpha);
  const auto& lowest = std::get<RenderRequest>(request.layers[0].source);
  EXPECT_EQ(lowest.spec.outputs, std::vector{Output::color});
  EXPECT_EQ(request.layers[0].opacity, 1.0);
  EXPECT_FALSE(request.layers[0].offset);
  // Laid over others its coverage is needed, whatever file its request speaks of.
  const auto& upper = std::get<RenderRequest>(request.layers[1].source);
  EXPECT_EQ(upper.spec.outputs, (std::vector{Output::color, Output::alpha}));
  EXPECT_EQ(request.layers[1].offset, (std::array<int, 2>{-3, 4}));
  const auto& image = std::get<LayerImage>(request.layers[2].source);
  EXPECT_EQ(image.bytes, std::string(3, '\0'));
  EXPECT_EQ(image.color_space, ColorSpace::linear);
  EXPECT_TRUE(image.is_premultiplied);
  EXPECT_EQ(request.layers[2].kind, LayerKind::key);
  EXPECT_EQ(request.layers[2].key.color[1], 0.5F);
  EXPECT_EQ(request.layers[2].key.tolerance, 0.1);
  EXPECT_EQ(request.layers[2].key.softness, 0.0);
  EXPECT_NE(request.normalised.find("sha256:"), std::string::npos);
}

TEST(CompositeRequest, NamesEveryFaultAtItsPlace) {
  const json request = json::parse(R"({"layers": [
      {"render": {"scene": "charts", "camera": {"lens": {"f_number": 0.1}, "zoom": 2},
                  "quality": {"max_time_ms": 5}}},
      {"render": "abc"},
      {"image": {"file": "floor.png"}, "key": {"color": [0, 1, 0]}},
      {"opacity": 2}],
      "outputs": ["alpha"], "image": {"format": "jpeg"}})");
  const auto act = [&] { parsed(request); };
  EXPECT_NE(fault_at(act, "#/layers/0/render/camera/lens/f_number").find("0.5"), std::string::npos);
  EXPECT_NE(fault_at(act, "#/layers/0/render/camera/zoom").find("unknown"), std::string::npos);
  EXPECT_NE(fault_at(act, "#/layers/1/render").find("64 hex"), std::string::npos);
  EXPECT_NE(fault_at(act, "#/layers/2/image/file").find("scene/file"), std::string::npos);
  EXPECT_NE(fault_at(act, "#/layers/2/key").find("operation"), std::string::npos);
  EXPECT_NE(fault_at(act, "#/layers/3").find("render and image"), std::string::npos);
  EXPECT_NE(fault_at(act, "#/layers/3/opacity").find("0 to 1"), std::string::npos);
  EXPECT_NE(fault_at(act, "#/image/format").find("jpeg"), std::string::npos);
  const json hurried = json::parse(R"({"layers": [{"render": {"scene": "charts",
      "camera": {"lens": {}}, "quality": {"max_time_ms": 5}}}]})");
  EXPECT_NE(
      fault_at([&] { parsed(hurried); }, "#/layers/0/render/quality/max_time_ms").find("moment"),
      std::string::npos);
  EXPECT_NE(fault_at([] { parsed(stack_of(17)); }, "#/layers").find("16"), std::string::npos);
}

TEST(CompositeRequest, TooMuchWorkIsOverBudget) {
  const json request = json::parse(R"({"layers": [{"render": {"scene": "charts",
      "camera": {"lens": {}}, "image": {"width": 16200, "height": 10800}}}]})");
  try {
    parsed(request);
    FAIL() << "nothing was refused";
  } catch (const InvalidRequest& refused) {
    EXPECT_EQ(refused.code(), ErrorCode::over_budget);
    EXPECT_EQ(refused.faults().front().pointer, "#/layers/0/render/image");
  }
}

TEST(CompositeRequest, FilesBesideARequestBelongToTheCommandLine) {
  json request;
  request["layers"] = json::array({json{{"image", {{"file", "plate.png"}}}}});
  EXPECT_EQ(
      std::get<LayerImage>(parsed(request, SceneNames::stored_or_files).layers[0].source).file,
      "plate.png");
  EXPECT_THROW(parsed(request), InvalidRequest);
}

// A red half-covering layer over a white one at half its opacity: 0.25 (0.5, 0, 0) + 0.75 ... by
// hand: alpha 0.5 * 0.5 = 0.25; red 0.25 + 0.75, green 0.75.
TEST(Compositor, LaysLayersByTheAlgebra) {
  json body = stack_of(2);
  body["layers"][1]["opacity"] = 0.5;
  body["outputs"] = json::array({"alpha"});
  const CompositeRequest request = parsed(body);
  Compositor compositor(request);
  compositor.add({.color = flat(4, 3, {1, 1, 1}), .error = {.color = 0.01}, .render = kId});
  compositor.add({.color = flat(4, 3, {0.5F, 0, 0}),
                  .alpha = flat(4, 3, {0.5F}),
                  .error = {.color = 0.02, .alpha = 0.04},
                  .render = kId});
  const Composite made = compositor.finish(kId);
  EXPECT_EQ(made.color, flat(4, 3, {1.0F, 0.75F, 0.75F}));
  EXPECT_EQ(made.alpha, flat(4, 3, {1.0F}));
  // 0.5 * 0.02 + 0.5 * 0.04 * 1 + 0.75 * 0.01
  EXPECT_NEAR(made.error.color, 0.01 + 0.02 + 0.0075, 1e-12);
  const json report = json::parse(made.report);
  EXPECT_EQ(ContractSchema("CompositeReport").objection(report), "");
  EXPECT_EQ(report["error"]["upper"], made.error.color);
  EXPECT_NEAR(report["error"]["confidence"].get<double>(), 0.9, 1e-12);
  EXPECT_EQ(report["layers"][0]["render"], kId);
}

// What is exact leaves nothing to be sure of.
TEST(Compositor, PicturesHaveNoError) {
  const CompositeRequest request = parsed(stack_of(1));
  Compositor compositor(request);
  compositor.add({.color = flat(2, 2, {1, 0.5F, 0})});
  const Composite made = compositor.finish(kId);
  EXPECT_TRUE(made.alpha.empty());
  const json report = json::parse(made.report);
  EXPECT_EQ(report["error"]["upper"], 0.0);
  EXPECT_EQ(report["error"]["confidence"], 1.0);
}

TEST(Compositor, AKeyTakesOutItsBackingAndKeepsWhatWasTransparent) {
  json body = stack_of(2);
  body["layers"][1]["operation"] = "key";
  body["layers"][1]["key"] = {{"color", {0, 1, 0}}};
  const CompositeRequest request = parsed(body);
  Compositor compositor(request);
  compositor.add({.color = flat(3, 1, {0.25F, 0.5F, 1})});
  LayerPicture top{.color = flat(3, 1, {0, 1, 0}), .alpha = flat(3, 1, {1})};
  std::fill_n(top.color.at(1, 0), 3, 0.5F);  // grey: the subject
  std::fill_n(top.color.at(2, 0), 3, 0.0F);  // nothing at all
  *top.alpha.at(2, 0) = 0.0F;
  compositor.add(top);
  const Image color = compositor.finish(kId).color;
  EXPECT_EQ(color.at(0, 0)[1], 0.5F);
  EXPECT_EQ(color.at(1, 0)[0], 0.5F);
  EXPECT_EQ(color.at(2, 0)[2], 1.0F);
}

TEST(Compositor, AnotherSizeNeedsAnOffset) {
  json body = stack_of(2);
  const LayerPicture lowest{.color = flat(4, 3, {1, 1, 1})};
  const LayerPicture small{.color = flat(2, 2, {0.5F, 0.5F, 0.5F})};
  {
    const CompositeRequest request = parsed(body);
    Compositor compositor(request);
    compositor.add(lowest);
    const std::string why = fault_at([&] { compositor.add(small); }, "#/layers/1");
    EXPECT_NE(why.find("2 x 2"), std::string::npos) << why;
    EXPECT_NE(why.find("offset_px"), std::string::npos) << why;
    EXPECT_THROW(compositor.finish(kId), Error);
  }
  body["layers"][1]["offset_px"] = {3, 1};
  const CompositeRequest request = parsed(body);
  Compositor compositor(request);
  compositor.add(lowest);
  compositor.add(small);
  const Image color = compositor.finish(kId).color;
  EXPECT_EQ(color.at(3, 1)[0], 0.5F);
  EXPECT_EQ(color.at(2, 1)[0], 1.0F);
}

TEST(Compositor, FilesBringTheirAlpha) {
  const Picture straight{{{{"R", "G", "B", "A"}, flat(2, 2, {1, 0.5F, 0, 0.5F})}}, {}};
  const std::vector<std::byte> png = encode(straight, ImageFormat::png);
  const LayerPicture layer = layer_picture(png, LayerImage{}, Limits{});
  ASSERT_FALSE(layer.alpha.empty());
  EXPECT_FALSE(layer.is_premultiplied);
  EXPECT_EQ(*layer.alpha.at(0, 0), 128.0F / 255.0F);  // round(127.5)
  EXPECT_EQ(layer.color.at(0, 0)[0], 1.0F);
  EXPECT_EQ(layer.error.color, 0.0);
}

// EXR multiplied, the others straight, JPEG not at all.
TEST(Compositor, FilesOfCompositesHoldAlphaAsTheirFormatDoes) {
  const Composite composite{.color = flat(2, 2, {0.25F, 0.125F, 0}), .alpha = flat(2, 2, {0.5F})};
  const Image exr =
      decode(encode(composite_picture(composite, kId, ImageFormat::exr), ImageFormat::exr))
          .layers.front()
          .image;
  EXPECT_EQ(exr, flat(2, 2, {0.25F, 0.125F, 0, 0.5F}));
  const Image tiff =
      decode(encode(composite_picture(composite, kId, ImageFormat::tiff), ImageFormat::tiff))
          .layers.front()
          .image;
  EXPECT_EQ(tiff, flat(2, 2, {0.5F, 0.25F, 0, 0.5F}));
  EXPECT_THROW(composite_picture(composite, kId, ImageFormat::jpeg), Error);
}

TEST(Compositor, IdsTellRequestsAndContentsApart) {
  const CompositeRequest one = parsed(stack_of(1));
  const CompositeRequest two = parsed(stack_of(2));
  EXPECT_EQ(composite_id(one, {"x"}), composite_id(one, {"x"}));
  EXPECT_NE(composite_id(one, {"x"}), composite_id(one, {"y"}));
  EXPECT_NE(composite_id(one, {"x"}), composite_id(two, {"x"}));
  EXPECT_EQ(composite_id(one, {"x"}).size(), 64U);
}

}  // namespace
}  // namespace fstop::api
