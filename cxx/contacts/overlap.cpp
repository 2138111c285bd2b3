// Overlap that is taken back by the laws themselves: what a step leaves of a contact's velocity is an overlap for good
// where laws act on velocities alone, and hundreds of steps of one sign leave a radius. Beyond a share of the smaller
// body's size the contact opens, by an eighth of that share in a step at most, so that what came in deep parts
// slowly: a body that nothing presses keeps that speed.
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

// How much of an overlap is beyond the limit [m].
double Interactions::State::overlap_beyond(std::int64_t i, double& size) const {
  if (!(candidates->gap[std::size_t(i)] < 0)) return 0;
  const double ra = *contactors->radius[candidates->contactor_a[std::size_t(i)]],
               rb = *contactors->radius[candidates->contactor_b[std::size_t(i)]];
  size = ra > 0 && rb > 0 ? std::min(ra, rb) : std::max(ra, rb);
  return std::max(0.0, -candidates->gap[std::size_t(i)] - overlap_limit * size);
}

constexpr double of_limit = 1.0 / 8; // measured: what steps at an error of 1e-3 leave is less

// The speed at which a contact opens [m/s].
double Interactions::State::parting_at(std::int64_t i) const {
  double size = 0;
  const double beyond = overlap_beyond(i, size);
  return beyond > 0 ? std::min(beyond, of_limit * overlap_limit * size) / h : 0;
}

void Interactions::State::part(const cairn_batch& b, double* bias) const {
  if (!limits_overlap(b)) return;
  const LawColumns& own = of_law[std::size_t(&b - system.batches.data())];
  for (int lane = 0; lane < b.contacts; ++lane) {
    const double speed = parting_at(system.candidate[b.first + lane]);
    if (!(speed > 0)) continue;
    bias[lane] -= speed;
    if (own.flight) own.flight[lane] -= speed; // no opening of what the law keeps
  }
}

double Interactions::State::deepest_drift() const {
  double deepest = 0;
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts && limits_overlap(b); ++lane) {
      double size = 0;
      if (const double beyond = overlap_beyond(system.candidate[b.first + lane], size); beyond > 0)
        deepest = std::max(deepest, beyond / size);
    }
  return deepest;
}

// Work of contacts that take back overlap [J], booked apart from created energy. Half of it is done in this step, the
// other half in the next, which begins with the parting speed; all of it is counted here.
void Interactions::State::count_parting() {
  for (const cairn_batch& b : system.batches)
    for (int lane = 0; lane < b.contacts && limits_overlap(b); ++lane) {
      const double push = at(b, b.r, lane, 0), given = 0.5 * b.scale[lane];
      const double work = push > 0 ? push * parting_at(system.candidate[b.first + lane]) : 0;
      if (!(work > 0)) continue;
      b.scale[lane] -= 2 * work;
      energy.parted += work;
      energy.normal += work;
      energy.created += std::max(0.0, given - work) - std::max(0.0, given);
      energy.turned_over += std::abs(given - work) + work - std::abs(given);
    }
}

} // namespace cairn
