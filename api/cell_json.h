#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/limits.h"

namespace fstop::api {

/// A file of a cell, or of a scene.
struct CellFileRecord {
  std::string name = {};
  std::string sha256 = {};
  std::uint64_t bytes = 0;
};

/// What a worker is told of a cell of a sweep, or of a part of its picture: its request, or where
/// that lies.
struct CellOrder {
  std::string engine = {};  // that must make it: another one makes other bytes
  std::string scene = {};   // hash of the scene that it must find; empty: whatever it finds
  std::vector<CellFileRecord> scene_files = {};  // in the content store: scene.json, its assets
  std::string sweep = {};
  std::uint32_t index = 0;
  std::string request = {};         // the text, byte by byte; empty: in the content store
  std::string stored_request = {};  // SHA-256 of a request that is too large for a message
  std::string part = {};  // of a part: SHA-256 of the bytes of its PartOrder, in the content store
};

/// What became of a cell: files and a report, or a problem.
struct CellRecord {
  std::uint32_t index = 0;
  std::string render_id = {};
  std::vector<CellFileRecord> files = {};
  std::string report = {};  // JSON; documents are carried as texts, so that no byte of them changes
  std::string problem = {};  // JSON
};

/// One line of JSON; the same values give the same bytes.
std::string to_json(const CellOrder& order);
std::string to_json(const CellRecord& record);

/// The inverses. What comes from a queue is foreign: `limits` bound its depth, every member is
/// checked, hashes are 64 lower-case hexadecimal digits, names of cells' files plain file names, of
/// scenes' files relative paths that lead nowhere else.
/// Throws: InvalidRequest.
CellOrder parse_cell_order(std::string_view text, const Limits& limits);
CellRecord parse_cell_record(std::string_view text, const Limits& limits);

/// A text that was put into the content store because it is too large for a message:
/// {"stored": hash}; and the hash that such a text names, empty for any other text.
std::string stored_text(std::string_view sha256);
std::string stored_text_hash(std::string_view text);

/// Whether `text` is a SHA-256 in 64 lower-case hexadecimal digits.
bool is_sha256(std::string_view text);

}  // namespace fstop::api
