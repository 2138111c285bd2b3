#include "impulse_transfer.hpp"

#include <algorithm>

#include "../base/vectors.hpp"
#include "../solvers/sweeps/batch.hpp"

namespace cairn {

// Impulses of contacts to the nodes of meshes.
void ImpulseTransfer::give_meshes() const {
  for (MeshBody& mesh : in_.meshes->meshes) std::fill(mesh.impulse.begin(), mesh.impulse.end(), 0.0);
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts && (b.mapped_a || b.mapped_b); ++lane) {
      double p[3], m[3];
      space_impulse(in_.dim(), b, lane, p, m);
      const auto give = [&](std::int32_t which, const std::int32_t* node, const double* weight, double sign) {
        MeshBody& mesh = in_.meshes->meshes[which];
        for (int j = 0; j < 4; ++j)
          system_.condensed[which].each_node(std::size_t(node[j * b.count + lane]), [&](std::int32_t at, double share) {
            for (int k = 0; k < in_.dim(); ++k)
              mesh.impulse[in_.dim() * (at - mesh.node(0)) + k] += share * (sign * weight[j * b.count + lane]) * p[k];
          });
      };
      if (b.mapped_a) give(b.body_a[lane], b.node_a, b.lever_a, 1);
      if (b.mapped_b) give(b.body_b[lane], b.node_b, b.lever_b, -1);
      if (b.turns) give_moment(b, lane);
    }
}

// Their velocities follow from one solution each.
void ImpulseTransfer::push_meshes() const {
  give_meshes();
  for (MeshBody& mesh : in_.meshes->meshes) mesh.push(*in_.nodes);
}

// The far part of a rope, to bodies that are driven.
void ImpulseTransfer::pull_driven(Bodies& bodies, const cairn_batch& b, int lane) const {
  for (int end = 0; end < 2; ++end) {
    const std::int32_t who = b.rope_body[2 * lane + end];
    if (bodies.driven.active && !*bodies.driven[who]) continue;
    const double* row = b.rope + rope_numbers * lane + 2 + 12 * end;
    for (int k = 0; k < system_.velocities(); ++k) bodies.reaction[who][k] += b.r[lane] * row[k];
  }
}

void ImpulseTransfer::add_reactions(Bodies& bodies) const {
  const int d = in_.dim();
  const auto driven = [&](std::int32_t who) { return !bodies.driven.active || *bodies.driven[who]; };
  const auto add = [&](const cairn_batch& b, int lane, std::int32_t who, int side, double* lever, double sign,
                       const double p[3], const double m[3]) {
    double l[3] = {0, 0, 0};
    const bool radial = is_radial(side);
    for (int k = 0; k < d; ++k) l[k] = radial ? at(b, lever, lane, 0) * at(b, b.frame, lane, k) : at(b, lever, lane, k);
    double* to = bodies.reaction[who];
    for (int k = 0; k < d; ++k) to[k] += sign * p[k];
    if (d == 2)
      to[2] += sign * (l[0] * p[1] - l[1] * p[0] + m[2]);
    else {
      double moment[3];
      cross(l, p, moment);
      for (int k = 0; k < 3; ++k) to[3 + k] += sign * (moment[k] + m[k]);
    }
  };
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      // meshes account for their own supports
      const bool a = !b.mapped_a && driven(b.body_a[lane]), other = !b.mapped_b && driven(b.body_b[lane]);
      if (b.rope && !b.pack) pull_driven(bodies, b, lane);
      if (!a && !other) continue; // most are not
      double p[3], m[3];
      space_impulse(in_.dim(), b, lane, p, m);
      if (a) add(b, lane, b.body_a[lane], b.side_a, b.lever_a, 1, p, m);
      if (other) add(b, lane, b.body_b[lane], b.side_b, b.lever_b, -1, p, m);
    }
}

// The moment of a contact to the nodes of the face that it turns against, as a couple.
void ImpulseTransfer::give_moment(const cairn_batch& b, int lane) const {
  const int d = in_.dim(), side = b.mapped_b ? 1 : 0;
  const std::int32_t which = (side ? b.body_b : b.body_a)[lane], *node = side ? b.node_b : b.node_a;
  MeshBody& mesh = in_.meshes->meshes[std::size_t(which)];
  for (int j = 0; b.turns[lane] && j < (side ? b.nodes_b : b.nodes_a); ++j)
    system_.condensed[which].each_node(std::size_t(node[j * b.count + lane]), [&](std::int32_t at, double) {
      for (int l = 0; l < d; ++l)
        for (int k = 0; k < b.components - d; ++k)
          mesh.impulse[std::size_t(d * (at - mesh.node(0)) + l)] +=
              (side ? -1 : 1) * spin_of(b, d, side, lane, j, l, k) * b.r[(d + k) * b.count + lane];
    });
}

} // namespace cairn
