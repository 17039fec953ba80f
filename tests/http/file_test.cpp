// Files by the hash of their bytes, over HTTP and as workers put them there.
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "api/render_id.h"
#include "core/error.h"
#include "server/content_folder.h"
#include "server/http_file_store.h"
#include "server/http_message.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"
#include "tests/http/wire.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;

const Headers kBytes = {{"Content-Type", "application/octet-stream"}};

// FIPS 180-2, appendix B.1.
const std::string kAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
const std::string kNone = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

class Files : public testing::Test {
 protected:
  static TestServer::Options options(const fs::path& folder, std::string token = {}) {
    TestServer::Options options;
    options.data_folder = folder;
    options.token = std::move(token);
    return options;
  }
  std::string url(const TestServer& server) const {
    return "http://127.0.0.1:" + std::to_string(server.port());
  }
  TemporaryFolder folder_;
};

TEST_F(Files, ArePutOnceAndStay) {
  {
    const TestServer server(options(folder_.path()));
    for (int i = 0; i < 2; ++i) {
      const Answer put = ask(server.port(), "PUT", "/v1/files/" + kAbc, kBytes, "abc");
      EXPECT_EQ(put.status, 204) << put.body;
      EXPECT_EQ(put.header("etag"), "\"" + kAbc + "\"");
      EXPECT_EQ(put.header("location"), "/v1/files/" + kAbc);
    }
    EXPECT_EQ(folder_.files(), 1);
  }
  const TestServer server(options(folder_.path()));
  const Answer got = ask(server.port(), "GET", "/v1/files/" + kAbc);
  EXPECT_EQ(got.status, 200);
  EXPECT_EQ(got.body, "abc");
  EXPECT_EQ(got.header("content-type"), "application/octet-stream");
  EXPECT_EQ(got.header("etag"), "\"" + kAbc + "\"");
  EXPECT_EQ(got.header("cache-control"), "private, max-age=31536000, immutable");
  const Answer again =
      ask(server.port(), "GET", "/v1/files/" + kAbc, {{"If-None-Match", "\"" + kAbc + "\""}});
  EXPECT_EQ(again.status, 304);
  Client client(server.port());
  client.send(request_text("HEAD", "/v1/files/" + kAbc));
  const auto head = client.read(true);
  ASSERT_TRUE(head);
  EXPECT_EQ(head->status, 200);
  EXPECT_EQ(head->header("content-length"), "3");
}

TEST_F(Files, OfNoBytesIsAFile) {
  const TestServer server(options(folder_.path()));
  Client client(server.port());
  client.send("PUT /v1/files/" + kNone + " HTTP/1.1\r\n" + kHost +
              "Content-Type: application/octet-stream\r\nContent-Length: 0\r\n\r\n");
  EXPECT_EQ(client.read()->status, 204);
  const Answer got = ask(server.port(), "GET", "/v1/files/" + kNone);
  EXPECT_EQ(got.status, 200);
  EXPECT_EQ(got.body, "");
}

TEST_F(Files, OfOtherBytesOrNamesAreRefused) {
  const TestServer server(options(folder_.path()));
  const std::string wrong_hash = kAbc.substr(0, 63) + "e";
  struct Wrong {
    std::string method;
    std::string target;
    Headers headers;
    std::string body;
    int status;
    std::string slug;
  };
  std::string upper = kAbc;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  for (const Wrong& wrong :
       std::vector<Wrong>{{"PUT", "/v1/files/" + wrong_hash, kBytes, "abc", 422, "hash-differs"},
                          {"PUT", "/v1/files/" + kAbc, kBytes, "abd", 422, "hash-differs"},
                          {"PUT", "/v1/files/" + upper, kBytes, "abc", 422, "bad-name"},
                          {"PUT", "/v1/files/abc", kBytes, "abc", 422, "bad-name"},
                          {"PUT",
                           "/v1/files/" + kAbc,
                           {{"Content-Type", "application/zip"}},
                           "abc",
                           415,
                           "unsupported-media-type"},
                          {"PUT", "/v1/files/%2e%2e", kBytes, "abc", 422, "bad-name"},
                          {"GET", "/v1/files/" + kAbc, {}, "", 404, "not-found"},
                          {"GET", "/v1/files/..%2F..%2Fsecret", {}, "", 422, "bad-name"},
                          {"DELETE", "/v1/files/" + kAbc, {}, "", 405, "method-not-allowed"}}) {
    const Answer answer = ask(server.port(), wrong.method, wrong.target, wrong.headers, wrong.body);
    EXPECT_EQ(answer.status, wrong.status) << wrong.method << " " << wrong.target << answer.body;
    EXPECT_NE(answer.body.find("/problems/" + wrong.slug), std::string::npos) << answer.body;
  }
  EXPECT_EQ(folder_.files(), 0);
}

TEST_F(Files, AreGuardedByTheToken) {
  const std::string token = "0123456789abcdef";
  const TestServer server(options(folder_.path(), token));
  EXPECT_EQ(ask(server.port(), "PUT", "/v1/files/" + kAbc, kBytes, "abc").status, 401);
  EXPECT_EQ(ask(server.port(), "GET", "/v1/files/" + kAbc).status, 401);
  server::HttpFileStore stranger(url(server), "");
  EXPECT_THROW(stranger.put("abc"), Error);
  EXPECT_EQ(folder_.files(), 0);
  server::HttpFileStore store(url(server), token);
  EXPECT_EQ(store.put("abc"), kAbc);
  EXPECT_EQ(store.get(kAbc), "abc");
}

// The limit is that of any file, not that of scenes' archives; what is too large is refused before
// it is sent.
TEST_F(Files, OfTooManyBytesAreRefusedBeforeTheyCome) {
  TestServer::Options small = options(folder_.path());
  small.limits.content_bytes = 1000;
  const TestServer server(std::move(small));
  Client client(server.port());
  client.send("PUT /v1/files/" + kAbc + " HTTP/1.1\r\n" + kHost +
              "Content-Type: application/octet-stream\r\nContent-Length: 1001\r\n\r\n");
  const auto answer = client.read();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 413);
  server::HttpFileStore store(url(server), "");
  EXPECT_EQ(store.put(std::string(1000, 'x')), api::sha256_hex(std::string(1000, 'x')));
  try {
    store.put(std::string(1001, 'x'));
    ADD_FAILURE() << "a file of 1001 bytes was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::over_budget) << error.what();
  }
}

// What is announced is room that others do not have: the second of two that together are more is
// asked to come again.
TEST_F(Files, ThatComeAtOnceHaveABound) {
  TestServer::Options small = options(folder_.path());
  small.limits.incoming_bytes = 1500;
  const TestServer server(std::move(small));
  Client first(server.port());
  const std::string head = "PUT /v1/files/" + kAbc + " HTTP/1.1\r\n" + kHost +
                           "Content-Type: application/octet-stream\r\nContent-Length: 1000\r\n";
  first.send(head + "Expect: 100-continue\r\n\r\n");
  const auto go_on = first.read(true);  // it has its room
  ASSERT_TRUE(go_on);
  EXPECT_EQ(go_on->status, 100);
  Client second(server.port());
  second.send(head + "\r\n");
  const auto refused = second.read();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 503);
  EXPECT_EQ(refused->header("retry-after"), "1");
  first.close();
  // The room comes back with the end of the first.
  EXPECT_TRUE(eventually([&] {
    return ask(server.port(), "PUT", "/v1/files/" + api::sha256_hex(std::string(1000, 'y')), kBytes,
               std::string(1000, 'y'))
               .status == 204;
  }));
}

TEST_F(Files, ThatAreDamagedAreNotThere) {
  const TestServer server(options(folder_.path()));
  EXPECT_EQ(ask(server.port(), "PUT", "/v1/files/" + kAbc, kBytes, "abc").status, 204);
  for (const auto& file : fs::recursive_directory_iterator(folder_.path())) {
    if (file.is_regular_file()) std::ofstream(file.path(), std::ios::binary) << "abd";
  }
  EXPECT_EQ(ask(server.port(), "GET", "/v1/files/" + kAbc).status, 404);
}

TEST_F(Files, AreThereOnlyWithADataDirectory) {
  const TestServer server;
  EXPECT_EQ(ask(server.port(), "GET", "/v1/files/" + kAbc).status, 503);
  EXPECT_EQ(ask(server.port(), "PUT", "/v1/files/" + kAbc, kBytes, "abc").status, 503);
}

TEST_F(Files, GoThroughTheClientByteByByte) {
  const TestServer server(options(folder_.path()));
  server::HttpFileStore store(url(server) + "/", "");
  std::string bytes;
  for (int i = 0; i < 3'000'000; ++i) bytes += static_cast<char>(i * i / 7);
  const std::string hash = store.put(bytes);
  EXPECT_EQ(hash, api::sha256_hex(bytes));
  EXPECT_TRUE(store.get(hash) == bytes);
  EXPECT_TRUE(store.has({.name = "a", .sha256 = hash, .bytes = bytes.size()}));
  EXPECT_FALSE(store.has({.name = "a", .sha256 = hash, .bytes = bytes.size() - 1}));
  EXPECT_FALSE(store.has({.name = "a", .sha256 = kAbc, .bytes = 3}));
  EXPECT_EQ(store.get(kAbc), std::nullopt);
}

// The client's connection outlives neither the server nor its idle deadline: the next call makes
// another one.
TEST_F(Files, TheClientConnectsAgain) {
  TestServer::Options hasty = options(folder_.path());
  hasty.limits.idle_deadline = std::chrono::milliseconds(50);
  const TestServer server(std::move(hasty));
  server::HttpFileStore store(url(server), "");
  store.put("abc");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(store.get(kAbc), "abc");
}

TEST_F(Files, TheClientSaysWhereNobodyAnswers) {
  std::string url_of_the_gone;
  {
    const TestServer server(options(folder_.path()));
    url_of_the_gone = url(server);
  }
  server::HttpFileStore store(url_of_the_gone, "");
  try {
    store.put("abc");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::io_failure);
    EXPECT_NE(std::string(error.what()).find(url_of_the_gone), std::string::npos) << error.what();
  }
}

TEST(HttpFileStore, TakesUrlsOfServersAlone) {
  for (const char* wrong :
       {"", "localhost", "https://a.example", "http://", "http://user@a.example",
        "http://a.example?x", "ftp://a.example", "http://a b"})
    EXPECT_THROW(server::HttpFileStore(wrong, ""), Error) << wrong;
  for (const char* right : {"http://a.example", "http://a.example:80/", "http://[::1]:8080/fstop"})
    EXPECT_NO_THROW(server::HttpFileStore(right, "")) << right;
}

}  // namespace
}  // namespace fstop::test
