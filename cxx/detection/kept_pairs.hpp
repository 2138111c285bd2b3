// Verlet list: pairs that one search finds for several steps (Verlet 1967). Each contactor reaches farther by its own
// skin, and the list holds all possible contacts until a contactor has moved or grown by as much. The narrow phase then
// gives the same contacts in the same order as a new search, so that a checkpoint needs no list.
#pragma once
#include <cstdint>
#include <vector>

#include "../base/cell.hpp"
#include "../contactors/contactor.hpp"
#include "../laws/law_rules.hpp"

namespace cairn::detection {

// Pairs in order of row of pairs.def, of A, of B, of image; bit 30 of an image: declared.
struct OrderedPairs {
  Array<std::int32_t> a, b, image;
  std::vector<std::int64_t> kind_end; // of each row of pairs.def
  std::int64_t count() const { return std::int64_t(a.size()); }
  std::int64_t begin_of(int kind) const { return kind > 0 ? kind_end[std::size_t(kind - 1)] : 0; }
  void begin(int kinds) {
    for (auto* array : {&a, &b, &image}) array->clear();
    kind_end.assign(std::size_t(kinds), 0);
  }
  void append(const OrderedPairs& of, std::int64_t first, std::int64_t last) {
    a.insert(a.end(), of.a.begin() + first, of.a.begin() + last);
    b.insert(b.end(), of.b.begin() + first, of.b.begin() + last);
    image.insert(image.end(), of.image.begin() + first, of.image.begin() + last);
  }
  std::size_t bytes() const { return (a.capacity() + b.capacity() + image.capacity()) * sizeof(std::int32_t); }
};

// Scene of a search at the present positions.
struct SearchedScene {
  const Contactors* contactors;
  const LawRules* rules; // null: all meet
  int dim;
  std::int64_t carriers;
  const double *centre, *direction, *reach; // (dim | dim + 1 | 1, contactors) [m]; direction null where nothing has one
  const std::int8_t* movable;               // (carriers)
};

class KeptPairs {
public:
  OrderedPairs pairs;

  // True if the list holds all possible contacts of this scene.
  bool hold(const SearchedScene&) const;
  // True if a search should reach farther. After lists that served few steps it is false for a while.
  bool pays();
  // Reaches of that search; `reach` is where the margins ask it to end, and is changed. Returns the skin of a wall.
  double widen(const SearchedScene&, double* reach);
  void keep() { kept_ = true; }
  void used() { ++uses_; }
  std::size_t bytes() const;

private:
  struct Turned { // walls and bars: valid at constant direction
    std::int32_t contactor;
    double radius, direction[4];
  };
  bool like_then(const SearchedScene&) const;
  bool kept_ = false, all_meet_ = true;
  int dim_ = 0;
  std::int64_t uses_ = 0, rest_ = 0, resting_ = 0;
  Array<double> centre_, room_; // then; where its reach may go [m]
  Array<std::int64_t> id_;
  Array<std::int32_t> body_, material_;
  Array<std::int16_t> shape_;
  Array<std::int8_t> movable_;
  std::vector<Turned> turned_;
  LawRules rules_;
};

} // namespace cairn::detection
