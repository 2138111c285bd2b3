// Marks of contacts that a stage of detection drops.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "declared_pairs.hpp"

namespace cairn::detection {

// Moves `count` contacts to places before their own.
void move_contacts(Candidates& out, int dim, std::int64_t from, std::int64_t count, std::int64_t to);
void trim_contacts(Candidates& out, int dim, std::int64_t count); // to as many

class DroppedContacts {
public:
  void begin(const Candidates& out) { marks_.assign(std::size_t(out.count), 0); }
  std::uint8_t& operator[](std::int64_t i) { return marks_[std::size_t(i)]; }
  std::uint8_t operator[](std::int64_t i) const { return marks_[std::size_t(i)]; }
  bool any() const { return std::find(marks_.begin(), marks_.end(), 1) != marks_.end(); }
  // Takes the mark from contacts of declared pairs.
  void spare(DeclaredPairs& declared, const PlacedScene& scene, const Candidates& out);
  void remove(Candidates& out, int dim) const;

private:
  std::vector<std::uint8_t> marks_;
};

} // namespace cairn::detection
