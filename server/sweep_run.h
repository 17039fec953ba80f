#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "api/sweep_request.h"
#include "server/content_folder.h"
#include "server/cost_model.h"
#include "server/descriptor.h"
#include "server/patient_store.h"
#include "server/sweep_cells.h"
#include "server/sweep_state.h"

namespace fstop::server {

/// A sweep in a folder: makes the cells that are missing there, records each, and at the end writes
/// manifest.json. Whenever it is stopped, killed or has lost files, another run goes on with what
/// is recorded and whole, and ends with the same manifest.
class SweepRun {
 public:
  /// `id`: of `sweep` (api::sweep_id). `files`: where the cells' files go. `names_files`: they also
  /// have names in the folder, cells/000012/image.exr. `sweep` and `files` outlive it.
  /// Throws: Error{invalid_request} if the folder holds another sweep or another process works in
  ///         it, Error{io_failure}, Refusal 507.
  SweepRun(const api::SweepRequest& sweep, std::string id, std::filesystem::path folder,
           ContentFolder& files, bool names_files);

  struct Listener {
    /// Cells that have their outcome, of all; one call at a time.
    std::function<void(std::size_t done, std::size_t all)> progress = {};
    WaitingFor waiting = {};
  };
  struct Summary {
    std::size_t cells = 0;
    std::size_t kept = 0;  // recorded by earlier runs
    std::size_t made = 0;
    std::size_t failed = 0;  // of all
  };
  /// Throws: Error{cancelled} if `stop` was requested before all was done; as `maker` does;
  ///         Error{io_failure}.
  Summary run(CellMaker& maker, const Listener& listener, const std::stop_token& stop);

  SweepState& state() noexcept { return state_; }
  std::filesystem::path manifest_file() const { return folder_ / "manifest.json"; }
  /// Whether `folder` holds the state of a sweep.
  static bool is_in(const std::filesystem::path& folder);

 private:
  std::vector<SweepCell> missing();
  void keep(const CellOutcome& outcome);
  std::string manifest();

  const api::SweepRequest& sweep_;
  std::string id_;
  std::filesystem::path folder_;
  ContentFolder& files_;
  bool names_files_;
  Descriptor lock_;  // on the folder, while it lives
  SweepState state_;
};

/// What all cells together are predicted to take; memory: of the largest. `scene_hashes`: of
/// sweep.scenes.
api::CostPrediction predicted_cost(const CostModel& costs, const api::SweepRequest& sweep,
                                   const std::vector<std::string>& scene_hashes);

}  // namespace fstop::server
