#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "api/picture.h"
#include "server/http_message.h"

namespace fstop::server {

/// What a reply may be: an image of some format, or the JSON report (no format).
using Representation = std::optional<ImageFormat>;

/// The best of what `accept` (RFC 9110 12.5.1; empty: anything) admits: the highest quality value,
/// among equals `preferred`, then the order of ImageFormat. The report is taken only where its
/// type is named. Throws: Refusal 406.
Representation negotiated(std::string_view accept, ImageFormat preferred, bool may_be_report);

/// The same for an answer that is numbers first: the report, unless Accept likes it less than an
/// image's type that it names, or as well but less expressly. Throws: Refusal 406.
Representation negotiated_numbers(std::string_view accept, ImageFormat preferred);

/// The best of `types` by their names, of which the first is the usual: another is taken where
/// `accept` names it or its kind and likes it better, or as well but more expressly. Its index.
/// Throws: Refusal 406.
std::size_t negotiated_type(std::string_view accept, std::span<const std::string_view> types);

/// The parameters of a query, decoded. Throws: Refusal 400 for one that is not among `known`, is
/// there twice or is malformed.
std::map<std::string, std::string> query_parameters(const Request& request,
                                                    std::span<const std::string_view> known);

/// The format called `name`. Throws: Refusal 400 listing those there are.
ImageFormat format_of(std::string_view name);

}  // namespace fstop::server
