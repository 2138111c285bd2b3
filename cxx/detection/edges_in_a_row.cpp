// Edges of a mesh in the plane that follow each other along its boundary. Each is a bar with round ends inside the
// body, and the end of one lies under the next: a node that slides over the next edge would meet it at an angle. A
// point beside the one edge and beyond the other is the former's alone, as in space (facet_view.f90). In a valley it is
// beside both; and at a corner that stands out, beyond both, both ends are near.
#include <algorithm>
#include <cmath>

#include "../base/cell.hpp"
#include "detection_workspace.hpp"

namespace cairn {

using namespace detection;

namespace {

constexpr double on_end = 1e-9;         // of the edges: what lies so near to their common node lies over it
constexpr double nearly_one = 0.75;     // cosine between edges over whose common node one of them has a point
constexpr double clearly = 16;          // times as deep behind one edge as behind the other
constexpr double straight = 1.0 / 1024; // sine between edges that are in a row as loads bend them, and have no valley

} // namespace

InteractionHandler::Workspace::EdgeOwner
InteractionHandler::Workspace::owner_at_corner(std::int32_t first, std::int32_t second, const double* x) const {
  const double *e = &direction[3 * std::int64_t(first)], *f = &direction[3 * std::int64_t(second)];
  const double *at_e = &centre[2 * std::int64_t(first)], *at_f = &centre[2 * std::int64_t(second)];
  double beyond_first = (x[0] - at_e[0]) * e[0] + (x[1] - at_e[1]) * e[1] - e[2];
  double along_second = (x[0] - at_f[0]) * f[0] + (x[1] - at_f[1]) * f[1] + f[2];
  const double slack = on_end * (e[2] + f[2]), cosine = e[0] * f[0] + e[1] * f[1];
  const double sine = e[0] * f[1] - e[1] * f[0];
  const bool in_a_row = cosine > 0 && std::abs(sine) <= straight, turns = cosine < nearly_one;
  if (turns && sine < 0) return EdgeOwner::both;                  // a valley
  if (in_a_row || std::abs(beyond_first - along_second) <= slack) // one of them, by the line between
    beyond_first = along_second = (beyond_first + along_second) / 2;
  // a corner that stands out has both within a hair of it, so that corners that meet do not pass each other
  const double hair = turns ? std::min(contactors->radius.values[first], contactors->radius.values[second]) / 64 : 0;
  const double least = std::min(beyond_first, along_second), most = std::max(beyond_first, along_second);
  if (most <= slack) return !turns || least < -hair ? EdgeOwner::first : EdgeOwner::both;
  if (least > (turns ? -slack : slack)) return most > hair ? EdgeOwner::second : EdgeOwner::both;
  if (beyond_first > 0 || !(sine > 0)) return EdgeOwner::both;
  // behind one of them or both, where the boundary turns away: the nearer one, where that is clear
  const auto depth = [&](std::int32_t edge, const double* at, const double* along) {
    return std::max(contactors->radius.values[edge] - (x[0] - at[0]) * along[1] + (x[1] - at[1]) * along[0], 0.0);
  };
  const double behind_first = depth(first, at_e, e), behind_second = depth(second, at_f, f);
  if (behind_second > std::max(clearly * behind_first, hair)) return EdgeOwner::first;
  if (behind_first > std::max(clearly * behind_second, hair)) return EdgeOwner::second;
  return EdgeOwner::both;
}

std::int32_t InteractionHandler::Workspace::edge_that_has_it(const Candidates& out, std::int64_t i) const {
  const std::int32_t a = out.contactor_a[i], b = out.contactor_b[i];
  if (!info(Shape(contactors->shape.values[a])).ball() || mapped->place[std::size_t(b)] < 0) return b;
  const auto k = std::size_t(mapped->place[std::size_t(b)]);
  double x[2], shift[3] = {0, 0, 0};
  if (any_periodic) image_shift(*cell, out.image[i], shift);
  for (int c = 0; c < 2; ++c) x[c] = centre[2 * std::int64_t(a) + c] - shift[c];
  std::int32_t after = mapped->after[k], before = mapped->before[k];
  // What has a size bends the row round itself, and all of the edges there bear it, but where nothing has bent them.
  const auto bent = [&](std::int32_t next) {
    const double *e = &direction[3 * std::int64_t(b)], *f = &direction[3 * std::int64_t(next)];
    return e[0] * f[0] + e[1] * f[1] > nearly_one && std::abs(e[0] * f[1] - e[1] * f[0]) > on_end;
  };
  if (*contactors->radius[a] > 0) {
    if (after >= 0 && bent(after)) after = -1;
    if (before >= 0 && bent(before)) before = -1;
  }
  if (after >= 0 && owner_at_corner(b, after, x) == EdgeOwner::second) return after;
  return before >= 0 && owner_at_corner(before, b, x) == EdgeOwner::first ? before : b;
}

// Whether a contact is to be left to the next edge, which has one: points of a body that touches itself have none with
// the edges that they are next to.
bool InteractionHandler::Workspace::is_on_next_edge(const Candidates& out, std::int64_t i) const {
  const std::int32_t owner = edge_that_has_it(out, i);
  if (owner == out.contactor_b[i]) return false;
  for (const int way : {-1, 1})
    for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
      if (out.contactor_b[j] == owner && out.image[j] == out.image[i]) return true;
  return false;
}

void InteractionHandler::Workspace::put_declared_in_order() {
  declared_in_order = declared;
  for (DeclaredPair& pair : declared_in_order) std::sort(pair.begin(), pair.end());
  std::sort(declared_in_order.begin(), declared_in_order.end());
}

bool InteractionHandler::Workspace::is_declared(const Candidates& out, std::int64_t i) const {
  DeclaredPair pair{contactors->id.values[out.contactor_a[i]], contactors->id.values[out.contactor_b[i]]};
  std::sort(pair.begin(), pair.end());
  return std::binary_search(declared_in_order.begin(), declared_in_order.end(), pair);
}

// A pair that is declared goes on with the edge that has the point now, if that looks about the same way.
void InteractionHandler::Workspace::leave_to_next_edges(Candidates& out) {
  if (dim != 2 || !mapped) return;
  left.assign(std::size_t(out.count), 0);
  for (std::int64_t i = 0; i < out.count; ++i) left[std::size_t(i)] = is_on_next_edge(out, i);
  if (std::find(left.begin(), left.end(), 1) == left.end()) return;
  put_declared_in_order();
  const auto goes_on = [&](std::int64_t i, std::int64_t j) {
    const std::int64_t b = out.contactor_b[i], other = out.contactor_b[j];
    if (left[std::size_t(j)] || out.image[j] != out.image[i] || mapped->place[std::size_t(other)] < 0) return false;
    if (carrier[b] != carrier[other] || is_declared(out, j)) return false;
    const double *e = &direction[3 * b], *f = &direction[3 * other];
    return e[0] * f[0] + e[1] * f[1] > 0.5; // as follow_bonds_across_sides
  };
  const auto has_heir = [&](std::int64_t i) {
    for (const int way : {-1, 1})
      for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
        if (goes_on(i, j)) return true;
    return false;
  };
  if (!declared.empty()) {
    held.clear();
    for (std::int64_t i = 0; i < out.count; ++i)
      if (left[std::size_t(i)] && is_declared(out, i) && !has_heir(i)) held.push_back(i);
    for (const std::int64_t i : held) left[std::size_t(i)] = 0;
  }
  leave_out(out);
}

} // namespace cairn
