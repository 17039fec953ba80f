#pragma once

#include <memory>
#include <optional>
#include <string>

#include <boost/asio/awaitable.hpp>

#include "api/limits.h"
#include "server/jobs.h"
#include "server/log.h"
#include "server/negotiation.h"
#include "server/preferences.h"
#include "server/render_cache.h"
#include "server/render_queue.h"
#include "server/render_work.h"
#include "server/routes.h"
#include "server/scene_cache.h"
#include "server/workers.h"

namespace fstop::server {

/// What the calls under /v1/renders work with.
struct RenderServices {
  const api::Limits& limits;
  Workers& readers;   // read requests and scenes
  Workers& encoders;  // make files
  RenderWork& work;
  RenderQueue& queue;
  RenderCache& renders;
  SceneCache& scenes;
  CostModel& costs;
  Jobs& jobs;
  JobNotes& notes;
  Log& log;
  const std::atomic<bool>& draining;  // no new work
};

/// POST /v1/renders and what it leaves under /v1/renders/{id}.
class RenderCalls {
 public:
  explicit RenderCalls(RenderServices services) : services_(std::move(services)) {}
  void add_to(Routes& routes);
  /// Makes the jobs of `notes`, which a former process had accepted, known again. Before the calls.
  void restore(const std::vector<api::JobNote>& notes);
  /// Begins the restored jobs anew, one after the other as the queue has room.
  boost::asio::awaitable<void> resume(std::vector<api::JobNote> notes);

 private:
  // A request as it was read.
  struct Prepared {
    RenderTask task = {};
    Representation wanted = {};
    std::string fingerprint = {};              // of an Idempotency-Key's request
    std::shared_ptr<StoredRender> there = {};  // it was rendered before
  };

  boost::asio::awaitable<Reply> create(Call& call);
  boost::asio::awaitable<Reply> report(Call& call);
  boost::asio::awaitable<Reply> image(Call& call);
  boost::asio::awaitable<Reply> output(Call& call);

  Prepared prepare(const Request& request);
  bool is_small(const RenderTask& task) const;
  RenderQueue::Ticket submit(const std::string& client, const Prepared& prepared);
  boost::asio::awaitable<Reply> created(Call& call, const Prepared& prepared,
                                        std::shared_ptr<StoredRender> render, bool was_there);
  boost::asio::awaitable<Reply> promoted(Call& call, const Prepared& prepared,
                                         const Preferences& wishes, RenderQueue::Ticket ticket,
                                         Clock::time_point start);
  boost::asio::awaitable<void> resume(const api::JobNote& note);
  boost::asio::awaitable<void> submit_patiently(const std::shared_ptr<Job>& job,
                                                const api::JobNote& note, const Prepared& prepared);
  boost::asio::awaitable<std::shared_ptr<StoredRender>> stored(Call& call);
  boost::asio::awaitable<Reply> file_reply(Call& call, FileKey key);

  RenderServices services_;
  int preparing_ = 0;  // requests on the readers now
};

/// The file `key` of `render`, encoded by `encoders` if it has not been.
boost::asio::awaitable<EncodedFile> encoded_file(Workers& encoders, RenderCache& renders,
                                                 std::shared_ptr<StoredRender> render, FileKey key);

/// Refuses, before anything is allocated for it, what is predicted to take more time or memory than
/// one render may. Throws: Refusal 422 with the prediction.
void refuse_what_costs_too_much(const RenderTask& task, const api::Limits& limits);

/// At most 6 digits.
std::string short_number(double number);

/// Throws: Refusal 406 for JPEG of a render that has alpha.
void require_room_for_alpha(const SimulationSpec& spec, ImageFormat format);

/// The headers that name a render, its method and error.
void describe(Reply& reply, const StoredRender& render);

/// ?format= of the query, else what Accept prefers, else `usual`. Throws: Refusal 400, 406.
ImageFormat wanted_format(const Request& request, ImageFormat usual);

/// 202 with what is told of a job that is under way. `wishes`: what was preferred.
Reply accepted_reply(const Job& job, const Preferences& wishes);

}  // namespace fstop::server
