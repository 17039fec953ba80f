#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/encode/image_codec.h"
#include "server/config.h"

namespace fstop::server {

struct RenderOptions {
  std::string request = {};  // a file, or "-" for standard input
  std::string out = {};      // its extension names the format
  std::string report = {};   // empty: the report goes to standard output
  std::string scenes_dir = {};
  int threads = 0;
};

struct PsfOptions {
  std::string request = "-";  // a file, or "-" for standard input
  std::string out = {};       // empty: no image
};

struct ChartOptions {
  std::string request = {};  // a file, or "-" for standard input
  std::string out = {};      // .svg or .json; empty: no file
  std::string scenes_dir = {};
  int threads = 0;
  bool progress = false;  // told on standard error even where that is no terminal
};

struct CompositeOptions {
  std::string request = {};  // a file, or "-" for standard input
  std::string out = {};
  std::string report = {};  // empty: standard output
  std::string scenes_dir = {};
  int threads = 0;
};

struct ProbeOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;
};

struct SignOptions {
  std::string target = {};  // path and query
  std::string url_key_file = {};
  std::int64_t valid_s = 3600;
};

// Each returns the exit code of its command. Throws: Error.
int serve(const ServeOptions& options);
int render(const RenderOptions& options);
/// `request`: a file, or "-" for standard input.
int optics(const std::string& request);
/// Prints the numbers; writes the image where one is asked for.
int psf(const PsfOptions& options);
/// Writes the composite's image; prints its report or writes it.
int composite(const CompositeOptions& options);
/// Prints the chart's numbers; writes the drawing where one is asked for. SIGINT and SIGTERM stop
/// it.
int chart(const ChartOptions& options);
/// 0 if the server on that port is ready.
int probe(const ProbeOptions& options);
/// Locks itself in, reads a scene archive on standard input and prints what is to be stored: what
/// the server runs apart from itself. Throws: as api::read_upload.
int read_scene(const std::string& name);
/// The same for a picture ("srgb" or "linear") of which the "color-alone" is wanted or that
/// "with-alpha": prints its pixels. Throws: as api::read_sent_image.
int read_image(const std::string& color_space, const std::string& channels);
/// Prints the target with its signature.
int sign(const SignOptions& options);

/// What a file's name says of its format: a format's name, or one of the usual short forms; nothing
/// where it has no suffix. Throws: Error{unsupported}.
std::optional<ImageFormat> format_of_name(const std::filesystem::path& file);
/// Throws: as write_file.
void write_image(const std::string& file, const std::vector<std::byte>& bytes);
/// A line on standard output. Throws: Error{io_failure}.
void print_line(const std::string& text);

/// All of a file, or of standard input for "-".
/// Throws: Error{not_found, over_budget, io_failure}.
std::string text_of(const std::string& file, std::size_t max_bytes);

/// Writes the whole file or, on failure, nothing: through a file beside it that is then renamed.
/// Throws: Error{io_failure}.
void write_file(const std::string& file, std::string_view bytes);

/// The same for what must outlive a crash: its name is flushed, too.
/// Throws: Refusal 507 where there is no room, else Error{io_failure}.
void write_durably(const std::string& file, std::string_view bytes);

}  // namespace fstop::server
