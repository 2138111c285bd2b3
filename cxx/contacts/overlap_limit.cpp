// Overlap that is taken back by the laws themselves: what a step leaves of a contact's velocity is an overlap for good
// where laws act on velocities alone, and hundreds of steps of one sign leave a radius. Beyond a share of the smaller
// body's size the contact opens, by an eighth of that share in a step at most, so that what came in deep parts
// slowly: a body that nothing presses keeps that speed.
#include "overlap_limit.hpp"

#include <algorithm>
#include <limits>

#include "../contactors/shapes.hpp"
#include "../laws/law_names.hpp"
#include "../solvers/sweeps/batch.hpp"

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

bool OverlapLimit::applies_to(const cairn_batch& b) const {
  return in_.options.overlap_limit < std::numeric_limits<double>::infinity() && !in_.options.pose.kernel &&
         !b.mapped_a && !b.mapped_b && takes_back(Law(b.law));
}

// How much of an overlap is beyond the limit [m].
double OverlapLimit::overlap_beyond(std::int64_t i, double& size) const {
  if (!(in_.candidates->gap[std::size_t(i)] < 0)) return 0;
  const double ra = *in_.contactors->radius[in_.candidates->contactor_a[std::size_t(i)]],
               rb = *in_.contactors->radius[in_.candidates->contactor_b[std::size_t(i)]];
  size = ra > 0 && rb > 0 ? std::min(ra, rb) : std::max(ra, rb);
  return std::max(0.0, -in_.candidates->gap[std::size_t(i)] - in_.options.overlap_limit * size);
}

constexpr double of_limit = 1.0 / 8; // measured: what steps at an error of 1e-3 leave is less

// The speed at which a contact opens [m/s].
double OverlapLimit::speed_at(std::int64_t i) const {
  double size = 0;
  const double beyond = overlap_beyond(i, size);
  return beyond > 0 ? std::min(beyond, of_limit * in_.options.overlap_limit * size) / in_.h : 0;
}

void OverlapLimit::open(const cairn_batch& b, double* bias) const {
  if (!applies_to(b)) return;
  const BatchStorage::LawColumns& own = storage_.columns_of(b);
  for (int lane = 0; lane < b.contacts; ++lane) {
    const double speed = speed_at(system_.candidate[b.first + lane]);
    if (!(speed > 0)) continue;
    bias[lane] -= speed;
    if (own.flight) own.flight[lane] -= speed; // no opening of what the law keeps
  }
}

double OverlapLimit::deepest_drift() const {
  double deepest = 0;
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts && applies_to(b); ++lane) {
      double size = 0;
      if (const double beyond = overlap_beyond(system_.candidate[b.first + lane], size); beyond > 0)
        deepest = std::max(deepest, beyond / size);
    }
  return deepest;
}

// Work of contacts that take back overlap [J], booked apart from created energy. Half of it is done in this step, the
// other half in the next, which begins with the parting speed; all of it is counted here.
void OverlapLimit::count() const {
  for (const cairn_batch& b : system_.batches)
    for (int lane = 0; lane < b.contacts && applies_to(b); ++lane) {
      const double push = at(b, b.r, lane, 0), given = 0.5 * b.scale[lane];
      const double work = push > 0 ? push * speed_at(system_.candidate[b.first + lane]) : 0;
      if (!(work > 0)) continue;
      b.scale[lane] -= 2 * work;
      energy_.parted += work;
      energy_.normal += work;
      energy_.created += std::max(0.0, given - work) - std::max(0.0, given);
      energy_.turned_over += std::abs(given - work) + work - std::abs(given);
    }
}

} // namespace cairn
