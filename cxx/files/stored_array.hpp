// Contents of a file: arrays with names, nested.
#pragma once
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace cairn {

// kind: 'i', 'u' whole numbers, 'f' real ones, 'b' true or false in a byte, 'S' texts of item bytes, nought behind.
struct StoredType {
  char kind = 'f';
  std::uint32_t item = 8; // bytes of one
  bool operator==(const StoredType&) const = default;
};
template <class T>
constexpr StoredType stored_type() {
  static_assert(std::is_arithmetic_v<T>);
  return {std::is_same_v<T, bool>       ? 'b'
          : std::is_floating_point_v<T> ? 'f'
          : std::is_signed_v<T>         ? 'i'
                                        : 'u',
          sizeof(T)};
}

struct StoredArray {
  StoredType type;
  std::vector<std::int64_t> shape; // empty: one number or text
  std::vector<unsigned char> bytes;

  std::int64_t size() const { // numbers
    std::int64_t n = 1;
    for (const std::int64_t along : shape) n *= along;
    return n;
  }
  static StoredArray text(const std::string& value) {
    StoredArray a{{'S', std::uint32_t(value.empty() ? 1 : value.size())}, {}, {value.begin(), value.end()}};
    a.bytes.resize(a.type.item);
    return a;
  }
  template <class T>
  static StoredArray of(const T* values, std::vector<std::int64_t> shape) {
    StoredArray a{stored_type<T>(), std::move(shape), {}};
    a.bytes.resize(std::size_t(a.size()) * sizeof(T));
    if (!a.bytes.empty()) std::memcpy(a.bytes.data(), values, a.bytes.size());
    return a;
  }
  template <class T>
  static StoredArray number(T value) {
    return of(&value, {});
  }
};

} // namespace cairn
