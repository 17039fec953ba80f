#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/picture.h"
#include "server/config.h"
#include "server/picture_source.h"

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

/// Where cells are made by workers elsewhere.
struct RemotePlace {
  std::string queue = {};       // nats://...; empty: they are made here
  std::string results = {};     // http://..., where the workers put files
  std::string token_file = {};  // of that server; empty for none
  double split_cpu_s = kSplitCpuSeconds;
};

struct SweepOptions {
  std::string request = {};  // a file, or "-" for standard input
  std::string out = {};      // a folder
  std::string scenes_dir = {};
  int threads = 0;
  bool resume = false;   // `out` must hold this sweep already
  bool dry_run = false;  // tells what it would cost
  RemotePlace remote = {};
};

struct DatasetOptions {
  std::uint32_t count = 1;
  std::uint32_t seed = 0;
  std::uint32_t images_per_scene = 1;
  std::string base = {};    // a file with image, quality, outputs; empty: the recipe's own
  SweepOptions sweep = {};  // all but the request
};

struct VerifyOptions {
  PictureSourceOptions source = {};
  std::string suite = {};   // a file; empty: the bundled suite
  std::string junit = {};   // empty: no file
  std::string report = {};  // HTML; empty: no file
  bool self_test = false;   // plants errors, too
  bool print_suite = false;
  bool print_schema = false;
};

struct BaselineOptions {
  PictureSourceOptions source = {};
  std::vector<std::string> requests = {};  // files
  std::string baselines = {};              // a folder
  std::string who = {};
  std::string why = {};
  std::string out = {};  // a folder for pictures that differ; empty: none
  int replicates = 16;
  double alarm_rate = 0.01;  // of each picture
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

/// Of a process that makes cells of sweeps for servers elsewhere.
struct QueueWorkerOptions {
  std::string queue = {};    // nats://...
  std::string results = {};  // http://...
  std::string token_file = {};
  std::string scenes_dir = {};  // empty: the bundled scenes
  std::string log_file = {};    // empty: standard error
  int threads = 0;
  int attempts = 5;       // at one cell
  double drain_s = 20.0;  // that SIGTERM gives to the cell in hand
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
/// Makes every render of a sweep's request, in a folder with a manifest; what is there already is
/// kept. Prints what was done; 1 if some cells failed. SIGINT and SIGTERM stop it.
int sweep(const SweepOptions& options);
/// The same of the recipe `defocus-dataset`.
int dataset(const DatasetOptions& options);
/// Prints every result; 1 if one is red or a planted error is not caught.
int verify(const VerifyOptions& options);
/// Renders each request's replicates and keeps what they look like.
int baseline_accept(const BaselineOptions& options);
/// Prints how each request's picture compares with its baseline; 1 if one differs.
int baseline_check(const BaselineOptions& options);
/// 0 if the server on that port is ready.
int probe(const ProbeOptions& options);
/// Makes cells of a queue until a signal stops it.
int queue_worker(const QueueWorkerOptions& options);
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
