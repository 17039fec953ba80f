#include <algorithm>
#include <cstdio>
#include <iostream>
#include <string>
#include <unistd.h>
#include <vector>

#include "api/chart_photograph.h"
#include "api/render_id.h"
#include "api/verify_suite.h"
#include "core/error.h"
#include "server/commands.h"

namespace fstop::server {
namespace {

void print(const std::string& text) {
  std::cout << text << std::flush;
  if (!std::cout) throw Error(ErrorCode::io_failure, "cannot write to standard output");
}

int results_of(const std::vector<VerificationOutcome>& outcomes, bool red_alone) {
  int count = 0;
  for (const VerificationOutcome& outcome : outcomes) {
    count += static_cast<int>(std::ranges::count_if(
        outcome.results, [&](const auto& result) { return !red_alone || !result.holds(); }));
    if (red_alone && !outcome.failure.empty()) ++count;
  }
  return count;
}

/// Progress of trials, in place, on a terminal.
class TrialProgress {
 public:
  ~TrialProgress() {
    if (is_terminal_) std::fputs("\r\033[K", stderr);
  }
  void tell(double share) const {
    if (is_terminal_) std::fprintf(stderr, "\rplanted errors: %.0f %%", 100.0 * share);
  }

 private:
  bool is_terminal_ = ::isatty(STDERR_FILENO) == 1;
};

}  // namespace

int verify(const VerifyOptions& options) {
  if (options.print_suite || options.print_schema) {
    print(std::string(options.print_suite ? api::default_suite_json() : api::suite_schema_json()));
    return 0;
  }
  const api::Limits limits = api::command_line_limits();
  const api::VerifySuite suite =
      api::parse_verify_suite(options.suite.empty() ? std::string(api::default_suite_json())
                                                    : text_of(options.suite, limits.body_bytes),
                              limits);
  const PictureSource pictures = picture_source(options.source);
  const Photographer photographer = [&](const ChartShot& shot) {
    return pictures(api::chart_request_text(shot), ".");
  };
  std::vector<VerificationOutcome> outcomes;
  bool is_cut = false;  // the reports hold what there is, and why there is no more
  for (const VerificationCheck& check : suite.checks) {
    try {
      outcomes.push_back(verified(check, photographer));
    } catch (const Error& error) {
      outcomes.push_back({.check = check.name,
                          .kind = check.kind,
                          .camera = check.camera_name,
                          .failure = error.what()});
      is_cut = true;
      std::cerr << "fstop: " << error.what() << '\n';
    }
    print(verification_text(outcomes.back()));
    if (is_cut) break;
  }
  std::vector<PlantedTrial> trials;
  if (options.self_test && !is_cut) {
    const TrialProgress progress;
    trials = planted_trials(suite.checks, 0.01, photographer,
                            [&](double share) { progress.tell(share); });
  }
  for (const PlantedTrial& trial : trials) print(trial_text(trial));
  const VerificationHeading heading{.suite = suite.title,
                                    .target = source_name(options.source),
                                    .engine = std::string(api::engine_version())};
  if (!options.junit.empty())
    write_file(options.junit, verification_junit(heading, outcomes, trials));
  if (!options.report.empty())
    write_file(options.report, verification_html(heading, outcomes, trials));
  const int red = results_of(outcomes, true);
  const auto missed = std::ranges::count_if(trials, [](const auto& t) { return !t.is_caught(); });
  print(std::to_string(results_of(outcomes, false)) + " results, " + std::to_string(red) + " red" +
        (trials.empty() ? std::string()
                        : "; " + std::to_string(trials.size()) + " planted errors, " +
                              std::to_string(missed) + " not caught") +
        "\n");
  return red == 0 && missed == 0 ? 0 : 1;
}

}  // namespace fstop::server
