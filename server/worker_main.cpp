// The program that makes photographs for `fstop serve`, apart from it: of no use by hand. It links
// no more than the light path, so that it starts at once and takes little memory.
#include <charconv>
#include <cstring>
#include <string_view>

#include "server/render_worker.h"

namespace {

template <typename Number>
bool read(const char* text, Number& number) {
  const char* end = text + std::strlen(text);
  return std::from_chars(text, end, number).ptr == end;
}

}  // namespace

int main(int argc, char** argv) {
  fstop::server::WorkerShape shape;
  const bool is_understood = argc == 4 && read(argv[1], shape.threads) &&
                             read(argv[2], shape.niceness) && read(argv[3], shape.scene_bytes);
  if (!is_understood) return 2;
  fstop::server::work_for_server(shape);
}
