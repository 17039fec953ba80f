#include "server/sandbox.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>

#include "core/error.h"

namespace fstop::server {
namespace {

using Clock = std::chrono::steady_clock;

// System calls that reach beyond the process or make something: they fail with EPERM.
constexpr std::array kForbidden = {SYS_socket,
                                   SYS_socketpair,
                                   SYS_connect,
                                   SYS_bind,
                                   SYS_listen,
                                   SYS_accept,
                                   SYS_accept4,
                                   SYS_sendto,
                                   SYS_sendmsg,
                                   SYS_sendmmsg,
                                   SYS_creat,
                                   SYS_mkdir,
                                   SYS_mkdirat,
                                   SYS_mknod,
                                   SYS_mknodat,
                                   SYS_link,
                                   SYS_linkat,
                                   SYS_symlink,
                                   SYS_symlinkat,
                                   SYS_rename,
                                   SYS_renameat,
                                   SYS_renameat2,
                                   SYS_unlink,
                                   SYS_unlinkat,
                                   SYS_rmdir,
                                   SYS_truncate,
                                   SYS_ftruncate,
                                   SYS_chmod,
                                   SYS_fchmod,
                                   SYS_fchmodat,
                                   SYS_chown,
                                   SYS_fchown,
                                   SYS_lchown,
                                   SYS_fchownat,
                                   SYS_utimensat,
                                   SYS_setxattr,
                                   SYS_execve,
                                   SYS_execveat,
                                   SYS_fork,
                                   SYS_vfork,
                                   SYS_kill,
                                   SYS_tkill,
                                   SYS_ptrace,
                                   SYS_process_vm_readv,
                                   SYS_process_vm_writev,
                                   SYS_pidfd_open,
                                   SYS_pidfd_send_signal,
                                   SYS_mount,
                                   SYS_umount2,
                                   SYS_pivot_root,
                                   SYS_chroot,
                                   SYS_setns,
                                   SYS_unshare,
                                   SYS_bpf,
                                   SYS_io_uring_setup,
                                   SYS_io_uring_enter,
                                   SYS_memfd_create,
                                   SYS_userfaultfd,
                                   SYS_perf_event_open,
                                   SYS_keyctl,
                                   SYS_add_key,
                                   SYS_request_key,
                                   SYS_openat2,
                                   SYS_open_by_handle_at,
                                   SYS_inotify_init1,
                                   SYS_setrlimit,
                                   SYS_shmget,
                                   SYS_msgget,
                                   SYS_semget};

constexpr std::uint32_t kWriting = O_WRONLY | O_RDWR | O_CREAT | O_TRUNC | O_APPEND;

sock_filter load(std::size_t offset) {
  return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset));
}

sock_filter answer(std::uint32_t action) { return BPF_STMT(BPF_RET | BPF_K, action); }

sock_filter skip_unless(std::uint32_t value, std::uint8_t instructions) {
  return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, instructions);
}

constexpr std::size_t argument(int n) {
  return offsetof(seccomp_data, args) + sizeof(std::uint64_t) * static_cast<std::size_t>(n);
}

// Where `call` opens a file to write or make it, EPERM.
void forbid_writing(std::vector<sock_filter>& program, long call, int flags_argument) {
  program.push_back(skip_unless(static_cast<std::uint32_t>(call), 4));
  program.push_back(load(argument(flags_argument)));
  program.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, kWriting));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 1, 0));
  program.push_back(answer(SECCOMP_RET_ERRNO | EPERM));
  program.push_back(load(offsetof(seccomp_data, nr)));
}

// Threads may be begun, processes not. clone3 hides its flags behind a pointer: the C library goes
// back to clone where the kernel says that it does not know it.
void forbid_processes(std::vector<sock_filter>& program) {
  program.push_back(skip_unless(SYS_clone3, 1));
  program.push_back(answer(SECCOMP_RET_ERRNO | ENOSYS));
  program.push_back(skip_unless(SYS_clone, 4));
  program.push_back(load(argument(0)));
  program.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, CLONE_THREAD));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, CLONE_THREAD, 1, 0));
  program.push_back(answer(SECCOMP_RET_ERRNO | EPERM));
  program.push_back(load(offsetof(seccomp_data, nr)));
}

std::vector<sock_filter> filter() {
  std::vector<sock_filter> program = {
      load(offsetof(seccomp_data, arch)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, AUDIT_ARCH_X86_64, 1, 0),
      answer(SECCOMP_RET_KILL_PROCESS), load(offsetof(seccomp_data, nr)),
      // The x32 names of the same calls.
      BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, 0x40000000, 0, 1), answer(SECCOMP_RET_KILL_PROCESS)};
  for (const long call : kForbidden) {
    program.push_back(skip_unless(static_cast<std::uint32_t>(call), 1));
    program.push_back(answer(SECCOMP_RET_ERRNO | EPERM));
  }
  forbid_writing(program, SYS_open, 1);
  forbid_writing(program, SYS_openat, 2);
  forbid_processes(program);
  program.push_back(answer(SECCOMP_RET_ALLOW));
  return program;
}

void require(bool worked, const char* what) {
  if (!worked)
    throw Error(ErrorCode::internal, std::string("sandbox: ") + what + ": " + std::strerror(errno));
}

void limit(int resource, std::size_t value) {
  const rlimit bound = {.rlim_cur = value, .rlim_max = value};
  require(::setrlimit(static_cast<__rlimit_resource>(resource), &bound) == 0, "a limit");
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { reset(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const noexcept { return number_; }
  void reset() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

[[noreturn]] void fail(const char* what) {
  throw Error(ErrorCode::io_failure, std::string(what) + ": " + std::strerror(errno));
}

// A file in memory with the input; it has no name and ends with its last descriptor.
int input_file(std::span<const char> input) {
  const int file = ::memfd_create("input", MFD_CLOEXEC);
  if (file < 0) fail("memfd_create");
  while (!input.empty()) {
    const ssize_t count = ::write(file, input.data(), input.size());
    if (count <= 0) {
      ::close(file);
      fail("write");
    }
    input = input.subspan(static_cast<std::size_t>(count));
  }
  ::lseek(file, 0, SEEK_SET);
  return file;
}

pid_t spawned(const std::string& program, const std::vector<std::string>& arguments, int input,
              int output) {
  std::vector<char*> words = {const_cast<char*>("fstop")};
  for (const std::string& argument : arguments)
    words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  std::array<char*, 1> environment = {nullptr};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  ::posix_spawn_file_actions_addclosefrom_np(&actions, 3);
  pid_t process = -1;
  const int error =
      ::posix_spawn(&process, program.c_str(), &actions, nullptr, words.data(), environment.data());
  ::posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    errno = error;
    fail("posix_spawn");
  }
  return process;
}

}  // namespace

void enter_sandbox(const SandboxLimits& limits) {
  limit(RLIMIT_AS, limits.memory_bytes);
  limit(RLIMIT_CPU, static_cast<std::size_t>(limits.cpu_s));
  limit(RLIMIT_FSIZE, 0);
  limit(RLIMIT_CORE, 0);
  require(::prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) == 0, "dumpable");
  require(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0, "no_new_privs");
  std::vector<sock_filter> program = filter();
  const sock_fprog installed = {.len = static_cast<unsigned short>(program.size()),
                                .filter = program.data()};
  require(::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &installed, 0, 0) == 0, "seccomp");
}

SandboxAnswer run_apart(const std::string& program, const std::vector<std::string>& arguments,
                        std::span<const char> input, const SandboxLimits& limits) {
  Descriptor file(input_file(input));
  std::array<int, 2> ends = {-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail("pipe");
  Descriptor from(ends[0]);
  Descriptor to(ends[1]);
  const pid_t process = spawned(program, arguments, file.get(), to.get());
  to.reset();
  file.reset();
  SandboxAnswer result;
  const auto deadline = Clock::now() + limits.wall;
  std::vector<char> buffer(std::size_t{1} << 16);
  bool goes_on = true;
  while (goes_on) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd waiting = {.fd = from.get(), .events = POLLIN, .revents = 0};
    const int ready = left > 0 ? ::poll(&waiting, 1, static_cast<int>(left)) : 0;
    if (ready < 0 && errno == EINTR) continue;
    const ssize_t count = ready > 0 ? ::read(from.get(), buffer.data(), buffer.size()) : 0;
    result.timed_out = ready <= 0;
    goes_on = count > 0 && result.output.size() <= limits.answer_bytes;
    if (count > 0) result.output.append(buffer.data(), static_cast<std::size_t>(count));
  }
  // Whoever has closed its output is done, or is made so.
  const bool is_ended = result.timed_out || result.output.size() > limits.answer_bytes;
  if (is_ended) ::kill(process, SIGKILL);
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  result.exit_code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  if (is_ended) result.exit_code = 128 + SIGKILL;  // even if it had just ended by itself
  return result;
}

}  // namespace fstop::server
