// POST /v1/psf: numbers or image by Accept, refusals, and a server that is not held up.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/encode/image_codec.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

const std::string kLens = R"({"camera": {"lens": {"focal_length_mm": 50, "f_number": 8,
    "focus_distance_m": 2}}, "object_distance_m": 3, "image": {"width": 24, "height": 16}})";

class PointSpreads : public testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new TestServer; }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  static Answer post(const std::string& body, const Headers& headers = {}) {
    return ask(server_->port(), "POST", "/v1/psf", headers, body);
  }
  static TestServer* server_;
};
TestServer* PointSpreads::server_ = nullptr;

Image image_in(const Answer& answer) {
  const auto* bytes = reinterpret_cast<const std::byte*>(answer.body.data());
  return decode({bytes, answer.body.size()}).layers.at(0).image;
}

TEST_F(PointSpreads, AnswersNumbersUnlessAnImageIsPreferred) {
  struct Case {
    const char* accept;
    const char* type;
  };
  const std::vector<Case> table = {
      {"", "application/json"},
      {"*/*", "application/json"},
      {"application/json", "application/json"},
      {"application/json, image/png", "application/json"},
      {"text/html, */*;q=0.5", "application/json"},
      {"image/png;q=0.5, application/json", "application/json"},
      {"image/png", "image/png"},
      {"image/x-exr", "image/x-exr"},
      {"IMAGE/X-EXR", "image/x-exr"},
      {"image/*", "image/png"},
      {"image/png, */*;q=0.8", "image/png"},
      {"image/png, */*", "image/png"},
      {"image/avif, image/x-exr;q=0.9, application/json;q=0.1", "image/x-exr"},
  };
  for (const Case& test : table) {
    Headers headers;
    if (*test.accept != '\0') headers.emplace_back("Accept", test.accept);
    const Answer answer = post(kLens, headers);
    ASSERT_EQ(answer.status, 200) << test.accept << answer.body;
    EXPECT_EQ(answer.header("content-type"), test.type) << test.accept;
    EXPECT_EQ(answer.header("vary"), "Accept");
    EXPECT_EQ(answer.header("cache-control"), "no-store");
  }
  for (const char* accept : {"text/html", "image/avif", "image/png;q=0, application/json;q=0"}) {
    EXPECT_EQ(post(kLens, {{"Accept", accept}}).status, 406) << accept;
  }
}

TEST_F(PointSpreads, SendsTheNumbersAndTheImage) {
  const Answer numbers = post(kLens);
  for (const char* member :
       {"\"profile\":[{\"radius_um\":0", "\"otf\":[{\"frequency_per_mm\":0",
        "\"encircled_energy\":", "\"regime\":\"fresnel\"", "\"error_bound\":", "\"energy\":0.9"}) {
    EXPECT_NE(numbers.body.find(member), std::string::npos) << member << numbers.body;
  }
  const Answer png = post(kLens, {{"Accept", "image/png"}});
  EXPECT_EQ(png.header("fstop-stretch").find("asinh; asinh(1000 p)/asinh(1000), p = density/("), 0U)
      << png.header("fstop-stretch");
  const Answer exr = post(kLens, {{"Accept", "image/x-exr"}});
  EXPECT_EQ(exr.header("fstop-stretch"), "none; density in 1/mm^2");
  EXPECT_EQ(exr.body, post(kLens, {{"Accept", "image/x-exr"}}).body);
  for (const Answer* answer : {&png, &exr}) {
    const Image image = image_in(*answer);
    EXPECT_EQ(image.width(), 24);
    EXPECT_EQ(image.height(), 16);
  }
}

TEST_F(PointSpreads, RefusesWithPointersAndReasons) {
  struct Case {
    std::string body;
    int status;
    const char* text;
  };
  const std::vector<Case> table = {
      {"{", 400, "json-invalid"},
      {"{}", 422, "#/camera"},
      {R"({"camera": {"lens": {}}, "radii_um": [0, "x"]})", 422, "#/radii_um/1"},
      {R"({"camera": {"lens": {}}, "scene": "tiny"})", 422, "#/scene"},
      {R"({"camera": {"pinhole": {}}, "field_angle_deg": 76})", 422, "outside-domain"},
      {R"({"camera": {"lens": {}}, "object_distance_m": "infinity", "spectrum": "rgb"})", 422,
       "over-budget"},
  };
  for (const Case& test : table) {
    for (const char* accept : {"application/json", "image/png"}) {
      const Answer answer = post(test.body, {{"Accept", accept}});
      EXPECT_EQ(answer.status, test.status) << test.body;
      EXPECT_EQ(answer.header("content-type"), "application/problem+json");
      EXPECT_NE(answer.body.find(test.text), std::string::npos) << answer.body;
    }
  }
}

// One at a time is all that this server lets wait: of many at once some are told to come back, and
// none is lost.
TEST(PointSpreadLimits, TellsClientsToComeBackWhenTooManyWait) {
  TestServer::Options options;
  options.limits.waiting_psfs = 1;
  TestServer server(options);
  const std::string request = R"({"camera": {"lens": {"f_number": 8, "blades": 7}},
      "object_distance_m": 3, "spectrum": "rgb", "radii_um": [], "frequencies_per_mm": []})";
  std::vector<Client> clients;
  for (int i = 0; i < 8; ++i) {
    clients.emplace_back(server.port());
    ASSERT_TRUE(clients.back().send(request_text("POST", "/v1/psf", {}, request)));
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
