#include <algorithm>
#include <cstdio>
#include <map>
#include <ostream>

#include "tests/methods/calibration.h"

namespace fstop {
namespace {

template <typename... Values>
std::string text(const char* format, Values... values) {
  char line[400];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

void print_row(std::ostream& out, const std::string& name,
               const std::vector<CalibrationCase>& cases) {
  const CalibrationSummary s = summary_of(cases);
  out << text("%-22s %5d  %6.1f %%  %6.1f %%  %6.2f  %6.2f\n", name.c_str(), s.cases,
              100.0 * s.held, 100.0 * s.over_target, s.median_ratio, s.mean_used);
}

std::string target_band(double target) {
  if (target < 0.006) return "target 0.003 to 0.006";
  if (target < 0.012) return "target 0.006 to 0.012";
  return target < 0.025 ? "target 0.012 to 0.025" : "target 0.025 to 0.05";
}

void print_worst(std::ostream& out, std::vector<const CalibrationCase*> cases, const char* title) {
  if (cases.empty()) return;
  out << title << '\n';
  for (const CalibrationCase* c : cases) {
    const MethodTrial& t = c->chosen;
    out << text(
        "  seed %4u  %-14s target %.4f  true %.4f +- %.4f  estimate %.4f  bound %.4f%s  %s\n",
        c->seed, t.method.c_str(), c->target, t.truth.rmse, t.truth.scatter, t.told.estimate,
        t.told.upper_95, t.finite ? "" : "  NOT FINITE", c->what.c_str());
  }
}

template <typename Chosen>
std::vector<const CalibrationCase*> those(const std::vector<CalibrationCase>& cases,
                                          const Chosen& chosen) {
  std::vector<const CalibrationCase*> result;
  for (const CalibrationCase& c : cases) {
    if (chosen(c)) result.push_back(&c);
  }
  return result;
}

void write_trial(std::ostream& out, const CalibrationCase& c, const MethodTrial& t,
                 const char* asked) {
  out << text("%u,%s,%s,%.6g,%.6g,%.6g,%.6g,%.6g,%llu,%.6g,%.6g,%d,", c.seed, asked,
              t.method.c_str(), c.target, t.truth.rmse, t.truth.scatter, t.told.estimate,
              t.told.upper_95, static_cast<unsigned long long>(t.rays), t.cpu_seconds,
              c.reference_noise, c.reference_samples)
      << '"' << c.what << "\",\"" << t.passed_over << "\"\n";
}

}  // namespace

void print_calibration(std::ostream& out, const std::vector<CalibrationCase>& cases) {
  out << "                       cases   bound     over    median    mean\n"
         "                               holds    target  est/true  true/target\n";
  std::map<std::string, std::vector<CalibrationCase>> by_target;
  std::map<std::string, std::vector<CalibrationCase>> by_method;
  for (const CalibrationCase& c : cases) {
    by_target[target_band(c.target)].push_back(c);
    by_method[c.chosen.method].push_back(c);
  }
  for (const auto& [name, part] : by_target) print_row(out, name, part);
  for (const auto& [name, part] : by_method) print_row(out, name, part);
  print_row(out, "all", cases);
  out << "not resolved by the references: " << summary_of(cases).unresolved << '\n';
  const auto resolved = [](const CalibrationCase& c) { return c.resolved(); };
  print_worst(out, those(cases, [&](const auto& c) { return resolved(c) && !c.chosen.holds(); }),
              "true error above the bound:");
  print_worst(out,
              those(cases, [&](const auto& c) { return resolved(c) && !c.chosen.meets_target(); }),
              "true error above the target:");
  print_worst(
      out,
      those(cases,
            [&](const auto& c) { return resolved(c) && c.chosen.truth.rmse < 0.2 * c.target; }),
      "true error below a fifth of the target:");
}

void print_choices(std::ostream& out, const std::vector<CalibrationCase>& cases) {
  const ChoiceSummary s = choices_of(cases);
  out << text(
      "the planner's choice costs at most 1.3 times the cheapest that meets the target: %.1f %% of "
      "%d cases by rays, %.1f %% by processor time (at worst %.2f times); no method met it in %d\n",
      100.0 * s.good_by_rays, s.cases, 100.0 * s.good_by_time, s.worst_by_time, s.missed);
  for (const CalibrationCase& c : cases) {
    if (!c.resolved()) continue;
    for (const MethodTrial& t : c.methods) {
      if (!t.passed_over.empty()) continue;
      const bool cheaper = t.meets_target() &&
                           static_cast<double>(c.chosen.rays) > 1.3 * static_cast<double>(t.rays);
      if (t.holds() && !cheaper) continue;
      out << text(
          "  seed %4u  %s: %-14s true %.4f of %.4f, bound %.4f, %.3g rays, %.3g s; chosen: "
          "%s, %.3g rays, %.3g s  %s\n",
          c.seed, t.holds() ? "cheaper" : "BOUND BROKEN", t.method.c_str(), t.truth.rmse, c.target,
          t.told.upper_95, static_cast<double>(t.rays), t.cpu_seconds, c.chosen.method.c_str(),
          static_cast<double>(c.chosen.rays), c.chosen.cpu_seconds, c.what.c_str());
    }
  }
}

void write_csv_names(std::ostream& out) {
  out << "seed,asked,method,target,true,scatter,estimate,upper_95,rays,cpu_s,reference_noise,"
         "reference_samples,what,passed_over\n";
}

void write_csv(std::ostream& out, const CalibrationCase& one) {
  write_trial(out, one, one.chosen, "auto");
  for (const MethodTrial& t : one.methods) write_trial(out, one, t, t.method.c_str());
  out.flush();
}

}  // namespace fstop
