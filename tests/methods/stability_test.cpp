// Every method at the corners of what may be asked for: finite pixels, bounds held, refusals in
// words. `./dev bench stability` draws the same with larger pictures.
#include "tests/methods/stability.h"

#include <iostream>

#include <gtest/gtest.h>

namespace fstop {
namespace {

TEST(Stability, EveryMethodHoldsItsBoundOrRefusesInEveryRegime) {
  std::vector<StabilityCell> cells;
  for (const Regime& regime : stability_regimes(48, 0.03)) {
    const std::vector<StabilityCell> some = stability_cells(regime, 1024, 2);
    print_stability(std::cout, some);
    std::cout << std::flush;
    cells.insert(cells.end(), some.begin(), some.end());
  }
  int told = 0;
  for (const StabilityCell& cell : cells) {
    const std::string where = cell.regime + ", " + cell.method;
    EXPECT_NE(cell.verdict, Verdict::failed) << where << ": " << cell.note;
    EXPECT_NE(cell.verdict, Verdict::not_finite) << where;
    EXPECT_NE(cell.verdict, Verdict::broken)
        << where << ": true error " << cell.true_error << ", bound " << cell.bound;
    if (cell.verdict == Verdict::refused) {
      EXPECT_GT(cell.note.size(), 20U) << where;
    }
    told += cell.verdict == Verdict::held || cell.verdict == Verdict::over ? 1 : 0;
    // With diffraction off there is always a method of rays.
    if (cell.method == "auto") {
      EXPECT_NE(cell.verdict, Verdict::refused) << where << cell.note;
    }
  }
  EXPECT_GE(told, 2 * static_cast<int>(cells.size()) / 3);
}

}  // namespace
}  // namespace fstop
