// Ropes over a pulley: joints of three ends. The near end and the pulley are the sides of the contact; what runs from
// the pulley to the far end is added to it: the same impulse acts there, so that the rope has one tension.
#include "ropes.hpp"

#include <algorithm>
#include <cmath>

#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/contact_rows.hpp"

namespace cairn {
namespace {

// Row of H' of a point on a body, its velocity along n: 2D (n, moment), 3D (n, moments).
void row_of(int dim, const double* lever, const double* n, double sign, double* row) {
  for (int k = 0; k < dim; ++k) row[k] = sign * n[k];
  if (dim == 2) {
    row[2] = sign * (lever[0] * n[1] - lever[1] * n[0]);
    return;
  }
  for (int k = 0; k < 3; ++k) {
    const int p = (k + 1) % 3, q = (k + 2) % 3;
    row[3 + k] = sign * (lever[p] * n[q] - lever[q] * n[p]);
  }
}

} // namespace

// Marks of a rope. Its three marks have a material of their own; the law of that material names the pulley and the far
// end by their order of ids.
std::optional<RopeEnds> rope_ends(const Contactors& contactors, const LawTable& laws, int material) {
  const int entry = laws.find(material, material);
  if (entry < 0 || !law_infos()[std::size_t(laws.entry(entry).law)].joins) return std::nullopt;
  const double* params = laws.entry(entry).params;
  const int pulley = int(params[joint_pulley]) - 1, far = int(params[joint_far]) - 1;
  if (pulley < 0) return std::nullopt;
  std::int32_t mark[3];
  int found = 0;
  for (std::int64_t c = 0; c < contactors.count; ++c)
    if (*contactors.material[c] == material && found < 3) mark[found++] = std::int32_t(c);
  if (found < 3 || far < 0 || far == pulley) return RopeEnds{};
  std::sort(mark, mark + 3, [&](std::int32_t i, std::int32_t j) { return *contactors.id[i] < *contactors.id[j]; });
  return RopeEnds{mark[3 - pulley - far], mark[pulley], mark[far]};
}

void Ropes::find(const Contactors& of, const LawTable& by) {
  of_material_.clear();
  for (int e = 0; e < by.entries(); ++e) {
    const LawTable::Entry& rule = by.entry(e);
    if (!law_infos()[std::size_t(rule.law)].joins || !(rule.params[joint_pulley] > 0)) continue;
    of_material_.resize(std::size_t(by.materials()));
    for (int m = 0; m < by.materials(); ++m)
      if (by.find(m, m) == e) of_material_[std::size_t(m)] = rope_ends(of, by, m);
  }
}

Ropes::FarPart Ropes::far_part(std::int64_t i) const {
  const RopeEnds& ends = *of_material_[std::size_t(*in_.contactors->material[in_.candidates->contactor_a[i]])];
  FarPart part;
  part.body[0] = in_.body(ends.far);
  part.body[1] = in_.body(ends.pulley);
  double at[2][3] = {}, square = 0;
  for (const auto& [end, mark] : {std::pair{0, ends.far}, std::pair{1, ends.pulley}}) {
    double own[3] = {};
    if (in_.contactors->offset.active) std::copy_n(in_.contactors->offset[mark], in_.dim(), own);
    in_.carried(mark, own, part.lever[end]);
    in_.carrier_at(mark, at[end]);
  }
  for (int k = 0; k < in_.dim(); ++k) {
    part.normal[k] = (at[0][k] - at[1][k]) + (part.lever[0][k] - part.lever[1][k]);
    square += part.normal[k] * part.normal[k];
  }
  part.length = std::sqrt(square);
  for (int k = 0; k < in_.dim() && part.length > 0; ++k) part.normal[k] /= part.length;
  return part;
}

// Terms of the far part in the velocity of the contact and in W, and the response of its bodies to a unit impulse.
void Ropes::fill(cairn_batch& b) const {
  const int d = in_.dim(), n = system_.velocities();
  for (int lane = 0; lane < b.count && b.rope; ++lane) {
    double* to = b.rope + rope_numbers * lane;
    std::fill_n(to, rope_numbers, 0.0);
    std::fill_n(b.rope_body + 2 * lane, 2, std::int32_t(system_.bodies));
    if (lane >= b.contacts) continue;
    const std::int64_t i = system_.candidate[b.first + lane];
    const FarPart part = far_part(i);
    double axes[3][3], near[6];
    axes_of(b, d, lane, axes);
    // whether the pulley is on side A; where that is a mesh, body_a is no number of a rigid body
    const bool first = in_.candidates->contactor_a[i] ==
                       of_material_[std::size_t(*in_.contactors->material[in_.candidates->contactor_a[i]])]->pulley;
    row_of(d, part.lever[1], axes[0], first ? 1 : -1, near);
    for (int end = 0; end < 2; ++end) {
      double *row = to + 2 + 12 * end, *answer = row + 6, mass[36], inverse[36];
      row_of(d, part.lever[end], part.normal, end ? -1 : 1, row);
      body_mass(system_, part.body[end], mass, inverse);
      for (int k = 0; k < n; ++k)
        for (int l = 0; l < n; ++l) answer[k] += inverse[n * l + k] * row[l];
      for (int k = 0; k < n; ++k) to[1] += answer[k] * (row[k] + (end ? 2 * near[k] : 0));
      b.rope_body[2 * lane + end] = part.body[end];
    }
  }
}

} // namespace cairn
