// Declared pairs of a round body or a node and a triangle have a contact wherever they are (sphere_facet.f90). Where
// the point passed to another triangle of the surface, that one goes on with the pair, and the contact here is left
// out; where no other has it, as a hair behind the rim of a surface, it stays.
#include <cstdint>
#include <vector>

#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

void InteractionHandler::Workspace::leave_out_spares(Candidates& out) {
  if (declared.empty() || dim != 3 || !contactors->hull.active) return;
  const auto on_facet = [&](std::int64_t i) {
    return Shape(contactors->shape.values[out.contactor_b[i]]) == Shape::facet;
  };
  const auto looks = [&](std::int64_t i) { // its normal stands behind its vertices
    const std::int32_t facet = out.contactor_b[i], hull = contactors->hull.values[facet];
    return turned.data() + hull_place[facet] + 3 * contactors->hulls.vertices(hull);
  };
  // one that is declared itself goes on with itself alone
  const auto goes_on = [&](std::int64_t i, std::int64_t j) {
    if (out.feature[j] < 0 || out.image[j] != out.image[i] || !on_facet(j)) return false;
    if (carrier[out.contactor_b[j]] != carrier[out.contactor_b[i]]) return false;
    const double *here = looks(i), *there = looks(j);
    return here[0] * there[0] + here[1] * there[1] + here[2] * there[2] > 0.5; // as follow_bonds_across_sides
  };
  const auto has_heir = [&](std::int64_t i) {
    for (const int way : {-1, 1})
      for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
        if (goes_on(i, j)) return true;
    return false;
  };
  left.assign(std::size_t(out.count), 0);
  for (std::int64_t i = 0; i < out.count; ++i) left[std::size_t(i)] = out.feature[i] == cairn_spare && has_heir(i);
  for (std::int64_t i = 0; i < out.count; ++i)
    if (out.feature[i] < 0) out.feature[i] = 0;
  leave_out(out);
}

void InteractionHandler::Workspace::leave_out(Candidates& out) const {
  std::int64_t to = 0;
  for (std::int64_t i = 0; i < out.count; ++i) {
    if (left[std::size_t(i)]) continue;
    if (to != i) move_contacts(i, 1, to, out);
    ++to;
  }
  trim(out, to);
}

} // namespace cairn
