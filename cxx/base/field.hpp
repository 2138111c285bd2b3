// An array stored per body or per contactor: one row of fields.def or kept_fields.def.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string_view>
#include <vector>

namespace cairn {

// Starts at a cache line, so that a record of eight doubles never straddles two.
template <class T>
struct LineAllocator {
  using value_type = T;
  LineAllocator() = default;
  template <class U>
  LineAllocator(const LineAllocator<U>&) {}
  T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), std::align_val_t(64))); }
  void deallocate(T* p, std::size_t) { ::operator delete(p, std::align_val_t(64)); }
  friend bool operator==(const LineAllocator&, const LineAllocator&) { return true; }
};
template <class T>
using Array = std::vector<T, LineAllocator<T>>;

// Resizes a vector whose size may change every step: capacity grows by a sixteenth, it is not doubled. Contents are
// lost where it grows.
template <class Vector>
void fit(Vector& v, std::size_t n) {
  if (n > v.capacity()) {
    v.clear(); // nothing to copy
    v.reserve(n + n / 16);
  }
  v.resize(n);
}

enum class Need {
  always,
  rotation,
  force,
  anisotropic,
  driven,
  damping,
  belts,
  smooth,
  acceleration,
  jerk,
  snap,
  crackle,
  thermal,
  growing,
  bending,
  electrical,
  offset,
  direction,
  hull,
  mapped
};

template <class T>
struct Field {
  using value_type = T;
  std::string_view name, unit, stage, meaning;
  Need need = Need::always;
  int components = 1;  // of an item; the fastest index
  bool active = false; // an inactive field has no memory
  Array<T> values;

  void resize(std::int64_t items, T fill = T{}) {
    if (active) values.resize(items * components, fill);
  }
  void activate(std::int64_t items, T fill = T{}) {
    active = true;
    resize(items, fill);
  }
  T* operator[](std::int64_t item) { return values.data() + item * components; }
  const T* operator[](std::int64_t item) const { return values.data() + item * components; }
  // item i of the result is item order[i] of now
  void reorder(const std::vector<std::int32_t>& order) {
    if (!active) return;
    Array<T> next(order.size() * components);
    for (std::size_t i = 0; i < order.size(); ++i)
      for (int c = 0; c < components; ++c) next[i * components + c] = values[std::int64_t(order[i]) * components + c];
    values.swap(next);
  }
};

// Numbers of a field as kernels take them: null where the field has no memory.
template <class T>
T* pointer(Field<T>& field) {
  return field.active ? field.values.data() : nullptr;
}
// Flags of a field as kernels take them, in Fortran one byte each.
inline const std::int8_t* bits(Field<std::uint8_t>& field) {
  return reinterpret_cast<const std::int8_t*>(pointer(field));
}

} // namespace cairn
