#pragma once

#include <boost/asio/awaitable.hpp>

#include "server/routes.h"
#include "server/sweep_cells.h"
#include "server/workers.h"

namespace fstop::server {

/// The calls under /v1/files: bytes by their SHA-256, which workers elsewhere put and whoever reads
/// a manifest gets.
class FileCalls {
 public:
  explicit FileCalls(ContentStore& store);
  void add_to(Routes& routes);

 private:
  boost::asio::awaitable<Reply> get(Call& call);
  boost::asio::awaitable<Reply> put(Call& call);

  ContentStore& store_;
  Workers disk_;  // many: they wait for the disk, not for a processor
};

}  // namespace fstop::server
