#include "server/config_file.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>

#include "core/error.h"

namespace fstop::server {
namespace {

std::string trimmed(std::string_view text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return std::string(text);
}

}  // namespace

std::string variable_of(std::string_view option) {
  std::string name = "FSTOP_";
  for (const char c : option.substr(option.find_first_not_of('-'))) {
    const bool is_small = c >= 'a' && c <= 'z';
    name += c == '-' ? '_' : is_small ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return name;
}

void apply_config_file(const std::string& file, std::span<const std::string> options) {
  std::ifstream stream(file);
  if (!stream) throw Error(ErrorCode::io_failure, "--config: cannot open " + file);
  std::set<std::string> seen;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    const std::string text = trimmed(line);
    if (text.empty() || text.front() == '#') continue;
    const auto refuse = [&](const std::string& why) {
      throw Error(ErrorCode::invalid_request,
                  "--config: line " + std::to_string(number) + " of " + file + " " + why);
    };
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) refuse("is not \"name = value\"");
    const std::string name = trimmed(text.substr(0, equals));
    const std::string value = trimmed(text.substr(equals + 1));
    if (std::find(options.begin(), options.end(), name) == options.end())
      refuse("names no option: " + name.substr(0, 64));
    if (!seen.insert(name).second) refuse("names " + name + " again");
    ::setenv(variable_of(name).c_str(), value.c_str(), 0);
  }
  if (stream.bad()) throw Error(ErrorCode::io_failure, "--config: cannot read " + file);
}

}  // namespace fstop::server
