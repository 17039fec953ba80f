#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/http/verb.hpp>

#include "api/problem.h"

namespace fstop::server {

namespace http = boost::beast::http;

/// One HTTP request, its framing checked.
struct Request {
  std::string id = {};  // ours, for the log and the reply
  http::verb verb = http::verb::unknown;
  std::string method = {};  // as sent
  std::string target = {};  // as sent
  std::string path = {};    // origin form, still percent-encoded
  std::string query = {};   // without '?'
  std::string host = {};    // host[:port], lower case
  http::fields fields = {};
  std::string body = {};
  bool keep_alive = false;

  /// The value of a header, empty where it is absent.
  std::string_view header(std::string_view name) const {
    const auto found = fields.find(boost::beast::string_view(name.data(), name.size()));
    if (found == fields.end()) return {};
    return {found->value().data(), found->value().size()};
  }
  bool has_header(std::string_view name) const {
    return fields.find(boost::beast::string_view(name.data(), name.size())) != fields.end();
  }
};

/// Bytes that several replies may share.
using SharedBytes = std::shared_ptr<const std::vector<std::byte>>;

/// One HTTP reply. Length, date and connection handling are added when it is written.
struct Reply {
  http::status status = http::status::ok;
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::variant<std::string, SharedBytes> body = {};
  /// Instead of `body`: the next piece of a body that is made while it is sent, in chunks; empty at
  /// its end. What it throws ends the connection.
  std::function<boost::asio::awaitable<std::string>()> next_piece = {};
  bool close = false;  // end the connection after it

  void set(std::string name, std::string value) {
    headers.emplace_back(std::move(name), std::move(value));
  }
  std::span<const char> bytes() const {
    if (const auto* text = std::get_if<std::string>(&body)) return {text->data(), text->size()};
    const auto& shared = std::get<SharedBytes>(body);
    if (!shared) return {};
    return {reinterpret_cast<const char*>(shared->data()), shared->size()};
  }
};

/// A refusal of HTTP itself, beside those of the contract (fstop::Error): it becomes problem+json.
class Refusal : public std::exception {
 public:
  Refusal(http::status status, std::string slug, std::string detail)
      : status_(status), slug_(std::move(slug)), detail_(std::move(detail)) {}
  Refusal& with(std::string name, std::string value) {
    headers_.emplace_back(std::move(name), std::move(value));
    return *this;
  }
  /// What the refused request was predicted to cost.
  Refusal& predicting(const api::CostPrediction& cost) {
    prediction_ = cost;
    return *this;
  }
  /// After it the bytes that follow on the connection cannot be trusted, or are not wanted.
  Refusal& closing() {
    close_ = true;
    return *this;
  }

  const char* what() const noexcept override { return detail_.c_str(); }
  http::status status() const noexcept { return status_; }
  const std::string& slug() const noexcept { return slug_; }
  const std::string& detail() const noexcept { return detail_; }
  const std::vector<std::pair<std::string, std::string>>& headers() const noexcept {
    return headers_;
  }
  bool close() const noexcept { return close_; }
  const std::optional<api::CostPrediction>& prediction() const noexcept { return prediction_; }

 private:
  http::status status_;
  std::string slug_;
  std::string detail_;
  std::vector<std::pair<std::string, std::string>> headers_ = {};
  std::optional<api::CostPrediction> prediction_ = {};
  bool close_ = false;
};

/// 503 of a server without a data directory, which `what` need.
inline Refusal no_data_folder(const std::string& what) {
  return {http::status::service_unavailable, "no-data-dir",
          what + " need a server with a data directory: --data-dir"};
}

/// The peer went away: nobody is left to answer.
class ClientGone : public std::exception {
 public:
  const char* what() const noexcept override { return "the client went away"; }
};

}  // namespace fstop::server
