#include "zero_pages.hpp"

#include <cstdint>
#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace cairn {

#ifdef __linux__
void give_back_zero_pages(const void* first, std::size_t bytes) {
  constexpr std::size_t least = 1 << 18; // bytes of a run: short ones would break huge pages up for little
  static const auto page = std::size_t(sysconf(_SC_PAGESIZE));
  const auto begin = (reinterpret_cast<std::uintptr_t>(first) + page - 1) / page * page; // of whole pages
  const auto end = (reinterpret_cast<std::uintptr_t>(first) + bytes) / page * page;
  const auto is_zero = [](std::uintptr_t at) {
    const auto* word = reinterpret_cast<const std::uint64_t*>(at);
    for (std::size_t i = 0; i < page / sizeof *word; ++i)
      if (word[i] != 0) return false;
    return true;
  };
  for (std::uintptr_t at = begin; at < end;) {
    std::uintptr_t after = at;
    while (after < end && is_zero(after)) after += page;
    if (after - at >= least) madvise(reinterpret_cast<void*>(at), after - at, MADV_DONTNEED);
    at = after + page;
  }
}
#else
void give_back_zero_pages(const void*, std::size_t) {}
#endif

} // namespace cairn
