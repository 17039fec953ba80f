#include "server/queue_parts.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "api/problem.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/cell_records.h"
#include "server/order_collector.h"

namespace fstop::server {
namespace {

// Numbers that depend on nothing but the picture: another attempt at it asks for the same parts.
constexpr double kLeastSamples = 1e6;  // of a part: seconds or tenths of one
constexpr int kMostParts = 48;         // of a round: the last ones end together
constexpr int kMostRefused = 8;
constexpr std::size_t kHashDigits = 64;

}  // namespace

QueueParts::QueueParts(Services services, api::CellOrder cell)
    : services_(services), cell_(std::move(cell)), key_(order_key(cell_)) {}

int QueueParts::parts(double samples) const {
  const double parts = std::min(samples / kLeastSamples, double{kMostParts});
  return parts >= 2.0 ? static_cast<int>(parts) : 0;
}

void QueueParts::trace(std::span<const PartOrder> orders, const Take& take_part,
                       const RunControl& run) {
  std::map<std::string, std::size_t, std::less<>> numbers;  // by key
  const auto order_text = [&](const std::string& key) {
    const std::string bytes = bytes_of(orders[numbers.at(key)]);
    api::CellOrder order = cell_;
    order.part = api::sha256_hex(bytes);
    if (!files_.contains(order.part)) services_.store.put(bytes);
    files_.insert(order.part);
    return api::to_json(order);
  };
  const auto take_outcome = [&](const std::string& key, CellOutcome& outcome) {
    const std::size_t number = numbers.at(key);
    const auto next = [&](const TracedPart& part) { take_part(number, part); };
    if (!take(orders[number], outcome, next)) return false;
    files_.insert(key.substr(key.size() - kHashDigits));  // an earlier attempt's order, maybe
    return true;
  };
  OrderCollector collector(
      {.queue = services_.queue, .store = services_.store, .log = services_.log}, key_ + ".",
      {.order = order_text, .take = take_outcome, .waiting = {}});
  for (std::size_t number = 0; number < orders.size(); ++number) {
    const std::string key = part_key(key_, api::sha256_hex(bytes_of(orders[number])));
    numbers.emplace(key, number);
    collector.add(key);
  }
  services_.log.event("round_begun", {{"cell", key_}, {"parts", static_cast<int>(orders.size())}});
  collector.until_done(run.stop);
  throw_if_stopped(run);
}

// Whether the part is there and whole.
bool QueueParts::take(const PartOrder& order, const CellOutcome& outcome,
                      const std::function<void(const TracedPart&)>& next) {
  if (!outcome.problem.empty()) throw PartFailed(outcome.problem);
  if (outcome.files.size() != 1) return false;
  const std::string& hash = outcome.files.front().sha256;
  const std::optional<std::string> bytes = services_.store.get(hash);
  if (!bytes) return false;
  std::optional<TracedPart> part;
  try {
    part = traced_part_of(*bytes, order);
  } catch (const Error& error) {
    services_.log.warning("part_refused", {{"cell", key_}, {"why", error.what()}});
    if (++refused_ < kMostRefused) return false;
    throw PartFailed(api::to_json(
        api::http_problem(500, "cell-abandoned", "workers put files that are no parts of it")));
  }
  next(*part);
  files_.insert(hash);
  ++traced_;
  return true;
}

void QueueParts::tidy() noexcept {
  OrderCollector({.queue = services_.queue, .store = services_.store, .log = services_.log},
                 key_ + ".", {})
      .tidy(true);
  for (const std::string& hash : files_) services_.store.remove(hash);
  files_.clear();
}

}  // namespace fstop::server
