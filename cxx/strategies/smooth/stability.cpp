// Critical time step: 2/omega of the stiffest mode, reduced by damping.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "../../base/call.hpp"
#include "lanes.hpp"

namespace cairn {
namespace {

double damped_share(double ratio) { return std::sqrt(1 + ratio * ratio) - ratio; } // Belytschko 1983

} // namespace

// Stiffness over mass of a contact on a body: along the normal, or along the tangent where the spin gives way too, to
// the moments of the law as well.
double SmoothDem::stiffness_over_mass(const Simulation& s, const double k[4], std::int64_t body, double arm) const {
  const Bodies& b = s.scene.bodies;
  const int spins = dim_ == 2 ? 4 : 56;
  const double inverse_mass = held(s, body) ? 0 : b.inverse_mass[body][0];
  const bool turns = !b.driven.active || (*b.driven[body] & spins) != spins;
  const double per_spin = turns ? inverse_inertia(s, body) : 0, spin_gives = arm * arm * per_spin;
  // away from its centre a body gives way to the normal force by its spin, too
  const bool off_centre = has_shaped_ ? body_arm_[body] > 0 : !uneven_.empty();
  return std::max(k[0] * (inverse_mass + (off_centre ? spin_gives : 0)),
                  k[1] * (inverse_mass + spin_gives) + k[3] * per_spin);
}

// Critical time step for a collision of any body with its like, at the overlap of the options; no contact need exist
// [s].
double SmoothDem::pair_limit(const Simulation& s) const {
  const Bodies& b = s.scene.bodies;
  const Contactors& c = s.scene.contactors;
  double limit = std::numeric_limits<double>::infinity();
  std::vector<int> entries_of(s.laws.materials());
  for (std::int64_t i = 0; i < c.count; ++i) {
    const bool shaped = has_shaped_ && *c.hull[i] >= 0;
    const double radius = 0.5 * (shaped ? c.size(std::int32_t(i)) : *c.radius[i]), overlap = settings.overlap * radius;
    if (!(b.inverse_mass[*c.body[i]][0] > 0) || !(radius > 0)) continue;
    const int entry = s.laws.find(*c.material[i], *c.material[i]);
    if (entry < 0) continue;
    double k[4], reach;
    const LawInfo& law = law_infos()[std::size_t(s.laws.entry(entry).law)];
    law.stiffness(1, law.components(dim_), &overlap, &radius, s.laws.entry(entry).params, k, &reach);
    const double rate =
        2 * stiffness_over_mass(s, k, *c.body[i], shaped || !uneven_.empty() ? arm_of(s, i) : 2 * radius);
    if (rate > 0) limit = std::min(limit, 2 / std::sqrt(rate) * damped_share(k[2]));
  }
  return limit * limit_share();
}

// Stability limit of the integrator / that of velocity Verlet, 2/omega.
double SmoothDem::limit_share() const { return settings.integrator.scheme(1).largest / 2; }

// Gershgorin's bound on the contacts as they are, each at least at the overlap of the settings.
double SmoothDem::contact_limit(Simulation& s) {
  if (lanes_.empty()) lanes_.push_back(std::make_unique<Lanes>());
  Lanes& w = *lanes_[0];
  Array<double>& rate = margins_;
  rate.assign(s.scene.bodies.count, 0);
  double damping = 0;
  const auto add = [&](const NeighbourList& list, const NeighbourList::Batch& batch) {
    batch_geometry(s, list, batch, w);
    for (int i = 0; i < batch.count; ++i) {
      w.grain_a[i] = grain_[2 * list.a[batch.first + i]];
      w.grain_b[i] = grain_[2 * list.b[batch.first + i]];
    }
    if (batch.kind < 0) shaped_grains(s, list, batch, w);
    const LawTable::Entry& entry = s.laws.entry(batch.entry);
    const LawInfo& law = law_infos()[std::size_t(entry.law)];
    for (int i = 0; i < batch.count; ++i) {
      if (w.gap[i] >= entries_[batch.entry].reach || w.status[i] == cairn_apart) continue;
      const std::int64_t p = batch.first + i;
      const double radius = 1 / (w.grain_a[i] + w.grain_b[i]);
      const double overlap = std::max(-w.gap[i], settings.overlap * radius);
      double k[4], reach;
      law.stiffness(1, law.components(dim_), &overlap, &radius, entry.params, k, &reach);
      damping = std::max(damping, k[2]);
      for (const std::int32_t body : {list.body_a[p], list.body_b[p]}) {
        const bool first = body == list.body_a[p];
        const double arm =
            uneven_.empty() ? (first ? w.radius_a : w.radius_b)[i] : arm_of(s, (first ? list.a : list.b)[p]);
        rate[body] += stiffness_over_mass(s, k, body, arm);
      }
    }
  };
  each_list([&](NeighbourList& list) {
    for (const NeighbourList::Batch& batch : list.batches) add(list, batch);
  });
  double greatest = 0;
  for (const double r : rate) greatest = std::max(greatest, r);
  const double limit =
      greatest > 0 ? std::sqrt(2 / greatest) * damped_share(damping) : std::numeric_limits<double>::infinity();
  return std::min(limit * limit_share(), pair_limit_);
}

void SmoothDem::refuse_step(double h) const {
  std::ostringstream message;
  message << "dt is " << h << " s, beyond the stable step of " << pair_limit_
          << " s of the lightest body and the stiffest law at an overlap of " << settings.overlap
          << " of its effective radius; give dt below it (a tenth is accurate), softer laws or heavier bodies, or "
             "SmoothDEM(unstable='warn')";
  throw Error(message.str());
}

} // namespace cairn
