#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/sweep_cells.h"

struct sqlite3;

namespace fstop::server {

/// What a sweep has done so far, in an SQLite file in write-ahead mode: an outcome that was
/// recorded outlives the process and the machine. One process at a time, any thread.
class SweepState {
 public:
  /// Opens or makes `file`. Throws: Error{io_failure} where it is no such file or cannot be opened;
  /// Refusal 507 where there is no room.
  explicit SweepState(const std::filesystem::path& file);
  ~SweepState();
  SweepState(const SweepState&) = delete;
  SweepState& operator=(const SweepState&) = delete;

  /// Words of the sweep as a whole: "sweep", "recipe".
  std::optional<std::string> fact(std::string_view name) const;
  void set_fact(std::string_view name, std::string_view value);
  void forget_fact(std::string_view name);

  /// Returns once the outcome is durable. A second one of the same cell changes nothing.
  /// Throws: Refusal 507 where there is no room, Error{io_failure}.
  void record(const CellOutcome& outcome);
  std::optional<CellOutcome> outcome(std::uint32_t index) const;
  /// Cells that have an outcome, in order.
  std::vector<std::uint32_t> recorded() const;
  std::uint64_t failed() const;
  /// As if cell `index` had never been made.
  void forget(std::uint32_t index);

 private:
  struct Closer {
    void operator()(sqlite3* database) const;
  };
  class Statement;
  void run(const char* sql) const;

  std::unique_ptr<sqlite3, Closer> database_;
};

}  // namespace fstop::server
