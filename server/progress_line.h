#pragma once

#include <string>
#include <string_view>

namespace fstop::server {

/// Tells progress on standard error: in place on a terminal, else a line each twentieth.
class ProgressLine {
 public:
  /// `what` begins the line: "chart". `is_wanted`: also where standard error is no terminal.
  ProgressLine(std::string what, bool is_wanted);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void tell(double share);
  /// A line of its own, whatever was wanted.
  void say(std::string_view text);

 private:
  void clear();

  std::string what_;
  bool is_terminal_;
  bool is_told_;
  int told_ = -1;
};

}  // namespace fstop::server
