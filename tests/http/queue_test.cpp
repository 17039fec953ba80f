// The queue of cells on a NATS server of the test's own.
#include <chrono>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "core/error.h"
#include "server/nats_queue.h"
#include "tests/http/queue_fixture.h"

namespace fstop::test {
namespace {

using namespace std::chrono_literals;
using server::NatsQueue;
using Bucket = server::NatsQueue::Bucket;

TEST_F(Queue, HoldsACellOnceUntilItIsDone) {
  const auto queue = connected();
  EXPECT_TRUE(queue->publish("s.1", "first", "a"));
  EXPECT_FALSE(queue->publish("s.1", "second", "b")) << "it waits";
  auto cell = queue->next(2s);
  ASSERT_TRUE(cell);
  EXPECT_EQ(cell->key(), "s.1");
  EXPECT_EQ(cell->text(), "first");
  EXPECT_FALSE(queue->publish("s.1", "third", "c")) << "it is in hand";
  EXPECT_EQ(queue->depth().in_hand, 1U);
  cell->done();
  EXPECT_EQ(queue->depth().in_hand, 0U);
  EXPECT_FALSE(queue->next(100ms));
  EXPECT_TRUE(queue->publish("s.1", "fourth", "d")) << "it has left";
}

// A sender that did not hear the answer sends the same again.
TEST_F(Queue, TakesTheSameSendingOnce) {
  const auto queue = connected();
  for (int i = 0; i < 3; ++i) queue->publish("s.1", "text", "a");
  auto cell = queue->next(2s);
  ASSERT_TRUE(cell);
  cell->done();
  queue->publish("s.1", "text", "a");
  EXPECT_FALSE(queue->next(100ms));
}

TEST_F(Queue, GivesACellToAnotherUnlessItsWorkerIsHeardOf) {
  const auto queue = connected(1s);
  EXPECT_EQ(queue->ack_wait(), 1s);
  queue->publish("s.1", "text", "a");
  auto mine = queue->next(2s);
  ASSERT_TRUE(mine);
  for (int i = 0; i < 9; ++i) {  // for three times the acknowledgement time
    mine->in_progress();
    EXPECT_FALSE(queue->next(333ms)) << "it is in hand";
  }
  auto of_another = queue->next(5s);  // silence
  ASSERT_TRUE(of_another);
  EXPECT_EQ(of_another->key(), "s.1");
  of_another->done();
}

TEST_F(Queue, GivesACellAgainWhenToldTo) {
  const auto queue = connected(30s);
  queue->publish("s.1", "text", "a");
  queue->next(2s)->again(0ms);
  auto cell = queue->next(5s);
  ASSERT_TRUE(cell);
  cell->done();
}

TEST_F(Queue, WithdrawsWhatBeginsSo) {
  const auto queue = connected();
  queue->publish("s.1", "text", "a");
  queue->publish("s.2", "text", "a");
  queue->publish("t.1", "text", "a");
  queue->withdraw("s.");
  EXPECT_EQ(queue->depth().waiting, 1U);
  EXPECT_EQ(queue->next(2s)->key(), "t.1");
}

TEST_F(Queue, KeepsTheFirstValueOfAKey) {
  const auto queue = connected();
  EXPECT_TRUE(queue->create(Bucket::outcomes, "s.1", "first"));
  EXPECT_FALSE(queue->create(Bucket::outcomes, "s.1", "second"));
  const auto value = queue->get(Bucket::outcomes, "s.1");
  ASSERT_TRUE(value);
  EXPECT_EQ(value->text, "first");
  EXPECT_FALSE(queue->get(Bucket::outcomes, "s.2"));
  EXPECT_FALSE(queue->get(Bucket::attempts, "s.1"));
  EXPECT_TRUE(queue->update(Bucket::outcomes, "s.1", "third", value->revision));
  EXPECT_FALSE(queue->update(Bucket::outcomes, "s.1", "fourth", value->revision));
  queue->remove(Bucket::outcomes, "s.1");
  EXPECT_FALSE(queue->get(Bucket::outcomes, "s.1"));
  EXPECT_TRUE(queue->create(Bucket::outcomes, "s.1", "fifth"));
  queue->create(Bucket::outcomes, "t.1", "other");
  queue->remove_all(Bucket::outcomes, "s.");
  EXPECT_FALSE(queue->get(Bucket::outcomes, "s.1"));
  EXPECT_TRUE(queue->get(Bucket::outcomes, "t.1"));
}

TEST_F(Queue, TellsValuesThatAreThereAndThatCome) {
  const auto queue = connected();
  queue->create(Bucket::outcomes, "s.1", "one");
  queue->create(Bucket::outcomes, "t.1", "of another");
  NatsQueue::Watch watch = queue->watch(Bucket::outcomes, "s.");
  const auto first = watch.next(5s);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->second, "one");
  while (!watch.is_up_to_date()) EXPECT_FALSE(watch.next(1s));
  queue->create(Bucket::outcomes, "s.2", "two");
  const auto second = watch.next(5s);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->first, "s.2");
  EXPECT_EQ(second->second, "two");
}

TEST_F(Queue, OutlivesItsBroker) {
  const auto queue = connected();
  queue->publish("s.1", "text", "a");
  const auto before = queue->connections();
  nats_.kill();
  EXPECT_TRUE(eventually([&] {
    try {
      queue->create(Bucket::outcomes, "s.1", "text");
      return false;
    } catch (const server::QueueUnreachable&) {
      return true;
    }
  }));
  nats_.start();
  ASSERT_TRUE(eventually([&] { return queue->connections() > before; }));
  std::optional<server::Delivery> cell;
  EXPECT_TRUE(eventually([&] {
    try {
      cell = queue->next(1s);
    } catch (const server::QueueUnreachable&) {
    }
    return cell.has_value();
  }));
  ASSERT_TRUE(cell);
  EXPECT_EQ(cell->key(), "s.1");
  cell->done();
}

TEST_F(Queue, IsMadeAnewWhereTheBrokerHasLostIt) {
  const auto queue = connected();
  queue->publish("s.1", "text", "a");
  nats_.kill();
  nats_.start_empty();
  EXPECT_TRUE(eventually([&] {
    try {
      return queue->publish("s.1", "text", "b");
    } catch (const server::QueueUnreachable&) {
      return false;
    }
  }));
  EXPECT_EQ(queue->depth().waiting, 1U);
}

TEST_F(Queue, HidesPasswordsAndRefusesOtherUrls) {
  const NatsQueue queue({.url = "nats://user:secret@127.0.0.1:9,nats://127.0.0.1:10"}, log_);
  EXPECT_EQ(queue.address(), "nats://127.0.0.1:9,nats://127.0.0.1:10");
  for (const char* wrong : {"", "127.0.0.1", "http://127.0.0.1", "nats://a,b"})
    EXPECT_THROW(NatsQueue({.url = wrong}, log_), Error) << wrong;
}

}  // namespace
}  // namespace fstop::test
