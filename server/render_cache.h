#pragma once

#include <cstddef>
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
  api::Timing timing = {};  // encode_ms apart, see report_json()

  /// The file, encoded now if it has not been. Throws: as api::picture_of and encode.
  EncodedFile file(const FileKey& key);
  /// Includes what encoding the first file took.
  std::string report_json();
  std::size_t bytes();

 private:
  std::optional<EncodedFile> known_file(const FileKey& key);

  std::mutex encoding_mutex_ = {};  // held while encoding: one at a time
  std::mutex mutex_ = {};           // held briefly: the I/O thread takes it too
  std::map<FileKey, EncodedFile> files_ = {};
  double encode_ms_ = 0.0;
};

/// Finished renders by id: those used last, as many as the bound on their bytes allows, and always
/// the newest.
class RenderCache {
 public:
  explicit RenderCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void insert(std::shared_ptr<StoredRender> render);
  /// Null if there is none (any more).
  std::shared_ptr<StoredRender> find(const std::string& id);
  /// Counts anew what `id` holds, after a file was added.
  void recount(const std::string& id);
  std::size_t bytes() const;

 private:
  struct Entry {
    std::shared_ptr<StoredRender> render = {};
    std::size_t bytes = 0;
  };
  void evict();

  mutable std::mutex mutex_;
  std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::list<Entry> entries_ = {};  // the one used last first
  std::unordered_map<std::string, std::list<Entry>::iterator> by_id_ = {};
};

}  // namespace fstop::server
