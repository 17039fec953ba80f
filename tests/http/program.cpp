#include "tests/http/program.h"

#include <csignal>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/http/http_client.h"
#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;

int exit_code_of(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Starts the program with the three standard streams on files (empty: inherited).
pid_t start(const std::vector<std::string>& arguments, const std::string& input,
            const std::string& output, const std::string& errors) {
  std::vector<char*> argv = {const_cast<char*>(FSTOP_PROGRAM)};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t process = ::fork();
  if (process != 0) return process;
  const auto redirect = [](const std::string& file, int flags, int descriptor) {
    if (!file.empty()) ::dup2(::open(file.c_str(), flags, 0600), descriptor);
  };
  redirect(input, O_RDONLY, STDIN_FILENO);
  redirect(output, O_WRONLY | O_CREAT | O_TRUNC, STDOUT_FILENO);
  redirect(errors, O_WRONLY | O_CREAT | O_TRUNC, STDERR_FILENO);
  ::execv(argv.front(), argv.data());
  ::_exit(127);
}

}  // namespace

Outcome run_fstop(const std::vector<std::string>& arguments, const std::string& input) {
  const TemporaryFolder folder;
  folder.write("input", input);
  const std::string path = folder.path().string();
  const pid_t process = start(arguments, path + "/input", path + "/output", path + "/errors");
  int status = 0;
  ::waitpid(process, &status, 0);
  return {exit_code_of(status), text_of_file(path + "/output"), text_of_file(path + "/errors")};
}

Outcome run_fstop_until(const std::vector<std::string>& arguments, const std::string& text,
                        int number) {
  const TemporaryFolder folder;
  const std::string path = folder.path().string();
  const pid_t process = start(arguments, "/dev/null", path + "/output", path + "/errors");
  const auto has_said = [&] {
    return text_of_file(path + "/errors").find(text) != std::string::npos;
  };
  if (!eventually(has_said)) number = SIGKILL;
  ::kill(process, number);
  int status = 0;
  ::waitpid(process, &status, 0);
  return {exit_code_of(status), text_of_file(path + "/output"), text_of_file(path + "/errors")};
}

RunningProgram::RunningProgram(const std::vector<std::string>& arguments,
                               std::optional<std::uint64_t> file_bytes) {
  std::string pattern = (fs::temp_directory_path() / "fstop-run-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
  folder_ = pattern;
  // The child inherits the bound.
  rlimit before = {};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit bound{.rlim_cur = file_bytes.value_or(before.rlim_cur), .rlim_max = before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &bound);
  process_ = start(arguments, "/dev/null", folder_ / "output", folder_ / "errors");
  ::setrlimit(RLIMIT_FSIZE, &before);
}

RunningProgram::~RunningProgram() {
  if (process_ > 0) {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void RunningProgram::signal(int number) const { ::kill(process_, number); }

void RunningProgram::grant_space() const {
  rlimit now = {};
  ::getrlimit(RLIMIT_FSIZE, &now);
  ::prlimit(process_, RLIMIT_FSIZE, &now, nullptr);
}

std::string RunningProgram::errors() const { return text_of_file(folder_ / "errors"); }

Outcome RunningProgram::wait() {
  int status = 0;
  ::waitpid(process_, &status, 0);
  process_ = -1;
  return {exit_code_of(status), text_of_file(folder_ / "output"), errors()};
}

ServerProcess::ServerProcess(const fs::path& folder, const std::vector<std::string>& arguments,
                             std::uint16_t port)
    : folder_(folder) {
  const std::string port_file = (folder / "port").string();
  fs::remove(port_file);  // of one that was killed
  std::vector<std::string> all = {"serve", "--port", std::to_string(port), "--port-file",
                                  port_file};
  all.insert(all.end(), arguments.begin(), arguments.end());
  process_ = start(all, "/dev/null", "", (folder / "log").string());
  const bool is_ready = eventually([&] {
    std::ifstream file(port_file);
    return static_cast<bool>(file >> port_) && ask(port_, "GET", "/readyz").status == 200;
  });
  if (!is_ready) throw std::runtime_error("fstop serve did not become ready: " + log_text());
}

ServerProcess::~ServerProcess() {
  if (process_ <= 0) return;
  ::kill(process_, SIGKILL);
  wait();
}

void ServerProcess::signal(int number) const { ::kill(process_, number); }

int ServerProcess::wait() {
  int status = 0;
  ::waitpid(process_, &status, 0);
  process_ = -1;
  return exit_code_of(status);
}

std::string ServerProcess::log_text() const { return text_of_file(folder_ / "log"); }

int ServerProcess::open_descriptors() const {
  const fs::path folder = "/proc/" + std::to_string(process_) + "/fd";
  return static_cast<int>(std::distance(fs::directory_iterator(folder), {}));
}

}  // namespace fstop::test
