#include "server/sweep_state.h"

#include <cerrno>
#include <sqlite3.h>
#include <utility>

#include "core/error.h"
#include "server/http_message.h"

namespace fstop::server {
namespace {

constexpr int kBusyMs = 5000;
constexpr const char* kSchema =
    "PRAGMA journal_mode=WAL;"
    "PRAGMA synchronous=FULL;"
    "CREATE TABLE IF NOT EXISTS facts(name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;"
    "CREATE TABLE IF NOT EXISTS cells(number INTEGER PRIMARY KEY, render_id TEXT NOT NULL,"
    " report TEXT NOT NULL, problem TEXT NOT NULL);"
    "CREATE TABLE IF NOT EXISTS files(cell INTEGER NOT NULL, place INTEGER NOT NULL,"
    " name TEXT NOT NULL, sha256 TEXT NOT NULL, bytes INTEGER NOT NULL,"
    " PRIMARY KEY(cell, place)) WITHOUT ROWID;";

// A write that fails for a bound on sizes or a quota is an I/O error to SQLite, whose cause is
// often overwritten before it can be asked for: so unless the disk itself failed.
bool is_out_of_space(sqlite3* database) {
  const int code = sqlite3_extended_errcode(database);
  if (code == SQLITE_FULL) return true;
  const bool is_of_writing = code == SQLITE_IOERR_WRITE || code == SQLITE_IOERR_SHMSIZE ||
                             code == SQLITE_IOERR_FSYNC || code == SQLITE_IOERR_TRUNCATE;
  const int cause = sqlite3_system_errno(database);
  return is_of_writing && cause != EIO && cause != EROFS;
}

[[noreturn]] void fail(sqlite3* database) {
  if (is_out_of_space(database)) {
    throw Refusal(http::status::insufficient_storage, "storage-full",
                  "the disk that keeps the sweep's state is full");
  }
  throw Error(ErrorCode::io_failure,
              std::string("the sweep's state cannot be used: ") + sqlite3_errmsg(database));
}

}  // namespace

/// A prepared statement with its values.
class SweepState::Statement {
 public:
  Statement(sqlite3* database, const char* sql) : database_(database) {
    if (sqlite3_prepare_v2(database, sql, -1, &statement_, nullptr) != SQLITE_OK) fail(database);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& with(std::string_view text) {
    check(sqlite3_bind_text64(statement_, ++bound_, text.data(), text.size(), SQLITE_TRANSIENT,
                              SQLITE_UTF8));
    return *this;
  }
  Statement& with(std::uint64_t number) {
    check(sqlite3_bind_int64(statement_, ++bound_, static_cast<sqlite3_int64>(number)));
    return *this;
  }
  // Whether there is another row.
  bool step() {
    const int code = sqlite3_step(statement_);
    if (code != SQLITE_ROW && code != SQLITE_DONE) fail(database_);
    return code == SQLITE_ROW;
  }
  std::string text(int column) const {
    const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    const int size = sqlite3_column_bytes(statement_, column);
    return bytes == nullptr ? std::string() : std::string(bytes, static_cast<std::size_t>(size));
  }
  std::uint64_t number(int column) const {
    return static_cast<std::uint64_t>(sqlite3_column_int64(statement_, column));
  }

 private:
  void check(int code) {
    if (code != SQLITE_OK) fail(database_);
  }
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

void SweepState::Closer::operator()(sqlite3* database) const { sqlite3_close_v2(database); }

SweepState::SweepState(const std::filesystem::path& file) {
  sqlite3* opened = nullptr;
  constexpr int kFlags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX;
  const int code = sqlite3_open_v2(file.c_str(), &opened, kFlags, nullptr);
  database_.reset(opened);
  if (code != SQLITE_OK) fail(opened);
  sqlite3_busy_timeout(opened, kBusyMs);
  sqlite3_extended_result_codes(opened, 1);
  run(kSchema);
}

SweepState::~SweepState() = default;

void SweepState::run(const char* sql) const {
  if (sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    fail(database_.get());
}

std::optional<std::string> SweepState::fact(std::string_view name) const {
  Statement statement(database_.get(), "SELECT value FROM facts WHERE name = ?");
  if (!statement.with(name).step()) return std::nullopt;
  return statement.text(0);
}

void SweepState::set_fact(std::string_view name, std::string_view value) {
  Statement(database_.get(), "INSERT OR REPLACE INTO facts VALUES (?, ?)")
      .with(name)
      .with(value)
      .step();
}

void SweepState::forget_fact(std::string_view name) {
  Statement(database_.get(), "DELETE FROM facts WHERE name = ?").with(name).step();
}

void SweepState::record(const CellOutcome& outcome) {
  run("BEGIN IMMEDIATE");
  try {
    sqlite3* database = database_.get();
    Statement(database, "INSERT OR IGNORE INTO cells VALUES (?, ?, ?, ?)")
        .with(outcome.index)
        .with(outcome.render_id)
        .with(outcome.report)
        .with(outcome.problem)
        .step();
    if (sqlite3_changes(database) > 0) {
      for (std::size_t i = 0; i < outcome.files.size(); ++i) {
        const CellFile& file = outcome.files[i];
        Statement(database, "INSERT INTO files VALUES (?, ?, ?, ?, ?)")
            .with(outcome.index)
            .with(i)
            .with(file.name)
            .with(file.sha256)
            .with(file.bytes)
            .step();
      }
    }
    run("COMMIT");
  } catch (...) {
    // Some failures have rolled back by themselves.
    sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
    throw;
  }
}

std::optional<CellOutcome> SweepState::outcome(std::uint32_t index) const {
  Statement cell(database_.get(), "SELECT render_id, report, problem FROM cells WHERE number = ?");
  if (!cell.with(index).step()) return std::nullopt;
  CellOutcome outcome{
      .index = index, .render_id = cell.text(0), .report = cell.text(1), .problem = cell.text(2)};
  Statement files(database_.get(),
                  "SELECT name, sha256, bytes FROM files WHERE cell = ? ORDER BY place");
  files.with(index);
  while (files.step()) {
    outcome.files.push_back(
        {.name = files.text(0), .sha256 = files.text(1), .bytes = files.number(2)});
  }
  return outcome;
}

std::vector<std::uint32_t> SweepState::recorded() const {
  Statement statement(database_.get(), "SELECT number FROM cells ORDER BY number");
  std::vector<std::uint32_t> cells;
  while (statement.step()) cells.push_back(static_cast<std::uint32_t>(statement.number(0)));
  return cells;
}

std::uint64_t SweepState::failed() const {
  Statement statement(database_.get(), "SELECT count(*) FROM cells WHERE problem <> ''");
  statement.step();
  return statement.number(0);
}

void SweepState::forget(std::uint32_t index) {
  run("BEGIN IMMEDIATE");
  try {
    Statement(database_.get(), "DELETE FROM files WHERE cell = ?").with(index).step();
    Statement(database_.get(), "DELETE FROM cells WHERE number = ?").with(index).step();
    run("COMMIT");
  } catch (...) {
    sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
    throw;
  }
}

}  // namespace fstop::server
