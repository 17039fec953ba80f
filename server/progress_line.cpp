#include "server/progress_line.h"

#include <cstdio>
#include <unistd.h>
#include <utility>

namespace fstop::server {

ProgressLine::ProgressLine(std::string what, bool is_wanted)
    : what_(std::move(what)),
      is_terminal_(::isatty(STDERR_FILENO) == 1),
      is_told_(is_wanted || is_terminal_) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::clear() {
  if (is_told_ && is_terminal_ && told_ >= 0) std::fputs("\r\033[K", stderr);
}

void ProgressLine::tell(double share) {
  const int step = is_terminal_ ? 1 : 5;  // percent
  const int percent = static_cast<int>(100.0 * share) / step * step;
  if (!is_told_ || percent <= told_) return;
  told_ = percent;
  std::fprintf(stderr, is_terminal_ ? "\r%s: %d %%" : "%s: %d %%\n", what_.c_str(), percent);
  std::fflush(stderr);
}

void ProgressLine::say(std::string_view text) {
  clear();
  std::fprintf(stderr, "%s: %.*s\n", what_.c_str(), static_cast<int>(text.size()), text.data());
  std::fflush(stderr);
  if (is_terminal_) told_ = -1;  // drawn again with the next step
}

}  // namespace fstop::server
