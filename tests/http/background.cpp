#include "tests/http/background.h"

#include <csignal>
#include <fcntl.h>
#include <netinet/in.h>
#include <stdexcept>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/http/test_server.h"

namespace fstop::test {
namespace {

namespace fs = std::filesystem;

int exit_code_of(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

bool can_connect(std::uint16_t port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool is_there =
      ::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  ::close(socket);
  return is_there;
}

}  // namespace

BackgroundProcess BackgroundProcess::fstop(const std::vector<std::string>& arguments,
                                           const fs::path& errors) {
  std::vector<std::string> command = {FSTOP_PROGRAM};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return system(command, errors);
}

BackgroundProcess BackgroundProcess::system(const std::vector<std::string>& command,
                                            const fs::path& errors) {
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const pid_t process = ::fork();
  if (process == 0) {
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    const int file = ::open(errors.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    ::dup2(file, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    ::execvp(argv.front(), argv.data());
    ::_exit(127);
  }
  return {process, errors};
}

BackgroundProcess::BackgroundProcess(BackgroundProcess&& other) noexcept
    : process_(std::exchange(other.process_, -1)), errors_(std::move(other.errors_)) {}

BackgroundProcess::~BackgroundProcess() {
  if (process_ <= 0) return;
  ::kill(process_, SIGKILL);
  wait();
}

void BackgroundProcess::signal(int number) const { ::kill(process_, number); }

int BackgroundProcess::wait() {
  int status = 0;
  ::waitpid(process_, &status, 0);
  process_ = -1;
  return exit_code_of(status);
}

std::string BackgroundProcess::error_text() const { return text_of_file(errors_); }

std::uint16_t free_port() {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool is_bound = ::bind(listener, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                        ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  ::close(listener);
  if (!is_bound) throw std::runtime_error("no free port");
  return ntohs(address.sin_port);
}

NatsServer::NatsServer(const fs::path& folder) : folder_(folder / "nats"), port_(free_port()) {
  fs::create_directories(folder_);
  start();
}

std::string NatsServer::url() const { return "nats://127.0.0.1:" + std::to_string(port_); }

void NatsServer::kill() { process_.reset(); }

void NatsServer::start() {
  process_ = std::make_unique<BackgroundProcess>(
      BackgroundProcess::system({"nats-server", "-js", "-sd", (folder_ / "store").string(), "-a",
                                 "127.0.0.1", "-p", std::to_string(port_)},
                                folder_ / "log"));
  const bool is_ready = eventually([&] { return can_connect(port_); });
  if (!is_ready) throw std::runtime_error("nats-server does not start: " + process_->error_text());
}

void NatsServer::start_empty() {
  fs::remove_all(folder_ / "store");
  start();
}

}  // namespace fstop::test
