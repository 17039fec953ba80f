// Renders over HTTP with the real light path: formats, tags, reports, equal bytes.
#include <cstddef>
#include <span>
#include <string>

#include <gtest/gtest.h>

#include "api/render_id.h"
#include "core/encode/image_codec.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

class Renders : public testing::Test {
 protected:
  Answer render(int seed, const Headers& headers = {}, const std::string& members = {}) {
    return ask(server_.port(), "POST", "/v1/renders", headers, tiny_request(seed, members));
  }
  Answer get(const std::string& target, const Headers& headers = {}) {
    return ask(server_.port(), "GET", target, headers);
  }
  TestServer server_;
};

Picture picture_in(const Answer& answer) { return decode(std::as_bytes(std::span(answer.body))); }

std::string tag_of(const std::string& bytes) {
  return '"' + api::sha256_hex(std::string_view(bytes)) + '"';
}

TEST_F(Renders, ReplyCarriesTheImageAndSaysHowItWasMade) {
  const Answer answer = render(1);
  ASSERT_EQ(answer.status, 200) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "image/png");
  const std::string id = answer.header("fstop-render-id");
  EXPECT_EQ(id.size(), 64U);
  EXPECT_EQ(answer.header("location"), "/v1/renders/" + id);
  EXPECT_EQ(answer.header("fstop-method"), "lens-sampling");
  EXPECT_EQ(answer.header("fstop-error").find("estimate="), 0U);
  EXPECT_NE(answer.header("fstop-error").find("upper_95="), std::string::npos);
  for (const char* part : {"queue;dur=", "render;dur=", "encode;dur="})
    EXPECT_NE(answer.header("server-timing").find(part), std::string::npos) << part;
  EXPECT_EQ(answer.header("etag"), tag_of(answer.body));
  EXPECT_EQ(answer.header("vary"), "Accept");
  const Picture picture = picture_in(answer);
  EXPECT_EQ(picture.layers.front().image.width(), 48);
  EXPECT_EQ(picture.layers.front().image.height(), 32);

  const Answer report = get("/v1/renders/" + id);
  EXPECT_EQ(report.status, 200);
  EXPECT_EQ(report.header("content-type"), "application/json");
  for (const char* member :
       {"\"id\":\"", "\"method\":\"", "\"error\":{", "\"cost\":{", "\"optics\":{"})
    EXPECT_NE(report.body.find(member), std::string::npos) << member;
  EXPECT_NE(report.body.find(id), std::string::npos);
  EXPECT_EQ(get("/v1/renders/" + id, {{"If-None-Match", report.header("etag")}}).status, 304);
}

TEST_F(Renders, OneIdHasEveryFormatWithATagOfItsBytes) {
  const std::string id = render(2).header("fstop-render-id");
  for (const char* format : {"png", "jpeg", "webp", "tiff", "exr"}) {
    const Answer file = get("/v1/renders/" + id + "/image?format=" + format);
    ASSERT_EQ(file.status, 200) << format << file.body;
    const std::string type = file.header("content-type");
    EXPECT_EQ(type, format == std::string("exr") ? "image/x-exr" : "image/" + std::string(format));
    EXPECT_EQ(file.header("etag"), tag_of(file.body));
    EXPECT_NE(file.header("cache-control").find("immutable"), std::string::npos);
    EXPECT_EQ(picture_in(file).layers.front().image.width(), 48) << format;
    const Answer by_accept = get("/v1/renders/" + id + "/image", {{"Accept", type}});
    EXPECT_EQ(by_accept.body, file.body) << format;
    const Answer by_post = render(2, {{"Accept", type}});
    EXPECT_EQ(by_post.header("fstop-render-id"), id);
    EXPECT_EQ(by_post.body, file.body) << format;
    EXPECT_NE(by_post.header("server-timing").find("cache"), std::string::npos);
  }
  EXPECT_EQ(get("/v1/renders/" + id + "/image?format=gif").status, 400);
  EXPECT_EQ(get("/v1/renders/" + id + "/image?size=2").status, 400);
  EXPECT_EQ(get("/v1/renders/" + id + "/image?format=png&format=exr").status, 400);
}

TEST_F(Renders, AcceptChoosesTheRepresentation) {
  const auto type = [&](const std::string& accept) {
    const Answer answer = render(3, {{"Accept", accept}});
    return answer.status == 200 ? answer.header("content-type") : std::to_string(answer.status);
  };
  EXPECT_EQ(type(""), "image/png");
  EXPECT_EQ(type("*/*"), "image/png");
  EXPECT_EQ(type("image/*"), "image/png");
  EXPECT_EQ(type("image/webp"), "image/webp");
  EXPECT_EQ(type("image/webp;q=0.5, image/x-exr"), "image/x-exr");
  EXPECT_EQ(type("image/avif,image/webp,image/apng,image/*,*/*;q=0.8"), "image/png");
  EXPECT_EQ(type("image/png, application/problem+json"), "image/png");
  EXPECT_EQ(type("application/json"), "application/json");
  EXPECT_EQ(type("application/json, text/plain, */*"), "image/png");
  EXPECT_EQ(type("application/json, image/png;q=0.5"), "application/json");
  EXPECT_EQ(type("image/avif"), "406");
  EXPECT_EQ(type("image/png;q=0"), "406");
  EXPECT_EQ(type("text/html"), "406");
}

TEST_F(Renders, OutputsAreFilesOfTheirOwn) {
  const std::string id =
      render(4, {}, R"(, "outputs": ["color", "depth", "normal"])").header("fstop-render-id");
  for (const char* name : {"color", "depth", "coc", "normal"}) {
    const Answer file = get("/v1/renders/" + id + "/outputs/" + name);
    ASSERT_EQ(file.status, 200) << name << file.body;
    EXPECT_EQ(file.header("content-type"), "image/x-exr");
    EXPECT_EQ(file.header("etag"), tag_of(file.body));
    EXPECT_EQ(picture_in(file).layers.front().image.width(), 48) << name;
    EXPECT_EQ(
        get("/v1/renders/" + id + "/outputs/" + name, {{"If-None-Match", file.header("etag")}})
            .status,
        304);
  }
  EXPECT_EQ(get("/v1/renders/" + id + "/outputs/depth?format=tiff").header("content-type"),
            "image/tiff");
  EXPECT_EQ(get("/v1/renders/" + id + "/outputs/variance").status, 404) << "was not asked for";
  EXPECT_EQ(get("/v1/renders/" + id + "/outputs/sound").status, 404);
}

TEST_F(Renders, KnownTagsAreAnsweredWith304) {
  const std::string id = render(5).header("fstop-render-id");
  const std::string target = "/v1/renders/" + id + "/image";
  const std::string tag = get(target).header("etag");
  const auto status = [&](const std::string& known) {
    const Answer answer = get(target, {{"If-None-Match", known}});
    if (answer.status == 304) {
      EXPECT_TRUE(answer.body.empty());
      EXPECT_EQ(answer.header("etag"), tag);
      EXPECT_EQ(answer.header("vary"), "Accept");
    }
    return answer.status;
  };
  EXPECT_EQ(status(tag), 304);
  EXPECT_EQ(status("W/" + tag), 304);
  EXPECT_EQ(status("\"other\", " + tag), 304);
  EXPECT_EQ(status("*"), 304);
  EXPECT_EQ(status("\"other\""), 200);
  EXPECT_EQ(status(tag.substr(1, 64)), 200);
  EXPECT_EQ(get(target + "?format=exr", {{"If-None-Match", tag}}).status, 200);
}

TEST_F(Renders, SameRequestGivesTheSameBytesOnAnotherServerAndThreadCount) {
  TestServer::Options options;
  options.threads = 3;
  TestServer other(options);
  for (const char* type : {"image/png", "image/x-exr"}) {
    const Headers headers = {{"Accept", type}};
    const Answer here = render(6, headers);
    const Answer there = ask(other.port(), "POST", "/v1/renders", headers, tiny_request(6));
    ASSERT_EQ(here.status, 200);
    EXPECT_EQ(here.header("fstop-render-id"), there.header("fstop-render-id"));
    EXPECT_TRUE(here.body == there.body) << type;
  }
  const Answer seeded = render(7);
  EXPECT_NE(seeded.header("fstop-render-id"), render(6).header("fstop-render-id"));
  EXPECT_FALSE(seeded.body == render(6).body);
  EXPECT_EQ(other.server().render_counts().started, 1U) << "one render for both formats";
}

TEST_F(Renders, IdDoesNotDependOnFormOrFormat) {
  const std::string id = render(8).header("fstop-render-id");
  const std::string same = R"({"seed": 8, "image": {"height": 32.0, "width": 48, "format": "webp"},
      "quality": {"samples": 16, "max_error": 0.01}, "scene": "tiny",
      "camera": {"lens": {"f_number": 2.0, "focal_length_mm": 5e1, "focus_distance_m": 2},
                 "sensor_mm": [36, 24]}})";
  const Answer answer = ask(server_.port(), "POST", "/v1/renders", {}, same);
  EXPECT_EQ(answer.header("fstop-render-id"), id) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "image/webp");
  EXPECT_EQ(server_.server().render_counts().started, 1U);
}

TEST_F(Renders, ScenesAreReadAgainOnlyWhenTheirFilesChange) {
  const std::string id = render(9).header("fstop-render-id");
  render(10);
  render(11);
  EXPECT_EQ(server_.server().scene_counts().loaded, 1);
  EXPECT_EQ(server_.server().worker_counts().builds, 1U);
  std::string text = text_of_file(server_.folder().path() / "scenes/tiny/scene.json");
  text.replace(text.find("0.2, 0.4, 0.6"), 13, "0.9, 0.4, 0.6");
  server_.folder().write("scenes/tiny/scene.json", text);
  const Answer changed = render(9);
  EXPECT_EQ(changed.status, 200);
  EXPECT_NE(changed.header("fstop-render-id"), id);
  EXPECT_EQ(server_.server().scene_counts().loaded, 2);
  EXPECT_EQ(server_.server().worker_counts().builds, 2U);
}

TEST_F(Renders, TimeBoundRendersAreNotKept) {
  const std::string members = R"(, "quality": {"max_error": 0.05, "max_time_ms": 2000})";
  std::string request = tiny_request(12);
  request.replace(request.find("\"quality\""), std::string("\"quality\": {\"samples\": 16}").size(),
                  members.substr(2));
  const Answer answer = ask(server_.port(), "POST", "/v1/renders", {}, request);
  ASSERT_EQ(answer.status, 200) << answer.body;
  EXPECT_TRUE(answer.header("location").empty());
  EXPECT_EQ(get("/v1/renders/" + answer.header("fstop-render-id")).status, 404);
}

TEST_F(Renders, NothingIsLeftBehind) {
  const int before = server_.folder().files();
  render(13);
  render(14, {{"Accept", "image/x-exr"}});
  ask(server_.port(), "POST", "/v1/renders", {}, R"({"scene": "broken-mesh"})");
  {
    Client gone(server_.port());
    gone.send(request_text("POST", "/v1/renders", {}, tiny_request(15)));
    gone.reset();
  }
  EXPECT_EQ(ask(server_.port(), "GET", "/readyz").status, 200);
  EXPECT_EQ(server_.folder().files(), before);
}

}  // namespace
}  // namespace fstop::test
