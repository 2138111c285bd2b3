// Displacements that take back overlap after a step. Laws act on velocities, so that an overlap which a step leaves
// stays, and hundreds of steps whose residuals have one sign leave a radius. The displacements are the smallest in the
// metric of mass that bring overlaps down to the limit and no other pair beyond it (Acary 2013), found by a few sweeps;
// later steps take back the rest. No velocity changes, so that no body gains speed.
#include "overlap_limit.hpp"

#include <omp.h>

#include <algorithm>
#include <limits>

#include "../contactors/shapes.hpp"
#include "../laws/law_info.hpp"
#include "../solvers/sweeps/batch.hpp"

namespace cairn {
namespace {

constexpr double least_change = 1e-3;        // of a sweep, over the largest of a sweep, below which sweeps end
constexpr double deep = 4;                   // overlap beyond the limit, over the limit, above which no step ends early
constexpr std::int64_t least_of_packs = 100; // contacts that press, as in a step that ends early
constexpr double of_masonry = 0.6; // share of pairs that touch by faces (measured: walls and vaults .7 to 1, rocks .6)

} // namespace

bool OverlapLimit::applies_to(const cairn_batch& b) const {
  return is_set() && !in_.options.pose.kernel && !b.mapped_a && !b.mapped_b &&
         law_infos()[std::size_t(b.law)].sheds_overlap;
}

// How much of a gap is overlap beyond the limit; negative: how far it is from that [m].
double OverlapLimit::overlap_beyond(std::int64_t i, double gap, double& size) const {
  const double ra = *in_.contactors->radius[in_.candidates->contactor_a[std::size_t(i)]],
               rb = *in_.contactors->radius[in_.candidates->contactor_b[std::size_t(i)]];
  size = ra > 0 && rb > 0 ? std::min(ra, rb) : std::max(ra, rb);
  return -gap - in_.options.overlap_limit * size;
}

double OverlapLimit::deepest_drift() const {
  double deepest = 0;
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts && applies_to(b); ++lane) {
      const std::int64_t i = system_.candidate[b.first + lane];
      double size = 0;
      if (const double beyond = overlap_beyond(i, in_.candidates->gap[std::size_t(i)], size); beyond > 0)
        deepest = std::max(deepest, beyond / size);
    }
  return deepest;
}

bool OverlapLimit::adds_up() const {
  return is_set() && system_.pack && system_.drift > deep * in_.options.overlap_limit;
}

bool OverlapLimit::persists() const {
  std::int64_t press = 0, persist = 0;
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane) {
      const bool presses = at(b, b.r, lane, 0) > 0;
      press += presses;
      persist += presses && loaded_[b.first + lane];
    }
  return press >= least_of_packs && 2 * persist > press;
}

// True if most pairs that pressed in the last step touch by a face: masonry, which stands by the balance of its blocks.
// Grains at random angles touch by corners and edges. Points of a pair follow each other.
bool OverlapLimit::bears_on_faces() {
  if (!is_set() || system_.clumps) return false;
  const Candidates& c = *in_.candidates;
  fit(pressed_, c.contactor_a.size());
  std::fill_n(pressed_.begin(), c.contactor_a.size(), char(0));
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane)
      if (at(b, b.r, lane, 0) > 0) pressed_[std::size_t(system_.candidate[b.first + lane])] = 1;
  std::int64_t pairs = 0, faces = 0;
  for (std::size_t i = 0, end = 0; i < c.contactor_a.size(); i = end) {
    bool presses = false;
    for (end = i;
         end < c.contactor_a.size() && c.contactor_a[end] == c.contactor_a[i] && c.contactor_b[end] == c.contactor_b[i];
         ++end)
      presses = presses || pressed_[end] != 0;
    pairs += presses;
    faces += presses && end - i >= std::size_t(in_.dim());
  }
  return double(faces) >= of_masonry * double(pairs); // in a first step none has pressed
}

void OverlapLimit::note_loaded() {
  fit(loaded_, std::size_t(system_.places()));
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts; ++lane) loaded_[b.first + lane] = at(b, b.r, lane, 0) > 0;
}

// Velocities along normals that displacements over a step are to have at least. False: none is above 0.
bool OverlapLimit::ask(const cairn_schedule& schedule, bool persisting) {
  fit(asked_, std::size_t(system_.places()));
  bool any = false;
  for (std::size_t k = 0; k < system_.batches.size(); ++k) {
    const cairn_batch& b = system_.batches[k];
    const bool limited = applies_to(b);
    double u[6 * 128];
    cairn_relative_velocities(&schedule, std::int32_t(k), 0, u);
    for (int lane = 0; lane < b.contacts; ++lane) {
      const std::int64_t i = system_.candidate[b.first + lane];
      const double gap = in_.candidates->gap[std::size_t(i)] + in_.h * in_.theta * u[lane]; // at the end of the step
      double size = 0, beyond = overlap_beyond(i, gap, size);
      const bool may = limited && (!persisting || (loaded_[b.first + lane] && at(b, b.r, lane, 0) > 0));
      if (!limited) beyond = std::min(0.0, -gap);
      beyond = std::min(beyond, may ? in_.options.overlap_limit * size : 0.0);
      asked_[b.first + lane] = beyond / in_.h;
      any = any || beyond > 0;
    }
  }
  return any;
}

void OverlapLimit::begin() {
  fit(impulse_, std::size_t(system_.places()));
  std::fill_n(impulse_.begin(), system_.places(), 0.0);
  system_.clear_velocities();
}

void OverlapLimit::sweep(const cairn_schedule& schedule) {
  cairn_normal_sweep(1, &schedule, asked_.data(), impulse_.data(), system_.change.data());
}

bool OverlapLimit::ends(double change, double largest) { return !(change > least_change * largest); }

bool OverlapLimit::find_velocities(const Bodies& bodies, bool persisting, Array<double>& velocity) {
  if (system_.batches.empty()) return false;
  const cairn_schedule schedule = system_.schedule(omp_get_max_threads());
  if (!ask(schedule, persisting)) return false;
  begin();
  double largest = 0;
  for (int n = 0; n < most_sweeps; ++n) {
    sweep(schedule);
    double change = 0;
    for (std::size_t b = 0; b < system_.batches.size(); ++b) change += system_.change[b];
    largest = std::max(largest, change);
    if (ends(change, largest)) break;
  }
  const int dofs = system_.velocities();
  fit(velocity, std::size_t(dofs) * std::size_t(bodies.count));
  for (std::int64_t b = 0; b < bodies.count; ++b)
    std::copy_n(system_.record[b].x, dofs, &velocity[std::size_t(dofs * b)]);
  system_.load({bodies.velocity, in_.meshes ? &in_.nodes->velocity : nullptr});
  return true;
}

} // namespace cairn
