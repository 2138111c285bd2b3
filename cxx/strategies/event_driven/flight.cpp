// Bodies in flight, and when they will meet.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "../../base/call.hpp"
#include "../../base/vectors.hpp"
#include "../../contactors/shapes.hpp"
#include "cairn/rows/pair.h"
#include "event_driven.hpp"

namespace cairn::events {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity(), rounding = std::numeric_limits<double>::epsilon();
constexpr int most_passes = 200; // iterations for the time of an impact; a grazing pair halves its distance in each

struct PairKind {
  Shape a, b;
  cairn_pair_contact* contact;
};
constexpr PairKind pair_kinds[] = {
#define CAIRN_PAIR(name, a, b, most) {Shape::a, Shape::b, cairn_pair_##name},
#include "../../../core_f90/detection/pairs.def"
#undef CAIRN_PAIR
};

double norm(const double* v, int n) { return std::sqrt(dot(v, v, n)); }

} // namespace

bool later(const Event& one, const Event& other) {
  return one.time > other.time ||
         (!(one.time < other.time) && std::pair(one.pair, one.body) > std::pair(other.pair, other.body));
}

// Pairs that may meet until one of their bodies has gone by half of the skin.
void EventDriven::find_neighbours(Simulation& s) {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const int dim = b.dim;
  double widest = 0;
  for (std::int64_t k = 0; k < c.count; ++k)
    if (info(Shape(*c.shape[k])).ball()) widest = std::max(widest, *c.radius[k]);
  Margin margin{};
  margin.constant = !std::isnan(settings_.skin) ? settings_.skin : 0.5 * (widest > 0 ? widest : 1);
  // a body that flies by thousands of its sizes in a step leaves its surroundings as often: they grow
  constexpr int plenty = 64, largest = 512;
  searches_ = now_ > 0 ? searches_ + 1 : 0;
  margin.constant = std::ldexp(margin.constant, std::clamp(searches_ - plenty, 0, largest));
  offset_.assign(c.count * dim, 0);
  direction_.assign(c.count * (dim + 1), 0);
  const double* rotation = b.rotation.active ? b.rotation.values.data() : nullptr;
  std::int64_t wrong = -1;
  cairn_contactor_centres(dim, 0, c.count, c.body.values.data(), b.position.values.data(), c.offset.active,
                          c.offset.values.data(), b.rotation.active, rotation, offset_.data(), &wrong);
  for (std::int64_t k = 0; k < c.count * dim; ++k) offset_[k] -= b.position[*c.body[k / dim]][k % dim];
  for (std::int64_t k = 0; k < c.count && !c.offset.active; ++k) std::fill_n(&offset_[k * dim], dim, 0.0);
  if (c.direction.active)
    cairn_contactor_directions(dim, 0, c.count, c.body.values.data(), c.direction.values.data(), b.rotation.active,
                               rotation, direction_.data());
  s.handler.declared().clear();
  Candidates& near = s.candidates;
  s.handler.detect(b, c, s.scene.cell, margin, near, {}, &s.interactions.scratch(), &s.laws.rules());
  // impacts that a pair had stay counted, by the contactors of it
  auto& had = had_;
  had.clear();
  for (const Pair& p : pairs_)
    if (p.impacts > 0 && now_ > 0) had.push_back({{p.a, p.b, p.image}, p.impacts});
  std::sort(had.begin(), had.end());
  pairs_.clear();
  first_pair_.assign(b.count + 1, 0);
  for (std::int64_t i = 0; i < near.count; ++i) {
    const std::int32_t one = near.contactor_a[i], two = near.contactor_b[i];
    const auto kind = std::find_if(std::begin(pair_kinds), std::end(pair_kinds), [&](const PairKind& k) {
      return k.a == Shape(*c.shape[one]) && k.b == Shape(*c.shape[two]);
    });
    if (kind == std::end(pair_kinds)) throw Error("EventDriven knows no contact of these shapes: use disks or spheres");
    const std::array<std::int32_t, 3> key = {one, two, near.image[i]};
    const auto known = std::lower_bound(had.begin(), had.end(), std::pair(key, 0));
    const int impacts = known != had.end() && known->first == key ? known->second : 0;
    pairs_.push_back({one, two, *c.body[one], *c.body[two], near.image[i], int(kind - pair_kinds), impacts});
    ++first_pair_[pairs_.back().body_a + 1];
    ++first_pair_[pairs_.back().body_b + 1];
  }
  near.count = 0;
  std::partial_sum(first_pair_.begin(), first_pair_.end(), first_pair_.begin());
  place_ = first_pair_;
  pair_of_.resize(2 * pairs_.size());
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    pair_of_[place_[pairs_[p].body_a]++] = std::int32_t(p);
    pair_of_[place_[pairs_[p].body_b]++] = std::int32_t(p);
  }
  queue_.clear();
  room_.assign(b.count, 0.5 * margin.constant);
  for (std::size_t p = 0; p < pairs_.size(); ++p) expect(s, std::int32_t(p), now_);
  for (std::int64_t i = 0; i < b.count; ++i) expect_to_leave(s, std::int32_t(i), now_);
}

void EventDriven::push(const Event& e) {
  if (!(e.time < h_)) return;
  queue_.push_back(e);
  std::push_heap(queue_.begin(), queue_.end(), later);
}

void EventDriven::expect(const Simulation& s, std::int32_t pair, double from) {
  const Pair& p = pairs_[std::size_t(pair)];
  push({time_of_impact(s, p, from), pair, -1, number_[p.body_a], number_[p.body_b]});
}

void EventDriven::expect_to_leave(const Simulation& s, std::int32_t body, double from) {
  const int nd = s.scene.bodies.dofs(), dim = s.scene.dim;
  const double v = norm(s.scene.bodies.velocity[body], dim), a = norm(&acceleration_[nd * std::int64_t(body)], dim);
  const double room = room_[body];
  const double way = a > 0 ? 2 * room / (v + std::sqrt(v * v + 2 * a * room)) : room / v;
  push({from + way, -1, body, number_[body], 0});
}

// Moves a body along its parabola, rotation included, and adds the work of forces on the way.
void EventDriven::advance(Simulation& s, std::int32_t body, double time) {
  Bodies& b = s.scene.bodies;
  const int nd = b.dofs(), dim = b.dim;
  const double t = time - at_[body];
  at_[body] = time;
  if (!(t > 0)) return;
  double *x = b.position[body], *v = b.velocity[body], mean[6] = {0, 0, 0, 0, 0, 0};
  const double* a = &acceleration_[nd * std::int64_t(body)];
  for (int k = 0; k < nd; ++k) mean[k] = v[k] + 0.5 * t * a[k];
  for (int k = 0; k < dim; ++k) x[k] += t * mean[k];
  room_[body] -= t * norm(v, dim) + 0.5 * t * t * norm(a, dim);
  if (dim == 2 && b.rotation.active) *b.rotation[body] += t * mean[2];
  std::int64_t unsolved = 0;
  if (dim == 3 && b.rotation.active)
    cairn_rotate(1, t, b.inertia[body], mean, b.rotation[body], nullptr, nullptr, &unsolved);
  for (int k = 0; k < nd; ++k) {
    v[k] += t * a[k];
    if (!(b.inverse_mass[body][k] > 0)) continue;
    if (k < dim) potential_ -= *b.mass[body] * s.scene.gravity[k] * t * mean[k];
    if (b.force.active) external_ += b.force[body][k] * t * mean[k];
  }
}

void EventDriven::advance_all(Simulation& s, double time) {
  for (std::int64_t i = 0; i < s.scene.bodies.count; ++i) advance(s, std::int32_t(i), time);
}

// The contact of a pair at a time, by the kernel of its shapes.
Contact EventDriven::look(const Simulation& s, const Pair& p, double time) const {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  const int nd = b.dofs(), dim = b.dim;
  double between[3], shift[3] = {0, 0, 0}, speed[3] = {0, 0, 0}, change[3] = {0, 0, 0}, largest = 0, speeds = 0;
  if (s.scene.cell.any()) image_shift(s.scene.cell, p.image, shift);
  const double ta = time - at_[p.body_a], tb = time - at_[p.body_b];
  const double *xa = b.position[p.body_a], *xb = b.position[p.body_b], *va = b.velocity[p.body_a],
               *vb = b.velocity[p.body_b];
  const double *aa = &acceleration_[nd * std::int64_t(p.body_a)], *ab = &acceleration_[nd * std::int64_t(p.body_b)];
  for (int k = 0; k < dim; ++k) {
    const double one = xa[k] + ta * (va[k] + 0.5 * ta * aa[k]),
                 two = xb[k] + tb * (vb[k] + 0.5 * tb * ab[k]) + shift[k];
    between[k] = (one + offset_[std::int64_t(p.a) * dim + k]) - (two + offset_[std::int64_t(p.b) * dim + k]);
    speed[k] = va[k] + ta * aa[k] - (vb[k] + tb * ab[k]);
    change[k] = aa[k] - ab[k];
    speeds += std::abs(va[k]) + std::abs(vb[k]) + h_ * (std::abs(aa[k]) + std::abs(ab[k]));
    largest = std::max({largest, std::abs(one), std::abs(two), std::abs(between[k])});
  }
  Contact at;
  std::int32_t kept = 0;
  const double none[4] = {0, 0, 0, 0};
  const bool directed = info(Shape(*c.shape[p.b])).directed;
  pair_kinds[p.kind].contact(1, between, c.radius[p.a], c.radius[p.b],
                             directed ? &direction_[std::int64_t(p.b) * (dim + 1)] : none, &at.gap, at.normal, at.point,
                             &kept);
  at.speed = dot(at.normal, speed, dim);
  at.still = 64 * rounding * speeds;
  if (std::abs(at.speed) <= at.still) at.speed = 0;
  at.push = dot(at.normal, change, dim);
  at.blur = 8 * rounding * (largest + *c.radius[p.a] + *c.radius[p.b]);
  return at;
}

// The first time from `from` on at which the gap closes. A gap between convex bodies that do not turn is, but for their
// acceleration, a convex function of time: its tangent, less what the acceleration may take, never passes the impact.
double EventDriven::time_of_impact(const Simulation& s, const Pair& p, double from) const {
  const int nd = s.scene.bodies.dofs(), dim = s.scene.dim;
  const bool flat = !info(Shape(*s.scene.contactors.shape[p.b])).bounded; // its normal stays
  double t = from;
  for (int pass = 0; pass < most_passes; ++pass) {
    const Contact at = look(s, p, t);
    double change[3] = {0, 0, 0};
    for (int k = 0; k < dim; ++k)
      change[k] = acceleration_[nd * std::int64_t(p.body_a) + k] - acceleration_[nd * std::int64_t(p.body_b) + k];
    const double pull = flat ? std::max(0.0, -at.push) : norm(change, dim);
    if (at.gap <= at.blur && (at.speed < 0 || (!(at.speed > 0) && at.push < 0))) return t; // it strikes, or rests
    const double gap = std::max(at.gap, at.speed > 0 ? 0.0 : at.blur); // separating pair: until the gap is visible
    if (!(pull > 0) && !(at.speed < 0)) return infinity;
    const double way = pull > 0
                           ? (at.speed >= 0 ? (at.speed + std::sqrt(at.speed * at.speed + 2 * pull * gap)) / pull
                                            : 2 * gap / (std::sqrt(at.speed * at.speed + 2 * pull * gap) - at.speed))
                           : gap / -at.speed;
    if (!(t + way > t)) return t; // as near as time can tell
    t += way;
    if (!(t < h_)) return infinity;
  }
  return t;
}

} // namespace cairn::events
