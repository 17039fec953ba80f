#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "server/log.h"
#include "server/nats_queue.h"
#include "tests/http/background.h"
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

}  // namespace fstop::test
