#include "server/chunk_scanner.h"

#include <algorithm>
#include <string>

#include "server/bad_framing.h"

namespace fstop::server {
namespace {

constexpr std::size_t kMaxLineBytes = 16384;
constexpr std::size_t kMaxSizeDigits = 16;  // 64 bit

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// Of a line: every octet but the controls, of which only the tab may be there.
bool is_of_line(char c) {
  const auto octet = static_cast<unsigned char>(c);
  return c == '\t' || (octet >= 0x20 && octet != 0x7F);
}

}  // namespace

std::size_t ChunkScanner::judge(std::string_view bytes) {
  std::size_t position = 0;
  while (position < bytes.size() && place_ != Place::done) {
    if (place_ == Place::data) {
      const std::uint64_t taken = std::min<std::uint64_t>(size_, bytes.size() - position);
      size_ -= taken;
      if (size_ == 0) place_ = Place::data_cr;
      return position + static_cast<std::size_t>(taken);
    }
    const char c = bytes[position++];
    switch (place_) {
      case Place::size:
        judge_size(c);
        break;
      case Place::extension:
      case Place::quoted:
      case Place::escaped:
        judge_extension(c);
        break;
      case Place::line_feed:
        if (c != '\n') throw bad_framing("a chunk's line ends with CR LF");
        end_line();
        if (place_ == Place::data) return position;
        break;
      case Place::data_cr:
        expect(c, '\r', Place::data_lf);
        break;
      case Place::data_lf:
        expect(c, '\n', Place::size);
        break;
      case Place::last_cr:
        if (c != '\r') throw bad_framing("trailer fields are not accepted");
        place_ = Place::last_lf;
        break;
      case Place::last_lf:
        if (c != '\n') throw bad_framing("a body of chunks ends with CR LF");
        place_ = Place::done;
        break;
      case Place::data:
      case Place::done:
        break;
    }
  }
  return position;
}

bool ChunkScanner::lines_are_whole() const {
  return place_ == Place::data || place_ == Place::data_cr || place_ == Place::done;
}

void ChunkScanner::judge_size(char c) {
  const int digit = hex_value(c);
  if (digit < 0) {
    const bool may_follow = c == '\r' || c == ';' || c == ' ' || c == '\t';
    if (digits_ == 0 || !may_follow) throw bad_framing("a chunk's size is a hexadecimal number");
    place_ = Place::extension;
    return judge_extension(c);
  }
  if (++digits_ > kMaxSizeDigits) throw bad_framing("a chunk's size has too many digits");
  size_ = size_ * 16 + static_cast<std::uint64_t>(digit);
}

void ChunkScanner::judge_extension(char c) {
  if (++line_bytes_ > kMaxLineBytes) throw bad_framing("a chunk's line is too long");
  if (c == '\r') {
    if (place_ != Place::extension) throw bad_framing("a chunk's line ends within quotes");
    place_ = Place::line_feed;
    return;
  }
  if (!is_of_line(c)) throw bad_framing("a control character in a chunk's line");
  if (place_ == Place::escaped) {
    place_ = Place::quoted;
  } else if (c == '"') {
    place_ = place_ == Place::quoted ? Place::extension : Place::quoted;
  } else if (c == '\\' && place_ == Place::quoted) {
    place_ = Place::escaped;
  }
}

void ChunkScanner::end_line() {
  place_ = size_ == 0 ? Place::last_cr : Place::data;
  digits_ = 0;
  line_bytes_ = 0;
}

void ChunkScanner::expect(char c, char expected, Place next) {
  if (c != expected) throw bad_framing("a chunk is longer than its size says");
  place_ = next;
}

}  // namespace fstop::server
