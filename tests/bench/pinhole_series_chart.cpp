// The pinhole series: one target through holes of 2 to 0.05 mm, rendered, measured, and compared
// with theory. Writes series.csv, theory.csv and series.png into a folder;
// tests/bench/pinhole_series.gp draws series.svg from the numbers.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "api/limits.h"
#include "api/scene_assets.h"
#include "api/scene_json.h"
#include "api/scene_store.h"
#include "core/encode/image_codec.h"
#include "core/error.h"
#include "core/study/pinhole_series.h"

namespace {

using namespace fstop;
namespace fs = std::filesystem;

const std::vector<double> kShownMillimetres = {2.0, 1.0, 0.6, 0.35, 0.15, 0.07};
const std::vector<double> kBetweenMillimetres = {1.4, 0.8,   0.45,  0.3, 0.26, 0.23,
                                                 0.2, 0.175, 0.125, 0.1, 0.05};
constexpr int kCurvePoints = 200;

struct Options {
  fs::path folder = {};
  fs::path scenes = FSTOP_SOURCE_DIR "/core/scenes";
  int width = 960;
  int height = 640;
  bool rays = false;  // diffraction left out: the curve's geometric branch alone
};

PinholeSeriesSpec series_spec(const Options& options) {
  PinholeSeriesSpec spec;
  spec.shot.width = options.width;
  spec.shot.height = options.height;
  spec.shot.quality.max_error = 0.003;
  spec.shot.effects.defocus = EffectChoice::on;
  spec.shot.effects.diffraction = options.rays ? EffectChoice::off : EffectChoice::on;
  std::vector<double> all = kShownMillimetres;
  all.insert(all.end(), kBetweenMillimetres.begin(), kBetweenMillimetres.end());
  std::ranges::sort(all, std::greater());
  for (const double d : all) spec.diameters.push_back(Length::si(d / 1e3));
  return spec;
}

double per_millimetre(Vergence frequency) { return frequency.si() / 1e3; }

void write_rows(const Options& options, const std::vector<PinholePicture>& series) {
  std::ofstream file(options.folder / "series.csv");
  file << "diameter_mm;fresnel_number;method;error_upper_95";
  for (const char* channel : {"red", "green", "blue"}) {
    for (const char* what : {"mtf50", "mtf50_theory", "mtf10", "mtf10_theory"}) {
      file << ";" << channel << "_" << what;
    }
  }
  file << "\n";
  char text[64];
  for (const PinholePicture& picture : series) {
    std::snprintf(text, sizeof text, "%.4g;%.4g;", picture.diameter.si() * 1e3,
                  picture.fresnel_number);
    file << text << picture.photograph.report.method;
    std::snprintf(text, sizeof text, ";%.2g", picture.photograph.report.error.upper_95);
    file << text;
    for (std::size_t c = 0; c < 3; ++c) {
      std::snprintf(
          text, sizeof text, ";%.4g;%.4g;%.4g;%.4g", per_millimetre(picture.measured[c].mtf50),
          per_millimetre(picture.theory[c].mtf50), per_millimetre(picture.measured[c].mtf10),
          per_millimetre(picture.theory[c].mtf10));
      file << text;
    }
    file << "\n";
  }
}

void write_theory(const Options& options, const PinholeSeriesSpec& spec) {
  std::ofstream file(options.folder / "theory.csv");
  file << "diameter_mm;mtf50;mtf10\n";
  for (int i = 0; i < kCurvePoints; ++i) {
    const double d = 0.045e-3 * std::pow(2.2e-3 / 0.045e-3, i / (kCurvePoints - 1.0));
    const PinholeResolution green = theoretical_resolution(spec, Length::si(d), 1);
    char text[64];
    std::snprintf(text, sizeof text, "%.5g;%.5g;%.5g\n", d * 1e3, per_millimetre(green.mtf50),
                  per_millimetre(green.mtf10));
    file << text;
  }
}

// Six pictures of half size, 3 x 2, each above its hole's diameter. Averages linear values.
Image contact_sheet(const std::vector<PinholePicture>& series) {
  constexpr int kCaption = 30;
  constexpr int kGap = 6;
  const int width = series.front().photograph.color.width() / 2;
  const int height = series.front().photograph.color.height() / 2;
  cv::Mat sheet(2 * (height + kCaption) + kGap, 3 * width + 2 * kGap, CV_32FC3,
                cv::Scalar::all(1.0));
  for (std::size_t k = 0; k < kShownMillimetres.size(); ++k) {
    const auto shown = std::ranges::find_if(series, [&](const PinholePicture& picture) {
      return std::abs(picture.diameter.si() * 1e3 - kShownMillimetres[k]) < 1e-9;
    });
    Image color = shown->photograph.color;
    const cv::Mat full(color.height(), color.width(), CV_32FC3, color.pixels().data());
    const int left = static_cast<int>(k % 3) * (width + kGap);
    const int top = static_cast<int>(k / 3) * (height + kCaption + kGap);
    cv::resize(full, sheet(cv::Rect(left, top, width, height)), {width, height}, 0, 0,
               cv::INTER_AREA);
    char caption[32];
    std::snprintf(caption, sizeof caption, "%g mm", kShownMillimetres[k]);
    cv::putText(sheet, caption, {left + 4, top + height + 22}, cv::FONT_HERSHEY_SIMPLEX, 0.7,
                cv::Scalar::all(0.0), 1, cv::LINE_AA);
  }
  Image image(sheet.cols, sheet.rows, 3);
  const cv::Mat target(sheet.rows, sheet.cols, CV_32FC3, image.pixels().data());
  sheet.copyTo(target);
  return image;
}

void write_sheet(const Options& options, const std::vector<PinholePicture>& series) {
  const Picture picture{
      .layers = {{.channel_names = {"R", "G", "B"}, .image = contact_sheet(series)}}};
  const std::vector<std::byte> bytes = encode(picture, ImageFormat::png);
  std::ofstream file(options.folder / "series.png", std::ios::binary);
  for (const std::byte byte : bytes) file.put(static_cast<char>(byte));
}

void print_rows(const std::vector<PinholePicture>& series) {
  std::printf("%8s %8s %-14s %21s %21s\n", "d mm", "N_F", "method", "mtf50 (theory) /mm",
              "star 10 % (theory)");
  for (const PinholePicture& p : series) {
    std::printf("%8.3f %8.3f %-14s %9.3f (%9.3f) %9.3f (%9.3f)\n", p.diameter.si() * 1e3,
                p.fresnel_number, p.photograph.report.method.c_str(),
                per_millimetre(p.measured[1].mtf50), per_millimetre(p.theory[1].mtf50),
                per_millimetre(p.measured[1].mtf10), per_millimetre(p.theory[1].mtf10));
  }
}

Scene target_scene(const Options& options) {
  const api::Limits limits;
  const api::SceneStore store({options.scenes}, limits);
  return api::load_scene(api::parse_scene_text(store.text("pinhole-series"), limits),
                         folder_assets(store.folder_of("pinhole-series"), limits.assets), "#",
                         limits)
      .scene;
}

int run(const Options& options) {
  fs::create_directories(options.folder);
  const RayScene scene(target_scene(options));
  WorkerPool workers(0);
  RunControl control;
  control.workers = &workers;
  const PinholeSeriesSpec spec = series_spec(options);
  const std::vector<PinholePicture> series = pinhole_series(spec, scene, control);
  write_rows(options, series);
  write_theory(options, spec);
  write_sheet(options, series);
  print_rows(series);
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i];
    if (argument == "--rays") {
      options.rays = true;
    } else if (argument == "--small") {
      options.width = 480;
      options.height = 320;
    } else {
      options.folder = argument;
    }
  }
  if (options.folder.empty()) {
    std::fprintf(stderr, "usage: pinhole_series_chart FOLDER [--rays] [--small]\n");
    return 2;
  }
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pinhole_series_chart: %s\n", error.what());
    return 1;
  }
}
