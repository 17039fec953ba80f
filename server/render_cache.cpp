#include "server/render_cache.h"

#include <chrono>
#include <utility>

#include "api/picture.h"
#include "api/render_id.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

std::size_t image_bytes(const Image& image) { return image.pixels().size() * sizeof(float); }

}  // namespace

std::optional<EncodedFile> StoredRender::known_file(const FileKey& key) {
  const std::lock_guard lock(mutex_);
  const auto found = files_.find(key);
  return found == files_.end() ? std::nullopt : std::optional(found->second);
}

EncodedFile StoredRender::file(const FileKey& key) {
  if (auto known = known_file(key)) return *known;
  const std::lock_guard encoding(encoding_mutex_);
  if (auto known = known_file(key)) return *known;  // encoded for another meanwhile
  const auto start = std::chrono::steady_clock::now();
  const Picture picture = key.alone ? api::output_picture(photograph, key.output, spec, id)
                                    : api::picture_of(photograph, spec, id, key.format);
  EncodedFile file;
  file.bytes =
      std::make_shared<const std::vector<std::byte>>(encode(picture, key.format, key.precision));
  file.etag = etag_of(api::sha256_hex(*file.bytes));
  file.encode_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const std::lock_guard lock(mutex_);
  return files_.emplace(key, std::move(file)).first->second;
}

std::size_t StoredRender::bytes() {
  std::size_t total =
      sizeof *this + normalised.size() + report.size() + image_bytes(photograph.color);
  for (const auto& [output, image] : photograph.layers) total += image_bytes(image);
  const std::lock_guard lock(mutex_);
  for (const auto& [key, file] : files_) total += file.bytes->size();
  return total;
}

void RenderCache::insert(std::shared_ptr<StoredRender> render) {
  if (files_ != nullptr) files_->save(*render);
  keep(std::move(render));
}

void RenderCache::keep(std::shared_ptr<StoredRender> render) {
  const std::size_t bytes = render->bytes();
  const std::lock_guard lock(mutex_);
  if (const auto found = by_id_.find(render->id); found != by_id_.end()) {
    counts_.bytes -= found->second->bytes;
    entries_.erase(found->second);
  }
  entries_.push_front({std::move(render), bytes});
  by_id_[entries_.front().render->id] = entries_.begin();
  counts_.bytes += bytes;
  evict();
}

std::shared_ptr<StoredRender> RenderCache::find(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = by_id_.find(id);
  if (found == by_id_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return entries_.front().render;
}

std::shared_ptr<StoredRender> RenderCache::load(const std::string& id) {
  std::shared_ptr<StoredRender> render = find(id);
  if (!render && files_ != nullptr) {
    render = files_->load(id);
    if (render) keep(render);
  }
  const std::lock_guard lock(mutex_);
  ++(render ? counts_.hits : counts_.misses);
  return render;
}

void RenderCache::recount(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = by_id_.find(id);
  if (found == by_id_.end()) return;
  Entry& entry = *found->second;
  counts_.bytes -= entry.bytes;
  entry.bytes = entry.render->bytes();
  counts_.bytes += entry.bytes;
  evict();
}

void RenderCache::evict() {
  while (counts_.bytes > max_bytes_ && entries_.size() > 1) {
    counts_.bytes -= entries_.back().bytes;
    by_id_.erase(entries_.back().render->id);
    entries_.pop_back();
  }
}

RenderCache::Counts RenderCache::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace fstop::server
