// Scratch memory, used by the stages of a step in turn: data of a stage are lost when the next begins. Detection works
// where the contacts of the last step were, and the contacts of this step take its place.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "field.hpp"

namespace cairn {

class Scratch {
public:
  // Gives everything back. Several blocks become one block, a sixteenth larger: once sizes are settled nothing is
  // allocated.
  void begin() {
    if (blocks_.size() > 1) {
      blocks_.clear();
      blocks_.emplace_back(most_ + most_ / 16);
    }
    used_ = taken_ = 0;
  }
  struct Mark {
    std::size_t blocks, used, taken;
  };
  Mark mark() const { return {blocks_.size(), used_, taken_}; }
  // Gives back the memory taken since the mark.
  void release(const Mark& mark) {
    taken_ = mark.taken;
    if (blocks_.size() == mark.blocks) used_ = mark.used; // else it is left until there is one block
  }
  // n items, not initialised, from the start of a cache line on.
  template <class T>
  T* take(std::int64_t n) {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    const std::size_t lines = (std::size_t(n) * sizeof(T) + sizeof(Line) - 1) / sizeof(Line);
    if (blocks_.empty() || used_ + lines > blocks_.back().size()) {
      const std::size_t slack = blocks_.empty() ? 0 : blocks_.back().size() / 8;
      blocks_.emplace_back(std::max(lines, slack));
      used_ = 0;
    }
    Line* here = blocks_.back().data() + used_;
    used_ += lines;
    taken_ += lines;
    most_ = std::max(most_, taken_);
    return reinterpret_cast<T*>(here);
  }
  std::int64_t bytes() const {
    std::int64_t all = 0;
    for (const auto& block : blocks_) all += std::int64_t(block.size() * sizeof(Line));
    return all;
  }

private:
  struct alignas(64) Line {
    Line() {} // no initialisation
    std::byte bytes[64];
  };
  std::vector<Array<Line>> blocks_;
  std::size_t used_ = 0;             // lines of the last block
  std::size_t taken_ = 0, most_ = 0; // lines at hand now, and at most so far
};

// Array in a scratch. make_room loses old contents; copies are views.
template <class T>
class ScratchArray {
public:
  void make_room(Scratch& scratch, std::int64_t n) {
    if (n <= size_) return;
    data_ = scratch.take<T>(n);
    size_ = n;
  }
  T* data() { return data_; }
  const T* data() const { return data_; }
  T& operator[](std::int64_t i) { return data_[i]; }
  const T& operator[](std::int64_t i) const { return data_[i]; }
  T* begin() { return data_; }
  T* end() { return data_ + size_; }
  std::int64_t size() const { return size_; }

private:
  T* data_ = nullptr;
  std::int64_t size_ = 0;
};

} // namespace cairn
