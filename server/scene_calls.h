#pragma once

#include <filesystem>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "api/limits.h"
#include "api/scene_store.h"
#include "api/scene_upload.h"
#include "server/log.h"
#include "server/routes.h"
#include "server/workers.h"

namespace fstop::server {

/// What the calls under /v1/scenes work with.
struct SceneServices {
  const api::Limits& limits;
  Log& log;
  Workers& readers;
  const api::SceneStore& store;
  std::filesystem::path folder;  // where scenes that are sent go; empty: none are taken
  std::string program;           // fstop itself, which reads what is sent
};

/// The stored scenes: list, text, and those that clients send.
class SceneCalls {
 public:
  /// Sweeps away what a former process left half made.
  explicit SceneCalls(SceneServices services);
  void add_to(Routes& routes);

 private:
  boost::asio::awaitable<Reply> list(Call& call);
  boost::asio::awaitable<Reply> show(Call& call);
  boost::asio::awaitable<Reply> put(Call& call);
  Reply keep(const std::string& name, const Request& request);
  api::UploadedScene decoded(const std::string& name, const std::string& body);
  bool store(const std::string& name, const api::UploadedScene& scene);

  SceneServices services_;
  Workers uploads_;  // one at a time: each may take gigabytes
};

}  // namespace fstop::server
