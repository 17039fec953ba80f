#include "server/command_line.h"

#include <csignal>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "api/limits.h"
#include "api/problem.h"
#include "api/render_id.h"
#include "core/error.h"
#include "server/commands.h"
#include "server/config_file.h"

namespace fstop::server {
namespace {

// CLI11's own name their upper end, in 300 digits.
CLI::Validator at_least(double least, bool or_equal, const std::string& words) {
  const auto fault = [least, or_equal, words](const std::string& text) -> std::string {
    double value = 0.0;
    const bool is_number = CLI::detail::lexical_cast(text, value);
    if (is_number && (value > least || (or_equal && value == least))) return {};
    return "must be a " + words + ", not " + text;
  };
  return CLI::Validator(fault, "");
}
CLI::Validator not_negative() { return at_least(0.0, true, "number of at least 0"); }
CLI::Validator not_empty() {
  const auto fault = [](const std::string& text) -> std::string {
    return text.empty() ? "must not be empty" : "";
  };
  return CLI::Validator(fault, "");
}
CLI::Validator positive() { return at_least(0.0, false, "number above 0"); }

constexpr int kFailed = 1;
constexpr int kRefused = 2;
constexpr const char* kSplitHelp =
    "predicted processor time above which many workers of the queue make one cell; 0: never";

struct CommandLine {
  CLI::App app{"fstop: simulates what a camera's optics do to light", "fstop"};
  ServeOptions serve = {};
  RenderOptions render = {};
  PsfOptions psf = {};
  ChartOptions chart = {};
  SweepOptions sweep = {};
  DatasetOptions dataset = {};
  VerifyOptions verify = {};
  BaselineOptions baseline = {};
  CompositeOptions composite = {};
  ProbeOptions probe = {};
  SignOptions sign = {};
  QueueWorkerOptions worker = {};
  std::string scene_name = {};
  std::string color_space = {};
  std::string channels = {};
  std::string optics_request = "-";
  CLI::App* serve_command = nullptr;
  CLI::App* render_command = nullptr;
  CLI::App* optics_command = nullptr;
  CLI::App* psf_command = nullptr;
  CLI::App* chart_command = nullptr;
  CLI::App* sweep_command = nullptr;
  CLI::App* dataset_command = nullptr;
  CLI::App* verify_command = nullptr;
  CLI::App* accept_command = nullptr;
  CLI::App* check_command = nullptr;
  CLI::App* composite_command = nullptr;
  CLI::App* probe_command = nullptr;
  CLI::App* read_scene_command = nullptr;
  CLI::App* read_image_command = nullptr;
  CLI::App* sign_command = nullptr;
  CLI::App* worker_command = nullptr;
  CLI::App* version_command = nullptr;
};

// The options of `command` without their dashes, which may stand in a file or the environment.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_single_name();
    if (name != "help" && name != "config") names.push_back(name);
  }
  return names;
}

void add_serve(CommandLine& line) {
  ServeOptions& options = line.serve;
  CLI::App* command = line.app.add_subcommand("serve", "answer HTTP requests");
  command->add_option("--port", options.port, "0 takes any free one")->capture_default_str();
  command
      ->add_option("--address", options.address,
                   "where to listen; beyond loopback a token file must be given")
      ->capture_default_str();
  command->add_option("--token-file", options.token_file,
                      "file whose first line, 16 or more characters, calls under /v1 must bear");
  command->add_option("--data-dir", options.data_dir, "folder with scenes of your own in scenes/");
  command->add_option("--threads", options.threads, "that render; 0: one for each processor")
      ->capture_default_str();
  command->add_option("--log-file", options.log_file, "instead of standard error");
  command->add_option("--port-file", options.port_file, "holds the port while the server listens");
  command->add_option("--web-root", options.web_root, "folder of the web page");
  command->add_option("--scenes-dir", options.scenes_dir, "instead of the bundled scenes");
  command->add_option("--url-key-file", options.url_key_file,
                      "file whose first line signs URLs that need no token (fstop sign)");
  command
      ->add_option("--allow-host", options.hosts,
                   "further names that requests may call this server, comma-separated")
      ->delimiter(',');
  command
      ->add_option("--cors-origin", options.origins,
                   "origins whose pages may use this server, comma-separated")
      ->delimiter(',');
  command->add_option("--probe-port", options.probe_port,
                      "port of its own, on loopback, for /livez, /readyz, /metrics; 0: any free");
  command->add_option("--probe-port-file", options.probe_port_file,
                      "holds that port while the server listens");
  command->add_option("--concurrent-renders", options.concurrent_renders, "that run at once")
      ->capture_default_str();
  command->add_option("--queued-renders", options.queued_renders, "that wait; more are refused")
      ->capture_default_str();
  command
      ->add_option("--synchronous-s", options.synchronous_s,
                   "until a render becomes a job, unless the client says Prefer: wait=N")
      ->capture_default_str();
  command->add_option("--drain-s", options.drain_s, "that SIGTERM gives to what was admitted")
      ->capture_default_str();
  command->add_option("--cache-mib", options.cache_mib, "of results, in the data directory")
      ->capture_default_str();
  command->add_option("--queue", options.queue,
                      "nats://host[:port] of a JetStream server: sweeps are made by fstop worker");
  command->add_option(
      "--ack-wait-s", options.ack_wait_s,
      "that a worker of the queue may be silent before its cell goes to another; 30 "
      "where nobody has said");
  command->add_option("--split-cpu-s", options.split_cpu_s, kSplitHelp)->capture_default_str();
  command->add_option("--memory-mib", options.memory_mib, "of results, in memory")
      ->capture_default_str();
  for (const std::string& name : option_names(*command))
    command->get_option("--" + name)->envname(variable_of(name));
  command
      ->add_option("--config", options.config_file,
                   "file of lines \"name = value\", names as above; flags and environment "
                   "variables such as FSTOP_DATA_DIR go before it")
      ->envname("FSTOP_CONFIG");
  line.serve_command = command;
}

void add_render(CommandLine& line) {
  RenderOptions& options = line.render;
  CLI::App* command = line.app.add_subcommand("render", "make one image");
  command->add_option("request", options.request, "a render request, - for standard input")
      ->required();
  command->add_option("--out", options.out, "image file: .png .jpg .webp .tif .exr")->required();
  command->add_option("--report", options.report, "file for the report, else standard output");
  command->add_option("--threads", options.threads, "that render; 0: one for each processor")
      ->capture_default_str()
      ->check(not_negative());
  command->add_option("--scenes-dir", options.scenes_dir, "instead of the bundled scenes");
  line.render_command = command;
}

void add_composite(CommandLine& line) {
  CompositeOptions& options = line.composite;
  CLI::App* command = line.app.add_subcommand("composite", "put renders and pictures together");
  command->add_option("request", options.request, "a composite request, - for standard input")
      ->required();
  command->add_option("--out", options.out, "image file: .png .jpg .webp .tif .exr")->required();
  command->add_option("--report", options.report, "file for the report, else standard output");
  command->add_option("--threads", options.threads, "that render; 0: one for each processor")
      ->capture_default_str()
      ->check(not_negative());
  command->add_option("--scenes-dir", options.scenes_dir, "instead of the bundled scenes");
  line.composite_command = command;
}

void add_chart(CommandLine& line) {
  ChartOptions& options = line.chart;
  CLI::App* command =
      line.app.add_subcommand("chart", "speed against accuracy of all methods on one scene");
  command->add_option("request", options.request, "a chart request, - for standard input")
      ->required();
  command->add_option("--out", options.out, "file for the drawing (.svg) or the numbers (.json)");
  command->add_option("--threads", options.threads, "that render; 0: one for each processor")
      ->capture_default_str()
      ->check(not_negative());
  command->add_option("--scenes-dir", options.scenes_dir, "instead of the bundled scenes");
  command->add_flag("--progress", options.progress,
                    "tell progress on standard error; to a terminal it is always told");
  line.chart_command = command;
}

void add_worker(CommandLine& line) {
  QueueWorkerOptions& options = line.worker;
  CLI::App* command =
      line.app.add_subcommand("worker", "make cells of sweeps that servers put into a queue");
  command->add_option("--queue", options.queue, "of fstop serve --queue: nats://host[:port]")
      ->required();
  command->add_option("--results", options.results, "where files go: http://host[:port]")
      ->required();
  command->add_option("--token-file", options.token_file, "as of the server of the results");
  command->add_option("--threads", options.threads, "that render; 0: one for each processor")
      ->capture_default_str();
  command->add_option("--scenes-dir", options.scenes_dir, "instead of the bundled scenes");
  command
      ->add_option("--attempts", options.attempts, "at one cell, before it is recorded as failed")
      ->capture_default_str();
  command->add_option("--drain-s", options.drain_s, "that SIGTERM gives to the cell in hand")
      ->capture_default_str();
  command->add_option("--log-file", options.log_file, "instead of standard error");
  for (const std::string& name : option_names(*command))
    command->get_option("--" + name)->envname(variable_of(name));
  line.worker_command = command;
}

void add_sweep_options(CLI::App* command, SweepOptions& options) {
  command->add_option("--out", options.out, "folder for files, state and manifest.json");
  command->add_flag("--resume", options.resume, "refuse unless the folder holds this sweep");
  command->add_flag("--dry-run", options.dry_run, "tell cells and predicted cost, make nothing");
  command->add_option("--threads", options.threads, "that render; 0: one for each processor")
      ->capture_default_str()
      ->check(not_negative());
  command->add_option("--scenes,--scenes-dir", options.scenes_dir, "instead of the bundled scenes");
  command->add_option("--queue", options.remote.queue,
                      "nats://host[:port]: made by fstop worker there, instead of here");
  command->add_option("--results", options.remote.results, "of those workers: http://host[:port]");
  command->add_option("--token-file", options.remote.token_file, "of that server");
  command->add_option("--split-cpu-s", options.remote.split_cpu_s, kSplitHelp)
      ->capture_default_str();
}

void add_sweep(CommandLine& line) {
  line.sweep_command = line.app.add_subcommand(
      "sweep", "many renders over ranges of any member; run again, it goes on where it ended");
  line.sweep_command
      ->add_option("request", line.sweep.request, "a sweep request, - for standard input")
      ->required();
  add_sweep_options(line.sweep_command, line.sweep);
  DatasetOptions& options = line.dataset;
  line.dataset_command =
      line.app.add_subcommand("dataset", "images of scenes at random, with depth and blur");
  line.dataset_command->add_option("--count", options.count, "images")
      ->required()
      ->check(positive());
  line.dataset_command->add_option("--seed", options.seed, "of scenes, cameras and noise")
      ->capture_default_str();
  line.dataset_command
      ->add_option("--images-per-scene", options.images_per_scene,
                   "that differ in focus and aperture alone")
      ->capture_default_str();
  line.dataset_command->add_option("--base", options.base,
                                   "file with image, quality, effects and outputs of a request");
  add_sweep_options(line.dataset_command, options.sweep);
}

void add_source(CLI::App* command, PictureSourceOptions& options) {
  command->add_option("--server", options.server,
                      "URL of the fstop server that renders, else this program");
  command->add_option("--token-file", options.token_file, "file with the server's token");
  command->add_option("--threads", options.threads, "that render here; 0: one for each processor")
      ->capture_default_str()
      ->check(not_negative());
  command->add_option("--scenes-dir", options.scenes_dir, "instead of the bundled scenes");
}

void add_verify(CommandLine& line) {
  VerifyOptions& options = line.verify;
  CLI::App* command = line.app.add_subcommand(
      "verify", "measure finished pictures of test charts against closed forms");
  add_source(command, options.source);
  command->add_option("--suite", options.suite, "a suite of checks, else the bundled one");
  command->add_option("--junit", options.junit, "file for JUnit XML");
  command->add_option("--report", options.report, "file for a report in HTML");
  command->add_flag("--self-test", options.self_test,
                    "plant errors of 1 % as well, each of which must be caught");
  command->add_flag("--print-suite", options.print_suite, "print the bundled suite alone");
  command->add_flag("--print-schema", options.print_schema,
                    "print the JSON schema of suites alone");
  line.verify_command = command;
}

void add_baseline_options(CLI::App* command, BaselineOptions& options) {
  command->add_option("requests", options.requests, "render requests, files")->required();
  command->add_option("--baselines", options.baselines, "folder of baselines")->required();
  add_source(command, options.source);
}

void add_baseline(CommandLine& line) {
  BaselineOptions& options = line.baseline;
  CLI::App* command =
      line.app.add_subcommand("baseline", "compare pictures with accepted ones, noise apart");
  command->require_subcommand(1);
  line.accept_command = command->add_subcommand("accept", "accept what is rendered now");
  add_baseline_options(line.accept_command, options);
  line.accept_command->add_option("--who", options.who, "accepts it")
      ->required()
      ->check(not_empty());
  line.accept_command->add_option("--why", options.why, "it is accepted")->required();
  line.accept_command
      ->add_option("--replicates", options.replicates, "of other seeds, that tell the noise")
      ->capture_default_str()
      ->check(CLI::Range(4, 256));
  line.check_command = command->add_subcommand("check", "fail where pictures have changed");
  add_baseline_options(line.check_command, options);
  line.check_command
      ->add_option("--alarm-rate", options.alarm_rate,
                   "chance that an unchanged picture is called changed")
      ->capture_default_str()
      ->check(CLI::Range(1e-9, 0.5));
  line.check_command->add_option("--out", options.out,
                                 "folder for result, baseline and deviation where they differ");
}

void add_commands(CommandLine& line) {
  line.app.require_subcommand(1);
  add_serve(line);
  add_render(line);
  line.optics_command = line.app.add_subcommand("optics", "the numbers of a camera");
  line.optics_command->add_option("request", line.optics_request,
                                  "an optics request, - for standard input");
  line.psf_command = line.app.add_subcommand("psf", "the image of a point");
  line.psf_command->add_option("request", line.psf.request, "a psf request, - for standard input");
  line.psf_command->add_option("--out", line.psf.out,
                               "image file: .exr .tif (density), .png .jpg .webp (stretched)");
  add_chart(line);
  add_worker(line);
  add_sweep(line);
  add_verify(line);
  add_baseline(line);
  add_composite(line);
  line.probe_command = line.app.add_subcommand("probe", "succeed if a server is ready");
  line.probe_command->add_option("--port", line.probe.port, "of the server")->capture_default_str();
  line.probe_command->add_option("--address", line.probe.address, "of the server")
      ->capture_default_str();
  line.sign_command = line.app.add_subcommand("sign", "a URL that needs no token for a while");
  line.sign_command->add_option("target", line.sign.target, "path and query, /v1/renders/...")
      ->required();
  line.sign_command->add_option("--url-key-file", line.sign.url_key_file, "as of fstop serve")
      ->required();
  line.sign_command->add_option("--valid-s", line.sign.valid_s, "seconds from now")
      ->capture_default_str()
      ->check(positive());
  line.read_scene_command = line.app.add_subcommand("read-scene", "what the server runs apart");
  line.read_scene_command->group("");  // of no use by hand
  line.read_scene_command->add_option("name", line.scene_name, "of the scene")->required();
  line.read_image_command = line.app.add_subcommand("read-image", "what the server runs apart");
  line.read_image_command->group("");
  line.read_image_command->add_option("color-space", line.color_space, "srgb or linear")
      ->required();
  line.read_image_command->add_option("channels", line.channels, "color-alone or with-alpha")
      ->required();
  line.version_command = line.app.add_subcommand("version", "print the version");
}

int run_command(const CommandLine& line) {
  if (line.serve_command->parsed()) return serve(line.serve);
  if (line.render_command->parsed()) return render(line.render);
  if (line.optics_command->parsed()) return optics(line.optics_request);
  if (line.psf_command->parsed()) return psf(line.psf);
  if (line.chart_command->parsed()) return chart(line.chart);
  if (line.sweep_command->parsed()) return sweep(line.sweep);
  if (line.dataset_command->parsed()) return dataset(line.dataset);
  if (line.verify_command->parsed()) return verify(line.verify);
  if (line.accept_command->parsed()) return baseline_accept(line.baseline);
  if (line.check_command->parsed()) return baseline_check(line.baseline);
  if (line.composite_command->parsed()) return composite(line.composite);
  if (line.probe_command->parsed()) return probe(line.probe);
  if (line.read_scene_command->parsed()) return read_scene(line.scene_name);
  if (line.read_image_command->parsed()) return read_image(line.color_space, line.channels);
  if (line.sign_command->parsed()) return sign(line.sign);
  if (line.worker_command->parsed()) return queue_worker(line.worker);
  std::cout << api::engine_version() << '\n';
  return 0;
}

// The file is read before the options are: it stands for environment variables.
std::string config_file(int argc, char** argv) {
  constexpr std::string_view kOption = "--config";
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == kOption && i + 1 < argc) return argv[i + 1];
    if (argument.starts_with("--config=")) return std::string(argument.substr(kOption.size() + 1));
  }
  const char* variable = std::getenv("FSTOP_CONFIG");
  return variable == nullptr ? std::string() : std::string(variable);
}

int print_problem(const api::Problem& problem) {
  std::cout << api::to_json(problem) << '\n' << std::flush;
  return problem.status < 500 ? kRefused : kFailed;
}

}  // namespace

int run_command_line(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond its bound is an error as others
  try {
    CommandLine line;
    add_commands(line);
    const bool serves = argc > 1 && std::string_view(argv[1]) == "serve";
    if (const std::string file = serves ? config_file(argc, argv) : std::string(); !file.empty())
      apply_config_file(file, option_names(*line.serve_command));
    try {
      line.app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      const bool asked_for_help = line.app.exit(error) == 0;
      if (asked_for_help) return 0;
      return print_problem(api::http_problem(400, "bad-arguments", error.what()));
    }
    return run_command(line);
  } catch (const std::exception& exception) {
    api::Problem problem = api::problem(exception);
    if (problem.status == 500) {
      // Here the user is the operator: he is told the cause, which a client must not see.
      const auto* error = dynamic_cast<const Error*>(&exception);
      const bool is_io = error != nullptr && error->code() == ErrorCode::io_failure;
      problem =
          api::http_problem(problem.status, is_io ? "io-failure" : "internal",
                            api::shortened(exception.what(), api::Limits{}.problem_bytes / 2));
    }
    if (problem.status >= 500) std::cerr << "fstop: " << exception.what() << '\n';
    return print_problem(problem);
  }
}

}  // namespace fstop::server
