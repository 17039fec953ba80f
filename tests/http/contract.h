#pragma once

#include <string>
#include <string_view>

#include "tests/http/http_client.h"

namespace fstop::test {

/// What the served OpenAPI document has against `answer` to this request: a status, type or body
/// that it does not tell of. Empty if it has nothing against it, or does not know the path.
std::string contract_objection(std::string_view method, std::string_view target,
                               const Answer& answer);

}  // namespace fstop::test
