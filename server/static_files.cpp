#include "server/static_files.h"

#include <array>
#include <fcntl.h>
#include <optional>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "api/render_id.h"
#include "server/reply_head.h"

namespace fstop::server {
namespace {

constexpr off_t kMaxFileBytes = off_t{64} << 20;

// Scripts, styles, fonts and images come from this server alone; pictures arrive as blobs.
constexpr const char* kContentSecurityPolicy =
    "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";

class FileDescriptor {
 public:
  explicit FileDescriptor(int descriptor) : descriptor_(descriptor) {}
  ~FileDescriptor() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FileDescriptor(FileDescriptor&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const noexcept { return descriptor_; }
  bool is_open() const noexcept { return descriptor_ >= 0; }

 private:
  int descriptor_;
};

std::optional<unsigned> hex_digit(char c) {
  if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a' + 10);
  if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A' + 10);
  return std::nullopt;
}

// Opens `path` ("a/b.js") below `root`, one name after the other, following no link. No name may
// be empty or begin with a dot, so that none leads upwards.
FileDescriptor open_below(const std::string& root, std::string_view path) {
  constexpr int kFolder = O_PATH | O_DIRECTORY | O_CLOEXEC;
  FileDescriptor at(::open(root.c_str(), kFolder));
  while (at.is_open()) {
    const std::size_t slash = path.find('/');
    const std::string name(path.substr(0, slash));
    if (name.empty() || name.front() == '.' || name.find('\\') != std::string::npos) break;
    const bool is_last = slash == std::string_view::npos;
    const int flags = is_last ? O_RDONLY | O_NONBLOCK | O_CLOEXEC : kFolder;
    at = FileDescriptor(::openat(at.get(), name.c_str(), flags | O_NOFOLLOW));
    if (is_last) return at;
    path.remove_prefix(slash + 1);
  }
  return FileDescriptor(-1);
}

std::optional<std::string> content_of(const FileDescriptor& file) {
  struct stat facts = {};
  if (!file.is_open() || ::fstat(file.get(), &facts) != 0) return std::nullopt;
  if (!S_ISREG(facts.st_mode) || facts.st_size > kMaxFileBytes) return std::nullopt;
  std::string content(static_cast<std::size_t>(facts.st_size), '\0');
  std::size_t filled = 0;
  while (filled < content.size()) {
    const ssize_t count = ::read(file.get(), content.data() + filled, content.size() - filled);
    if (count <= 0) return std::nullopt;
    filled += static_cast<std::size_t>(count);
  }
  return content;
}

std::string_view media_type_of(std::string_view path) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 13> kTypes = {{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".webp", "image/webp"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".txt", "text/plain; charset=utf-8"},
  }};
  for (const auto& [extension, type] : kTypes) {
    if (path.ends_with(extension)) return type;
  }
  return "application/octet-stream";
}

}  // namespace

std::string percent_decoded(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    const auto high = i + 2 < text.size() ? hex_digit(text[i + 1]) : std::nullopt;
    const auto low = high ? hex_digit(text[i + 2]) : std::nullopt;
    const unsigned byte = low ? 16 * *high + *low : 0;
    if (byte == 0) {
      throw Refusal(http::status::bad_request, "bad-target",
                    "the path has a broken or forbidden percent escape");
    }
    decoded += static_cast<char>(byte);
    i += 2;
  }
  return decoded;
}

Reply StaticFiles::reply(const Request& request, std::string_view path) const {
  std::string name = percent_decoded(path.substr(1));
  if (name.empty()) name = "index.html";
  std::optional<std::string> content;
  if (!root_.empty()) content = content_of(open_below(root_, name));
  if (!content) throw Refusal(http::status::not_found, "not-found", "nothing is at this path");
  const std::string etag = etag_of(api::sha256_hex(std::string_view(*content)));
  Reply reply = tagged_reply(request, std::string(media_type_of(name)), etag, std::move(*content));
  reply.set("Content-Security-Policy", kContentSecurityPolicy);
  reply.set("Referrer-Policy", "no-referrer");
  // The build names what lies in assets/ by its content.
  reply.set("Cache-Control",
            name.starts_with("assets/") ? "public, max-age=31536000, immutable" : "no-cache");
  return reply;
}

}  // namespace fstop::server
