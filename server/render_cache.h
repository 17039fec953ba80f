#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>

#include "api/picture.h"
#include "api/render_request.h"
#include "api/report_json.h"
#include "server/http_message.h"
#include "server/result_store.h"

namespace fstop::server {

/// Which file of a render is meant.
struct FileKey {
  Output output = Output::color;
  ImageFormat format = ImageFormat::png;
  Precision precision = Precision::single;
  bool alone = false;  // the output without the layers beside it

  friend auto operator<=>(const FileKey&, const FileKey&) = default;
};

/// One encoded file.
struct EncodedFile {
  SharedBytes bytes = {};
  std::string etag = {};  // strong: the hash of the bytes, in its quotes
  double encode_ms = 0.0;
};

/// A finished render and the files made of it so far.
struct StoredRender {
  std::string id = {};
  std::string normalised = {};  // the request, for the report
  SimulationSpec spec = {};
  Photograph photograph = {};
  api::Timing timing = {};
  std::string report = {};  // JSON; as it was when the render ended

  /// The file, encoded now if it has not been. Throws: as api::picture_of and encode.
  EncodedFile file(const FileKey& key);
  /// The file if it has been encoded: at once.
  std::optional<EncodedFile> known_file(const FileKey& key);
  std::size_t bytes();

 private:
  std::mutex encoding_mutex_ = {};  // held while encoding: one at a time
  std::mutex mutex_ = {};           // held briefly: the I/O thread takes it too
  std::map<FileKey, EncodedFile> files_ = {};
};

/// Finished renders by id, in memory and in files: those used last, as many as the bounds on their
/// bytes allow, and always the newest.
class RenderCache {
 public:
  struct Counts {
    std::size_t bytes = 0;  // in memory
    std::uint64_t hits = 0;
    std::uint64_t misses = 0;
  };

  /// `files`: where renders go beyond the memory; null: nowhere.
  explicit RenderCache(std::size_t max_bytes, ResultStore* files = nullptr)
      : max_bytes_(max_bytes), files_(files) {}

  /// Returns once the render lies on the disk. Throws: as ResultStore::save; then it is not kept.
  void insert(std::shared_ptr<StoredRender> render);
  /// From memory alone. Null if there is none (any more).
  std::shared_ptr<StoredRender> find(const std::string& id);
  /// From memory or a file, which takes its time. Null if there is none (any more).
  std::shared_ptr<StoredRender> load(const std::string& id);
  /// Counts anew what `id` holds, after a file was added.
  void recount(const std::string& id);
  Counts counts() const;

 private:
  struct Entry {
    std::shared_ptr<StoredRender> render = {};
    std::size_t bytes = 0;
  };
  void keep(std::shared_ptr<StoredRender> render);
  void evict();

  mutable std::mutex mutex_;
  std::size_t max_bytes_;
  ResultStore* files_;
  Counts counts_ = {};
  std::list<Entry> entries_ = {};  // the one used last first
  std::unordered_map<std::string, std::list<Entry>::iterator> by_id_ = {};
};

}  // namespace fstop::server
