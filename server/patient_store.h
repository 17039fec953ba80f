#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <string_view>

#include "server/sweep_cells.h"

namespace fstop::server {

/// What whoever waits says of it: "disk space"; empty: it waits no longer.
using WaitingFor = std::function<void(std::string_view)>;

/// Repeats `attempt` while it is refused for want of room (Refusal 507), after 0.1 s at first, up
/// to 5 s later, and tells `waiting`. Throws: Error{cancelled} once `stop` is requested; what else
/// `attempt` throws.
void when_there_is_room(const std::function<void()>& attempt, const WaitingFor& waiting,
                        const std::stop_token& stop);

/// A content store that waits where there is no room.
class PatientStore : public ContentStore {
 public:
  PatientStore(ContentStore& store, WaitingFor waiting, std::stop_token stop)
      : store_(store), waiting_(std::move(waiting)), stop_(std::move(stop)) {}

  std::string put(std::string_view bytes) override;
  std::optional<std::string> get(std::string_view sha256) override { return store_.get(sha256); }
  void remove(std::string_view sha256) noexcept override { store_.remove(sha256); }

 private:
  ContentStore& store_;
  WaitingFor waiting_;
  std::stop_token stop_;
};

}  // namespace fstop::server
