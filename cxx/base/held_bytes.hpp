// Memory that vectors hold.
#pragma once
#include <cstdint>

namespace cairn {

template <class... Vectors>
std::int64_t held_bytes(const Vectors&... vectors) {
  return (std::int64_t(0) + ... + std::int64_t(vectors.capacity() * sizeof(vectors[0])));
}

} // namespace cairn
