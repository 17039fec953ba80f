#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <nats/nats.h>

#include "server/nats_queue.h"

namespace fstop::server {

/// What the library gives, destroyed as it wants it to be.
template <typename T, void (*destroy)(T*)>
struct Destroyer {
  void operator()(T* object) const { destroy(object); }
};

template <typename T, void (*destroy)(T*)>
using Owned = std::unique_ptr<T, Destroyer<T, destroy>>;

using Options = Owned<natsOptions, natsOptions_Destroy>;
using NatsConnection = Owned<natsConnection, natsConnection_Destroy>;
using Context = Owned<jsCtx, jsCtx_Destroy>;
using Table = std::shared_ptr<kvStore>;
using Subscription = Owned<natsSubscription, natsSubscription_Destroy>;
using ConsumerInfo = Owned<jsConsumerInfo, jsConsumerInfo_Destroy>;
using StreamInfo = Owned<jsStreamInfo, jsStreamInfo_Destroy>;
using OneEntry = Owned<kvEntry, kvEntry_Destroy>;
using Watcher = Owned<kvWatcher, kvWatcher_Destroy>;
using OneMessage = Owned<natsMsg, natsMsg_Destroy>;

constexpr std::int64_t kBrokerAnswerMs = NatsQueue::kAnswerTime.count();
constexpr std::chrono::milliseconds kUsualAckWait{30'000};
constexpr const char* kCellStream = "FSTOP_CELLS";
constexpr const char* kCellConsumer = "workers";
constexpr const char* kCellSubjects = "fstop.cells.>";
constexpr std::array<const char*, 3> kBucketNames = {"fstop_outcomes", "fstop_attempts",
                                                     "fstop_waiting"};

/// What the library says of a failure of the last call on this thread.
std::string cause_of(natsStatus status, int code = 0);

/// The URLs of a list after commas without users and passwords.
/// Throws: Error{invalid_request} where one is none.
std::string shown_addresses(const std::string& list);

/// The connection and what stands on the broker.
struct NatsQueue::Broker {
  Broker(Settings given, Log& its_log) : settings(std::move(given)), log(its_log) {}
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  void connect(const std::string& address);
  void require(natsStatus status, int code = 0);
  void make_stream();
  void make_consumer();
  void make_tables();
  /// Makes sure that all is there. Under the mutex.
  void prepare();
  jsCtx* jetstream();
  Table table(Bucket bucket);
  natsSubscription* cells();

  Settings settings;
  Log& log;
  std::string address = {};
  std::atomic<std::uint64_t> connections = 0;
  std::mutex mutex = {};
  NatsConnection connection = {};
  Context context = {};
  std::array<Table, kBucketNames.size()> tables = {};
  Subscription subscription = {};
  std::chrono::milliseconds ack_wait = kUsualAckWait;
  bool is_prepared = false;
  bool is_closed = false;  // for good: no callback comes any more
  std::condition_variable closed = {};
};

}  // namespace fstop::server
