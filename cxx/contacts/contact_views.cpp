#include "contact_views.hpp"

#include <algorithm>
#include <limits>

#include "../base/call.hpp"
#include "../solvers/sweeps/batch.hpp"
#include "../solvers/sweeps/contact_rows.hpp"
#include "assembly_input.hpp"
#include "batch_storage.hpp"
#include "surface_motion.hpp"

namespace cairn {

std::int64_t ContactViews::count() const { return in_.candidates ? in_.candidates->count : 0; }

void ContactViews::impulse_local(double* out) const {
  const int d = in_.dim();
  std::fill(out, out + d * count(), 0.0);
  each_contact(system_, [&](const cairn_batch& b, int lane, std::int64_t i) {
    for (int k = 0; k < d; ++k) out[d * i + k] = at(b, b.r, lane, k);
  });
}

void ContactViews::impulse_space(double* out) const {
  const int d = in_.dim();
  std::fill(out, out + d * count(), 0.0);
  each_contact(system_, [&](const cairn_batch& b, int lane, std::int64_t i) {
    double p[3], m[3];
    space_impulse(in_.dim(), b, lane, p, m);
    std::copy_n(p, d, out + d * i);
  });
}

void ContactViews::moment_space(double* out) const {
  const int d = in_.dim() == 2 ? 1 : 3;
  std::fill(out, out + d * count(), 0.0);
  each_contact(system_, [&](const cairn_batch& b, int lane, std::int64_t i) {
    double p[3], m[3];
    space_impulse(in_.dim(), b, lane, p, m);
    std::copy_n(m + 3 - d, d, out + d * i);
  });
}

void ContactViews::relative_velocity(double* out) const {
  const int d = in_.dim();
  std::fill(out, out + d * count(), 0.0);
  const cairn_schedule schedule = system_.schedule(1);
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    double u[6 * 128];
    cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
    for (int lane = 0; lane < b.contacts; ++lane) {
      if (in_.has_jumps()) add_jump(in_, system_, b, lane, u);
      for (int c = 0; c < d; ++c) out[std::int64_t(d) * system_.candidate[b.first + lane] + c] = u[c * b.count + lane];
    }
  }
}

void ContactViews::status(std::int32_t* out) const {
  std::fill(out, out + count(), std::int32_t(cairn_open));
  each_contact(system_, [&](const cairn_batch& b, int lane, std::int64_t i) { out[i] = b.status[lane]; });
}

void ContactViews::keys(std::int64_t* out) const {
  for (std::int64_t i = 0; i < count(); ++i) {
    const ContactKey k = in_.key(i);
    for (const std::int64_t word : {k.contactor_a, k.contactor_b, std::int64_t(k.feature), std::int64_t(k.image)})
      *out++ = word;
  }
}

void ContactViews::dissipated(double* out) const {
  std::fill(out, out + count(), 0.0);
  each_contact(system_, [&](const cairn_batch& b, int lane, std::int64_t i) { out[i] = -0.5 * b.scale[lane]; });
}

ContactRows ContactViews::rows() const {
  const int d = in_.dim();
  const auto n = std::size_t(count());
  ContactRows rows{.axes = std::vector<double>(d * d * n),
                   .lever = std::vector<double>(2 * d * n),
                   .bias = std::vector<double>(d * n),
                   .mu = std::vector<double>(n),
                   .compliance = std::vector<double>(d * n),
                   .bodies = std::vector<std::int32_t>(2 * n),
                   .kind = std::vector<std::int32_t>(n),
                   .mesh = {},
                   .node = {},
                   .weight = {}};
  if (in_.meshes) {
    rows.mesh.assign(2 * n, -1);
    rows.node.assign(8 * n, 0);
    rows.weight.assign(8 * n, 0);
  }
  each_contact(system_, [&](const cairn_batch& b, int lane, std::int64_t i) {
    double axes[3][3];
    axes_of(b, d, lane, axes);
    const auto lever = [&](double* from, std::int32_t side, int k) {
      if (sides()[side].scatter == nullptr) return 0.0; // of a mesh: weights of nodes
      return is_radial(side) ? at(b, from, lane, 0) * axes[0][k] : at(b, from, lane, k);
    };
    for (int k = 0; k < d; ++k) {
      for (int c = 0; c < d; ++c) rows.axes[d * d * i + d * c + k] = axes[c][k];
      rows.lever[2 * d * i + k] = lever(b.lever_a, b.side_a, k);
      rows.lever[2 * d * i + d + k] = lever(b.lever_b, b.side_b, k);
      rows.bias[d * i + k] = b.pack ? (k == 0 ? at(b, b.bias, lane, 0) : 0) : b.bias[k * b.count + lane];
    }
    for (int k = 0; b.compliance && k < d; ++k) rows.compliance[d * i + k] = b.compliance[k * b.count + lane];
    const bool cone = !law_infos()[b.law].has_solve;
    rows.mu[i] = cone ? at(b, b.params, lane, 0) : 0;
    rows.bodies[2 * i] = b.mapped_a ? -1 : b.body_a[lane];
    rows.bodies[2 * i + 1] = b.mapped_b ? -1 : b.body_b[lane];
    rows.kind[i] = !cone ? 2 : at(b, b.bias, lane, 0) < never() ? 1 : 0;
    const auto map = [&](std::int64_t side, std::int32_t which, const std::int32_t* node, const double* weight) {
      rows.mesh[side] = which;
      const CondensedBody& body = system_.condensed[which];
      const std::int32_t first = in_.meshes->meshes[which].node(0);
      for (int j = 0; j < 4; ++j) {
        const auto row = std::size_t(node[j * b.count + lane]);
        if (row >= body.node.size())
          throw Error(
              "a contact of the mesh '" + in_.meshes->meshes[which].model.name +
              "' is a mortar over more than four nodes, of which there are no rows: leave mortar out, or ask a scene "
              "without");
        rows.node[4 * side + j] = body.node[row] - first;
        rows.weight[4 * side + j] = weight[j * b.count + lane];
      }
    };
    if (b.mapped_a) map(2 * i, b.body_a[lane], b.node_a, b.lever_a);
    if (b.mapped_b) map(2 * i + 1, b.body_b[lane], b.node_b, b.lever_b);
  });
  return rows;
}

void ContactViews::stored(double* out) const {
  std::fill(out, out + count(), 0.0);
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    for (int lane = 0; lane < b.contacts && storage_.of_law[k].energy; ++lane)
      out[system_.candidate[b.first + lane]] = storage_.of_law[k].energy[lane];
  }
}

void ContactViews::soundness(double* out) const {
  std::fill(out, out + count(), 0.0);
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts && law_infos()[std::size_t(b.law)].keeps; ++lane)
      // what a pressure in a crack keeps a pair, broken as it is, has less
      out[system_.candidate[b.first + lane]] = b.state[lane] > 0x1p-40 ? std::min(b.state[lane], 1.0) : 0;
}

void ContactViews::law_state(const std::string& name, double* out) const {
  std::fill(out, out + count(), 0.0);
  for (const cairn_batch& b : system_.batches) {
    const int column = law_infos()[std::size_t(b.law)].state_column(name, in_.dim());
    for (int lane = 0; lane < b.contacts && column >= 0; ++lane)
      out[system_.candidate[b.first + lane]] = b.state[column * b.count + lane];
  }
}

void ContactViews::attraction(double* out) const {
  std::fill(out, out + count(), 0.0);
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts && law_infos()[std::size_t(b.law)].attracts; ++lane)
      if (b.status[lane] != cairn_open) out[system_.candidate[b.first + lane]] = b.params[lane];
}

} // namespace cairn
