#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace fstop::server {

/// Judges the framing of a chunked body (RFC 9112 7.1) before Beast's parser sees it, so that both
/// end a chunk's line at the same byte: CR LF alone ends it, and a quoted string within it.
/// Trailer fields are refused. What an extension says is left to Beast.
class ChunkScanner {
 public:
  /// `bytes`: the next of the body, whose earlier ones are judged. Judges up to where a chunk's
  /// data begin, up to the end of what has come of them, or of the body; returns how many, at
  /// least one while the body goes on. Throws: Refusal 400, closing.
  std::size_t judge(std::string_view bytes);

  /// Whether all lines that have begun have ended.
  bool lines_are_whole() const;

 private:
  enum class Place {
    size,       // hexadecimal digits
    extension,  // behind them
    quoted,
    escaped,  // behind a backslash in quotes
    line_feed,
    data,
    data_cr,
    data_lf,
    last_cr,  // of the empty line that ends the body
    last_lf,
    done
  };

  void judge_size(char c);
  void judge_extension(char c);
  void end_line();
  void expect(char c, char expected, Place next);

  Place place_ = Place::size;
  std::uint64_t size_ = 0;  // of this chunk; in its data: what is left of it
  std::size_t digits_ = 0;
  std::size_t line_bytes_ = 0;
};

}  // namespace fstop::server
