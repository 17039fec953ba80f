#include "server/cell_records.h"

#include <charconv>
#include <system_error>
#include <utility>

#include "api/cell_json.h"
#include "api/limits.h"
#include "server/nats_queue.h"

namespace fstop::server {
namespace {

constexpr std::string_view kPart = ".p";

template <typename Number>
std::optional<Number> parsed(std::string_view text) {
  Number number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

std::string cell_key(std::string_view sweep, std::uint32_t index) {
  return std::string(sweep) + "." + std::to_string(index);
}

std::string part_key(std::string_view cell, std::string_view part_sha256) {
  return std::string(cell).append(kPart).append(part_sha256);
}

std::string order_key(const api::CellOrder& order) {
  const std::string cell = cell_key(order.sweep, order.index);
  return order.part.empty() ? cell : part_key(cell, order.part);
}

std::optional<std::uint32_t> cell_index(std::string_view key) {
  const std::size_t part = key.rfind(kPart);
  if (part != std::string_view::npos && api::is_sha256(key.substr(part + kPart.size())))
    key = key.substr(0, part);
  const std::size_t dot = key.rfind('.');
  if (dot == std::string_view::npos || dot == 0) return std::nullopt;
  return parsed<std::uint32_t>(key.substr(dot + 1));
}

int count_of(std::string_view text) {
  const auto number = parsed<int>(text);
  return number && *number > 0 ? *number : 0;
}

std::string outcome_text(const CellOutcome& outcome) {
  api::CellRecord record{.index = outcome.index,
                         .render_id = outcome.render_id,
                         .report = outcome.report,
                         .problem = outcome.problem};
  for (const CellFile& file : outcome.files)
    record.files.push_back({file.name, file.sha256, file.bytes});
  return api::to_json(record);
}

CellOutcome outcome_of(std::string_view text) {
  const api::CellRecord record = api::parse_cell_record(text, api::Limits{});
  CellOutcome outcome{.index = record.index,
                      .render_id = record.render_id,
                      .report = record.report,
                      .problem = record.problem};
  for (const api::CellFileRecord& file : record.files)
    outcome.files.push_back({file.name, file.sha256, file.bytes});
  return outcome;
}

std::string short_text(std::string text, ContentStore& store) {
  if (text.size() <= NatsQueue::kMostMessageBytes) return text;
  return api::stored_text(store.put(text));
}

std::optional<std::string> whole_text(std::string text, ContentStore& store) {
  const std::string hash = api::stored_text_hash(text);
  if (hash.empty()) return text;
  return store.get(hash);
}

}  // namespace fstop::server
