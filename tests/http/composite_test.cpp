// POST /v1/composites and alpha: layers as renders, ids, stored and sent pictures, at once or kept.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/render_id.h"
#include "core/encode/image_codec.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

using nlohmann::json;

// A ball close to the lens, its edge soft, before a background that is not to be seen.
json ball_request(int samples = 16) {
  return json::parse(R"({"scene": {"format": "fstop-scene/1",
      "materials": {"red": {"model": "unlit", "emission": [0.8, 0.1, 0.05]}},
      "objects": [{"type": "sphere", "center_m": [0, 0, -0.6], "radius_m": 0.05,
                   "material": "red"}], "background": [0, 1, 0]},
      "camera": {"lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2}},
      "image": {"width": 48, "height": 32, "format": "exr"}, "outputs": ["color", "alpha"],
      "quality": {"method": "lens-sampling", "samples": )" +
                     std::to_string(samples) + "}}");
}

json wall_request() {
  json request = json::parse(tiny_request(5));
  request["image"]["format"] = "exr";
  return request;
}

json stack(const std::vector<json>& layers, json request = json::object()) {
  request["layers"] = layers;
  return request;
}

// Base64 without padding: as many bytes as three divide, the last ones of no account.
std::string base64(std::string bytes) {
  static constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  bytes.resize((bytes.size() + 2) / 3 * 3);
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8U | static_cast<unsigned char>(bytes[i + k]);
    for (std::size_t k = 0; k < 4; ++k) text += kLetters[group >> (18 - 6 * k) & 63U];
  }
  return text;
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class Composites : public testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new TestServer; }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  static Answer post(const json& request, const Headers& headers = {}) {
    return ask(server_->port(), "POST", "/v1/composites", headers, request.dump());
  }
  static Answer render(const json& request, const Headers& headers = {}) {
    return ask(server_->port(), "POST", "/v1/renders", headers, request.dump());
  }
  static Image image_in(const Answer& answer) {
    return decode(std::as_bytes(std::span(answer.body))).layers.front().image;
  }
  // What the problem says of the member.
  static std::string fault(const Answer& answer, const std::string& pointer) {
    const json problem = json::parse(answer.body);
    for (const json& error : problem.value("errors", json::array())) {
      if (error["pointer"] == pointer) return error["detail"];
    }
    return "no fault there: " + answer.body;
  }
  static TestServer* server_;
};
TestServer* Composites::server_ = nullptr;

// What the files of both layers say by themselves, put together here: c + (1 - a) B.
TEST_F(Composites, ARenderOverAnotherIsPorterAndDuffs) {
  const Answer ball = render(ball_request());
  const Answer wall = render(wall_request());
  ASSERT_EQ(ball.status, 200) << ball.body;
  ASSERT_EQ(wall.status, 200) << wall.body;
  const Answer made =
      post({{"layers", {{{"render", wall_request()}}, {{"render", ball_request()}}}},
            {"image", {{"format", "exr"}}}});
  ASSERT_EQ(made.status, 200) << made.body;
  EXPECT_EQ(made.header("content-type"), "image/x-exr");
  EXPECT_EQ(made.header("fstop-composite-id").size(), 64U);
  EXPECT_EQ(made.header("fstop-error").find("upper="), 0U);
  EXPECT_EQ(made.header("etag"), '"' + api::sha256_hex(std::string_view(made.body)) + '"');
  const Image top = image_in(ball);
  const Image beneath = image_in(wall);
  const Image result = image_in(made);
  ASSERT_EQ(top.channels(), 4);
  ASSERT_EQ(result.channels(), 3);
  int soft = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) {
      const float* c = top.at(x, y);
      if (c[3] > 0.0F && c[3] < 1.0F) ++soft;
      // The green background is none of the layer's light: 0.1 of it is the ball's.
      EXPECT_LE(c[1], 0.1F * c[3] + 1e-6F);
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(result.at(x, y)[k], c[k] + (1.0F - c[3]) * beneath.at(x, y)[k]);
      }
    }
  }
  // A disc of radius 0.05/0.6 v = 5.7 px with an edge as wide as its blur disc, 25 mm v
  // |1/2 - 1/0.6| = 2.0 px (v = 51.3 mm, 0.75 mm a pixel): 2 pi 5.7 * 2.0 = 72 pixels.
  EXPECT_GT(soft, 50);
  // By their ids the same bytes, and the same again.
  const Answer by_id = post({{"layers",
                              {{{"render", wall.header("fstop-render-id")}},
                               {{"render", ball.header("fstop-render-id")}}}},
                             {"image", {{"format", "exr"}}}});
  ASSERT_EQ(by_id.status, 200) << by_id.body;
  EXPECT_EQ(image_in(by_id), result);
}

TEST_F(Composites, ReportsTheBoundAndTheLayers) {
  const json request = {{"layers", {{{"render", wall_request()}}, {{"render", ball_request()}}}}};
  const Answer told = post(request, {{"Accept", "application/json"}});
  ASSERT_EQ(told.status, 200) << told.body;
  const json report = json::parse(told.body);
  EXPECT_NEAR(report["error"]["confidence"].get<double>(), 0.9, 1e-12);
  const json wall = json::parse(render(wall_request(), {{"Accept", "application/json"}}).body);
  const json ball = json::parse(render(ball_request(), {{"Accept", "application/json"}}).body);
  // A corner is not covered: all of the wall's error passes there, and its light counts as 1; what
  // is brighter than white counts as wholly wrong.
  const Image beneath = image_in(render(wall_request()));
  int bright = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) {
      const float* c = beneath.at(x, y);
      bright += std::max({c[0], c[1], c[2]}) > 1.0F ? 1 : 0;
    }
  }
  const double expected =
      ball["error"]["upper_95"].get<double>() + ball["alpha_error"]["upper_95"].get<double>() +
      wall["error"]["upper_95"].get<double>() + std::sqrt(bright / (48.0 * 32.0));
  EXPECT_NEAR(report["error"]["upper"].get<double>(), std::min(1.0, expected), 1e-9);
  EXPECT_EQ(report["layers"][0]["render"], wall["id"]);
  EXPECT_EQ(report["layers"][1]["render"], ball["id"]);
}

TEST_F(Composites, PicturesAreSentOrStored) {
  Image card(48, 32, 4);
  for (std::size_t i = 0; i < card.pixels().size(); i += 4) {
    card.pixels()[i] = 1.0F;
    card.pixels()[i + 3] = 1.0F;
  }
  for (int y = 0; y < 32; ++y) card.at(0, y)[3] = 0.0F;
  const Picture picture{{{{"R", "G", "B", "A"}, card}}, {}};
  const json sent = {{"base64", base64(text_of(encode(picture, ImageFormat::png)))}};
  const Answer made = post({{"layers", {{{"render", wall_request()}}, {{"image", sent}}}},
                            {"outputs", json::array({"alpha"})},
                            {"image", {{"format", "exr"}}}});
  ASSERT_EQ(made.status, 200) << made.body;
  const Image result = image_in(made);
  ASSERT_EQ(result.channels(), 4);
  EXPECT_EQ(result.at(5, 5)[0], 1.0F);
  EXPECT_EQ(result.at(5, 5)[1], 0.0F);
  const Image wall = image_in(render(wall_request()));
  EXPECT_EQ(result.at(0, 5)[1], wall.at(0, 5)[1]);
  EXPECT_EQ(result.at(0, 5)[3], 1.0F);

  server_->folder().write("scenes/tiny/card.png", text_of(encode(picture, ImageFormat::png)));
  const Answer stored =
      post({{"layers", {{{"render", wall_request()}}, {{"image", {{"file", "tiny/card.png"}}}}}},
            {"outputs", json::array({"alpha"})},
            {"image", {{"format", "exr"}}}});
  ASSERT_EQ(stored.status, 200) << stored.body;
  EXPECT_EQ(image_in(stored), result);
}

TEST_F(Composites, RefusesAtTheLayersPlace) {
  const auto refused = [&](const json& layer, const std::string& pointer, const char* why,
                           int status = 422) {
    const Answer answer = post({{"layers", {{{"render", wall_request()}}, layer}}});
    EXPECT_EQ(answer.status, status) << answer.body;
    const std::string detail = fault(answer, pointer);
    EXPECT_NE(detail.find(why), std::string::npos) << detail;
  };
  refused({{"render", std::string(64, 'f')}}, "#/layers/1/render", "no such render");
  json request = ball_request();
  request["scene"] = "nowhere";
  refused({{"render", request}}, "#/layers/1/render/scene", "no stored scene");
  request = ball_request();
  request["image"]["width"] = 24;
  request["image"]["height"] = 16;
  refused({{"render", request}}, "#/layers/1", "24 x 16");
  request = ball_request();
  request["effects"] = {{"diffraction", "on"}};
  refused({{"render", request}}, "#/layers/1/render", "diffraction");
  refused({{"image", {{"file", "tiny/none.png"}}}}, "#/layers/1/image/file", "none.png");
  refused({{"image", {{"file", "tiny/../secret"}}}}, "#/layers/1/image/file", "");
  refused({{"image", {{"base64", "AAAAAAAA"}}}}, "#/layers/1/image/base64", "");
  EXPECT_EQ(post(stack({{{"render", wall_request()}}}), {{"Accept", "text/html"}}).status, 406);
  EXPECT_EQ(post(stack({{{"render", wall_request()}}}, {{"outputs", json::array({"alpha"})}}),
                 {{"Accept", "image/jpeg"}})
                .status,
            406);
}

TEST_F(Composites, AClientThatLeavesStopsTheWork) {
  TestServer server;
  {
    Client client(server.port());
    client.send(request_text("POST", "/v1/composites", {},
                             stack({{{"render", ball_request(60'000)}}}).dump()));
    ASSERT_TRUE(eventually([&] { return server.server().render_counts().running == 1; }));
  }
  EXPECT_TRUE(eventually([&] { return server.server().render_counts().running == 0; }));
  EXPECT_TRUE(eventually(
      [&] { return server.log_text().find("composite_ended_early") != std::string::npos; }));
}

// EXR multiplied, PNG straight, JPEG refused wherever it is asked for; alpha alone is an output.
TEST_F(Composites, ARendersAlphaComesInEveryFormatThatHoldsIt) {
  const Answer exr = render(ball_request());
  ASSERT_EQ(exr.status, 200) << exr.body;
  const Image multiplied = image_in(exr);
  const std::string id = exr.header("fstop-render-id");
  const Image straight = image_in(render(ball_request(), {{"Accept", "image/png"}}));
  ASSERT_EQ(straight.channels(), 4);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 48; ++x) {
      const float alpha = multiplied.at(x, y)[3];
      EXPECT_NEAR(straight.at(x, y)[3], alpha, 0.5F / 255.0F + 1e-6F);
      // Of the colour 0.8: 1.055 0.8^(1/2.4) - 0.055 = 0.9063, to half a code of 255.
      if (alpha <= 0.0F) continue;
      EXPECT_NEAR(straight.at(x, y)[0], 0.9063F, 0.5F / 255.0F + 1e-4F);
    }
  }
  EXPECT_EQ(render(ball_request(), {{"Accept", "image/jpeg"}}).status, 406);
  const std::string target = "/v1/renders/" + id;
  EXPECT_EQ(ask(server_->port(), "GET", target + "/image?format=jpeg").status, 406);
  const Answer alone = ask(server_->port(), "GET", target + "/outputs/alpha");
  ASSERT_EQ(alone.status, 200) << alone.body;
  EXPECT_EQ(image_in(alone).channels(), 1);
  json jpeg = ball_request();
  jpeg["image"]["format"] = "jpeg";
  EXPECT_NE(fault(render(jpeg), "#/image/format").find("jpeg"), std::string::npos);
}

}  // namespace
}  // namespace fstop::test
