#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "server/sweep_cells.h"

namespace fstop::server {

/// The files of an fstop server (PUT and GET /v1/files/{sha256}), over one connection that is kept.
/// Any thread, one exchange at a time.
class HttpFileStore : public ContentStore {
 public:
  /// `url`: http://host[:port], a path of a proxy behind it. `token`: empty for none. Connects
  /// where it is first used. Throws: Error{invalid_request} for a URL that is none.
  HttpFileStore(const std::string& url, std::string token);
  ~HttpFileStore() override;

  const std::string& address() const noexcept { return address_; }

  /// Tries a few times within seconds. Throws: Refusal 507 where the server has no room;
  /// Error{over_budget} for more bytes than it takes; Error{io_failure} where it is not reached,
  /// is busy, or does not accept the token.
  std::string put(std::string_view bytes) override;
  std::optional<std::string> get(std::string_view sha256) override;
  /// Whether the server has these bytes. Throws: as get.
  bool has(const CellFile& file);

 private:
  struct Link;
  struct Response;
  Response exchange(const char* method, std::string_view sha256, std::string_view body);
  Response exchange_once(const char* method, std::string_view sha256, std::string_view body);
  [[noreturn]] void refuse(const Response& response) const;

  std::string address_;
  std::string host_ = {};
  std::string port_ = "80";
  std::string prefix_ = {};  // of paths, without the last slash
  std::string token_;
  std::mutex mutex_ = {};
  std::unique_ptr<Link> link_;
};

}  // namespace fstop::server
