// Declared pairs of a round body or a node and a triangle have a contact wherever they are (sphere_facet.f90). Where
// the point passed to another triangle of the surface, that one goes on with the pair, and the contact here is left
// out; where no other has it, as a hair behind the rim of a surface, it stays.
#include "spare_contacts.hpp"

#include "../base/vectors.hpp"
#include "cairn/core.h"

namespace cairn::detection {

namespace {

constexpr double over_it = 1 - 5e-5; // cosine of a contact over a triangle and that triangle

} // namespace

bool SpareContacts::on_facet(const Candidates& out, std::int64_t i) const {
  return scene_.shape(out.contactor_b[i]).facet();
}

const double* SpareContacts::normal_of_facet(const Candidates& out, std::int64_t i) const {
  const std::int32_t facet = out.contactor_b[i], hull = scene_.contactors->hull.values[facet];
  return scene_.turned.data() + scene_.hull_place[facet] + 3 * scene_.contactors->hulls.vertices(hull);
}

// True if contact j may go on with the pair of contact i; one that is declared itself goes on with itself alone.
bool SpareContacts::may_go_on(const Candidates& out, std::int64_t i, std::int64_t j) const {
  return out.feature[j] >= 0 && out.image[j] == out.image[i] && on_facet(out, j) &&
         scene_.carrier[out.contactor_b[j]] == scene_.carrier[out.contactor_b[i]] &&
         dot(normal_of_facet(out, i), normal_of_facet(out, j), 3) > 0.5; // as follow_bonds_across_sides
}

void SpareContacts::drop_one(const Candidates& out, std::int64_t i, DroppedContacts& dropped) const {
  // beyond a rim the triangle beside has a node no more than its own
  const auto is_beyond = [&](std::int64_t j) {
    return !(scene_.contactors->radius.values[out.contactor_a[j]] > 0) &&
           !(dot(&out.normal[3 * j], normal_of_facet(out, j), 3) > over_it);
  };
  bool heir = false;
  const auto each_other = [&](auto&& take) {
    for (const int way : {-1, 1})
      for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
        if (may_go_on(out, i, j)) take(j);
  };
  each_other([&](std::int64_t j) { heir = heir || !is_beyond(j); });
  dropped[i] = heir;
  if (!heir) each_other([&](std::int64_t j) { dropped[j] = 1; });
}

void SpareContacts::drop(const DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) const {
  if (declared.pairs.empty() || scene_.dim != 3 || !scene_.contactors->hull.active) return;
  dropped.begin(out);
  for (std::int64_t i = 0; i < out.count; ++i)
    if (out.feature[i] == cairn_spare) drop_one(out, i, dropped);
  for (std::int64_t i = 0; i < out.count; ++i)
    if (out.feature[i] < 0) out.feature[i] = 0;
  dropped.remove(out, scene_.dim);
}

} // namespace cairn::detection
