#include "server/worker_process.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "core/error.h"

namespace fstop::server {
namespace {

// Above the numbers that the new process gives them.
constexpr int kOutOfTheWay = 16;
constexpr int kWorkerProgram = kWorkerSocket + 1;

Descriptor moved_away(int descriptor) {
  return Descriptor(::fcntl(descriptor, F_DUPFD_CLOEXEC, kOutOfTheWay));
}

pid_t spawned(int program, int socket, const WorkerShape& shape) {
  const Descriptor from_program = moved_away(program);
  const Descriptor from_socket = moved_away(socket);
  std::vector<std::string> arguments = {"fstop-worker", std::to_string(shape.threads),
                                        std::to_string(shape.niceness),
                                        std::to_string(shape.scene_bytes)};
  std::vector<char*> words;
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO})
    ::posix_spawn_file_actions_addopen(&actions, standard, "/dev/null", O_RDWR, 0);
  ::posix_spawn_file_actions_adddup2(&actions, from_socket.get(), kWorkerSocket);
  ::posix_spawn_file_actions_adddup2(&actions, from_program.get(), kWorkerProgram);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, kWorkerProgram + 1);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t none;
  ::sigemptyset(&none);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  const std::string path = "/proc/self/fd/" + std::to_string(kWorkerProgram);
  pid_t process = -1;
  const int error =
      ::posix_spawn(&process, path.c_str(), &actions, &attributes, words.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  if (error != 0)
    throw Error(ErrorCode::io_failure, std::string("starting a worker: ") + std::strerror(error));
  return process;
}

}  // namespace

WorkerProcess::WorkerProcess(int program, const WorkerShape& shape)
    : WorkerProcess(program, shape, Channel::pair()) {}

WorkerProcess::WorkerProcess(int program, const WorkerShape& shape,
                             std::pair<Descriptor, Descriptor> ends)
    : channel_(std::move(ends.first)), process_(spawned(program, ends.second.get(), shape)) {}

WorkerProcess::~WorkerProcess() { end(); }

bool WorkerProcess::has_ended() const {
  pollfd ended = {.fd = channel_.descriptor(), .events = 0, .revents = 0};
  return ::poll(&ended, 1, 0) > 0;
}

std::string WorkerProcess::end() {
  if (process_ < 0) return {};
  ::kill(process_, SIGKILL);
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                             : "exit code " + std::to_string(WEXITSTATUS(status));
}

}  // namespace fstop::server
