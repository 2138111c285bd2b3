// Contact errors on meshes that a converged step may hide: initial overlaps too deep to be pushed out, contacts that
// move by more than a cell in a step and may tunnel, and contacts that did tunnel.
#include "mesh_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>

#include "../../base/vectors.hpp"

namespace cairn {
namespace {

constexpr double deep_share = 0.5, far_share = 1; // of a cell, beyond which a step tells of it

// Velocity at the begin of the step of what a contactor carries, at a point.
void velocity_at(const Simulation& s, std::int32_t contactor, const double* point, double* out) {
  const int dim = s.scene.dim;
  if (s.meshes.carries(contactor)) {
    const MeshSet::Middle& middle = s.meshes.middle(contactor);
    for (int k = 0; k < dim; ++k) out[k] = middle.of(s.scene.nodes.velocity, k);
    return;
  }
  const Bodies& b = s.scene.bodies;
  const std::int64_t body = *s.scene.contactors.body[contactor];
  const double *v = b.velocity[body], *x = b.position[body];
  double arm[3] = {};
  for (int k = 0; k < dim; ++k) out[k] = v[k], arm[k] = point[k] - x[k];
  if (dim == 2) {
    out[0] -= v[2] * arm[1];
    out[1] += v[2] * arm[0];
  } else {
    add_cross(v + 3, arm, out);
  }
}

std::string name_of(const Simulation& s, std::int32_t contactor) {
  if (s.meshes.carries(contactor)) return s.meshes.describe(contactor);
  return "body " + std::to_string(carrier_id(s.scene.bodies, s.scene.contactors, contactor));
}

// True if a law is bilateral: it resists gaps and overlaps alike.
bool holds(const Simulation& s, std::int32_t one, std::int32_t two) {
  const int entry = s.laws.find(*s.scene.contactors.material[one], *s.scene.contactors.material[two]);
  if (entry < 0) return true; // nothing acts between them
  const LawInfo& law = law_infos()[std::size_t(s.laws.entry(entry).law)];
  return law.joins || law.keeps;
}

// The normal of a side of a mesh, up to its sign and length; of nodes and points none.
bool normal_of_side(const Simulation& s, std::int32_t contactor, double* out) {
  if (!s.meshes.carries(contactor) || info(Shape(*s.scene.contactors.shape[contactor])).ball()) return false;
  const MeshSet::Middle& middle = s.meshes.middle(contactor);
  const Field<double>& x = s.scene.nodes.position;
  const double* corner[3];
  for (int j = 0; j < s.scene.dim; ++j) corner[j] = x[middle.node[j]];
  if (s.scene.dim == 2) {
    out[0] = corner[0][1] - corner[1][1];
    out[1] = corner[1][0] - corner[0][0];
    return true;
  }
  double e[3], f[3];
  for (int k = 0; k < 3; ++k) e[k] = corner[1][k] - corner[0][k], f[k] = corner[2][k] - corner[0][k];
  cross(e, f, out);
  return true;
}

// True if a contact lies in the interior of a side, false on its edge or end.
bool on_the_side(const Simulation& s, std::int32_t side, const double* normal) {
  double of_side[3], square = 0, along = 0;
  if (!normal_of_side(s, side, of_side)) return false;
  for (int k = 0; k < s.scene.dim; ++k) square += of_side[k] * of_side[k], along += of_side[k] * normal[k];
  constexpr double upright = 1 - 1e-6; // of a cosine
  return std::abs(along) > upright * std::sqrt(square);
}

// Normal relative velocity of a contact at the begin of the step [m/s]; positive where both separate.
double speed_of(const Simulation& s, std::int64_t i) {
  const Candidates& c = s.candidates;
  const auto at = std::size_t(s.scene.dim * i);
  double of_one[3], of_two[3], speed = 0;
  velocity_at(s, c.contactor_a[std::size_t(i)], &c.point[at], of_one);
  velocity_at(s, c.contactor_b[std::size_t(i)], &c.point[at], of_two);
  for (int k = 0; k < s.scene.dim; ++k) speed += (of_one[k] - of_two[k]) * c.normal[at + std::size_t(k)];
  return speed;
}

// Overlap of a contact before the step [m]: the least over all sides of the same body, since a point in front of any
// side is outside.
double depth_before(const Simulation& s, std::int64_t i, double ahead) {
  const Candidates& c = s.candidates;
  const std::int32_t one = c.contactor_a[std::size_t(i)];
  const std::int32_t body = *s.scene.contactors.body[c.contactor_b[std::size_t(i)]];
  const auto same = [&](std::int64_t k) {
    return k >= 0 && k < c.count && c.contactor_a[std::size_t(k)] == one &&
           *s.scene.contactors.body[c.contactor_b[std::size_t(k)]] == body;
  };
  std::int64_t first = i;
  while (same(first - 1)) --first;
  double deep = std::numeric_limits<double>::infinity();
  for (std::int64_t k = first; same(k); ++k) deep = std::min(deep, ahead * speed_of(s, k) - c.gap[std::size_t(k)]);
  return deep;
}

} // namespace

// Velocities are evaluated for few candidates: the others have no overlap, or move too slowly for the search margin.
void look_at_meshes(Simulation& s, const StepScheme& step, const double* margins) {
  const double h = step.h;
  s.report.mesh_depth = s.report.mesh_way = 0;
  s.report.mesh_hint.clear();
  if (s.meshes.empty()) return;
  const Candidates& c = s.candidates;
  const int dim = s.scene.dim;
  const Contactors& contactors = s.scene.contactors;
  const double ahead = step.ahead; // for which bodies move on before contacts are sought
  std::int64_t deepest = -1, farthest = -1, through = -1;
  double depth = 0, way = 0, beyond = 0, safe = 0;
  for (std::int64_t i = 0; i < c.count; ++i) {
    const std::int32_t one = c.contactor_a[i], two = c.contactor_b[i];
    const double size = s.meshes.cell_size(one, two), gap = c.gap[std::size_t(i)];
    if (!std::isfinite(size)) continue;                                           // of rigid bodies
    const double apart = gap + *contactors.radius[one] + *contactors.radius[two]; // of their middles
    const double most = margins ? margins[one] + margins[two] : std::numeric_limits<double>::infinity();
    if (!(gap < -s.report.mesh_depth * size) && most <= far_share * size && ahead / h * most <= apart) continue;
    const double* normal = &c.normal[std::size_t(dim * i)];
    const double speed = speed_of(s, i);
    if (gap < -s.report.mesh_depth * size && !holds(s, one, two))
      if (const double deep = depth_before(s, i, ahead); deep > s.report.mesh_depth * size)
        s.report.mesh_depth = deep / size, depth = deep, deepest = i;
    if (const double moved = h * std::abs(speed); moved > std::max(s.report.mesh_way, far_share) * size)
      s.report.mesh_way = moved / size, way = moved, farthest = i;
    if (apart > 0 && ahead * speed - apart > beyond && (on_the_side(s, one, normal) || on_the_side(s, two, normal)) &&
        !holds(s, one, two))
      beyond = ahead * speed - apart, through = i, safe = h * (apart - gap) / (ahead * speed);
  }
  char text[160];
  const auto both = [&](std::int64_t i) {
    return std::pair(name_of(s, c.contactor_a[std::size_t(i)]), name_of(s, c.contactor_b[std::size_t(i)]));
  };
  if (s.report.mesh_depth > deep_share) {
    const auto [one, two] = both(deepest);
    std::snprintf(text, sizeof text, " overlap by %.3g m before step %lld, %.2g of the size of a cell there", depth,
                  static_cast<long long>(s.steps + 1), s.report.mesh_depth);
    s.report.mesh_hint = one + " and " + two + text +
                         ", and contacts do not push them apart: let them begin apart, or give a smaller dt to what "
                         "brought them there";
  }
  if (through >= 0) { // it is sought where it lies behind the side by now
    const auto [one, two] = both(through);
    std::snprintf(text, sizeof text, " pass through each other in step %lld: give dt <= %.2g s",
                  static_cast<long long>(s.steps + 1), safe);
    if (!s.report.mesh_hint.empty()) s.report.mesh_hint += "; ";
    s.report.mesh_hint += one + " and " + two + text;
  } else if (s.report.mesh_way > far_share) {
    const auto [one, two] = both(farthest);
    std::snprintf(text, sizeof text,
                  " move by %.3g m along their normal in step %lld, %.2g of the size of a cell there", way,
                  static_cast<long long>(s.steps + 1), s.report.mesh_way);
    if (!s.report.mesh_hint.empty()) s.report.mesh_hint += "; ";
    s.report.mesh_hint += one + " and " + two + text + ", and may pass through each other: give dt <= ";
    std::snprintf(text, sizeof text, "%.2g s", h * far_share / s.report.mesh_way);
    s.report.mesh_hint += text;
  }
}

} // namespace cairn
