// POST /v1/measurements: what finished renders and pictures that are sent tell of their blur.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/encode/image_codec.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using nlohmann::json;

class Measurements : public testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new TestServer; }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  static Answer post(const json& request) {
    return ask(server_->port(), "POST", "/v1/measurements", {}, request.dump());
  }
  static TestServer* server_;
};
TestServer* Measurements::server_ = nullptr;

std::string base64(const std::string& bytes) {
  static constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const bool is_padding = i + k > bytes.size();
      text += is_padding ? '=' : kLetters[group >> (18 - 6 * k) & 63U];
    }
  }
  return text;
}

json example() {
  return json::parse(text_of_file(FSTOP_SOURCE_DIR "/api/examples/measurements-spot.json"));
}

// A sphere that is half a pixel wide, 3 m away, through a lens focused at 2 m.
json point_shot(double f_number) {
  return json::parse(R"({"scene": {"format": "fstop-scene/1",
      "materials": {"lamp": {"model": "unlit", "emission": [400, 400, 400]}},
      "objects": [{"type": "sphere", "center_m": [0, 0, -3], "radius_m": 0.00012,
                   "material": "lamp"}]},
    "camera": {"sensor_mm": [1, 1], "lens": {"focal_length_mm": 50, "focus_distance_m": 2,
                                             "f_number": )" +
                     std::to_string(f_number) + R"(}},
    "image": {"width": 128, "height": 128}, "quality": {"max_error": 0.002},
    "effects": {"defocus": "on", "diffraction": "off"}})");
}

// c = A v (1/s - 1/d), A = f/N, 1/v = 1/f - 1/s. Tolerance 1 %: the disc is 35 to 90 px wide, its
// mean square is of thousands of pixels with errors far below theirs; as splats of 0.2 %.
TEST_F(Measurements, APointsDiscIsTheThinLensCircleOfConfusion) {
  for (const double f_number : {1.4, 2.8}) {
    const Answer rendered =
        ask(server_->port(), "POST", "/v1/renders", {}, point_shot(f_number).dump());
    ASSERT_EQ(rendered.status, 200) << rendered.body;
    const Answer measured =
        post({{"render", rendered.header("fstop-render-id")},
              {"measurements", {{{"kind", "spot"}, {"background", 0}, {"channel", "red"}}}}});
    ASSERT_EQ(measured.status, 200) << measured.body;
    const json value = json::parse(measured.body);
    EXPECT_NEAR(value["pixel_um"].get<double>(), 1000.0 / 128.0, 1e-9);
    const double v_mm = 1.0 / (1.0 / 50.0 - 1.0 / 2000.0);
    const double coc_um = 1e3 * (50.0 / f_number) * v_mm * (1.0 / 2000.0 - 1.0 / 3000.0);
    EXPECT_NEAR(value["measurements"][0]["disc_diameter_um"].get<double>() / coc_um, 1.0, 0.01)
        << "f/" << f_number;
  }
}

// A disc of 10 px: sampling by pixels leaves 0.023 px of its diameter (core/measure/spot.h), the
// rounding of its 20 rim pixels to 8 bits less than a tenth of that.
TEST_F(Measurements, TheExampleIsADiscOfTenPixels) {
  const Answer measured = post(example());
  ASSERT_EQ(measured.status, 200) << measured.body;
  EXPECT_EQ(measured.header("cache-control"), "no-store");
  const json value = json::parse(measured.body);
  EXPECT_NEAR(value["measurements"][0]["disc_diameter_px"].get<double>(), 10.0, 0.03);
  EXPECT_NEAR(value["measurements"][0]["disc_diameter_um"].get<double>(), 50.0, 0.15);
  EXPECT_EQ(value["measurements"][1]["kind"], "sharpness");
}

// What is sent as PNG and JPEG is decoded from sRGB unless it is said to be linear; EXR is linear.
TEST_F(Measurements, PicturesThatAreSentAreReadAsTheyAreEncoded) {
  Image disc(40, 40, 3);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 3; ++c) disc.at(x, y)[c] = std::hypot(x - 19.5, y - 19.5) < 9 ? 0.5F : 0;
    }
  }
  const auto energy = [&](ImageFormat format, const char* color_space) {
    const auto bytes =
        encode({.layers = {{.channel_names = {"R", "G", "B"}, .image = disc}}}, format);
    const std::string file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const Answer measured =
        post({{"image", {{"base64", base64(file)}, {"color_space", color_space}}},
              {"measurements", {{{"kind", "spot"}}}}});
    EXPECT_EQ(measured.status, 200) << measured.body;
    return json::parse(measured.body)["measurements"][0]["energy"].get<double>();
  };
  const double exact = energy(ImageFormat::exr, "srgb");
  EXPECT_NEAR(energy(ImageFormat::png, "srgb"), exact, 0.01 * exact);
  EXPECT_NEAR(energy(ImageFormat::jpeg, "srgb"), exact, 0.03 * exact);
  // 0.5 is 0.7354 in sRGB (IEC 61966-2-1).
  EXPECT_NEAR(energy(ImageFormat::png, "linear"), 0.7354 / 0.5 * exact, 0.01 * exact);
}

TEST_F(Measurements, RefusesWithPointersAndReasons) {
  const json spot = {{{"kind", "spot"}}};
  const auto sent = [&](const std::string& bytes) {
    return json{{"image", {{"base64", base64(bytes)}}}, {"measurements", spot}};
  };
  json empty_region = example();
  empty_region["measurements"][0]["region"] = {{"x", 0}, {"y", 0}, {"width", 3}, {"height", 3}};
  json far_region = example();
  far_region["measurements"][1]["region"]["x"] = 23;
  // A header that promises a million times what the bytes can hold.
  std::string png = "\x89PNG\r\n\x1a\n";
  png += std::string("\0\0\0\rIHDR\0\0\xff\xff\0\0\xff\xff\x08\2\0\0\0", 25) + "\1\2\3\4";
  struct Case {
    json request;
    int status;
    const char* text;
  };
  const std::vector<Case> table = {
      {json::object(), 422, "#/measurements"},
      {{{"render", std::string(64, 'a')}, {"measurements", spot}}, 404, "not-found"},
      {{{"render", "a"}, {"measurements", spot}}, 422, "#/render"},
      {sent("no picture at all"), 422, "#/image/base64"},
      {sent("\x89PNG\r\n\x1a\nxxxxxxxx"), 422, "bad-image"},
      {sent(png), 422, "#/image/base64"},
      {empty_region, 422, "#/measurements/0"},
      {far_region, 422, "#/measurements/1"},
  };
  for (const Case& wrong : table) {
    const Answer answer = post(wrong.request);
    EXPECT_EQ(answer.status, wrong.status) << wrong.request;
    EXPECT_EQ(answer.header("content-type"), "application/problem+json");
    EXPECT_NE(answer.body.find(wrong.text), std::string::npos) << answer.body;
  }
  EXPECT_EQ(ask(server_->port(), "POST", "/v1/measurements", {}, "{").status, 400);
}

TEST(MeasurementLimits, TellsClientsToComeBackWhenTooManyWait) {
  TestServer::Options options;
  options.limits.waiting_measurements = 1;
  TestServer server(options);
  std::vector<Client> clients;
  for (int i = 0; i < 8; ++i) {
    clients.emplace_back(server.port());
    ASSERT_TRUE(
        clients.back().send(request_text("POST", "/v1/measurements", {}, example().dump())));
  }
  int answered = 0;
  int refused = 0;
  for (Client& client : clients) {
    const auto answer = client.read();
    ASSERT_TRUE(answer);
    answered += answer->status == 200 ? 1 : 0;
    if (answer->status != 503) continue;
    ++refused;
    EXPECT_EQ(answer->header("retry-after"), "1");
  }
  EXPECT_EQ(answered + refused, 8);
  EXPECT_GE(answered, 1);
  EXPECT_GE(refused, 1);
}

}  // namespace
}  // namespace fstop::test
