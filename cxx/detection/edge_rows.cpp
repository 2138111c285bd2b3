// Each edge of a mesh in the plane is a bar with round ends inside the body, and the end of one lies under the next: a
// node that slides over the next edge would meet it at an angle. A point beside the one edge and beyond the other is
// the former's alone, as in space (facet_view.f90). In a valley it is beside both; and at a corner that stands out,
// beyond both, both ends are near.
#include "edge_rows.hpp"

#include <algorithm>
#include <cmath>

#include "../base/vectors.hpp"
#include "edge_limits.hpp"

namespace cairn::detection {

namespace {

constexpr double clearly = 16;          // times as deep behind one edge as behind the other
constexpr double straight = 1.0 / 1024; // sine between edges that are in a row as loads bend them, and have no valley

} // namespace

EdgeRows::Owner EdgeRows::owner_at_corner(std::int32_t first, std::int32_t second, const double* x) const {
  const double *e = &scene_.direction[3 * std::int64_t(first)], *f = &scene_.direction[3 * std::int64_t(second)];
  const double *at_e = &scene_.centre[2 * std::int64_t(first)], *at_f = &scene_.centre[2 * std::int64_t(second)];
  double beyond_first = (x[0] - at_e[0]) * e[0] + (x[1] - at_e[1]) * e[1] - e[2];
  double along_second = (x[0] - at_f[0]) * f[0] + (x[1] - at_f[1]) * f[1] + f[2];
  const double slack = on_end * (e[2] + f[2]), cosine = e[0] * f[0] + e[1] * f[1];
  const double sine = e[0] * f[1] - e[1] * f[0];
  const bool in_a_row = cosine > 0 && std::abs(sine) <= straight, turns = cosine < nearly_one;
  if (turns && sine < 0) return Owner::both;                      // a valley
  if (in_a_row || std::abs(beyond_first - along_second) <= slack) // one of them, by the line between
    beyond_first = along_second = (beyond_first + along_second) / 2;
  // a corner that stands out has both within a hair of it, so that corners that meet do not pass each other
  const double hair =
      turns ? std::min(scene_.contactors->radius.values[first], scene_.contactors->radius.values[second]) / 64 : 0;
  const double least = std::min(beyond_first, along_second), most = std::max(beyond_first, along_second);
  if (most <= slack) return !turns || least < -hair ? Owner::first : Owner::both;
  if (least > (turns ? -slack : slack)) return most > hair ? Owner::second : Owner::both;
  if (beyond_first > 0 || !(sine > 0)) return Owner::both;
  // behind an edge or both, where the boundary turns away: the nearer edge, if clearly nearer
  const auto depth = [&](std::int32_t edge, const double* at, const double* along) {
    return std::max(scene_.contactors->radius.values[edge] - (x[0] - at[0]) * along[1] + (x[1] - at[1]) * along[0],
                    0.0);
  };
  const double behind_first = depth(first, at_e, e), behind_second = depth(second, at_f, f);
  if (behind_second > std::max(clearly * behind_first, hair)) return Owner::first;
  if (behind_first > std::max(clearly * behind_second, hair)) return Owner::second;
  return Owner::both;
}

std::int32_t EdgeRows::edge_that_has_it(const Candidates& out, std::int64_t i) const {
  const std::int32_t a = out.contactor_a[i], b = out.contactor_b[i];
  if (!scene_.shape(a).ball() || scene_.mapped->place[std::size_t(b)] < 0) return b;
  const auto k = std::size_t(scene_.mapped->place[std::size_t(b)]);
  double x[2], shift[3] = {0, 0, 0};
  if (scene_.any_periodic) image_shift(*scene_.cell, out.image[i], shift);
  for (int c = 0; c < 2; ++c) x[c] = scene_.centre[2 * std::int64_t(a) + c] - shift[c];
  std::int32_t after = scene_.mapped->after[k], before = scene_.mapped->before[k];
  // A body with a radius touches several edges around it, and all of them carry it, unless they are in a straight row.
  const auto bent = [&](std::int32_t next) {
    const double *e = &scene_.direction[3 * std::int64_t(b)], *f = &scene_.direction[3 * std::int64_t(next)];
    return e[0] * f[0] + e[1] * f[1] > nearly_one && std::abs(e[0] * f[1] - e[1] * f[0]) > on_end;
  };
  if (*scene_.contactors->radius[a] > 0) {
    if (after >= 0 && bent(after)) after = -1;
    if (before >= 0 && bent(before)) before = -1;
  }
  if (after >= 0 && owner_at_corner(b, after, x) == Owner::second) return after;
  return before >= 0 && owner_at_corner(before, b, x) == Owner::first ? before : b;
}

// True if a contact is left to the next edge, which has a contact, too: points of a self-contacting body have none with
// adjacent edges.
bool EdgeRows::is_on_next_edge(const Candidates& out, std::int64_t i) const {
  const std::int32_t owner = edge_that_has_it(out, i);
  if (owner == out.contactor_b[i]) return false;
  for (const int way : {-1, 1})
    for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
      if (out.contactor_b[j] == owner && out.image[j] == out.image[i]) return true;
  return false;
}

// Keeps contacts of declared pairs where no other contact goes on with them: with the edge that has the point now, if
// it looks about the same way.
void EdgeRows::hold_without_heir(DeclaredPairs& declared, DroppedContacts& dropped, const Candidates& out) {
  if (declared.pairs.empty()) return;
  declared.sort();
  const auto goes_on = [&](std::int64_t i, std::int64_t j) {
    const std::int64_t b = out.contactor_b[i], other = out.contactor_b[j];
    if (dropped[j] || out.image[j] != out.image[i] || scene_.mapped->place[std::size_t(other)] < 0) return false;
    if (scene_.carrier[b] != scene_.carrier[other] || declared.has(scene_, out, j)) return false;
    const double *e = &scene_.direction[3 * b], *f = &scene_.direction[3 * other];
    return e[0] * f[0] + e[1] * f[1] > 0.5; // as follow_bonds_across_sides
  };
  const auto has_heir = [&](std::int64_t i) {
    for (const int way : {-1, 1})
      for (std::int64_t j = i + way; j >= 0 && j < out.count && out.contactor_a[j] == out.contactor_a[i]; j += way)
        if (goes_on(i, j)) return true;
    return false;
  };
  held_.clear();
  for (std::int64_t i = 0; i < out.count; ++i)
    if (dropped[i] && declared.has(scene_, out, i) && !has_heir(i)) held_.push_back(i);
  for (const std::int64_t i : held_) dropped[i] = 0;
}

void EdgeRows::drop(DeclaredPairs& declared, DroppedContacts& dropped, Candidates& out) {
  if (scene_.dim != 2 || !scene_.mapped) return;
  dropped.begin(out);
  for (std::int64_t i = 0; i < out.count; ++i) dropped[i] = is_on_next_edge(out, i);
  if (!dropped.any()) return;
  hold_without_heir(declared, dropped, out);
  dropped.remove(out, scene_.dim);
}

} // namespace cairn::detection
