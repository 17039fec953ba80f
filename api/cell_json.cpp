#include "api/cell_json.h"

#include <algorithm>
#include <limits>

#include "api/json_reader.h"
#include "api/json_text.h"

namespace fstop::api {
namespace {

constexpr std::size_t kMostFiles = 1024;
constexpr std::size_t kMostNameBytes = 255;
constexpr std::size_t kMostTextBytes = std::size_t{64} << 20;
constexpr std::int64_t kMostIndex = std::numeric_limits<std::uint32_t>::max();
constexpr std::int64_t kMostBytes = std::int64_t{1} << 53;  // what every JSON reader counts exactly
constexpr std::size_t kHashDigits = 64;

bool is_plain_name(std::string_view name) {
  const auto legal = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == '_';
  };
  for (const char c : name) {
    if (!legal(c)) return false;
  }
  return !name.empty() && name.front() != '.';
}

bool is_relative_path(std::string_view path) {
  for (std::size_t at = 0; at <= path.size();) {
    const std::size_t slash = std::min(path.find('/', at), path.size());
    if (!is_plain_name(path.substr(at, slash - at))) return false;
    at = slash + 1;
  }
  return true;
}

std::string hash_of(ObjectReader& reader, std::string_view key, bool required) {
  std::string hash = required ? reader.text(key, kHashDigits) : reader.text(key, kHashDigits, "");
  if ((required || !hash.empty()) && !is_sha256(hash) && reader.clean())
    reader.fault(key, "must be a SHA-256: 64 lower-case hexadecimal digits");
  return hash;
}

nlohmann::ordered_json files_json(const std::vector<CellFileRecord>& files) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const CellFileRecord& file : files)
    list.push_back({{"name", file.name}, {"sha256", file.sha256}, {"bytes", file.bytes}});
  return list;
}

std::vector<CellFileRecord> files_of(ObjectReader& root, std::string_view key,
                                     bool (*is_name)(std::string_view)) {
  std::vector<CellFileRecord> files;
  for (ObjectReader& reader : root.objects(key, kMostFiles)) {
    CellFileRecord& file = files.emplace_back();
    file.name = reader.text("name", kMostNameBytes);
    if (!is_name(file.name)) reader.fault("name", "must be a plain file name");
    file.sha256 = hash_of(reader, "sha256", true);
    file.bytes = static_cast<std::uint64_t>(reader.integer("bytes", 0, kMostBytes));
    reader.reject_unread_members();
  }
  return files;
}

}  // namespace

bool is_sha256(std::string_view text) {
  return text.size() == kHashDigits &&
         text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::string to_json(const CellOrder& order) {
  nlohmann::ordered_json value = {{"engine", order.engine}};
  if (!order.scene.empty()) value["scene"] = order.scene;
  if (!order.scene_files.empty()) value["scene_files"] = files_json(order.scene_files);
  value["sweep"] = order.sweep;
  value["index"] = order.index;
  if (order.stored_request.empty()) {
    value["request"] = order.request;
  } else {
    value["stored_request"] = order.stored_request;
  }
  if (!order.part.empty()) value["part"] = order.part;
  return json_text(value);
}

std::string to_json(const CellRecord& record) {
  nlohmann::ordered_json value = {{"index", record.index}, {"render", record.render_id}};
  value["files"] = files_json(record.files);
  if (!record.report.empty()) value["report"] = record.report;
  if (!record.problem.empty()) value["problem"] = record.problem;
  return json_text(value);
}

CellOrder parse_cell_order(std::string_view text, const Limits& limits) {
  const nlohmann::json value = parse_json(text, limits);
  FaultList faults(limits.faults);
  nlohmann::json normal;
  CellOrder order;
  ObjectReader root(value, "#", faults, normal);
  order.engine = root.text("engine", kMostNameBytes);
  order.scene = hash_of(root, "scene", false);
  order.scene_files = files_of(root, "scene_files", is_relative_path);
  order.sweep = root.text("sweep", kMostNameBytes);
  order.index = static_cast<std::uint32_t>(root.integer("index", 0, kMostIndex));
  order.request = root.text("request", kMostTextBytes, "");
  order.stored_request = hash_of(root, "stored_request", false);
  order.part = hash_of(root, "part", false);
  if (order.request.empty() == order.stored_request.empty() && root.clean())
    root.fault("must have one of request and stored_request");
  root.reject_unread_members();
  faults.throw_if_any();
  return order;
}

CellRecord parse_cell_record(std::string_view text, const Limits& limits) {
  const nlohmann::json value = parse_json(text, limits);
  FaultList faults(limits.faults);
  nlohmann::json normal;
  CellRecord record;
  ObjectReader root(value, "#", faults, normal);
  record.index = static_cast<std::uint32_t>(root.integer("index", 0, kMostIndex));
  record.render_id = root.text("render", kMostNameBytes, "");
  record.files = files_of(root, "files", is_plain_name);
  record.report = root.text("report", kMostTextBytes, "");
  record.problem = root.text("problem", kMostTextBytes, "");
  if (!record.problem.empty() && !record.files.empty()) root.fault("has both files and a problem");
  root.reject_unread_members();
  faults.throw_if_any();
  return record;
}

std::string stored_text(std::string_view sha256) {
  return json_text(nlohmann::ordered_json{{"stored", std::string(sha256)}});
}

std::string stored_text_hash(std::string_view text) {
  constexpr std::string_view kHead = R"({"stored":")";
  constexpr std::string_view kTail = R"("})";
  if (text.size() != kHead.size() + kHashDigits + kTail.size()) return {};
  if (!text.starts_with(kHead) || !text.ends_with(kTail)) return {};
  const std::string_view hash = text.substr(kHead.size(), kHashDigits);
  return is_sha256(hash) ? std::string(hash) : std::string();
}

}  // namespace fstop::api
