#include "server/result_store.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <fcntl.h>
#include <fstream>
#include <sys/stat.h>
#include <system_error>
#include <utility>
#include <vector>

#include "core/error.h"
#include "server/commands.h"
#include "server/http_message.h"
#include "server/render_cache.h"
#include "server/result_file.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

bool is_id(std::string_view name) {
  return name.size() == 64 && name.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::string content_of(const fs::path& file) {
  std::error_code ec;
  const auto size = fs::file_size(file, ec);
  std::ifstream stream(file, std::ios::binary);
  if (ec || !stream) return {};
  std::string bytes(size, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

// So that a later process knows the order of use.
void touch(const fs::path& file) {
  std::error_code ignored;
  fs::last_write_time(file, fs::file_time_type::clock::now(), ignored);
}

}  // namespace

ResultStore::ResultStore(fs::path folder, std::size_t max_bytes, const api::Limits& limits,
                         Log& log)
    : folder_(std::move(folder)), max_bytes_(max_bytes), limits_(limits), log_(log) {
  if (folder_.empty()) return;
  std::error_code ec;
  fs::create_directories(folder_, ec);
  if (!fs::is_directory(folder_))
    throw Error(ErrorCode::io_failure, "cannot make the folder " + folder_.string());
  find_what_is_there();
}

void ResultStore::find_what_is_there() {
  struct Found {
    fs::file_time_type time = {};
    Entry entry = {};
  };
  std::vector<Found> found;
  std::error_code ec;
  for (const auto& file : fs::directory_iterator(folder_, ec)) {
    std::error_code gone;
    const std::string name = file.path().filename().string();
    const auto bytes = file.file_size(gone);
    if (is_id(name) && !gone) {
      found.push_back({file.last_write_time(gone), {name, bytes}});
    } else if (name.find(".part") != std::string::npos) {
      fs::remove(file.path(), gone);  // of a process that was killed
    }
  }
  std::sort(found.begin(), found.end(),
            [](const Found& a, const Found& b) { return a.time < b.time; });
  for (const Found& each : found) remember(each.entry.id, each.entry.bytes);
  const std::lock_guard lock(mutex_);
  make_room(0);
}

fs::path ResultStore::file_of(const std::string& id) const { return folder_ / id; }

void ResultStore::save(const StoredRender& render) {
  if (folder_.empty()) return;
  const std::string bytes = result_bytes(render);
  if (bytes.size() > max_bytes_) return;
  {
    const std::lock_guard lock(mutex_);
    make_room(bytes.size());
  }
  write_durably(file_of(render.id).string(), bytes);
  remember(render.id, bytes.size());
  const std::lock_guard lock(mutex_);
  ++counts_.saved;
}

std::shared_ptr<StoredRender> ResultStore::load(const std::string& id) {
  if (folder_.empty() || !is_id(id)) return nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (!by_id_.contains(id)) return nullptr;
  }
  const std::string bytes = content_of(file_of(id));
  auto render = result_of(bytes, id, limits_);
  if (!render) {
    log_.warning("result_damaged", {{"render", id}});
    forget(id);
    const std::lock_guard lock(mutex_);
    ++counts_.damaged;
    return nullptr;
  }
  touch(file_of(id));
  remember(id, bytes.size());
  const std::lock_guard lock(mutex_);
  ++counts_.loaded;
  return render;
}

void ResultStore::remember(const std::string& id, std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (const auto known = by_id_.find(id); known != by_id_.end()) {
    counts_.bytes -= known->second->bytes;
    entries_.erase(known->second);
  }
  entries_.push_front({id, bytes});
  by_id_[id] = entries_.begin();
  counts_.bytes += bytes;
}

void ResultStore::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  std::error_code ignored;
  fs::remove(file_of(id), ignored);
  const auto known = by_id_.find(id);
  if (known == by_id_.end()) return;
  counts_.bytes -= known->second->bytes;
  entries_.erase(known->second);
  by_id_.erase(known);
}

// For `bytes` more. Under the mutex.
void ResultStore::make_room(std::uint64_t bytes) {
  while (!entries_.empty() && counts_.bytes + bytes > max_bytes_) {
    const Entry& oldest = entries_.back();
    std::error_code ignored;
    fs::remove(file_of(oldest.id), ignored);
    counts_.bytes -= oldest.bytes;
    by_id_.erase(oldest.id);
    entries_.pop_back();
    ++counts_.evicted;
  }
}

ResultStore::Counts ResultStore::counts() const {
  const std::lock_guard lock(mutex_);
  Counts counts = counts_;
  counts.files = entries_.size();
  return counts;
}

}  // namespace fstop::server
