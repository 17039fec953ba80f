// Held against independent references, on random scenes and cameras: the error that reports tell,
// and what the planner's choice costs beside the cheapest method that meets the target.
#include "tests/methods/calibration.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

// calibration FOLDER [CASES [FIRST [THREADS]]]: tables to standard output, FOLDER/calibration.csv.
int main(int count, char** words) {
  const auto number = [&](int i, int otherwise) {
    return count > i ? std::atoi(words[i]) : otherwise;
  };
  const std::filesystem::path folder = count > 1 ? words[1] : "build/bench";
  const int cases = number(2, 300);
  std::filesystem::create_directories(folder);
  std::ofstream csv(folder / "calibration.csv");
  fstop::write_csv_names(csv);
  const std::vector<fstop::CalibrationCase> done = fstop::calibrated(
      static_cast<std::uint32_t>(number(3, 1)), cases, number(4, 2), {.all_methods = true},
      [&](const fstop::CalibrationCase& one) { fstop::write_csv(csv, one); });
  fstop::print_calibration(std::cout, done);
  fstop::print_choices(std::cout, done);
  return csv ? 0 : 1;
}
