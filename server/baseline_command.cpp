#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "api/baseline_record.h"
#include "api/chart_photograph.h"
#include "api/render_id.h"
#include "api/render_request.h"
#include "core/error.h"
#include "server/commands.h"

namespace fstop::server {
namespace {

namespace fs = std::filesystem;

void print(const std::string& text) {
  std::cout << text << std::flush;
  if (!std::cout) throw Error(ErrorCode::io_failure, "cannot write to standard output");
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

/// A request file, read: its baseline is called like it.
struct BaselineCase {
  std::string name = {};
  std::string folder = {};
  api::RenderRequest request = {};
};

std::vector<BaselineCase> cases_of(const BaselineOptions& options) {
  const api::Limits limits = api::command_line_limits();
  std::vector<BaselineCase> cases;
  for (const std::string& file : options.requests) {
    BaselineCase one{.name = fs::path(file).stem().string(),
                     .folder = fs::absolute(file).parent_path().string()};
    one.request = api::parse_render_request(text_of(file, limits.body_bytes), limits,
                                            api::SceneNames::stored_or_files);
    if (one.request.spec.quality.max_time_ms) {
      throw Error(ErrorCode::unsupported,
                  file + ": a render with max_time_ms differs from run to run; it has no baseline");
    }
    const auto same = [&](const BaselineCase& other) { return other.name == one.name; };
    if (std::ranges::any_of(cases, same))
      throw Error(ErrorCode::invalid_request, "two requests are called " + one.name);
    cases.push_back(std::move(one));
  }
  return cases;
}

fs::path file_of(const BaselineOptions& options, const BaselineCase& one, const char* ending) {
  return fs::path(options.baselines) / (one.name + ending);
}

struct StoredBaseline {
  api::BaselineRecord record = {};
  ImageBaseline image = {};
};

std::optional<StoredBaseline> stored(const BaselineOptions& options, const BaselineCase& one) {
  const api::Limits limits = api::command_line_limits();
  const fs::path record = file_of(options, one, ".json");
  if (!fs::exists(record)) return std::nullopt;
  StoredBaseline baseline{
      .record = api::parse_baseline_record(text_of(record.string(), limits.body_bytes), limits)};
  const std::string file =
      text_of(file_of(options, one, ".exr").string(), limits.assets.max_file_bytes);
  baseline.image = api::baseline_of(bytes_of(file), baseline.record);
  return baseline;
}

double largest_deviation(const BaselineVerdict& verdict) {
  double largest = 0.0;
  for (const BaselineLevel& level : verdict.levels) largest = std::max(largest, level.largest);
  return largest;
}

// Against the old baseline, as if the new mean were a picture: far more even than one is.
std::optional<api::BaselineChange> change_from(const std::optional<StoredBaseline>& old,
                                               const ImageBaseline& image, double alarm_rate) {
  if (!old || old->image.mean.width() != image.mean.width() ||
      old->image.mean.height() != image.mean.height()) {
    return std::nullopt;
  }
  const BaselineVerdict verdict = compared(image.mean, old->image, alarm_rate);
  return api::BaselineChange{.rmse = verdict.rmse,
                             .largest_deviation = largest_deviation(verdict),
                             .brightness = verdict.brightness};
}

ImageBaseline photographed(const BaselineOptions& options, const BaselineCase& one,
                           const PictureSource& pictures) {
  BaselineBuilder builder;
  for (int i = 0; i < options.replicates; ++i) {
    const std::string request = api::request_with_seed(
        one.request.normalised, api::replicate_seed(one.request.spec.seed, i));
    builder.add(pictures(request, one.folder));
  }
  return builder.finish();
}

std::string level_text(const BaselineLevel& level) {
  std::string text = level.name + ": |t| up to " + number(level.largest);
  if (level.name != "picture") {
    text += " at column " + std::to_string(level.x) + ", row " + std::to_string(level.y);
  }
  return text + " of " + number(level.threshold) + " in " + std::to_string(level.tests) +
         " tests, " + std::to_string(level.alarms) + " beyond";
}

// Result, baseline and deviation of a picture that differs.
void write_evidence(const BaselineOptions& options, const BaselineCase& one, const Image& picture,
                    const ImageBaseline& baseline) {
  if (options.out.empty()) return;
  fs::create_directories(options.out);
  const auto write = [&](const char* ending, const Image& image) {
    const auto bytes = encode({.layers = {{{"R", "G", "B"}, image}}}, ImageFormat::exr);
    write_file((fs::path(options.out) / (one.name + ending)).string(),
               {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  };
  write(".result.exr", picture);
  write(".baseline.exr", baseline.mean);
  write(".deviation.exr", deviation_image(picture, baseline));
}

bool check_one(const BaselineOptions& options, const BaselineCase& one,
               const PictureSource& pictures) {
  const std::optional<StoredBaseline> baseline = stored(options, one);
  if (!baseline) {
    print("red: " + one.name + ": has no baseline in " + options.baselines +
          "; fstop baseline accept makes one\n");
    return false;
  }
  if (one.request.normalised != baseline->record.request) {
    print("red: " + one.name + ": the request is another than the one that was accepted\n");
    return false;
  }
  const Image picture =
      pictures(api::request_with_seed(one.request.normalised, one.request.spec.seed), one.folder);
  const BaselineVerdict verdict = compared(picture, baseline->image, options.alarm_rate);
  std::string text = std::string(verdict.differs() ? "red: " : "green: ") + one.name +
                     ": root mean square difference " + number(verdict.rmse) + ", by noise alone " +
                     number(verdict.expected_rmse) + ", brightness " +
                     number(verdict.brightness[0]) + " " + number(verdict.brightness[1]) + " " +
                     number(verdict.brightness[2]) + "\n";
  for (const BaselineLevel& level : verdict.levels) text += "  " + level_text(level) + "\n";
  print(text);
  if (verdict.differs()) write_evidence(options, one, picture, baseline->image);
  return !verdict.differs();
}

}  // namespace

int baseline_accept(const BaselineOptions& options) {
  const std::vector<BaselineCase> cases = cases_of(options);
  const PictureSource pictures = picture_source(options.source);
  fs::create_directories(options.baselines);
  for (const BaselineCase& one : cases) {
    const std::optional<StoredBaseline> old = stored(options, one);
    const ImageBaseline image = photographed(options, one, pictures);
    const std::vector<std::byte> file = api::baseline_file(image);
    api::BaselineRecord record{.request = one.request.normalised,
                               .image_sha256 = api::sha256_hex(file),
                               .replicates = image.replicates,
                               .total = image.total,
                               .total_variance = image.total_variance};
    record.accepted.push_back({.who = options.who,
                               .why = options.why,
                               .engine = std::string(api::engine_version()),
                               .change = change_from(old, image, options.alarm_rate)});
    if (old) {
      record.accepted.insert(record.accepted.end(), old->record.accepted.begin(),
                             old->record.accepted.end());
    }
    write_file(file_of(options, one, ".exr").string(),
               {reinterpret_cast<const char*>(file.data()), file.size()});
    write_file(file_of(options, one, ".json").string(), api::baseline_record_json(record) + "\n");
    const auto& change = record.accepted.front().change;
    print("accepted: " + one.name + ": " + std::to_string(image.replicates) + " replicates, " +
          (change ? "root mean square change " + number(change->rmse) + ", |t| up to " +
                        number(change->largest_deviation)
                  : std::string("the first of its kind")) +
          "\n");
  }
  return 0;
}

int baseline_check(const BaselineOptions& options) {
  const std::vector<BaselineCase> cases = cases_of(options);
  const PictureSource pictures = picture_source(options.source);
  int red = 0;
  for (const BaselineCase& one : cases) red += check_one(options, one, pictures) ? 0 : 1;
  print(std::to_string(cases.size()) + " pictures, " + std::to_string(red) +
        " red; chance of a false alarm for each that is unchanged: " + number(options.alarm_rate) +
        "\n");
  return red == 0 ? 0 : 1;
}

}  // namespace fstop::server
