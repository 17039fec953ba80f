#pragma once

#include <list>
#include <string>
#include <utility>

#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {

/// A server whose renders wait until the test lets them go, and clients that wait for them.
class HeldServer {
 public:
  explicit HeldServer(TestServer::Options options = {}) : server_(held(std::move(options))) {}
  ~HeldServer() { renders.let_go(); }
  HeldServer(const HeldServer&) = delete;
  HeldServer& operator=(const HeldServer&) = delete;

  /// A client that has asked for the tiny image with `seed`.
  Client& asking(int seed, const Headers& headers = {}) {
    clients_.emplace_back(server_.port());
    clients_.back().send(request_text("POST", "/v1/renders", headers, tiny_request(seed)));
    return clients_.back();
  }
  /// The name of the job that the tiny image with `seed` becomes at once.
  std::string job(int seed, const Headers& headers = {}) {
    Headers all = {{"Prefer", "respond-async"}};
    all.insert(all.end(), headers.begin(), headers.end());
    const Answer answer = ask(server_.port(), "POST", "/v1/renders", all, tiny_request(seed));
    return answer.header("location").substr(std::string("/v1/jobs/").size());
  }
  server::RenderQueue::Counts counts() { return server_.server().render_counts(); }
  bool reaches(int running, int queued) {
    return eventually([&] { return counts().running == running && counts().queued == queued; });
  }
  TestServer& server() { return server_; }

  HeldRenders renders;

 private:
  TestServer::Options held(TestServer::Options options) {
    options.simulate = renders.simulate();
    options.limits.express_renders = 0;  // what is small is not what these tests count
    return options;
  }

  TestServer server_;
  std::list<Client> clients_;
};

}  // namespace fstop::test
