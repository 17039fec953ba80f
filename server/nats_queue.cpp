#include "server/nats_queue.h"

#include <utility>

#include "core/error.h"
#include "server/nats_broker.h"

namespace fstop::server {
namespace {

const std::string kSubject = "fstop.cells.";

std::string_view text_of_entry(kvEntry* entry) {
  const int length = kvEntry_ValueLen(entry);
  if (length <= 0) return {};
  return {static_cast<const char*>(kvEntry_Value(entry)), static_cast<std::size_t>(length)};
}

}  // namespace

// ---- One cell.

struct Delivery::Message {
  OneMessage message = {};
};

Delivery::Delivery(std::unique_ptr<Message> message) : message_(std::move(message)) {}
Delivery::~Delivery() = default;
Delivery::Delivery(Delivery&&) noexcept = default;
Delivery& Delivery::operator=(Delivery&&) noexcept = default;

std::string_view Delivery::text() const {
  natsMsg* message = message_->message.get();
  return {natsMsg_GetData(message), static_cast<std::size_t>(natsMsg_GetDataLength(message))};
}

std::string Delivery::key() const {
  const std::string subject = natsMsg_GetSubject(message_->message.get());
  return subject.starts_with(kSubject) ? subject.substr(kSubject.size()) : subject;
}

void Delivery::in_progress() noexcept { natsMsg_InProgress(message_->message.get(), nullptr); }

void Delivery::done() {
  jsErrCode code = {};
  jsOptions options;
  jsOptions_Init(&options);
  options.Wait = kBrokerAnswerMs;
  const natsStatus status = natsMsg_AckSync(message_->message.get(), &options, &code);
  if (status != NATS_OK) throw QueueUnreachable(cause_of(status, code));
}

void Delivery::again(std::chrono::milliseconds delay) noexcept {
  natsMsg_NakWithDelay(message_->message.get(), delay.count(), nullptr);
}

// ---- Values as they come.

struct NatsQueue::Watch::Feed {
  Watcher watcher = {};
  bool is_up_to_date = false;
};

NatsQueue::Watch::Watch(std::unique_ptr<Feed> feed) : feed_(std::move(feed)) {}
NatsQueue::Watch::~Watch() = default;
NatsQueue::Watch::Watch(Watch&&) noexcept = default;
NatsQueue::Watch& NatsQueue::Watch::operator=(Watch&&) noexcept = default;

bool NatsQueue::Watch::is_up_to_date() const noexcept { return feed_->is_up_to_date; }

std::optional<NatsQueue::Entry> NatsQueue::Watch::next(std::chrono::milliseconds patience) {
  for (;;) {
    kvEntry* found = nullptr;
    const natsStatus status = kvWatcher_Next(&found, feed_->watcher.get(), patience.count());
    const OneEntry entry(found);
    if (status == NATS_TIMEOUT) return std::nullopt;
    if (status != NATS_OK) throw QueueUnreachable(cause_of(status));
    if (!entry) {  // the end of what was there
      feed_->is_up_to_date = true;
      return std::nullopt;
    }
    if (kvEntry_Operation(found) != kvOp_Put) continue;
    return Entry(kvEntry_Key(found), text_of_entry(found));
  }
}

// ---- The queue.

NatsQueue::NatsQueue(Settings settings, Log& log)
    : address_(shown_addresses(settings.url)),
      broker_(std::make_unique<Broker>(std::move(settings), log)) {
  broker_->connect(address_);
}

NatsQueue::~NatsQueue() = default;

std::uint64_t NatsQueue::connections() const noexcept { return broker_->connections; }

// Any failure makes the next call look whether all is there: the broker may have lost it.
template <typename Call>
auto NatsQueue::reached(const char* what, const Call& call) {
  try {
    return call(*broker_);
  } catch (const QueueUnreachable& failure) {
    const std::lock_guard lock(broker_->mutex);
    broker_->is_prepared = false;
    throw QueueUnreachable(std::string(what) + ": " + failure.what());
  }
}

bool NatsQueue::publish(const std::string& key, std::string_view text,
                        std::string_view generation) {
  return reached("publishing a cell", [&](Broker& broker) {
    const std::string subject = kSubject + key;
    const std::string id = key + "/" + std::string(generation);
    jsPubOptions options;
    jsPubOptions_Init(&options);
    options.MsgId = id.c_str();
    jsErrCode code = {};
    const natsStatus status = js_Publish(nullptr, broker.jetstream(), subject.c_str(), text.data(),
                                         static_cast<int>(text.size()), &options, &code);
    if (status == NATS_OK) return true;
    // Of this stream: a cell with this key is there.
    if (code == JSStreamStoreFailedErr &&
        cause_of(status, code).find("per subject") != std::string::npos)
      return false;
    throw QueueUnreachable(cause_of(status, code));
  });
}

std::optional<Delivery> NatsQueue::next(std::chrono::milliseconds patience) {
  return reached("taking a cell", [&](Broker& broker) -> std::optional<Delivery> {
    natsMsgList list = {};
    jsErrCode code = {};
    const natsStatus status =
        natsSubscription_Fetch(&list, broker.cells(), 1, patience.count(), &code);
    if (status == NATS_OK && list.Count > 0) {
      auto message = std::make_unique<Delivery::Message>();
      message->message.reset(list.Msgs[0]);
      list.Msgs[0] = nullptr;
      natsMsgList_Destroy(&list);
      return Delivery(std::move(message));
    }
    natsMsgList_Destroy(&list);
    const bool is_there =
        natsConnection_Status(broker.connection.get()) == NATS_CONN_STATUS_CONNECTED;
    if ((status == NATS_OK || status == NATS_TIMEOUT) && is_there) return std::nullopt;
    const std::lock_guard lock(broker.mutex);
    broker.subscription.reset();
    throw QueueUnreachable(is_there ? cause_of(status, code) : "no connection");
  });
}

// One by one: nats-server 2.9.10, told to purge some subjects of a stream, has its consumers pass
// over the others as well.
void NatsQueue::withdraw(const std::string& prefix) {
  reached("withdrawing cells", [&](Broker& broker) {
    const std::string subjects = kSubject + prefix + ">";
    jsOptions options;
    jsOptions_Init(&options);
    options.Wait = kBrokerAnswerMs;
    options.Stream.Info.SubjectsFilter = subjects.c_str();
    jsErrCode code = {};
    jsStreamInfo* found = nullptr;
    natsStatus status = js_GetStreamInfo(&found, broker.jetstream(), kCellStream, &options, &code);
    const StreamInfo info(found);
    if (status != NATS_OK) throw QueueUnreachable(cause_of(status, code));
    const jsStreamStateSubjects* list = info->State.Subjects;
    for (int i = 0; list != nullptr && i < list->Count; ++i) {
      natsMsg* last = nullptr;
      status = js_GetLastMsg(&last, broker.jetstream(), kCellStream, list->List[i].Subject, nullptr,
                             &code);
      const OneMessage message(last);
      if (status == NATS_NOT_FOUND) continue;  // a worker was quicker
      if (status != NATS_OK) throw QueueUnreachable(cause_of(status, code));
      status =
          js_DeleteMsg(broker.jetstream(), kCellStream, natsMsg_GetSequence(last), nullptr, &code);
      const bool is_gone = status == NATS_NOT_FOUND || code == JSNoMessageFoundErr ||
                           code == JSSequenceNotFoundErr || code == JSStreamMsgDeleteFailed;
      if (status != NATS_OK && !is_gone) throw QueueUnreachable(cause_of(status, code));
    }
  });
}

NatsQueue::Depth NatsQueue::depth() {
  return reached("looking at the queue", [&](Broker& broker) {
    jsErrCode code = {};
    jsConsumerInfo* found = nullptr;
    const natsStatus status =
        js_GetConsumerInfo(&found, broker.jetstream(), kCellStream, kCellConsumer, nullptr, &code);
    const ConsumerInfo info(found);
    if (status != NATS_OK) throw QueueUnreachable(cause_of(status, code));
    return Depth{.waiting = info->NumPending,
                 .in_hand = static_cast<std::uint64_t>(info->NumAckPending),
                 .idle = static_cast<std::uint64_t>(info->NumWaiting)};
  });
}

std::chrono::milliseconds NatsQueue::ack_wait() {
  return reached("looking at the queue", [&](Broker& broker) {
    const std::lock_guard lock(broker.mutex);
    broker.prepare();
    return broker.ack_wait;
  });
}

bool NatsQueue::create(Bucket bucket, const std::string& key, std::string_view text) {
  return reached("writing a value", [&](Broker& broker) {
    const Table table = broker.table(bucket);
    const natsStatus status = kvStore_Create(nullptr, table.get(), key.c_str(), text.data(),
                                             static_cast<int>(text.size()));
    if (status == NATS_OK) return true;
    const std::string cause = cause_of(status);
    if (get(bucket, key)) return false;
    throw QueueUnreachable(cause);
  });
}

std::optional<NatsQueue::Value> NatsQueue::get(Bucket bucket, const std::string& key) {
  return reached("reading a value", [&](Broker& broker) -> std::optional<Value> {
    kvEntry* found = nullptr;
    const natsStatus status = kvStore_Get(&found, broker.table(bucket).get(), key.c_str());
    const OneEntry entry(found);
    if (status == NATS_NOT_FOUND) return std::nullopt;
    if (status != NATS_OK) throw QueueUnreachable(cause_of(status));
    return Value{std::string(text_of_entry(found)), kvEntry_Revision(found)};
  });
}

bool NatsQueue::update(Bucket bucket, const std::string& key, std::string_view text,
                       std::uint64_t revision) {
  return reached("writing a value", [&](Broker& broker) {
    const natsStatus status = kvStore_Update(nullptr, broker.table(bucket).get(), key.c_str(),
                                             text.data(), static_cast<int>(text.size()), revision);
    if (status == NATS_OK) return true;
    const std::string cause = cause_of(status);
    const auto now = get(bucket, key);
    if (!now || now->revision != revision) return false;
    throw QueueUnreachable(cause);
  });
}

void NatsQueue::put(Bucket bucket, const std::string& key, std::string_view text) {
  reached("writing a value", [&](Broker& broker) {
    const natsStatus status = kvStore_Put(nullptr, broker.table(bucket).get(), key.c_str(),
                                          text.data(), static_cast<int>(text.size()));
    if (status != NATS_OK) throw QueueUnreachable(cause_of(status));
  });
}

void NatsQueue::remove(Bucket bucket, const std::string& key) {
  reached("removing a value", [&](Broker& broker) {
    const natsStatus status = kvStore_Delete(broker.table(bucket).get(), key.c_str());
    if (status != NATS_OK && status != NATS_NOT_FOUND) throw QueueUnreachable(cause_of(status));
  });
}

void NatsQueue::remove_all(Bucket bucket, const std::string& prefix) {
  reached("removing values", [&](Broker& broker) {
    const std::string name = kBucketNames[static_cast<std::size_t>(bucket)];
    const std::string stream = "KV_" + name;
    const std::string subject = "$KV." + name + "." + prefix + ">";
    jsOptions options;
    jsOptions_Init(&options);
    options.Wait = kBrokerAnswerMs;
    options.Stream.Purge.Subject = subject.c_str();
    jsErrCode code = {};
    const natsStatus status = js_PurgeStream(broker.jetstream(), stream.c_str(), &options, &code);
    if (status != NATS_OK) throw QueueUnreachable(cause_of(status, code));
  });
}

NatsQueue::Watch NatsQueue::watch(Bucket bucket, const std::string& prefix) {
  return reached("watching values", [&](Broker& broker) {
    kvWatchOptions options;
    kvWatchOptions_Init(&options);
    options.IgnoreDeletes = true;
    options.Timeout = kBrokerAnswerMs;
    auto feed = std::make_unique<Watch::Feed>();
    kvWatcher* made = nullptr;
    const std::string keys = prefix + ">";
    const natsStatus status =
        kvStore_Watch(&made, broker.table(bucket).get(), keys.c_str(), &options);
    feed->watcher.reset(made);
    if (status != NATS_OK) throw QueueUnreachable(cause_of(status));
    return Watch(std::move(feed));
  });
}

std::vector<NatsQueue::Entry> NatsQueue::entries(Bucket bucket, std::size_t most) {
  Watch all = watch(bucket, "");
  std::vector<Entry> found;
  while (found.size() < most) {
    auto entry = all.next(std::chrono::milliseconds(kBrokerAnswerMs));
    if (!entry) break;
    found.push_back(std::move(*entry));
  }
  return found;
}

}  // namespace fstop::server
