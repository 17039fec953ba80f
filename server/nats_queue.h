#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/log.h"

namespace fstop::server {

/// The queue does not answer for now: the same again may succeed later.
class QueueUnreachable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A cell that was taken from the queue. Until it is ended the queue holds it for this worker, for
/// the acknowledgement time at most since the last sign of life, and then gives it to another.
/// Any thread, one call at a time but for in_progress().
class Delivery {
 public:
  struct Message;
  explicit Delivery(std::unique_ptr<Message> message);
  ~Delivery();
  Delivery(Delivery&&) noexcept;
  Delivery& operator=(Delivery&&) noexcept;

  std::string_view text() const;
  /// Its subject without what all have in common: whose cell or part it is, whatever the text says.
  std::string key() const;
  /// A sign of life. Lost where the queue is not reached.
  void in_progress() noexcept;
  /// It is done with and leaves the queue. Throws: QueueUnreachable; then it may come again.
  void done();
  /// It is to be given out again, after `delay`. Lost where the queue is not reached: then it is
  /// given out after the acknowledgement time.
  void again(std::chrono::milliseconds delay) noexcept;

 private:
  std::unique_ptr<Message> message_;
};

/// A work queue of cells and three tables of values, on NATS JetStream: the stream FSTOP_CELLS with
/// work-queue retention, its durable pull consumer "workers" with explicit acknowledgement, and the
/// key-value buckets below. Reconnects for ever; makes what is missing, alters nothing that is
/// there but the acknowledgement time where one is asked for. Any thread.
/// Throws: QueueUnreachable from every call that must reach it.
class NatsQueue {
 public:
  struct Settings {
    std::string url = {};   // nats://[user:password@]host[:port], more after commas; tls:// as well
    std::string name = {};  // of this connection, for whoever looks at the broker
    std::optional<std::chrono::milliseconds> ack_wait = {};  // absent: as it is, else 30 s
  };
  /// A table. `outcomes` and `attempts` forget after a week, `waiting` after half a minute.
  enum class Bucket { outcomes, attempts, waiting };
  struct Depth {
    std::uint64_t waiting = 0;  // cells that nobody has
    std::uint64_t in_hand = 0;  // of workers
    std::uint64_t idle = 0;     // workers that ask for one now
  };
  struct Value {
    std::string text = {};
    std::uint64_t revision = 0;
  };
  using Entry = std::pair<std::string, std::string>;  // key and text
  /// The values of keys that begin with a prefix: those there are, then each that is written.
  class Watch {
   public:
    struct Feed;
    explicit Watch(std::unique_ptr<Feed> feed);
    ~Watch();
    Watch(Watch&&) noexcept;
    Watch& operator=(Watch&&) noexcept;
    /// The next one; none if nothing comes within `patience`.
    std::optional<Entry> next(std::chrono::milliseconds patience);
    /// Whether all that was there at the beginning has been told.
    bool is_up_to_date() const noexcept;

   private:
    std::unique_ptr<Feed> feed_;
  };

  /// Returns at once; connects in the background.
  /// Throws: Error{invalid_request} for a URL that is none, Error{internal} if the library fails.
  NatsQueue(Settings settings, Log& log);
  ~NatsQueue();
  NatsQueue(const NatsQueue&) = delete;
  NatsQueue& operator=(const NatsQueue&) = delete;

  /// Where it is, without user and password.
  const std::string& address() const noexcept { return address_; }
  /// How often it has been connected: another number means that something may have been missed.
  std::uint64_t connections() const noexcept;

  /// Whether it was taken; false: a cell of this key is there, waiting or in hand. At most
  /// kMostMessageBytes. `generation`: publishing the same key and generation again within two
  /// minutes does nothing, whatever became of the first.
  bool publish(const std::string& key, std::string_view text, std::string_view generation);
  /// A cell, none if none comes within `patience`.
  std::optional<Delivery> next(std::chrono::milliseconds patience);
  /// Takes the waiting cells whose keys begin with `prefix` out of the queue.
  void withdraw(const std::string& prefix);
  Depth depth();
  /// For how long a worker may be silent.
  std::chrono::milliseconds ack_wait();

  /// Whether it was the first of this key.
  bool create(Bucket bucket, const std::string& key, std::string_view text);
  std::optional<Value> get(Bucket bucket, const std::string& key);
  /// Whether the value still had this revision.
  bool update(Bucket bucket, const std::string& key, std::string_view text, std::uint64_t revision);
  void put(Bucket bucket, const std::string& key, std::string_view text);
  void remove(Bucket bucket, const std::string& key);
  /// Removes all keys that begin with `prefix`, which ends where a part of a key does.
  void remove_all(Bucket bucket, const std::string& prefix);
  Watch watch(Bucket bucket, const std::string& prefix);
  /// At most `most` of a table.
  std::vector<Entry> entries(Bucket bucket, std::size_t most);

  static constexpr std::chrono::milliseconds kAnswerTime{3000};  // of the broker
  static constexpr std::size_t kMostMessageBytes = std::size_t{512} << 10;

 private:
  struct Broker;
  template <typename Call>
  auto reached(const char* what, const Call& call);

  std::string address_;
  std::unique_ptr<Broker> broker_;
};

}  // namespace fstop::server
