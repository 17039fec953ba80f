#pragma once

#include <string_view>

namespace fstop::server {

/// The contract to read: a page that draws /openapi.json with nothing from elsewhere.
std::string_view docs_page();    // HTML
std::string_view docs_script();  // its JavaScript
std::string_view docs_style();   // its CSS

}  // namespace fstop::server
