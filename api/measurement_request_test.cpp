#include "api/measurement_request.h"

#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/contract_schema.h"
#include "api/problem.h"

namespace fstop::api {
namespace {

using nlohmann::json;

const std::string kId(64, '0');

// Linear RGB whose channels are 1, 1/2 and 1/4 of the pixel averages of `value` by 16 x 16 points.
Image picture(int width, int height, const std::function<double(double, double)>& value) {
  constexpr int kSide = 16;
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0.0;
      for (int i = 0; i < kSide * kSide; ++i) {
        sum += value(x + (i % kSide + 0.5) / kSide, y + (i / kSide + 0.5) / kSide);
      }
      for (int c = 0; c < 3; ++c) {
        image.at(x, y)[c] = static_cast<float>(std::ldexp(sum / (kSide * kSide), -c));
      }
    }
  }
  return image;
}

json answer(const json& measurements, const Image& image, std::optional<Length> pitch = {}) {
  const json request = {{"render", kId}, {"measurements", measurements}};
  const json value = json::parse(measurement_json(
      parse_measurement_request(request.dump(), Limits{}), image.view(), pitch, Limits{}));
  EXPECT_EQ(ContractSchema("MeasurementReport").objection(value), "") << value;
  return value;
}

std::vector<std::string> pointers(const std::string& body) {
  try {
    parse_measurement_request(body, Limits{});
  } catch (const InvalidRequest& invalid) {
    std::vector<std::string> result;
    for (const FieldFault& fault : invalid.faults()) result.push_back(fault.pointer);
    return result;
  }
  return {};
}

// 16 x 16 points place the rim within 1/16 px at random; of a disc 20 px wide that is far below
// 0.2 % of its diameter.
TEST(MeasurementRequest, MeasuresASpotInPixelsAndOnTheSensor) {
  const Image image = picture(64, 48, [](double x, double y) {
    return std::hypot(x - 30.0, y - 24.0) <= 10.0 ? 1.0 : 0.0;
  });
  const json value = answer({{{"kind", "spot"},
                              {"channel", "green"},
                              {"background", 0},
                              {"region", {{"x", 10}, {"y", 4}, {"width", 40}, {"height", 40}}}}},
                            image, 4.0_um);
  EXPECT_EQ(value["width"], 64);
  EXPECT_EQ(value["height"], 48);
  EXPECT_DOUBLE_EQ(value["pixel_um"], 4.0);
  const json& spot = value["measurements"][0];
  EXPECT_NEAR(spot["disc_diameter_px"].get<double>(), 20.0, 0.04);
  EXPECT_NEAR(spot["disc_diameter_um"].get<double>(), 80.0, 0.16);
  EXPECT_NEAR(spot["centroid_px"]["x"].get<double>(), 30.0, 1e-6);
  EXPECT_NEAR(spot["centroid_px"]["y"].get<double>(), 24.0, 1e-6);
  EXPECT_NEAR(spot["energy"].get<double>(), 0.5 * std::numbers::pi * 100.0, 0.5);
}

TEST(MeasurementRequest, ChannelsAndLuminanceAreThoseOfRec709) {
  const Image image = picture(
      32, 32, [](double x, double y) { return std::hypot(x - 16.0, y - 16.0) <= 6.0 ? 1.0 : 0.0; });
  json questions = json::array();
  for (const char* channel : {"red", "green", "blue", "luminance"}) {
    questions.push_back({{"kind", "spot"}, {"channel", channel}});
  }
  const json value = answer(questions, image)["measurements"];
  const double red = value[0]["energy"];
  EXPECT_NEAR(value[1]["energy"].get<double>() / red, 0.5, 1e-6);
  EXPECT_NEAR(value[2]["energy"].get<double>() / red, 0.25, 1e-6);
  EXPECT_NEAR(value[3]["energy"].get<double>() / red, 0.2126 + 0.7152 / 2 + 0.0722 / 4, 1e-6);
  EXPECT_FALSE(value[0].contains("disc_diameter_um"));
}

// An edge that rises linearly over w px has the transfer of a box of that width, times the
// pixel's: sinc(w nu) falls to one half at w nu = 0.6034; the pixel takes 2 % off at 0.06
// cycles/px, so MTF50 lies between that and 3 % less.
TEST(MeasurementRequest, MeasuresASlantedEdge) {
  const double angle = 8.0 * std::numbers::pi / 180.0;
  const double rise = 10.0;
  const Image image = picture(80, 80, [&](double x, double y) {
    const double across = (x - 40.0) * std::cos(angle) + (y - 40.0) * std::sin(angle);
    return 0.1 + 0.8 * std::clamp(across / rise + 0.5, 0.0, 1.0);
  });
  const json value = answer({{{"kind", "slanted-edge"}, {"channel", "red"}}}, image, 5.0_um);
  const json& edge = value["measurements"][0];
  EXPECT_NEAR(edge["slant_deg"].get<double>(), 8.0, 0.05);
  EXPECT_NEAR(edge["levels"]["dark"].get<double>(), 0.1, 2e-3);
  EXPECT_NEAR(edge["levels"]["bright"].get<double>(), 0.9, 2e-3);
  EXPECT_NEAR(edge["rise_10_90_px"].get<double>(), 0.8 * rise, 0.1);
  EXPECT_LT(edge["mtf50_per_px"].get<double>(), 0.06034);
  EXPECT_GT(edge["mtf50_per_px"].get<double>(), 0.97 * 0.06034);
  EXPECT_NEAR(edge["mtf50_per_mm"].get<double>(), edge["mtf50_per_px"].get<double>() / 0.005, 1e-9);
  EXPECT_EQ(edge["mtf"].size(), 101U);
}

TEST(MeasurementRequest, MeasuresTheOtherKindsToo) {
  const Vec2 centre = {40.0, 40.0};
  const auto star = [&](double x, double y) {
    return 0.5 + 0.4 * std::cos(12.0 * std::atan2(centre.y - y, x - centre.x));
  };
  const json value = answer({{{"kind", "sharpness"}},
                             {{"kind", "star"},
                              {"channel", "red"},
                              {"center_px", {{"x", 40}, {"y", 40}}},
                              {"cycles", 12},
                              {"mean", 0.5},
                              {"amplitude", 0.4},
                              {"radii_px", {30}}}},
                            picture(80, 80, star));
  EXPECT_GT(value["measurements"][0]["tenengrad"].get<double>(), 0.0);
  // The pixel's square alone blurs: sinc(1/16) of 12/(2 pi 30) = 1/15.7 cycles/px, 0.993.
  EXPECT_NEAR(value["measurements"][1]["rings"][0]["modulation"].get<double>(), 0.993, 0.003);
}

TEST(MeasurementRequest, RefusesWithEveryFault) {
  using Pointers = std::vector<std::string>;
  const std::string spot = R"("measurements": [{"kind": "spot"}])";
  EXPECT_EQ(pointers("{}"), (Pointers{"#", "#/measurements"}));
  EXPECT_EQ(pointers("{" + spot + "}"), Pointers{"#"});
  EXPECT_EQ(pointers(R"({"render": "x", "image": {}, )" + spot + "}"), Pointers{"#"});
  EXPECT_EQ(pointers(R"({"render": "x", )" + spot + "}"), Pointers{"#/render"});
  EXPECT_EQ(pointers(R"({"render": ")" + kId + R"("})"), Pointers{"#/measurements"});
  for (const char* text : {"A", "AAA", "AA=A", "====", "AA-_", "AAAA\\n", " AAA"}) {
    EXPECT_EQ(pointers(R"({"image": {"base64": ")" + std::string(text) + R"("}, )" + spot + "}"),
              Pointers{"#/image/base64"})
        << text;
  }
  EXPECT_EQ(
      pointers(R"({"image": {"base64": "AAAA", "pixel_um": -1, "a": 1}, "measurements": [
      {"kind": "spot", "blades": 1}, {"kind": "guess"},
      {"kind": "slanted-edge", "levels": {"dark": 1, "bright": 1}},
      {"kind": "star", "center_px": {"x": 1}}]})"),
      (Pointers{"#/image/pixel_um", "#/image/a", "#/measurements/0/blades", "#/measurements/1/kind",
                "#/measurements/2/levels/bright", "#/measurements/3/center_px/y",
                "#/measurements/3/cycles", "#/measurements/3/mean", "#/measurements/3/amplitude",
                "#/measurements/3/radii_px"}));
}

TEST(MeasurementRequest, SaysWhatThePictureDoesNotAnswer) {
  const Image black(32, 32, 3);
  const auto faults = [&](const json& questions, ErrorCode code, const Limits& limits = {}) {
    const json request = {{"render", kId}, {"measurements", questions}};
    std::vector<std::string> result;
    try {
      measurement_json(parse_measurement_request(request.dump(), limits), black.view(), {}, limits);
    } catch (const InvalidRequest& invalid) {
      EXPECT_EQ(invalid.code(), code);
      for (const FieldFault& fault : invalid.faults()) result.push_back(fault.pointer);
    }
    return result;
  };
  using Pointers = std::vector<std::string>;
  const json outside = {{"x", 30}, {"y", 0}, {"width", 3}, {"height", 3}};
  EXPECT_EQ(
      faults({{{"kind", "spot"}},
              {{"kind", "sharpness"}},
              {{"kind", "slanted-edge"}},
              {{"kind", "disc-edge"}},
              {{"kind", "sharpness"}, {"region", outside}}},
             ErrorCode::outside_domain),
      (Pointers{"#/measurements/0", "#/measurements/2", "#/measurements/3", "#/measurements/4"}));
  Limits few;
  few.measured_pixels = 1500.0;
  EXPECT_EQ(faults({{{"kind", "sharpness"}}, {{"kind", "sharpness"}}}, ErrorCode::over_budget, few),
            Pointers{"#/measurements/1"});
}

TEST(MeasurementRequest, APictureLeavesItsReaderAsItIs) {
  const Image image = picture(7, 5, [](double x, double y) { return x + 10.0 * y; });
  EXPECT_EQ(unpacked_image(packed_image(image), Limits{}), image);
  const std::string good = packed_image(image);
  Limits few;
  few.measured_image_pixels = 34;
  EXPECT_THROW(unpacked_image(good, few), Error);
  for (const std::string& bad :
       {std::string(), std::string("7"), std::string("7 5"), std::string("-7 5\n"),
        good.substr(0, good.size() - 1), good + "x", "70000 70000\n" + good}) {
    EXPECT_THROW(unpacked_image(bad, Limits{}), Error);
  }
}

}  // namespace
}  // namespace fstop::api
