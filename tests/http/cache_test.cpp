// Results in files: kept over restarts, bounded, thrown away where they are damaged.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/resource.h>

#include <gtest/gtest.h>

#include "server/render_cache.h"
#include "server/result_file.h"
#include "server/result_store.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;

TestServer::Options keeping_in(const fs::path& folder) {
  TestServer::Options options;
  options.result_folder = folder;
  return options;
}

Answer render(const TestServer& server, int seed, const Headers& headers = {}) {
  return ask(server.port(), "POST", "/v1/renders", headers, tiny_request(seed));
}

TEST(Results, OutliveTheServerWithTheSameBytesInEveryFormat) {
  TemporaryFolder folder;
  std::string id;
  std::string report;
  std::vector<std::string> files;
  const auto images = [&](const TestServer& server) {
    std::vector<std::string> bodies;
    for (const char* path : {"/image?format=png", "/image?format=exr", "/image?format=webp",
                             "/outputs/depth", "/outputs/coc"}) {
      const Answer answer = ask(server.port(), "GET", "/v1/renders/" + id + path);
      EXPECT_EQ(answer.status, 200) << path << answer.body;
      bodies.push_back(answer.body + answer.header("etag") + answer.header("fstop-error"));
    }
    return bodies;
  };
  {
    TestServer server(keeping_in(folder.path()));
    id = render(server, 1).header("fstop-render-id");
    report = ask(server.port(), "GET", "/v1/renders/" + id).body;
    files = images(server);
  }
  EXPECT_EQ(folder.files(), 1);
  TestServer server(keeping_in(folder.path()));
  EXPECT_EQ(images(server), files);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + id).body, report);
  const Answer again = render(server, 1, {{"Prefer", "respond-async"}});
  EXPECT_EQ(again.status, 200) << "it is there";
  EXPECT_NE(again.header("server-timing").find("cache"), std::string::npos);
  EXPECT_EQ(server.server().render_counts().started, 0U) << "hits take no turn in the queue";
  const Answer kept = ask(server.port(), "GET", "/v1/renders/" + id);
  EXPECT_NE(kept.header("cache-control").find("immutable"), std::string::npos);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + id, {{"If-None-Match", kept.header("etag")}})
                .status,
            304);
}

TEST(Results, DamagedFilesAreThrownAwayAndMadeAnew) {
  TemporaryFolder folder;
  std::string id;
  std::string picture;
  {
    TestServer server(keeping_in(folder.path()));
    const Answer answer = render(server, 2);
    id = answer.header("fstop-render-id");
    picture = answer.body;
  }
  const std::string whole = text_of_file(folder.path() / id);
  ASSERT_GT(whole.size(), 1000U);
  std::vector<std::string> damaged = {"", whole.substr(0, 50), whole.substr(0, whole.size() - 1),
                                      whole + "x"};
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
  damaged.push_back(flipped);
  for (const std::string& bytes : damaged) {
    folder.write(id, bytes);
    TestServer server(keeping_in(folder.path()));
    EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + id).status, 404);
    const Answer anew = render(server, 2);
    EXPECT_EQ(anew.status, 200);
    EXPECT_TRUE(anew.body == picture);
    EXPECT_EQ(server.server().render_counts().started, 1U);
    EXPECT_EQ(server.server().file_counts().damaged, 1U);
  }
}

// A file of one render under the name of another is not that one.
TEST(Results, AreKnownByTheirOwnIdAlone) {
  TemporaryFolder folder;
  TestServer server(keeping_in(folder.path()));
  const std::string id = render(server, 3).header("fstop-render-id");
  const std::string bytes = text_of_file(folder.path() / id);
  EXPECT_NE(server::result_of(bytes, id, api::Limits{}), nullptr);
  EXPECT_EQ(server::result_of(bytes, std::string(64, '0'), api::Limits{}), nullptr);
}

TEST(Results, ThoseUsedLastStayWithinTheBound) {
  TemporaryFolder folder;
  TestServer::Options options = keeping_in(folder.path());
  std::vector<std::string> ids;
  std::uint64_t size = 0;
  {
    TestServer server(options);
    for (int seed = 0; seed < 4; ++seed)
      ids.push_back(render(server, seed).header("fstop-render-id"));
    size = server.server().file_counts().bytes / 4;
  }
  // The oldest is used again; then two of the others must go.
  const auto old = fs::last_write_time(folder.path() / ids[3]);
  for (int i = 0; i < 4; ++i)
    fs::last_write_time(folder.path() / ids[static_cast<std::size_t>(i)],
                        old - std::chrono::hours(10 - i));
  {
    TestServer server(options);
    EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + ids[0]).status, 200);
  }
  options.limits.kept_file_bytes = 2 * size + size / 2;
  TestServer server(options);
  EXPECT_EQ(server.server().file_counts().files, 2U);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + ids[0]).status, 200);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + ids[1]).status, 404);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + ids[2]).status, 404);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/renders/" + ids[3]).status, 200);
  render(server, 9);
  EXPECT_EQ(server.server().file_counts().files, 2U);
  EXPECT_LE(server.server().file_counts().bytes, options.limits.kept_file_bytes);
  EXPECT_EQ(folder.files(), 2);
}

TEST(Results, PartsOfAKilledProcessAreSweptAway) {
  TemporaryFolder folder;
  folder.write(std::string(64, 'a') + ".part123-4", "half of it");
  folder.write("notes", "of somebody else");
  TestServer server(keeping_in(folder.path()));
  EXPECT_EQ(folder.files(), 1);
}

// The bound on a file's size stands for a disk without room: writes fail in the midst of a file.
TEST(Results, AFullDiskIs507AndLosesNothingThatWasKept) {
  TemporaryFolder folder;
  TestServer server(keeping_in(folder.path()));
  const Answer kept = render(server, 1);
  ASSERT_EQ(kept.status, 200);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit = {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit small = {.rlim_cur = 20'000, .rlim_max = limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const Answer full = render(server, 2);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_EQ(full.status, 507) << full.body;
  EXPECT_NE(full.body.find("/problems/storage-full"), std::string::npos);
  EXPECT_EQ(folder.files(), 1) << "no part is left";
  EXPECT_EQ(render(server, 1).body, kept.body);
  EXPECT_EQ(render(server, 2).status, 200) << "there is room again";
}

}  // namespace
}  // namespace fstop::test
