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
  std::vector<fstop::StabilityCell> cells;
  for (const fstop::Regime& regime : fstop::stability_regimes(width, max_error)) {
    const std::vector<fstop::StabilityCell> some = fstop::stability_cells(regime, 4096, 0);
    fstop::print_stability(std::cout, some);
    std::cout.flush();
    cells.insert(cells.end(), some.begin(), some.end());
  }
  std::filesystem::create_directories(folder);
  std::ofstream csv(folder / "stability.csv");
  fstop::write_stability_csv(csv, cells);
  std::ofstream svg(folder / "stability.svg");
  fstop::write_stability_svg(svg, cells);
  return csv && svg ? 0 : 1;
}
