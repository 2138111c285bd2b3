// Bonds are made where bodies stand when they come in, before anything moves.
#include <algorithm>
#include <limits>

#include "../strategies/nscd/nscd.hpp"

namespace cairn {
namespace {

constexpr double touch = 1.0 / (1 << 30); // gap / effective radius that positions in doubles cannot tell from 0

// Room for a state and for as many components of impulse as a law with a state has.
void make_room(ContactMemory& m, int impulses) {
  if (m.impulse_components < impulses) {
    std::vector<double> wider(m.keys.size() * impulses, 0.0);
    for (std::size_t k = 0; k < m.keys.size(); ++k)
      std::copy_n(&m.impulses[k * m.impulse_components], m.impulse_components, &wider[k * impulses]);
    m.impulses = std::move(wider);
    m.impulse_components = impulses;
  }
  if (m.state_components == 0) {
    m.states.assign(m.keys.size(), std::numeric_limits<double>::max()); // of contacts that have none
    m.state_components = 1;
  }
}

} // namespace

// Contactors that came in since the last step and touch where they stand; a bond is a state of its contact: the gap it
// had.
void Nscd::make_bonds(Simulation& s) {
  const std::int64_t seen = s.interactions.memory().contactors_seen;
  if (seen >= s.scene.next_contactor_id) return;
  bool bonding = false;
  for (int e = 0; e < s.laws.entries(); ++e) bonding |= s.laws.entry(e).law == Law::bonded;
  ContactMemory m = s.interactions.memory();
  m.contactors_seen = s.scene.next_contactor_id;
  if (bonding) {
    make_room(m, law_infos()[int(Law::bonded)].components(s.scene.dim));
    const Contactors& c = s.scene.contactors;
    margins_.assign(c.count, 0);
    for (std::int64_t k = 0; k < c.count; ++k) margins_[k] = 2 * touch * *c.radius[k];
    Margin margin{};
    margin.per_contactor = margins_.data();
    s.contacts_known = false;
    compute_free_velocity(s); // detection leaves out pairs that nothing moves
    s.scene.bodies.velocity.values = s.scene.bodies.velocity_begin.values;
    s.handler.declared().clear();
    s.handler.detect(s.scene.bodies, c, s.scene.cell, margin, s.candidates, {}, &s.interactions.scratch(),
                     &s.laws.rules());
    for (std::int64_t i = 0; i < s.candidates.count; ++i) {
      const std::int32_t a = s.candidates.contactor_a[i], b = s.candidates.contactor_b[i];
      const int entry = s.laws.find(*c.material[a], *c.material[b]);
      if (entry < 0 || s.laws.entry(entry).law != Law::bonded || std::max(*c.id[a], *c.id[b]) < seen) continue;
      const double ra = *c.radius[a], rb = *c.radius[b];
      if (s.candidates.gap[i] > touch * (ra > 0 && rb > 0 ? ra * rb / (ra + rb) : std::max(ra, rb))) continue;
      m.keys.push_back({*c.id[a], *c.id[b], s.candidates.feature[i], s.candidates.image[i]});
      m.impulses.insert(m.impulses.end(), m.impulse_components, 0.0);
      m.states.push_back(s.candidates.gap[i]);
      m.states.insert(m.states.end(), m.state_components - 1, std::numeric_limits<double>::max());
    }
    s.candidates.count = 0;
  }
  s.interactions.restore(std::move(m));
}

} // namespace cairn
