#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "api/cell_json.h"
#include "server/sweep_cells.h"

namespace fstop::server {

/// What a cell is called in the queue and its tables: "SWEEP.INDEX".
std::string cell_key(std::string_view sweep, std::uint32_t index);
/// What a part of it is called there: "SWEEP.INDEX.pHASH", by the hash of its PartOrder.
std::string part_key(std::string_view cell, std::string_view part_sha256);
/// What an order is called: of a cell or of a part of one.
std::string order_key(const api::CellOrder& order);
/// The index of the cell whose order, or a part's, is called `key`; nothing for what is no such
/// name.
std::optional<std::uint32_t> cell_index(std::string_view key);

/// A whole number at least 0; 0 for a text that is none.
int count_of(std::string_view text);

/// An outcome as JSON, and the inverse. Throws: api::InvalidRequest.
std::string outcome_text(const CellOutcome& outcome);
CellOutcome outcome_of(std::string_view text);

/// `text`, or, where it is too large for a message, what names it in the store, where it then lies.
/// Throws: as ContentStore::put.
std::string short_text(std::string text, ContentStore& store);
/// The inverse; nothing where the store does not have it. Throws: as ContentStore::get.
std::optional<std::string> whole_text(std::string text, ContentStore& store);

}  // namespace fstop::server
