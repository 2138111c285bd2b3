#include "kept_pairs.hpp"

#include <algorithm>

#include "cairn/core.h"
#include "detection_grid.hpp"

namespace cairn::detection {

namespace {

// Skin as a share of the reach of a ball. A wider skin lasts longer, and every step tests more pairs.
constexpr double skin = 0.125;
// A list that serves fewer steps does not pay for what its wider search takes; how many searches are left alone then,
// at first and at most.
constexpr std::int64_t fewest_uses = 3, first_rest = 8, longest_rest = 256;

template <class T>
void copy(Array<T>& to, const T* from, std::int64_t n) {
  fit(to, std::size_t(n));
  std::copy_n(from, n, to.begin());
}

template <class T>
bool same(const Array<T>& kept, const T* now) {
  return std::equal(kept.begin(), kept.end(), now);
}

} // namespace

bool KeptPairs::like_then(const SearchedScene& s) const {
  const Contactors& c = *s.contactors;
  const bool all_meet = !s.rules || s.rules->all_meet();
  if (dim_ != s.dim || std::int64_t(id_.size()) != c.count || std::int64_t(movable_.size()) != s.carriers ||
      all_meet_ != all_meet)
    return false;
  if (!same(id_, c.id.values.data()) || !same(body_, c.body.values.data()) || !same(shape_, c.shape.values.data()) ||
      !same(movable_, s.movable))
    return false;
  return all_meet || (same(material_, c.material.values.data()) && rules_.same_as(*s.rules));
}

bool KeptPairs::hold(const SearchedScene& s) const {
  if (!kept_ || !like_then(s)) return false;
  for (const Turned& t : turned_) {
    const std::int64_t i = t.contactor;
    if (!(s.contactors->radius.values[std::size_t(i)] == t.radius)) return false;
    for (int k = 0; k <= s.dim && s.direction; ++k)
      if (!(s.direction[i * (s.dim + 1) + k] == t.direction[k])) return false;
  }
  std::int64_t beyond = 0;
  in_slices(s.contactors->count, [&](std::int64_t first, std::int64_t last) {
    std::int64_t here = 0;
    cairn_pairs_beyond(s.dim, first, last, s.centre, s.reach, centre_.data(), room_.data(), &here);
    if (here == 0) return;
#pragma omp atomic
    beyond += here;
  });
  return beyond == 0;
}

bool KeptPairs::pays() {
  if (kept_) {
    rest_ = uses_ < fewest_uses ? std::clamp(2 * rest_, first_rest, longest_rest) : 0;
    resting_ = rest_;
    kept_ = false;
  }
  if (resting_ == 0) return true;
  --resting_;
  return false;
}

double KeptPairs::widen(const SearchedScene& s, double* reach) {
  const Contactors& c = *s.contactors;
  dim_ = s.dim;
  uses_ = 0;
  all_meet_ = !s.rules || s.rules->all_meet();
  copy(centre_, s.centre, c.count * s.dim);
  copy(id_, c.id.values.data(), c.count);
  copy(body_, c.body.values.data(), c.count);
  copy(shape_, c.shape.values.data(), c.count);
  copy(movable_, s.movable, s.carriers);
  if (!all_meet_) {
    copy(material_, c.material.values.data(), c.count);
    rules_ = *s.rules;
  }
  const auto is_ball = [&](std::int64_t i) { return info(Shape(c.shape.values[std::size_t(i)])).ball(); };
  turned_.clear();
  double sum = 0;
  for (std::int64_t i = 0; i < c.count; ++i) {
    if (is_ball(i)) {
      sum += skin * reach[i];
      continue;
    }
    Turned t{std::int32_t(i), c.radius.values[std::size_t(i)], {0, 0, 0, 0}};
    if (s.direction) std::copy_n(s.direction + i * (s.dim + 1), s.dim + 1, t.direction);
    turned_.push_back(t);
  }
  const auto balls = c.count - std::int64_t(turned_.size());
  const double of_wall = balls > 0 ? sum / double(balls) : 0;
  fit(room_, std::size_t(c.count));
  for (std::int64_t i = 0; i < c.count; ++i) room_[std::size_t(i)] = reach[i] += is_ball(i) ? skin * reach[i] : of_wall;
  return of_wall;
}

std::size_t KeptPairs::bytes() const {
  const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return pairs.bytes() + of(centre_) + of(room_) + of(id_) + of(body_) + of(material_) + of(shape_) + of(movable_) +
         of(turned_);
}

} // namespace cairn::detection
