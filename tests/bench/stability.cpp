// Where each method holds its bound and where it fails, as a table and a map.
#include "tests/methods/stability.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

// stability FOLDER [WIDTH [MAX_ERROR]]: FOLDER/stability.svg and .csv, a table to standard output.
int main(int count, char** words) {
  const std::filesystem::path folder = count > 1 ? words[1] : "build/bench";
  const int width = count > 2 ? std::atoi(words[2]) : 96;
  const double max_error = count > 3 ? std::atof(words[3]) : 0.01;
  const std::vector<fstop::StabilityCell> cells =
      fstop::stability_cells(fstop::stability_regimes(width, max_error), 4096, 0);
  fstop::print_stability(std::cout, cells);
  std::filesystem::create_directories(folder);
  std::ofstream csv(folder / "stability.csv");
  fstop::write_stability_csv(csv, cells);
  std::ofstream svg(folder / "stability.svg");
  fstop::write_stability_svg(svg, cells);
  return csv && svg ? 0 : 1;
}
