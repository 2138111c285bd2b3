#include "applied_pose.hpp"

#include <algorithm>
#include <utility>

#include "../solvers/sweeps/batch.hpp"

namespace cairn {

// Impulses besides those that are sought: they change the free velocity, and come on top of the solution.
Velocities AppliedPose::free_with_given(const Bodies& bodies) {
  velocity_given_ = bodies.velocity_free;
  if (in_.meshes) nodes_given_ = in_.nodes->velocity_free;
  if (!system_.batches.empty()) {
    swap_in();
    system_.load(in_.free(bodies));
    const cairn_schedule schedule = system_.schedule(1);
    cairn_add_impulses(&schedule);
    system_.unload(velocity_given_, in_.meshes ? &nodes_given_ : nullptr);
    swap_in();
  }
  return {velocity_given_, in_.meshes ? &nodes_given_ : nullptr};
}

void AppliedPose::swap_in() const {
  for (const cairn_batch& b : system_.batches)
    std::swap_ranges(b.r, b.r + std::ptrdiff_t(b.count) * b.components, storage_.given_of(b));
}

void AppliedPose::add_given_to_solution() const {
  for (const cairn_batch& b : system_.batches)
    for (int i = 0; i < b.count * b.components; ++i) b.r[i] += storage_.given_of(b)[i];
}

// Applies the pose of the strategy in place of the prepared law, with the contact forces at the end of the last step.
void AppliedPose::apply(const cairn_batch& b, const double* gap, const double* u, double* compliance) const {
  const int n = b.count, d = in_.dim();
  if (law_infos()[b.law].joins) { // the gap of its marks is no error of a joint, which has conditions of its own
    std::fill_n(storage_.given_of(b), std::size_t(n) * b.components, 0.0);
    return;
  }
  alignas(64) double force[6 * 128], impulses[6 * 128];
  std::fill_n(force, std::size_t(n) * b.components, 0.0);
  for (int lane = 0; lane < b.contacts && !memory_.forces.empty(); ++lane) {
    const std::int32_t where = matcher_.place[b.first + lane];
    if (where < 0) continue;
    const double* f = &memory_.forces[std::size_t(where) * d];
    double axes[3][3];
    axes_of(b, d, lane, axes);
    for (int k = 0; k < d; ++k) {
      double along = d == 2 ? f[k] : 0;
      for (int l = 0; l < d && d == 3; ++l) along += axes[k][l] * f[l];
      force[k * n + lane] = along;
    }
  }
  in_.options.pose.kernel(n, b.components, in_.h, in_.theta, in_.options.pose.params, gap, u, force, b.bias, compliance,
                          impulses);
  std::copy_n(impulses, std::size_t(n) * b.components, storage_.given_of(b));
}

} // namespace cairn
