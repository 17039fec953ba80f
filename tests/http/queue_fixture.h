#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "server/log.h"
#include "server/nats_queue.h"
#include "tests/http/background.h"
#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {

/// A NATS server of the test's own.
class Queue : public testing::Test {
 protected:
  Queue() : log_((folder_.path() / "log").string()), nats_(folder_.path()) {}

  std::unique_ptr<server::NatsQueue> connected(
      std::optional<std::chrono::milliseconds> ack_wait = std::chrono::seconds(1)) {
    auto queue = std::make_unique<server::NatsQueue>(
        server::NatsQueue::Settings{.url = nats_.url(), .name = "test", .ack_wait = ack_wait},
        log_);
    const bool is_there = eventually([&] {
      try {
        queue->depth();
        return true;
      } catch (const server::QueueUnreachable&) {
        return false;
      }
    });
    if (!is_there) throw std::runtime_error("the queue does not answer");
    return queue;
  }
  std::string log_text() const { return text_of_file(folder_.path() / "log"); }

  TemporaryFolder folder_;
  server::Log log_;
  NatsServer nats_;
};

/// The name of a sweep that `recipe` began.
inline std::string begun_sweep(std::uint16_t port, const std::string& recipe) {
  const Answer answer = ask(port, "POST", "/v1/sweeps", {}, recipe);
  EXPECT_EQ(answer.status, 202) << answer.body;
  constexpr std::string_view kMember = "\"sweep\":\"";
  const std::size_t at = answer.body.find(kMember);
  return at == std::string::npos ? "" : answer.body.substr(at + kMember.size(), 64);
}

/// The manifest of a sweep, once it is there; the server may be away meanwhile.
inline std::string manifest_of(std::uint16_t port, const std::string& sweep) {
  std::string manifest;
  eventually(
      [&] {
        try {
          const Answer answer = ask(port, "GET", "/v1/sweeps/" + sweep + "/manifest");
          if (answer.status == 200) manifest = answer.body;
        } catch (const std::runtime_error&) {  // nobody listens
        }
        return !manifest.empty();
      },
      std::chrono::seconds(120));
  return manifest;
}

}  // namespace fstop::test
