// Time against error of the ways to a round pupil's point spread and OTF, and where each fails.
// Writes CSV files that the scripts beside this file (psf_*.gp) draw.
//
//   psf_methods FOLDER
//
// Errors are the largest over a profile of 512 points, v up to 1.5 |U| + 30 or s up to 2, against
// quadratures in long double; times are the median of five profiles in processor time of one
// thread.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/bench/psf_method.h"
#include "tests/bench/psf_reference.h"
#include "tests/bench/thread_timer.h"

namespace fstop {
namespace {

constexpr std::size_t kPoints = 512;
constexpr int kRuns = 5;
constexpr std::size_t kMapCells = 48;       // along each side of a stability map
constexpr double kPeakInFocus = 0.25;       // |G(0, 0)|^2
constexpr double kWorstShown = 1e99;        // what infinity and NaN are written as
constexpr double kLeastShown = 1e-17;       // and a difference of 0, for logarithmic axes
constexpr double kLargestMapRadius = 2000;  // v
constexpr double kSmallestMapRadius = 0.1;

double defocus_of_fresnel_number(double n) { return 2.0 * std::numbers::pi * n; }
double fresnel_number(double U) { return U / (2.0 * std::numbers::pi); }
double waves(double U) { return U / (4.0 * std::numbers::pi); }

// The middles of `count` equal parts of (0, end).
std::vector<double> middles(double end, std::size_t count) {
  std::vector<double> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back(end * (static_cast<double>(i) + 0.5) / static_cast<double>(count));
  }
  return points;
}

// `count` values from `first` to `last` in equal ratios.
std::vector<double> in_equal_ratios(double first, double last, std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(count - 1);
    values.push_back(first * std::pow(last / first, share));
  }
  return values;
}

// |G|^2 or the OTF: its methods, its truth, where it is looked at.
struct Quantity {
  std::string name = {};
  std::vector<PsfMethod> methods = {};
  std::function<double(double at, double defocus)> truth;
  double full_scale = 1.0;
  std::function<std::vector<double>(double defocus)> profile_points;
  std::vector<double> map_points = {};
};

// The truth at one U, each point computed once.
class Truth {
 public:
  Truth(const Quantity& quantity, double U) : quantity_(quantity), defocus_(U) {}

  double operator()(double at) {
    const auto [entry, is_new] = known_.try_emplace(at, 0.0);
    if (is_new) entry->second = quantity_.truth(at, defocus_);
    return entry->second;
  }
  double peak() {
    double largest = 0.0;
    for (const double at : quantity_.profile_points(defocus_)) {
      largest = std::max(largest, std::abs((*this)(at)));
    }
    return largest;
  }

 private:
  const Quantity& quantity_;
  double defocus_;
  std::map<double, double> known_ = {};
};

std::vector<double> answers(const PsfMethod& method, double U, const std::vector<double>& at) {
  std::vector<double> result(at.size());
  method.profile(U, at, result);
  return result;
}

// |answer - truth| at each point, at the method's own nearest point where it has such.
std::vector<double> differences(const PsfMethod& method, double U, std::vector<double> at,
                                Truth& truth) {
  for (double& point : at) point = method.nearest(point);
  std::vector<double> result = answers(method, U, at);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double difference = std::abs(result[i] - truth(at[i]));
    result[i] = std::isfinite(difference) ? std::min(difference, kWorstShown) : kWorstShown;
  }
  return result;
}

double shown(double error) { return std::clamp(error, kLeastShown, kWorstShown); }

std::ofstream opened(const std::filesystem::path& path, const std::string& header) {
  std::ofstream file(path);
  if (!file) throw std::runtime_error("cannot write " + path.string());
  file.precision(6);
  file << header << '\n';
  return file;
}

struct ErrorOfProfile {
  double in_focus = 0.0;  // over the peak in focus, or the OTF's 1
  double of_peak = 0.0;   // over the profile's own peak
};

ErrorOfProfile profile_error(const Quantity& quantity, const PsfMethod& method, double U,
                             Truth& truth) {
  const double largest =
      std::ranges::max(differences(method, U, quantity.profile_points(U), truth));
  return {shown(largest / quantity.full_scale), shown(largest / truth.peak())};
}

// Rows of one method follow each other, so that a plot can join them.
void write_errors(std::ofstream& file, const std::string& sweep, const Quantity& quantity,
                  const std::vector<double>& defocus) {
  std::map<std::string, std::string> rows;
  for (const double U : defocus) {
    Truth truth(quantity, U);
    for (const PsfMethod& method : quantity.methods) {
      if (U == 0.0 && method.needs_defocus) continue;
      const ErrorOfProfile error = profile_error(quantity, method, U, truth);
      char row[256];
      std::snprintf(row, sizeof row, "%s;%s;%s;%.6g;%.6g;%.4g;%.4g\n", sweep.c_str(),
                    quantity.name.c_str(), method.name.c_str(), fresnel_number(U), waves(U),
                    error.in_focus, error.of_peak);
      rows[method.name] += row;
    }
  }
  for (const PsfMethod& method : quantity.methods) file << rows[method.name];
}

void write_times(std::ofstream& file, const Quantity& quantity,
                 const std::vector<double>& defocus) {
  for (const double U : defocus) {
    Truth truth(quantity, U);
    for (const PsfMethod& method : quantity.methods) {
      const ErrorOfProfile error = profile_error(quantity, method, U, truth);
      const std::vector<double> at = quantity.profile_points(U);
      std::vector<double> result(at.size());
      const Timing time = seconds_of([&] { method.profile(U, at, result); }, kRuns);
      char row[256];
      std::snprintf(row, sizeof row, "%s;%s;%.6g;%.6g;%.4g;%.4g\n", quantity.name.c_str(),
                    method.name.c_str(), fresnel_number(U), waves(U), time.median * 1e3,
                    error.in_focus);
      file << row;
    }
  }
}

// One line a cell: U's Fresnel number, v or s, then the error of every method over the profile's
// own peak.
void write_map(const std::filesystem::path& path, const Quantity& quantity,
               const std::vector<double>& defocus) {
  std::string header = "fresnel_number;at";
  for (const PsfMethod& method : quantity.methods) header += ";" + method.name;
  std::ofstream file = opened(path, header);
  file.precision(3);
  for (const double U : defocus) {
    Truth truth(quantity, U);
    const double peak = truth.peak();
    std::vector<std::vector<double>> columns;
    for (const PsfMethod& method : quantity.methods) {
      columns.push_back(differences(method, U, quantity.map_points, truth));
    }
    for (std::size_t i = 0; i < quantity.map_points.size(); ++i) {
      file << fresnel_number(U) << ';' << quantity.map_points[i];
      for (const auto& column : columns) file << ';' << shown(column[i] / peak);
      file << '\n';
    }
  }
}

// How far the truth moves when its nodes are doubled, over full scale.
double doubt(const Quantity& quantity, PsfReference& reference,
             const std::vector<double>& defocus) {
  double largest = 0.0;
  for (const double U : defocus) {
    const std::vector<double> points = quantity.profile_points(U);
    for (std::size_t i = 0; i < points.size(); i += 16) {
      const double value = quantity.truth(points[i], U);
      reference.set_refinement(2);
      largest = std::max(largest, std::abs(value - quantity.truth(points[i], U)));
      reference.set_refinement(1);
    }
  }
  return largest / quantity.full_scale;
}

std::vector<Quantity> quantities(PsfReference& reference) {
  return {{.name = "psf",
           .methods = intensity_methods(),
           .truth = [&reference](double v, double U) { return reference.intensity(v, U); },
           .full_scale = kPeakInFocus,
           .profile_points = [](double U) { return middles(1.5 * std::abs(U) + 30.0, kPoints); },
           .map_points = in_equal_ratios(kSmallestMapRadius, kLargestMapRadius, kMapCells)},
          {.name = "otf",
           .methods = otf_methods(),
           .truth = [&reference](double s, double U) { return reference.otf(s, U); },
           .full_scale = 1.0,
           .profile_points = [](double) { return middles(2.0, kPoints); },
           .map_points = middles(2.0, kMapCells)}};
}

std::vector<double> pinhole_sweep() {
  std::vector<double> values = in_equal_ratios(0.01, 100.0, 33);
  std::ranges::transform(values, values.begin(), defocus_of_fresnel_number);
  return values;
}

// 0 to 20 waves; a wave is two Fresnel zones.
std::vector<double> lens_sweep() {
  std::vector<double> values;
  for (int i = 0; i <= 50; ++i) values.push_back(defocus_of_fresnel_number(0.8 * i));
  return values;
}

// Fresnel numbers 0.01 to 100 of pinholes and 0.1 to 20 waves of lenses.
std::vector<double> timed() {
  std::vector<double> values;
  for (const double n : {0.01, 0.1, 0.2, 0.7, 1.0, 2.0, 10.0, 40.0, 100.0}) {
    values.push_back(defocus_of_fresnel_number(n));
  }
  return values;
}

void measure(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  PsfReference reference;
  std::ofstream errors = opened(folder / "psf_errors.csv",
                                "sweep;quantity;method;fresnel_number;waves;error;error_of_peak");
  std::ofstream times =
      opened(folder / "psf_times.csv", "quantity;method;fresnel_number;waves;milliseconds;error");
  std::vector<double> map_defocus = in_equal_ratios(0.01, 100.0, kMapCells);
  std::ranges::transform(map_defocus, map_defocus.begin(), defocus_of_fresnel_number);
  for (const Quantity& quantity : quantities(reference)) {
    const double start = thread_seconds();
    std::printf("%s: doubling the reference's nodes moves it by %.1e of full scale\n",
                quantity.name.c_str(), doubt(quantity, reference, timed()));
    write_times(times, quantity, timed());
    write_errors(errors, "pinhole", quantity, pinhole_sweep());
    write_errors(errors, "lens", quantity, lens_sweep());
    write_map(folder / (quantity.name + "_map.csv"), quantity, map_defocus);
    std::printf("%s: measured in %.1f s\n", quantity.name.c_str(), thread_seconds() - start);
  }
}

}  // namespace
}  // namespace fstop

int main(int count, char** arguments) {
  if (count != 2) {
    std::fprintf(stderr, "usage: psf_methods FOLDER\n");
    return 2;
  }
  try {
    fstop::measure(arguments[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "psf_methods: %s\n", error.what());
    return 1;
  }
  return 0;
}
