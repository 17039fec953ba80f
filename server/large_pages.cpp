// Large arrays on pages of 2 MiB. Films and textures are some tens of megabytes that are written
// once and read a few times: on pages of 4 KiB the kernel spends more on handing them out than a
// coarse render spends on tracing. Replaces the program's operator new; what it returns is
// malloc's, so that libraries may free it.
#include <cstddef>
#include <cstdlib>
#include <new>
#include <sys/mman.h>

namespace {

constexpr std::size_t kPage = std::size_t{2} << 20;

// Of the last page half at least is used, else small pages serve for what it would hold.
void* large(std::size_t size) noexcept {
  const std::size_t whole = (size + kPage - 1) / kPage * kPage;
  if (whole < size) return nullptr;
  void* memory = std::aligned_alloc(kPage, whole);
  const std::size_t on_large = (size + kPage / 2) / kPage * kPage;
  // Advice: where the kernel has no such pages the small ones serve.
  if (memory != nullptr) ::madvise(memory, on_large, MADV_HUGEPAGE);
  return memory;
}

}  // namespace

void* operator new(std::size_t size) {
  while (true) {
    void* memory = size >= kPage ? large(size) : std::malloc(size == 0 ? 1 : size);
    if (memory != nullptr) return memory;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
