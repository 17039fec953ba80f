#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "api/limits.h"
#include "api/sweep_request.h"
#include "server/content_folder.h"
#include "server/jobs.h"
#include "server/log.h"
#include "server/queue_cell_maker.h"
#include "server/render_queue.h"
#include "server/routes.h"
#include "server/workers.h"

namespace fstop::server {

/// What the calls under /v1/sweeps work with.
struct SweepServices {
  const api::Limits& limits;
  Log& log;
  Workers& readers;    // read files
  Workers& expanders;  // make the cells of requests, which may take seconds
  RenderQueue& queue;  // of its own: one sweep at a time leads its cells through the renders'
  Jobs& jobs;
  CellServices cells;
  /// Instead of the server's renders; may be absent.
  std::function<std::unique_ptr<CellMaker>(ContentFolder& files)> maker;
  std::filesystem::path folder;       // of sweeps; empty: none are taken
  std::filesystem::path file_folder;  // of their files
  const std::atomic<bool>& draining;  // no new work
};

/// POST /v1/sweeps and what it leaves under /v1/sweeps/{id}. Of each sweep there is a folder with
/// its recipe, its state, a file for each job that wants it, and at the end its manifest: what a
/// former process left undone goes on.
class SweepCalls {
 public:
  explicit SweepCalls(SweepServices services);
  void add_to(Routes& routes);
  /// Goes on with the sweeps that jobs of a former process want, under their names. Once the I/O
  /// thread runs.
  boost::asio::awaitable<void> resume();

 private:
  struct Prepared {
    std::shared_ptr<const api::SweepRequest> sweep = {};
    std::string id = {};
    api::CostPrediction cost = {};
    bool is_done = false;
  };
  struct Active;

  boost::asio::awaitable<Reply> create(Call& call);
  boost::asio::awaitable<Reply> show(Call& call);
  boost::asio::awaitable<Reply> manifest(Call& call);
  boost::asio::awaitable<Reply> file(Call& call);

  boost::asio::awaitable<Prepared> prepared_for(Call& call);
  Prepared prepare(const std::string& body) const;
  void refuse_what_costs_too_much(const Prepared& prepared) const;
  std::shared_ptr<Job> start(const Prepared& prepared, const std::string& client,
                             const std::string& name);
  RenderQueue::Result run(const Prepared& prepared, const std::shared_ptr<Active>& active,
                          const RenderQueue::Turn& turn);
  std::string view(const std::string& id, const std::shared_ptr<Active>& active) const;
  std::filesystem::path folder_of(const std::string& id) const;
  std::vector<std::filesystem::path> unfinished() const;
  void require_folder() const;

  SweepServices services_;
  std::optional<ContentFolder> files_ = {};
  std::map<std::string, std::weak_ptr<Active>> active_ = {};  // of the I/O thread
  int preparing_ = 0;                                         // requests on the expanders now
};

}  // namespace fstop::server
