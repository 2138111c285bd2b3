#include "zero_pages.hpp"

#include <cstdint>
#include <cstring>
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
    const auto* bytes_of_page = reinterpret_cast<const unsigned char*>(at);
    std::uint64_t word = 0; // of numbers of any type
    for (std::size_t i = 0; i < page && word == 0; i += sizeof word) std::memcpy(&word, bytes_of_page + i, sizeof word);
    return word == 0;
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
