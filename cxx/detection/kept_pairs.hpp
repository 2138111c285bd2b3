// Pairs that one search finds for several steps (Verlet 1967): it reaches a little farther than the margins ask, each
// contactor by its own skin, and its pairs are all that may count until a contactor moved or grew by as much. What is
// found among them is what a search would find, in the same order, so that nothing of this need be in a checkpoint.
#pragma once
#include <cstdint>
#include <vector>

#include "../base/cell.hpp"
#include "../contactors/shapes.hpp"
#include "../laws/law_rules.hpp"

namespace cairn::detection {

// Pairs in order of row of pairs.def, of A, of B, of image; bit 30 of an image: declared.
struct OrderedPairs {
  Array<std::int32_t> a, b, image;
  std::vector<std::int64_t> kind_end; // of each row of pairs.def
  std::int64_t count() const { return std::int64_t(a.size()); }
  std::size_t bytes() const { return (a.capacity() + b.capacity() + image.capacity()) * sizeof(std::int32_t); }
};

// What a search asks of a scene, as it stands.
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

  // Whether the pairs are all that may count in this scene.
  bool hold(const SearchedScene&) const;
  // Whether a search should reach farther. Lists that ended after few steps are not tried for a while.
  bool pays();
  // Reaches of that search; `reach` is where the margins ask it to end, and is changed. Returns the skin of a wall.
  double widen(const SearchedScene&, double* reach);
  void keep() { kept_ = true; }
  void used() { ++uses_; }
  std::size_t bytes() const;

private:
  struct Turned { // what is no ball holds as long as it is turned as it was
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
