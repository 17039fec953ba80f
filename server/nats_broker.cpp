#include "server/nats_broker.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <utility>

#include <boost/url/parse.hpp>

#include "core/error.h"

namespace fstop::server {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;  // JetStream's configurations count nanoseconds
constexpr std::int64_t kSecond = 1000 * kMillisecond;
constexpr std::int64_t kPingMs = 5000;  // a broker that is silent for twice this has gone
constexpr std::chrono::seconds kClosing{10};
constexpr std::int64_t kReconnectMs = 500;
constexpr std::int64_t kDuplicates = 120 * kSecond;
constexpr std::int64_t kForgetAfter = 7 * 24 * 3600 * kSecond;
constexpr std::int64_t kForgetWaitingAfter = 30 * kSecond;
// Workers that ask for a cell at once, or have one: the broker's own bounds are 512 and 1,000.
constexpr std::int64_t kMostWorkers = 16'384;
constexpr int kMostValueBytes = 1 << 20;

// The addresses of a list after commas, each as it stands.
std::vector<std::string> urls_of(const std::string& list) {
  std::vector<std::string> urls;
  for (std::size_t at = 0; at <= list.size();) {
    const std::size_t comma = std::min(list.find(',', at), list.size());
    urls.push_back(list.substr(at, comma - at));
    at = comma + 1;
  }
  return urls;
}

std::string without_user(std::string url) {
  const std::size_t scheme = url.find("://");
  const std::size_t begin = scheme == std::string::npos ? 0 : scheme + 3;
  const std::size_t at = url.rfind('@');
  if (at != std::string::npos && at >= begin) url.erase(begin, at + 1 - begin);
  return url;
}

// Absent or 1 to 65535.
bool is_port(const boost::urls::url_view& url) {
  if (!url.has_port()) return true;
  const std::string_view text(url.port().data(), url.port().size());
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && number > 0;
}

}  // namespace

std::string cause_of(natsStatus status, int code) {
  std::string text = natsStatus_GetText(status);
  const char* details = nats_GetLastError(nullptr);
  if (code != 0) text += ", JetStream error " + std::to_string(code);
  if (details != nullptr && *details != '\0') text += std::string(": ") + details;
  return text;
}

std::string shown_addresses(const std::string& list) {
  std::string text;
  for (const std::string& url : urls_of(list)) {
    const auto parts = boost::urls::parse_uri(url);
    const bool is_known = parts && (parts->scheme() == "nats" || parts->scheme() == "tls");
    if (!is_known || parts->encoded_host().empty() || !is_port(*parts) ||
        !parts->encoded_path().empty() || parts->has_query() || parts->has_fragment()) {
      throw Error(ErrorCode::invalid_request,
                  "--queue: must be nats://[user:password@]host[:port] or tls://..., the port 1 to "
                  "65535, more after commas; not " +
                      without_user(url));
    }
    text += (text.empty() ? "" : ",") + without_user(url);
  }
  return text;
}

NatsQueue::Broker::~Broker() {
  subscription.reset();
  if (!connection) return;
  natsConnection_Close(connection.get());
  // Callbacks come on a thread of the library's: the last one says so.
  std::unique_lock lock(mutex);
  closed.wait_for(lock, kClosing, [this] { return is_closed; });
}

void NatsQueue::Broker::require(natsStatus status, int code) {
  if (status == NATS_OK) return;
  is_prepared = false;
  throw QueueUnreachable(cause_of(status, code));
}

void NatsQueue::Broker::connect(const std::string& shown_address) {
  address = shown_address;
  natsOptions* made = nullptr;
  const auto check = [](natsStatus status) {
    if (status != NATS_OK)
      throw Error(ErrorCode::internal, "the NATS library fails: " + cause_of(status, 0));
  };
  check(natsOptions_Create(&made));
  const Options options(made);
  const std::vector<std::string> urls = urls_of(settings.url);
  std::vector<const char*> list;
  for (const std::string& url : urls) list.push_back(url.c_str());
  if (natsOptions_SetServers(made, list.data(), static_cast<int>(list.size())) != NATS_OK)
    throw Error(ErrorCode::invalid_request, "--queue: not a NATS URL: " + address);
  check(natsOptions_SetName(made, settings.name.c_str()));
  check(natsOptions_SetMaxReconnect(made, -1));
  check(natsOptions_SetReconnectWait(made, kReconnectMs));
  check(natsOptions_SetReconnectJitter(made, kReconnectMs, kReconnectMs));
  check(natsOptions_SetPingInterval(made, kPingMs));
  check(natsOptions_SetMaxPingsOut(made, 2));
  check(natsOptions_SetFailRequestsOnDisconnect(made, true));
  const auto connected = [](natsConnection*, void* self) {
    auto& broker = *static_cast<Broker*>(self);
    ++broker.connections;
    broker.log.event("queue_connected", {{"queue", broker.address}});
  };
  const auto disconnected = [](natsConnection*, void* self) {
    auto& broker = *static_cast<Broker*>(self);
    broker.log.warning("queue_disconnected", {{"queue", broker.address}});
  };
  const auto ended = [](natsConnection*, void* self) {
    auto& broker = *static_cast<Broker*>(self);
    const std::lock_guard lock(broker.mutex);
    broker.is_closed = true;
    broker.closed.notify_all();
  };
  check(natsOptions_SetClosedCB(made, ended, this));
  // The library's own handler writes to standard error, where a log of JSON lines stands.
  const auto ignored = [](natsConnection*, natsSubscription*, natsStatus, void*) {};
  check(natsOptions_SetErrorHandler(made, ignored, nullptr));
  check(natsOptions_SetReconnectedCB(made, connected, this));
  check(natsOptions_SetDisconnectedCB(made, disconnected, this));
  check(natsOptions_SetRetryOnFailedConnect(made, true, connected, this));
  natsConnection* link = nullptr;
  const natsStatus status = natsConnection_Connect(&link, made);
  connection.reset(link);
  if (status == NATS_OK) {
    connected(link, this);
  } else if (status != NATS_NOT_YET_CONNECTED) {
    throw Error(ErrorCode::invalid_request,
                "--queue: cannot use " + address + ": " + cause_of(status, 0));
  }
}

void NatsQueue::Broker::make_stream() {
  jsErrCode code = {};
  jsStreamInfo* found = nullptr;
  natsStatus status = js_GetStreamInfo(&found, context.get(), kCellStream, nullptr, &code);
  const StreamInfo info(found);
  if (status == NATS_OK) return;
  if (code != JSStreamNotFoundErr && status != NATS_NOT_FOUND) require(status, code);
  const char* subjects = kCellSubjects;
  jsStreamConfig config;
  jsStreamConfig_Init(&config);
  config.Name = kCellStream;
  config.Description = "cells of fstop's sweeps that are to be made";
  config.Subjects = &subjects;
  config.SubjectsLen = 1;
  config.Retention = js_WorkQueuePolicy;
  config.Storage = js_FileStorage;
  config.Duplicates = kDuplicates;
  // A cell that waits or is in hand is not taken a second time.
  config.MaxMsgsPerSubject = 1;
  config.Discard = js_DiscardNew;
  config.DiscardNewPerSubject = true;
  status = js_AddStream(nullptr, context.get(), &config, nullptr, &code);
  // Another process may have been quicker; where it differs, what it made stays.
  if (status != NATS_OK && code != JSStreamNameExistErr) require(status, code);
}

void NatsQueue::Broker::make_consumer() {
  jsErrCode code = {};
  jsConsumerInfo* found = nullptr;
  natsStatus status =
      js_GetConsumerInfo(&found, context.get(), kCellStream, kCellConsumer, nullptr, &code);
  const ConsumerInfo info(found);
  const bool is_there = status == NATS_OK;
  if (code != JSConsumerNotFoundErr && status != NATS_NOT_FOUND) require(status, code);
  if (is_there) ack_wait = std::chrono::milliseconds(info->Config->AckWait / kMillisecond);
  if (is_there && (!settings.ack_wait || *settings.ack_wait == ack_wait)) return;
  ack_wait = settings.ack_wait.value_or(kUsualAckWait);
  jsConsumerConfig config;
  jsConsumerConfig_Init(&config);
  config.Durable = kCellConsumer;
  config.AckPolicy = js_AckExplicit;
  config.AckWait = ack_wait.count() * kMillisecond;
  config.MaxDeliver = -1;  // attempts are counted in a table: deliveries are not attempts
  config.MaxAckPending = kMostWorkers;
  config.MaxWaiting = kMostWorkers;
  status = is_there
               ? js_UpdateConsumer(nullptr, context.get(), kCellStream, &config, nullptr, &code)
               : js_AddConsumer(nullptr, context.get(), kCellStream, &config, nullptr, &code);
  require(status, code);
}

void NatsQueue::Broker::make_tables() {
  std::array<Table, kBucketNames.size()> made = {};
  for (std::size_t i = 0; i < kBucketNames.size(); ++i) {
    kvStore* store = nullptr;
    natsStatus status = js_KeyValue(&store, context.get(), kBucketNames[i]);
    if (status != NATS_OK) {
      kvConfig config;
      kvConfig_Init(&config);
      config.Bucket = kBucketNames[i];
      config.History = 1;
      config.MaxValueSize = kMostValueBytes;
      config.StorageType = js_FileStorage;
      config.TTL =
          i == static_cast<std::size_t>(Bucket::waiting) ? kForgetWaitingAfter : kForgetAfter;
      status = js_CreateKeyValue(&store, context.get(), &config);
    }
    require(status);
    made[i] = Table(store, kvStore_Destroy);
  }
  tables = std::move(made);
}

void NatsQueue::Broker::prepare() {
  if (is_prepared) return;
  if (natsConnection_Status(connection.get()) != NATS_CONN_STATUS_CONNECTED) {
    const char* why = nullptr;
    natsConnection_GetLastError(connection.get(), &why);
    throw QueueUnreachable(why == nullptr || *why == '\0' ? "no connection"
                                                          : std::string("no connection, ") + why);
  }
  if (!context) {
    jsOptions options;
    jsOptions_Init(&options);
    options.Wait = kBrokerAnswerMs;
    jsCtx* made = nullptr;
    require(natsConnection_JetStream(&made, connection.get(), &options));
    context.reset(made);
  }
  make_stream();
  make_consumer();
  make_tables();
  is_prepared = true;
}

jsCtx* NatsQueue::Broker::jetstream() {
  const std::lock_guard lock(mutex);
  prepare();
  return context.get();
}

Table NatsQueue::Broker::table(Bucket bucket) {
  const std::lock_guard lock(mutex);
  prepare();
  return tables[static_cast<std::size_t>(bucket)];
}

// For the one thread that takes cells.
natsSubscription* NatsQueue::Broker::cells() {
  const std::lock_guard lock(mutex);
  prepare();
  if (subscription) return subscription.get();
  jsSubOptions options;
  jsSubOptions_Init(&options);
  options.Stream = kCellStream;
  options.Consumer = kCellConsumer;
  jsErrCode code = {};
  natsSubscription* made = nullptr;
  require(js_PullSubscribe(&made, context.get(), kCellSubjects, kCellConsumer, nullptr, &options,
                           &code),
          code);
  subscription.reset(made);
  return subscription.get();
}

}  // namespace fstop::server
