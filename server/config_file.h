#pragma once

#include <span>
#include <string>
#include <string_view>

namespace fstop::server {

/// The environment variable that stands for an option: FSTOP_DATA_DIR for "--data-dir".
std::string variable_of(std::string_view option);

/// Reads a file of lines "name = value", names as the options have them without dashes; empty lines
/// and lines that begin with # say nothing. Sets each as the option's environment variable where
/// that is not set: so flags go before the environment, and the environment before the file.
/// Throws: Error{io_failure} if the file cannot be read; Error{invalid_request}, naming the line,
///         for what is no such line, is no name of `options` or comes twice.
void apply_config_file(const std::string& file, std::span<const std::string> options);

}  // namespace fstop::server
