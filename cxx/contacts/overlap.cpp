// Displacements that take back overlap after a step. Laws act on velocities, so that an overlap which a step leaves
// stays, and hundreds of steps whose residuals have one sign leave a radius. The displacements are the smallest in the
// metric of mass that bring overlaps down to the limit and no other pair beyond it (Acary 2013), found by a few sweeps;
// later steps take back the rest. No velocity changes, so that no body gains speed.
#include <omp.h>

#include <algorithm>
#include <limits>

#include "../laws/law_names.hpp"
#include "interaction_state.hpp"

namespace cairn {
namespace {

// Laws that ask for no overlap of their own, and whose contacts do not pull by how far they are open.
bool takes_back(Law law) {
  switch (law) {
  case Law::signorini_coulomb:
  case Law::newton_restitution:
  case Law::frictionless:
  case Law::rolling_friction:
  case Law::limited_slip:
  case Law::wet:
  case Law::capillary: return true;
  default: return false;
  }
}

constexpr int most_sweeps = 8;        // measured: the deepest overlap of a pack is no smaller with 50
constexpr double least_change = 1e-3; // of a sweep, over the largest of a sweep, below which sweeps end
constexpr double deep = 4;            // overlap beyond the limit, over the limit, above which no step ends early

} // namespace

bool Interactions::State::limits_overlap(const cairn_batch& b) const {
  return overlap_limit < std::numeric_limits<double>::infinity() && !pose.kernel && !b.mapped_a && !b.mapped_b &&
         takes_back(Law(b.law));
}

// True if all moving contactors are balls, alone or in clumps.
bool Interactions::State::all_balls() const {
  if (meshes) return false;
  for (std::int64_t k = 0; k < contactors->count; ++k)
    if ((kind[k] & moving) && !info(Shape(*contactors->shape[k])).ball()) return false;
  return true;
}

// How much of a gap is overlap beyond the limit; negative: how far it is from that [m].
double Interactions::State::overlap_beyond(std::int64_t i, double gap, double& size) const {
  const double ra = *contactors->radius[candidates->contactor_a[std::size_t(i)]],
               rb = *contactors->radius[candidates->contactor_b[std::size_t(i)]];
  size = ra > 0 && rb > 0 ? std::min(ra, rb) : std::max(ra, rb);
  return -gap - overlap_limit * size;
}

double Interactions::State::deepest_drift() const {
  double deepest = 0;
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts && limits_overlap(b); ++lane) {
      const std::int64_t i = system.candidate[b.first + lane];
      double size = 0;
      if (const double beyond = overlap_beyond(i, candidates->gap[std::size_t(i)], size); beyond > 0)
        deepest = std::max(deepest, beyond / size);
    }
  return deepest;
}

// Once overlap adds up all the same, steps are solved to their tolerance.
bool Interactions::State::may_end_early() const {
  return !(overlap_limit < std::numeric_limits<double>::infinity()) || system.drift <= deep * overlap_limit;
}

void Interactions::State::note_loaded() {
  fit(loaded, std::size_t(system.places()));
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts; ++lane) loaded[b.first + lane] = at(b, b.r, lane, 0) > 0;
}

// Velocities along normals that displacements over a step are to have at least. False: none is above 0.
bool Interactions::State::ask_for_parting(const cairn_schedule& schedule, bool persisting) {
  bool any = false;
  for (std::size_t k = 0; k < system.batches.size(); ++k) {
    const cairn_batch& b = system.batches[k];
    const bool limited = limits_overlap(b);
    double u[6 * 128];
    cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = system.candidate[b.first + lane];
      const double gap = candidates->gap[std::size_t(i)] + h * theta * u[lane]; // at the end of the step
      double size = 0, beyond = overlap_beyond(i, gap, size);
      const bool may = limited && (!persisting || (loaded[b.first + lane] && at(b, b.r, lane, 0) > 0));
      if (!limited) beyond = std::min(0.0, -gap);
      beyond = std::min(beyond, may ? overlap_limit * size : 0.0);
      asked[b.first + lane] = beyond / h;
      any = any || beyond > 0;
    }
  }
  return any;
}

bool Interactions::part_overlaps(const Bodies& bodies, bool persisting, Array<double>& velocity) {
  State& s = *s_;
  ContactSystem& system = s.system;
  if (system.batches.empty()) return false;
  const cairn_schedule schedule = system.schedule(omp_get_max_threads());
  fit(s.asked, std::size_t(system.places()));
  fit(s.parting, std::size_t(system.places()));
  if (!s.ask_for_parting(schedule, persisting)) return false;
  std::fill_n(s.parting.begin(), system.places(), 0.0);
  system.clear_velocities();
  double largest = 0;
  for (int n = 0; n < most_sweeps; ++n) {
    cairn_normal_sweep(1, &schedule, s.asked.data(), s.parting.data(), system.change.data());
    double change = 0;
    for (std::size_t b = 0; b < system.batches.size(); ++b) change += system.change[b];
    largest = std::max(largest, change);
    if (!(change > least_change * largest)) break;
  }
  const int dofs = system.velocities();
  fit(velocity, std::size_t(dofs) * std::size_t(bodies.count));
  for (std::int64_t b = 0; b < bodies.count; ++b)
    std::copy_n(system.record[b].x, dofs, &velocity[std::size_t(dofs * b)]);
  system.load({bodies.velocity, s.meshes ? &s.nodes->velocity : nullptr});
  return true;
}

} // namespace cairn
