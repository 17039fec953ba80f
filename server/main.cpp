// Compiled for every x86-64 processor, while all else needs more: this file includes no standard
// C++ header, whose inline functions the linker might take from elsewhere.
#include <fcntl.h>
#include <unistd.h>

#include "server/command_line.h"

namespace {

void complain(const char* text) {
  unsigned long length = 0;
  while (text[length] != '\0') ++length;
  const ssize_t ignored = ::write(STDERR_FILENO, text, length);
  (void)ignored;
}

// Runs before the constructors of all other files, which use what is checked here.
[[gnu::constructor(101)]] void require_processor() {
  __builtin_cpu_init();
  bool is_enough = true;
  const auto require = [&](bool there, const char* name) {
    if (there) return;
    if (is_enough) complain("fstop needs an x86-64-v3 processor (2013 or later). Missing here:");
    is_enough = false;
    complain(" ");
    complain(name);
  };
  require(__builtin_cpu_supports("avx2"), "AVX2");
  require(__builtin_cpu_supports("fma"), "FMA");
  require(__builtin_cpu_supports("bmi2"), "BMI2");
  require(__builtin_cpu_supports("f16c"), "F16C");
  require(__builtin_cpu_supports("lzcnt"), "LZCNT");
  if (is_enough) return;
  complain("\n");
  ::_exit(1);
}

// A file opened later must not become standard output or error.
void open_standard_streams() {
  int descriptor = 0;
  do {
    descriptor = ::open("/dev/null", O_RDWR);
  } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
  if (descriptor >= 0) ::close(descriptor);
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  return fstop::server::run_command_line(argc, argv);
}
