#include "core/optics/pinhole_figures.h"

#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/optics/pinhole.h"
#include "tests/references/oracle.h"

namespace fstop {
namespace {

// The fixture's names for the criteria.
const std::map<std::string, std::string> kCriterionOfMetric = {
    {"peak_incident_normalised", "brightest"},
    {"peak_energy_normalised", "peak-per-energy"},
    {"ee50_radius", "energy50"},
    {"ee80_radius", "energy80"},
    {"mtf50", "mtf50"},
    {"mtf10", "mtf10"},
    {"area_abs_mtf_1d", "line-spread"},
    {"fwhm", "fwhm"},
};
constexpr std::string_view kWindowedRms = "rms_window_";  // and the window's width

// "25 mm, 450 nm": f' and lambda.
Length optimal_diameter_for(const std::string& key, double c) {
  const double f = std::stod(key);
  const double nm = std::stod(key.substr(key.find(',') + 1));
  return optimal_pinhole_diameter(Length::si(f / 1e3), Length::si(nm / 1e9), c);
}

// The fixture's statement: c to 1e-5, values to 1e-9 relative (the area under the MTF 1e-5).
TEST(PinholeFigures, AgreeWithEveryRowOfTheFixture) {
  const nlohmann::json table = oracle::fixture("pinhole_optimum");
  ASSERT_FALSE(table.at("rows").empty());
  for (const nlohmann::json& row : table.at("rows")) {
    const std::string metric = row.at("metric");
    const double c = row.at("c");
    EXPECT_NEAR(0.25 * c * c, oracle::number(row.at("N_F")), 1e-12);
    for (const auto& [key, diameter] : row.at("d_mm").items()) {
      EXPECT_LE(oracle::relative_difference(optimal_diameter_for(key, c).si() * 1e3, diameter),
                1e-12)
          << metric << " " << key;
    }
    const double relative = metric == "area_abs_mtf_1d" ? 1e-5 : 1e-9;
    const auto expect_values = [&](auto&& value_at) {
      for (const auto& [at, column] : {std::pair{c, "value"},
                                       {2.0, "value_at_c_2"},
                                       {1.9, "value_at_c_1_9"},
                                       {std::numbers::sqrt2, "value_at_c_1_414"}}) {
        EXPECT_LE(oracle::relative_difference(value_at(at), row.at(column)), relative)
            << metric << " at c = " << at;
      }
    };
    if (metric.starts_with(kWindowedRms)) {
      const double window = std::stod(metric.substr(kWindowedRms.size()));
      const auto radius = [window](double at) { return windowed_rms_radius(at, window); };
      expect_values(radius);
      // Its optimum in the same sense as the others': no smaller value on either side.
      EXPECT_LT(radius(c), radius(c - 1e-5) + 1e-15);
      EXPECT_LT(radius(c), radius(c + 1e-5) + 1e-15);
      continue;
    }
    ASSERT_TRUE(kCriterionOfMetric.contains(metric)) << "a metric that no test reads: " << metric;
    const PinholeFigure figure = pinhole_figure(kCriterionOfMetric.at(metric)).value();
    EXPECT_EQ(larger_is_better(figure), row.at("sense") == "max");
    EXPECT_NEAR(best_coefficient(figure), c, 1e-5) << metric;
    expect_values([figure](double at) { return figure_value(figure, at); });
  }
}

// The table of criteria: 0.001 for the coefficients that it gives with four digits.
TEST(PinholeFigures, ConfirmTheTableOfCriteria) {
  int confirmed = 0;
  for (const PinholeCriterion& criterion : pinhole_criteria()) {
    const std::optional<PinholeFigure> figure = pinhole_figure(criterion.name);
    if (!figure) {
      EXPECT_TRUE(criterion.name == "rayleigh" || criterion.name == "petzval") << criterion.name;
      continue;
    }
    ++confirmed;
    EXPECT_NEAR(best_coefficient(*figure), criterion.coefficient, 0.001) << criterion.name;
  }
  EXPECT_EQ(confirmed, 8);
}

// Closed forms: 4 sin^2(pi c^2/8) on the axis; peak per energy is that over the hole's area pi
// c^2/4.
TEST(PinholeFigures, HaveTheirClosedForms) {
  for (const double c : {0.1, 0.9, 1.7, 2.0, 2.7, 8.0}) {
    const double axis = 4.0 * std::pow(std::sin(std::numbers::pi * c * c / 8.0), 2);
    EXPECT_NEAR(figure_value(PinholeFigure::brightest, c), axis, 1e-12) << c;
    EXPECT_NEAR(figure_value(PinholeFigure::peak_per_energy, c),
                axis / (0.25 * std::numbers::pi * c * c), 1e-12)
        << c;
  }
  // A small hole is Airy's: frequencies grow with it, radii shrink.
  EXPECT_NEAR(figure_value(PinholeFigure::mtf50, 0.02) / figure_value(PinholeFigure::mtf50, 0.01),
              2.0, 1e-6);
  EXPECT_NEAR(figure_value(PinholeFigure::fwhm, 0.01) * 0.01, 1.02899, 1e-5);
}

TEST(PinholeFigures, RefuseWhatIsOutsideTheirDomain) {
  for (const double bad : {0.0, -1.0, 20.1, std::nan("")}) {
    EXPECT_THROW(figure_value(PinholeFigure::mtf50, bad), Error);
    EXPECT_THROW(windowed_rms_radius(bad, 1.0), Error);
  }
  EXPECT_THROW(windowed_rms_radius(1.0, 0.0), Error);
  EXPECT_THROW(figure_value(PinholeFigure::fwhm, 2.0 * std::numbers::sqrt2), Error);
  EXPECT_FALSE(pinhole_figure("sharpest"));
}

}  // namespace
}  // namespace fstop
